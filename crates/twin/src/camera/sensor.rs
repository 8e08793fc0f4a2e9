//! From light to counts: full well, shot noise, read noise, quantisation.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::settings::CameraSettings;

/// Steps of the table of normal deviates; the largest is 3.7.
const DEVIATES: usize = 4096;

/// The light-sensitive part of the camera.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    white_e: f32,
    full_well_e: f32,
    read_variance_e2: f32,
    counts_per_e: f32,
    black: f32,
    largest: f32,
    colour: bool,
    deviates: Vec<f32>,
}

impl Sensor {
    pub(super) fn new(settings: &CameraSettings) -> Self {
        let largest = settings.largest_count();
        Self {
            white_e: (settings.white_level * settings.full_well_e) as f32,
            full_well_e: settings.full_well_e as f32,
            read_variance_e2: (settings.read_noise_e * settings.read_noise_e) as f32,
            counts_per_e: ((largest - settings.black_level) / settings.full_well_e) as f32,
            black: settings.black_level as f32,
            largest: largest as f32,
            colour: settings.colour,
            deviates: normal_deviates(),
        }
    }

    /// Turns the light of one row into bytes. Each row has its own noise, so rows may be read in any order.
    pub(super) fn read_row(&self, light: &[[f32; 3]], seed: u64, row: usize, bytes: &mut [u8]) {
        let mut dice = Pcg64Mcg::seed_from_u64(seed ^ (row as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        if self.colour {
            for (pixel, light) in bytes.chunks_exact_mut(3).zip(light) {
                let roll = dice.next_u64();
                for (channel, (byte, value)) in pixel.iter_mut().zip(light).enumerate() {
                    *byte = self.count(*value, roll >> (16 * channel));
                }
            }
        } else {
            for (byte, [red, green, blue]) in bytes.iter_mut().zip(light) {
                let grey = 0.299 * red + 0.587 * green + 0.114 * blue;
                *byte = self.count(grey, dice.next_u64());
            }
        }
    }

    /// One pixel of one channel. Shot noise is taken as normal, which is close from some twenty electrons up.
    fn count(&self, light: f32, roll: u64) -> u8 {
        let electrons = light.max(0.0) * self.white_e;
        let rms = (electrons + self.read_variance_e2).sqrt();
        let noisy = electrons + rms * self.deviates[roll as usize % DEVIATES];
        let counts = self.black + noisy.min(self.full_well_e) * self.counts_per_e;
        counts.clamp(0.0, self.largest).round_ties_even() as u8
    }
}

/// The middles of equally likely slices of the normal distribution, scaled to variance 1.
///
/// Looking one up costs a nanosecond and, unlike drawing one through a logarithm, gives every machine the same bits.
fn normal_deviates() -> Vec<f32> {
    let half: Vec<f64> = upper_quantiles(DEVIATES / 2);
    let variance = half.iter().map(|x| x * x).sum::<f64>() / half.len() as f64;
    let scale = 1.0 / variance.sqrt();
    half.iter().rev().map(|x| -x).chain(half.iter().copied()).map(|x| (x * scale) as f32).collect()
}

/// Middles of `count` slices of the upper half of the normal distribution, rising.
fn upper_quantiles(count: usize) -> Vec<f64> {
    let mut x = 0.0;
    let mut quantiles = Vec::with_capacity(count);
    for slice in 0..count {
        let wanted = (slice as f64 + 0.5) / count as f64;
        // Newton from the slice before: the curve bends one way only, so it cannot overshoot far.
        for _ in 0..8 {
            let slope = libm::exp(-0.5 * x * x) * (2.0 / core::f64::consts::PI).sqrt();
            x -= (libm::erf(x * core::f64::consts::FRAC_1_SQRT_2) - wanted) / slope;
        }
        quantiles.push(x);
    }
    quantiles
}
