//! Sine and cosine motion as chords (paper row A8): the angle in equal parts, the chord of each run as a [`Line`].
//!
//! [`Chords`] is slow work, outside the tick: it takes a sine in floats for the end of each chord. A [`Line`] is what the
//! tick walks, in integers. Each end is computed from the beginning and rounded once, so nothing adds up over periods.
//!
//! # How many chords
//!
//! Over the angles m ± H the sine minus its chord is, at m + t,
//!
//! ```text
//! sin m · (cos t − cos H) + cos m · (sin t − c t),   c = sin H / H
//! ```
//!
//! at most √g with g(t) = (cos t − cos H)² + (sin t − c t)², whatever m is. For H ≤ π/2, g falls from t = 0 on both ways:
//! −g'/2 = (c − cos H) sin t + c t (cos t − c) is zero at 0 and at H and bends downwards between (its second derivative is
//! −(c − cos H) sin t − c (2 sin t + t cos t)), so it is nowhere negative. Hence the chord is nowhere farther from the
//! sine, measured across, than in the middle of the one that spans a crest:
//!
//! ```text
//! A (1 − cos H) = 2 A sin²(H/2)
//! ```
//!
//! With n chords a period H is π/n, and a tolerance T asks for n ≥ π / 2 asin √(T/2A). The next multiple of four is taken:
//! then H ≤ π/4, and a phase of whole quarters has its crests and zeros on chord ends.
//!
//! # How far beside the sine
//!
//! A chord: T at most. Its ends lie in whole counts, √½ beside at most, and so does what is between them; the line is walked
//! √½ beside at most. So each point is within T + √2 counts of the sine (`every_point_is_near_the_sine`).

use super::compare::{Axis, Line, TooFar, within_reach};
use crate::units::Counts;
use core::f64::consts::{PI, TAU};
use core::fmt;

/// The smallest tolerance of a chord, counts: what is walked is rounded to a count.
pub const FINEST: f64 = 0.001;

/// A sine across one axis while the other goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wave {
    /// The axis that goes on; the other one swings.
    pub along: Axis,
    /// Half the height from crest to crest. Below zero the sine begins downwards.
    pub amplitude: Counts,
    /// The way along in a period. Below zero it goes backwards; zero is a swing on the spot.
    pub period: Counts,
    /// How many.
    pub periods: u32,
    /// Where it begins, 2⁻³² of a period: 0 is a sine, 2³⁰ a cosine.
    pub phase: u32,
}

/// Why there is no such wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WaveError {
    /// Its end or a crest lies too far off.
    TooFar(TooFar),
    /// The tolerance is no number of at least [`FINEST`] counts.
    Tolerance(f64),
}

impl fmt::Display for WaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFar(too_far) => write!(f, "{too_far}"),
            Self::Tolerance(_) => f.write_str("the tolerance of a chord must be at least 0.001 counts"),
        }
    }
}

impl core::error::Error for WaveError {}

impl From<TooFar> for WaveError {
    fn from(too_far: TooFar) -> Self {
        Self::TooFar(too_far)
    }
}

/// A sine about the straight line from where it begins to another place, whole periods of it, in any direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Where it ends.
    pub to: [Counts; 2],
    /// Half the height from crest to crest, counts; above zero it begins to the left of the line. A part of a count counts.
    pub amplitude: f64,
    /// How many periods, at least one.
    pub periods: u32,
    /// Where it begins, 2⁻³² of a period: 0 is a sine, 2³⁰ a cosine.
    pub phase: u32,
}

/// The chords of a [`Wave`] or a [`Swing`], one line after the other. Floats: between ticks, not in one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Chords {
    from: [Counts; 2],
    to: [Counts; 2],
    /// From the line to a crest, in each axis.
    across: [f64; 2],
    /// Where it begins, 2⁻³² of a period.
    phase: u32,
    per_period: u32,
    /// Of the whole sine.
    count: u64,
    /// Chords that were handed out.
    done: u64,
    /// Where the last one ended.
    reached: [Counts; 2],
}

impl Chords {
    /// The chords of a wave that begins at `from`, each within `tolerance` counts of the sine.
    ///
    /// # Errors
    /// A point of the wave beyond ± [`FARTHEST`](super::compare::FARTHEST), or no such tolerance.
    pub fn new(wave: &Wave, from: [Counts; 2], tolerance: f64) -> Result<Self, WaveError> {
        let gone = Counts::new(wave.period.get().saturating_mul(i64::from(wave.periods)));
        let (amplitude, [x, y]) = (wave.amplitude.get() as f64, from);
        let (to, across) = match wave.along {
            Axis::X => ([x + gone, y], [0.0, amplitude]),
            Axis::Y => ([x, y + gone], [amplitude, 0.0]),
        };
        Self::between(from, to, across, [wave.periods, wave.phase], tolerance)
    }

    /// The same of a sine about a line.
    ///
    /// # Errors
    /// As of [`Chords::new`].
    pub fn swinging(swing: &Swing, from: [Counts; 2], tolerance: f64) -> Result<Self, WaveError> {
        let [x, y] = way(from, swing.to);
        let length = libm::hypot(x, y);
        let left = if length > 0.0 { [-y / length, x / length] } else { [0.0; 2] };
        let across = left.map(|left| swing.amplitude * left);
        Self::between(from, swing.to, across, [swing.periods, swing.phase], tolerance)
    }

    fn between(
        from: [Counts; 2],
        to: [Counts; 2],
        across: [f64; 2],
        [periods, phase]: [u32; 2],
        tolerance: f64,
    ) -> Result<Self, WaveError> {
        if !(tolerance >= FINEST && tolerance.is_finite()) {
            return Err(WaveError::Tolerance(tolerance));
        }
        within_reach(from)?;
        let [x, y] = across;
        let per_period = chords_per_period(libm::hypot(x, y), tolerance);
        let count = u64::from(per_period).saturating_mul(u64::from(periods));
        let chords = Self { from, to, across, phase, per_period, count, done: 0, reached: from };
        if periods > 0 {
            within_reach(to)?;
            chords.crests().into_iter().try_for_each(|crest| within_reach(crest).map(drop))?;
        }
        Ok(chords)
    }

    /// Chords of a whole period, a multiple of four.
    pub fn per_period(&self) -> u32 {
        self.per_period
    }

    /// How far a chord is from the sine at most, before its ends are rounded, counts: the tolerance or less.
    pub fn farthest(&self) -> f64 {
        let [x, y] = self.across;
        let half = libm::sin(PI / (2.0 * f64::from(self.per_period)));
        2.0 * libm::hypot(x, y) * half * half
    }

    /// Chords still to go.
    pub fn remaining(&self) -> u64 {
        self.count.saturating_sub(self.done)
    }

    /// The next chord; `None` at the end. One that is shorter than a count may have no steps.
    pub fn next_line(&mut self) -> Option<Line> {
        if self.remaining() == 0 {
            return None;
        }
        let next = self.done.saturating_add(1);
        let end = self.end_of(next);
        let line = Line::new(self.reached, end).ok()?;
        (self.done, self.reached) = (next, end);
        Some(line)
    }

    /// Where chord number `chord` ends; 0 is the start.
    fn end_of(&self, chord: u64) -> [Counts; 2] {
        if chord == self.count {
            return self.to;
        }
        let part = chord.checked_rem(u64::from(self.per_period)).unwrap_or(0);
        self.place(chord as f64 / self.count as f64, self.height(part) - self.height(0))
    }

    /// sin θ after some chords of a period.
    fn height(&self, part: u64) -> f64 {
        let turns = part as f64 / f64::from(self.per_period) + f64::from(self.phase) / 4_294_967_296.0;
        libm::sin(TAU * if turns >= 1.0 { turns - 1.0 } else { turns })
    }

    /// A point by the part of the way along that is gone and its height across, in whole counts.
    fn place(&self, gone: f64, height: f64) -> [Counts; 2] {
        let ([x, y], [way_x, way_y], [across_x, across_y]) =
            (self.from, way(self.from, self.to), self.across);
        let rounded = |number: f64| Counts::new(libm::round(number) as i64);
        [x + rounded(gone * way_x + height * across_x), y + rounded(gone * way_y + height * across_y)]
    }

    /// What lies farthest: one crest and the other, at both ends.
    fn crests(&self) -> [[Counts; 2]; 4] {
        let begun = self.height(0);
        [(0.0, 1.0), (0.0, -1.0), (1.0, 1.0), (1.0, -1.0)]
            .map(|(gone, crest)| self.place(gone, crest - begun))
    }
}

/// From one point to another.
fn way([x, y]: [Counts; 2], [to_x, to_y]: [Counts; 2]) -> [f64; 2] {
    [to_x.get().saturating_sub(x.get()) as f64, to_y.get().saturating_sub(y.get()) as f64]
}

/// The smallest multiple of four with which no chord is farther than `tolerance` from a sine of that amplitude.
fn chords_per_period(amplitude: f64, tolerance: f64) -> u32 {
    // From 4 A on, and without any amplitude, four chords do: sin²(H/2) is limited to 1.
    let sine = libm::sqrt((tolerance / (2.0 * amplitude)).min(1.0));
    let quarter = libm::ceil(PI / (8.0 * libm::asin(sine)));
    (quarter.max(1.0) as u32).saturating_mul(4)
}

#[cfg(test)]
mod tests;
