//! A short stretch of a sweep: what the phase does beside a smooth motion.
//!
//! No servo keeps a speed to a nanometre, but its wander is slow against the fringes. Over some ten milliseconds the motion is
//! a cubic in time; what the measured phase does beside it, and in step with itself, is its own error. The cubic and the
//! harmonics are fitted together, and the cubic is then taken out of the normal equations, so that those of many
//! stretches, each with a cubic of its own, can be added up ([`Lesson`](super::Lesson)).

use super::HARMONICS;
use super::sweep::SweepError;
use crate::sense::periods::Periods;
use core::f64::consts::TAU;

/// Constants of the motion: a cubic.
const CURVE: usize = 4;
/// A cosine and a sine each.
pub(super) const WAVES: usize = 2 * HARMONICS;
const UNKNOWNS: usize = CURVE + WAVES;
/// Samples of a stretch, and periods, at least: a cubic cannot follow two waves.
pub const SHORTEST: u32 = 128;
const PERIODS: f64 = 2.0;
/// A stretch that goes through fewer periods in so many samples is given up.
pub const LONGEST: u32 = 512;
/// Time is counted in so many samples, from the middle of the shortest stretch on.
const UNIT: f64 = 64.0;
/// Parts of a period, a bit each.
pub(super) const PARTS: u32 = 64;
const BELOW_PART: u32 = 32_u32.saturating_sub(PARTS.ilog2());
/// A phase that strays farther from the cubic, turns rms, did not move smoothly.
const STRAYS: f64 = 0.05;
/// Within a stretch the lowest speed is at least this part of the highest: it neither turns nor sticks.
const STEADY: f64 = 0.5;

/// Sums over a stretch, sample by sample.
#[derive(Clone, Debug)]
pub struct Stretch {
    matrix: [[f64; UNKNOWNS]; UNKNOWNS],
    right: [f64; UNKNOWNS],
    squares: f64,
    samples: u32,
    first: Periods,
    last: Periods,
    parts: u64,
}

/// A stretch without its motion: normal equations of the harmonics alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    pub(super) matrix: [[f64; WAVES]; WAVES],
    pub(super) right: [f64; WAVES],
    /// Σ of what lies beside the cubic, squared, turns².
    pub(super) squares: f64,
    pub(super) samples: u32,
    pub(super) periods: f64,
    pub(super) parts: u64,
}

impl Default for Stretch {
    fn default() -> Self {
        Self {
            matrix: [[0.0; UNKNOWNS]; UNKNOWNS],
            right: [0.0; UNKNOWNS],
            squares: 0.0,
            samples: 0,
            first: Periods(0),
            last: Periods(0),
            parts: 0,
        }
    }
}

impl Stretch {
    /// One sample, corrected by the ellipse, in the order of time and at even distances of it.
    pub fn add(&mut self, position: Periods) {
        if self.samples == 0 {
            self.first = position;
        }
        self.last = position;
        self.parts |= 1_u64 << (position.phase().0 >> BELOW_PART);
        let row = regressors(f64::from(self.samples) / UNIT - 1.0, position.phase().turns());
        // Counted from the first: a long way would cost decimals.
        let way = self.way();
        for ((line, right), a) in self.matrix.iter_mut().zip(&mut self.right).zip(row) {
            line.iter_mut().zip(row).for_each(|(cell, b)| *cell += a * b);
            *right += a * way;
        }
        self.squares += way * way;
        self.samples = self.samples.saturating_add(1);
    }

    /// How many samples.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Periods that it went through.
    pub fn periods(&self) -> f64 {
        self.way().abs()
    }

    /// Periods a sample.
    pub fn speed(&self) -> f64 {
        self.periods() / f64::from(self.samples.saturating_sub(1).max(1))
    }

    /// It is long enough to teach, or so long that it never will.
    pub fn has_ended(&self) -> bool {
        let teaches = self.samples >= SHORTEST && self.periods() >= PERIODS;
        teaches || self.samples >= LONGEST
    }

    fn way(&self) -> f64 {
        Periods(self.last.way_from(self.first)).turns()
    }

    /// What it says of the harmonics.
    pub(super) fn beside(&self) -> Result<Beside, SweepError> {
        if self.samples < SHORTEST {
            return Err(SweepError::TooShort { periods: self.periods() });
        }
        if self.periods() < PERIODS {
            return Err(SweepError::TooSlow { speed: self.speed() });
        }
        let taken = self.without_motion().ok_or(SweepError::TooSlow { speed: self.speed() })?;
        let strays = libm::sqrt((taken.squares / f64::from(self.samples)).max(0.0));
        if strays > STRAYS {
            return Err(SweepError::NotSmooth { strays });
        }
        self.check_speed(&taken)?;
        let mut matrix = [[0.0; WAVES]; WAVES];
        let rows = taken.matrix.iter().skip(CURVE);
        matrix.iter_mut().zip(rows).for_each(|(to, row)| *to = of_waves(row));
        Ok(Beside {
            matrix,
            right: of_waves(&taken.right),
            squares: taken.squares,
            samples: self.samples,
            periods: self.periods(),
            parts: self.parts,
        })
    }

    /// The normal equations with the constants of the motion eliminated (Gauss).
    fn without_motion(&self) -> Option<Self> {
        let mut taken = self.clone();
        for k in 0..CURVE {
            let (above, value) = (*taken.matrix.get(k)?, *taken.right.get(k)?);
            let pivot = *above.get(k)?;
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            taken.squares -= value * value / pivot;
            for (row, right) in taken.matrix.iter_mut().zip(&mut taken.right).skip(k).skip(1) {
                let part = row.get(k)? / pivot;
                row.iter_mut().zip(above).for_each(|(cell, above)| *cell -= part * above);
                *right -= part * value;
            }
        }
        Some(taken)
    }

    /// The motion goes one way all along, at nearly one speed.
    fn check_speed(&self, taken: &Self) -> Result<(), SweepError> {
        let [_, first, second, third] = taken.motion();
        let speed = |at: f64| (first + 2.0 * second * at + 3.0 * third * at * at) / UNIT;
        let end = f64::from(self.samples) / UNIT - 1.0;
        let forward = if self.way() < 0.0 { -1.0 } else { 1.0 };
        let speeds = [-1.0, (end - 1.0) / 2.0, end].map(|at| forward * speed(at));
        let slowest = speeds.into_iter().fold(f64::INFINITY, f64::min);
        let fastest = speeds.into_iter().fold(f64::NEG_INFINITY, f64::max);
        if slowest >= STEADY * fastest { Ok(()) } else { Err(SweepError::NotSteady { slowest, fastest }) }
    }

    /// The cubic, after its elimination.
    fn motion(&self) -> [f64; CURVE] {
        let mut motion = [0.0; CURVE];
        for k in (0..CURVE).rev() {
            let (Some(row), Some(right)) = (self.matrix.get(k), self.right.get(k)) else { continue };
            let others: f64 = row.iter().zip(motion).skip(k).skip(1).map(|(cell, value)| cell * value).sum();
            if let (Some(place), Some(pivot)) = (motion.get_mut(k), row.get(k)) {
                *place = (right - others) / pivot;
            }
        }
        motion
    }
}

/// The part of a row that belongs to the harmonics.
fn of_waves(row: &[f64; UNKNOWNS]) -> [f64; WAVES] {
    let mut part = [0.0; WAVES];
    part.iter_mut().zip(row.iter().skip(CURVE)).for_each(|(to, from)| *to = *from);
    part
}

/// A cubic in time, and the harmonics of the phase.
fn regressors(time: f64, turns: f64) -> [f64; UNKNOWNS] {
    let mut row = [0.0; UNKNOWNS];
    let (curve, waves) = row.split_at_mut(CURVE);
    curve
        .iter_mut()
        .zip([1.0, time, time * time, time * time * time])
        .for_each(|(cell, value)| *cell = value);
    let (sin, cos) = (libm::sin(TAU * turns), libm::cos(TAU * turns));
    // Each harmonic is the one before it turned on by the first.
    let mut now = [cos, sin];
    for pair in waves.chunks_exact_mut(2) {
        pair.iter_mut().zip(now).for_each(|(cell, value)| *cell = value);
        now = [now[0] * cos - now[1] * sin, now[1] * cos + now[0] * sin];
    }
    row
}
