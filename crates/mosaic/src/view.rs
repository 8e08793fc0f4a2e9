//! A tile as the mosaic sees it: undistorted and evened, in one interpolation.

use crate::distortion::Distortion;
use crate::image::{Channels, Image, Sample, Samples};
use crate::patch::cubic_weights;
use crate::shading::Shading;

/// What the optics did, to be undone.
#[derive(Clone, Copy)]
pub(crate) struct Corrections<'a> {
    pub(crate) lens: Distortion,
    pub(crate) shading: Option<&'a Shading>,
}

/// A tile under its corrections.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) image: &'a Image,
    /// Number of the tile, for its gain.
    pub(crate) tile: usize,
    pub(crate) corrections: Corrections<'a>,
}

impl View<'_> {
    /// Whether an ideal tile place lies on the tile, a pixel being a square around its centre.
    pub(crate) fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let within = |v: f64, n: usize| v >= -0.5 && v < n as f64 - 0.5;
        within(x, self.image.width()) && within(y, self.image.height())
    }

    /// Samples at an ideal tile place, in grey levels; one or three are valid.
    pub(crate) fn evened(&self, ideal: [f64; 2]) -> [f32; 3] {
        let seen = self.corrections.lens.seen_from_ideal(ideal);
        let mut values = match self.image.samples() {
            Samples::Eight(samples) => self.interpolated(samples, seen),
            Samples::Sixteen(samples) => self.interpolated(samples, seen),
        };
        if let Some(shading) = self.corrections.shading {
            let x = nearest(seen[0], self.image.width());
            let y = nearest(seen[1], self.image.height());
            for (channel, value) in values.iter_mut().enumerate().take(self.image.channels().count()) {
                *value *= shading.factor(self.tile, x, y, channel);
            }
        }
        values
    }

    /// Luminance at an ideal tile place.
    pub(crate) fn luminance(&self, ideal: [f64; 2]) -> f32 {
        let [r, g, b] = self.evened(ideal);
        match self.image.channels() {
            Channels::Grey => r,
            Channels::Rgb => 0.2126 * r + 0.7152 * g + 0.0722 * b,
        }
    }

    fn interpolated<S: Sample>(&self, samples: &[S], [x, y]: [f64; 2]) -> [f32; 3] {
        match self.image.channels() {
            Channels::Grey => {
                let [v] = cubic::<S, 1>(samples, self.image.width(), self.image.height(), x, y);
                [v, 0.0, 0.0]
            }
            Channels::Rgb => cubic::<S, 3>(samples, self.image.width(), self.image.height(), x, y),
        }
    }
}

fn nearest(v: f64, size: usize) -> usize {
    (v.round().max(0.0) as usize).min(size - 1)
}

/// Cubic interpolation over 4 × 4 pixels; the rim is repeated outwards.
fn cubic<S: Sample, const C: usize>(samples: &[S], width: usize, height: usize, x: f64, y: f64) -> [f32; C] {
    let (left, top) = (x.floor(), y.floor());
    let (wx, wy) = (cubic_weights((x - left) as f32), cubic_weights((y - top) as f32));
    let (left, top) = (left as i64 - 1, top as i64 - 1);
    let clamped = |v: i64, size: usize| v.clamp(0, size as i64 - 1) as usize;
    let columns = [0, 1, 2, 3].map(|i| clamped(left + i, width) * C);
    let mut out = [0.0; C];
    for (j, weight) in wy.iter().enumerate() {
        let row = &samples[clamped(top + j as i64, height) * width * C..][..width * C];
        for (c, sum) in out.iter_mut().enumerate() {
            let tap = |i: usize| -> f32 { wx[i] * row[columns[i] + c].into() };
            *sum += weight * (tap(0) + tap(1) + tap(2) + tap(3));
        }
    }
    out
}
