//! How good the signals of an analogue encoder are, and when they are too bad to know the position by.
//!
//! Findings are gathered over a block of 256 samples and graded; what endangers the count of periods does not wait for
//! the end of a block: it is a [`SignalFault`] in the very sample that shows it, or a few later.

mod grade;

pub use grade::*;

use super::correct::CODE_BITS;
use core::fmt;

/// What was found, by how bad it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Report {
    /// To be looked at.
    pub warn: Findings,
    /// Beyond use.
    pub fail: Findings,
    /// All that any block was found to be since the ellipse was first fitted, or since power-on: a finding lasts a block, and
    /// who asks seldom would miss it.
    pub ever: Findings,
    /// Mean amplitude of the block, in 1/256 of what it should be.
    pub amplitude: u16,
    /// Mean change of the radius from sample to sample, in 1/4096 of the amplitude.
    pub noise: u16,
}

impl Report {
    /// The worst of all.
    pub const fn grade(&self) -> Grade {
        match (self.fail.0, self.warn.0) {
            (0, 0) => Grade::Good,
            (0, _) => Grade::Warn,
            _ => Grade::Fail,
        }
    }
}

/// Why the position cannot be known any more, or only for a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum SignalFault {
    /// No signal: a pulled plug, a dead lamp, dirt.
    Lost,
    /// The vector is far off its circle: a channel stands still, or both are at the end of the converter.
    OffCircle,
    /// The converter gives no samples.
    Missed,
    /// Count and phase differ by more than 5/16 of a period.
    Disagrees,
    /// The motion changed by more than five sixteenths of a period in one sample.
    Fast,
    /// The count jumped by a whole period, or by several.
    Slipped,
}

impl fmt::Display for SignalFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Lost => "no encoder signal",
            Self::OffCircle => "the encoder signals are distorted beyond use",
            Self::Missed => "the encoder gives no samples",
            Self::Disagrees => "the encoder's count and phase disagree",
            Self::Fast => "the motion is too fast for the encoder's samples",
            Self::Slipped => "the encoder's position jumped: counts were lost or won, or a signal is false",
        })
    }
}

/// Samples in a row that must show a lost or distorted signal; one alone may be a spike.
pub const IN_A_ROW: u8 = 3;
/// Samples in a row that may be missing.
pub const MISSED_IN_A_ROW: u8 = 8;
/// A lost signal is shorter than 3/8 of the nominal radius: dirt that takes one channel alone leaves the other long enough
/// for a while, and the comparators must still count. One that dips is shorter than 9/16 of it, one far off its circle longer
/// than 7/4; in sixteenths.
const LOST: u32 = 6;
const DIPS: u32 = 9;
const FAR: u32 = 28;
/// A vector shorter than this part of the radius that it should have has no phase.
pub const SHORT: f64 = LOST as f64 / 16.0;
/// Samples of a block that must dip: dirt may pass too quickly for the mean of a block to show it.
const FEWEST_DIPS: u16 = 3;
/// Count and phase: 3/16 of a period is to be looked at, 5/16 a fault; half a period would be a wrong position.
pub const DISAGREES_WARN: u32 = 3 << 28;
/// See [`DISAGREES_WARN`].
pub const DISAGREES_FAULT: u32 = 5 << 28;
/// Surprise of a followed phase: 1/4 of a period is to be looked at, 5/16 a fault. One wild sample surprises twice, by s and
/// by −2s; were 3/8 allowed, both might pass and a period be lost.
pub const FAST_WARN: u32 = 4 << 28;
/// See [`FAST_WARN`].
pub const FAST_FAULT: u32 = 5 << 28;
/// Nothing to be looked at up to here, whatever it is.
const BESIDE_WARN: u32 = if DISAGREES_WARN < FAST_WARN { DISAGREES_WARN } else { FAST_WARN };

/// What one sample shows.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Length of the corrected vector, with [`CODE_BITS`].
    pub radius: u32,
    /// A channel is at an end of the converter.
    pub clipped: bool,
    /// Count against phase; or, without a counter, found against expected position: 2⁻³² of a period.
    pub beside: i32,
    /// A counter counts.
    pub counted: bool,
    /// The position jumped by periods, and stays there: see [`super::course`].
    pub slipped: bool,
}

/// What watching the signals of an axis remembers.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Health {
    /// Nominal radius without fractional bits: sums of a block fit a word.
    nominal: u32,
    /// Radii, with [`CODE_BITS`]: shorter ones are lost, or dip; longer ones are far off the circle.
    short: u32,
    dip: u32,
    long: u32,
    /// In a row: lost, far off, missed.
    lost: u8,
    far: u8,
    missed: u8,
    /// Samples of the running block, and what they showed.
    ticks: u8,
    sum: u32,
    changes: u32,
    clips: u16,
    misses: u16,
    dips: u16,
    last: u32,
    warn: Findings,
    /// Of the ellipse: it changes between ticks.
    shape: [Findings; 2],
    /// A block has ended.
    has_graded: bool,
    /// The last block: what was found, to be looked at and beyond use, and its sums of radii and of their changes.
    graded: [Findings; 2],
    ended: [u32; 2],
    /// Of all blocks so far.
    ever: Findings,
}

impl Health {
    /// For signals whose corrected radius is `nominal`, with [`CODE_BITS`]; at least one code.
    pub fn new(nominal: u32) -> Self {
        let nominal = (nominal >> CODE_BITS).max(1);
        // 2¹⁷ · 2⁸ / 2⁴ · 28 fits a word.
        let part = |sixteenths: u32| (nominal << CODE_BITS >> 4).wrapping_mul(sixteenths);
        Self {
            nominal,
            short: part(LOST),
            dip: part(DIPS),
            long: part(FAR),
            lost: 0,
            far: 0,
            missed: 0,
            ticks: 0,
            sum: 0,
            changes: 0,
            clips: 0,
            misses: 0,
            dips: 0,
            last: nominal,
            warn: Findings::NONE,
            shape: [Findings::NONE; 2],
            has_graded: false,
            graded: [Findings::NONE; 2],
            ended: [0; 2],
            ever: Findings::NONE,
        }
    }

    /// What the last block of 256 samples was like, once there was one. Divides: for who asks, not for the tick.
    pub fn report(&self) -> Option<Report> {
        if !self.has_graded {
            return None;
        }
        let [warn, fail] = self.graded;
        let [sum, changes] = self.ended;
        let nominals_in = |sum: u32| sum.checked_div(self.nominal).unwrap_or(0) as u16;
        Some(Report {
            warn,
            fail,
            ever: self.ever,
            amplitude: nominals_in(sum),
            noise: nominals_in(changes.wrapping_mul(16)),
        })
    }

    /// Takes note of the [`shape`] of the ellipse in use, between ticks.
    pub fn take_shape(&mut self, shape: [Findings; 2]) {
        self.shape = shape;
    }

    /// What was found so far was found with an ellipse that nobody had fitted.
    pub fn forget(&mut self) {
        self.ever = Findings::NONE;
    }

    /// One sample.
    #[inline]
    pub fn sample(&mut self, sample: &Sample) -> Option<SignalFault> {
        let radius = sample.radius >> CODE_BITS;
        self.sum = self.sum.wrapping_add(radius);
        self.changes = self.changes.wrapping_add(radius.abs_diff(self.last));
        self.last = radius;
        self.missed = 0;
        let round = sample.radius >= self.dip && sample.radius <= self.long;
        let beside = sample.beside.unsigned_abs() > BESIDE_WARN;
        let fault = if !round || beside || sample.clipped || sample.slipped {
            self.judge(sample.radius, sample.beside, sample.clipped, sample.counted, sample.slipped)
        } else {
            (self.lost, self.far) = (0, 0);
            None
        };
        self.end_of_sample();
        fault
    }

    /// A sample that did not come.
    #[cold]
    pub fn miss(&mut self) -> Option<SignalFault> {
        self.missed = self.missed.saturating_add(1);
        self.misses = self.misses.wrapping_add(1);
        self.sum = self.sum.wrapping_add(self.last);
        self.warn = self.warn.and(Findings::MISSED);
        self.end_of_sample();
        (self.missed > MISSED_IN_A_ROW).then_some(SignalFault::Missed)
    }

    /// A sample that is not as it should be. By its parts: whole, it would be put into memory in every tick.
    #[cold]
    fn judge(
        &mut self,
        radius: u32,
        beside: i32,
        clipped: bool,
        counted: bool,
        slipped: bool,
    ) -> Option<SignalFault> {
        let count = |in_a_row: u8, so: bool| if so { in_a_row.saturating_add(1) } else { 0 };
        self.lost = count(self.lost, radius < self.short);
        self.far = count(self.far, radius > self.long);
        self.dips = self.dips.wrapping_add(u16::from(radius < self.dip));
        self.clips = self.clips.wrapping_add(u16::from(clipped));
        let (finding, warn, worst) = if counted {
            (Findings::DISAGREES, DISAGREES_WARN, (DISAGREES_FAULT, SignalFault::Disagrees))
        } else {
            (Findings::FAST, FAST_WARN, (FAST_FAULT, SignalFault::Fast))
        };
        let beside = beside.unsigned_abs();
        self.warn = self.warn.and(finding.when(beside > warn));
        if slipped {
            return Some(SignalFault::Slipped);
        }
        if self.lost >= IN_A_ROW {
            return Some(SignalFault::Lost);
        }
        if self.far >= IN_A_ROW {
            return Some(SignalFault::OffCircle);
        }
        // A vector without length has no phase worth judging.
        (self.lost == 0 && beside > worst.0).then_some(worst.1)
    }

    /// Whether a vector of this length, with [`CODE_BITS`], is too short to have a phase.
    #[inline]
    pub fn is_short(&self, radius: u32) -> bool {
        radius < self.short
    }

    #[inline]
    fn end_of_sample(&mut self) {
        self.ticks = self.ticks.wrapping_add(1);
        if self.ticks == 0 {
            self.end_of_block();
        }
    }

    /// A block of 256 ends with the sample just seen.
    #[inline]
    pub fn ends_block(&self) -> bool {
        self.ticks == 0
    }

    /// Grades the block. Once in 256 samples, without a division.
    #[cold]
    fn end_of_block(&mut self) {
        // The nominal in sixteenths times the samples of a block: 16 of it are the whole.
        let sixteenth = self.nominal.wrapping_mul(256 / 16);
        let times = |number: u32| sixteenth.wrapping_mul(number);
        // 2⁸ · 2¹⁷ · 50 fits a word.
        let changes = |parts: u32| self.changes.wrapping_mul(parts) > self.nominal.wrapping_mul(256);
        let fail = Findings::WEAK
            .when(self.sum < times(8))
            .and(Findings::STRONG.when(self.sum > times(24)))
            .and(Findings::CLIPPED.when(self.clips > 4))
            .and(Findings::NOISY.when(changes(16)))
            .and(Findings::MISSED.when(self.misses > 32));
        let warn = Findings::WEAK
            .when(self.sum < times(11) || self.dips >= FEWEST_DIPS)
            .and(Findings::STRONG.when(self.sum > times(19)))
            .and(Findings::CLIPPED.when(self.clips > 0))
            .and(Findings::NOISY.when(changes(32)));
        let [shape_warn, shape_fail] = self.shape;
        let fail = fail.and(shape_fail);
        let warn = self.warn.and(warn).and(shape_warn);
        self.has_graded = true;
        self.graded = [Findings(warn.0 & !fail.0), fail];
        self.ever = self.ever.and(warn).and(fail);
        self.ended = [self.sum, self.changes];
        self.sum = 0;
        self.changes = 0;
        self.clips = 0;
        self.misses = 0;
        self.dips = 0;
        self.warn = Findings::NONE;
    }

    /// Illegal transitions of the counter belong to the picture, too.
    #[cold]
    pub fn illegal(&mut self) {
        self.warn = self.warn.and(Findings::ILLEGAL);
    }
}

#[cfg(test)]
mod tests;
