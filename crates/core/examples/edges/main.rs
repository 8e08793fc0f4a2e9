//! No lost count: so many edges of a 0.8 µm grating (0.2 µm a 4× count), at two speeds.
//!
//! `cargo run --release -p abbe-core --example edges -- 1000000000 100000000`
//!
//! The first argument is the number of edges at each speed that go through the counter alone. Edges come early or late,
//! comparators chatter, noise puts pulses on both channels, and the stage turns at every phase. The second is the number
//! of edges in each run of the whole way: signals, comparators, counter, converter, head, and without the counter. The
//! same numbers give the same tables on every machine.

mod grating;
mod line;
mod motion;
mod parts;
mod track;

use abbe_core::front::filter_for;
use line::Line;
use motion::Pace;
use parts::{all, threads};
use std::process::ExitCode;
use std::time::Instant;
use track::Track;

/// Paper B's grating interferometer.
const COUNT_UM: f64 = 0.2;
/// Paper B's fastest, and ten times that.
const SPEEDS_MM_S: [u32; 2] = [5, 50];
/// Pulses shorter than this are noise.
const PULSE_NS: u32 = 100;

fn main() -> ExitCode {
    let arguments: Result<Vec<u64>, _> = std::env::args().skip(1).map(|argument| argument.parse()).collect();
    let Ok(&[edges, of_heads]) = arguments.as_deref() else {
        eprintln!("two numbers of edges are needed: for the counter alone, and for each run with a head");
        return ExitCode::FAILURE;
    };
    let filter = filter_for(PULSE_NS).expect("100 ns are within the filter's range");
    let lost = counters(filter, edges) + heads(filter, of_heads);
    if lost == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The counter alone; what was lost.
fn counters(filter: u8, edges: u64) -> u64 {
    println!(
        "| speed, mm/s | edges | turns at phase 0, 1, 2, 3: to forward | to backward | bounces | noise pulses | \
         glitches filtered | counts lost | illegal |"
    );
    println!("|---:|---:|---|---|---:|---:|---:|---:|---:|");
    let (began, mut lost) = (Instant::now(), 0);
    for speed in SPEEDS_MM_S {
        let line = Line::at(f64::from(speed), COUNT_UM, filter);
        let tally = all(edges, u64::from(speed), |edges, seed| line.run(edges, seed), line::Tally::and);
        let [backward, forward] = tally.turns.map(|turns| turns.map(|turns| turns.to_string()).join(", "));
        println!(
            "| {speed} | {} | {forward} | {backward} | {} | {} | {} | {} | {} |",
            tally.edges, tally.bounces, tally.pulses, tally.glitches, tally.lost, tally.illegal
        );
        lost += tally.lost + tally.illegal;
    }
    println!("\nFilter {filter} clocks; {}.\n", taken(began));
    lost
}

/// The whole way, with the counter and without; what was lost.
fn heads(filter: u8, edges: u64) -> u64 {
    println!(
        "| counter | ellipse | speed, mm/s | edges | ticks | turns to forward, to backward, fewest in a 16th of the \
         period | level changes | glitches filtered | counts lost | illegal | periods lost | signal faults | \
         position off, nm |"
    );
    println!("|---|---|---:|---:|---:|---|---:|---:|---:|---:|---:|---:|---:|");
    let (began, mut lost) = (Instant::now(), 0);
    for (row, (counted, known)) in [(true, true), (true, false), (false, true), (false, false)].into_iter().enumerate() {
        for speed in SPEEDS_MM_S {
            let track = Track { counted, known, ..Track::at(Pace::of_a_stage(f64::from(speed)), filter) };
            let seed = (row as u64) << 16 | u64::from(speed);
            let tally = all(edges, seed, |edges, seed| track.run(edges, seed), track::Tally::and);
            let [backward, forward] = tally.turns.map(|turns| turns.into_iter().min().unwrap_or(0));
            println!(
                "| {} | {} | {speed} | {} | {} | {forward}, {backward} | {} | {} | {} | {} | {} | {} | {:.2} |",
                if counted { "yes" } else { "no" },
                if known { "known" } else { "a circle" },
                tally.edges,
                tally.ticks,
                tally.changes,
                tally.glitches,
                tally.lost,
                tally.illegal,
                tally.periods,
                tally.faults,
                tally.worst_periods() * grating::PERIOD_UM * 1e3
            );
            lost += tally.lost + tally.illegal + tally.periods + tally.faults;
        }
    }
    println!("\n{}.", taken(began));
    lost
}

fn taken(began: Instant) -> String {
    format!("{:.1} min on {} threads", began.elapsed().as_secs_f64() / 60.0, threads())
}
