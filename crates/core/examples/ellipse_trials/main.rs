//! What is left of the error inside a period, by method, samples and noise: the tables of docs/benchmarks.md.
//!
//! `cargo run --release -p abbe-core --example ellipse_trials`

mod trials;

use abbe_core::sense::correct::{Correction, Residual};
use abbe_core::sense::phase::polar;
use std::f64::consts::TAU;
use trials::{Method, Motion, PERIOD_NM, mean, p95};

const TRIALS: u64 = 2000;
/// Samples and noise.
const ROWS: [(u32, f64); 6] =
    [(200, 0.001), (200, 0.01), (1000, 0.003), (1000, 0.01), (5000, 0.003), (5000, 0.01)];
const SWEEPS: u64 = 200;
const SWEEP_ROWS: [(u32, f64); 4] = [(20_000, 0.0), (20_000, 0.003), (20_000, 0.01), (100_000, 0.01)];
/// A converter's amplitude, part of half of its range.
const FILLED: f64 = 0.9;
const PLACES: u32 = 1_000_000;

fn main() {
    let plain = Motion { samples: 0, noise: 0.0, third: 0.0 };
    let taken_as_they_are = plain.left_nm(&Correction::NONE, &Residual::NONE);
    println!("The signals taken as they are: {taken_as_they_are:.2} nm peak.\n");
    println!("Peak error left by the ellipse, nm of {PERIOD_NM}, mean / p95 of {TRIALS} signals:\n");
    println!(
        "| samples | noise | Heydemann | moments | peaks (paper B) | recursive |\n|---:|---:|---:|---:|---:|---:|"
    );
    for (samples, noise) in ROWS {
        let motion = Motion { samples, noise, third: 0.0 };
        let cells = Method::ALL.map(|method| cell(motion.trials(method, TRIALS)));
        println!("| {samples} | {} % | {} |", 100.0 * noise, cells.join(" | "));
    }
    println!("\nThird harmonic of 1 %, peak error left, nm, mean / p95 of {SWEEPS} sweeps:\n");
    println!("| samples | noise | ellipse alone | ellipse and table |\n|---:|---:|---:|---:|");
    for (samples, noise) in SWEEP_ROWS {
        let motion = Motion { samples, noise, third: 0.01 };
        let [alone, table] = [false, true].map(|with| cell(motion.sweeps(with, SWEEPS)));
        println!("| {samples} | {} % | {alone} | {table} |", 100.0 * noise);
    }
    println!(
        "\nWhat the roundings of a converter add, amplitude {FILLED} of its range, over {PLACES} places:\n"
    );
    println!("| bits | peak, nm | rms, nm |\n|---:|---:|---:|");
    for bits in [8, 10, 12, 14, 16] {
        let [peak, rms] = rounding(bits);
        println!("| {bits} | {peak:.4} | {rms:.4} |");
    }
}

fn cell(left: Option<Vec<f64>>) -> String {
    left.map_or_else(|| "–".into(), |left| format!("{:.3} / {:.3}", mean(&left), p95(&left)))
}

/// Peak and rms of the error that rounding to whole codes makes, nm.
fn rounding(bits: u32) -> [f64; 2] {
    let amplitude = FILLED * (f64::from(1 << (bits - 1)) - 0.5);
    let errors = (0..PLACES).map(|place| {
        let turns = (f64::from(place) + 0.5) / f64::from(PLACES);
        let [sin, cos] = [(turns * TAU).sin(), (turns * TAU).cos()].map(|v| (amplitude * v).round() as i32);
        let off = polar(sin, cos).phase.turns() - turns;
        (off - off.round()) * PERIOD_NM
    });
    let (peak, squares) = errors.fold((0.0_f64, 0.0), |(peak, sum), e| (peak.max(e.abs()), sum + e * e));
    [peak, (squares / f64::from(PLACES)).sqrt()]
}
