//! Signals of an analogue encoder as a stage gives them: offsets that drift, unequal amplitudes, a quadrature error, a
//! third harmonic, noise, lost samples; standing, creeping, slewing, turning round.
//!
//! Floats come from `libm` alone, so that every processor makes the same signals.

use abbe_core::edge::SinCos;
use abbe_core::sense::ellipse::Ellipse;
use abbe_core::sense::harmonics::{HARMONICS, Harmonics};
use core::f64::consts::TAU;

/// Samples of a run.
pub(crate) const SAMPLES: usize = 4096;
/// What somebody measured once.
pub(crate) const ELLIPSE: Ellipse = Ellipse { p: 900.0, q: -700.0, r: 1.08, alpha: 0.05, radius: 20_000.0 };
/// What it is by now.
const DRIFTED: Ellipse = Ellipse { p: 1150.0, q: -600.0, r: 1.07, alpha: 0.045, radius: 19_500.0 };
/// The third harmonic of both channels, parts of the amplitude.
const THIRD: f64 = 0.01;
/// Noise, codes rms.
const NOISE: f64 = 12.0;
/// Speeds that the motion goes for, periods a sample: at 0.8 µm and 10 kHz 24 mm/s at most.
const SPEEDS: [f64; 8] = [0.0, 0.002, 0.03, -0.03, 0.11, 0.3, 3.0, -0.06];
/// Change of the speed from sample to sample, periods: 80 m/s² would be 1.
const ACCELERATION: f64 = 0.02;
/// How far beyond its edge a count goes over, periods.
const HYSTERESIS: f64 = 0.01;
/// One sample in so many does not come.
const MISSING: usize = 1000;

/// What one tick reads.
#[derive(Clone, Copy)]
pub(crate) struct Reading {
    pub(crate) sample: SinCos,
    /// The converter was in time.
    pub(crate) came: bool,
    pub(crate) count: i32,
}

impl Reading {
    /// Nothing yet.
    pub(crate) const NONE: Self = Self { sample: SinCos { sin: 0, cos: 0 }, came: false, count: 0 };
}

/// What the phase is off by because of the third harmonic; its size and place as a sweep finds them.
pub(crate) fn harmonics() -> Harmonics {
    let mut found = Harmonics([[0.0; 2]; HARMONICS]);
    // cos + h cos 3φ, sin − h sin 3φ: off by −h sin 4φ.
    if let Some(fourth) = found.0.get_mut(3) {
        fourth[1] = -THIRD / TAU;
    }
    found
}

/// Fills a run.
pub(crate) fn fill(readings: &mut [Reading]) {
    let mut motion = Motion { position: 0.3, speed: 0.0, count: 1 };
    let mut random = Random(1);
    let each = readings.len() / SPEEDS.len();
    for (number, reading) in readings.iter_mut().enumerate() {
        let aim = SPEEDS.get(number / each).copied().unwrap_or(0.0);
        motion.step(aim);
        let sample = sample(motion.position, &mut random);
        *reading = Reading { sample, came: number % MISSING != MISSING - 1, count: motion.count };
    }
}

struct Motion {
    position: f64,
    speed: f64,
    count: i32,
}

impl Motion {
    fn step(&mut self, aim: f64) {
        self.speed += (aim - self.speed).clamp(-ACCELERATION, ACCELERATION);
        self.position += self.speed;
        let (low, high) =
            (f64::from(self.count) * 0.25 - HYSTERESIS, f64::from(self.count + 1) * 0.25 + HYSTERESIS);
        if !(low..high).contains(&self.position) {
            self.count = libm::floor(self.position * 4.0) as i32;
        }
    }
}

/// The channels at a position in periods.
fn sample(position: f64, random: &mut Random) -> SinCos {
    let Ellipse { p, q, r, alpha, radius } = DRIFTED;
    let angle = TAU * (position - libm::floor(position));
    let cos = libm::cos(angle) + THIRD * libm::cos(3.0 * angle);
    let sin = libm::sin(angle - alpha) - THIRD * libm::sin(3.0 * angle);
    let mut code = |exact: f64| libm::round(exact + NOISE * random.normal()) as i16;
    SinCos { cos: code(p + radius * cos), sin: code(q + radius / r * sin) }
}

/// `SplitMix64` (Steele, Lea, Flood, 2014).
struct Random(u64);

impl Random {
    /// From −½ to ½.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    /// Variance 1: four uniform numbers have one of 1/3.
    fn normal(&mut self) -> f64 {
        let four = self.uniform() + self.uniform() + self.uniform() + self.uniform();
        four * 1.732_050_807_568_877_2
    }
}
