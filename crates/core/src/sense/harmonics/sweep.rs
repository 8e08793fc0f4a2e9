//! A sweep at nearly constant speed: stretch after stretch, and what they say together.

use super::Harmonics;
use super::lesson::{FEWEST_PERIODS, Lesson};
use super::stretch::{LONGEST, Stretch};
use crate::sense::periods::Periods;
use core::fmt;

/// Why a sweep, or a stretch of it, teaches nothing.
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
    /// It hardly moved: the motion itself cannot be told from an error that repeats with the period.
    TooSlow {
        /// Periods a sample.
        speed: f64,
    },
    /// The motion is no smooth one.
    NotSmooth {
        /// What lies beside a cubic, turns rms.
        strays: f64,
    },
    /// The motion turned back, stuck, or changed its speed by more than half.
    NotSteady {
        /// Lowest speed, periods a sample; below 0 against the way that it went.
        slowest: f64,
        /// Highest speed.
        fastest: f64,
    },
}

impl fmt::Display for SweepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooShort { periods } => {
                write!(f, "the sweep went through {periods:.1} periods; {FEWEST_PERIODS:.0} are needed")
            }
            Self::Gaps { seen, of } => {
                write!(f, "the sweep saw {seen} of {of} parts of the period")
            }
            Self::TooSlow { speed } => write!(
                f,
                "the sweep is too slow: {speed:.4} periods a sample, at least {:.4} are needed",
                2.0 / f64::from(LONGEST)
            ),
            Self::NotSmooth { strays } => {
                write!(f, "the sweep strays {strays:.3} periods rms from a smooth motion at constant speed")
            }
            Self::NotSteady { slowest, fastest } => write!(
                f,
                "the sweep has no constant speed: within {LONGEST} samples at most it goes from {slowest:.4} to {fastest:.4} periods a sample"
            ),
        }
    }
}

impl core::error::Error for SweepError {}

/// A sweep, sample by sample.
#[derive(Clone, Debug, Default)]
pub struct Sweep {
    stretch: Stretch,
    lesson: Lesson,
    refused: Option<SweepError>,
}

impl Sweep {
    /// One sample, corrected by the ellipse, in the order of time and at even distances of it.
    pub fn add(&mut self, position: Periods) {
        self.stretch.add(position);
        if self.stretch.has_ended() {
            self.refused = self.lesson.take(&self.stretch).err().or(self.refused);
            self.stretch = Stretch::default();
        }
    }

    /// The harmonics from the stretches that teach, and what is left beside them and the motion, turns rms.
    ///
    /// # Errors
    /// See [`SweepError`]; where no stretch teaches, why the last did not.
    pub fn learn(&self) -> Result<(Harmonics, f64), SweepError> {
        match self.refused {
            Some(refused) if self.lesson.stretches() == 0 => Err(refused),
            None if self.lesson.stretches() == 0 => {
                Err(SweepError::TooShort { periods: self.stretch.periods() })
            }
            _ => self.lesson.learn(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    fn moved(samples: u32, place: impl Fn(f64) -> f64, error: impl Fn(f64) -> f64) -> Sweep {
        let mut sweep = Sweep::default();
        for k in 0..samples {
            let turns = place(f64::from(k));
            sweep.add(Periods(((turns + error(turns)) * 4_294_967_296.0) as i64));
        }
        sweep
    }

    fn sweep(speed: f64, samples: u32, error: impl Fn(f64) -> f64) -> Sweep {
        moved(samples, |k| k * speed + 0.2, error)
    }

    fn poor(turns: f64) -> f64 {
        0.0016 * (4.0 * TAU * turns + 0.4).sin() + 0.0004 * (6.0 * TAU * turns).cos()
            - 0.0008 * (TAU * turns).sin()
    }

    fn is_poor(sweep: &Sweep, within: f64, left_most: f64) {
        let (harmonics, left) = sweep.learn().unwrap();
        // They are counted in the measured phase, which is off by the error itself: 2π · 4 · 0.0016² / 2 at the eighth.
        for (size, expected) in harmonics.sizes().iter().zip([8e-4, 0.0, 0.0, 1.6e-3, 0.0, 4e-4, 0.0, 0.0]) {
            assert!((size - expected).abs() < within, "{harmonics:?}");
        }
        assert!(left < left_most, "{left}");
    }

    #[test]
    fn harmonics_come_back() {
        for speed in [0.0371, -0.1713, 0.0047, 0.4131] {
            is_poor(&sweep(speed, 20_000, poor), 4e-5, 4e-5);
        }
    }

    /// Half a period of wander, more than a thousand times the error that is learned.
    #[test]
    fn a_wander_slower_than_a_stretch_is_no_harm() {
        is_poor(&moved(20_000, |k| 0.0371 * k + 0.5 * (k * 0.008).sin(), poor), 5e-5, 2e-4);
    }

    #[test]
    fn a_sweep_that_teaches_nothing_says_why() {
        let none = |_: f64| 0.0;
        assert!(matches!(sweep(0.01, 100, none).learn(), Err(SweepError::TooShort { .. })));
        assert!(matches!(sweep(0.125, 1000, none).learn(), Err(SweepError::Gaps { seen: 8, .. })));
        assert!(matches!(sweep(0.003, 20_000, none).learn(), Err(SweepError::TooSlow { .. })));
        let shaken = moved(20_000, |k| 0.0371 * k + 0.12 * (k * 0.4).sin(), none);
        assert!(matches!(shaken.learn(), Err(SweepError::NotSmooth { .. })), "{:?}", shaken.learn());
        let turning = moved(20_000, |k| 2.5 * (k * 0.011).sin(), none);
        assert!(matches!(turning.learn(), Err(SweepError::NotSteady { .. })), "{:?}", turning.learn());
        let sticking = moved(20_000, |k| 4.0 * (k / 100.0).floor() + ((k % 100.0) / 10.0).min(4.0), none);
        assert!(matches!(sticking.learn(), Err(SweepError::NotSmooth { .. })), "{:?}", sticking.learn());
        assert!(Sweep::default().learn().is_err());
    }
}
