//! What many stretches say together.

use super::stretch::{Beside, PARTS, Stretch, WAVES};
use super::sweep::SweepError;
use super::{HARMONICS, Harmonics};
use crate::sense::solve::solve;

/// Periods that a sweep must cover.
pub const FEWEST_PERIODS: f64 = 8.0;

/// Normal equations of the harmonics, summed up over stretches. A stretch counts by its samples.
#[derive(Clone, Copy, Debug)]
pub struct Lesson {
    sums: Beside,
    stretches: u32,
}

impl Default for Lesson {
    fn default() -> Self {
        let sums = Beside {
            matrix: [[0.0; WAVES]; WAVES],
            right: [0.0; WAVES],
            squares: 0.0,
            samples: 0,
            periods: 0.0,
            parts: 0,
        };
        Self { sums, stretches: 0 }
    }
}

impl Lesson {
    /// One more stretch.
    ///
    /// # Errors
    /// It was too slow, or did not move smoothly one way; see [`SweepError`].
    pub fn take(&mut self, stretch: &Stretch) -> Result<(), SweepError> {
        self.add(&stretch.beside()?);
        self.stretches = self.stretches.saturating_add(1);
        Ok(())
    }

    /// Both.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let mut both = *self;
        both.add(&other.sums);
        both.stretches = both.stretches.saturating_add(other.stretches);
        both
    }

    fn add(&mut self, more: &Beside) {
        let sums = &mut self.sums;
        let cells = sums.matrix.as_flattened_mut().iter_mut().chain(&mut sums.right);
        let others = more.matrix.as_flattened().iter().chain(&more.right);
        cells.zip(others).for_each(|(cell, other)| *cell += other);
        sums.squares += more.squares;
        sums.samples = sums.samples.saturating_add(more.samples);
        sums.periods += more.periods;
        sums.parts |= more.parts;
    }

    /// How many stretches.
    pub fn stretches(&self) -> u32 {
        self.stretches
    }

    /// How many samples they have.
    pub fn samples(&self) -> u32 {
        self.sums.samples
    }

    /// Periods that they went through.
    pub fn periods(&self) -> f64 {
        self.sums.periods
    }

    /// The harmonics, and what is left beside them and the motion, turns rms.
    ///
    /// # Errors
    /// Too few periods, or not all of their parts; see [`SweepError`].
    pub fn learn(&self) -> Result<(Harmonics, f64), SweepError> {
        let Beside { matrix, right, squares, samples, periods, parts } = self.sums;
        if periods < FEWEST_PERIODS {
            return Err(SweepError::TooShort { periods });
        }
        let gaps = SweepError::Gaps { seen: parts.count_ones(), of: PARTS };
        if parts != u64::MAX {
            return Err(gaps);
        }
        let solution = solve(matrix, right).ok_or(gaps)?;
        let explained: f64 = solution.iter().zip(right).map(|(value, right)| value * right).sum();
        let left = libm::sqrt(((squares - explained) / f64::from(samples)).max(0.0));
        let mut harmonics = Harmonics([[0.0; 2]; HARMONICS]);
        harmonics.0.as_flattened_mut().iter_mut().zip(solution).for_each(|(to, from)| *to = from);
        Ok((harmonics, left))
    }
}
