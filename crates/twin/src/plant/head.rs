//! `[plant.x.head]`: a reading head that puts out a sine and a cosine, its converter and its comparators.

use super::Range;
use serde::Deserialize;

/// An analogue head. "Part" without more is part of the nominal amplitude of the cosine.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeadPlant {
    /// Nominal amplitude of the cosine, part of the converter's full scale.
    pub amplitude: f64,
    /// Offset of the cosine, part.
    pub offset_cos: f64,
    /// Offset of the sine, part.
    pub offset_sin: f64,
    /// Sine over cosine.
    pub gain: f64,
    /// The sine is ahead of a quarter period by so much, degrees.
    pub phase_deg: f64,
    /// Third harmonic of both signals, part of the signal.
    pub third_harmonic: f64,
    /// Fifth harmonic of both signals, part of the signal.
    pub fifth_harmonic: f64,
    /// Noise of a sample, part, rms.
    pub noise: f64,
    /// The sine is sampled later than the cosine, ns.
    pub skew_ns: f64,
    /// Slow change of both offsets along the travel, part, rms.
    pub wander_offset: f64,
    /// Slow change of the gain along the travel, rms.
    pub wander_gain: f64,
    /// Slow change of the amplitude along the travel, part, rms.
    pub wander_amplitude: f64,
    /// Correlation length of the three, mm.
    pub wander_length_mm: f64,
    /// Change of both offsets, part/K from 20 °C.
    pub offset_per_k: f64,
    /// Change of the gain, 1/K from 20 °C.
    pub gain_per_k: f64,
    /// Change of the amplitude, part/K from 20 °C.
    pub amplitude_per_k: f64,
    /// Each line of the grating is off its place, nm rms.
    pub line_nm: f64,
    /// Bits of the converter.
    pub bits: u8,
    /// Smooth integral non-linearity of the converter, LSB at the middle of its range.
    pub bow_lsb: f64,
    /// Non-linearity that differs from code to code, LSB rms.
    pub codes_lsb: f64,
    /// A sample that the converter does not deliver, per tick.
    pub lost_probability: f64,
    /// Half the comparators' hysteresis, part.
    pub hysteresis: f64,
    /// Noise at the comparators, part, rms.
    pub comparator_noise: f64,
    /// Level of both channels when the connector is pulled, part of the converter's full scale.
    pub unplugged: f64,
}

impl HeadPlant {
    pub(super) fn ranges(&self) -> Vec<Range> {
        vec![
            Range(".head", "amplitude", self.amplitude, 0.01, 4.0),
            Range(".head", "offset_cos", self.offset_cos, -1.0, 1.0),
            Range(".head", "offset_sin", self.offset_sin, -1.0, 1.0),
            Range(".head", "gain", self.gain, 0.25, 4.0),
            Range(".head", "phase_deg", self.phase_deg, -60.0, 60.0),
            Range(".head", "third_harmonic", self.third_harmonic, 0.0, 0.2),
            Range(".head", "fifth_harmonic", self.fifth_harmonic, 0.0, 0.2),
            Range(".head", "noise", self.noise, 0.0, 1.0),
            Range(".head", "skew_ns", self.skew_ns, -1e5, 1e5),
            Range(".head", "wander_offset", self.wander_offset, 0.0, 0.2),
            Range(".head", "wander_gain", self.wander_gain, 0.0, 0.2),
            Range(".head", "wander_amplitude", self.wander_amplitude, 0.0, 0.2),
            Range(".head", "wander_length_mm", self.wander_length_mm, 0.5, 1e4),
            Range(".head", "offset_per_k", self.offset_per_k, -0.02, 0.02),
            Range(".head", "gain_per_k", self.gain_per_k, -0.02, 0.02),
            Range(".head", "amplitude_per_k", self.amplitude_per_k, -0.02, 0.02),
            Range(".head", "line_nm", self.line_nm, 0.0, 1000.0),
            Range(".head", "bits", f64::from(self.bits), 8.0, 16.0),
            Range(".head", "bow_lsb", self.bow_lsb, -1000.0, 1000.0),
            Range(".head", "codes_lsb", self.codes_lsb, 0.0, 100.0),
            Range(".head", "lost_probability", self.lost_probability, 0.0, 0.5),
            Range(".head", "hysteresis", self.hysteresis, 0.0, 0.5),
            Range(".head", "comparator_noise", self.comparator_noise, 0.0, 1.0),
            Range(".head", "unplugged", self.unplugged, -1.0, 1.0),
        ]
    }
}
