//! Grades of a pair of signals, each with its reason. Wherever the tick grades the same figure, the bounds are the
//! tick's: [`abbe_core::sense::health`].

use super::follow::{PARTS, Trail};
use super::method::Learned;
use super::signals::Signals;
use abbe_core::sense::ellipse::Ellipse;
use abbe_core::sense::health::{
    Bounds, CLIPPED, GAIN, Grade, NOISE, OFFSET, QUADRATURE_DEG, SURPRISE, Shape, WEAKNESS,
};
use serde::{Serialize, Serializer};
use std::f64::consts::TAU;

/// A grade that must be seen.
pub(crate) fn word(grade: Grade) -> String {
    let word = grade.to_string();
    if grade == Grade::Fail { word.to_uppercase() } else { word }
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "as serde asks")]
fn as_text<S: Serializer>(grade: &Grade, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(grade)
}

/// One thing that is not good.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Finding {
    #[serde(serialize_with = "as_text")]
    pub(crate) grade: Grade,
    pub(crate) what: &'static str,
    pub(crate) reason: String,
}

/// Grades a figure; none when it is good.
fn judge(what: &'static str, bounds: Bounds, value: f64, reason: impl FnOnce() -> String) -> Option<Finding> {
    let grade = bounds.grade(value);
    (grade != Grade::Good).then(|| Finding { grade, what, reason: reason() })
}

/// Distance from the ellipse, rms part of its radius: more than noise, the signals are no ellipse.
const SCATTER: Bounds = Bounds { warn: 0.03, fail: 0.10 };
/// Parts of the period that were not seen.
const COVERAGE: Bounds = Bounds { warn: 0.0, fail: PARTS as f64 / 4.0 };
/// Samples in place of which the limit filter kept another, parts of all: it is for single wild ones.
const KEPT: Bounds = Bounds { warn: 0.01, fail: 0.25 };
/// What an amplitude lacks of full scale.
const SMALL: Bounds = Bounds { warn: 0.6, fail: 0.9 };

/// All that is not good, the worst first.
pub(crate) fn findings(signals: &Signals<'_>, learned: &Learned, trail: &Trail) -> Vec<Finding> {
    let ellipse = &learned.signals;
    let samples = trail.samples as f64;
    let (cut, kept) = (learned.cut_samples, learned.kept);
    let percent = |part: f64| 100.0 * part;
    let [offset_a, offset_b] = offsets(ellipse, signals.scale.zero);
    let biased = is_biased(signals, ellipse);
    let [p, q] = signals.scale.zero;
    let shape = Shape::of(&Ellipse { p: ellipse.p - p, q: ellipse.q - q, ..*ellipse });
    let offset = if biased { 0.0 } else { shape.offset };
    let scatter = trail.radius.deviation();
    let weak = if trail.weakest.is_finite() { 1.0 - trail.weakest } else { 0.0 };
    // Of the phase: a period is 2π amplitudes long.
    let noise = trail.noise();
    let surprise = trail.largest_surprise;
    let missing = PARTS - trail.parts_seen();
    let small = signals.survey.converter.map_or(0.0, |converter| {
        let [low, high] = converter.ends();
        1.0 - ellipse.radius.max(ellipse.radius / ellipse.r) / ((high - low) / 2.0)
    });
    let all = [
        judge("saturation", CLIPPED, cut as f64 / samples, || {
            format!(
                "{cut} samples ({:.2} %) are cut off at the end of the range; the fit leaves them out, their positions are wrong",
                percent(cut as f64 / samples)
            )
        }),
        judge("limit filter", KEPT, kept as f64 / samples, || {
            format!(
                "in {kept} places ({:.0} %) --limit-samples kept another sample: its step is smaller than those of the motion; allow a larger one",
                percent(kept as f64 / samples)
            )
        }),
        judge("amplitude scatter", SCATTER, scatter, || {
            format!("samples lie {:.1} % rms of the amplitude from the ellipse", percent(scatter))
        }),
        judge("contamination", WEAKNESS, weak, || {
            format!(
                "the signals fall to {:.0} % of their amplitude somewhere, and {} samples ({:.2} %) lie below {:.0} %: dirt, or a damaged grating",
                percent(1.0 - weak),
                trail.weak,
                percent(trail.weak as f64 / samples),
                percent(1.0 - WEAKNESS.warn)
            )
        }),
        judge("offset", OFFSET, offset, || {
            format!("offsets of {:+.1} % and {:+.1} % of the amplitude", percent(offset_a), percent(offset_b))
        }),
        judge("gain", GAIN, shape.gain, || {
            format!("the amplitudes differ by {:.1} %", percent(shape.gain - 1.0))
        }),
        judge("quadrature", QUADRATURE_DEG, shape.quadrature_deg, || {
            format!("the channels are {:.1}° from quadrature", shape.quadrature_deg)
        }),
        judge("noise", NOISE, TAU * noise, || format!("noise of {:.2} % rms of a period", percent(noise))),
        judge("speed", SURPRISE, surprise, || {
            format!(
                "a sample lies {:.0} % of half a period from where it was expected; beyond 100 % periods are lost: sample faster, or go slower{}",
                percent(2.0 * surprise),
                trail.lost_from.map_or_else(String::new, untrusted)
            )
        }),
        judge("coverage", COVERAGE, missing as f64, || {
            format!("{missing} of {PARTS} parts of the period hold no sample; there the fit is a guess")
        }),
        judge("small signal", SMALL, small, || {
            format!("the amplitude is {:.0} % of the converter's full scale", percent(1.0 - small))
        }),
    ];
    let mut all: Vec<Finding> = all.into_iter().flatten().chain(gaps(trail)).collect();
    all.sort_by_key(|finding| std::cmp::Reverse(finding.grade));
    all
}

fn untrusted(line: u64) -> String {
    format!("; from line {line} on the positions cannot be trusted")
}

/// What is to be said of samples that were not there, or had no phase.
fn gaps(trail: &Trail) -> Vec<Finding> {
    let gaps = &trail.gaps;
    let lost_from = gaps.lost_from(trail.noise());
    let grade = if lost_from.is_some() { Grade::Fail } else { Grade::Warn };
    let trust = || {
        lost_from
            .map_or_else(String::new, |line| format!(", which does not tell the period{}", untrusted(line)))
    };
    let missing = gaps.missing_before.map(|line| Finding {
        grade,
        what: "missing samples",
        reason: format!(
            "by their times {} samples are missing in {} places, first before line {line}; positions go on at the speed before each{}",
            gaps.missing, gaps.places, trust()
        ),
    });
    let short = gaps.short_from.map(|line| Finding {
        grade,
        what: "no phase",
        reason: format!(
            "{} samples, the first in line {line}, are shorter than 3/8 of the amplitude; positions go on at the speed before them{}",
            gaps.short, trust()
        ),
    });
    missing.into_iter().chain(short).collect()
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
