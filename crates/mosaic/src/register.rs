//! Which tiles overlap, and by how much they are really apart: phase correlation within a search radius.
//!
//! The overlap strips are reduced to structure, tapered at the rim and correlated with all frequencies weighing the
//! same (Kuglin and Hines 1975), then low-passed. The highest peaks are judged by the normalised cross-correlation
//! of what both tiles really share, the best one is refined to a fraction of a pixel.

use std::sync::{Arc, Mutex, PoisonError};

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::image::Image;
use crate::patch::{Patch, Rect, common};
use crate::refine::{Division, Match, least_ncc, measure};

/// Peaks of the correlation that are looked at.
const CANDIDATES: usize = 8;

/// Low-pass of the phase correlation, cycles per pixel (1/e): structure finer than 6 px is mostly noise.
const CUT_OFF: f32 = 0.16;

/// Two tiles that should overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair {
    pub(crate) a: usize,
    pub(crate) b: usize,
}

/// Pairs whose tiles overlap along at least a quarter of a side and 12 px across, by index.
pub(crate) fn neighbours(places: &[[f64; 2]], tile_size: [usize; 2]) -> Vec<Pair> {
    overlapping(places, tile_size)
        .filter(|(_, rect)| is_broad(*rect, tile_size))
        .map(|(pair, _)| pair)
        .collect()
}

fn is_broad(rect: Rect, [width, height]: [usize; 2]) -> bool {
    rect.width.min(rect.height) >= 12 && (4 * rect.width >= width || 4 * rect.height >= height)
}

/// All pairs that share pixels, with the shared rectangle in the first tile.
pub(crate) fn overlapping(places: &[[f64; 2]], tile_size: [usize; 2]) -> impl Iterator<Item = (Pair, Rect)> {
    // Sorted by x, only tiles within one width can overlap.
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|&i, &j| places[i][0].total_cmp(&places[j][0]).then(i.cmp(&j)));
    let mut pairs = Vec::new();
    for (rank, &i) in order.iter().enumerate() {
        for &j in &order[rank + 1..] {
            if places[j][0] - places[i][0] >= tile_size[0] as f64 {
                break;
            }
            let pair = Pair { a: i.min(j), b: i.max(j) };
            let delta = [0, 1].map(|k| (places[pair.b][k] - places[pair.a][k]).round() as i64);
            pairs.extend(common(tile_size, delta).map(|(rect, _)| (pair, rect)));
        }
    }
    pairs.sort_by_key(|(pair, _)| (pair.a, pair.b));
    pairs.into_iter()
}

/// Finds displacements between tiles. Shared by all threads; keeps the transforms of sizes met before.
pub(crate) struct Correlator {
    planner: Mutex<FftPlanner<f32>>,
}

impl Correlator {
    pub(crate) fn new() -> Self {
        Self { planner: Mutex::new(FftPlanner::new()) }
    }

    /// Displacement of the second tile from the first within `radius` px of `expected`, or nothing if no candidate
    /// is beyond doubt.
    pub(crate) fn find(&self, tiles: [&Image; 2], expected: [f64; 2], radius: usize) -> Option<Match> {
        let strips = Strips::cut(tiles, expected, radius)?;
        let surface = self.correlate(&strips);
        let best = strips.best_of(&surface.peaks(&strips))?;
        let delta = [0, 1].map(|k| (strips.origin_delta[k] + best[k]) as f64);
        measure(tiles, delta, None, Division::Whole).into_iter().next()
    }

    fn correlate(&self, strips: &Strips) -> Surface {
        let width = fast_size(strips.a.width + 2 * strips.radius);
        let height = fast_size(strips.a.height + 2 * strips.radius);
        let plans = self.plans(width, height);
        let mut field = packed(&strips.a, &strips.b, width, height);
        plans.forward(&mut field);
        let mut cross = cross_power(&field, width, height);
        plans.inverse(&mut cross);
        Surface { width, height, values: cross.iter().map(|c| c.re).collect() }
    }

    fn plans(&self, width: usize, height: usize) -> Plans {
        // A poisoned planner is still a sound planner: it only caches.
        let mut planner = self.planner.lock().unwrap_or_else(PoisonError::into_inner);
        Plans {
            width,
            height,
            forward: [planner.plan_fft_forward(width), planner.plan_fft_forward(height)],
            inverse: [planner.plan_fft_inverse(width), planner.plan_fft_inverse(height)],
        }
    }
}

/// The parts of two tiles that may overlap if the displacement is within the radius of the expected one.
struct Strips {
    a: Patch,
    b: Patch,
    radius: usize,
    /// Origin of the first strip in its tile less that of the second.
    origin_delta: [i64; 2],
    /// Expected displacement between the strips, whole pixels.
    expected: [i64; 2],
}

impl Strips {
    fn cut(tiles: [&Image; 2], expected: [f64; 2], radius: usize) -> Option<Self> {
        let tile_size = [tiles[0].width(), tiles[0].height()];
        let delta = expected.map(|v| v.round() as i64);
        let rect_a = reachable(tile_size, delta, radius)?;
        let rect_b = reachable(tile_size, delta.map(|v| -v), radius)?;
        let origin_delta = [rect_a.x as i64 - rect_b.x as i64, rect_a.y as i64 - rect_b.y as i64];
        Some(Self {
            a: Patch::cut(tiles[0], rect_a, None).structure(),
            b: Patch::cut(tiles[1], rect_b, None).structure(),
            radius,
            origin_delta,
            expected: [0, 1].map(|k| delta[k] - origin_delta[k]),
        })
    }

    /// The candidate with the best correlation of the shared part; where two are nearly equal (repetitive
    /// structure), the one nearer to the expected place.
    fn best_of(&self, candidates: &[[i64; 2]]) -> Option<[i64; 2]> {
        let (variance, slopes) = self.a.variances();
        let mut best: Option<(f64, [i64; 2])> = None;
        for &shift in candidates {
            let Some((ncc, pixels)) = self.correlation(shift) else { continue };
            // A little less than the refined match must reach: whole pixels miss the peak.
            if ncc < least_ncc(4.0, pixels as f64, variance, slopes) {
                continue;
            }
            let away = (0..2).map(|k| (shift[k] - self.expected[k]) as f64 / self.radius.max(1) as f64);
            let score = ncc - 0.05 * away.map(|v| v * v).sum::<f64>();
            if best.is_none_or(|(highest, _)| score > highest) {
                best = Some((score, shift));
            }
        }
        best.map(|(_, shift)| shift)
    }

    /// Normalised cross-correlation of the shared part at a shift, and its number of pixels. Parts narrower than
    /// 8 px correlate by chance and do not count.
    fn correlation(&self, shift: [i64; 2]) -> Option<(f64, usize)> {
        let (a, b) = common([self.a.width, self.a.height], shift)?;
        if a.width.min(a.height) < 8 {
            return None;
        }
        let [mut sa, mut sb, mut saa, mut sab, mut sbb] = [0.0_f64; 5];
        for y in 0..a.height {
            let row_a = (a.y + y) * self.a.width + a.x;
            let row_b = (b.y + y) * self.b.width + b.x;
            let values_a = &self.a.values[row_a..row_a + a.width];
            let values_b = &self.b.values[row_b..row_b + b.width];
            for (&va, &vb) in values_a.iter().zip(values_b) {
                let (va, vb) = (f64::from(va), f64::from(vb));
                sa += va;
                sb += vb;
                saa += va * va;
                sab += va * vb;
                sbb += vb * vb;
            }
        }
        let n = a.area() as f64;
        let spread = ((saa - sa * sa / n) * (sbb - sb * sb / n)).sqrt();
        (spread > 0.0).then(|| ((sab - sa * sb / n) / spread, a.area()))
    }
}

/// The rectangle of a tile that a neighbour at `delta` ± `radius` may cover.
fn reachable(tile_size: [usize; 2], delta: [i64; 2], radius: usize) -> Option<Rect> {
    let range = |k: usize| {
        let (size, radius) = (tile_size[k] as i64, radius as i64);
        let low = (delta[k] - radius).max(0);
        let high = (delta[k] + size + radius).min(size);
        (high > low).then_some((low as usize, (high - low) as usize))
    };
    let ((x, width), (y, height)) = (range(0)?, range(1)?);
    Some(Rect { x, y, width, height })
}

/// The least size of only the factors 2, 3 and 5: those transforms are fast.
fn fast_size(least: usize) -> usize {
    let smooth = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    let mut size = least.max(2);
    while !smooth(size) {
        size += 1;
    }
    size
}

/// Both strips, tapered, as real and imaginary part of one field.
fn packed(a: &Patch, b: &Patch, width: usize, height: usize) -> Vec<Complex<f32>> {
    let mut field = vec![Complex::new(0.0, 0.0); width * height];
    let taper = |n: usize| -> Vec<f32> { (0..n).map(|i| taper(i, n)).collect() };
    let (across, down) = (taper(a.width), taper(a.height));
    for y in 0..a.height {
        for x in 0..a.width {
            let weight = across[x] * down[y];
            field[y * width + x] = Complex::new(a.at(x, y) * weight, b.at(x, y) * weight);
        }
    }
    field
}

/// Raised cosine over the outer eighth (at most 16 px) of each end.
fn taper(index: usize, length: usize) -> f32 {
    let ramp = (length as f32 / 8.0).clamp(1.0, 16.0);
    let from_end = index.min(length - 1 - index) as f32 + 0.5;
    if from_end >= ramp { 1.0 } else { 0.5 - 0.5 * (std::f32::consts::PI * from_end / ramp).cos() }
}

/// Whitened and low-passed cross power of the two real fields that are packed in the transform of one complex one.
fn cross_power(field: &[Complex<f32>], width: usize, height: usize) -> Vec<Complex<f32>> {
    let mut cross = Vec::with_capacity(field.len());
    let cycles = |i: usize, n: usize| i.min(n - i) as f32 / n as f32;
    let low_pass = |i: usize, n: usize| (-(cycles(i, n) / CUT_OFF).powi(2)).exp();
    let across: Vec<f32> = (0..width).map(|i| low_pass(i, width)).collect();
    for y in 0..height {
        let mirror_row = (height - y) % height * width;
        let down = low_pass(y, height);
        for x in 0..width {
            let here = field[y * width + x];
            let mirror = field[mirror_row + (width - x) % width].conj();
            let a = (here + mirror) * 0.5;
            let b = (here - mirror) * Complex::new(0.0, -0.5);
            let product = a * b.conj();
            let weight = across[x] * down / product.norm().max(1e-12);
            cross.push(product * weight);
        }
    }
    cross
}

/// Transforms of one size.
struct Plans {
    width: usize,
    height: usize,
    forward: [Arc<dyn Fft<f32>>; 2],
    inverse: [Arc<dyn Fft<f32>>; 2],
}

impl Plans {
    fn forward(&self, field: &mut Vec<Complex<f32>>) {
        self.both_ways(&self.forward, field);
    }

    fn inverse(&self, field: &mut Vec<Complex<f32>>) {
        self.both_ways(&self.inverse, field);
    }

    fn both_ways(&self, [rows, columns]: &[Arc<dyn Fft<f32>>; 2], field: &mut Vec<Complex<f32>>) {
        rows.process(field);
        let mut turned = turned(field, self.width, self.height);
        columns.process(&mut turned);
        *field = self::turned(&turned, self.height, self.width);
    }
}

fn turned(field: &[Complex<f32>], width: usize, height: usize) -> Vec<Complex<f32>> {
    let mut out = Vec::with_capacity(field.len());
    for x in 0..width {
        out.extend((0..height).map(|y| field[y * width + x]));
    }
    out
}

/// Correlation over all shifts, negative ones wrapped to the end.
struct Surface {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl Surface {
    fn at(&self, [x, y]: [i64; 2]) -> f32 {
        let column = x.rem_euclid(self.width as i64) as usize;
        let row = y.rem_euclid(self.height as i64) as usize;
        self.values[row * self.width + column]
    }

    /// The highest local maxima within the radius of the expected shift, and the expected shift itself.
    fn peaks(&self, strips: &Strips) -> Vec<[i64; 2]> {
        let radius = strips.radius as i64;
        let mut found: Vec<(f32, [i64; 2])> = Vec::new();
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                let shift = [strips.expected[0] + dx, strips.expected[1] + dy];
                if self.is_maximum(shift) {
                    found.push((self.at(shift), shift));
                }
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        found.iter().take(CANDIDATES).map(|(_, shift)| *shift).chain([strips.expected]).collect()
    }

    fn is_maximum(&self, [x, y]: [i64; 2]) -> bool {
        let here = self.at([x, y]);
        let around = (-1..=1).flat_map(|j| (-1..=1).map(move |i| [x + i, y + j]));
        around.filter(|&s| s != [x, y]).all(|s| self.at(s) <= here)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Channels, Depth};

    /// Smoothed hash noise: no two places are alike.
    fn texture(x: f64, y: f64) -> f64 {
        let lattice = |i: i64, j: i64| {
            let h = (i.wrapping_mul(0x9E37_79B9) ^ j.wrapping_mul(0x85EB_CA6B))
                .wrapping_mul(0x27D4_EB2F_1656_67C5);
            ((h as u64) >> 40) as f64 / f64::from(1 << 24)
        };
        let (u, v) = (x / 7.0, y / 7.0);
        let (i, j) = (u.floor(), v.floor());
        let ease = |t: f64| t * t * (3.0 - 2.0 * t);
        let (s, t) = (ease(u - i), ease(v - j));
        let (i, j) = (i as i64, j as i64);
        let top = lattice(i, j) * (1.0 - s) + lattice(i + 1, j) * s;
        let bottom = lattice(i, j + 1) * (1.0 - s) + lattice(i + 1, j + 1) * s;
        200.0 * (top * (1.0 - t) + bottom * t)
    }

    fn tile(origin: [f64; 2]) -> Image {
        let values: Vec<f32> = (0..200 * 200)
            .map(|i| texture(origin[0] + (i % 200) as f64, origin[1] + (i / 200) as f64) as f32)
            .collect();
        Image::from_f32(200, 200, Channels::Grey, Depth::Eight, &values).unwrap()
    }

    #[test]
    fn a_displacement_is_found_across_the_whole_search_radius() {
        let correlator = Correlator::new();
        let a = tile([0.0, 0.0]);
        for off in [[0.0, 0.0], [18.3, -17.6], [-19.4, 12.2], [3.5, 19.5]] {
            let truth = [165.0 + off[0], -4.0 + off[1]];
            let found = correlator.find([&a, &tile(truth)], [165.0, -4.0], 20).unwrap();
            assert!((0..2).all(|k| (found.delta[k] - truth[k]).abs() < 0.05), "{:?} {truth:?}", found.delta);
        }
    }

    #[test]
    fn strangers_are_not_matched() {
        let correlator = Correlator::new();
        let a = tile([0.0, 0.0]);
        for k in 0..8 {
            let stranger = tile([3000.0 + 500.0 * f64::from(k), 7000.0]);
            assert!(correlator.find([&a, &stranger], [165.0, 0.0], 20).is_none(), "{k}");
        }
    }

    #[test]
    fn neighbours_are_pairs_with_a_broad_overlap() {
        let places = [[0.0, 0.0], [450.0, 3.0], [2.0, 451.0], [452.0, 450.0], [2000.0, 0.0]];
        let pairs: Vec<_> = neighbours(&places, [512, 512]).iter().map(|p| (p.a, p.b)).collect();
        assert_eq!(pairs, [(0, 1), (0, 2), (1, 3), (2, 3)]);
        assert_eq!(overlapping(&places, [512, 512]).count(), 6);
    }

    #[test]
    fn fast_sizes_hold_what_they_must() {
        assert_eq!([7, 121, 512, 577].map(fast_size), [8, 125, 512, 600]);
    }
}
