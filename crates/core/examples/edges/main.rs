//! No lost count: so many edges of a 0.8 µm grating (0.2 µm a 4× count) through the counter, at two speeds.
//!
//! `cargo run --release -p abbe-core --example edges -- 1000000000`
//!
//! The argument is the number of edges at each speed. Edges come early or late, comparators chatter, noise puts pulses
//! on both channels, and the stage turns at every phase. The same number gives the same table on every machine.

mod line;

use abbe_core::front::filter_for;
use line::{Line, Tally};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Instant;

/// Paper B's grating interferometer.
const COUNT_UM: f64 = 0.2;
/// Paper B's fastest, and ten times that.
const SPEEDS_MM_S: [u32; 2] = [5, 50];
/// Pulses shorter than this are noise.
const PULSE_NS: u32 = 100;
/// Edges of a run with a seed of its own.
const PART: u64 = 1 << 22;

fn main() -> ExitCode {
    let argument = std::env::args().nth(1).unwrap_or_else(|| "100000000".into());
    let Ok(edges) = argument.parse() else {
        eprintln!("{argument} is not a number of edges");
        return ExitCode::FAILURE;
    };
    let filter = filter_for(PULSE_NS).expect("100 ns are within the filter's range");
    println!(
        "| speed, mm/s | edges | turns at phase 0, 1, 2, 3: to forward | to backward | bounces | noise pulses | \
         glitches filtered | counts lost | illegal |"
    );
    println!("|---:|---:|---|---|---:|---:|---:|---:|---:|");
    let (began, mut lost) = (Instant::now(), 0);
    for speed in SPEEDS_MM_S {
        let tally = all(Line::at(f64::from(speed), COUNT_UM, filter), edges, u64::from(speed));
        let [backward, forward] = tally.turns.map(|turns| turns.map(|turns| turns.to_string()).join(", "));
        println!(
            "| {speed} | {} | {forward} | {backward} | {} | {} | {} | {} | {} |",
            tally.edges, tally.bounces, tally.pulses, tally.glitches, tally.lost, tally.illegal
        );
        lost += tally.lost + tally.illegal;
    }
    println!(
        "\nFilter {filter} clocks; {:.1} min on {} threads.",
        began.elapsed().as_secs_f64() / 60.0,
        threads()
    );
    if lost == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn threads() -> u64 {
    thread::available_parallelism().map_or(1, |count| count.get() as u64)
}

/// All parts of a run, whoever does them.
fn all(line: Line, edges: u64, seed: u64) -> Tally {
    let next = AtomicU64::new(0);
    let work = || {
        let mut tally = Tally::default();
        loop {
            let part = next.fetch_add(1, Ordering::Relaxed);
            let left = edges.saturating_sub(part.saturating_mul(PART));
            if left == 0 {
                return tally;
            }
            tally = tally.and(&line.run(left.min(PART), (seed << 32) + part));
        }
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads()).map(|_| scope.spawn(work)).collect();
        let tallies = workers.into_iter().map(|worker| worker.join().expect("a worker does not panic"));
        tallies.fold(Tally::default(), |sum, tally| sum.and(&tally))
    })
}
