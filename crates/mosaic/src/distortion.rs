//! Lens distortion of the camera.

use serde::Serialize;

/// Coefficients of a distortion: the radial one, then seven monomials of x, then seven of y.
pub(crate) const TERMS: usize = 15;

/// Where an ideal place is seen: `seen = ideal + c₀·ρ²·n + Σ cᵢ·mᵢ(n)`, with `n` the ideal place from the centre of
/// the frame in half diagonals, `ρ = |n|`, and `mᵢ` the monomials of degree two and three for each axis. All
/// coefficients are pixels; `c₀` is the displacement at the corners, negative for barrel.
///
/// Constant and linear terms are left out: tiles at other places, or another pixel size, would do the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    coefficients: [f64; TERMS],
    centre: [f64; 2],
    half_diagonal: f64,
}

/// What is told about a distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DistortionSummary {
    /// Radial part at the corners, px, negative for barrel.
    pub radial_corner_px: f64,
    /// Its standard deviation, px.
    pub radial_sigma_px: f64,
    /// Whether terms other than the radial one were needed.
    pub beyond_radial: bool,
    /// Largest displacement at the corners and in the middle of the edges, px.
    pub largest_px: f64,
}

impl Distortion {
    /// No distortion, for tiles of this size in pixels.
    pub fn none(tile_size: [usize; 2]) -> Self {
        let centre = tile_size.map(|n| (n as f64 - 1.0) / 2.0);
        Self { coefficients: [0.0; TERMS], centre, half_diagonal: centre[0].hypot(centre[1]).max(0.5) }
    }

    /// The same frame with a radial distortion of so many pixels at the corners.
    #[must_use]
    pub fn with_radial_px(self, corner_px: f64) -> Self {
        self.with_coefficients(&[corner_px])
    }

    /// The same frame with other coefficients; those not given are zero.
    #[must_use]
    pub(crate) fn with_coefficients(self, given: &[f64]) -> Self {
        let mut coefficients = [0.0; TERMS];
        coefficients.iter_mut().zip(given).for_each(|(c, g)| *c = *g);
        Self { coefficients, ..self }
    }

    /// Radial displacement at the corners, px.
    pub fn radial_px(&self) -> f64 {
        self.coefficients[0]
    }

    pub(crate) fn coefficients(&self) -> &[f64; TERMS] {
        &self.coefficients
    }

    /// Displacement at an ideal tile place for each coefficient being one pixel.
    pub(crate) fn terms(&self, ideal: [f64; 2]) -> [[f64; 2]; TERMS] {
        let n = self.normalised(ideal);
        let m = monomials(n);
        let square = n[0] * n[0] + n[1] * n[1];
        std::array::from_fn(|i| match i {
            0 => n.map(|v| square * v),
            1..=7 => [m[i - 1], 0.0],
            _ => [0.0, m[i - 8]],
        })
    }

    /// Where in the tile an ideal place is seen.
    pub fn seen_from_ideal(&self, ideal: [f64; 2]) -> [f64; 2] {
        let off = self.displacement(ideal);
        [ideal[0] + off[0], ideal[1] + off[1]]
    }

    /// The ideal place of something seen in the tile. Four fixed-point steps: error below `10⁻³ px` while the
    /// distortion stays below 2 % of the half diagonal.
    pub fn ideal_from_seen(&self, seen: [f64; 2]) -> [f64; 2] {
        let mut ideal = seen;
        for _ in 0..4 {
            let off = self.displacement(ideal);
            ideal = [seen[0] - off[0], seen[1] - off[1]];
        }
        ideal
    }

    /// Largest displacement at the corners and in the middle of the edges, px.
    pub fn largest_px(&self) -> f64 {
        let at = |i: usize, j: usize| [self.centre[0] * i as f64, self.centre[1] * j as f64];
        let lengths = (0..9).map(|i| self.displacement(at(i % 3, i / 3))).map(|[x, y]| x.hypot(y));
        lengths.fold(0.0, f64::max)
    }

    fn normalised(&self, ideal: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| (ideal[k] - self.centre[k]) / self.half_diagonal)
    }

    fn displacement(&self, ideal: [f64; 2]) -> [f64; 2] {
        let n = self.normalised(ideal);
        let m = monomials(n);
        let radial = self.coefficients[0] * (n[0] * n[0] + n[1] * n[1]);
        let sum = |c: &[f64]| -> f64 { c.iter().zip(m).map(|(c, m)| c * m).sum() };
        [radial * n[0] + sum(&self.coefficients[1..8]), radial * n[1] + sum(&self.coefficients[8..])]
    }
}

fn monomials([x, y]: [f64; 2]) -> [f64; 7] {
    let (xx, xy, yy) = (x * x, x * y, y * y);
    [xx, xy, yy, xx * x, xx * y, x * yy, yy * y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corner_moves_by_the_radial_coefficient_and_back() {
        let lens = Distortion::none([512, 384]).with_radial_px(-1.5);
        let seen = lens.seen_from_ideal([0.0, 0.0]);
        assert!((seen[0].hypot(seen[1]) - 1.5).abs() < 1e-9, "{seen:?}");
        assert!(seen[0] > 0.0 && seen[1] > 0.0, "barrel draws corners in");
        assert!((lens.largest_px() - 1.5).abs() < 1e-9);
    }

    #[test]
    fn terms_add_up_to_the_displacement_and_are_undone() {
        let coefficients: Vec<f64> = (0..TERMS).map(|i| (i as f64 * 1.7).sin()).collect();
        let lens = Distortion::none([512, 384]).with_coefficients(&coefficients);
        for ideal in [[0.0, 0.0], [511.0, 20.0], [255.5, 191.5], [100.0, 380.0]] {
            let seen = lens.seen_from_ideal(ideal);
            for k in 0..2 {
                let sum: f64 = lens.terms(ideal).iter().zip(&coefficients).map(|(t, c)| t[k] * c).sum();
                assert!((seen[k] - ideal[k] - sum).abs() < 1e-9);
                assert!((lens.ideal_from_seen(seen)[k] - ideal[k]).abs() < 1e-3);
            }
        }
    }
}
