//! What plans of two axes that arrive together cost.

use super::cases::{Case, Ends};
use super::other::Other;
use super::{TICK_S, plan_two};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::hint::black_box;
use std::time::Instant;

/// Both planners take turns: whatever else the machine does then slows both.
const BLOCKS: usize = 21;

/// Whether the other planner is nowhere faster.
pub(crate) fn print(plans: u32) -> bool {
    println!(
        "| two axes, medians of {BLOCKS} blocks | ns a plan | rsruckig, ns a plan | ratio | lowest ratio of a block | highest |\n|---|---:|---:|---:|---:|---:|"
    );
    let mut good = true;
    for ends in [Ends::AtRest, Ends::FromMotion, Ends::Any] {
        let blocks = measured(plans.clamp(1, 10_000), ends);
        let [ours, theirs] = [0, 1].map(|of| median(blocks.iter().map(|block| block[of]).collect()));
        let ratios = blocks.iter().map(|[ours, theirs]| ours / theirs);
        let (lowest, highest) =
            ratios.fold((f64::INFINITY, 0.0_f64), |(low, high), ratio| (low.min(ratio), high.max(ratio)));
        let ratio = ours / theirs;
        println!("| {} | {ours:.0} | {theirs:.0} | {ratio:.2} | {lowest:.2} | {highest:.2} |", ends.name());
        good &= ratio <= 1.0;
    }
    good
}

/// Ours and theirs of each block, ns for each plan.
fn measured(plans: u32, ends: Ends) -> Vec<[f64; 2]> {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let cases: Vec<[Case; 2]> =
        (0..plans).map(|_| [(); 2].map(|()| Case::random(&mut random, 1.0, ends))).collect();
    // With which it does not fail.
    let in_metres: Vec<[Case; 2]> =
        cases.iter().map(|two| two.map(|case| case.in_units(1e-12, TICK_S))).collect();
    let mut other = Other::<2>::new();
    let mut block = || {
        let ours = for_each(&cases, |cases| {
            black_box(plan_two(black_box(cases)));
        });
        let theirs = for_each(&in_metres, |cases| {
            other.set(black_box(cases));
            black_box(other.plan());
        });
        [ours, theirs]
    };
    // Caches and clocks warm up first.
    block();
    (0..BLOCKS).map(|_| block()).collect()
}

fn for_each(cases: &[[Case; 2]], plan: impl FnMut(&[Case; 2])) -> f64 {
    let began = Instant::now();
    cases.iter().for_each(plan);
    began.elapsed().as_secs_f64() * 1e9 / cases.len() as f64
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}
