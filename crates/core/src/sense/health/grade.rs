//! What can be wrong with the signals of an analogue encoder, and from where on: one table for the tick and for files.

use crate::sense::ellipse::Ellipse;
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
    pub(super) const fn when(self, so: bool) -> Self {
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
