//! No lost count: so many edges of a 0.8 µm grating (0.2 µm a 4× count) through the counter, at two speeds.
//!
//! `cargo run --release -p abbe-core --example edges -- 1000000000`
//!
//! The argument is the number of edges at each speed. Edges come early or late, comparators chatter, noise puts pulses
//! on both channels, and the stage turns at every phase. The same number gives the same table on every machine. What
//! becomes of the counts in a reading head: `periods`.

mod line;
mod parts;

use abbe_core::front::filter_for;
use line::{Line, Tally};
use parts::{all, taken};
use std::process::ExitCode;
use std::time::Instant;

/// Paper B's grating interferometer.
const COUNT_UM: f64 = 0.2;
/// Paper B's fastest, and ten times that.
const SPEEDS_MM_S: [u32; 2] = [5, 50];
/// Pulses shorter than this are noise.
const PULSE_NS: u32 = 100;

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
        let line = Line::at(f64::from(speed), COUNT_UM, filter);
        let tally = all(edges, u64::from(speed), |edges, seed| line.run(edges, seed), Tally::and);
        let [backward, forward] = tally.turns.map(|turns| turns.map(|turns| turns.to_string()).join(", "));
        println!(
            "| {speed} | {} | {forward} | {backward} | {} | {} | {} | {} | {} |",
            tally.edges, tally.bounces, tally.pulses, tally.glitches, tally.lost, tally.illegal
        );
        lost += tally.lost + tally.illegal;
    }
    println!("\nFilter {filter} clocks; {}.", taken(began));
    if lost == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
