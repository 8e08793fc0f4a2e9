//! What an axis is read and moved by.

use super::{DesignError, check};
use crate::sense::ellipse::Ellipse;
use crate::sense::harmonics::Harmonics;
use crate::sense::head;
use crate::sense::health::{GAIN, OFFSET, QUADRATURE_DEG};
use crate::sense::subdivide::LARGEST_FACTOR;
use crate::units::Pos;

/// What reads the position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Encoder {
    /// Square signals, counted by the front end (row A3).
    #[default]
    Digital,
    /// A sine and a cosine, sampled in every tick (rows B2 … B8).
    Analogue(Analogue),
}

/// An encoder with a sine and a cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Analogue {
    /// Signal period, µm; four times `count_um`.
    pub period_um: f64,
    /// Amplitude of the cosine, part of the converter's full scale; 0.05 … 1.
    pub amplitude: f64,
    /// Offset of the cosine, parts of the amplitude; −0.25 … 0.25. `abbe encoder` finds this and the next three; beyond their
    /// ranges an encoder is out of adjustment, and is graded as failed.
    pub offset_cos: f64,
    /// Offset of the sine, parts of the amplitude; −0.25 … 0.25.
    pub offset_sin: f64,
    /// Amplitude of the sine over that of the cosine; 1/1.5 … 1.5.
    pub gain: f64,
    /// By how much the sine leads a quarter of a period, degrees; −25 … 25.
    pub phase_deg: f64,
    /// What is left after these, by harmonics of the phase: parts of a period, cosine and sine, each ± 1/64 at most.
    #[cfg_attr(feature = "serde", serde(default))]
    pub harmonics: Harmonics,
    /// Steps of a period, 4 … 4096 (paper B: 160); 0: as fine as the samples are.
    pub factor: u16,
    /// Paper B's first limit filter: largest step of a sample, parts of the amplitude; 0: no filter.
    pub sample_limit: f64,
    /// Paper B's second limit filter, on the steps.
    pub count_limit: bool,
    /// Comparators and a counter count the same signals.
    pub counted: bool,
    /// Let offsets, gain and phase follow their drift.
    pub track: bool,
}

impl Default for Analogue {
    /// Paper B's grating, with perfect signals at three quarters of the converter.
    fn default() -> Self {
        Self {
            period_um: 0.8,
            amplitude: 0.75,
            offset_cos: 0.0,
            offset_sin: 0.0,
            gain: 1.0,
            phase_deg: 0.0,
            harmonics: Harmonics::default(),
            factor: 0,
            sample_limit: 0.0,
            count_limit: false,
            counted: true,
            track: true,
        }
    }
}

/// Full scale of a converter, codes.
const FULL_SCALE: f64 = 32_768.0;
/// A code this far from zero is taken for the end of a converter: the last code of 8 bits is 32 512.
const RAIL: i16 = 32_500;

impl Analogue {
    pub(super) fn check(&self, axis: usize, count_um: f64) -> Result<(), DesignError> {
        let axis = Some(axis);
        let fits = (self.period_um - 4.0 * count_um).abs() <= 1e-9 * self.period_um;
        check(axis, "encoder.period_um", self.period_um, fits, "four times count_um")?;
        let fits = (0.05..=1.0).contains(&self.amplitude);
        check(axis, "encoder.amplitude", self.amplitude, fits, "0.05 … 1")?;
        for (key, value) in [("encoder.offset_cos", self.offset_cos), ("encoder.offset_sin", self.offset_sin)]
        {
            check(axis, key, value, value.abs() <= OFFSET.fail, "-0.25 … 0.25")?;
        }
        let fits = (1.0 / GAIN.fail..=GAIN.fail).contains(&self.gain);
        check(axis, "encoder.gain", self.gain, fits, "0.6667 … 1.5")?;
        let fits = self.phase_deg.abs() <= QUADRATURE_DEG.fail;
        check(axis, "encoder.phase_deg", self.phase_deg, fits, "-25 … 25")?;
        let peak = self.peak();
        let fits = peak * FULL_SCALE < f64::from(RAIL);
        check(
            axis,
            "encoder.amplitude",
            peak,
            fits,
            "with gain and offsets inside the converter: below 0.99",
        )?;
        let largest = self.harmonics.sizes().into_iter().fold(0.0, f64::max);
        let fits = self.harmonics.sizes().iter().all(|size| (0.0..=1.0 / 64.0).contains(size));
        check(axis, "encoder.harmonics", largest, fits, "parts of a period, at most 1/64 each")?;
        let fits = self.factor == 0 || (4..=LARGEST_FACTOR).contains(&self.factor);
        check(axis, "encoder.factor", f64::from(self.factor), fits, "0 or 4 … 4096")?;
        let fits = (0.0..=2.0).contains(&self.sample_limit);
        check(axis, "encoder.sample_limit", self.sample_limit, fits, "0 … 2")?;
        let fits = !self.count_limit || self.factor != 0;
        check(axis, "encoder.count_limit", 1.0, fits, "off without encoder.factor")
    }

    /// How far the signals go from zero, part of the converter's full scale.
    fn peak(&self) -> f64 {
        self.amplitude * (1.0 + self.offset_cos.abs()).max(self.gain + self.offset_sin.abs())
    }

    pub(super) fn build(&self) -> head::Config {
        let radius = self.amplitude * FULL_SCALE;
        head::Config {
            period_pm: Pos::from_um(self.period_um).pm() as i32,
            ellipse: Ellipse {
                p: self.offset_cos * radius,
                q: self.offset_sin * radius,
                r: 1.0 / self.gain,
                alpha: -self.phase_deg.to_radians(),
                radius,
            },
            harmonics: self.harmonics,
            rail: RAIL,
            counted: self.counted,
            factor: self.factor,
            sample_limit: libm::round(self.sample_limit * radius).clamp(0.0, 65_535.0) as u16,
            count_limit: self.count_limit,
            tracks: self.track,
        }
    }
}

/// What moves an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Motor {
    /// Step pulses of `step_um`.
    #[default]
    Stepper,
    /// A DC motor behind an H-bridge (row B1). The servo's speeds become voltages; `step_um` is only the unit in which
    /// they are counted.
    Dc {
        /// Speed for which full duty is enough, mm/s: the working speed over the duty that it takes, friction and all.
        full_speed_mm_s: f64,
        /// Largest speed that the law may ask for while friction holds the axis at rest, mm/s. Beyond it the encoder must
        /// move, or it is taken for lost after `encoder_lost_um`.
        friction_mm_s: f64,
    },
}

impl Motor {
    /// What the law may ask for at most: to correct, a little more than the path asks; of a DC motor, whose speeds are
    /// voltages that friction eats from, all that there is.
    pub(super) fn fastest_mm_s(&self, speed_mm_s: f64) -> f64 {
        match *self {
            Self::Stepper => 1.2 * speed_mm_s,
            Self::Dc { full_speed_mm_s, .. } => full_speed_mm_s,
        }
    }

    pub(super) fn check(&self, axis: usize, speed_mm_s: f64) -> Result<(), DesignError> {
        let Self::Dc { full_speed_mm_s, friction_mm_s } = *self else { return Ok(()) };
        let fits = full_speed_mm_s >= 1.2 * speed_mm_s && full_speed_mm_s <= 1e4;
        check(
            Some(axis),
            "motor.full_speed_mm_s",
            full_speed_mm_s,
            fits,
            "at least 1.2 times speed_mm_s, at most 10000",
        )?;
        let fits = (0.0..full_speed_mm_s).contains(&friction_mm_s);
        check(Some(axis), "motor.friction_mm_s", friction_mm_s, fits, "from 0 on, less than full_speed_mm_s")
    }
}
