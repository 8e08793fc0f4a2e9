//! What can happen to an analogue encoder, how soon it is told, and how wrong the position is until then:
//! `encoder_faults [SEEDS]`, 20 if not said. Ends with 1 if a row is not as it states.
//!
//! The stage's gratings, heads, comparators, converters and counters are the twin's (preset `litho-120`), the reading is
//! core's. Each seed draws its axis, its grating, its motion up to 5 mm/s with reversals, its moment, and whatever a row
//! states as a range. A second table asks the whole controller what a head cannot tell alone.

mod bench;
mod cases;
pub(crate) mod closed;

use abbe_core::sense::health::{Findings, SignalFault};
use bench::{Bench, LEARNS, Seen, Stage, TICK_HZ, both_cores};
use cases::{CASES, Case, Told};
use std::process::ExitCode;

const PRESET: &str = include_str!("../../../../presets/litho-120.toml");
/// Nothing is waited for longer, ticks.
const LONGEST: u32 = 40_000;
/// What need not be told is watched for so long, ticks.
const WATCHED: u32 = 10_000;
/// Farther off than this, the position is in another period, µm: half of one.
const HALF_A_PERIOD_UM: f64 = 0.4;
/// Ticks after learning in which the block that was graded before it is still shown.
const GRADED: u32 = 300;

/// A stage that homes first takes longer: one seed of so many.
const CLOSED: u32 = 5;

/// What the seeds of a case came to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    seeds: u32,
    /// From the danger on until it was told, ms; below zero: before.
    median_ms: f64,
    longest_ms: f64,
    /// Until then the position was off by so much, µm, at most.
    worst_um: f64,
    unnoticed: u32,
    /// Seeds in which the position was half a period off or more when it was told.
    a_period_off: u32,
    /// Something else was told, or something was told before it happened.
    wrong: u32,
}

/// What can go wrong with noticing.
enum Wrong {
    Unnoticed { worst_um: f64 },
    Other(Option<SignalFault>, Findings),
}

/// One seed: from the danger on so many ticks until it was told, and how far off the position was until then at most and
/// when it was told, µm.
fn run(case: &Case, stage: &Stage, seed: u32) -> Result<(i64, [f64; 2]), Wrong> {
    let mut bench = Bench::new(stage, seed, case.counted);
    let begins = bench.moment();
    for tick in 0..begins {
        let seen = bench.tick(tick);
        // Until it has learned, its offsets are findings, and rightly.
        if seen.fault.is_some() || (tick > LEARNS + GRADED && seen.findings != Findings::NONE) {
            return Err(Wrong::Other(seen.fault, seen.findings));
        }
    }
    bench.happen(case.what);
    let never = case.told.is_nothing();
    let (mut worst_um, mut danger) = (0.0_f64, None);
    for tick in begins..begins + if never { WATCHED } else { LONGEST } {
        let seen = bench.tick(tick);
        worst_um = worst_um.max(seen.off_um);
        if danger.is_none() && bench.is_in_danger(case.danger, &seen) {
            danger = Some(tick);
        }
        if is_told(&case.told, &seen) {
            let since = danger.map_or(0, |danger| i64::from(tick - danger) + 1);
            return Ok((since, [worst_um, seen.off_um]));
        }
        if seen.fault.is_some() || (never && seen.findings != Findings::NONE) {
            return Err(Wrong::Other(seen.fault, seen.findings));
        }
    }
    if never { Ok((0, [worst_um, 0.0])) } else { Err(Wrong::Unnoticed { worst_um }) }
}

fn is_told(told: &Told, seen: &Seen) -> bool {
    seen.fault.is_some_and(|fault| told.faults.contains(&fault)) || seen.findings.0 & told.findings.0 != 0
}

/// All seeds of each case, one case after the other.
pub(crate) fn table(seeds: u32) -> impl Iterator<Item = (&'static Case, Tally)> {
    let stage = Stage::read(PRESET);
    CASES.iter().map(move |case| (case, tally(case, &stage, seeds)))
}

fn tally(case: &Case, stage: &Stage, seeds: u32) -> Tally {
    let mut ticks = Vec::new();
    let mut tally = Tally { seeds, ..Tally::default() };
    for (seed, found) in both_cores(seeds, |seed| run(case, stage, seed)) {
        match found {
            Ok((since, [worst_um, told_um])) => {
                ticks.push(since);
                tally.worst_um = tally.worst_um.max(worst_um);
                tally.a_period_off += u32::from(told_um > HALF_A_PERIOD_UM);
            }
            Err(Wrong::Unnoticed { worst_um }) => {
                tally.unnoticed += 1;
                tally.worst_um = tally.worst_um.max(worst_um);
            }
            Err(Wrong::Other(fault, findings)) => {
                tally.wrong += 1;
                eprintln!("{}, seed {seed}: {fault:?}, {findings}", case.name);
            }
        }
    }
    ticks.sort_unstable();
    let ms = |ticks: Option<&i64>| ticks.map_or(0.0, |ticks| *ticks as f64 * 1e3 / TICK_HZ);
    tally.median_ms = ms(ticks.get(ticks.len() / 2));
    tally.longest_ms = ms(ticks.last());
    tally
}

/// What a row does not hold of what it states.
pub(crate) fn broken(case: &Case, tally: &Tally) -> Option<String> {
    let holds = tally.unnoticed == 0
        && tally.wrong == 0
        && tally.longest_ms <= case.within_ms
        && tally.worst_um <= case.within_um;
    (!holds).then(|| {
        format!("{}: {tally:?}, not within {} ms and {} µm", case.name, case.within_ms, case.within_um)
    })
}

fn main() -> ExitCode {
    let asked = std::env::args().nth(1).unwrap_or_else(|| "20".into());
    let Ok(seeds) = asked.parse::<u32>() else {
        eprintln!("encoder_faults: {asked} is not a number of seeds");
        return ExitCode::from(2);
    };
    println!(
        "| what happens | told by | danger from | told after, ms: median … longest | at most | position off, µm | at most | a period off | unnoticed | wrong |"
    );
    println!("|---|---|---|---:|---:|---:|---:|---:|---:|---:|");
    let mut bad = 0;
    for (case, t) in table(seeds) {
        println!(
            "| {} | {} | {} | {:.1} … {:.1} | {} | {:.3} | {} | {} | {} of {} | {} |",
            case.name,
            case.told.words(),
            case.danger.words(),
            t.median_ms,
            t.longest_ms,
            case.within_ms,
            t.worst_um,
            case.within_um,
            t.a_period_off,
            t.unnoticed,
            t.seeds,
            t.wrong
        );
        if let Some(broken) = broken(case, &t) {
            eprintln!("{broken}");
            bad += 1;
        }
    }
    println!("\n{}", closed::HEAD);
    for (row, t) in closed::table(seeds.div_ceil(CLOSED)) {
        println!("{}", closed::line(row, &t));
        if let Some(broken) = closed::broken(row, &t) {
            eprintln!("{broken}");
            bad += 1;
        }
    }
    ExitCode::from(u8::from(bad != 0))
}
