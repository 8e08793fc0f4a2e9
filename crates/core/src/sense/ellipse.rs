//! The ellipse that a pair of encoder signals draws, and the fit that finds it (Heydemann, Appl. Opt. 20, 3382, 1981).
//!
//! Model: x = R cos θ + p, y = R g sin(θ + φ) + q. A conic A x² + B y² + C xy + D x + E y = 1 is fitted by least squares,
//! and the five constants of the model are read off it. Floats: between ticks, not in one.

use super::moments::{Moments, ORDER};

/// Constants of a conic.
pub(super) const FIRST: usize = 5;

/// What is wrong with a pair of signals.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ellipse {
    /// Offset of the cosine channel, in its unit.
    pub p: f64,
    /// Offset of the sine channel.
    pub q: f64,
    /// Amplitude of the cosine channel over that of the sine channel: 1/g.
    pub r: f64,
    /// By how much the sine channel lags a quarter of a period behind, rad: −φ.
    pub alpha: f64,
    /// Amplitude of the cosine channel.
    pub radius: f64,
}

/// Why a fit has no answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FitError {
    /// Fewer samples than unknowns.
    TooFew {
        /// How many there were.
        samples: u32,
    },
    /// The signals stand still.
    Constant,
    /// Some eighths of the period were not seen: an arc fits many ellipses.
    PartialArc {
        /// One bit for each eighth that was seen, from the positive cosine axis on.
        octants: u8,
    },
    /// The best conic is no ellipse.
    NoEllipse,
    /// It is one that no working encoder draws: α beyond ±30°, or r outside 0.5 … 2.
    Unlikely(Ellipse),
}

/// α of a working encoder lies within ± this, rad: 30°.
pub const LARGEST_ALPHA: f64 = core::f64::consts::FRAC_PI_6;
/// r of a working encoder.
pub const RATIOS: core::ops::RangeInclusive<f64> = 0.5..=2.0;

impl core::fmt::Display for FitError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::TooFew { samples } => {
                write!(f, "{samples} samples are too few for the five constants of an ellipse")
            }
            Self::Constant => f.write_str("the signals do not move"),
            Self::PartialArc { octants } => write!(
                f,
                "the signals went through {} of the 8 eighths of a period: an arc fits many ellipses",
                octants.count_ones()
            ),
            Self::NoEllipse => f.write_str("the signals draw no ellipse"),
            Self::Unlikely(Ellipse { r, alpha, .. }) => write!(
                f,
                "the signals draw an ellipse that no working encoder draws (amplitudes {r:.2} : 1, {:.1}° from quadrature)",
                alpha.to_degrees()
            ),
        }
    }
}

impl core::error::Error for FitError {}

impl Ellipse {
    /// Perfect signals of an amplitude.
    pub const fn circle(radius: f64) -> Self {
        Self { p: 0.0, q: 0.0, r: 1.0, alpha: 0.0, radius }
    }

    /// The ellipse that fits the sums best.
    ///
    /// # Errors
    /// See [`FitError`].
    pub fn fit(moments: &Moments) -> Result<Self, FitError> {
        let normal = Normal::of(moments)?;
        let conic = normal.solve().ok_or(FitError::NoEllipse)?;
        normal.ellipse(conic)
    }

    /// A sample with offsets, unequal amplitudes and quadrature error taken off, cosine and sine.
    #[inline]
    pub fn straighten(&self, x: f64, y: f64) -> [f64; 2] {
        let u = x - self.p;
        let v = self.r * (y - self.q);
        [u, (u * libm::sin(self.alpha) + v) / libm::cos(self.alpha)]
    }

    /// The phase of a sample, turns, −½ … ½.
    pub fn turns(&self, x: f64, y: f64) -> f64 {
        let [u, v] = self.straighten(x, y);
        libm::atan2(v, u) / core::f64::consts::TAU
    }

    /// Peak and rms of the position error inside a period, as parts of the period, when the signals are taken as they
    /// are; the mean is no error, it moves the zero.
    pub fn uncorrected(&self) -> [f64; 2] {
        const PLACES: u32 = 720;
        let error = |place: u32| {
            let angle = f64::from(place) / f64::from(PLACES) * core::f64::consts::TAU;
            let x = self.radius * libm::cos(angle) + self.p;
            let y = self.radius / self.r * libm::sin(angle - self.alpha) + self.q;
            let off = libm::atan2(y, x) - angle;
            off / core::f64::consts::TAU - libm::round(off / core::f64::consts::TAU)
        };
        let mean = (0..PLACES).map(error).sum::<f64>() / f64::from(PLACES);
        let off = (0..PLACES).map(|place| error(place) - mean);
        let peak = off.clone().fold(0.0, |peak: f64, off| peak.max(off.abs()));
        [peak, libm::sqrt(off.map(|off| off * off).sum::<f64>() / f64::from(PLACES))]
    }

    /// A x² + B y² + C xy + D x + E y = 1 around a centre and in a unit; none where the centre lies outside.
    pub(super) fn conic(&self, centre: [f64; 2], unit: f64) -> Option<[f64; FIRST]> {
        let (sin, cos) = (libm::sin(self.alpha), libm::cos(self.alpha));
        let (p, q) = ((self.p - centre[0]) / unit, (self.q - centre[1]) / unit);
        let radius = self.radius / unit;
        // u² + ((u sin α + r v) / cos α)² = R², with u = x − p and v = y − q.
        let (a, b, c) = (1.0, self.r * self.r, 2.0 * self.r * sin);
        let left = radius * radius * cos * cos - a * p * p - b * q * q - c * p * q;
        let (d, e) = (-2.0 * a * p - c * q, -2.0 * b * q - c * p);
        (left > 0.0).then(|| [a, b, c, d, e].map(|k| k / left))
    }
}

/// The normal equations of the conic, Σ φφᵀ κ = Σ φ with φ = [x², y², xy, x, y], around the sums' centre and in a unit
/// that makes the ellipse about 1 in size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Normal {
    pub(super) matrix: [[f64; FIRST]; FIRST],
    pub(super) right: [f64; FIRST],
    pub(super) samples: f64,
    centre: [f64; 2],
    unit: f64,
}

impl Normal {
    pub(super) fn of(moments: &Moments) -> Result<Self, FitError> {
        let samples = moments.samples();
        if (samples as usize) < FIRST {
            return Err(FitError::TooFew { samples });
        }
        let n = moments.sum(0, 0);
        let [x, y, xx, yy] = [[1, 0], [0, 1], [2, 0], [0, 2]].map(|[i, j]| moments.sum(i, j) / n);
        let spread = xx - x * x + yy - y * y;
        if spread <= 0.0 || spread < 1e-12 * (xx + yy) {
            return Err(FitError::Constant);
        }
        if moments.octants() != u8::MAX {
            return Err(FitError::PartialArc { octants: moments.octants() });
        }
        Ok(Self::with_unit(moments, libm::sqrt(spread)))
    }

    pub(super) fn with_unit(moments: &Moments, unit: f64) -> Self {
        let sum = |i: usize, j: usize| moments.sum(i, j) / libm::pow(unit, (i.wrapping_add(j)) as f64);
        // Powers of x and y of each regressor.
        let powers = [[2, 0], [0, 2], [1, 1], [1, 0], [0, 1]];
        let product = |a: [usize; 2], b: [usize; 2]| sum(a[0].wrapping_add(b[0]), a[1].wrapping_add(b[1]));
        Self {
            matrix: powers.map(|row| powers.map(|column| product(row, column))),
            right: powers.map(|[i, j]| sum(i, j)),
            // The sum of the weights, which fading makes a broken number.
            samples: moments.sum(0, 0),
            centre: moments.centre(),
            unit,
        }
    }

    pub(super) fn solve(&self) -> Option<[f64; FIRST]> {
        super::solve::solve(self.matrix, self.right)
    }

    /// Σ (φᵀκ − 1)²: how badly a conic fits.
    pub(super) fn misfit(&self, conic: &[f64; FIRST]) -> f64 {
        let mut sum = self.samples;
        for ((row, right), a) in self.matrix.iter().zip(self.right).zip(conic) {
            let along: f64 = row.iter().zip(conic).map(|(m, b)| m * b).sum();
            sum += a * (along - 2.0 * right);
        }
        sum
    }

    /// The misfit of an ellipse; none for one whose inside does not hold the centre.
    pub(super) fn misfit_of(&self, ellipse: &Ellipse) -> Option<f64> {
        Some(self.misfit(&ellipse.conic(self.centre, self.unit)?))
    }

    /// The constants of the model (Heydemann's equations, around the centre).
    pub(super) fn ellipse(&self, [a, b, c, d, e]: [f64; FIRST]) -> Result<Ellipse, FitError> {
        let discriminant = 4.0 * a * b - c * c;
        if !(a > 0.0 && b > 0.0 && discriminant > 0.0) {
            return Err(FitError::NoEllipse);
        }
        let p = (e * c - 2.0 * b * d) / discriminant;
        let q = (d * c - 2.0 * a * e) / discriminant;
        let inside = 1.0 + a * p * p + b * q * q + c * p * q;
        let ellipse = Ellipse {
            p: self.centre[0] + self.unit * p,
            q: self.centre[1] + self.unit * q,
            r: libm::sqrt(b / a),
            alpha: libm::asin(c / libm::sqrt(4.0 * a * b)),
            radius: self.unit * libm::sqrt(4.0 * b * inside / discriminant),
        };
        let likely = ellipse.alpha.abs() <= LARGEST_ALPHA && RATIOS.contains(&ellipse.r);
        if likely && ellipse.radius > 0.0 { Ok(ellipse) } else { Err(FitError::Unlikely(ellipse)) }
    }
}

const _: () = assert!(ORDER == 4, "the normal equations need sums up to the fourth power");

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    fn samples(ellipse: Ellipse, number: u32, noise: &mut impl FnMut() -> f64) -> Vec<[f64; 2]> {
        let Ellipse { p, q, r, alpha, radius } = ellipse;
        (0..number)
            .map(|k| {
                let angle = f64::from(k) / f64::from(number) * TAU * 7.0 + 0.1;
                let sin = (angle - alpha).sin();
                [radius * angle.cos() + p + noise(), radius / r * sin + q + noise()]
            })
            .collect()
    }

    fn sums(samples: &[[f64; 2]]) -> Moments {
        Moments::of_all(samples.iter().copied())
    }

    #[test]
    fn the_check_of_the_formulas_comes_out() {
        let truth = Ellipse { p: 0.05, q: -0.03, r: 1.0 / 1.08, alpha: -4_f64.to_radians(), radius: 1.0 };
        let found = Ellipse::fit(&sums(&samples(truth, 200, &mut || 0.0))).unwrap();
        assert!(
            (found.r - 0.925_926).abs() < 1e-6 && (found.alpha.to_degrees() + 4.0).abs() < 1e-10,
            "{found:?}"
        );
        assert!((found.radius - 1.0).abs() < 1e-12 && (found.p - 0.05).abs() < 1e-12, "{found:?}");
        let [peak, rms] = found.uncorrected().map(|part| 800.0 * part);
        assert!((peak - 12.9).abs() < 0.01 && (rms - 6.98).abs() < 0.01, "{peak} {rms}");
    }

    proptest! {
        #[test]
        fn an_exact_ellipse_leaves_less_than_1e_12_of_a_period(
            p in -0.5..0.5_f64, q in -0.5..0.5_f64, r in 0.6..1.6_f64, alpha in -0.4..0.4_f64,
            radius in 10.0..30_000.0_f64, far in -3.0..3.0_f64,
        ) {
            let truth = Ellipse { p: (p + far) * radius, q: q * radius, r, alpha, radius };
            let samples = samples(truth, 500, &mut || 0.0);
            let found = Ellipse::fit(&sums(&samples)).unwrap();
            for (k, [x, y]) in samples.iter().enumerate() {
                let angle = (k as f64 / 500.0 * 7.0) + 0.1 / TAU;
                let off = found.turns(*x, *y) - angle;
                prop_assert!((off - off.round()).abs() < 1e-12, "{} {:?} {:?}", off - off.round(), found, truth);
            }
        }

        #[test]
        fn conic_and_ellipse_are_one(
            p in -0.5..0.5_f64, q in -0.5..0.5_f64, r in 0.6..1.6_f64, alpha in -0.4..0.4_f64,
        ) {
            let truth = Ellipse { p, q, r, alpha, radius: 1.0 };
            let normal = Normal::of(&sums(&samples(truth, 100, &mut || 0.0))).unwrap();
            prop_assert!(normal.misfit_of(&truth).unwrap() < 1e-20 * 100.0 + 1e-12);
        }
    }

    #[test]
    fn what_cannot_be_fitted_says_why() {
        let truth = Ellipse { p: 3.0, q: 1.0, r: 1.0, alpha: 0.0, radius: 10.0 };
        let all = samples(truth, 700, &mut || 0.0);
        assert_eq!(Ellipse::fit(&sums(&all[..4])), Err(FitError::TooFew { samples: 4 }));
        assert_eq!(Ellipse::fit(&sums(&[[5.0, 5.0]; 100])), Err(FitError::Constant));
        let arc = Ellipse::fit(&sums(&all[..40]));
        assert!(matches!(arc, Err(FitError::PartialArc { octants }) if octants != 0xff), "{arc:?}");
        let flat = Ellipse { r: 3.0, ..truth };
        let unlikely = Ellipse::fit(&sums(&samples(flat, 700, &mut || 0.0)));
        assert!(
            matches!(unlikely, Err(FitError::Unlikely(found)) if (found.r - 3.0).abs() < 1e-9),
            "{unlikely:?}"
        );
    }
}
