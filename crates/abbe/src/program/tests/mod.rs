//! Programs as a whole, and curves against what a blind search finds on them.

mod curves;
mod document;
mod programs;
mod random;
mod runs;

use super::check::{Checked, check};
use super::lines::Lines;
use crate::preset::{self, Preset};
use std::io::BufRead;
use std::sync::LazyLock;

static USUAL: LazyLock<Preset> = LazyLock::new(|| preset::load(preset::USUAL).unwrap());

/// A program on the usual stage, 100 × 100 mm and 20 mm/s, that stands at zero.
fn checked(program: impl BufRead) -> Checked {
    check(Lines::new(program, &|_| ()), &USUAL, 100).unwrap()
}
