//! What an ellipse cannot take off: harmonics of the signals, learned while the stage goes at a constant speed.
//!
//! At constant speed the true phase is a straight line in time, so what the measured phase does beside a line is its own
//! error. A line and the harmonics of the phase are fitted together; the harmonics go into a table
//! ([`super::correct::Residual`]). Floats: between ticks.

use super::correct::Residual;
use super::periods::Periods;
use super::solve::solve;
use core::f64::consts::TAU;

/// Harmonics of the phase error that are learned: a third harmonic of the signals is the fourth of the phase, a fifth
/// the fourth and the sixth.
pub const HARMONICS: usize = 8;
/// A line, and a cosine and a sine each.
const UNKNOWNS: usize = 2 + 2 * HARMONICS;
/// Periods that a sweep must cover.
pub const FEWEST_PERIODS: f64 = 8.0;
/// Parts of a period that must all have been seen.
const PARTS: u32 = 64;
const BELOW_PART: u32 = 32_u32.saturating_sub(PARTS.ilog2());
/// A sweep whose phase strays farther from its line, turns rms, was not at constant speed.
const STRAYS: f64 = 0.05;

/// Harmonics of a phase error: turns, cosine and sine of each, the first first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Harmonics(pub [[f64; 2]; HARMONICS]);

impl Harmonics {
    /// The error at a phase, turns of turns.
    pub fn at(&self, turns: f64) -> f64 {
        let Self(all) = self;
        (1_u32..)
            .zip(all)
            .map(|(k, [cos, sin])| {
                let angle = TAU * f64::from(k) * turns;
                cos * libm::cos(angle) + sin * libm::sin(angle)
            })
            .sum()
    }

    /// How large each harmonic is, turns.
    pub fn sizes(&self) -> [f64; HARMONICS] {
        self.0.map(|[cos, sin]| libm::hypot(cos, sin))
    }

    /// Without the first two, which are offsets, gain and quadrature: an ellipse takes those off, and may follow them.
    #[must_use]
    pub fn beyond_an_ellipse(&self) -> Self {
        let Self([_, _, beyond @ ..]) = self;
        let mut left = Self::default();
        let Self([_, _, places @ ..]) = &mut left;
        *places = *beyond;
        left
    }

    /// The table that takes them off.
    pub fn residual(&self) -> Residual {
        Residual::of(|turns| self.at(turns))
    }
}

/// Why a sweep teaches nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SweepError {
    /// It went through too few periods.
    TooShort {
        /// How many.
        periods: f64,
    },
    /// It left out parts of the period: the speed and the sample rate are commensurate.
    Gaps {
        /// Parts that were seen.
        seen: u32,
        /// Of so many.
        of: u32,
    },
    /// The speed was not constant.
    NotConstant {
        /// What lies beside the line, turns rms.
        strays: f64,
    },
}

impl core::fmt::Display for SweepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooShort { periods } => {
                write!(f, "the sweep went through {periods:.1} periods; {FEWEST_PERIODS:.0} are needed")
            }
            Self::Gaps { seen, of } => {
                write!(f, "the sweep saw {seen} of {of} parts of the period; take another speed")
            }
            Self::NotConstant { strays } => {
                write!(f, "the sweep strays {strays:.3} periods rms from a constant speed")
            }
        }
    }
}

impl core::error::Error for SweepError {}

/// A sweep at constant speed, sample by sample.
#[derive(Clone, Debug)]
pub struct Sweep {
    matrix: [[f64; UNKNOWNS]; UNKNOWNS],
    right: [f64; UNKNOWNS],
    squares: f64,
    samples: u32,
    first: Option<Periods>,
    last: Periods,
    parts: u64,
}

impl Default for Sweep {
    fn default() -> Self {
        Self {
            matrix: [[0.0; UNKNOWNS]; UNKNOWNS],
            right: [0.0; UNKNOWNS],
            squares: 0.0,
            samples: 0,
            first: None,
            last: Periods(0),
            parts: 0,
        }
    }
}

impl Sweep {
    /// One sample, corrected by the ellipse, in the order of time and at even distances of it.
    pub fn add(&mut self, position: Periods) {
        let first = *self.first.get_or_insert(position);
        self.last = position;
        self.parts |= 1_u64 << (position.phase().0 >> BELOW_PART);
        let row = regressors(f64::from(self.samples), position.phase().turns());
        // Counted from the first: a long way would cost decimals.
        let way = Periods(position.way_from(first)).turns();
        for ((line, right), a) in self.matrix.iter_mut().zip(&mut self.right).zip(row) {
            line.iter_mut().zip(row).for_each(|(cell, b)| *cell += a * b);
            *right += a * way;
        }
        self.squares += way * way;
        self.samples = self.samples.saturating_add(1);
    }

    /// The harmonics, and what is left beside them, turns rms.
    ///
    /// # Errors
    /// See [`SweepError`].
    pub fn learn(&self) -> Result<(Harmonics, f64), SweepError> {
        let periods = Periods(self.last.way_from(self.first.unwrap_or_default())).turns().abs();
        if periods < FEWEST_PERIODS {
            return Err(SweepError::TooShort { periods });
        }
        let seen = self.parts.count_ones();
        if seen < PARTS {
            return Err(SweepError::Gaps { seen, of: PARTS });
        }
        let solution = solve(self.matrix, self.right).ok_or(SweepError::Gaps { seen, of: PARTS })?;
        let explained: f64 = solution.iter().zip(self.right).map(|(value, right)| value * right).sum();
        let left = libm::sqrt(((self.squares - explained) / f64::from(self.samples)).max(0.0));
        if left > STRAYS {
            return Err(SweepError::NotConstant { strays: left });
        }
        let mut harmonics = Harmonics::default();
        let (pairs, _) = solution.get(2..).unwrap_or_default().as_chunks();
        harmonics.0.iter_mut().zip(pairs).for_each(|(harmonic, pair)| *harmonic = *pair);
        Ok((harmonics, left))
    }
}

/// A line in time, and the harmonics of the phase.
fn regressors(sample: f64, turns: f64) -> [f64; UNKNOWNS] {
    let mut row = [0.0; UNKNOWNS];
    let (line, waves) = row.split_at_mut(2);
    line.iter_mut().zip([1.0, sample]).for_each(|(cell, value)| *cell = value);
    let (sin, cos) = (libm::sin(TAU * turns), libm::cos(TAU * turns));
    // Each harmonic is the one before it turned on by the first.
    let mut now = [cos, sin];
    for pair in waves.chunks_exact_mut(2) {
        pair.iter_mut().zip(now).for_each(|(cell, value)| *cell = value);
        now = [now[0] * cos - now[1] * sin, now[1] * cos + now[0] * sin];
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(speed: f64, samples: u32, error: impl Fn(f64) -> f64) -> Sweep {
        let mut sweep = Sweep::default();
        for k in 0..samples {
            let turns = f64::from(k) * speed + 0.2;
            sweep.add(Periods(((turns + error(turns)) * 4_294_967_296.0) as i64));
        }
        sweep
    }

    #[test]
    fn harmonics_come_back() {
        let error = |turns: f64| {
            0.0016 * (4.0 * TAU * turns + 0.4).sin() + 0.0004 * (6.0 * TAU * turns).cos()
                - 0.0008 * (TAU * turns).sin()
        };
        for speed in [0.0371, -0.1713] {
            let (harmonics, left) = sweep(speed, 20_000, error).learn().unwrap();
            // They are counted in the measured phase, which is off by the error itself: 2π · 4 · 0.0016² / 2 at the eighth.
            for (size, expected) in
                harmonics.sizes().iter().zip([8e-4, 0.0, 0.0, 1.6e-3, 0.0, 4e-4, 0.0, 0.0])
            {
                assert!((size - expected).abs() < 4e-5, "{harmonics:?}");
            }
            assert!(left < 3e-5, "{left}");
        }
    }

    #[test]
    fn a_sweep_that_teaches_nothing_says_why() {
        let none = |_: f64| 0.0;
        assert!(matches!(sweep(0.01, 100, none).learn(), Err(SweepError::TooShort { .. })));
        assert!(matches!(sweep(0.125, 1000, none).learn(), Err(SweepError::Gaps { seen: 8, .. })));
        let uneven = sweep(0.0371, 20_000, |turns| 0.5 * (turns * 0.3).sin());
        assert!(matches!(uneven.learn(), Err(SweepError::NotConstant { .. })), "{:?}", uneven.learn());
        assert!(Sweep::default().learn().is_err());
    }
}
