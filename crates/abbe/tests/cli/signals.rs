//! Encoder signals made up with a seed.

use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Paper B's grating.
pub(crate) const PERIOD_UM: f64 = 0.8;

/// Signals with offsets of +5 % and −3 %, gain 1.08 and 4° at a constant speed, in volts.
#[derive(Clone, Copy)]
pub(crate) struct Made {
    pub(crate) samples: u32,
    /// Part of the amplitude.
    pub(crate) noise: f64,
    pub(crate) third: f64,
    /// Periods a sample.
    pub(crate) speed: f64,
    /// Amplitude of the cosine, and how a cell is written.
    pub(crate) amplitude: f64,
    pub(crate) decimals: usize,
}

pub(crate) const MADE: Made =
    Made { samples: 20_000, noise: 0.01, third: 0.0, speed: 0.0473, amplitude: 1.0, decimals: 6 };

impl Made {
    /// Where the stage truly is, periods.
    pub(crate) fn truth(self, k: u32) -> f64 {
        0.2 + self.speed * f64::from(k)
    }

    fn cells(self, k: u32, random: &mut Pcg64Mcg) -> [f64; 2] {
        let angle = TAU * self.truth(k);
        let wave = |angle: f64| angle.cos() + self.third * (3.0 * angle).cos();
        let mut noise = || self.noise * random.sample::<f64, _>(StandardNormal);
        let a = wave(angle) + 0.05 + noise();
        let b = 1.08 * wave(angle + 4_f64.to_radians() - TAU / 4.0) - 0.03 + noise();
        [a, b].map(|value| self.amplitude * value)
    }

    pub(crate) fn rows(self) -> Vec<[f64; 2]> {
        let mut random = Pcg64Mcg::seed_from_u64(5);
        (0..self.samples).map(|k| self.cells(k, &mut random)).collect()
    }

    pub(crate) fn write(self, dir: &Path, name: &str) {
        write_rows(dir, name, self.decimals, &self.rows());
    }
}

pub(crate) fn write_rows(dir: &Path, name: &str, decimals: usize, rows: &[[f64; 2]]) {
    let mut text = String::from("t_s,b,note,a\n");
    for (k, [a, b]) in rows.iter().enumerate() {
        writeln!(text, "{:.4},{b:.decimals$},x,{a:.decimals$}", k as f64 * 1e-4).unwrap();
    }
    fs::write(dir.join(name), text).unwrap();
}
