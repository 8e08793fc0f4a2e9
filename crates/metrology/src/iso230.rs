//! ISO 230-2:2014 (GB/T 17421.2): accuracy and repeatability of positioning of a linear axis.
//!
//! Notation of the standard: targets `i = 1…m`, runs `j = 1…n`, approach ↑ or ↓, deviation `x_ij = P_ij − P_i`.
//! Everything here is in µm unless its name says mm.

use serde::Serialize;

use crate::axis::Approach;
use crate::readings::Readings;

/// The complete evaluation of one set of readings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Iso230 {
    /// The figures that a certificate states.
    pub figures: Figures,
    /// The table behind them, targets ascending.
    pub points: Vec<Point>,
    /// How the axis moved as a whole from run to run: not a figure of the standard, but R hides it.
    pub drift: Drift,
}

/// The figures of the standard, µm; serialised under the standard's own letters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Bidirectional accuracy: max(x̄ + 2s) − min(x̄ − 2s) over targets and directions.
    #[serde(rename = "A")]
    pub a: f64,
    /// Unidirectional accuracy ↑.
    #[serde(rename = "A_up")]
    pub a_up: f64,
    /// Unidirectional accuracy ↓.
    #[serde(rename = "A_down")]
    pub a_down: f64,
    /// Bidirectional repeatability: max `R_i`.
    #[serde(rename = "R")]
    pub r: f64,
    /// Unidirectional repeatability ↑: max 4 s ↑.
    #[serde(rename = "R_up")]
    pub r_up: f64,
    /// Unidirectional repeatability ↓: max 4 s ↓.
    #[serde(rename = "R_down")]
    pub r_down: f64,
    /// Bidirectional systematic deviation: range of the means over targets *and* directions.
    #[serde(rename = "E")]
    pub e: f64,
    /// Unidirectional systematic deviation ↑.
    #[serde(rename = "E_up")]
    pub e_up: f64,
    /// Unidirectional systematic deviation ↓.
    #[serde(rename = "E_down")]
    pub e_down: f64,
    /// Mean bidirectional positional deviation: range of the mean of both directions.
    #[serde(rename = "M")]
    pub m: f64,
    /// Reversal value: max |`B_i`|.
    #[serde(rename = "B")]
    pub b: f64,
    /// Mean reversal value, signed: mean of `B_i` = x̄↑ − x̄↓.
    #[serde(rename = "B_mean")]
    pub b_mean: f64,
}

impl Figures {
    /// Each figure with the standard's letter, in the order a certificate lists them.
    pub fn named(&self) -> [(&'static str, f64); 12] {
        [
            ("A", self.a),
            ("A_up", self.a_up),
            ("A_down", self.a_down),
            ("R", self.r),
            ("R_up", self.r_up),
            ("R_down", self.r_down),
            ("E", self.e),
            ("E_up", self.e_up),
            ("E_down", self.e_down),
            ("M", self.m),
            ("B", self.b),
            ("B_mean", self.b_mean),
        ]
    }
}

/// One target position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Target `P_i`, mm.
    pub target_mm: f64,
    /// Mean deviation ↑.
    pub mean_up_um: f64,
    /// Mean deviation ↓.
    pub mean_down_um: f64,
    /// Mean of the two.
    pub mean_um: f64,
    /// Reversal value `B_i`, signed.
    pub b_um: f64,
    /// Standard deviation ↑ (n − 1).
    pub s_up_um: f64,
    /// Standard deviation ↓ (n − 1).
    pub s_down_um: f64,
    /// Repeatability ↑: 4 s.
    pub r_up_um: f64,
    /// Repeatability ↓: 4 s.
    pub r_down_um: f64,
    /// Bidirectional repeatability: max[2 s↑ + 2 s↓ + |B|; R↑; R↓].
    pub r_um: f64,
}

/// Drift from run to run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drift {
    /// Mean deviation of each run, all targets and both directions, minus that of the first run.
    pub shift_um: Vec<f64>,
    /// Largest minus smallest shift.
    pub span_um: f64,
}

/// Evaluates readings by the standard. Cannot fail: [`Readings`] always holds two runs and two targets or more.
pub fn evaluate(readings: &Readings) -> Iso230 {
    let up = readings.deviations_um(Approach::Up);
    let down = readings.deviations_um(Approach::Down);
    let rows = readings.targets_mm().iter().zip(up.iter().zip(&down));
    let points: Vec<Point> = rows.map(|(&target_mm, (up, down))| point(target_mm, up, down)).collect();
    Iso230 { figures: figures(&points), drift: drift(&up, &down), points }
}

fn point(target_mm: f64, up: &[f64], down: &[f64]) -> Point {
    let (mean_up_um, s_up_um) = mean_and_deviation(up);
    let (mean_down_um, s_down_um) = mean_and_deviation(down);
    let b_um = mean_up_um - mean_down_um;
    let (r_up_um, r_down_um) = (4.0 * s_up_um, 4.0 * s_down_um);
    Point {
        target_mm,
        mean_up_um,
        mean_down_um,
        mean_um: f64::midpoint(mean_up_um, mean_down_um),
        b_um,
        s_up_um,
        s_down_um,
        r_up_um,
        r_down_um,
        r_um: (2.0 * s_up_um + 2.0 * s_down_um + b_um.abs()).max(r_up_um).max(r_down_um),
    }
}

fn figures(points: &[Point]) -> Figures {
    let mean_up = Extent::of(points.iter().map(|p| (p.mean_up_um, 0.0)));
    let mean_down = Extent::of(points.iter().map(|p| (p.mean_down_um, 0.0)));
    let band_up = Extent::of(points.iter().map(|p| (p.mean_up_um, 2.0 * p.s_up_um)));
    let band_down = Extent::of(points.iter().map(|p| (p.mean_down_um, 2.0 * p.s_down_um)));
    let largest = |value: fn(&Point) -> f64| points.iter().map(value).fold(0.0, f64::max);
    Figures {
        a: band_up.joined(band_down).range(),
        a_up: band_up.range(),
        a_down: band_down.range(),
        r: largest(|p| p.r_um),
        r_up: largest(|p| p.r_up_um),
        r_down: largest(|p| p.r_down_um),
        e: mean_up.joined(mean_down).range(),
        e_up: mean_up.range(),
        e_down: mean_down.range(),
        m: Extent::of(points.iter().map(|p| (p.mean_um, 0.0))).range(),
        b: largest(|p| p.b_um.abs()),
        b_mean: points.iter().map(|p| p.b_um).sum::<f64>() / points.len() as f64,
    }
}

fn drift(up: &[Vec<f64>], down: &[Vec<f64>]) -> Drift {
    let runs = up.first().map_or(0, Vec::len);
    let rows = (up.len() + down.len()) as f64;
    let of_run = |j: usize| up.iter().chain(down).map(|row| row[j]).sum::<f64>() / rows;
    let means: Vec<f64> = (0..runs).map(of_run).collect();
    let shift_um: Vec<f64> = means.iter().map(|mean| mean - means[0]).collect();
    let span_um = Extent::of(shift_um.iter().map(|&shift| (shift, 0.0))).range();
    Drift { shift_um, span_um }
}

/// Mean and sample standard deviation (n − 1); `values` has two elements or more.
fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0)).sqrt())
}

/// Smallest and largest edge of a set of bands.
#[derive(Clone, Copy)]
struct Extent {
    low: f64,
    high: f64,
}

impl Extent {
    /// Extent of bands given as (centre, half width).
    fn of(bands: impl Iterator<Item = (f64, f64)>) -> Self {
        bands.fold(Self { low: f64::INFINITY, high: f64::NEG_INFINITY }, |extent, (centre, half)| Self {
            low: extent.low.min(centre - half),
            high: extent.high.max(centre + half),
        })
    }

    fn joined(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn range(self) -> f64 {
        self.high - self.low
    }
}
