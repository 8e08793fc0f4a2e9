//! A polynomial in the Chebyshev basis: µm of error over mm of position.
//!
//! Powers of raw millimetres lose all their digits at degree 12 on 0…120 mm; Chebyshev polynomials on the range scaled
//! to [−1, 1] lose none. Readers of the papers get the monomial form from [`Polynomial::monomial_um`].

use serde::Serialize;

/// Highest degree that is accepted anywhere; far above what a guide needs.
pub const MAX_DEGREE: usize = 32;

/// `e(x) = Σ c_k T_k(u)`, `u` = `x` scaled from the range to [−1, 1].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Polynomial {
    range_mm: [f64; 2],
    chebyshev_um: Vec<f64>,
}

/// Why numbers do not make a polynomial.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PolynomialFault {
    /// The range must have a length.
    #[error("the range {low_mm} to {high_mm} mm is empty or inverted")]
    Range {
        /// Lower end given.
        low_mm: f64,
        /// Upper end given.
        high_mm: f64,
    },
    /// NaN or infinite.
    #[error("coefficient {index} is {value}, expected a finite number")]
    NotFinite {
        /// Place of the coefficient, from 0.
        index: usize,
        /// The number.
        value: f64,
    },
    /// None, or more than [`MAX_DEGREE`] + 1.
    #[error("{count} coefficients, expected 1 to {}", MAX_DEGREE + 1)]
    Count {
        /// Coefficients given.
        count: usize,
    },
}

impl Polynomial {
    /// A polynomial on `range_mm` = [low, high] with Chebyshev coefficients in µm, constant first.
    ///
    /// # Errors
    /// [`PolynomialFault`] for an empty or inverted range, a number that is not finite, or a count outside 1…33.
    pub fn new(range_mm: [f64; 2], chebyshev_um: Vec<f64>) -> Result<Self, PolynomialFault> {
        let [low_mm, high_mm] = range_mm;
        if !(low_mm.is_finite() && high_mm.is_finite() && low_mm < high_mm) {
            return Err(PolynomialFault::Range { low_mm, high_mm });
        }
        if chebyshev_um.is_empty() || chebyshev_um.len() > MAX_DEGREE + 1 {
            return Err(PolynomialFault::Count { count: chebyshev_um.len() });
        }
        match chebyshev_um.iter().position(|c| !c.is_finite()) {
            Some(index) => Err(PolynomialFault::NotFinite { index, value: chebyshev_um[index] }),
            None => Ok(Self { range_mm, chebyshev_um }),
        }
    }

    /// Range `[low, high]` in mm on which the polynomial is defined.
    pub fn range_mm(&self) -> [f64; 2] {
        self.range_mm
    }

    /// Chebyshev coefficients in µm, constant first.
    pub fn chebyshev_um(&self) -> &[f64] {
        &self.chebyshev_um
    }

    /// Degree; a leading coefficient of zero counts.
    pub fn degree(&self) -> usize {
        self.chebyshev_um.len() - 1
    }

    /// Value in µm at `x_mm`. Outside the range a polynomial runs away: callers that may leave it use
    /// [`ErrorCurve`](crate::compensation::ErrorCurve).
    pub fn value_um(&self, x_mm: f64) -> f64 {
        clenshaw(&self.chebyshev_um, self.scaled(x_mm))
    }

    /// Slope in µm/mm at `x_mm`.
    pub fn slope_um_per_mm(&self, x_mm: f64) -> f64 {
        let scale = 2.0 / (self.range_mm[1] - self.range_mm[0]);
        clenshaw(&derivative(&self.chebyshev_um), self.scaled(x_mm)) * scale
    }

    /// Coefficients of 1, x, x², … (µm, x in mm), as a paper prints them.
    pub fn monomial_um(&self) -> Vec<f64> {
        let [low, high] = self.range_mm;
        let (scale, shift) = (2.0 / (high - low), -(high + low) / (high - low));
        // Horner's scheme in polynomials: result = result · (scale·x + shift) + coefficient.
        powers_of_u(&self.chebyshev_um).into_iter().rev().fold(Vec::new(), |inner, coefficient| {
            let mut outer = vec![0.0; inner.len() + 1];
            for (k, value) in inner.iter().enumerate() {
                outer[k] += value * shift;
                outer[k + 1] += value * scale;
            }
            outer[0] += coefficient;
            outer
        })
    }

    fn scaled(&self, x_mm: f64) -> f64 {
        let [low, high] = self.range_mm;
        (2.0 * x_mm - low - high) / (high - low)
    }
}

/// Σ `c_k` `T_k(u)` by Clenshaw's backward recurrence.
fn clenshaw(coefficients: &[f64], u: f64) -> f64 {
    let Some((first, rest)) = coefficients.split_first() else { return 0.0 };
    let (b1, b2) = rest.iter().rev().fold((0.0, 0.0), |(b1, b2), c| (c + 2.0 * u * b1 - b2, b1));
    first + u * b1 - b2
}

/// Chebyshev coefficients of d/du: `d_(k−1) = d_(k+1) + 2 k c_k`, the constant halved.
fn derivative(coefficients: &[f64]) -> Vec<f64> {
    let n = coefficients.len();
    let mut slope = vec![0.0; n + 1];
    for k in (1..n).rev() {
        slope[k - 1] = slope[k + 1] + 2.0 * k as f64 * coefficients[k];
    }
    slope[0] /= 2.0;
    slope.truncate(n.saturating_sub(1).max(1));
    slope
}

/// The same polynomial in powers of `u`, by `T_(k+1) = 2 u T_k − T_(k−1)`.
fn powers_of_u(coefficients: &[f64]) -> Vec<f64> {
    let n = coefficients.len();
    let mut sum = vec![0.0; n];
    let (mut before, mut now) = (vec![0.0; n], vec![0.0; n]);
    now[0] = 1.0;
    for (k, c) in coefficients.iter().enumerate() {
        for (total, power) in sum.iter_mut().zip(&now) {
            *total += c * power;
        }
        // T_1 = u T_0, without the factor 2 of the later steps.
        let factor = if k == 0 { 1.0 } else { 2.0 };
        let mut next: Vec<f64> = before.iter().map(|power| -power).collect();
        for i in 1..n {
            next[i] += factor * now[i - 1];
        }
        (before, now) = (now, next);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Powers summed by Horner's scheme.
    fn plain(coefficients: &[f64], x: f64) -> f64 {
        coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
    }

    #[test]
    fn chebyshev_of_known_polynomials() {
        // On [−1, 1]: T_2 = 2u² − 1, T_3 = 4u³ − 3u.
        let p = Polynomial::new([-1.0, 1.0], vec![1.0, 2.0, 3.0, 4.0]).unwrap();
        assert_eq!(p.monomial_um(), [1.0 - 3.0, 2.0 - 12.0, 6.0, 16.0]);
        for u in [-1.0, -0.3, 0.0, 0.5, 1.0] {
            assert!((p.value_um(u) - plain(&[-2.0, -10.0, 6.0, 16.0], u)).abs() < 1e-13);
            assert!((p.slope_um_per_mm(u) - plain(&[-10.0, 12.0, 48.0], u)).abs() < 1e-13);
        }
    }

    #[test]
    fn monomial_form_agrees_on_a_shifted_range() {
        let p = Polynomial::new([20.0, 120.0], vec![3.0, -1.0, 0.5, 0.25, -0.125]).unwrap();
        let powers = p.monomial_um();
        assert_eq!(powers.len(), 5);
        for x in [20.0, 33.3, 70.0, 120.0] {
            assert!((p.value_um(x) - plain(&powers, x)).abs() < 1e-11);
        }
    }

    #[test]
    fn slope_is_the_derivative() {
        let p = Polynomial::new([0.0, 100.0], vec![3.0, -1.0, 0.5, 0.25, -0.125, 0.7]).unwrap();
        for x in [0.0, 12.0, 50.0, 99.0] {
            let numeric = (p.value_um(x + 1e-4) - p.value_um(x - 1e-4)) / 2e-4;
            assert!((p.slope_um_per_mm(x) - numeric).abs() < 1e-7);
        }
        assert_eq!(Polynomial::new([0.0, 1.0], vec![3.0]).unwrap().slope_um_per_mm(0.5), 0.0);
    }

    #[test]
    fn refuses_what_is_no_polynomial() {
        let fault = |range, c| Polynomial::new(range, c).unwrap_err();
        assert!(matches!(fault([1.0, 0.0], vec![1.0]), PolynomialFault::Range { .. }));
        assert!(matches!(fault([0.0, f64::NAN], vec![1.0]), PolynomialFault::Range { .. }));
        assert_eq!(fault([0.0, 1.0], vec![]), PolynomialFault::Count { count: 0 });
        assert_eq!(fault([0.0, 1.0], vec![0.0; 34]), PolynomialFault::Count { count: 34 });
        assert!(matches!(
            fault([0.0, 1.0], vec![0.0, f64::NAN]),
            PolynomialFault::NotFinite { index: 1, .. }
        ));
    }
}
