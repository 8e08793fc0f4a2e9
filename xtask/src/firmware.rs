//! `cargo xtask firmware`: builds every image for a board and judges it by its machine code.
//!
//! What must run in every tick is followed from its entry through all calls: it must not panic, allocate, calculate in
//! floats, divide 64 bits, call through a register, or use a stack without a bound.

mod report;

pub(crate) use report::Form;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Mutex;

use anyhow::{Context, Result};

use crate::commands::stdout_of;
use crate::compiler::{self, Route, THUMB_V6M};
use crate::image::{Graph, Image, Stack};
use crate::stage::{Outcome, Setting};

const KIB: u64 = 1024;

/// An image for a board: a row of [`IMAGES`].
pub(crate) struct Row {
    /// Name of the program, and of the image.
    pub(crate) name: &'static str,
    /// Its folder under `firmware/`.
    pub(crate) folder: &'static str,
    pub(crate) target: &'static str,
    /// What runs in every tick or holds it up.
    pub(crate) entries: &'static [Entry],
    /// Functions that may call through a register, each with the reason.
    pub(crate) may_call_indirectly: &'static [(&'static str, &'static str)],
    pub(crate) limits: Limits,
}

/// Where the judging of a tick begins: a function, by its symbol or its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Entry {
    Call(&'static str),
    /// The processor calls it, and pushes a frame first.
    Interrupt(&'static str),
}

/// What an image may use, bytes.
pub(crate) struct Limits {
    pub(crate) flash: u64,
    pub(crate) ram: u64,
    /// From an entry down.
    pub(crate) stack: u32,
}

/// Flash and RAM leave room on the smallest board (2 MiB, 264 KiB); the stack is that of the tick's core.
const LIMITS: Limits = Limits { flash: 256 * KIB, ram: 128 * KIB, stack: 4096 };

/// Every image. A row whose folder does not exist yet is left out.
pub(crate) const IMAGES: &[Row] = &[
    Row {
        name: "tick",
        folder: "gate",
        target: THUMB_V6M,
        entries: &[
            Entry::Call("tick::tick"),
            Entry::Call("tick::command"),
            Entry::Call("tick::status"),
            Entry::Call("tick::wanted_plan"),
            Entry::Call("tick::take_plan"),
        ],
        may_call_indirectly: &[],
        limits: LIMITS,
    },
    Row {
        name: "abbe-pico",
        folder: "pico",
        target: THUMB_V6M,
        entries: &[
            Entry::Call("abbe_core::controller::Controller<_>::tick"),
            Entry::Interrupt("TIMER_IRQ_1"),
        ],
        may_call_indirectly: &[],
        limits: LIMITS,
    },
];

/// Functions of `firmware/gate` that do what must not be done, and the words in which that must be found.
const OFFENDERS: &[(&str, &str)] = &[
    ("known_panic", "can panic"),
    ("known_float", "calculates in floats"),
    ("known_division", "divides 64 bits"),
    ("known_128_bits", "calculates in 128 bits"),
    ("known_allocation", "allocates"),
    ("known_indirect_call", "an indirect call"),
    ("known_recursion", "recursion"),
    ("known_trap", "ends in a trap"),
    ("known_large_frame", "bytes of stack"),
];
const OFFENDERS_ROW: Row = Row {
    name: "offenders",
    folder: "gate",
    target: THUMB_V6M,
    entries: &[],
    may_call_indirectly: &[],
    limits: LIMITS,
};

/// What was found of an image.
pub(crate) struct Verdict {
    row: &'static Row,
    flash: u64,
    ram: u64,
    entries: Vec<EntryVerdict>,
    /// Costly routines with their callers; they do not fail.
    costly: BTreeMap<String, BTreeSet<String>>,
    /// A sentence for each thing that is wrong.
    findings: Vec<String>,
}

/// What was found from one entry.
struct EntryVerdict {
    entry: Entry,
    functions: usize,
    stack: Stack,
}

/// The stage of `cargo xtask test`.
pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let Some(route) = find_route(setting) else {
        return Ok(compiler::not_possible(&targets(setting)));
    };
    println!("compiling with {}", route.name());
    let verdicts = judge_all(setting, route)?;
    print!("{}", report::table(&verdicts));
    let mut findings: Vec<String> = verdicts.into_iter().flat_map(|verdict| verdict.findings).collect();
    findings.extend(missed_offenders(setting, route)?);
    Ok(Outcome::of_findings(findings))
}

/// The chore; true when all is well.
///
/// # Errors
/// There is no compiler, or an image does not build or cannot be read.
pub(crate) fn run(setting: &Setting, form: Form) -> Result<bool> {
    let targets = targets(setting);
    let route = find_route(setting).with_context(|| compiler::missing(&targets))?;
    eprintln!("compiling with {}", route.name());
    let verdicts = judge_all(setting, route)?;
    let missed = missed_offenders(setting, route)?;
    println!("{}", form.of(&verdicts, route, &missed));
    Ok(missed.is_empty() && verdicts.iter().all(|verdict| verdict.findings.is_empty()))
}

/// A route that compiles for every image.
pub(crate) fn find_route(setting: &Setting) -> Option<Route> {
    compiler::find_route(setting, &targets(setting))
}

fn rows(setting: &Setting) -> impl Iterator<Item = &'static Row> {
    let firmware = setting.root.join("firmware");
    IMAGES.iter().filter(move |row| firmware.join(row.folder).join("Cargo.toml").exists())
}

fn targets(setting: &Setting) -> Vec<&'static str> {
    let targets: BTreeSet<&str> = rows(setting).map(|row| row.target).collect();
    targets.into_iter().collect()
}

/// How a program for a board is built.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Build {
    /// Its folder under `firmware/`.
    pub(crate) folder: &'static str,
    pub(crate) name: &'static str,
    pub(crate) target: &'static str,
    /// The same whenever it is built for this target.
    pub(crate) features: &'static [&'static str],
}

/// The ELF file of an image, built unless this run has built it already.
///
/// # Errors
/// It does not build; the compiler's words are on the terminal.
pub(crate) fn elf_file(setting: &Setting, route: Route, row: &Row) -> Result<PathBuf> {
    let build = Build { folder: row.folder, name: row.name, target: row.target, features: &[] };
    built(setting, route, &build)
}

/// The ELF file of a program for a board, built unless this run has built it already.
///
/// # Errors
/// It does not build; the compiler's words are on the terminal.
pub(crate) fn built(setting: &Setting, route: Route, build: &Build) -> Result<PathBuf> {
    static BUILT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let folder = setting.root.join("firmware").join(build.folder);
    let target_folder = route.target_folder(&folder);
    let file = target_folder.join(build.target).join("release").join(build.name);
    let mut built = BUILT.lock().ok().context("an earlier build of an image ended in a panic")?;
    if !built.contains(&file) {
        let mut command = route.cargo(&folder);
        command.args(["build", "--release", "--bin", build.name, "--target", build.target]);
        command.args(["--features", &build.features.join(",")]);
        stdout_of(command.arg("--target-dir").arg(target_folder))
            .with_context(|| format!("the image {} does not build", build.name))?;
        built.insert(file.clone());
    }
    Ok(file)
}

fn judge_all(setting: &Setting, route: Route) -> Result<Vec<Verdict>> {
    rows(setting).map(|row| judge(row, &Image::read(&elf_file(setting, route, row)?)?)).collect()
}

fn judge(row: &'static Row, image: &Image) -> Result<Verdict> {
    let mut verdict = Verdict {
        row,
        flash: image.flash,
        ram: image.ram,
        entries: Vec::new(),
        costly: BTreeMap::new(),
        findings: findings_of_memory(row, image.flash, image.ram),
    };
    for entry in row.entries {
        verdict.judge_entry(*entry, image).with_context(|| format!("image {}", row.name))?;
    }
    Ok(verdict)
}

fn findings_of_memory(row: &Row, flash: u64, ram: u64) -> Vec<String> {
    let over = |what: &str, is: u64, limit: u64| {
        (is > limit).then(|| format!("{}: {is} bytes of {what}, the limit is {limit}", row.name))
    };
    let (flash, ram) = (over("flash", flash, row.limits.flash), over("RAM", ram, row.limits.ram));
    flash.into_iter().chain(ram).collect()
}

impl Entry {
    fn name(self) -> &'static str {
        match self {
            Self::Call(name) | Self::Interrupt(name) => name,
        }
    }

    /// Worst case of the stack from here down.
    fn stack(self, graph: &Graph<'_>) -> Stack {
        /// Eight registers, and a word to come to a multiple of eight bytes.
        const PUSHED: u32 = 36;
        match (self, graph.stack()) {
            (Self::Interrupt(_), Stack::Bounded { bytes, mut chain }) => {
                chain.insert(0, format!("interrupt ({PUSHED})"));
                Stack::Bounded { bytes: bytes + PUSHED, chain }
            }
            (_, stack) => stack,
        }
    }
}

impl Verdict {
    fn judge_entry(&mut self, entry: Entry, image: &Image) -> Result<()> {
        let graph = Graph::from(image, image.function_named(entry.name())?);
        let found = findings_of_entry(self.row, entry, &graph);
        self.findings.extend(found.into_iter().map(|finding| format!("{}: {finding}", self.row.name)));
        for (routine, callers) in graph.costly() {
            self.costly.entry(routine).or_default().extend(callers);
        }
        let functions = graph.reachable().count();
        self.entries.push(EntryVerdict { entry, functions, stack: entry.stack(&graph) });
        Ok(())
    }
}

fn findings_of_entry(row: &Row, entry: Entry, graph: &Graph<'_>) -> Vec<String> {
    let allowed: Vec<&str> = row.may_call_indirectly.iter().map(|(function, _)| *function).collect();
    let mut findings = graph.offences(&allowed);
    match entry.stack(graph) {
        Stack::Bounded { bytes, chain } if bytes > row.limits.stack => {
            let (name, limit, chain) = (entry.name(), row.limits.stack, chain.join(" → "));
            findings.push(format!("{name} may use {bytes} bytes of stack, the limit is {limit}: {chain}"));
        }
        Stack::Recursion(circle) => findings.push(format!("recursion: {}", circle.join(" → "))),
        // What is unknown is among the offences, or allowed.
        Stack::Bounded { .. } | Stack::Unknown(_) => {}
    }
    findings
}

/// The offenders that are not found: as many reasons not to believe what was judged clean.
fn missed_offenders(setting: &Setting, route: Route) -> Result<Vec<String>> {
    let image = Image::read(&elf_file(setting, route, &OFFENDERS_ROW)?)?;
    let mut missed = Vec::new();
    for (name, words) in OFFENDERS {
        let graph = Graph::from(&image, image.function_named(name)?);
        let findings = findings_of_entry(&OFFENDERS_ROW, Entry::Call(name), &graph);
        if !findings.iter().any(|finding| finding.contains(words)) {
            missed.push(format!("{name} of firmware/gate is not found by its gate: the gate proves nothing"));
        }
    }
    Ok(missed)
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    fn verdict(findings: &[&str]) -> Verdict {
        let chain = vec!["tick::tick (592)".to_owned()];
        Verdict {
            row: &IMAGES[0],
            flash: 22_790,
            ram: 12,
            entries: vec![EntryVerdict {
                entry: IMAGES[0].entries[0],
                functions: 21,
                stack: Stack::Bounded { bytes: 592, chain },
            }],
            costly: BTreeMap::new(),
            findings: findings.iter().map(|&finding| finding.to_owned()).collect(),
        }
    }

    #[test]
    fn memory_is_over_the_limit_beyond_it_and_not_at_it() {
        assert_eq!(findings_of_memory(&IMAGES[0], LIMITS.flash, LIMITS.ram), [""; 0]);
        let found = findings_of_memory(&IMAGES[0], LIMITS.flash + 1, LIMITS.ram + 1);
        assert_eq!(
            found,
            [
                "tick: 262145 bytes of flash, the limit is 262144",
                "tick: 131073 bytes of RAM, the limit is 131072"
            ]
        );
    }

    #[test]
    fn the_report_passes_only_without_findings() {
        let report = |verdict, missed: &[String]| -> Value {
            serde_json::from_str(&Form::Json.of(&[verdict], Route::Rustup, missed)).unwrap()
        };
        let good = report(verdict(&[]), &[]);
        assert_eq!((&good["passed"], &good["images"][0]["flash_bytes"]), (&true.into(), &22_790.into()));
        assert_eq!(good["images"][0]["entries"][0]["stack_bytes"], 592);
        assert_eq!(report(verdict(&["tick: can panic: a → b"]), &[])["passed"], false);
        assert_eq!(report(verdict(&[]), &["known_panic is not found".into()])["passed"], false);
        let text = Form::Table.of(&[verdict(&["tick: can panic: a → b"])], Route::Rustup, &[]);
        assert!(text.ends_with("findings: 1\n  tick: can panic: a → b"), "{text}");
    }
}
