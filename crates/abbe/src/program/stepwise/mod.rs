//! A program as paper A goes through it (rows A7 and A8): step by step, each one count of a grid on one axis.
//!
//! Lines and arcs by point-by-point comparison ([`compare`](abbe_core::plan::compare)), sines as chords of equal angles
//! ([`chords`](abbe_core::plan::chords)), each chord as a line. Rapids and references are no paths: they only go to a place
//! of the grid.
//!
//! | module | does |
//! |---|---|
//! | [`walk`] | the steps of a motion, or why there are none |
//! | [`truth`] | the path that was meant, and how far a point is beside it |
//! | [`pace`] | how long a step takes |
//! | [`survey`] | a whole program on paper |
//! | [`trace`] | its steps in a file |
//! | [`picture`] | its stairs drawn |
//! | [`stage`] | its steps on a stage |

pub(crate) mod pace;
pub(crate) mod picture;
pub(crate) mod stage;
pub(crate) mod survey;
#[cfg(test)]
pub(crate) mod tests;
pub(crate) mod trace;
pub(crate) mod truth;
pub(crate) mod walk;

use crate::preset::Preset;
use abbe_core::Pos;
use abbe_core::units::Counts;
use abbe_proto::gcode::Place;

/// The grid of steps; zero of the machine is one of its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    /// A step, pm.
    step: i64,
    /// How far a chord may be beside its sine, in steps.
    tolerance: f64,
}

impl Grid {
    /// By the step and the tolerance of a chord; without one that is a step.
    pub(crate) fn new(step: Pos, tolerance: Option<Pos>) -> Self {
        let step = step.pm().max(1);
        Self { step, tolerance: tolerance.map_or(1.0, |tolerance| tolerance.pm() as f64 / step as f64) }
    }

    /// The step that the scale can see: its count, the coarser one if the axes have two.
    pub(crate) fn count_of(preset: &Preset) -> Pos {
        let counts = preset.controller.settings.axes.each_ref().map(|axis| Pos::from_um(axis.count_um));
        counts[0].max(counts[1])
    }

    pub(crate) fn step(&self) -> Pos {
        Pos::from_pm(self.step)
    }

    pub(crate) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The point nearest to a place.
    pub(crate) fn nearest(&self, place: Place) -> [Counts; 2] {
        place.map(|at| Counts::new((at.pm() + self.step / 2).div_euclid(self.step)))
    }

    pub(crate) fn place(&self, point: [Counts; 2]) -> Place {
        point.map(|count| Pos::from_pm(count.get().saturating_mul(self.step)))
    }

    /// A place in steps, for measuring.
    pub(crate) fn in_steps(&self, place: Place) -> [f64; 2] {
        place.map(|at| at.pm() as f64 / self.step as f64)
    }
}

/// A point of the grid for measuring.
pub(crate) fn as_floats(point: [Counts; 2]) -> [f64; 2] {
    point.map(|count| count.get() as f64)
}
