//! Pieces of tiles as luminance, made ready for comparison.

use crate::image::Image;
use crate::shading::Shading;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rect {
    pub(crate) x: usize,
    pub(crate) y: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Rect {
    pub(crate) fn area(&self) -> usize {
        self.width * self.height
    }

    /// The rectangle less `margin` pixels on every side; empty sides become zero.
    pub(crate) fn inset(&self, margin: usize) -> Self {
        Self {
            x: self.x + margin,
            y: self.y + margin,
            width: self.width.saturating_sub(2 * margin),
            height: self.height.saturating_sub(2 * margin),
        }
    }

    /// Divides into `columns × rows` blocks of nearly equal size.
    pub(crate) fn blocks(self, columns: usize, rows: usize) -> impl Iterator<Item = Self> {
        let edge = |length: usize, i: usize, n: usize| length * i / n;
        (0..columns * rows).map(move |i| {
            let (column, row) = (i % columns, i / columns);
            let (left, right) = (edge(self.width, column, columns), edge(self.width, column + 1, columns));
            let (top, bottom) = (edge(self.height, row, rows), edge(self.height, row + 1, rows));
            Self { x: self.x + left, y: self.y + top, width: right - left, height: bottom - top }
        })
    }
}

/// What two tiles of equal size share when the second lies `delta` (whole pixels) from the first: the rectangle in
/// the first and in the second.
pub(crate) fn common(tile_size: [usize; 2], delta: [i64; 2]) -> Option<(Rect, Rect)> {
    let size = tile_size.map(|n| n as i64);
    let extent = [0, 1].map(|k| size[k] - delta[k].abs());
    if extent[0] <= 0 || extent[1] <= 0 {
        return None;
    }
    let rect = |sign: i64| Rect {
        x: (sign * delta[0]).max(0) as usize,
        y: (sign * delta[1]).max(0) as usize,
        width: extent[0] as usize,
        height: extent[1] as usize,
    };
    Some((rect(1), rect(-1)))
}

/// Luminance of a piece of a tile.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) values: Vec<f32>,
}

impl Patch {
    /// Cuts a piece out of a tile, evened by the shading if there is one.
    pub(crate) fn cut(image: &Image, rect: Rect, shading: Option<&Shading>) -> Self {
        let value = |x, y| match shading {
            None => image.luminance(x, y),
            Some(shading) => shading.evened_luminance(image, x, y),
        };
        let rows = rect.y..rect.y + rect.height;
        let values = rows.flat_map(|y| (rect.x..rect.x + rect.width).map(move |x| (x, y)));
        Self { width: rect.width, height: rect.height, values: values.map(|(x, y)| value(x, y)).collect() }
    }

    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// Ready for comparison: noise smoothed (Gaussian, σ = 1 px), slow brightness changes removed (mean over
    /// 49 × 49 px), so that structure counts and illumination does not.
    pub(crate) fn structure(&self) -> Self {
        let smooth = self.smoothed();
        let mean = smooth.box_mean(24);
        let values = smooth.values.iter().zip(&mean.values).map(|(v, m)| v - m).collect();
        Self { values, ..smooth }
    }

    /// Variance of the values (whose mean is taken for zero) and of their slopes along x and y, per pixel.
    pub(crate) fn variances(&self) -> (f64, [f64; 2]) {
        let (mut sum, mut along, mut down) = (0.0, 0.0, 0.0);
        for y in 1..self.height.saturating_sub(1) {
            for x in 1..self.width.saturating_sub(1) {
                let slope = |a: f32, b: f32| f64::from(a - b).powi(2) / 4.0;
                sum += f64::from(self.at(x, y)).powi(2);
                along += slope(self.at(x + 1, y), self.at(x - 1, y));
                down += slope(self.at(x, y + 1), self.at(x, y - 1));
            }
        }
        let pixels = (self.width.saturating_sub(2) * self.height.saturating_sub(2)).max(1) as f64;
        (sum / pixels, [along / pixels, down / pixels])
    }

    fn smoothed(&self) -> Self {
        /// exp(−n²/2) for n = 0, 1, 2, 3, made to sum to one over −3…3.
        const KERNEL: [f32; 4] = [0.399_05, 0.242_04, 0.054_01, 0.004_425];
        let across = self.filtered_rows(&KERNEL);
        across.transposed().filtered_rows(&KERNEL).transposed()
    }

    fn filtered_rows(&self, half_kernel: &[f32; 4]) -> Self {
        let mut values = Vec::with_capacity(self.values.len());
        let last = self.width as i64 - 1;
        for row in self.values.chunks_exact(self.width) {
            for x in 0..row.len() as i64 {
                let tap = |n: i64| row[(x + n).clamp(0, last) as usize];
                let pairs = (1..4).map(|n| half_kernel[n as usize] * (tap(n) + tap(-n)));
                values.push(half_kernel[0] * tap(0) + pairs.sum::<f32>());
            }
        }
        Self { values, ..*self }
    }

    fn transposed(&self) -> Self {
        let mut values = Vec::with_capacity(self.values.len());
        for x in 0..self.width {
            values.extend((0..self.height).map(|y| self.at(x, y)));
        }
        Self { width: self.height, height: self.width, values }
    }

    /// Mean over a square of `2 · radius + 1` pixels, cut at the rim.
    fn box_mean(&self, radius: usize) -> Self {
        let across = self.row_means(radius);
        across.transposed().row_means(radius).transposed()
    }

    fn row_means(&self, radius: usize) -> Self {
        let mut values = Vec::with_capacity(self.values.len());
        let mut sums = vec![0.0_f64; self.width + 1];
        for row in self.values.chunks_exact(self.width) {
            for (x, &v) in row.iter().enumerate() {
                sums[x + 1] = sums[x] + f64::from(v);
            }
            values.extend((0..self.width).map(|x| {
                let (low, high) = (x.saturating_sub(radius), (x + radius + 1).min(self.width));
                ((sums[high] - sums[low]) / (high - low) as f64) as f32
            }));
        }
        Self { values, ..*self }
    }

    /// Values at `window` moved by `offset` pixels, by cubic interpolation; the rim is repeated outwards.
    pub(crate) fn moved(&self, window: Rect, offset: [f64; 2]) -> Self {
        let whole = offset.map(f64::floor);
        let weights = [0, 1].map(|k| cubic_weights((offset[k] - whole[k]) as f32));
        let index = |start: usize, i: usize, k: usize, tap: usize, size: usize| {
            (start as i64 + i as i64 + whole[k] as i64 + tap as i64 - 1).clamp(0, size as i64 - 1) as usize
        };
        let columns: Vec<[usize; 4]> =
            (0..window.width).map(|i| [0, 1, 2, 3].map(|t| index(window.x, i, 0, t, self.width))).collect();
        let mut values = Vec::with_capacity(window.area());
        for j in 0..window.height {
            let rows = [0, 1, 2, 3].map(|t| index(window.y, j, 1, t, self.height) * self.width);
            for taps in &columns {
                let along =
                    |row: usize| (0..4).map(|t| weights[0][t] * self.values[row + taps[t]]).sum::<f32>();
                values.push((0..4).map(|t| weights[1][t] * along(rows[t])).sum());
            }
        }
        Self { width: window.width, height: window.height, values }
    }
}

/// Weights of four neighbours at −1, 0, 1, 2 for a place at `t`, `0 ≤ t < 1`: Catmull–Rom, exact for parabolas.
pub(crate) fn cubic_weights(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(width: usize, height: usize, f: impl Fn(f64, f64) -> f64) -> Patch {
        let values = (0..width * height).map(|i| f((i % width) as f64, (i / width) as f64) as f32).collect();
        Patch { width, height, values }
    }

    #[test]
    fn common_rectangles_mirror_each_other() {
        let (a, b) = common([100, 80], [90, -10]).unwrap();
        assert_eq!(a, Rect { x: 90, y: 0, width: 10, height: 70 });
        assert_eq!(b, Rect { x: 0, y: 10, width: 10, height: 70 });
        assert_eq!(common([100, 80], [100, 0]), None);
    }

    #[test]
    fn moving_a_parabola_is_exact() {
        let f = |x: f64, y: f64| 3.0 + 0.2 * x * x - 0.7 * y + 0.01 * x * y;
        let moved = plane(20, 16, f).moved(Rect { x: 5, y: 5, width: 6, height: 4 }, [0.3, -1.6]);
        for (i, v) in moved.values.iter().enumerate() {
            let expected = f((5 + i % 6) as f64 + 0.3, (5 + i / 6) as f64 - 1.6);
            assert!((f64::from(*v) - expected).abs() < 1e-4);
        }
    }

    #[test]
    fn structure_has_no_slow_part_and_keeps_the_fast_one() {
        let flat = plane(120, 30, |x, _| 100.0 + x).structure();
        assert!(flat.at(60, 15).abs() < 1e-3);
        let wave = plane(120, 30, |x, _| (x * 0.8).sin()).structure();
        let largest = wave.values.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        assert!((0.68..0.85).contains(&largest), "{largest}: exp(−0.8²/2) = 0.73");
    }
}
