//! Words for people.

use super::preset::Keys;
use super::{Report, Shape};
use crate::encoder::error::{Estimate, From};
use crate::encoder::health::{self, Finding};
use std::f64::consts::TAU;
use std::fmt::Write as _;

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
    }
    for (line, name) in Keys::of(report)
        .iter()
        .flat_map(Keys::lines)
        .zip(std::iter::once("for a preset").chain(std::iter::repeat("")))
    {
        row(name, line);
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
        From::Motion => format!("beside the smooth motion of {stretches} stretches{but}"),
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
