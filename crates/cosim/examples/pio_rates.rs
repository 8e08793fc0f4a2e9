//! Prints how fast the PIO programs are exact: `cargo run --release -p abbe-cosim --example pio_rates`.

use abbe_core::front::CLOCK_HZ;
use abbe_core::front::emitter::SHORTEST_PERIOD;
use abbe_cosim::rates::{edges_lost, indices_found, pulses_exact};

/// Edges of each row.
const EDGES: u64 = 400_000;
/// Clocks of a tick at 10 kHz, and ticks of each row.
const TICK: u32 = 12_500;
const TICKS: u64 = 500;

fn main() {
    println!("| decoder: clocks an edge | million edges/s | edges lost | index found at its count |");
    println!("|---:|---:|---:|---:|");
    for clocks in [625, 60, 25, 22, 21, 14, 12, 11, 10, 9] {
        let edges = if clocks > 60 { EDGES / 20 } else { EDGES };
        let (found, marks) = indices_found(clocks, edges);
        let rate = f64::from(CLOCK_HZ) / clocks as f64 * 1e-6;
        println!("| {clocks} | {rate:.2} | {} of {edges} | {found} of {marks} |", edges_lost(clocks, edges));
    }
    println!();
    println!("| emitter: clocks a pulse | MHz, each of two axes | pulses | each at its clock |");
    println!("|---:|---:|---:|---|");
    for clocks in [1250, 250, 128, SHORTEST_PERIOD] {
        let rate = (u64::from(TICK) * 65_536 / u64::from(clocks)) as i32;
        let mhz = f64::from(CLOCK_HZ) / f64::from(clocks) * 1e-6;
        match pulses_exact(TICK, rate, TICKS) {
            Ok(pulses) => println!("| {clocks} | {mhz:.2} | {pulses} | yes |"),
            Err(wrong) => println!("| {clocks} | {mhz:.2} | | no: {wrong:?} |"),
        }
    }
}
