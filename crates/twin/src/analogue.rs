//! An analogue reading head over a grating (row B2): two sensors, their amplifiers, two comparators, a converter.
//!
//! x = A (cos θ + e₃ cos 3θ + e₅ cos 5θ) + p, and the same wave a quarter of a period (and a little) later for y:
//! y = A g (sin θ′ − e₃ sin 3θ′ + e₅ sin 5θ′) + q with θ′ = θ + φ; θ = 2π · reading / period. Parts of the converter's full
//! scale. Amplitude and offsets change along the travel and with temperature; each line of the grating has its own place.

use crate::noise::Noise;
use crate::plant::HeadPlant;
use crate::trig::{floor, sin_turns};
use abbe_core::edge::SinCos;

/// Codes of a converter's full scale, to one side.
const FULL_SCALE: f64 = 32_768.0;
/// Where the inputs lie when nothing is plugged in: an open receiver, parts of full scale.
const OPEN: [f64; 2] = [0.012, -0.017];
/// Waves of the drift along the travel.
const WAVES: usize = 4;

/// Dirt on the grating; lengths in µm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dirt {
    /// Its middle.
    pub at_um: f64,
    /// From the middle to where it takes 1/e of its most.
    pub width_um: f64,
    /// What it takes of the light, 0 … 1; of the second sensor, which looks a little beside it, three quarters.
    pub depth: f64,
}

/// What can happen to a head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeadEvent {
    /// The light becomes this part of what it was: an ageing lamp below 1, a gain set too high above.
    Light(f64),
    /// The noise becomes so many times what it was: an interfering motor, a bad shield.
    Noise(f64),
    /// Dirt falls on the grating.
    Dirt(Dirt),
    /// A channel of the converter stands at its last code, or no longer: cosine, sine.
    Stuck([bool; 2]),
    /// The converter gives no samples, or gives them again.
    NoSamples(bool),
}

/// A reading head.
#[derive(Clone, Debug)]
pub struct Head {
    settings: HeadPlant,
    period_um: f64,
    noise: Noise,
    seed: u64,
    /// Amplitude, offset of cosine, offset of sine: (waves a metre, phase) each.
    drift: [[(f64, f64); WAVES]; 3],
    inl_phase: [f64; 2],
    kelvin: f64,
    light: f64,
    louder: f64,
    dirt: Vec<Dirt>,
    stuck: [bool; 2],
    last: SinCos,
    no_samples: bool,
    connected: bool,
    /// Levels of the comparators, A and B.
    levels: (bool, bool),
}

impl Head {
    /// A head over a grating of `period_um`, standing at a reading.
    pub fn new(settings: &HeadPlant, period_um: f64, reading_um: f64, seed: u64, name: &str) -> Self {
        let mut noise = Noise::new(seed, &format!("head {name}"));
        let mut waves = || {
            core::array::from_fn(|_| {
                (noise.normal() * 1e3 / settings.drift_length_mm, noise.uniform(0.0, 1.0))
            })
        };
        let drift = [waves(), waves(), waves()];
        let inl_phase = [noise.uniform(0.0, 1.0), noise.uniform(0.0, 1.0)];
        let lines = noise.uniform(0.0, 9e15) as u64;
        let mut head = Self {
            settings: settings.clone(),
            period_um,
            noise,
            seed: lines,
            drift,
            inl_phase,
            kelvin: 0.0,
            light: 1.0,
            louder: 1.0,
            dirt: Vec::new(),
            stuck: [false; 2],
            last: SinCos::default(),
            no_samples: false,
            connected: true,
            levels: (false, false),
        };
        let [x, y] = head.signals(reading_um);
        head.levels = (x < 0.0, y < 0.0);
        head
    }

    /// The amplifiers are `kelvin` warmer than 20 °C.
    pub fn warm(&mut self, kelvin: f64) {
        self.kelvin = kelvin;
    }

    /// Plugs it in, or pulls it.
    pub fn connect(&mut self, connected: bool) {
        self.connected = connected;
    }

    /// Something happens.
    pub fn happen(&mut self, event: HeadEvent) {
        match event {
            HeadEvent::Light(part) => self.light = part,
            HeadEvent::Noise(times) => self.louder = times,
            HeadEvent::Dirt(dirt) => self.dirt.push(dirt),
            HeadEvent::Stuck(channels) => self.stuck = channels,
            HeadEvent::NoSamples(none) => self.no_samples = none,
        }
    }

    /// Both signals at a reading, without noise.
    pub fn signals(&self, reading_um: f64) -> [f64; 2] {
        if !self.connected {
            return OPEN;
        }
        let s = &self.settings;
        let place = reading_um + self.line_error_um(reading_um);
        let turns = place / self.period_um;
        let later = turns + s.phase_deg / 360.0;
        let cos = |turns: f64| sin_turns(turns + 0.25);
        let x = cos(turns) + s.third * cos(3.0 * turns) + s.fifth * cos(5.0 * turns);
        let y = sin_turns(later) - s.third * sin_turns(3.0 * later) + s.fifth * sin_turns(5.0 * later);
        let metres = reading_um * 1e-6;
        let drift = |waves: &[(f64, f64); WAVES]| -> f64 {
            let sum: f64 = waves.iter().map(|(per_metre, phase)| sin_turns(per_metre * metres + phase)).sum();
            s.drift * sum * (2.0 / WAVES as f64).sqrt() + s.drift_per_k * self.kelvin
        };
        let [of_amplitude, of_p, of_q] = self.drift.each_ref().map(drift);
        let [dark_x, dark_y] = self.darkness(reading_um);
        let amplitude = s.amplitude * self.light * (1.0 + of_amplitude);
        [
            amplitude * (1.0 - dark_x) * x + s.amplitude * (s.offset_cos + of_p),
            amplitude * (1.0 - dark_y) * s.gain * y + s.amplitude * (s.offset_sin + of_q),
        ]
    }

    /// How far the line under the head is from where it should be; straight from line to line.
    fn line_error_um(&self, reading_um: f64) -> f64 {
        let lines = reading_um / self.period_um;
        let line = floor(lines);
        let part = lines - line as f64;
        let own = |line: i64| self.settings.line_rms_um * scatter(self.seed ^ line.cast_unsigned());
        own(line) * (1.0 - part) + own(line + 1) * part
    }

    /// What dirt takes of each sensor's light.
    fn darkness(&self, reading_um: f64) -> [f64; 2] {
        let mut dark = [0.0_f64; 2];
        for dirt in &self.dirt {
            let off = (reading_um - dirt.at_um) / dirt.width_um;
            let takes = dirt.depth * libm::exp(-off * off);
            dark = [dark[0].max(takes), dark[1].max(0.75 * takes)];
        }
        dark
    }

    /// The levels of A and B when the head comes to a reading: comparators with hysteresis.
    pub fn compare(&mut self, reading_um: f64) -> (bool, bool) {
        let [x, y] = self.signals(reading_um);
        let (noise, h) = (self.settings.noise * self.louder * self.settings.amplitude, self.hysteresis());
        let (x, y) = (x + noise * self.noise.normal(), y + noise * self.noise.normal());
        let below = |value: f64, was: bool| if was { value < h } else { value < -h };
        self.levels = (below(x, self.levels.0), below(y, self.levels.1));
        self.levels
    }

    fn hysteresis(&self) -> f64 {
        self.settings.hysteresis * self.settings.amplitude
    }

    /// What the converter gives at a reading, the head going `um_s`; none if it gives nothing.
    pub fn sample(&mut self, reading_um: f64, um_s: f64) -> Option<SinCos> {
        if self.no_samples {
            return None;
        }
        // The sine is sampled a little later than the cosine.
        let later = reading_um + um_s * self.settings.skew_ns * 1e-9;
        let noise = self.settings.noise * self.louder * self.settings.amplitude;
        let x = self.signals(reading_um)[0] + noise * self.noise.normal();
        let y = self.signals(later)[1] + noise * self.noise.normal();
        let [stuck_cos, stuck_sin] = self.stuck;
        let cos = if stuck_cos { self.last.cos } else { self.convert(x, 0) };
        let sin = if stuck_sin { self.last.sin } else { self.convert(y, 1) };
        self.last = SinCos { sin, cos };
        Some(self.last)
    }

    /// A converter: its own bend, its steps, its ends.
    fn convert(&self, value: f64, channel: usize) -> i16 {
        let step = libm::ldexp(1.0, 1 - i32::from(self.settings.bits));
        // A bow, and a wave that most converters have between their larger steps.
        let bend = 0.7 * (1.0 - value * value) * self.inl_phase[channel].mul_add(2.0, -1.0).signum()
            + 0.3 * sin_turns(8.0 * value + self.inl_phase[channel]);
        let codes = (value + bend * self.settings.inl_lsb * step) / step;
        let most = 1.0 / step;
        (codes.round().clamp(-most, most - 1.0) * step * FULL_SCALE) as i16
    }
}

/// A number with mean 0 and standard deviation 1 that belongs to a line for ever: evenly distributed.
fn scatter(line: u64) -> f64 {
    let mut z = line.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    let even = ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
    (even - 0.5) * 12_f64.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use abbe_core::sense::ellipse::Ellipse;
    use abbe_core::sense::moments::Moments;

    pub(super) fn plain() -> HeadPlant {
        HeadPlant {
            amplitude: 0.7,
            offset_cos: 0.05,
            offset_sin: -0.03,
            gain: 1.08,
            phase_deg: 4.0,
            third: 0.0,
            fifth: 0.0,
            noise: 0.0,
            skew_ns: 0.0,
            drift: 0.0,
            drift_length_mm: 30.0,
            drift_per_k: 0.0,
            line_rms_um: 0.0,
            bits: 16,
            inl_lsb: 0.0,
            hysteresis: 0.03,
        }
    }

    fn head(settings: &HeadPlant) -> Head {
        Head::new(settings, 0.8, 0.0, 1, "x")
    }

    /// Codes along a stretch, and the peak error, nm, of the phase when they are taken as they are and after the fit.
    fn errors(head: &mut Head, from_um: f64) -> [f64; 2] {
        let places: Vec<f64> = (0..2000).map(|k| from_um + f64::from(k) * 0.0123).collect();
        let codes: Vec<[f64; 2]> = places
            .iter()
            .map(|&place| head.sample(place, 0.0).unwrap())
            .map(|code| [code.cos, code.sin].map(f64::from))
            .collect();
        let fit = Ellipse::fit(&Moments::of_all(codes.iter().copied())).unwrap();
        [Ellipse::circle(1.0), fit].map(|ellipse| {
            let off: Vec<f64> = codes
                .iter()
                .zip(&places)
                .map(|([x, y], place)| ellipse.turns(*x, *y) - place / 0.8)
                .map(|off| 800.0 * (off - off.round()))
                .collect();
            let mean = off.iter().sum::<f64>() / off.len() as f64;
            off.iter().fold(0.0, |peak: f64, off| peak.max((off - mean).abs()))
        })
    }

    #[test]
    fn offsets_gain_and_quadrature_cost_what_the_formulas_say() {
        let [raw, fitted] = errors(&mut head(&plain()), 100.0);
        assert!((raw - 12.9).abs() < 0.05 && fitted < 0.02, "{raw} {fitted}");
    }

    #[test]
    fn a_third_harmonic_of_one_percent_leaves_1_27_nm_after_the_fit() {
        let even = HeadPlant { offset_cos: 0.0, offset_sin: 0.0, gain: 1.0, phase_deg: 0.0, ..plain() };
        let [_, third] = errors(&mut head(&HeadPlant { third: 0.01, ..even.clone() }), 100.0);
        assert!((third - 1.273).abs() < 0.02, "{third}");
        let [_, fifth] = errors(&mut head(&HeadPlant { fifth: 0.005, ..even }), 100.0);
        assert!((fifth - 0.637).abs() < 0.02, "{fifth}");
    }

    #[test]
    fn bits_and_bends_of_the_converter_have_their_sizes() {
        for (bits, at_most, at_least) in [(8, 1.6, 0.4), (10, 0.4, 0.1), (12, 0.11, 0.02), (14, 0.04, 0.005)]
        {
            let [_, fitted] = errors(&mut head(&HeadPlant { bits, ..plain() }), 100.0);
            assert!((at_least..at_most).contains(&fitted), "{bits} bits: {fitted} nm");
        }
        let [_, bent] = errors(&mut head(&HeadPlant { bits: 12, inl_lsb: 4.0, ..plain() }), 100.0);
        assert!((0.1..1.0).contains(&bent), "{bent}");
    }

    #[test]
    fn each_line_has_its_own_place_for_ever_and_signals_drift_along_the_way() {
        let lines = head(&HeadPlant { line_rms_um: 0.004, ..plain() });
        let own: Vec<f64> = (0..4000).map(|line| lines.line_error_um(f64::from(line) * 0.8)).collect();
        let rms = (own.iter().map(|e| e * e).sum::<f64>() / 4000.0).sqrt();
        assert!((rms - 0.004).abs() < 2e-4, "{rms}");
        assert_eq!(lines.line_error_um(123.4), lines.line_error_um(123.4));
        let drifting = head(&HeadPlant { drift: 0.02, ..plain() });
        let sizes: Vec<f64> = (0..120)
            .map(|mm| {
                drifting.signals(f64::from(mm) * 1e3 + 0.2)[0]
                    - head(&plain()).signals(f64::from(mm) * 1e3 + 0.2)[0]
            })
            .collect();
        let spread =
            sizes.iter().copied().fold(f64::MIN, f64::max) - sizes.iter().copied().fold(f64::MAX, f64::min);
        assert!((0.01..0.15).contains(&spread), "{spread}");
        let mut warm = head(&HeadPlant { drift_per_k: 0.002, ..plain() });
        warm.warm(5.0);
        assert!((warm.signals(0.0)[0] / head(&plain()).signals(0.0)[0] - 1.0).abs() > 0.005);
    }

    #[test]
    fn a_skew_turns_the_phase_at_speed() {
        let mut skewed = head(&HeadPlant {
            skew_ns: 100.0,
            offset_cos: 0.0,
            offset_sin: 0.0,
            gain: 1.0,
            phase_deg: 0.0,
            ..plain()
        });
        // At 50 mm/s the sine is 5 nm late: 2.25° of quadrature.
        let late = skewed.sample(0.2, 50_000.0).unwrap();
        let still = skewed.sample(0.2, 0.0).unwrap();
        assert_eq!(late.cos, still.cos);
        let slope = f64::from(skewed.sample(0.205, 0.0).unwrap().sin) - f64::from(still.sin);
        assert!((f64::from(late.sin) - f64::from(still.sin) - slope).abs() < 2.0);
    }

    #[test]
    fn events_do_what_they_say() {
        let mut head = head(&HeadPlant {
            offset_cos: 0.0,
            offset_sin: 0.0,
            gain: 1.0,
            phase_deg: 0.0,
            noise: 0.002,
            ..plain()
        });
        let radius = |head: &mut Head, at: f64| {
            let code = head.sample(at, 0.0).unwrap();
            f64::from(code.cos).hypot(f64::from(code.sin)) / FULL_SCALE
        };
        assert!((radius(&mut head, 50.0) - 0.7).abs() < 0.01);
        head.happen(HeadEvent::Dirt(Dirt { at_um: 50.0, width_um: 20.0, depth: 0.8 }));
        assert!(radius(&mut head, 50.0) < 0.2 && radius(&mut head, 150.0) > 0.69);
        head.happen(HeadEvent::Light(2.0));
        let clipped = (0..800).map(|k| head.sample(500.0 + f64::from(k) * 0.001, 0.0).unwrap());
        assert!(clipped.filter(|code| code.cos == 32_767 || code.cos == i16::MIN).count() > 100);
        head.happen(HeadEvent::Light(1.0));
        head.happen(HeadEvent::Stuck([true, false]));
        let [one, other] = [300.0, 300.3].map(|at| head.sample(at, 0.0).unwrap());
        assert!(one.cos == other.cos && one.sin != other.sin);
        head.happen(HeadEvent::NoSamples(true));
        assert_eq!(head.sample(300.0, 0.0), None);
        head.happen(HeadEvent::NoSamples(false));
        head.happen(HeadEvent::Stuck([false; 2]));
        head.connect(false);
        assert!(radius(&mut head, 50.0) < 0.05);
    }
}
