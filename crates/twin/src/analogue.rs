//! An analogue reading head: a sine and a cosine, a converter that samples them, comparators that count them.
//!
//! With θ = 2π · reading / P the head of paper B (row B2) puts out
//!
//! x = A cos θ + p and y = A g sin(θ + φ) + q,
//!
//! and the third and fifth harmonic of both; the two channels have the same shape, a quarter of a period apart. A, g, p
//! and q wander along the travel and with the temperature, and each line of the grating is a little off its place. The
//! converter and the comparators see the same signals, each with its own faults.

mod comparators;
mod converter;
mod fault;

pub use fault::{Channel, Dirt, HeadEvent};

use crate::noise::{Noise, scattered};
use crate::plant::{AxisPlant, HeadPlant};
use crate::scale::Lines;
use crate::trig::{floor, sin_turns};
use crate::wander::Wander;
use abbe_core::edge::SinCos;
use comparators::Comparators;
use converter::Converter;
use fault::Faults;

/// The signals are looked at so often in a period; between two looks they are straight lines for the comparators, which
/// moves an edge by a nanometre at most while the hysteresis is small.
const LOOKS: f64 = 8.0;
/// Looks in a step whose comparators chatter.
const CHATTER_LOOKS: u64 = 25;

/// Amplitude and offset of a channel, parts of the converter's full scale.
#[derive(Clone, Copy, Debug)]
struct Level {
    amplitude: f64,
    offset: f64,
}

/// A multiple of the wave: eⁿ = size · exp(i phase).
#[derive(Clone, Copy, Debug)]
struct Harmonic {
    re: f64,
    im: f64,
}

impl Harmonic {
    fn new(size: f64, phase: f64) -> Self {
        Self { re: size * sin_turns(phase + 0.25), im: size * sin_turns(phase) }
    }

    /// Cosine and sine of the multiple, from those of the multiple without size and phase.
    fn turned(self, [c, s]: [f64; 2]) -> [f64; 2] {
        [self.re * c - self.im * s, self.re * s + self.im * c]
    }
}

/// The head of an axis.
#[derive(Clone, Debug)]
pub struct Head {
    plant: HeadPlant,
    period_um: f64,
    count_um: f64,
    third: Harmonic,
    fifth: Harmonic,
    /// Cosine and sine of the phase error.
    phase: [f64; 2],
    /// Of the offsets of cosine and sine, of gain and of amplitude.
    wander: [Wander; 4],
    /// The grating's lines are scattered by this seed.
    lines: u64,
    kelvin: f64,
    faults: Faults,
    converter: Converter,
    comparators: Comparators,
    noise: Noise,
}

impl Head {
    /// The head of an axis, if its head is analogue, standing at a reading.
    pub(crate) fn new(axis: &AxisPlant, reading_um: f64, seed: u64, name: &str) -> Option<Self> {
        let plant = axis.head.clone()?;
        let mut noise = Noise::new(seed, &format!("head {name}"));
        let seeds: [u64; 2] = [0; 2].map(|_: u8| noise.uniform(0.0, 1e15) as u64);
        let high_mm = axis.stops.high_mm;
        let sizes = [plant.wander_offset, plant.wander_offset, plant.wander_gain, plant.wander_amplitude];
        let wander = sizes.map(|rms| Wander::new(rms, plant.wander_length_mm, high_mm, &mut noise));
        let phase = plant.phase_deg / 360.0;
        let mut head = Self {
            period_um: axis.scale.grating_um,
            count_um: axis.scale.count_um,
            third: Harmonic::new(plant.third_harmonic, noise.uniform(0.0, 1.0)),
            fifth: Harmonic::new(plant.fifth_harmonic, noise.uniform(0.0, 1.0)),
            phase: [sin_turns(phase + 0.25), sin_turns(phase)],
            wander,
            lines: seeds[0],
            kelvin: 0.0,
            faults: Faults::default(),
            converter: Converter::new(&plant, seeds[1]),
            comparators: Comparators::default(),
            noise,
            plant,
        };
        let signals = head.signals(reading_um, &head.levels(reading_um));
        head.comparators = Comparators::new(signals, head.plant.hysteresis * head.plant.amplitude);
        Some(head)
    }

    /// The surroundings are `kelvin` warmer than 20 °C.
    pub(crate) fn warm(&mut self, kelvin: f64) {
        self.kelvin = kelvin;
    }

    /// Something happens to the head.
    pub fn happen(&mut self, event: HeadEvent) {
        self.faults.happen(event);
    }

    /// The comparators' lines as they stand.
    pub(crate) fn lines(&self) -> Lines {
        self.comparators.lines
    }

    /// How strong both channels are near a reading: cosine, sine.
    fn levels(&self, reading_um: f64) -> [Level; 2] {
        let (plant, kelvin) = (&self.plant, self.kelvin);
        let [cos, sin, gain, amplitude] = self.wander.each_ref().map(|wander| wander.at(reading_um));
        let light = self.faults.light * (1.0 + amplitude + plant.amplitude_per_k * kelvin);
        let gain = plant.gain + gain + plant.gain_per_k * kelvin;
        let kept = self.faults.kept(reading_um);
        let full = plant.amplitude * self.faults.amplifier;
        let level = |amplitude: f64, offset: f64| Level {
            amplitude: full * light * amplitude,
            offset: full * (offset + plant.offset_per_k * kelvin),
        };
        [level(kept[0], plant.offset_cos + cos), level(kept[1] * gain, plant.offset_sin + sin)]
    }

    /// Cosine and sine at a reading, parts of the converter's full scale, without noise.
    fn signals(&self, reading_um: f64, [x, y]: &[Level; 2]) -> [f64; 2] {
        let turns = (reading_um + self.line_error_um(reading_um)) / self.period_um;
        let (c, s) = (sin_turns(turns + 0.25), sin_turns(turns));
        let times = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a * c - b * d, a * d + b * c];
        let second = times([c, s], [c, s]);
        let third = times(second, [c, s]);
        let [c3, s3] = self.third.turned(third);
        let [c5, s5] = self.fifth.turned(times(third, second));
        let sine = s * self.phase[0] + c * self.phase[1];
        // A quarter of a period later cos 3θ is −sin 3θ, and cos 5θ is sin 5θ.
        [x.offset + x.amplitude * (c + c3 + c5), y.offset + y.amplitude * (sine - s3 + s5)]
    }

    /// How far the grating's lines at a reading are off their places, µm.
    fn line_error_um(&self, reading_um: f64) -> f64 {
        let along = reading_um / self.period_um;
        let line = floor(along);
        let share = along - line as f64;
        let [left, right] = [line, line + 1].map(|line| scattered(self.lines, line));
        self.plant.line_nm * 1e-3 * (left + share * (right - left))
    }

    /// What the converter makes of the signals at a reading that moves at `speed_mm_s`.
    pub(crate) fn sample(&mut self, reading_um: f64, speed_mm_s: f64, connected: bool) -> Option<SinCos> {
        // The sine comes later: a millimetre a second for a nanosecond is a picometre.
        let late_um = speed_mm_s * self.plant.skew_ns * 1e-6;
        let levels = self.levels(reading_um);
        let seen = if connected {
            [self.signals(reading_um, &levels)[0], self.signals(reading_um + late_um, &levels)[1]]
        } else {
            [self.faults.unplugged.unwrap_or(self.plant.unplugged); 2]
        };
        let noise = self.plant.noise * self.faults.noise * self.plant.amplitude * self.faults.amplifier;
        let [cos, sin] = seen.map(|signal| signal + noise * self.noise.normal());
        let codes = [self.converter.code(0, cos), self.converter.code(1, sin)];
        let lost = self.noise.chance(self.plant.lost_probability) || self.faults.loses_a_sample();
        let [cos, sin] = self.faults.shown(codes);
        (!lost).then_some(SinCos { sin, cos })
    }

    /// Moves from one reading to another within `clocks`; every edge of the comparators is told with its clock. `index`
    /// is the count of the reference mark.
    pub(crate) fn go(&mut self, way: [f64; 2], clocks: u64, index: i64, mut edge: impl FnMut(u64, Lines)) {
        let [from, to] = way;
        let levels = self.levels(to);
        let noise =
            (self.plant.comparator_noise * self.faults.noise + self.faults.chatter) * self.plant.amplitude;
        let least = if self.faults.chatter > 0.0 { CHATTER_LOOKS } else { 1 };
        let looks = least.max(1 + ((to - from).abs() * LOOKS / self.period_um) as u64);
        let mut before = 0;
        for look in 1..=looks {
            let at = from + (to - from) * (look as f64 / looks as f64);
            let signals = self.signals(at, &levels).map(|signal| signal + noise * self.noise.normal());
            let now = clocks * look / looks;
            let z = floor(at / self.count_um) == index;
            self.comparators.see(signals, z, [before, now], &mut edge);
            before = now;
        }
    }
}

#[cfg(test)]
mod tests;
