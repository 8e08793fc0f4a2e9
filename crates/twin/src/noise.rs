//! Seeded randomness. Each part of the twin has a stream of its own, so that a change in one leaves the others.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Noise(Pcg64Mcg);

impl Noise {
    /// The stream `name` of a seed.
    pub fn new(seed: u64, name: &str) -> Self {
        // FNV-1a of the name, so that streams do not depend on the order in which they are made.
        let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        Self(Pcg64Mcg::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ hash))
    }

    /// Mean 0, standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Between `low` and `high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// True once in 1 ÷ `probability` calls.
    pub fn chance(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.0.random::<f64>() < probability
    }
}

/// A number that belongs to `n`, the same each time: mean 0, standard deviation 1, nearly normal, at most ±3.5.
pub fn scattered(seed: u64, n: i64) -> f64 {
    // SplitMix64 of Steele, Lea and Flood 2014; the sum of four uniform numbers of 16 bits.
    let mut z = n.cast_unsigned().wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    let sum: u64 = [0, 16, 32, 48].iter().map(|shift| (z >> shift) & 0xffff).sum();
    // Each has the variance 65536²/12.
    (sum as f64 - 131_070.0) / 37_837.227
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ_by_name_and_seed() {
        let first = |seed, name| Noise::new(seed, name).normal();
        assert_eq!(first(1, "x"), first(1, "x"));
        assert_ne!(first(1, "x"), first(1, "y"));
        assert_ne!(first(1, "x"), first(2, "x"));
    }

    #[test]
    fn normal_noise_has_mean_zero_and_deviation_one() {
        let mut noise = Noise::new(3, "n");
        let samples: Vec<f64> = (0..100_000).map(|_| noise.normal()).collect();
        let mean = samples.iter().sum::<f64>() / 1e5;
        let deviation = (samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / 1e5).sqrt();
        assert!(mean.abs() < 0.02 && (deviation - 1.0).abs() < 0.01, "{mean} {deviation}");
    }

    #[test]
    fn scattered_numbers_repeat_and_have_mean_zero_and_deviation_one() {
        let numbers: Vec<f64> = (-50_000..50_000).map(|n| scattered(7, n)).collect();
        let mean = numbers.iter().sum::<f64>() / 1e5;
        let deviation = (numbers.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / 1e5).sqrt();
        assert!(mean.abs() < 0.01 && (deviation - 1.0).abs() < 0.01, "{mean} {deviation}");
        let neighbours = numbers.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / 1e5;
        assert!(neighbours.abs() < 0.01, "{neighbours}");
        assert_ne!(scattered(7, 1), scattered(8, 1));
    }
}
