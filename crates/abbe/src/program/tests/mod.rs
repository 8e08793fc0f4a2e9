//! Programs as a whole, and curves against what a blind search finds on them.

mod curves;
mod document;
mod programs;

use super::check::{Checked, check};
use super::lines::Lines;
use crate::preset;
use abbe_core::Pos;
use std::io::BufRead;

/// A program on the usual stage, 100 × 100 mm and 20 mm/s, that stands at zero.
fn checked(program: impl BufRead) -> Checked {
    let preset = preset::load(preset::USUAL).unwrap();
    check(Lines::new(program, &|_| ()), &preset, [Pos::ZERO; 2]).unwrap()
}
