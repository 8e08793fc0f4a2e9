//! What the name of a function says about it.

use rustc_demangle::demangle;

/// What the tick must not reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Offence {
    Panic,
    Allocation,
    SoftFloat,
    /// A division of 64 bits, or any arithmetic of 128 bits but adding.
    WideArithmetic,
}

impl Offence {
    pub(crate) fn what(self) -> &'static str {
        match self {
            Self::Panic => "can panic",
            Self::Allocation => "allocates",
            Self::SoftFloat => "calculates in floats",
            Self::WideArithmetic => "divides 64 bits or calculates in 128 bits",
        }
    }
}

/// The name as people read it, without the hash. The linker's bridges are told by where they lead.
pub(crate) fn demangled(symbol: &str) -> String {
    match symbol.split_once("ABSLongThunk_") {
        Some((kind, to)) if kind.starts_with("__Thumb") => format!("bridge to {:#}", demangle(to)),
        _ => format!("{:#}", demangle(symbol)),
    }
}

/// Which of a function's symbols to show: a path says more than a routine's name, and that more than a label.
pub(super) fn says_much(symbol: &str) -> u8 {
    match demangled(symbol) {
        name if name.contains("::") => 2,
        name if name.starts_with("__") => 1,
        _ => 0,
    }
}

/// What a function with this symbol would do to the tick; `None` when its name says nothing bad.
pub(crate) fn offence_of(symbol: &str) -> Option<Offence> {
    let name = demangled(symbol);
    if panics(&name) {
        return Some(Offence::Panic);
    }
    if allocates(&name) {
        return Some(Offence::Allocation);
    }
    if is_soft_float(&name) {
        return Some(Offence::SoftFloat);
    }
    is_wide(&name).then_some(Offence::WideArithmetic)
}

/// Routines that stand for one operation of the source and take their time: shown with their callers.
pub(crate) fn is_costly(symbol: &str) -> bool {
    const COSTLY: [&str; 12] = [
        "__aeabi_lmul",
        "__muldi3",
        "__aeabi_llsl",
        "__aeabi_llsr",
        "__aeabi_lasr",
        "__aeabi_idiv",
        "__aeabi_uidiv",
        "__aeabi_idivmod",
        "__aeabi_uidivmod",
        "__aeabi_memcpy",
        "__aeabi_memcpy4",
        "__aeabi_memcpy8",
    ];
    COSTLY.contains(&symbol)
}

fn panics(name: &str) -> bool {
    let ends = ["::unwrap_failed", "::expect_failed", "rust_begin_unwind"];
    let bad_index = name.starts_with("core::") && name.ends_with("_fail");
    name.contains("panic") || bad_index || ends.iter().any(|end| name.ends_with(end))
}

fn allocates(name: &str) -> bool {
    const ROUTINES: [&str; 6] = ["malloc", "calloc", "realloc", "free", "__rg_alloc", "__rg_realloc"];
    let routine = name.rsplit("::").next().unwrap_or(name);
    let in_crate = |start: usize| !name[..start].ends_with([':', '_']) && !ends_in_letter(&name[..start]);
    ROUTINES.contains(&routine)
        || routine.starts_with("__rust_alloc")
        || routine.starts_with("__rust_realloc")
        || routine.starts_with("__rust_dealloc")
        || name.match_indices("alloc::").any(|(start, _)| in_crate(start))
}

fn ends_in_letter(text: &str) -> bool {
    text.ends_with(|last: char| last.is_alphanumeric())
}

fn is_soft_float(name: &str) -> bool {
    let in_library =
        ["compiler_builtins::float::", "compiler_builtins::math::", "libm::", "::f64::", "::f32::"];
    if in_library.iter().any(|path| name.contains(path)) {
        return true;
    }
    if let Some(routine) = name.strip_prefix("__aeabi_") {
        return is_aeabi_float(routine);
    }
    name.strip_prefix("__").is_some_and(is_gnu_float)
}

/// The names of ARM's run-time ABI: `dadd`, `fcmplt`, `cdcmpeq`, `l2d`.
fn is_aeabi_float(routine: &str) -> bool {
    let starts = ["d", "f", "cd", "cf", "h2"];
    starts.iter().any(|start| routine.starts_with(start))
        || routine.ends_with("2d")
        || routine.ends_with("2f")
}

/// The names of GCC's library: `adddf3`, `floatdisf`, `fixunsdfdi`, `gesf2`.
fn is_gnu_float(routine: &str) -> bool {
    const OPERATIONS: [&str; 18] = [
        "add", "sub", "mul", "div", "neg", "eq", "ne", "ge", "gt", "le", "lt", "cmp", "unord", "fix",
        "float", "extend", "trunc", "powi",
    ];
    let has_type = ["hf", "sf", "df", "tf"].iter().any(|kind| routine.contains(kind));
    has_type && OPERATIONS.iter().any(|operation| routine.starts_with(operation))
}

fn is_wide(name: &str) -> bool {
    const DIVISIONS: [&str; 8] = [
        "__aeabi_ldivmod",
        "__aeabi_uldivmod",
        "__divdi3",
        "__udivdi3",
        "__moddi3",
        "__umoddi3",
        "__divmoddi4",
        "__udivmoddi4",
    ];
    let divides = name.contains("specialized_div_rem::u64") || name.contains("specialized_div_rem::u128");
    let is_128 = name.starts_with("__") && (name.ends_with("ti3") || name.ends_with("ti4"));
    DIVISIONS.contains(&name) || divides || is_128
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_a_function_does() {
        let cases = [
            ("_ZN4core9panicking5panic17h0123456789abcdefE", Some(Offence::Panic)),
            ("_ZN4core6option13unwrap_failed17h0123456789abcdefE", Some(Offence::Panic)),
            ("_RNvNtNtCsgEmfK2I1SDS_4core5slice5index16slice_index_fail", Some(Offence::Panic)),
            ("_RNvCsfLfy6EI15iL_7___rustc17rust_begin_unwind", Some(Offence::Panic)),
            ("_RNvCsfLfy6EI15iL_7___rustc12___rust_alloc", Some(Offence::Allocation)),
            ("__rust_dealloc", Some(Offence::Allocation)),
            ("_ZN5alloc7raw_vec12handle_error17h0123456789abcdefE", Some(Offence::Allocation)),
            (
                "_ZN67_$LT$alloc..vec..Vec$LT$T$C$A$GT$$u20$as$u20$core..clone..Clone$GT$5clone17h14dc4d4a7dd41a6aE",
                Some(Offence::Allocation),
            ),
            ("_ZN4core5alloc6layout6Layout4make17h0123456789abcdefE", None),
            ("_ZN10my_alloc_x6dalloc4make17h0123456789abcdefE", None),
            ("_ZN4libm4math4ceil4ceil17h0123456789abcdefE", Some(Offence::SoftFloat)),
            ("_ZN17compiler_builtins5float3add8__adddf317h0123456789abcdefE", Some(Offence::SoftFloat)),
            ("_ZN9abbe_core5servo14IncrementalPid4tick17h0123456789abcdefE", None),
            (
                "_RNvNtNtCsjc7sn2q0iDy_17compiler_builtins3int19specialized_div_rem11u64_div_rem",
                Some(Offence::WideArithmetic),
            ),
            ("_RNvNtNtCsjc7sn2q0iDy_17compiler_builtins3int19specialized_div_rem11u32_div_rem", None),
        ];
        for (symbol, expected) in cases {
            assert_eq!(offence_of(symbol), expected, "{}", demangled(symbol));
        }
    }

    #[test]
    fn a_bridge_is_told_by_where_it_leads() {
        let symbol = "__Thumbv6MABSLongThunk__ZN4tick4tick17h9b533650bf6aebf5E";
        assert_eq!(demangled(symbol), "bridge to tick::tick");
    }

    #[test]
    fn routines_of_both_run_time_libraries_are_told_apart() {
        let floats = "__aeabi_dadd __aeabi_fcmplt __aeabi_cdcmpeq __aeabi_cfrcmple __aeabi_i2d __aeabi_ui2f __aeabi_l2d \
            __aeabi_ul2f __aeabi_d2lz __aeabi_f2uiz __aeabi_h2f __adddf3 __subsf3 __muldf3 __divsf3 __gedf2 __unordsf2 \
            __floatsidf __floatundisf __fixunsdfdi __fixsfti __extendsfdf2 __truncdfsf2 __powidf2 __negdf2 __extendhfsf2";
        for name in floats.split_whitespace() {
            assert_eq!(offence_of(name), Some(Offence::SoftFloat), "{name}");
        }
        let wide = "__aeabi_ldivmod __aeabi_uldivmod __udivdi3 __moddi3 __udivmoddi4 __multi3 __udivti3 __udivmodti4 \
            __muloti4 __ashlti3";
        for name in wide.split_whitespace() {
            assert_eq!(offence_of(name), Some(Offence::WideArithmetic), "{name}");
        }
        let harmless = "__aeabi_lmul __aeabi_llsl __aeabi_lasr __aeabi_idiv __aeabi_uidivmod __aeabi_memcpy4 __muldi3 \
            __aeabi_memclr memset _start __clzsi2 __ashldi3";
        for name in harmless.split_whitespace() {
            assert_eq!(offence_of(name), None, "{name}");
        }
        assert!(is_costly("__aeabi_lmul") && is_costly("__aeabi_uidiv") && !is_costly("__aeabi_memclr"));
    }
}
