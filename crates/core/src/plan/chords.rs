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

/// The chords of a [`Wave`], one line after the other. Floats: between ticks, not in one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Chords {
    wave: Wave,
    from: [Counts; 2],
    per_period: u32,
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
        if !(tolerance >= FINEST && tolerance.is_finite()) {
            return Err(WaveError::Tolerance(tolerance));
        }
        within_reach(from)?;
        let per_period = chords_per_period(wave.amplitude, tolerance);
        let chords = Self { wave: *wave, from, per_period, done: 0, reached: from };
        if wave.periods > 0 {
            chords.crests().into_iter().try_for_each(|crest| within_reach(crest).map(drop))?;
        }
        Ok(chords)
    }

    /// Chords of a whole period, a multiple of four.
    pub fn per_period(&self) -> u32 {
        self.per_period
    }

    /// Chords still to go.
    pub fn remaining(&self) -> u64 {
        u64::from(self.per_period).saturating_mul(u64::from(self.wave.periods)).saturating_sub(self.done)
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
        let per_period = u64::from(self.per_period);
        let (periods, part) =
            (chord.checked_div(per_period).unwrap_or(0), chord.checked_rem(per_period).unwrap_or(0));
        let swing = self.swing(part).saturating_sub(self.swing(0));
        self.place(self.gone(periods, part), swing)
    }

    /// The way along after whole periods and some chords.
    fn gone(&self, periods: u64, part: u64) -> i64 {
        let (period, per_period) = (self.wave.period.get(), i64::from(self.per_period));
        // A period and a number of chords have 31 bits at most.
        let twice = period.saturating_mul(part as i64).saturating_mul(2).saturating_add(per_period);
        let begun = twice.checked_div_euclid(per_period.saturating_mul(2)).unwrap_or(0);
        period.saturating_mul(periods as i64).saturating_add(begun)
    }

    /// A sin θ after some chords of a period, in whole counts.
    fn swing(&self, part: u64) -> i64 {
        let turns = part as f64 / f64::from(self.per_period) + f64::from(self.wave.phase) / 4_294_967_296.0;
        let turns = if turns >= 1.0 { turns - 1.0 } else { turns };
        libm::round(self.wave.amplitude.get() as f64 * libm::sin(TAU * turns)) as i64
    }

    /// A point by its way along from the start, and across.
    fn place(&self, along: i64, across: i64) -> [Counts; 2] {
        let (along, across) = (Counts::new(along), Counts::new(across));
        let [x, y] = self.from;
        match self.wave.along {
            Axis::X => [x + along, y + across],
            Axis::Y => [x + across, y + along],
        }
    }

    /// What lies farthest: one crest at the start, the other at the end.
    fn crests(&self) -> [[Counts; 2]; 2] {
        let (amplitude, begun) = (self.wave.amplitude.get(), self.swing(0));
        let end = self.wave.period.get().saturating_mul(i64::from(self.wave.periods));
        let [up, down] = [amplitude, amplitude.saturating_neg()].map(|crest| crest.saturating_sub(begun));
        [self.place(0, up), self.place(end, down)]
    }
}

/// The smallest multiple of four with which no chord is farther than `tolerance` from a sine of that amplitude.
fn chords_per_period(amplitude: Counts, tolerance: f64) -> u32 {
    let amplitude = libm::fabs(amplitude.get() as f64);
    // From 4 A on, and without any amplitude, four chords do: sin²(H/2) is limited to 1.
    let sine = libm::sqrt((tolerance / (2.0 * amplitude)).min(1.0));
    let quarter = libm::ceil(PI / (8.0 * libm::asin(sine)));
    (quarter.max(1.0) as u32).saturating_mul(4)
}

#[cfg(test)]
mod tests;
