//! Plans from state to state, beside those of another planner: how many fail in which unit, how long the motions last, how
//! long the planning takes.
//!
//! `cargo run --release -p abbe-core --example transfer_trials -- 1000000`
//!
//! The argument is the number of plans of each row. States, limits and durations are the same on every machine.

mod cases;
mod costs;
mod other;

use abbe_core::plan::transfer::{State, Transfer, together};
use cases::{Case, Ends};
use other::Other;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::process::ExitCode;

/// A tick, seconds.
const TICK_S: f64 = 1e-4;
/// Units in which somebody might think, and how many are in a picometre.
const UNITS: [(&str, f64); 4] = [("pm", 1.0), ("nm", 1e-3), ("µm", 1e-6), ("mm", 1e-9)];

fn main() -> ExitCode {
    let argument = std::env::args().nth(1).unwrap_or_else(|| "100000".into());
    let Ok(plans) = argument.parse() else {
        eprintln!("{argument} is not a number of plans");
        return ExitCode::FAILURE;
    };
    // Costs are of the machine, but no machine may make the ratio larger than one.
    let good = print_fails(plans) & print_durations(plans) & costs::print(plans);
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// From any state to any other; units of length and seconds.
fn print_fails(plans: u32) -> bool {
    println!(
        "| unit, with seconds | plans | fail | end off by, part of the way | rsruckig fails |\n|---|---:|---:|---:|---:|"
    );
    let mut good = true;
    for (name, unit) in UNITS {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let mut other = Other::<1>::new();
        let (mut fails, mut fails_of_other, mut worst) = (0, 0, 0.0_f64);
        for _ in 0..plans {
            let case = Case::random(&mut random, 1.0, Ends::Any).in_units(unit, TICK_S);
            match Transfer::fastest(case.from, case.to, &case.limits).map(|transfer| off(&transfer, &case)) {
                Ok(off) if off < 1e-9 => worst = worst.max(off),
                _ => fails += 1,
            }
            other.set(&[case]);
            fails_of_other += u32::from(other.plan().is_none());
        }
        good &= fails == 0;
        let percent = 100.0 * f64::from(fails_of_other) / f64::from(plans);
        println!("| {name} | {plans} | {fails} | {worst:.1e} | {percent:.1} % |");
    }
    println!();
    good
}

/// By how much the sums of the phases miss the end, part of the way at full speed.
fn off(transfer: &Transfer, case: &Case) -> f64 {
    let end =
        transfer.phases().iter().fold(case.from, |state: State, phase| state.after(phase.ticks, phase.jerk));
    let way = (case.to.position - case.from.position).abs() + transfer.ticks() * case.limits.speed;
    if way > 0.0 { (end.position - case.to.position).abs() / way } else { 0.0 }
}

/// In metres and seconds, with which the other one does not fail.
fn print_durations(plans: u32) -> bool {
    println!(
        "| axes | ends | plans compared | longer by more than a thousandth | share | longest, part of rsruckig's | shortest |\n|---|---|---:|---:|---:|---:|---:|"
    );
    let mut good = true;
    for ends in [Ends::AtRest, Ends::FromMotion, Ends::Any] {
        good &= ratios::<1>(plans, ends, "1", |[case], _| Some(plan_one(&case)?.ticks()));
        good &= ratios::<2>(plans, ends, "2", |cases, _| plan_two(&cases));
    }
    // What two axes ask of one, but more often than they meet the times that cannot be met.
    let mut random = Pcg64Mcg::seed_from_u64(4);
    good &= ratios::<1>(plans, Ends::Any, "1, up to half as long again", |[case], other| {
        let fastest = plan_one(&case)?;
        let wanted = fastest.ticks() * random.random_range(1.0..1.5);
        other.last(wanted);
        Some(fastest.lasting(&case.limits, wanted).ok()?.ticks())
    });
    println!();
    good
}

fn plan_one(case: &Case) -> Option<Transfer> {
    Transfer::fastest(case.from, case.to, &case.limits).ok()
}

fn plan_two(cases: &[Case; 2]) -> Option<f64> {
    let motions = together(&cases.map(|c| c.from), &cases.map(|c| c.to), &cases.map(|c| c.limits)).ok()?;
    Some(motions.iter().fold(0.0, |longest, motion| motion.ticks().max(longest)))
}

/// The durations of the plans for a number of axes; planning may tell the other planner how long it is to take.
fn ratios<const N: usize>(
    plans: u32,
    ends: Ends,
    axes: &str,
    mut plan: impl FnMut([Case; N], &mut Other<N>) -> Option<f64>,
) -> bool {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let mut other = Other::<N>::new();
    let (mut compared, mut longer, mut longest, mut shortest) = (0, 0, 0.0_f64, f64::INFINITY);
    for _ in 0..plans {
        let cases = [(); N].map(|()| Case::random(&mut random, 1.0, ends).in_units(1e-12, TICK_S));
        other.set(&cases);
        let (Some(ours), Some(theirs)) = (plan(cases, &mut other), other.plan()) else { continue };
        let ratio = if ours == theirs { 1.0 } else { ours / theirs };
        if ratio.is_nan() {
            continue;
        }
        compared += 1;
        longer += u32::from(ratio > 1.001);
        (longest, shortest) = (longest.max(ratio), shortest.min(ratio));
    }
    let share = 100.0 * f64::from(longer) / f64::from(compared.max(1));
    println!(
        "| {axes} | {} | {compared} | {longer} | {share:.4} % | {longest:.12} | {shortest:.12} |",
        ends.name()
    );
    // Shorter than the soonest would be beyond a limit.
    longer == 0 && compared * 10 > plans * 9 && shortest > 1.0 - 1e-9
}
