//! What an ellipse cannot take off: harmonics of the signals, learned from a sweep ([`Sweep`]) and taken off by a table
//! ([`super::correct::Residual`]). Floats: between ticks.

mod lesson;
mod stretch;
mod sweep;

pub use lesson::{FEWEST_PERIODS, Lesson};
pub use stretch::{LONGEST, SHORTEST, Stretch};
pub use sweep::{Sweep, SweepError};

use super::correct::Residual;
use core::f64::consts::TAU;

/// Harmonics of the phase error that are learned: a third harmonic of the signals is the fourth of the phase, a fifth
/// the fourth and the sixth.
pub const HARMONICS: usize = 8;

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
