//! How good the signals of an analogue encoder are, and when they are too bad to know the position by.
//!
//! Findings are gathered over a block of 256 samples and graded; what endangers the count of periods does not wait for
//! the end of a block: it is a [`SignalFault`] in the very sample that shows it, or a few later.

use super::correct::CODE_BITS;
use super::ellipse::Ellipse;
use core::fmt;

/// What can be wrong with the signals, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Findings(pub u16);

impl Findings {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// The amplitude is low: contamination, distance, an ageing lamp.
    pub const WEAK: Self = Self(1);
    /// The amplitude is high.
    pub const STRONG: Self = Self(1 << 1);
    /// Samples at the end of the converter.
    pub const CLIPPED: Self = Self(1 << 2);
    /// The radius changes from sample to sample.
    pub const NOISY: Self = Self(1 << 3);
    /// Samples did not come.
    pub const MISSED: Self = Self(1 << 4);
    /// Count and phase differ.
    pub const DISAGREES: Self = Self(1 << 5);
    /// The motion changes too fast to be followed from sample to sample.
    pub const FAST: Self = Self(1 << 6);
    /// An offset is large.
    pub const OFFSET: Self = Self(1 << 7);
    /// The amplitudes of the channels differ.
    pub const GAIN: Self = Self(1 << 8);
    /// The channels are far from a quarter of a period apart.
    pub const QUADRATURE: Self = Self(1 << 9);
    /// Illegal transitions of the counter.
    pub const ILLEGAL: Self = Self(1 << 10);

    /// Each with its words.
    pub const NAMES: [(Self, &'static str); 11] = [
        (Self::WEAK, "weak"),
        (Self::STRONG, "strong"),
        (Self::CLIPPED, "clipped"),
        (Self::NOISY, "noisy"),
        (Self::MISSED, "samples missed"),
        (Self::DISAGREES, "count and phase disagree"),
        (Self::FAST, "too fast to follow"),
        (Self::OFFSET, "offset"),
        (Self::GAIN, "unequal amplitudes"),
        (Self::QUADRATURE, "out of quadrature"),
        (Self::ILLEGAL, "illegal transitions"),
    ];

    /// These and others.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// These if it is so.
    #[must_use]
    const fn when(self, so: bool) -> Self {
        if so { self } else { Self::NONE }
    }

    /// All of the others are among these.
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut between = "";
        for (_, name) in Self::NAMES.iter().filter(|(finding, _)| self.has(*finding)) {
            write!(f, "{between}{name}")?;
            between = ", ";
        }
        Ok(())
    }
}

/// How good the signals are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Grade {
    /// As they should be.
    #[default]
    Good,
    /// Usable; somebody should look at the encoder.
    Warn,
    /// Not to be trusted.
    Fail,
}

impl fmt::Display for Grade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Good => "good",
            Self::Warn => "warn",
            Self::Fail => "fail",
        })
    }
}

/// From where on a figure is to be looked at, and from where on it is beyond use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// To be looked at above this.
    pub warn: f64,
    /// Beyond use above this.
    pub fail: f64,
}

impl Bounds {
    /// The grade of a figure.
    pub fn grade(&self, value: f64) -> Grade {
        match value {
            value if value > self.fail => Grade::Fail,
            value if value > self.warn => Grade::Warn,
            _ => Grade::Good,
        }
    }
}

/// Larger of both offsets, parts of the amplitude. Before it is taken off, a tenth errs by 12.7 nm of 0.8 µm: an encoder
/// that is so far out of adjustment can be corrected, but somebody should look at it. The bounds are ours, as are all here.
pub const OFFSET: Bounds = Bounds { warn: 0.10, fail: 0.25 };
/// The larger amplitude over the smaller; the bounds err as those of the offset do.
pub const GAIN: Bounds = Bounds { warn: 1.2, fail: 1.5 };
/// From a quarter of a period, degrees; the bounds err by an eighth less than those of the offset.
pub const QUADRATURE_DEG: Bounds = Bounds { warn: 10.0, fail: 25.0 };
/// Noise of a channel, parts of the amplitude rms; the tick finds it as 1/32 and 1/16 of the amplitude from sample to sample
/// in the mean, which is 2/√π of this.
pub const NOISE: Bounds = Bounds { warn: 0.0277, fail: 0.0554 };
/// What the amplitude lacks of what it should be.
pub const WEAKNESS: Bounds = Bounds { warn: 5.0 / 16.0, fail: 8.0 / 16.0 };
/// Samples at the end of the converter, parts of all; the tick counts 4 of 256.
pub const CLIPPED: Bounds = Bounds { warn: 0.0, fail: 1.0 / 64.0 };
/// Motion that was not expected from one sample to the next, parts of a period, where no counter counts; at a half periods
/// are lost.
pub const SURPRISE: Bounds = Bounds { warn: 0.25, fail: 0.3125 };

/// What an ellipse is like, by the figures that have bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// See [`OFFSET`].
    pub offset: f64,
    /// See [`GAIN`].
    pub gain: f64,
    /// See [`QUADRATURE_DEG`].
    pub quadrature_deg: f64,
}

impl Shape {
    /// Of an ellipse around zero.
    pub fn of(ellipse: &Ellipse) -> Self {
        Self {
            offset: ellipse.p.abs().max(ellipse.q.abs()) / ellipse.radius,
            gain: ellipse.r.max(1.0 / ellipse.r),
            quadrature_deg: ellipse.alpha.abs().to_degrees(),
        }
    }
}

/// What is to be looked at and what is beyond use of an ellipse. Floats: between ticks.
pub fn shape(ellipse: &Ellipse) -> [Findings; 2] {
    let Shape { offset, gain, quadrature_deg } = Shape::of(ellipse);
    let all = [
        (Findings::OFFSET, OFFSET.grade(offset)),
        (Findings::GAIN, GAIN.grade(gain)),
        (Findings::QUADRATURE, QUADRATURE_DEG.grade(quadrature_deg)),
    ];
    [Grade::Warn, Grade::Fail].map(|wanted| {
        all.iter().fold(Findings::NONE, |found, (finding, grade)| found.and(finding.when(*grade == wanted)))
    })
}

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
mod tests {
    use super::*;

    const NOMINAL: u32 = 24_000 << CODE_BITS;
    const GOOD: Sample = Sample { radius: NOMINAL, clipped: false, beside: 0, counted: true, slipped: false };

    fn after(samples: impl Iterator<Item = Sample>) -> (Report, Option<(usize, SignalFault)>) {
        let mut health = Health::new(NOMINAL);
        let mut first = None;
        for (k, sample) in samples.enumerate() {
            let fault = health.sample(&sample);
            first = first.or(fault.map(|fault| (k, fault)));
        }
        (health.report().unwrap_or_default(), first)
    }

    fn grade(sample: impl Fn(u32) -> Sample) -> (Grade, Findings) {
        let (report, fault) = after((0..512).map(sample));
        assert_eq!(fault, None);
        (report.grade(), report.warn.and(report.fail))
    }

    #[test]
    fn each_finding_has_its_grades() {
        let radius = |part: f64| move |_| Sample { radius: (f64::from(NOMINAL) * part) as u32, ..GOOD };
        assert_eq!(grade(radius(1.0)), (Grade::Good, Findings::NONE));
        assert_eq!(grade(radius(0.65)), (Grade::Warn, Findings::WEAK));
        assert_eq!(grade(radius(0.4)), (Grade::Fail, Findings::WEAK));
        assert_eq!(grade(radius(1.25)), (Grade::Warn, Findings::STRONG));
        assert_eq!(grade(radius(1.6)), (Grade::Fail, Findings::STRONG));
        let clipped = |every| move |k: u32| Sample { clipped: k.is_multiple_of(every), ..GOOD };
        assert_eq!(grade(clipped(100)), (Grade::Warn, Findings::CLIPPED));
        assert_eq!(grade(clipped(50)), (Grade::Fail, Findings::CLIPPED));
        let noisy = |part: f64| {
            move |k: u32| Sample {
                radius: (f64::from(NOMINAL) * (1.0 + part * f64::from(k % 2))) as u32,
                ..GOOD
            }
        };
        assert_eq!(grade(noisy(0.01)).0, Grade::Good);
        assert_eq!(grade(noisy(0.04)), (Grade::Warn, Findings::NOISY));
        assert_eq!(grade(noisy(0.1)), (Grade::Fail, Findings::NOISY));
        assert_eq!(grade(|_| Sample { beside: -(4 << 28), ..GOOD }), (Grade::Warn, Findings::DISAGREES));
        assert_eq!(
            grade(|_| Sample { beside: 5 << 28, counted: false, ..GOOD }),
            (Grade::Warn, Findings::FAST)
        );
    }

    /// The tick compares whole numbers; they are the bounds that files are graded by.
    #[test]
    fn the_tick_grades_by_the_table_of_bounds() {
        let of = |bounds: Bounds, grade: &dyn Fn(f64) -> Grade| {
            let at = [bounds.warn - 0.004, bounds.warn + 0.004, bounds.fail - 0.004, bounds.fail + 0.004];
            assert_eq!(at.map(grade), [Grade::Good, Grade::Warn, Grade::Warn, Grade::Fail], "{bounds:?}");
        };
        let part = |part: f64| (f64::from(NOMINAL) * part) as u32;
        of(WEAKNESS, &|lacks| grade(|_| Sample { radius: part(1.0 - lacks), ..GOOD }).0);
        let change = core::f64::consts::FRAC_2_SQRT_PI;
        of(NOISE, &|noise| {
            grade(|k| Sample { radius: part(1.0 + change * noise * f64::from(k % 2)), ..GOOD }).0
        });
        let clipped = |of_256: u32| grade(|k| Sample { clipped: k % 256 < of_256, ..GOOD }).0;
        assert_eq!([0, 1, 4, 5].map(clipped), [Grade::Good, Grade::Warn, Grade::Warn, Grade::Fail]);
        assert_eq!([1, 4, 5].map(|of| CLIPPED.grade(f64::from(of) / 256.0)), [1, 4, 5].map(clipped));
        assert_eq!(SURPRISE.warn, f64::from(FAST_WARN) / 4_294_967_296.0);
        assert_eq!(SURPRISE.fail, f64::from(FAST_FAULT) / 4_294_967_296.0);
    }

    #[test]
    fn what_endangers_the_count_is_a_fault_at_once() {
        let from = |bad: Sample| after((0..200).map(|k| if k < 100 { GOOD } else { bad })).1;
        assert_eq!(from(Sample { radius: NOMINAL / 5, ..GOOD }), Some((102, SignalFault::Lost)));
        assert_eq!(from(Sample { radius: NOMINAL * 2, ..GOOD }), Some((102, SignalFault::OffCircle)));
        let far = Sample { beside: DISAGREES_FAULT as i32 + 1, ..GOOD };
        assert_eq!(from(far), Some((100, SignalFault::Disagrees)));
        assert_eq!(from(Sample { beside: i32::MIN, ..GOOD }), Some((100, SignalFault::Disagrees)));
        let fast = Sample { beside: FAST_FAULT as i32 + 1, counted: false, ..GOOD };
        assert_eq!(from(fast), Some((100, SignalFault::Fast)));
        assert_eq!(from(Sample { slipped: true, ..GOOD }), Some((100, SignalFault::Slipped)));
        let spike = after((0..200).map(|k| if k == 100 { Sample { radius: 0, ..GOOD } } else { GOOD }));
        assert_eq!(spike.1, None);
        let mut health = Health::new(NOMINAL);
        let missed: Vec<_> = (0..10).map(|_| health.miss()).collect();
        assert_eq!(missed[8], Some(SignalFault::Missed));
        assert_eq!(missed[7], None);
    }

    #[test]
    fn the_ellipse_is_part_of_the_picture() {
        let of = |ellipse: Ellipse| {
            let mut health = Health::new(NOMINAL);
            health.take_shape(shape(&ellipse));
            (0..255).for_each(|_| _ = health.sample(&GOOD));
            assert_eq!(health.report(), None);
            health.sample(&GOOD);
            health.report().unwrap()
        };
        let circle = Ellipse::circle(24_000.0);
        assert_eq!(of(circle).grade(), Grade::Good);
        assert_eq!(of(Ellipse { p: 3000.0, ..circle }).warn, Findings::OFFSET);
        assert_eq!(of(Ellipse { r: 0.6, ..circle }).fail, Findings::GAIN);
        let both = of(Ellipse { alpha: 0.2, q: 7300.0, ..circle });
        assert_eq!((both.warn, both.fail), (Findings::QUADRATURE, Findings::OFFSET));
        assert_eq!(both.warn.and(both.fail).to_string(), "offset, out of quadrature");
    }

    #[test]
    fn what_a_block_was_found_to_be_is_not_forgotten() {
        let clipped = |k: u32| Sample { clipped: k == 5, ..GOOD };
        let (report, _) = after((0..1024).map(clipped));
        assert_eq!((report.grade(), report.ever), (Grade::Good, Findings::CLIPPED));
    }
}
