//! All tile places at once: robust weighted least squares over every measured displacement.
//!
//! Unknown are the places of the tiles, how the camera frame lies to the nominal one (a shift, an angle and a
//! scale, common to all tiles) and, if asked for, the lens distortion. One observation says
//! `delta = place_b − place_a + Σ cᵢ · (Bᵢ(u_a) − Bᵢ(u_b))`, with `Bᵢ` the terms of the distortion.
//! Each tile is also held, weakly, at the place that the common model predicts from its nominal one: a tile that no
//! observation reaches is placed by the *corrected* prediction, not by the raw nominal.

use nalgebra::{DMatrix, DVector};

use crate::distortion::{Distortion, TERMS};
use crate::refine::{Information, Match};

/// How far the scale may be from one and the angle from zero a priori: half a per cent, and one degree in rad. Few
/// tiles with rough nominal places know the pixel size worse than its maker.
const MODEL_SIGMA: [f64; 2] = [0.005, 0.0175];

/// A displacement measured between two tiles.
#[derive(Clone, Debug)]
pub(crate) struct Observation {
    /// Number of the pair, to say later which pairs were used.
    pub(crate) pair: usize,
    pub(crate) a: usize,
    pub(crate) b: usize,
    pub(crate) found: Match,
}

/// What is solved, and how strictly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    /// Error of every displacement that its information does not know of, px.
    pub(crate) floor_px: f64,
    /// Residuals up to this are never rejected, px.
    pub(crate) tolerance_px: f64,
    /// How far a tile may be from its predicted place, one sigma, px; bettered from the tiles themselves.
    pub(crate) prior_px: f64,
    pub(crate) lens: LensModel,
}

/// Which terms of the lens distortion are unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LensModel {
    /// None: the lens is taken as given.
    Given,
    /// The radial term.
    Radial,
    /// All of second and third degree. Overlaps cannot tell all of them apart (a cubic along the step looks like a
    /// longer step): what they leave open is taken from the radial term, whose prior is the looser one.
    Polynomial,
}

impl LensModel {
    fn unknowns(self) -> usize {
        match self {
            Self::Given => 0,
            Self::Radial => 1,
            Self::Polynomial => TERMS,
        }
    }
}

/// Lens coefficients a priori, px: the radial one, and each of the others.
const LENS_PRIOR_PX: [f64; 2] = [20.0, 2.0];

/// How the camera's frame lies to the nominal one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StageModel {
    /// Mean of the nominal places, px.
    centre: [f64; 2],
    /// Length that makes the coefficients pixels.
    extent: f64,
    shift: [f64; 2],
    /// `(scale · cos(angle) − 1) · extent` and `scale · sin(angle) · extent`, px.
    coefficients: [f64; 2],
    /// Standard deviation of the coefficients, px.
    sigma: f64,
}

impl StageModel {
    /// The place predicted from a nominal one.
    pub(crate) fn place_from_nominal(&self, nominal: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|k| (nominal[k] - self.centre[k]) / self.extent);
        let [p, q] = self.coefficients;
        [nominal[0] + self.shift[0] + p * x - q * y, nominal[1] + self.shift[1] + q * x + p * y]
    }

    /// Pixels of the camera per nominal pixel.
    pub(crate) fn scale(&self) -> f64 {
        (1.0 + self.coefficients[0] / self.extent).hypot(self.coefficients[1] / self.extent)
    }

    /// From the nominal x axis towards the nominal y axis, rad.
    pub(crate) fn angle_rad(&self) -> f64 {
        (self.coefficients[1] / self.extent).atan2(1.0 + self.coefficients[0] / self.extent)
    }

    /// Standard deviation of scale and (in rad) angle.
    pub(crate) fn relative_sigma(&self) -> f64 {
        self.sigma / self.extent
    }
}

/// The result.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    /// Places, px; the first tile keeps its nominal one.
    pub(crate) places: Vec<[f64; 2]>,
    pub(crate) model: StageModel,
    pub(crate) lens: Distortion,
    /// Standard deviation of the distortion at the corner, px; infinite if not estimated.
    pub(crate) lens_sigma_px: f64,
    /// Which observations were kept.
    pub(crate) kept: Vec<bool>,
    /// Root mean square of the kept residuals, px.
    pub(crate) residual_rms_px: f64,
    /// Median residual of all observations, kept or not, px.
    pub(crate) median_residual_px: f64,
    /// Root mean square of the observed tiles from their predicted places, px, as used for the prior.
    pub(crate) prior_px: f64,
}

/// Solves for everything; see the module.
pub(crate) fn solve(
    nominal: &[[f64; 2]],
    lens: Distortion,
    observations: &[Observation],
    settings: Settings,
) -> Solution {
    let mut system = System::new(nominal, lens, observations, settings);
    let mut weights = vec![1.0; observations.len()];
    for _ in 0..8 {
        system.solve_once(&weights);
        let limit = system.limit();
        // Geman–McClure: beyond the limit an observation soon counts for nothing.
        weights = system.residuals().map(|e| (1.0 + (e / limit).powi(2)).powi(-2)).collect();
    }
    let limit = system.limit();
    let kept: Vec<bool> = system.residuals().map(|e| e <= limit).collect();
    let weights: Vec<f64> = kept.iter().map(|&k| f64::from(u8::from(k))).collect();
    for _ in 0..2 {
        system.solve_once(&weights);
    }
    system.into_solution(kept)
}

/// State of the iteration.
struct System<'a> {
    nominal: &'a [[f64; 2]],
    observations: &'a [Observation],
    settings: Settings,
    places: Vec<[f64; 2]>,
    model: StageModel,
    lens: Distortion,
    lens_sigma_px: f64,
    prior_px: f64,
}

impl<'a> System<'a> {
    fn new(
        nominal: &'a [[f64; 2]],
        lens: Distortion,
        observations: &'a [Observation],
        settings: Settings,
    ) -> Self {
        let n = nominal.len().max(1) as f64;
        let centre = [0, 1].map(|k| nominal.iter().map(|p| p[k]).sum::<f64>() / n);
        let square: f64 =
            nominal.iter().map(|p| (p[0] - centre[0]).powi(2) + (p[1] - centre[1]).powi(2)).sum();
        let extent = (square / n).sqrt().max(1.0);
        let model = StageModel {
            centre,
            extent,
            shift: [0.0; 2],
            coefficients: [0.0; 2],
            sigma: MODEL_SIGMA[0] * extent,
        };
        let (places, prior_px) = (nominal.to_vec(), settings.prior_px);
        let lens_sigma_px = f64::INFINITY;
        Self { nominal, observations, settings, places, model, lens, lens_sigma_px, prior_px }
    }

    /// Index of the first unknown after the places: shift x, y, coefficients, and perhaps the lens.
    fn common_index(&self) -> usize {
        2 * self.nominal.len()
    }

    fn unknowns(&self) -> usize {
        self.common_index() + 4 + self.settings.lens.unknowns()
    }

    /// Solves for the places less the nominal ones: small numbers, however far tiles lie from the origin.
    fn solve_once(&mut self, weights: &[f64]) {
        let mut normal = Normal::new(self.unknowns());
        self.add_gauge(&mut normal);
        self.add_prior(&mut normal);
        for (observation, &weight) in self.observations.iter().zip(weights) {
            self.add_observation(&mut normal, observation, weight);
        }
        // The prior makes the matrix positive definite; if rounding spoils it, the last places stand.
        let Some(cholesky) = normal.matrix.cholesky() else { return };
        let x = cholesky.solve(&normal.right);
        let variance = |index: usize| {
            let mut unit = DVector::zeros(x.len());
            unit[index] = 1.0;
            cholesky.solve(&unit)[index]
        };
        let c = self.common_index();
        let place = |(i, q): (usize, &[f64; 2])| [q[0] + x[2 * i], q[1] + x[2 * i + 1]];
        self.places = self.nominal.iter().enumerate().map(place).collect();
        self.model.shift = [x[c], x[c + 1]];
        self.model.coefficients = [x[c + 2], x[c + 3]];
        self.model.sigma = variance(c + 2).sqrt();
        if self.settings.lens != LensModel::Given {
            self.lens = self.lens.with_coefficients(&x.as_slice()[c + 4..]);
            self.lens_sigma_px = (variance(c + 4) * self.excess(weights)).sqrt();
        }
        self.update_prior(weights);
    }

    /// Fixes the first tile, and scale and angle loosely.
    fn add_gauge(&self, normal: &mut Normal) {
        let c = self.common_index();
        for (k, sigma) in MODEL_SIGMA.iter().enumerate() {
            normal.add(&[(k, 1.0)], 0.0, 1e6);
            normal.add(&[(c + 2 + k, 1.0)], 0.0, (sigma * self.model.extent).powi(-2));
        }
        for i in 0..self.settings.lens.unknowns() {
            normal.add(&[(c + 4 + i, 1.0)], 0.0, LENS_PRIOR_PX[usize::from(i > 0)].powi(-2));
        }
    }

    /// Holds every tile at its predicted place.
    fn add_prior(&self, normal: &mut Normal) {
        let c = self.common_index();
        let weight = self.prior_px.powi(-2);
        for (i, q) in self.nominal.iter().enumerate() {
            let [x, y] = [0, 1].map(|k| (q[k] - self.model.centre[k]) / self.model.extent);
            normal.add(&[(2 * i, 1.0), (c, -1.0), (c + 2, -x), (c + 3, y)], 0.0, weight);
            normal.add(&[(2 * i + 1, 1.0), (c + 1, -1.0), (c + 2, -y), (c + 3, -x)], 0.0, weight);
        }
    }

    fn add_observation(&self, normal: &mut Normal, observation: &Observation, weight: f64) {
        let Observation { a, b, found, .. } = observation;
        let lens = self.lens_terms(found);
        let [xx, xy, yy] = with_floor(found.information, self.settings.floor_px).map(|v| v * weight);
        // The square root of the weight matrix turns two correlated equations into independent ones.
        let first = xx.sqrt().max(1e-12);
        let rows = [[first, xy / first], [0.0, (yy - xy * xy / (first * first)).max(0.0).sqrt()]];
        let given = if self.settings.lens == LensModel::Given { self.pretended(&lens) } else { [0.0; 2] };
        let nominal = [0, 1].map(|k| self.nominal[*b][k] - self.nominal[*a][k]);
        let more = [0, 1].map(|k| found.delta[k] - nominal[k] - given[k]);
        for [wx, wy] in rows {
            let mut terms = vec![(2 * b, wx), (2 * b + 1, wy), (2 * a, -wx), (2 * a + 1, -wy)];
            let unknown = lens.iter().take(self.settings.lens.unknowns()).enumerate();
            terms.extend(unknown.map(|(i, t)| (self.common_index() + 4 + i, wx * t[0] + wy * t[1])));
            let right = wx * more[0] + wy * more[1];
            normal.add(&terms, right, 1.0);
        }
    }

    /// Displacement between the tiles that each lens coefficient pretends if it is one.
    fn lens_terms(&self, found: &Match) -> [[f64; 2]; TERMS] {
        let [a, b] = [found.seen_a, found.seen_b].map(|u| self.lens.terms(self.lens.ideal_from_seen(u)));
        std::array::from_fn(|i| [a[i][0] - b[i][0], a[i][1] - b[i][1]])
    }

    /// Displacement between the tiles that the present lens pretends.
    fn pretended(&self, terms: &[[f64; 2]; TERMS]) -> [f64; 2] {
        let coefficients = self.lens.coefficients();
        [0, 1].map(|k| terms.iter().zip(coefficients).map(|(t, c)| t[k] * c).sum())
    }

    fn residual(&self, observation: &Observation) -> [f64; 2] {
        let Observation { a, b, found, .. } = observation;
        let lens = self.pretended(&self.lens_terms(found));
        [0, 1].map(|k| self.places[*b][k] - self.places[*a][k] + lens[k] - found.delta[k])
    }

    /// Lengths of the residuals, px.
    fn residuals(&self) -> impl Iterator<Item = f64> {
        self.observations.iter().map(|o| self.residual(o)).map(|[x, y]| x.hypot(y))
    }

    /// Residuals beyond this are outliers: three robust sigmas, but never less than the tolerance.
    fn limit(&self) -> f64 {
        let mut lengths: Vec<f64> = self.residuals().collect();
        (3.0 * 1.4826 * median(&mut lengths)).max(self.settings.tolerance_px)
    }

    /// How much larger the residuals are than their information claims (reduced chi square, at least 1).
    fn excess(&self, weights: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (observation, weight) in self.observations.iter().zip(weights) {
            let [x, y] = self.residual(observation);
            let [xx, xy, yy] = with_floor(observation.found.information, self.settings.floor_px);
            sum += weight * (xx * x * x + 2.0 * xy * x * y + yy * y * y);
        }
        let freedom = 2.0 * weights.iter().sum::<f64>() - 2.0 * self.nominal.len() as f64;
        (sum / freedom.max(1.0)).max(1.0)
    }

    /// Learns from tiles that observations hold how good the nominal places are. Needs enough of them: four numbers
    /// of the model are fitted to the same tiles.
    fn update_prior(&mut self, weights: &[f64]) {
        let mut observed = vec![false; self.nominal.len()];
        for (observation, _) in self.observations.iter().zip(weights).filter(|(_, w)| **w > 0.5) {
            observed[observation.a] = true;
            observed[observation.b] = true;
        }
        let off = |i: usize| {
            let predicted = self.model.place_from_nominal(self.nominal[i]);
            (self.places[i][0] - predicted[0]).powi(2) + (self.places[i][1] - predicted[1]).powi(2)
        };
        let squares: Vec<f64> = (0..observed.len()).filter(|&i| observed[i]).map(off).collect();
        if squares.len() >= 5 {
            let freedom = 2.0 * squares.len() as f64 - 4.0;
            self.prior_px = (squares.iter().sum::<f64>() / freedom).sqrt().clamp(1.0, self.settings.prior_px);
        }
    }

    fn into_solution(self, kept: Vec<bool>) -> Solution {
        let squares: Vec<f64> =
            self.residuals().zip(&kept).filter(|(_, k)| **k).map(|(e, _)| e * e).collect();
        let sum = squares.iter().fold(0.0, |sum, square| sum + square);
        let residual_rms_px = (sum / squares.len().max(1) as f64).sqrt();
        let mut lengths: Vec<f64> = self.residuals().collect();
        // The gauge leaves a rounding error; the first tile is to stay exactly where it was.
        let rounding = [0, 1].map(|k| self.places[0][k] - self.nominal[0][k]);
        let places = self.places.iter().map(|p| [p[0] - rounding[0], p[1] - rounding[1]]).collect();
        Solution {
            residual_rms_px,
            median_residual_px: median(&mut lengths),
            places,
            model: self.model,
            lens: self.lens,
            lens_sigma_px: self.lens_sigma_px,
            kept,
            prior_px: self.prior_px,
        }
    }
}

/// Information after an independent error of `floor` px is added.
fn with_floor([xx, xy, yy]: Information, floor: f64) -> Information {
    let determinant = xx * yy - xy * xy;
    if determinant <= 0.0 {
        return [0.0; 3];
    }
    let (cxx, cxy, cyy) =
        (yy / determinant + floor * floor, -xy / determinant, xx / determinant + floor * floor);
    let determinant = cxx * cyy - cxy * cxy;
    [cyy / determinant, -cxy / determinant, cxx / determinant]
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Normal equations, summed row by row.
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl Normal {
    fn new(unknowns: usize) -> Self {
        Self { matrix: DMatrix::zeros(unknowns, unknowns), right: DVector::zeros(unknowns) }
    }

    /// Adds the equation `Σ factor · unknown = right` with a weight.
    fn add(&mut self, terms: &[(usize, f64)], right: f64, weight: f64) {
        for &(i, f) in terms {
            self.right[i] += weight * f * right;
            for &(j, g) in terms {
                self.matrix[(i, j)] += weight * f * g;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Settings =
        Settings { floor_px: 0.05, tolerance_px: 0.5, prior_px: 10.0, lens: LensModel::Given };

    /// A grid of tiles whose camera frame is turned and scaled; nominal places are off by a few pixels.
    fn grid(columns: usize, rows: usize) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let (s, c) = 0.3_f64.to_radians().sin_cos();
        let nominal: Vec<[f64; 2]> = (0..columns * rows)
            .map(|i| [450.0 * (i % columns) as f64, 450.0 * (i / columns) as f64])
            .collect();
        let off = |i: usize, k: usize| ((i * 7 + k * 3) % 11) as f64 / 2.5 - 2.0;
        let truth = nominal
            .iter()
            .enumerate()
            .map(|(i, [x, y])| [1.002 * (c * x - s * y) + off(i, 0), 1.002 * (s * x + c * y) + off(i, 1)])
            .collect();
        (nominal, truth)
    }

    fn observation(truth: &[[f64; 2]], a: usize, b: usize, lens: Distortion, along: f64) -> Observation {
        let delta = [0, 1].map(|k| truth[b][k] - truth[a][k]);
        let flat = delta[0].abs() > delta[1].abs();
        let ideal_a = if flat { [480.0, 512.0 * along] } else { [512.0 * along, 480.0] };
        let ideal_b = [0, 1].map(|k| ideal_a[k] - delta[k]);
        let (seen_a, seen_b) = (lens.seen_from_ideal(ideal_a), lens.seen_from_ideal(ideal_b));
        let delta = [0, 1].map(|k| seen_a[k] - seen_b[k]);
        let found = Match { delta, seen_a, seen_b, information: [1e4, 0.0, 1e4], ncc: 1.0 };
        Observation { pair: 0, a, b, found }
    }

    fn all(truth: &[[f64; 2]], columns: usize, lens: Distortion, along: &[f64]) -> Vec<Observation> {
        let mut list = Vec::new();
        for i in 0..truth.len() {
            for &t in along {
                if (i + 1) % columns != 0 {
                    list.push(observation(truth, i, i + 1, lens, t));
                }
                if i + columns < truth.len() {
                    list.push(observation(truth, i, i + columns, lens, t));
                }
            }
        }
        list
    }

    fn rms(places: &[[f64; 2]], truth: &[[f64; 2]]) -> f64 {
        let n = places.len() as f64;
        let mean = [0, 1].map(|k| places.iter().zip(truth).map(|(p, t)| p[k] - t[k]).sum::<f64>() / n);
        let square: f64 = places
            .iter()
            .zip(truth)
            .map(|(p, t)| (p[0] - t[0] - mean[0]).powi(2) + (p[1] - t[1] - mean[1]).powi(2))
            .sum();
        (square / n).sqrt()
    }

    #[test]
    fn wrong_pairs_are_rejected_and_the_rest_is_exact() {
        let (nominal, truth) = grid(4, 3);
        let lens = Distortion::none([512, 512]);
        let mut list = all(&truth, 4, lens, &[0.5]);
        for (i, off) in [(2, 30.0), (9, -17.0), (12, 8.0)] {
            list[i].found.delta[i % 2] += off;
        }
        let solution = solve(&nominal, lens, &list, SETTINGS);
        let rejected: Vec<usize> = (0..list.len()).filter(|&i| !solution.kept[i]).collect();
        assert_eq!(rejected, [2, 9, 12]);
        // The prior pulls a little; a hundredth of a pixel is what it may take.
        assert!(rms(&solution.places, &truth) < 0.02, "{}", rms(&solution.places, &truth));
        let angle = solution.model.angle_rad().to_degrees();
        assert!((angle - 0.3).abs() < 0.15 && (solution.model.scale() - 1.002).abs() < 0.003, "{angle}");
    }

    #[test]
    fn an_unreached_tile_follows_the_camera_angle_not_the_nominal() {
        let (nominal, truth) = grid(6, 5);
        let lens = Distortion::none([512, 512]);
        let last = truth.len() - 1;
        let list: Vec<_> =
            all(&truth, 6, lens, &[0.5]).into_iter().filter(|o| o.a != last && o.b != last).collect();
        let solution = solve(&nominal, lens, &list, SETTINGS);
        let raw = (nominal[last][0] - truth[last][0]).hypot(nominal[last][1] - truth[last][1]);
        let off =
            (solution.places[last][0] - truth[last][0]).hypot(solution.places[last][1] - truth[last][1]);
        assert!(raw > 10.0 && off < 5.0, "{raw} {off}");
    }

    #[test]
    fn distortion_comes_out_with_the_places() {
        let (nominal, truth) = grid(4, 3);
        let lens = Distortion::none([512, 512]).with_radial_px(-1.3);
        let list = all(&truth, 4, lens, &[0.05, 0.3, 0.5, 0.8, 0.95]);
        let none = Distortion::none([512, 512]);
        let solution = solve(&nominal, none, &list, Settings { lens: LensModel::Radial, ..SETTINGS });
        assert!((solution.lens.radial_px() + 1.3).abs() < 0.01, "{}", solution.lens.radial_px());
        assert!(rms(&solution.places, &truth) < 0.02);
        let blind = solve(&nominal, none, &list, SETTINGS);
        assert!(rms(&blind.places, &truth) > 0.5, "{}", rms(&blind.places, &truth));
    }

    #[test]
    fn without_observations_tiles_stay_nominal() {
        let (nominal, _) = grid(3, 2);
        let solution = solve(&nominal, Distortion::none([512, 512]), &[], SETTINGS);
        assert!(rms(&solution.places, &nominal) < 1e-6);
        assert!((solution.model.scale() - 1.0).abs() < 1e-9);
    }
}
