//! Whatever a program holds, it is gone through, and what is said of it holds together.

use super::checked;
use crate::program::check::{Checked, MOST};
use proptest::prelude::*;

/// A number, now and then as small or as large as any that is read.
fn number() -> impl Strategy<Value = String> {
    prop_oneof![
        6 => (-50.0..150.0_f64).prop_map(|n| format!("{n:.3}")),
        2 => (0..40_u32).prop_map(|n| n.to_string()),
        1 => (-3..4_i64).prop_map(|n| format!("{:.9}", n as f64 * 1e-9)),
        1 => (-100_000..100_000_i32).prop_map(|n| n.to_string()),
        1 => "[0-9.]{1,12}",
    ]
}

/// A line that mostly means something.
fn line() -> impl Strategy<Value = String> {
    let xy = || (number(), number());
    let word = prop::sample::select(vec![
        "G0",
        "G1 F600",
        "G90",
        "G91",
        "G20",
        "G21",
        "G93 F5",
        "G94",
        "G28",
        "G30.1",
        "G92 X1",
        "G55",
        "G10 L20 P2 X5",
        "M0",
        "/G0",
        "G64 P0.1",
        "",
        "%",
        "(",
        "M30",
    ]);
    prop_oneof![
        4 => (word, xy()).prop_map(|(word, (x, y))| format!("{word} X{x} Y{y}")),
        3 => (any::<bool>(), xy(), number(), number())
            .prop_map(|(left, (x, y), i, j)| format!("G{} X{x} Y{y} I{i} J{j} F1", 2 + u8::from(left))),
        3 => (any::<bool>(), number(), number()).prop_map(|(left, i, j)| format!("G{} I{i} J{j} F9", 2 + u8::from(left))),
        3 => (any::<bool>(), xy(), number())
            .prop_map(|(left, (x, y), r)| format!("G{} X{x} Y{y} R{r} F9", 2 + u8::from(left))),
        3 => (number(), number(), 0..360_u32).prop_map(|(way, p, q)| format!("G91 G5.5 X{way} P{p} L{way} Q{q} F1")),
        1 => "[ -~]{0,20}",
    ]
}

fn holds_together(checked: &Checked) {
    assert!(checked.errors.len() as u64 <= checked.count && checked.errors.len() <= MOST);
    assert_eq!(checked.count == 0, checked.errors.is_empty());
    assert!(checked.errors.is_sorted_by_key(|found| found.line));
    let all = checked.summary.all();
    assert!(all.length_mm.is_finite() && all.length_mm >= 0.0, "{all:?}");
    assert_eq!(checked.summary.extents.is_some(), all.count > 0);
    for [low, high] in checked.summary.extents.into_iter().flatten() {
        assert!(low <= high);
        if checked.count == 0 {
            assert!(low.mm() >= 0.0 && high.mm() <= 100.0, "{low:?} {high:?}");
        }
    }
    for feed in &checked.feeds.limited {
        assert!(feed.limit_mm_s >= 20.0 - 1e-9 && feed.limit_mm_s < feed.feed_mm_s, "{feed:?}");
    }
    for found in &checked.errors {
        let said = found.to_string();
        assert!(said.len() < 300 && said.contains("; ") && !said.contains("NaN"), "{said}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn lines_are_gone_through(lines in proptest::collection::vec(line(), 0..12)) {
        holds_together(&checked(lines.join("\n").as_bytes()));
    }

    /// One motion, so that what is refused does not hide the rest.
    #[test]
    fn single_lines_are_gone_through(line in line()) {
        holds_together(&checked(line.as_bytes()));
    }

    #[test]
    fn bytes_are_gone_through(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
        holds_together(&checked(&bytes[..]));
    }
}
