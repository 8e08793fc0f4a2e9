//! The same for programs.

use super::Report;
use super::preset::Keys;
use crate::encoder::error::Estimate;
use crate::encoder::health;
use crate::encoder::survey::Coding;
use abbe_core::sense::ellipse::Ellipse;
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// The same for programs.
pub(crate) fn document(report: &Report<'_>) -> Value {
    let (asked, trail) = (report.asked, report.trail);
    let ellipse = |ellipse: &Ellipse| {
        let shape = report.shape(ellipse);
        json!({
            "offset_a_percent": shape.offsets.map(|[a, _]| a),
            "offset_b_percent": shape.offsets.map(|[_, b]| b),
            "middle_a": shape.middle[0],
            "middle_b": shape.middle[1],
            "gain": shape.gain,
            "phase_deg": shape.phase_deg,
            "amplitude_a": shape.amplitude,
            "amplitude_b": shape.amplitude * shape.gain,
        })
    };
    let error = |estimate: &Estimate| {
        json!({
            "peak_nm": report.nm(estimate.peak),
            "rms_nm": report.nm(estimate.rms),
            "uncertainty_nm": estimate.uncertainty.map(|known| report.nm(known)),
            "from": estimate.from.name(),
        })
    };
    let scatter = trail.radius.deviation();
    json!({
        "file": asked.samples,
        "samples": trail.samples,
        "period_um": asked.period_um,
        "method": report.method(),
        "ellipse": ellipse(&report.learned.signals),
        "taken_off": ellipse(&report.learned.taken),
        "residual": { "rms_percent": 100.0 * scatter, "rms_nm": report.nm(scatter / TAU) },
        "noise": { "rms_nm": report.nm(trail.noise()), "from": "second differences" },
        "converter": report.rounding().map(|rounding| json!({
            "bits": rounding.bits,
            "coding": if rounding.coding == Coding::Signed { "signed" } else { "unsigned" },
            "filled_percent": 100.0 * rounding.filled,
            "peak_nm": report.nm(rounding.peak),
            "rms_nm": report.nm(rounding.rms),
        })),
        "error_before": report.inside.before.as_ref().map(|(_, estimate)| error(estimate)),
        "error_after": report.inside.after.as_ref().ok().map(|(_, estimate)| error(estimate)),
        "stretches": report.trail.stretches.agreed().ok().map(|agreed| json!({
            "taken": agreed.stretches,
            "left_out": agreed.left_out,
        })),
        "harmonics": report.agreed.map(|agreed| agreed.harmonics.0),
        "harmonics_nm": report.agreed.map(|agreed| agreed.harmonics.sizes().map(|size| report.nm(size))),
        "for_preset": Keys::of(report).map(|keys| keys.document()),
        "sweep_hz": report.sweep_hz(),
        "travel_um": report.um(trail.highest - trail.lowest),
        "way_um": report.um(trail.last - trail.first),
        "largest_step_nm": report.nm(trail.largest_step),
        "largest_step_mm_s": report.signals.survey.rate_hz().map(|hz| 1e-3 * report.um(trail.largest_step) * hz),
        "largest_surprise_nm": report.nm(trail.largest_surprise),
        "aliasing_limit_nm": report.nm(0.5),
        "cut_off": { "a": report.learned.cut[0], "b": report.learned.cut[1], "samples": report.learned.cut_samples },
        "missing_samples": trail.gaps.missing,
        "weak_samples": trail.weak,
        "samples_without_phase": trail.gaps.short,
        "kept_by_filter": report.learned.kept,
        "grade": health::grade(&report.findings).to_string(),
        "findings": report.findings,
        "notes": report.notes(),
        "positions": asked.positions,
        "plot": asked.plot,
    })
}
