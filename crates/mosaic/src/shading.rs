//! Vignetting and uneven light, estimated from what two tiles see of the same place.
//!
//! Where tiles a and b overlap, `ln I_a − ln I_b = S(u_a) − S(u_b) + g_a − g_b`: the specimen cancels. `S`, the
//! logarithm of the illumination over the frame, is a polynomial of degree 4 without constant; `g` are small
//! exposure differences. Solved by robust least squares on means over small blocks, each channel on its own.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;

use crate::image::{Channels, Image};
use crate::patch::{Rect, common};
use crate::register::Pair;

/// Exponents of x and y of the polynomial's terms, and how large each coefficient may be a priori (logarithm at the
/// corner). An overlap sees only the rim of the frame: the rest is extrapolated, so high terms must be earned.
const TERMS: [(i32, i32, f64); 14] = [
    (1, 0, 0.2),
    (0, 1, 0.2),
    (2, 0, 0.5),
    (1, 1, 0.1),
    (0, 2, 0.5),
    (3, 0, 0.05),
    (2, 1, 0.05),
    (1, 2, 0.05),
    (0, 3, 0.05),
    (4, 0, 0.2),
    (3, 1, 0.05),
    (2, 2, 0.2),
    (1, 3, 0.05),
    (0, 4, 0.2),
];

/// Exposure differences between tiles a priori, as a share.
const GAIN_SIGMA: f64 = 0.02;

/// Blocks darker or brighter than these shares of full scale say nothing about the light.
const USABLE: std::ops::Range<f64> = 0.02..0.97;

/// More light variation over the frame than this factor is taken for a failed estimate.
const MOST_RANGE: f64 = 4.0;

/// How the light falls over the frame, with the gains of the tiles.
#[derive(Clone, Debug)]
pub struct Shading {
    width: usize,
    channels: usize,
    /// What to multiply a sample with, pixel by pixel, channels interleaved; at least 1.
    factors: Vec<f32>,
    /// What to multiply a tile with, channels interleaved.
    gains: Vec<f32>,
}

/// What is told about the shading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShadingSummary {
    /// Light at the darkest place of the frame over that at the brightest, all channels.
    pub darkest: f64,
    /// Smallest and largest factor that evens the exposure of the tiles.
    pub gain_range: [f64; 2],
}

impl Shading {
    /// What evens a sample of a tile.
    pub(crate) fn factor(&self, tile: usize, x: usize, y: usize, channel: usize) -> f32 {
        self.factors[(y * self.width + x) * self.channels + channel]
            * self.gains[tile * self.channels + channel]
    }

    /// Luminance of a pixel under even light, without the gain of the tile.
    pub(crate) fn evened_luminance(&self, image: &Image, x: usize, y: usize) -> f32 {
        let at = (y * self.width + x) * self.channels;
        let value = |c: usize| image.value(x, y, c) * self.factors[at + c];
        match image.channels() {
            Channels::Grey => value(0),
            Channels::Rgb => 0.2126 * value(0) + 0.7152 * value(1) + 0.0722 * value(2),
        }
    }

    /// In short.
    pub fn summary(&self) -> ShadingSummary {
        let brightest = self.factors.iter().fold(1.0_f32, |m, &v| m.max(v));
        let low = self.gains.iter().fold(f32::INFINITY, |m, &v| m.min(v));
        let high = self.gains.iter().fold(0.0_f32, |m, &v| m.max(v));
        ShadingSummary { darkest: f64::from(1.0 / brightest), gain_range: [low.into(), high.into()] }
    }

    /// Estimates the shading from tiles at their places. Nothing if the overlaps say too little, or nothing that
    /// evening would better by a tenth.
    pub(crate) fn estimate(tiles: &[Image], overlaps: &[(Pair, [i64; 2])]) -> Option<Self> {
        let first = tiles.first()?;
        let channels = first.channels().count();
        let lights = (0..channels)
            .map(|channel| Light::estimate(tiles, overlaps, channel))
            .collect::<Option<Vec<_>>>()?;
        let frame = Frame::of(first);
        let tables: Vec<Vec<f32>> = lights.iter().map(|light| light.factors(frame)).collect::<Option<_>>()?;
        let interleaved = |i: usize| tables[i % channels][i / channels];
        Some(Self {
            width: frame.width,
            channels,
            factors: (0..frame.width * frame.height * channels).map(interleaved).collect(),
            gains: (0..tiles.len()).flat_map(|t| lights.iter().map(move |l| l.gain(t))).collect(),
        })
    }
}

/// Frame coordinates: centre and half diagonal.
#[derive(Clone, Copy)]
struct Frame {
    width: usize,
    height: usize,
}

impl Frame {
    fn of(image: &Image) -> Self {
        Self { width: image.width(), height: image.height() }
    }

    /// The polynomial's terms at a tile pixel.
    fn terms(self, x: f64, y: f64) -> [f64; TERMS.len()] {
        let centre = [(self.width as f64 - 1.0) / 2.0, (self.height as f64 - 1.0) / 2.0];
        let half_diagonal = centre[0].hypot(centre[1]).max(0.5);
        let (x, y) = ((x - centre[0]) / half_diagonal, (y - centre[1]) / half_diagonal);
        TERMS.map(|(i, j, _)| x.powi(i) * y.powi(j))
    }
}

/// One block seen by two tiles.
struct Comparison {
    pair: Pair,
    /// `ln I_a − ln I_b`.
    ratio: f64,
    /// Difference of the terms.
    terms: [f64; TERMS.len()],
}

/// Logarithm of the light of one channel, and of the tiles' exposures.
struct Light {
    coefficients: Vec<f64>,
    exposures: Vec<f64>,
}

impl Light {
    fn estimate(tiles: &[Image], overlaps: &[(Pair, [i64; 2])], channel: usize) -> Option<Self> {
        let compared: Vec<Vec<Comparison>> =
            overlaps.par_iter().map(|&(pair, delta)| compare(tiles, pair, delta, channel)).collect();
        let compared: Vec<Comparison> = compared.into_iter().flatten().collect();
        if compared.len() < 3 * TERMS.len() {
            return None;
        }
        let before = clipped_rms(compared.iter().map(|c| c.ratio));
        let light = Self::fit(&compared, tiles.len())?;
        let after = clipped_rms(compared.iter().map(|c| light.residual(c)));
        (after < 0.9 * before).then_some(light)
    }

    /// Iteratively reweighted least squares with Huber's weights.
    fn fit(compared: &[Comparison], tiles: usize) -> Option<Self> {
        let mut light = Self { coefficients: vec![0.0; TERMS.len()], exposures: vec![0.0; tiles] };
        for _ in 0..6 {
            let mut sizes: Vec<f64> = compared.iter().map(|c| light.residual(c).abs()).collect();
            sizes.sort_by(f64::total_cmp);
            // Half a per cent is as alike as two block means ever are.
            let sigma = (1.4826 * sizes[sizes.len() / 2]).max(0.005);
            light = light.reweighted(compared, sigma)?;
        }
        Some(light)
    }

    fn reweighted(&self, compared: &[Comparison], sigma: f64) -> Option<Self> {
        let unknowns = TERMS.len() + self.exposures.len();
        let mut matrix = DMatrix::<f64>::zeros(unknowns, unknowns);
        let mut right = DVector::<f64>::zeros(unknowns);
        for (i, (_, _, most)) in TERMS.iter().enumerate() {
            matrix[(i, i)] = most.powi(-2);
        }
        for i in TERMS.len()..unknowns {
            matrix[(i, i)] = GAIN_SIGMA.powi(-2);
        }
        for c in compared {
            let weight = (1.5 * sigma / self.residual(c).abs().max(1e-12)).min(1.0) / (sigma * sigma);
            let tile = |t: usize| TERMS.len() + t;
            let terms = c.terms.iter().copied().enumerate();
            let row: Vec<(usize, f64)> =
                terms.chain([(tile(c.pair.a), 1.0), (tile(c.pair.b), -1.0)]).collect();
            for &(i, f) in &row {
                right[i] += weight * f * c.ratio;
                for &(j, g) in &row {
                    matrix[(i, j)] += weight * f * g;
                }
            }
        }
        let x = matrix.cholesky()?.solve(&right);
        let (coefficients, exposures) = x.as_slice().split_at(TERMS.len());
        Some(Self { coefficients: coefficients.to_vec(), exposures: exposures.to_vec() })
    }

    fn residual(&self, c: &Comparison) -> f64 {
        let light: f64 = self.coefficients.iter().zip(&c.terms).map(|(k, t)| k * t).sum();
        c.ratio - light - self.exposures[c.pair.a] + self.exposures[c.pair.b]
    }

    /// What evens each pixel, 1 where the light is brightest. Nothing if the light would vary beyond belief.
    fn factors(&self, frame: Frame) -> Option<Vec<f32>> {
        let row = |y: usize| {
            (0..frame.width).map(move |x| {
                let terms = frame.terms(x as f64, y as f64);
                self.coefficients.iter().zip(terms).map(|(k, t)| k * t).sum::<f64>()
            })
        };
        let logs: Vec<Vec<f64>> = (0..frame.height).into_par_iter().map(|y| row(y).collect()).collect();
        let brightest = logs.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        let darkest = logs.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        let range = brightest - darkest;
        let believable = range.is_finite() && range < MOST_RANGE.ln();
        believable.then(|| logs.iter().flatten().map(|v| (brightest - v).exp() as f32).collect())
    }

    fn gain(&self, tile: usize) -> f32 {
        (-self.exposures[tile]).exp().clamp(0.8, 1.25) as f32
    }
}

/// Block means of one overlap. Blocks are a third of the overlap's short side, 6 to 32 px.
fn compare(tiles: &[Image], pair: Pair, delta: [i64; 2], channel: usize) -> Vec<Comparison> {
    let (a, b) = (&tiles[pair.a], &tiles[pair.b]);
    let Some((rect_a, rect_b)) = common([a.width(), a.height()], delta) else { return Vec::new() };
    let side = (rect_a.width.min(rect_a.height) / 3).clamp(6, 32);
    let (columns, rows) = (rect_a.width / side, rect_a.height / side);
    let frame = Frame::of(a);
    let blocks = rect_a.blocks(columns, rows).zip(rect_b.blocks(columns, rows));
    let compared = blocks.filter_map(|(in_a, in_b)| {
        let ratio = usable_log_mean(a, in_a, channel)? - usable_log_mean(b, in_b, channel)?;
        let (at_a, at_b) = (terms_at_centre(frame, in_a), terms_at_centre(frame, in_b));
        Some(Comparison { pair, ratio, terms: std::array::from_fn(|i| at_a[i] - at_b[i]) })
    });
    compared.collect()
}

fn terms_at_centre(frame: Frame, block: Rect) -> [f64; TERMS.len()] {
    let centre = |start: usize, length: usize| start as f64 + (length as f64 - 1.0) / 2.0;
    frame.terms(centre(block.x, block.width), centre(block.y, block.height))
}

fn usable_log_mean(image: &Image, block: Rect, channel: usize) -> Option<f64> {
    let mut sum = 0.0;
    for y in block.y..block.y + block.height {
        for x in block.x..block.x + block.width {
            sum += f64::from(image.value(x, y, channel));
        }
    }
    let mean = sum / block.area() as f64;
    USABLE.contains(&(mean / f64::from(image.depth().full_scale()))).then(|| mean.ln())
}

/// Root mean square with values beyond 0.2 counted as 0.2: a few moved cells must not decide.
fn clipped_rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(s, n), v| (s + v.clamp(-0.2, 0.2).powi(2), n + 1));
    (sum / count.max(1) as f64).sqrt()
}
