//! What an analogue axis costs a Cortex-M0+, sample by sample: the image `sensing` of `firmware/golden` on an emulated
//! RP2040. What it finds must hash to what this machine finds, from the same source.

use std::path::Path;

use anyhow::{Result, ensure};
use serde::Serialize;

use crate::image::Image;
use crate::metered::{Entries, Metered};

#[path = "../../core/examples/sensing_speed/signals.rs"]
mod signals;
#[path = "../../core/examples/sensing_speed/work.rs"]
#[allow(dead_code, reason = "the image alone tells when an ellipse is taken anew")]
mod work;

use signals::{Reading, SAMPLES};
use work::{Bench, ROWS};

/// Functions of this module are metered.
const MEASURED: &str = "sensing::work::measured";
/// Instructions between two looks whether the image is done.
const GLANCE: u32 = 1 << 16;
/// More cycles than the signals, the tables and the samples of all rows take.
const MOST_CYCLES: u64 = 2_000_000_000;

/// What a row costs, cycles.
#[derive(Debug, Serialize)]
pub struct Cost {
    /// Its name.
    pub name: &'static str,
    /// How often it was done.
    pub samples: usize,
    /// In half of them at most so many cycles.
    pub median: u32,
    /// In 99 of 100.
    pub p99: u32,
    /// In all.
    pub worst: u32,
    /// What is allowed, where it is judged.
    pub budget: Option<u32>,
    /// Number of the dearest sample of its run, from 0.
    pub worst_at: usize,
    /// Hash of its results there, when it is another than here.
    pub differs: Option<String>,
}

/// Runs the image.
///
/// # Errors
/// It cannot be read, or stops without an answer.
pub fn costs(file: &Path) -> Result<Vec<Cost>> {
    let image = Image::read(file)?;
    let entries = Entries::of(&image, &image.entries_in(MEASURED)?);
    let [end, row, found] = ["SENSING_END", "SENSING_ROW", "SENSING_FOUND"].map(|name| image.place_of(name));
    let (end, row, found) = (end?, row?, found?);
    let mut board = Metered::switched_on(&image, &entries)?;
    let mut cycles: Vec<Vec<u32>> = vec![Vec::new(); ROWS.len()];
    while board.peek(end) == 0 {
        for _ in 0..GLANCE {
            if let Some(left) = board.step() {
                cycles[board.peek(row) as usize].push(left.cycles);
            }
        }
        board.is_well(MOST_CYCLES)?;
    }
    ensure!(board.peek(end) == 1, "the image has panicked in row {}", board.peek(row));
    ensure!(board.peek(found) as usize == ROWS.len(), "the image has other rows than this program");
    let hashes = (1_u32..).map(|number| board.peek(found + 4 * number));
    let rows = ROWS.iter().zip(cycles).zip(hashes).zip(here());
    rows.map(|(((row, cycles), there), here)| cost(row, &cycles, there, here)).collect()
}

/// What this machine's results hash to, by row.
fn here() -> Vec<u32> {
    let mut readings = vec![Reading::NONE; SAMPLES];
    signals::fill(&mut readings);
    let found = |row| Bench::new(row).run(&readings, |head| work::refine(head, |_| ()));
    ROWS.iter().map(found).collect()
}

fn cost(row: &work::Row, cycles: &[u32], there: u32, here: u32) -> Result<Cost> {
    ensure!(!cycles.is_empty(), "{}: nothing was metered", row.name);
    let mut sorted = cycles.to_vec();
    sorted.sort_unstable();
    // The smallest number that at least so many of a hundred do not exceed.
    let within = |percent: usize| sorted[(sorted.len() * percent).div_ceil(100) - 1];
    let worst = within(100);
    Ok(Cost {
        name: row.name,
        samples: cycles.len(),
        median: within(50),
        p99: within(99),
        worst,
        budget: row.budget,
        worst_at: cycles.iter().position(|&cycles| cycles == worst).unwrap_or(0),
        differs: (there != here).then(|| format!("{there:08x} there, {here:08x} here")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dearest_sample_is_named_and_another_hash_is_told() {
        let cycles: Vec<u32> = (0..200).map(|number| (number * 77) % 200).collect();
        let found = cost(&ROWS[0], &cycles, 7, 7).unwrap();
        assert_eq!((found.samples, found.median, found.p99, found.worst), (200, 99, 197, 199));
        assert_eq!((cycles[found.worst_at], found.differs), (199, None));
        let differs = cost(&ROWS[0], &cycles, 7, 255).unwrap().differs;
        assert_eq!(differs.as_deref(), Some("00000007 there, 000000ff here"));
        assert!(cost(&ROWS[0], &[], 7, 7).is_err());
    }

    #[test]
    fn rows_find_different_things_and_a_head_takes_new_ellipses() {
        // What is done between ticks has no results of its own.
        let reads = |row: &work::Row| !matches!(row.work, work::Work::Refine);
        let mut hashes: Vec<u32> =
            ROWS.iter().zip(here()).filter_map(|(row, hash)| reads(row).then_some(hash)).collect();
        let rows = hashes.len();
        hashes.sort_unstable();
        hashes.dedup();
        assert_eq!(hashes.len(), rows);
        let (mut readings, mut taken) = (vec![Reading::NONE; SAMPLES], 0);
        signals::fill(&mut readings);
        let mut bench = Bench::new(&ROWS[0]);
        bench.run(&readings, |head| {
            let before = *head.ellipse();
            work::refine(head, |_| ());
            taken += u32::from(*head.ellipse() != before);
        });
        assert!(taken > 0);
    }
}
