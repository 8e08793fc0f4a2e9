//! Least-squares polynomials through measured errors, and the choice of their degree.
//!
//! Paper A chooses the degree by SSE and R², but both get better with every degree added, whether the degree means
//! anything or not. So they are shown, and the choice is made by leave-one-out cross-validation: each point is
//! predicted from all the others.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::iso230::Iso230;
use crate::polynomial::{MAX_DEGREE, Polynomial};

/// The highest degree tried unless the caller says otherwise.
pub const DEFAULT_MAX_DEGREE: usize = 16;

/// A higher degree must lower the cross-validated error by more than this part of it, or the lower degree stays.
///
/// One needless coefficient lowers it by luck in a few cases of a hundred by as much; and whoever keeps the lower
/// degree in vain loses at most this.
pub const REAL_GAIN: f64 = 0.05;

/// A measured error: actual minus commanded position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorPoint {
    /// Where, mm.
    pub x_mm: f64,
    /// How much, µm.
    pub error_um: f64,
}

/// All degrees tried and the one chosen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The polynomial of the chosen degree, on the range of the points.
    pub polynomial: Polynomial,
    /// Quality of the chosen degree.
    pub chosen: DegreeQuality,
    /// Quality of every degree from 1 up.
    pub degrees: Vec<DegreeQuality>,
    /// The points fitted, as given.
    pub points: Vec<ErrorPoint>,
}

impl Fit {
    /// What the chosen polynomial leaves at each point, µm.
    pub fn residuals_um(&self) -> Vec<f64> {
        self.points.iter().map(|p| p.error_um - self.polynomial.value_um(p.x_mm)).collect()
    }
}

/// How well one degree follows the points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DegreeQuality {
    /// The degree.
    pub degree: usize,
    /// Sum of squared residuals, µm².
    pub sse_um2: f64,
    /// 1 − SSE / (sum of squares about the mean); 1 when the points do not vary at all.
    pub r2: f64,
    /// Root mean square of the leave-one-out prediction errors, µm.
    pub cv_um: f64,
}

/// Why no polynomial was fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Fewer different positions than the degree needs.
    #[error("{found} different positions are too few, degree {degree} needs at least {needed}")]
    TooFewPoints {
        /// Different positions given.
        found: usize,
        /// Positions needed: degree + 2, so that each can be predicted from the others.
        needed: usize,
        /// The degree asked for.
        degree: usize,
    },
    /// NaN or infinite.
    #[error("point {index} is not finite: {error_um} µm at {x_mm} mm")]
    NotFinite {
        /// Place of the point, from 0.
        index: usize,
        /// Its position.
        x_mm: f64,
        /// Its error.
        error_um: f64,
    },
    /// Outside 1…[`MAX_DEGREE`].
    #[error("degree {degree} is outside 1 to {MAX_DEGREE}")]
    Degree {
        /// The degree asked for.
        degree: usize,
    },
    /// The positions are so close together that the coefficients are not determined.
    #[error("the positions do not determine a polynomial of degree {degree}")]
    Singular {
        /// The degree tried.
        degree: usize,
    },
}

/// The mean of both directions at every target: the error that a compensation should remove.
pub fn mean_error(evaluation: &Iso230) -> Vec<ErrorPoint> {
    let points = evaluation.points.iter();
    points.map(|p| ErrorPoint { x_mm: p.target_mm, error_um: p.mean_um }).collect()
}

/// Fits every degree from 1 to the smaller of `max_degree` and half the number of different positions, and chooses.
///
/// # Errors
/// [`FitError`]: fewer than three different positions, numbers that are not finite, a `max_degree` outside 1…32.
pub fn choose(points: &[ErrorPoint], max_degree: usize) -> Result<Fit, FitError> {
    if !(1..=MAX_DEGREE).contains(&max_degree) {
        return Err(FitError::Degree { degree: max_degree });
    }
    let highest = max_degree.min(check(points, 1)? / 2);
    let fits = (1..=highest).map(|degree| of_degree(points, degree)).collect::<Result<Vec<_>, _>>()?;
    let degrees: Vec<DegreeQuality> = fits.iter().map(|(_, quality)| *quality).collect();
    let (polynomial, chosen) = fits[most_parsimonious(&degrees)].clone();
    Ok(Fit { polynomial, chosen, degrees, points: points.to_vec() })
}

/// Fits one given degree.
///
/// # Errors
/// [`FitError`]: fewer than `degree` + 2 different positions, numbers that are not finite, a degree outside 1…32.
pub fn of_degree(points: &[ErrorPoint], degree: usize) -> Result<(Polynomial, DegreeQuality), FitError> {
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(FitError::Degree { degree });
    }
    check(points, degree)?;
    let range_mm = range(points);
    let singular = FitError::Singular { degree };
    let design = chebyshev_matrix(points, range_mm, degree);
    let errors = DVector::from_iterator(points.len(), points.iter().map(|p| p.error_um));
    let qr = design.clone().qr();
    let q = qr.q();
    let coefficients = qr.r().solve_upper_triangular(&(q.transpose() * &errors)).ok_or(singular.clone())?;
    let residuals = &errors - &design * &coefficients;
    let quality = quality(degree, &errors, &residuals, &q);
    let polynomial =
        Polynomial::new(range_mm, coefficients.iter().copied().collect()).map_err(|_| singular.clone())?;
    if quality.cv_um.is_finite() { Ok((polynomial, quality)) } else { Err(singular) }
}

/// Number of different positions, if all is finite and they are enough for `degree`.
fn check(points: &[ErrorPoint], degree: usize) -> Result<usize, FitError> {
    for (index, &ErrorPoint { x_mm, error_um }) in points.iter().enumerate() {
        if !(x_mm.is_finite() && error_um.is_finite()) {
            return Err(FitError::NotFinite { index, x_mm, error_um });
        }
    }
    let mut positions: Vec<f64> = points.iter().map(|p| p.x_mm).collect();
    positions.sort_by(f64::total_cmp);
    positions.dedup();
    let (found, needed) = (positions.len(), degree + 2);
    if found < needed { Err(FitError::TooFewPoints { found, needed, degree }) } else { Ok(found) }
}

fn range(points: &[ErrorPoint]) -> [f64; 2] {
    let positions = || points.iter().map(|p| p.x_mm);
    [positions().fold(f64::INFINITY, f64::min), positions().fold(f64::NEG_INFINITY, f64::max)]
}

/// `T_k(u_i)`: one row a point, one column a degree.
fn chebyshev_matrix(points: &[ErrorPoint], [low, high]: [f64; 2], degree: usize) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(points.len(), degree + 1);
    for (i, point) in points.iter().enumerate() {
        let u = (2.0 * point.x_mm - low - high) / (high - low);
        let (mut before, mut now) = (u, 1.0);
        for k in 0..=degree {
            matrix[(i, k)] = now;
            (before, now) = (now, 2.0 * u * now - before);
        }
    }
    matrix
}

/// `q` is the orthonormal factor of the design: row i has the squared length `h_ii`, the leverage of point i, and the
/// error of predicting point i from all others is its residual / (1 − `h_ii`).
fn quality(
    degree: usize,
    errors: &DVector<f64>,
    residuals: &DVector<f64>,
    q: &DMatrix<f64>,
) -> DegreeQuality {
    let sse_um2 = residuals.norm_squared();
    let about_mean = errors.add_scalar(-errors.mean()).norm_squared();
    let left_out =
        residuals.iter().zip(q.row_iter()).map(|(r, row)| (r / (1.0 - row.norm_squared())).powi(2));
    DegreeQuality {
        degree,
        sse_um2,
        r2: if about_mean > 0.0 { 1.0 - sse_um2 / about_mean } else { 1.0 },
        cv_um: (left_out.sum::<f64>() / errors.len() as f64).sqrt(),
    }
}

/// Place of the lowest degree whose cross-validated error is as good as the best, apart from [`REAL_GAIN`].
fn most_parsimonious(degrees: &[DegreeQuality]) -> usize {
    let best = degrees.iter().map(|d| d.cv_um).fold(f64::INFINITY, f64::min);
    // Rounding alone must not choose when the points lie exactly on a polynomial.
    let enough = best / (1.0 - REAL_GAIN) + 1e-9;
    degrees.iter().position(|d| d.cv_um <= enough).unwrap_or(0)
}
