//! Small symmetric systems of equations, for the fits between ticks.

/// Solves a symmetric, positive definite system by Cholesky's method; none where it is not definite.
pub(super) fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> Option<[f64; N]> {
    // Rows and columns scaled to a unit diagonal: regressors of different size then weigh the same.
    let mut scale = [0.0; N];
    for ((scale, row), i) in scale.iter_mut().zip(&matrix).zip(0..) {
        let diagonal: f64 = *row.get(i)?;
        if diagonal.is_nan() || diagonal <= 0.0 {
            return None;
        }
        *scale = 1.0 / libm::sqrt(diagonal);
    }
    for ((row, right), of_row) in matrix.iter_mut().zip(&mut right).zip(scale) {
        *right *= of_row;
        row.iter_mut().zip(scale).for_each(|(cell, of_column)| *cell *= of_row * of_column);
    }
    let lower = factor(&matrix)?;
    let mut solution = back(&lower, forth(&lower, right)?)?;
    solution.iter_mut().zip(scale).for_each(|(value, scale)| *value *= scale);
    Some(solution)
}

/// L with L Lᵀ = matrix.
fn factor<const N: usize>(matrix: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let mut lower = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let (row, other) = (lower.get(i)?, lower.get(j)?);
            let taken: f64 = row.iter().zip(other).take(j).map(|(a, b)| a * b).sum();
            let rest = matrix.get(i)?.get(j)? - taken;
            let cell = if i == j {
                if rest.is_nan() || rest <= f64::EPSILON {
                    return None;
                }
                libm::sqrt(rest)
            } else {
                rest / other.get(j)?
            };
            *lower.get_mut(i)?.get_mut(j)? = cell;
        }
    }
    Some(lower)
}

/// y with L y = right.
fn forth<const N: usize>(lower: &[[f64; N]; N], right: [f64; N]) -> Option<[f64; N]> {
    let mut y = [0.0; N];
    for i in 0..N {
        let row = lower.get(i)?;
        let taken: f64 = row.iter().zip(&y).take(i).map(|(a, b)| a * b).sum();
        *y.get_mut(i)? = (right.get(i)? - taken) / row.get(i)?;
    }
    Some(y)
}

/// x with Lᵀ x = y.
fn back<const N: usize>(lower: &[[f64; N]; N], y: [f64; N]) -> Option<[f64; N]> {
    let mut x = [0.0; N];
    for i in (0..N).rev() {
        let taken: f64 =
            lower.iter().zip(&x).skip(i).skip(1).map(|(row, x)| row.get(i).copied().unwrap_or(0.0) * x).sum();
        *x.get_mut(i)? = (y.get(i)? - taken) / lower.get(i)?.get(i)?;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_of_any_scale_is_solved_and_a_singular_one_is_not() {
        let matrix = [[4e12, 2e6, 0.0], [2e6, 5.0, 1e-6], [0.0, 1e-6, 1e-12]];
        let expected = [3e-6, -2.0, 7e6];
        let right = matrix.map(|row| row.iter().zip(expected).map(|(a, b)| a * b).sum());
        for (found, expected) in solve(matrix, right).unwrap().iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-12);
        }
        assert_eq!(solve([[1.0, 1.0], [1.0, 1.0]], [1.0, 1.0]), None);
        assert_eq!(solve([[f64::NAN]], [1.0]), None);
    }
}
