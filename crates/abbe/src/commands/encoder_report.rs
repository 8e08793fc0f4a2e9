//! What `abbe encoder` says: words for people ([`text`]), a document for programs ([`document`]), from the same figures.

mod document;
mod preset;
mod text;

pub(crate) use document::document;
pub(crate) use text::text;

use crate::cli::Encoder;
use crate::encoder::error::{Estimate, From, Inside};
use crate::encoder::follow::Trail;
use crate::encoder::health::{self, Finding};
use crate::encoder::method::Learned;
use crate::encoder::signals::Signals;
use crate::encoder::stretches::{Agreed, BEYOND_SERVO};
use crate::encoder::survey::Coding;
use abbe_core::sense::ellipse::Ellipse;
use clap::ValueEnum as _;
use std::f64::consts::TAU;

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

    /// Periods a second of the sweep that taught the harmonics.
    fn sweep_hz(&self) -> Option<f64> {
        self.agreed.zip(self.signals.survey.rate_hz()).map(|(agreed, rate_hz)| agreed.speed * rate_hz)
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
        if let (None, Some(hz)) = (self.asked.servo_hz, self.sweep_hz()) {
            notes.push(format!("the sweep went through {hz:.0} periods a second: a servo of more than {:.0} Hz of bandwidth followed the errors of its own encoder and hid them; --servo-hz says what yours has", hz / BEYOND_SERVO));
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
