use abbe_metrology::fit::{DEFAULT_MAX_DEGREE, ErrorPoint, Fit, FitError, choose, of_degree};

/// Paper A's fitted polynomials, constant first: µm over mm.
const PAPER_X: [f64; 3] = [1.563, 0.9473, -0.0006];
const PAPER_Y: [f64; 3] = [1.021, 0.6397, 0.0168];

fn points(positions: impl IntoIterator<Item = f64>, error: impl Fn(f64) -> f64) -> Vec<ErrorPoint> {
    positions.into_iter().map(|x_mm| ErrorPoint { x_mm, error_um: error(x_mm) }).collect()
}

fn every_ten_mm(low: u32, high: u32) -> impl Iterator<Item = f64> {
    (low..=high).step_by(10).map(f64::from)
}

fn plain(coefficients: &[f64]) -> impl Fn(f64) -> f64 {
    move |x| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Errors that have no trend: a fixed, uneven pattern of about 1 µm.
fn scatter(x: f64) -> f64 {
    (x * 12.9898).sin() + 0.5 * (x * 78.233).sin()
}

#[test]
fn paper_a_coefficients_come_back() {
    for paper in [PAPER_X, PAPER_Y] {
        let (polynomial, quality) = of_degree(&points(every_ten_mm(10, 90), plain(&paper)), 2).unwrap();
        for (found, printed) in polynomial.monomial_um().iter().zip(paper) {
            assert!((found - printed).abs() < 1e-9, "{found} against {printed}");
        }
        assert!(quality.sse_um2 < 1e-18 && quality.cv_um < 1e-9 && (quality.r2 - 1.0).abs() < 1e-12);
        assert_eq!(polynomial.range_mm(), [10.0, 90.0]);
    }
}

#[test]
fn exact_points_choose_their_own_degree() {
    let chosen = |fit: Result<Fit, FitError>| fit.unwrap().chosen.degree;
    for degree in 1..=5 {
        let coefficients: Vec<f64> = (0..=degree).map(|k| 3.0 / 50f64.powi(k)).collect();
        let exact = points(every_ten_mm(0, 100), plain(&coefficients));
        assert_eq!(chosen(choose(&exact, DEFAULT_MAX_DEGREE)), degree as usize);
    }
}

#[test]
fn scatter_keeps_the_line_although_sse_and_r2_prefer_more() {
    let noisy = points(every_ten_mm(0, 100), |x| plain(&[1.0, 0.9])(x) + scatter(x));
    let fit = choose(&noisy, DEFAULT_MAX_DEGREE).unwrap();
    assert_eq!(fit.chosen.degree, 1);
    assert_eq!(fit.degrees.len(), 5, "at most half the number of points");
    assert!(fit.degrees.is_sorted_by(|a, b| a.sse_um2 >= b.sse_um2 && a.r2 <= b.r2));
}

#[test]
fn a_real_curvature_under_scatter_is_found() {
    let noisy = points(every_ten_mm(0, 100), |x| plain(&PAPER_Y)(x) + scatter(x));
    assert_eq!(choose(&noisy, DEFAULT_MAX_DEGREE).unwrap().chosen.degree, 2);
}

/// The short formula for leave-one-out errors against leaving each point out in earnest.
#[test]
fn cross_validation_equals_brute_force() {
    let noisy =
        points([0.0, 3.0, 10.0, 22.0, 31.0, 47.0, 60.0, 71.0, 85.0, 100.0], |x| 0.02 * x * x + scatter(x));
    for degree in 1..=5 {
        let mut sum = 0.0;
        for i in 0..noisy.len() {
            let mut others = noisy.clone();
            let left_out = others.remove(i);
            let (polynomial, _) = of_degree(&others, degree).unwrap();
            sum += (left_out.error_um - polynomial.value_um(left_out.x_mm)).powi(2);
        }
        let brute = (sum / noisy.len() as f64).sqrt();
        let (_, quality) = of_degree(&noisy, degree).unwrap();
        assert!(
            (quality.cv_um - brute).abs() < 1e-9 * brute,
            "degree {degree}: {} against {brute}",
            quality.cv_um
        );
    }
}

/// Straight line through (0, 1), (1, 2), (2, 4), by pencil: 5/6 + 3/2 x, SSE 1/6, R² = 27/28.
#[test]
fn a_line_by_hand() {
    let three = points([0.0, 1.0, 2.0], |x| [1.0, 2.0, 4.0][x as usize]);
    let (line, quality) = of_degree(&three, 1).unwrap();
    let powers = line.monomial_um();
    assert!((powers[0] - 5.0 / 6.0).abs() < 1e-14 && (powers[1] - 1.5).abs() < 1e-14);
    assert!((quality.sse_um2 - 1.0 / 6.0).abs() < 1e-14 && (quality.r2 - 27.0 / 28.0).abs() < 1e-14);
}

/// Powers of raw millimetres fail here: the condition of their matrix is far beyond 1e16.
#[test]
fn degree_twelve_over_the_whole_travel_stays_accurate() {
    let wave = |x: f64| 5.0 * ((x - 60.0) / 60.0 * 3.0).sin();
    let (polynomial, _) = of_degree(&points((0..=60).map(|i| f64::from(i) * 2.0), wave), 12).unwrap();
    let worst = (0..=1200).map(|i| f64::from(i) / 10.0).map(|x| (polynomial.value_um(x) - wave(x)).abs());
    assert!(worst.fold(0.0, f64::max) < 1e-4);
}

#[test]
fn constant_errors_have_no_nan() {
    let fit = choose(&points(every_ten_mm(0, 100), |_| 2.5), 8).unwrap();
    assert_eq!(fit.chosen.degree, 1);
    assert!(fit.degrees.iter().all(|d| d.r2.is_finite() && d.cv_um.is_finite()));
}

#[test]
fn refuses_what_cannot_be_fitted() {
    let two = points([0.0, 1.0], |x| x);
    assert_eq!(choose(&two, 8), Err(FitError::TooFewPoints { found: 2, needed: 3, degree: 1 }));
    let same_place = points([1.0; 9], |x| x);
    assert_eq!(choose(&same_place, 8), Err(FitError::TooFewPoints { found: 1, needed: 3, degree: 1 }));
    let hole = points([0.0, 1.0, 2.0, 3.0], |x| if x == 2.0 { f64::NAN } else { x });
    assert!(matches!(choose(&hole, 8), Err(FitError::NotFinite { index: 2, .. })));
    let four = points([0.0, 1.0, 2.0, 3.0], |x| x);
    assert_eq!(choose(&four, 0), Err(FitError::Degree { degree: 0 }));
    assert!(matches!(of_degree(&four, 3), Err(FitError::TooFewPoints { needed: 5, .. })));
}
