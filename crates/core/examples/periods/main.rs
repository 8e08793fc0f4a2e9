//! No lost period: so many edges of a 0.8 µm grating through its comparators, the counter and a reading head, and the same
//! motion through a head without a counter.
//!
//! `cargo run --release -p abbe-core --example periods -- 100000000`
//!
//! The argument is the number of edges in each row. The signals are poor, comparators and converter have noise, samples
//! are taken early or late, and the stage turns everywhere in the period; each tick is compared with the true place. The
//! same number gives the same table on every machine.

mod grating;
mod motion;
#[path = "../edges/parts.rs"]
mod parts;
mod track;

use abbe_core::front::filter_for;
use grating::PERIOD_UM;
use motion::Pace;
use parts::{all, taken};
use std::process::ExitCode;
use std::time::Instant;
use track::{Tally, Track};

/// Paper B's fastest, and ten times that.
const SPEEDS_MM_S: [u32; 2] = [5, 50];
/// Pulses shorter than this are noise.
const PULSE_NS: u32 = 100;
/// With the counter or without; the ellipse known or not.
const HEADS: [(bool, bool); 4] = [(true, true), (true, false), (false, true), (false, false)];

fn main() -> ExitCode {
    let argument = std::env::args().nth(1).unwrap_or_else(|| "10000000".into());
    let Ok(edges) = argument.parse() else {
        eprintln!("{argument} is not a number of edges");
        return ExitCode::FAILURE;
    };
    let filter = filter_for(PULSE_NS).expect("100 ns are within the filter's range");
    println!(
        "| counter | signals taken for | speed, mm/s | edges | ticks | turns to forward, to backward, fewest in a \
         sixteenth | level changes | glitches filtered | counts lost | illegal | periods lost | signal faults | \
         position off, nm |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    let (began, mut worse, mut all_edges) = (Instant::now(), false, 0);
    for (head, (counted, known)) in HEADS.into_iter().enumerate() {
        for speed in SPEEDS_MM_S {
            let track = Track { counted, known, ..Track::at(Pace::of_a_stage(f64::from(speed)), filter) };
            let seed = ((head as u64) << 8) + u64::from(speed);
            let tally = all(edges, seed, |edges, seed| track.run(edges, seed), Tally::and);
            print_row(&track, speed, &tally);
            if !tally.is_within(track.bound()) {
                eprintln!("worse than it may be, seed {seed}: {track:?}");
                worse = true;
            }
            all_edges += tally.edges;
        }
    }
    println!("\n{all_edges} edges in all; filter {filter} clocks; {}.", taken(began));
    if worse { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn print_row(track: &Track, speed: u32, tally: &Tally) {
    let [backward, forward] = tally.turns.map(|turns| turns.into_iter().min().unwrap_or(0));
    // Without a counter there is none to lose counts.
    let of_counter = [tally.changes, tally.glitches, tally.lost, tally.illegal]
        .map(|number| if track.counted { number.to_string() } else { "–".into() })
        .join(" | ");
    println!(
        "| {} | {} | {speed} | {} | {} | {forward}, {backward} | {of_counter} | {} | {} | {:.2} |",
        if track.counted { "yes" } else { "no" },
        if track.known { "what they are" } else { "a circle at first" },
        tally.edges,
        tally.ticks,
        tally.periods,
        tally.faults,
        tally.worst_periods() * PERIOD_UM * 1e3
    );
}
