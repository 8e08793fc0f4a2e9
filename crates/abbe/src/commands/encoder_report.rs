//! What `abbe encoder` says: words for people, a document for programs, from the same figures.

use crate::cli::Encoder;
use crate::encoder::error::{Estimate, From, Inside};
use crate::encoder::follow::Trail;
use crate::encoder::health::{self, Finding};
use crate::encoder::method::Learned;
use crate::encoder::signals::Signals;
use crate::encoder::stretches::Agreed;
use crate::encoder::survey::Coding;
use abbe_core::sense::ellipse::Ellipse;
use abbe_core::sense::harmonics::Harmonics;
use clap::ValueEnum as _;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// All that was found.
pub(crate) struct Report<'r> {
    pub(crate) asked: &'r Encoder,
    pub(crate) signals: &'r Signals<'r>,
    pub(crate) learned: &'r Learned,
    pub(crate) trail: &'r Trail,
    /// What the table takes off, if there is one.
    pub(crate) agreed: Option<Agreed>,
    pub(crate) inside: Inside,
    pub(crate) findings: Vec<Finding>,
}

/// What the roundings of a converter do to a position, periods.
struct Rounding {
    bits: u32,
    coding: Coding,
    /// The smaller amplitude, part of half of the range.
    filled: f64,
    /// Both channels half a code off, across.
    peak: f64,
    /// Each channel a code's twelfth in variance.
    rms: f64,
}

impl Report<'_> {
    /// Nanometres of a part of the period.
    fn nm(&self, periods: f64) -> f64 {
        1e3 * self.asked.period_um * periods
    }

    fn um(&self, periods: f64) -> f64 {
        self.asked.period_um * periods
    }

    fn method(&self) -> String {
        self.asked.method.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    fn rounding(&self) -> Option<Rounding> {
        let converter = self.signals.survey.converter?;
        let [low, high] = converter.ends();
        let signals = &self.learned.signals;
        let amplitude = signals.radius.min(signals.radius / signals.r);
        Some(Rounding {
            bits: converter.bits,
            coding: converter.coding,
            filled: 2.0 * amplitude / (high - low),
            peak: 0.5_f64.sqrt() / amplitude / TAU,
            rms: (1.0_f64 / 12.0).sqrt() / amplitude / TAU,
        })
    }

    /// Offsets in %, gain, phase in degrees and amplitude in the file's unit.
    fn shape(&self, ellipse: &Ellipse) -> Shape {
        let scale = &self.signals.scale;
        let is_biased = health::is_biased(self.signals, &self.learned.signals);
        let [a, b] = scale.middle;
        Shape {
            offsets: (!is_biased).then(|| health::offsets(ellipse, scale.zero).map(|part| 100.0 * part)),
            middle: [ellipse.p / scale.codes + a, ellipse.q / scale.codes + b],
            gain: 1.0 / ellipse.r,
            phase_deg: -ellipse.alpha.to_degrees(),
            amplitude: ellipse.radius / scale.codes,
        }
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if health::is_biased(self.signals, &self.learned.signals) {
            notes.push("the numbers are counted from outside the ellipse, so the offset is taken for the converter's bias and not graded; --bits says where its middle is".into());
        }
        if self.inside.before.is_none() {
            notes.push(
                "the error before is not stated: without its offset the phase does not go round".into(),
            );
        }
        if let Err(reason) = &self.inside.after {
            notes.push(format!("the error after is not stated: {reason}"));
        }
        if let (Ok((_, Estimate { from: From::Radius, .. })), Err(reason)) =
            (&self.inside.after, self.trail.stretches.agreed())
        {
            notes.push(format!("the error after is taken from the radius, which shows harmonics of the phase from the third on: {reason}"));
        } else if !self.signals.survey.is_even() {
            notes.push("the error after is taken from the radius, which shows harmonics of the phase from the third on: the samples are not at even distances of time".into());
        }
        if self.learned.kept > 0 {
            notes.push(format!("the limit filter kept the sample before in {} places", self.learned.kept));
        }
        notes
    }
}

struct Shape {
    /// Of the middle from the zero, %; none where the zero is not known.
    offsets: Option<[f64; 2]>,
    /// The middle, as the file counts.
    middle: [f64; 2],
    gain: f64,
    phase_deg: f64,
    amplitude: f64,
}

impl Shape {
    /// Where the middle lies: beside the zero, or where the file counts it if the zero is not known.
    fn place(&self, of: &str) -> String {
        let [a, b] = self.middle;
        self.offsets.map_or_else(
            || format!("the middle is at a {}, b {}, as the file counts", Middle(a), Middle(b)),
            |[a, b]| format!("a {a:+.2} %, b {b:+.2} %{of}"),
        )
    }
}

/// Words for people.
pub(crate) fn text(report: &Report<'_>) -> String {
    let asked = report.asked;
    let mut text = format!(
        "{}: {} samples, period {} µm, health {}\n\n",
        asked.samples.display(),
        report.trail.samples,
        asked.period_um,
        health::word(health::grade(&report.findings))
    );
    let mut row = |name: &str, words: String| _ = writeln!(text, "  {name:<14}{words}");
    let shape = report.shape(&report.learned.signals);
    row("offsets", shape.place(" of the amplitude of a"));
    row("gain b/a", format!("{:.4}", shape.gain));
    row("quadrature", format!("{:+.2}°", shape.phase_deg));
    row(
        "amplitude",
        format!(
            "a {:.6}, b {:.6}, as the file counts",
            Short(shape.amplitude),
            Short(shape.amplitude * shape.gain)
        ),
    );
    let scatter = report.trail.radius.deviation();
    row(
        "residual",
        format!("{:.3} % rms of the radius, {:.3} nm", 100.0 * scatter, report.nm(scatter / TAU)),
    );
    row(
        "noise",
        format!(
            "{:.3} nm rms (median of the second differences of the positions)",
            report.nm(report.trail.noise())
        ),
    );
    if let Some(rounding) = report.rounding() {
        row(
            "converter",
            format!(
                "{} bit, {:.0} % of the range: at most {:.4} nm, {:.4} nm rms",
                rounding.bits,
                100.0 * rounding.filled,
                report.nm(rounding.peak),
                report.nm(rounding.rms)
            ),
        );
    }
    if report.learned.taken != report.learned.signals {
        let taken = report.shape(&report.learned.taken);
        row(
            "taken off",
            format!(
                "{}, gain {:.4}, {:+.2}° (method {})",
                taken.place(""),
                taken.gain,
                taken.phase_deg,
                report.method()
            ),
        );
    }
    if let Some((_, before)) = &report.inside.before {
        row("error before", estimate(report, before));
    }
    if let Ok((_, after)) = &report.inside.after {
        row("error after", estimate(report, after));
    }
    if let Some(agreed) = &report.agreed {
        let sizes: Vec<String> =
            agreed.harmonics.sizes().iter().map(|size| format!("{:.3}", report.nm(*size))).collect();
        row("harmonics", format!("{} nm (the first first; taken off)", sizes.join(", ")));
        row("for a preset", format!("harmonics = {}", pairs(&agreed.harmonics)));
    }
    motion(report, &mut row);
    for Finding { grade, what, reason } in &report.findings {
        _ = writeln!(text, "\n{}: {what}: {reason}", health::word(*grade));
    }
    for note in report.notes() {
        _ = writeln!(text, "\nnote: {note}");
    }
    for file in [&asked.positions, &asked.plot].into_iter().flatten() {
        _ = writeln!(text, "→ {}", file.display());
    }
    text
}

/// Harmonics as `[controller.x.encoder]` takes them: cosine and sine of each, parts of a period.
fn pairs(harmonics: &Harmonics) -> String {
    let Harmonics(all) = harmonics;
    let each: Vec<String> = all.iter().map(|[cos, sin]| format!("[{cos:.7}, {sin:.7}]")).collect();
    format!("[{}]", each.join(", "))
}

fn motion(report: &Report<'_>, row: &mut impl FnMut(&str, String)) {
    let trail = report.trail;
    row(
        "travel",
        format!(
            "{:.6} µm, ends {:+.6} µm from where it begins",
            report.um(trail.highest - trail.lowest),
            report.um(trail.last - trail.first)
        ),
    );
    let speed =
        report.signals.survey.rate_hz().map_or_else(String::new, |hz| {
            format!(", {:.3} mm/s", 1e-3 * report.um(trail.largest_step) * hz)
        });
    row(
        "largest step",
        format!(
            "{:.1} nm from sample to sample{speed}, {:.0} % of half a period",
            report.nm(trail.largest_step),
            200.0 * trail.largest_step
        ),
    );
    row(
        "prediction",
        format!(
            "off by {:.1} nm at most, {:.0} % of half a period (at 100 % periods are lost)",
            report.nm(trail.largest_surprise),
            200.0 * trail.largest_surprise
        ),
    );
}

fn estimate(report: &Report<'_>, estimate: &Estimate) -> String {
    let agreed = report.trail.stretches.agreed();
    let (stretches, left_out) = agreed.map_or((0, 0), |agreed| (agreed.stretches, agreed.left_out));
    let but = if left_out > 0 {
        format!("; {left_out} with cut, weak or missing samples left out")
    } else {
        String::new()
    };
    let how = match estimate.from {
        From::Ellipse => "of the ellipse alone".into(),
        From::Lines => format!("beside straight lines through {stretches} stretches{but}"),
        From::Halves => format!("half of {stretches} stretches against the other{but}"),
        From::Radius => "estimated from the radius".to_owned(),
    };
    let known =
        estimate.uncertainty.map_or_else(String::new, |known| format!(", ± {:.3} nm", report.nm(known)));
    format!("{:.3} nm peak, {:.3} nm rms{known} ({how})", report.nm(estimate.peak), report.nm(estimate.rms))
}

/// Twelve digits at most: the middle of numbers that are counted from far away.
struct Middle(f64);

impl std::fmt::Display for Middle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let decades = self.0.abs().max(f64::MIN_POSITIVE).log10().floor();
        if (-4.0..12.0).contains(&decades) {
            write!(f, "{:.*}", (11.0 - decades).min(6.0) as usize, self.0)
        } else {
            write!(f, "{:.11e}", self.0)
        }
    }
}

/// Six digits of a number of any size.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let decades = self.0.abs().max(f64::MIN_POSITIVE).log10().floor();
        if (-4.0..6.0).contains(&decades) {
            write!(f, "{:.*}", (5.0 - decades) as usize, self.0)
        } else {
            write!(f, "{:.5e}", self.0)
        }
    }
}

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
        "travel_um": report.um(trail.highest - trail.lowest),
        "way_um": report.um(trail.last - trail.first),
        "largest_step_nm": report.nm(trail.largest_step),
        "largest_step_mm_s": report.signals.survey.rate_hz().map(|hz| 1e-3 * report.um(trail.largest_step) * hz),
        "largest_surprise_nm": report.nm(trail.largest_surprise),
        "aliasing_limit_nm": report.nm(0.5),
        "cut_off": { "a": report.learned.cut[0], "b": report.learned.cut[1], "samples": report.learned.cut_samples },
        "missing_samples": trail.gaps.missing,
        "samples_without_phase": trail.gaps.short,
        "kept_by_filter": report.learned.kept,
        "grade": health::grade(&report.findings).to_string(),
        "findings": report.findings,
        "notes": report.notes(),
        "positions": asked.positions,
        "plot": asked.plot,
    })
}
