//! What is left after compensation, in the terms of paper A and of ISO 230-2.

use serde::Serialize;

use crate::axis::Approach;
use crate::iso230::{self, Iso230};
use crate::readings::Readings;

/// What paper A reports of its stage after compensation (seven runs a point, both axes together).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PaperA {
    /// Lowest and highest mean error of a point, µm.
    pub mean_um: [f64; 2],
    /// Largest single error (Y, 20 mm), µm.
    pub worst_single_um: f64,
    /// Largest spread of the runs at a point (Y, 10 mm), µm.
    pub spread_um: f64,
    /// Stated repeatability over 100 × 100 mm, ± µm.
    pub stated_um: f64,
}

/// The figures printed in paper A.
pub const PAPER_A: PaperA =
    PaperA { mean_um: [-3.6, 3.8], worst_single_um: 4.4, spread_um: 3.0, stated_um: 5.0 };

/// What is left after compensation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// Lowest mean error over targets and directions.
    pub mean_min: At,
    /// Highest mean error over targets and directions.
    pub mean_max: At,
    /// The single error of largest size, signed, and the run (from 1) it happened in.
    pub worst_single: At,
    /// Run of the worst single error, from 1.
    pub worst_run: usize,
    /// Largest spread of the runs at one target from one side: maximum minus minimum.
    pub spread: At,
    /// The evaluation by the standard.
    pub iso230: Iso230,
}

/// A value and the point where it was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct At {
    /// The value, µm.
    pub value_um: f64,
    /// The target, mm.
    pub target_mm: f64,
    /// Side of the approach.
    pub approach: Approach,
}

/// Bounds that a compensated axis must stay within, µm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limits {
    /// Every mean error, ±.
    pub mean_um: f64,
    /// Every single error, ±.
    pub worst_single_um: f64,
    /// Spread of the runs at a point.
    pub spread_um: f64,
    /// ISO 230-2 bidirectional accuracy A.
    pub a_um: f64,
}

impl Default for Limits {
    /// The bounds this project sets itself for the `microscope-100` stage; each is tighter than paper A's figure.
    fn default() -> Self {
        Self { mean_um: 2.0, worst_single_um: 3.0, spread_um: 2.0, a_um: 5.0 }
    }
}

/// One figure against its bound.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Name of the figure.
    pub figure: &'static str,
    /// Size found, µm.
    pub value_um: f64,
    /// Bound, µm.
    pub limit_um: f64,
    /// Whether the size is within the bound.
    pub pass: bool,
}

impl Verification {
    /// Evaluates readings that were taken with the compensation on.
    pub fn of(readings: &Readings) -> Self {
        let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
        let spread = |errors: &[f64]| highest(errors) - lowest(errors);
        let means = at_points(readings, mean);
        let singles = at_points(readings, |errors| errors[largest(errors)]);
        let worst_single = extreme(&singles, f64::abs);
        Self {
            mean_min: extreme(&means, |value| -value),
            mean_max: extreme(&means, |value| value),
            worst_run: run_of(readings, worst_single),
            worst_single,
            spread: extreme(&at_points(readings, spread), |value| value),
            iso230: iso230::evaluate(readings),
        }
    }

    /// Largest size of a mean error, µm.
    pub fn mean_size_um(&self) -> f64 {
        self.mean_min.value_um.abs().max(self.mean_max.value_um.abs())
    }

    /// Each figure against its bound.
    pub fn checks(&self, limits: &Limits) -> [Check; 4] {
        let check = |figure, value_um: f64, limit_um: f64| Check {
            figure,
            value_um,
            limit_um,
            pass: value_um <= limit_um,
        };
        [
            check("mean error per point and direction", self.mean_size_um(), limits.mean_um),
            check("worst single error", self.worst_single.value_um.abs(), limits.worst_single_um),
            check("spread of the runs at a point", self.spread.value_um, limits.spread_um),
            check("ISO 230-2 accuracy A", self.iso230.figures.a, limits.a_um),
        ]
    }
}

/// One value for every target and approach, from the errors of its runs.
fn at_points(readings: &Readings, value: impl Fn(&[f64]) -> f64) -> Vec<At> {
    let side = |approach| {
        let rows = readings.deviations_um(approach);
        let at =
            |(&target_mm, errors): (&f64, Vec<f64>)| At { value_um: value(&errors), target_mm, approach };
        readings.targets_mm().iter().zip(rows).map(at).collect::<Vec<_>>()
    };
    Approach::BOTH.into_iter().flat_map(side).collect()
}

/// The first point with the largest `rank`; `points` is never empty because readings never are.
fn extreme(points: &[At], rank: impl Fn(f64) -> f64) -> At {
    points[1..].iter().fold(
        points[0],
        |best, point| {
            if rank(point.value_um) > rank(best.value_um) { *point } else { best }
        },
    )
}

/// Run, from 1, of the error of largest size at the point of `worst`.
fn run_of(readings: &Readings, worst: At) -> usize {
    let rows = readings.deviations_um(worst.approach);
    let row = readings.targets_mm().iter().position(|&target| target == worst.target_mm);
    row.map_or(1, |i| largest(&rows[i]) + 1)
}

/// Place of the value of largest size.
fn largest(values: &[f64]) -> usize {
    (1..values.len()).fold(0, |best, i| if values[i].abs() > values[best].abs() { i } else { best })
}

fn highest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

fn lowest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}
