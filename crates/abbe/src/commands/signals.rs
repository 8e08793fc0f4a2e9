//! How good the signals of analogue encoders are, in words and as JSON.

use abbe_core::Status;
use abbe_core::sense::health::{Findings, Report};
use serde_json::{Value, json};
use std::f64::consts::FRAC_2_SQRT_PI;
use std::fmt::Write as _;

/// Parts in which a report counts amplitude and noise.
const AMPLITUDE: f64 = 256.0;
const NOISE: f64 = 4096.0;

/// A line for each axis that has such an encoder.
pub(super) fn text(status: &Status<2>) -> String {
    let mut text = String::new();
    for (name, axis) in ["x", "y"].into_iter().zip(&status.axes) {
        let Some(report) = axis.signals else { continue };
        _ = write!(
            text,
            "\n{name}: encoder signals {} (amplitude {:.0} %, noise {:.1} %)",
            report.grade(),
            amplitude(report) * 100.0,
            noise(report) * 100.0
        );
        if report.warn.0 | report.fail.0 != 0 {
            _ = write!(text, ": {}", report.warn.and(report.fail));
        }
        let before = before(report);
        if before != Findings::NONE {
            _ = write!(text, "; earlier: {before}");
        }
    }
    text
}

/// The same for `x` and `y`; null for an axis with square signals.
pub(super) fn json(status: &Status<2>) -> Value {
    let [x, y] = status.axes.each_ref().map(|axis| axis.signals.map(of_axis));
    json!({ "x": x, "y": y })
}

fn of_axis(report: Report) -> Value {
    json!({
        "grade": report.grade().to_string(),
        "warn": report.warn.to_string(),
        "fail": report.fail.to_string(),
        "ever": report.ever.to_string(),
        "amplitude": amplitude(report),
        "noise": noise(report),
    })
}

/// What was found earlier, and is not now.
fn before(report: Report) -> Findings {
    Findings(report.ever.0 & !report.warn.and(report.fail).0)
}

/// Part of what it should be.
fn amplitude(report: Report) -> f64 {
    f64::from(report.amplitude) / AMPLITUDE
}

/// Of a channel, rms part of the amplitude: the radius changes by 2/√π of it from sample to sample in the mean.
fn noise(report: Report) -> f64 {
    f64::from(report.noise) / NOISE / FRAC_2_SQRT_PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use abbe_core::Controller;
    use abbe_core::design::StageSettings;

    #[test]
    fn grades_are_told_in_words_and_square_signals_have_none() {
        let settings = StageSettings::<2>::default().build().unwrap();
        let mut status = Controller::new(settings).status();
        assert_eq!((text(&status), json(&status)), (String::new(), json!({ "x": null, "y": null })));
        let report = Report {
            warn: Findings::WEAK,
            fail: Findings::NONE,
            ever: Findings::WEAK.and(Findings::MISSED),
            amplitude: 160,
            noise: 46,
        };
        status.axes[1].signals = Some(report);
        let words = "\ny: encoder signals warn (amplitude 62 %, noise 1.0 %): weak; earlier: samples missed";
        assert_eq!(text(&status), words);
        assert_eq!(json(&status)["y"]["grade"], "warn");
    }
}
