//! Arcs.

use super::{Bend, Place, Spot};
use core::f64::consts::TAU;

/// An arc. If its ends are not equally far from the centre, as rounded numbers leave it, its radius goes from one distance
/// to the other in proportion to the angle, so that both ends are exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    centre: Place,
    /// Distances of the ends from the centre, pm.
    radii: [f64; 2],
    /// Direction of its beginning from the centre, rad, counterclockwise from x.
    begins: f64,
    /// Angle to its end, rad; positive is counterclockwise.
    sweep: f64,
}

impl Arc {
    /// From a place about a centre to another, counterclockwise or clockwise; a whole turn if both are one. The centre must
    /// be neither.
    pub fn new(from: Place, to: Place, centre: Place, counterclockwise: bool) -> Self {
        let [begins, ends] = [from, to].map(|[x, y]| libm::atan2(y - centre[1], x - centre[0]));
        let radii = [from, to].map(|end| super::distance(centre, end));
        // From 0, not included, to a turn.
        let turn = |angle: f64| if angle <= 0.0 { angle + TAU } else { angle };
        let sweep = match (from == to, counterclockwise) {
            (true, true) => TAU,
            (true, false) => -TAU,
            (false, true) => turn(ends - begins),
            (false, false) => -turn(begins - ends),
        };
        Self { centre, radii, begins, sweep }
    }

    fn radius(&self) -> f64 {
        f64::midpoint(self.radii[0], self.radii[1])
    }

    pub(super) fn length(&self) -> f64 {
        self.sweep.abs() * self.radius()
    }

    pub(super) fn bend(&self) -> Bend {
        Bend { curvature: 1.0 / self.radius(), ..Bend::default() }
    }

    pub(super) fn spot(&self, way: f64) -> Spot {
        let (length, [first, last]) = (self.length(), self.radii);
        let radius = first + way / length * (last - first);
        let (sin, cos) = libm::sincos(self.begins + way / length * self.sweep);
        // A picometre of the length is so much of the angle, and of the radius.
        let (turns, widens) = (self.sweep / length, (last - first) / length);
        Spot {
            at: [self.centre[0] + radius * cos, self.centre[1] + radius * sin],
            tangent: [widens * cos - radius * turns * sin, widens * sin + radius * turns * cos],
        }
    }
}
