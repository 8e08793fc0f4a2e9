//! Sub-pixel shift of one block against another by iterative least squares.
//!
//! Both sides are moved by half the shift, so that interpolation blurs both alike and pulls to no side; gain and
//! offset of the brightness are free. The normal matrix of the shift tells how well each direction is known: along
//! a straight edge it is not (Lucas and Kanade 1981; symmetric form after Birchfield).

use nalgebra::{Matrix4, Vector4};

use crate::image::Image;
use crate::patch::{Patch, Rect, common};
use crate::shading::Shading;

/// A block may move this far from where it was expected, px.
const MOST_MOVE_PX: f64 = 3.0;

/// Smoothing makes neighbouring residuals alike; so many pixels carry the information of one (Gaussian, σ = 1 px).
const PIXELS_A_SAMPLE: f64 = 12.0;

/// Inverse covariance of a shift, px⁻²: xx, xy, yy.
pub(crate) type Information = [f64; 3];

/// A measured displacement between two tiles.
#[derive(Clone, Debug)]
pub(crate) struct Match {
    /// Place in the first tile less place in the second of the same thing, px.
    pub(crate) delta: [f64; 2],
    /// Centre of the block as seen in the first tile, px.
    pub(crate) seen_a: [f64; 2],
    /// Centre of the block as seen in the second tile, px.
    pub(crate) seen_b: [f64; 2],
    pub(crate) information: Information,
    /// Normalised cross-correlation of the structure at this displacement, −1 to 1.
    pub(crate) ncc: f64,
}

/// How an overlap is divided.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Division {
    /// One block over everything.
    Whole,
    /// Blocks of about 64 px, at most 16 × 4 of them.
    Blocks,
}

impl Division {
    /// Sigmas of chance that a match must exceed. A whole overlap decides where tiles lie, and has been searched
    /// for; a block only says it better.
    fn sigmas(self) -> f64 {
        match self {
            Self::Whole => 5.0,
            Self::Blocks => 3.0,
        }
    }
}

/// Measures the displacement between two tiles that is expected at `expected` (px, within [`MOST_MOVE_PX`]), in one
/// or several blocks of their overlap. Blocks without trustworthy structure are left out.
pub(crate) fn measure(
    tiles: [&Image; 2],
    expected: [f64; 2],
    shading: Option<&Shading>,
    division: Division,
) -> Vec<Match> {
    let whole = expected.map(|v| v.round() as i64);
    let tile_size = [tiles[0].width(), tiles[0].height()];
    let Some((rect_a, rect_b)) = common(tile_size, whole) else { return Vec::new() };
    let a = Patch::cut(tiles[0], rect_a, shading).structure();
    let b = Patch::cut(tiles[1], rect_b, shading).structure();
    let start = [0, 1].map(|k| expected[k] - whole[k] as f64);
    let inside = Rect { x: 0, y: 0, width: rect_a.width, height: rect_a.height }.inset(3);
    let [columns, rows] = match division {
        Division::Whole => [1, 1],
        Division::Blocks => block_counts(inside),
    };
    let blocks = inside.blocks(columns, rows).filter(|block| block.width >= 12 && block.height >= 12);
    let measured = blocks.filter_map(|block| Some((block, shift(&a, &b, block, start, division.sigmas())?)));
    measured.map(|(block, found)| found.in_tiles(block, rect_a, rect_b, whole)).collect()
}

fn block_counts(rect: Rect) -> [usize; 2] {
    let along = |length: usize, most: usize| (length as f64 / 64.0).round().clamp(1.0, most as f64) as usize;
    let wide = rect.width >= rect.height;
    [along(rect.width, if wide { 16 } else { 4 }), along(rect.height, if wide { 4 } else { 16 })]
}

/// Shift found in a block: what is at `u + shift/2` in the first patch is at `u − shift/2` in the second.
struct Found {
    shift: [f64; 2],
    information: Information,
    ncc: f64,
}

impl Found {
    fn in_tiles(&self, block: Rect, rect_a: Rect, rect_b: Rect, whole: [i64; 2]) -> Match {
        let centre = [
            block.x as f64 + (block.width as f64 - 1.0) / 2.0,
            block.y as f64 + (block.height as f64 - 1.0) / 2.0,
        ];
        let (origin_a, origin_b) = ([rect_a.x, rect_a.y], [rect_b.x, rect_b.y]);
        Match {
            delta: [0, 1].map(|k| whole[k] as f64 + self.shift[k]),
            seen_a: [0, 1].map(|k| origin_a[k] as f64 + centre[k] + self.shift[k] / 2.0),
            seen_b: [0, 1].map(|k| origin_b[k] as f64 + centre[k] - self.shift[k] / 2.0),
            information: self.information,
            ncc: self.ncc,
        }
    }
}

fn shift(a: &Patch, b: &Patch, block: Rect, start: [f64; 2], sigmas: f64) -> Option<Found> {
    let mut shift = start;
    let mut gain = 1.0;
    for _ in 0..12 {
        let step = Normal::assemble(a, b, block, shift, gain).step()?;
        gain = step.gain;
        shift = [0, 1].map(|k| shift[k] + step.shift[k]);
        if (0..2).any(|k| (shift[k] - start[k]).abs() > MOST_MOVE_PX) {
            return None;
        }
        if step.shift[0].hypot(step.shift[1]) < 2e-3 {
            break;
        }
    }
    let last = Normal::assemble(a, b, block, shift, gain);
    let (information, ncc, least) = last.judgement(sigmas)?;
    (ncc > least).then_some(Found { shift, information, ncc })
}

/// The correlation that two unrelated pieces of structure stay below: so many sigmas of chance, at least 0.25 and at
/// most 0.9.
///
/// Chance correlates two pieces with a standard deviation of `√(area / pixels)`, where `area = π·ℓx·ℓy` is what one
/// independent sample covers and `ℓ² = variance / variance of the slope` its correlation length, px (Bartlett).
pub(crate) fn least_ncc(sigmas: f64, pixels: f64, variance: f64, slope_variances: [f64; 2]) -> f64 {
    let area = std::f64::consts::PI * variance / (slope_variances[0] * slope_variances[1]).sqrt();
    let chance = (area / pixels).sqrt();
    // Flat pieces have no slope: then nothing is enough.
    if chance.is_finite() { (sigmas * chance).clamp(0.25, 0.9) } else { 1.0 }
}

/// Normal equations of `a ≈ gain·b − gain·∇·δ + offset` over a block, all sums in a fixed order.
struct Normal {
    /// Of the columns b, −∂x, −∂y, 1.
    matrix: Matrix4<f64>,
    right: Vector4<f64>,
    sum_a: f64,
    sum_aa: f64,
    pixels: f64,
}

struct Step {
    shift: [f64; 2],
    gain: f64,
}

impl Normal {
    fn assemble(a: &Patch, b: &Patch, block: Rect, shift: [f64; 2], gain: f64) -> Self {
        // One pixel more on each side for the gradients; blocks lie at least three from the rim.
        let grown = Rect { x: block.x - 1, y: block.y - 1, width: block.width + 2, height: block.height + 2 };
        let a = a.moved(grown, shift.map(|v| v / 2.0));
        let b = b.moved(grown, shift.map(|v| -v / 2.0));
        let per_gain = (1.0 / gain) as f32;
        let mut sums = [[0.0_f64; 4]; 4];
        let mut normal =
            Self { matrix: Matrix4::zeros(), right: Vector4::zeros(), sum_a: 0.0, sum_aa: 0.0, pixels: 0.0 };
        for y in 1..=block.height {
            for x in 1..=block.width {
                let both = |x: usize, y: usize| a.at(x, y) * per_gain + b.at(x, y);
                let gx = f64::from(both(x + 1, y) - both(x - 1, y)) / 4.0;
                let gy = f64::from(both(x, y + 1) - both(x, y - 1)) / 4.0;
                let (va, row) = (f64::from(a.at(x, y)), [f64::from(b.at(x, y)), -gx, -gy, 1.0]);
                for i in 0..4 {
                    for j in i..4 {
                        sums[i][j] += row[i] * row[j];
                    }
                    normal.right[i] += row[i] * va;
                }
                normal.sum_a += va;
                normal.sum_aa += va * va;
            }
        }
        normal.pixels = block.area() as f64;
        normal.matrix = Matrix4::from_fn(|i, j| sums[i.min(j)][i.max(j)]);
        normal
    }

    fn step(&self) -> Option<Step> {
        let solution = self.matrix.cholesky()?.solve(&self.right);
        let gain = solution[0];
        if !(0.1..10.0).contains(&gain) {
            return None;
        }
        Some(Step { shift: [solution[1] / gain, solution[2] / gain], gain })
    }

    /// Inverse covariance of the shift, the correlation, and what correlation chance could reach.
    fn judgement(&self, sigmas: f64) -> Option<(Information, f64, f64)> {
        let mean_a = self.sum_a / self.pixels;
        let mean_b = self.matrix[(0, 3)] / self.pixels;
        let variance_a = self.sum_aa / self.pixels - mean_a * mean_a;
        let variance_b = self.matrix[(0, 0)] / self.pixels - mean_b * mean_b;
        let covariance = self.right[0] / self.pixels - mean_a * mean_b;
        if variance_a <= 0.0 || variance_b <= 0.0 {
            return None;
        }
        let ncc = covariance / (variance_a * variance_b).sqrt();
        let gain = covariance / variance_b;
        // Slopes were averaged over both sides, which lowers their variance where the sides differ.
        let slope_variance = |i: usize| 2.0 * self.matrix[(i, i)] / (self.pixels * (1.0 + ncc));
        let least = least_ncc(sigmas, self.pixels, variance_b, [slope_variance(1), slope_variance(2)]);
        // Never below the rounding of an 8-bit sample, or noise-free tiles would claim infinite precision.
        let residual = (variance_a * (1.0 - ncc * ncc)).max(1e-6 * variance_a);
        let inverse = self.matrix.try_inverse()?;
        let block = [inverse[(1, 1)], inverse[(1, 2)], inverse[(2, 2)]];
        let scale = residual * PIXELS_A_SAMPLE / (gain * gain);
        let [xx, xy, yy] = block.map(|v| v * scale);
        let determinant = xx * yy - xy * xy;
        (determinant > 0.0).then(|| ([yy / determinant, -xy / determinant, xx / determinant], ncc, least))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Channels, Depth};

    fn texture(x: f64, y: f64) -> f64 {
        128.0
            + 30.0 * (0.31 * x + 0.8 * (0.11 * y).sin()).sin()
            + 30.0 * (0.27 * y - 0.9 * (0.13 * x).cos()).cos()
    }

    fn tile(origin: [f64; 2], gain: f64, f: impl Fn(f64, f64) -> f64) -> Image {
        let values: Vec<f32> = (0..160 * 160)
            .map(|i| (gain * f(origin[0] + (i % 160) as f64, origin[1] + (i / 160) as f64)) as f32 * 200.0)
            .collect();
        Image::from_f32(160, 160, Channels::Grey, Depth::Sixteen, &values).unwrap()
    }

    #[test]
    fn shift_is_found_to_a_hundredth_under_another_gain() {
        let a = tile([0.0, 0.0], 1.0, texture);
        for step in [[100.37, 2.81], [99.5, -3.2], [101.0, 0.0]] {
            let b = tile(step, 0.8, texture);
            let expected = [step[0] + 0.9, step[1] - 0.8];
            let found = measure([&a, &b], expected, None, Division::Whole);
            let delta = found[0].delta;
            assert!((0..2).all(|k| (delta[k] - step[k]).abs() < 0.01), "{delta:?} {step:?}");
            assert!(found[0].ncc > 0.99);
        }
    }

    #[test]
    fn an_edge_is_known_across_and_not_along() {
        let edge = |x: f64, y: f64| 100.0 + 40.0 * (0.4 * x).sin() + 0.02 * (0.3 * y).sin();
        let (a, b) = (tile([0.0, 0.0], 1.0, edge), tile([100.3, 0.0], 1.0, edge));
        let found = measure([&a, &b], [100.0, 0.0], None, Division::Whole);
        let [xx, _, yy] = found[0].information;
        assert!(xx > 1000.0 * yy, "{xx} {yy}");
    }

    #[test]
    fn flat_overlaps_say_nothing() {
        let (a, b) = (tile([0.0, 0.0], 1.0, |_, _| 90.0), tile([100.0, 0.0], 1.0, |_, _| 90.0));
        assert!(measure([&a, &b], [100.0, 0.0], None, Division::Blocks).is_empty());
    }
}
