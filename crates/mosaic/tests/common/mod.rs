//! A camera with true imperfections over a specimen that is a continuous function.

#![allow(dead_code, reason = "each test file uses its own part of the camera")]

use abbe_mosaic::image::{Channels, Depth, Image};
use abbe_mosaic::tiles::{Placed, TileSet};

/// A reproducible sequence of numbers (splitmix64).
pub(crate) struct Sequence(pub u64);

impl Sequence {
    /// From 0 to 1.
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        (mixed(self.0) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Mean 0, standard deviation 1 (Irwin–Hall).
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

fn mixed(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Value noise with features of `size` px, −1 to 1, continuous with its first derivative.
fn noise(x: f64, y: f64, size: f64, seed: u64) -> f64 {
    let (u, v) = (x / size, y / size);
    let (i, j) = (u.floor(), v.floor());
    let ease = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    let (s, t) = (ease(u - i), ease(v - j));
    let at = |di: f64, dj: f64| {
        let key = (((i + di) as i64 as u64) << 32) ^ ((j + dj) as i64 as u64 & 0xffff_ffff) ^ (seed << 17);
        (mixed(mixed(key)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let top = at(0.0, 0.0) * (1.0 - s) + at(1.0, 0.0) * s;
    let bottom = at(0.0, 1.0) * (1.0 - s) + at(1.0, 1.0) * s;
    top * (1.0 - t) + bottom * t
}

/// Tissue-like brightness at a place in px, 0 to 1, around 0.6.
pub(crate) fn tissue(x: f64, y: f64, channel: u64) -> f64 {
    let octaves = [(5.0, 0.06), (13.0, 0.08), (37.0, 0.07), (120.0, 0.08)];
    let sum: f64 = octaves.iter().map(|(size, share)| share * noise(x, y, *size, 7 + channel)).sum();
    0.6 + sum
}

/// What the camera and the stage do wrong.
#[derive(Clone, Copy)]
pub(crate) struct Truth {
    pub size: [usize; 2],
    pub grid: [usize; 2],
    pub overlap: f64,
    pub angle_deg: f64,
    pub scale: f64,
    /// Barrel is negative, px at the corner.
    pub corner_px: f64,
    /// Light lost at the corner, share.
    pub vignetting: f64,
    /// Error of the nominal places, px, uniform to either side.
    pub jitter_px: f64,
    /// Electrons at full scale: shot noise.
    pub full_well: f64,
    pub channels: Channels,
    pub depth: Depth,
    pub seed: u64,
}

impl Default for Truth {
    fn default() -> Self {
        Self {
            size: [320, 256],
            grid: [4, 3],
            overlap: 0.12,
            angle_deg: 0.3,
            scale: 1.002,
            corner_px: -1.0,
            vignetting: 0.25,
            jitter_px: 5.0,
            full_well: 10_000.0,
            channels: Channels::Grey,
            depth: Depth::Eight,
            seed: 1,
        }
    }
}

impl Truth {
    /// Takes the tiles of a grid: the set with its nominal places, and the true places.
    pub(crate) fn tiles(&self, specimen: impl Fn(f64, f64, u64) -> f64) -> (TileSet, Vec<Placed>) {
        let mut sequence = Sequence(self.seed);
        let (mut placed, mut images, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        let (s, c) = self.angle_deg.to_radians().sin_cos();
        for i in 0..self.grid[0] * self.grid[1] {
            let (row, col) = (i / self.grid[0], i % self.grid[0]);
            let file = format!("tile_r{row:03}_c{col:03}.tif");
            let step = |k: usize| self.size[k] as f64 * (1.0 - self.overlap);
            let nominal = [col as f64 * step(0), row as f64 * step(1)];
            let [x, y] = nominal.map(|v| v + self.jitter_px * (2.0 * sequence.unit() - 1.0));
            let place = [self.scale * (c * x - s * y), self.scale * (s * x + c * y)];
            images.push(self.image(place, &specimen, &mut sequence));
            placed.push(Placed { file: file.clone(), place_px: nominal });
            truth.push(Placed { file, place_px: place });
        }
        (TileSet { placed, images }, truth)
    }

    /// One exposure at a true place.
    pub(crate) fn image(
        &self,
        place: [f64; 2],
        specimen: &impl Fn(f64, f64, u64) -> f64,
        sequence: &mut Sequence,
    ) -> Image {
        let full = f64::from(self.depth.full_scale());
        let centre = self.size.map(|n| (n as f64 - 1.0) / 2.0);
        let half = centre[0].hypot(centre[1]);
        let mut values = Vec::new();
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let seen = [(x as f64 - centre[0]) / half, (y as f64 - centre[1]) / half];
                let square = seen[0] * seen[0] + seen[1] * seen[1];
                // First order is enough: the second is corner² / half diagonal, 0.005 px.
                let ideal = [0, 1].map(|k| [x, y][k] as f64 - self.corner_px * square * seen[k]);
                let light = 1.0 - self.vignetting * square;
                for channel in 0..self.channels.count() as u64 {
                    let signal = light * specimen(place[0] + ideal[0], place[1] + ideal[1], channel);
                    let noise = (signal.max(0.0) / self.full_well).sqrt() * sequence.normal();
                    values.push(((signal + noise) * full) as f32);
                }
            }
        }
        Image::from_f32(self.size[0], self.size[1], self.channels, self.depth, &values).unwrap()
    }
}
