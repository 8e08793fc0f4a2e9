//! Grades of a pair of signals, each with its reason.
//!
//! The bounds are ours. An offset of 10 % of the amplitude is 12.7 nm of 0.8 µm before correction, a quadrature error of
//! 5° 5.6 nm: beyond such, something is out of adjustment even though the fit takes it off. Noise is compared with
//! the position, 1 % of the amplitude being 0.16 % of a period.

use super::follow::{PARTS, Trail};
use super::method::Learned;
use super::signals::Signals;
use abbe_core::sense::ellipse::Ellipse;
use serde::Serialize;

/// How good a pair of signals is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Grade {
    Good,
    Warn,
    Fail,
}

impl Grade {
    /// As a word.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Warn => "warn",
            Self::Fail => "FAIL",
        }
    }
}

/// One thing that is not good.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Finding {
    pub(crate) grade: Grade,
    pub(crate) what: &'static str,
    pub(crate) reason: String,
}

/// From where on a figure is no longer good, and from where on it fails.
struct Bounds {
    what: &'static str,
    warn: f64,
    fail: f64,
}

impl Bounds {
    fn judge(&self, value: f64, reason: impl FnOnce() -> String) -> Option<Finding> {
        let grade = if value > self.fail {
            Grade::Fail
        } else if value > self.warn {
            Grade::Warn
        } else {
            return None;
        };
        Some(Finding { grade, what: self.what, reason: reason() })
    }
}

/// Part of the amplitude.
const OFFSET: Bounds = Bounds { what: "offset", warn: 0.10, fail: 0.30 };
/// Larger amplitude over the smaller, less one.
const GAIN: Bounds = Bounds { what: "gain", warn: 0.10, fail: 0.35 };
/// Degrees.
const QUADRATURE: Bounds = Bounds { what: "quadrature", warn: 5.0, fail: 15.0 };
/// Distance from the ellipse, rms part of its radius.
const SCATTER: Bounds = Bounds { what: "amplitude scatter", warn: 0.03, fail: 0.10 };
/// What a weak patch lacks of the radius.
const WEAK: Bounds = Bounds { what: "contamination", warn: 0.15, fail: 0.50 };
/// Part of the samples.
const SATURATION: Bounds = Bounds { what: "saturation", warn: 0.0, fail: 0.01 };
/// Rms part of a period.
const NOISE: Bounds = Bounds { what: "noise", warn: 0.003, fail: 0.02 };
/// Part of half a period.
const ALIASING: Bounds = Bounds { what: "speed", warn: 0.5, fail: 0.8 };
/// Parts of the period that were not seen.
const COVERAGE: Bounds = Bounds { what: "coverage", warn: 0.0, fail: PARTS as f64 / 4.0 };
/// What an amplitude lacks of full scale.
const SMALL: Bounds = Bounds { what: "small signal", warn: 0.6, fail: 0.9 };

/// All that is not good, the worst first.
pub(crate) fn findings(signals: &Signals<'_>, learned: &Learned, trail: &Trail) -> Vec<Finding> {
    let ellipse = &learned.signals;
    let samples = trail.samples as f64;
    let cut = learned.cut[0].max(learned.cut[1]);
    let percent = |part: f64| 100.0 * part;
    let [offset_a, offset_b] = offsets(ellipse, signals.scale.zero);
    let biased = is_biased(signals, ellipse);
    let offset = if biased { 0.0 } else { offset_a.abs().max(offset_b.abs()) };
    let gain = ellipse.r.max(1.0 / ellipse.r) - 1.0;
    let degrees = ellipse.alpha.to_degrees().abs();
    let scatter = trail.radius.deviation();
    let weak = if trail.weakest.is_finite() { 1.0 - trail.weakest } else { 0.0 };
    let noise = trail.noise();
    let surprise = 2.0 * trail.largest_surprise;
    let missing = PARTS - trail.parts_seen();
    let small = signals.survey.converter.map_or(0.0, |converter| {
        let [low, high] = converter.ends();
        1.0 - ellipse.radius.max(ellipse.radius / ellipse.r) / ((high - low) / 2.0)
    });
    let all = [
        SATURATION.judge(cut as f64 / samples, || {
            format!("{cut} samples ({:.2} %) are cut off at the end of the range; the fit leaves them out, their positions are wrong", percent(cut as f64 / samples))
        }),
        SCATTER.judge(scatter, || {
            format!("samples lie {:.1} % rms of the amplitude from the ellipse", percent(scatter))
        }),
        WEAK.judge(weak, || {
            format!("the signals fall to {:.0} % of their amplitude somewhere: dirt, or a damaged grating", percent(1.0 - weak))
        }),
        OFFSET.judge(offset, || {
            format!("offsets of {:+.1} % and {:+.1} % of the amplitude", percent(offset_a), percent(offset_b))
        }),
        GAIN.judge(gain, || format!("the amplitudes differ by {:.1} %", percent(gain))),
        QUADRATURE.judge(degrees, || format!("the channels are {degrees:.1}° from quadrature")),
        NOISE.judge(noise, || format!("noise of {:.2} % rms of a period", percent(noise))),
        ALIASING.judge(surprise, || {
            format!("a sample lies {:.0} % of half a period from where it was expected; beyond 100 % periods are lost: sample faster, or go slower", percent(surprise))
        }),
        COVERAGE.judge(missing as f64, || format!("{missing} of {PARTS} parts of the period hold no sample; there the fit is a guess")),
        SMALL.judge(small, || format!("the amplitude is {:.0} % of the converter's full scale", percent(1.0 - small))),
    ];
    let mut all: Vec<Finding> = all.into_iter().flatten().collect();
    all.sort_by_key(|finding| std::cmp::Reverse(finding.grade));
    all
}

/// The worst of all findings.
pub(crate) fn grade(findings: &[Finding]) -> Grade {
    findings.iter().map(|finding| finding.grade).max().unwrap_or(Grade::Good)
}

/// Offsets of both channels as parts of the amplitude of the cosine channel.
pub(crate) fn offsets(ellipse: &Ellipse, zero: [f64; 2]) -> [f64; 2] {
    [(ellipse.p - zero[0]) / ellipse.radius, (ellipse.q - zero[1]) / ellipse.radius]
}

/// The numbers are counted from far outside the ellipse: then the offset is the converter's bias, and no fault. With a
/// converter that is known, its middle is the zero.
pub(crate) fn is_biased(signals: &Signals<'_>, ellipse: &Ellipse) -> bool {
    signals.survey.converter.is_none()
        && offsets(ellipse, signals.scale.zero).into_iter().any(|offset| offset.abs() >= 1.0)
}
