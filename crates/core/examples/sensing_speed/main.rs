//! What reading an analogue encoder costs this machine, sample by sample, beside other ways to an angle; and what it
//! keeps.
//!
//! `cargo run --release -p abbe-core --example sensing_speed`
//!
//! `cargo xtask cycles` counts the cycles of the same work on a Cortex-M0+.

mod signals;
#[allow(dead_code, reason = "budgets are for a Cortex-M0+")]
mod work;

use abbe_core::sense::correct::Residual;
use abbe_core::sense::head::{Config, Head};
use abbe_core::sense::recursive::{Gather, Recursive};
use signals::{Reading, SAMPLES};
use std::f64::consts::TAU;
use std::time::Instant;
use work::{Bench, ROWS, Work, measured, refine};

/// Every row is run so often; the fastest run is the least disturbed.
const TIMES: usize = 2001;

/// What an axis keeps. No pointer is in it, so that a Cortex-M0+ needs as much.
const SIZES: [(&str, usize); 5] = [
    ("all that a head remembers", size_of::<Head>()),
    ("of it the table of harmonics", size_of::<Residual>()),
    ("of it the sums that the tick gathers", size_of::<Gather>()),
    ("of it the recursion", size_of::<Recursive>()),
    ("its settings", size_of::<Config>()),
];

fn main() {
    let mut readings = vec![Reading::NONE; SAMPLES];
    signals::fill(&mut readings);
    println!("| work | this machine, ns | largest error of the angle, 10⁻⁹ of a period |\n|---|---:|---:|");
    // Of the rows that are done while heads are read.
    let mut between = vec![Vec::new(); ROWS.len()];
    for (number, row) in ROWS.iter().enumerate() {
        let ns = match row.work {
            Work::Refine => fastest(&between[number]),
            _ => nanoseconds_of(row, &readings, &mut between),
        };
        println!("| {} | {ns:.1} | {} |", row.name, error(row.work));
    }
    println!("\n| what an axis needs in RAM | bytes |\n|---|---:|");
    for (what, bytes) in SIZES {
        println!("| {what} | {bytes} |");
    }
}

/// Of a sample.
fn nanoseconds_of(row: &work::Row, readings: &[Reading], between: &mut [Vec<f64>]) -> f64 {
    let runs: Vec<f64> = (0..TIMES)
        .map(|_| {
            let mut bench = Bench::new(row);
            let mut not_reading = 0.0;
            let began = Instant::now();
            std::hint::black_box(bench.run(readings, |head| {
                let began = Instant::now();
                let mut pieces = Vec::with_capacity(4);
                refine(head, |row| pieces.push((row, Instant::now())));
                let ends = pieces.iter().skip(1).map(|(_, end)| *end).chain([Instant::now()]);
                for ((row, begin), end) in pieces.iter().zip(ends) {
                    between[*row].push((end - *begin).as_secs_f64() * 1e9);
                }
                not_reading += nanoseconds_since(began);
            }));
            (nanoseconds_since(began) - not_reading) / readings.len() as f64
        })
        .collect();
    fastest(&runs)
}

fn nanoseconds_since(began: Instant) -> f64 {
    began.elapsed().as_secs_f64() * 1e9
}

fn fastest(runs: &[f64]) -> f64 {
    runs.iter().copied().fold(f64::INFINITY, f64::min)
}

/// The worst over the whole turn, for a way to an angle.
fn error(work: Work) -> String {
    const ANGLES: u32 = 100_000;
    let table = match work {
        Work::Subdivide(factor) => abbe_core::sense::subdivide::Subdivider::new(factor).ok(),
        _ => None,
    };
    let turns = |sin: i32, cos: i32| match work {
        Work::Polar => Some(measured::phase(sin, cos).phase.turns()),
        Work::Atan2f => Some(f64::from(measured::atan2f(sin, cos)) / TAU),
        Work::IdspAtan2 => Some(f64::from(measured::idsp_atan2(sin, cos)) / 4_294_967_296.0),
        Work::Subdivide(factor) => {
            table.as_ref().map(|table| f64::from(measured::subdivide(table, sin, cos)) / f64::from(factor))
        }
        Work::Nothing | Work::Head { .. } | Work::Refine | Work::Straighten => None,
    };
    let off = |number: u32| {
        let angle = f64::from(number) / f64::from(ANGLES) * TAU;
        // 16-bit signals with 8 more bits of the correction.
        let (sin, cos) = ((angle.sin() * 5.1e6) as i32, (angle.cos() * 5.1e6) as i32);
        let off = turns(sin, cos)? - f64::from(sin).atan2(f64::from(cos)) / TAU;
        Some((off - off.round()).abs())
    };
    let worst = (0..ANGLES).filter_map(off).reduce(f64::max);
    worst.map_or("–".into(), |worst| format!("{:.0}", worst * 1e9))
}
