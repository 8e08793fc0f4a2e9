//! Arcs.

use super::{Bend, Place, Spot};
use core::f64::consts::{FRAC_PI_2, TAU};

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

/// Ends and centre in whole picometres may add so much to the difference of the distances, pm: twice √2, rounded up.
const ROUNDED: f64 = 3.0;

impl Arc {
    /// From a place about a centre to another, counterclockwise or clockwise; a whole turn if both are one. None if the
    /// centre is one of them, or their distances from it differ by more than a tenth of the larger one and what whole
    /// picometres may add: that is no arc.
    pub fn new(from: Place, to: Place, centre: Place, counterclockwise: bool) -> Option<Self> {
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
        let (smaller, larger) = (radii[0].min(radii[1]), radii[0].max(radii[1]));
        let alike = smaller >= 0.9 * larger - ROUNDED;
        (smaller > 0.0 && alike).then_some(Self { centre, radii, begins, sweep })
    }

    /// Of an arc with the larger radius, and longer by what the radius changes: never too short, so that nothing is faster
    /// than it seems.
    pub(super) fn length(&self) -> f64 {
        let [first, last] = self.radii;
        libm::hypot(self.sweep * first.max(last), last - first)
    }

    /// Sharper than any of it: that of the smaller radius, by as much as the length is too long, and by what it turns while
    /// it widens. With w the widening for a picometre, the second derivative of the place is √(1 + 3w²) of that at most,
    /// and the third less than its square.
    pub(super) fn bend(&self) -> Bend {
        let [first, last] = self.radii;
        let widens = (last - first) / self.length();
        let steep = libm::sqrt(1.0 + 3.0 * squared(widens));
        Bend { curvature: first.max(last) / squared(first.min(last)) * steep, ..Bend::default() }
    }

    pub(super) fn turning(&self, way: f64) -> Place {
        let (length, [first, last]) = (self.length(), self.radii);
        let radius = first + way / length * (last - first);
        let (sin, cos) = libm::sincos(self.begins + way / length * self.sweep);
        let (turns, widens) = (self.sweep / length, (last - first) / length);
        let (inward, ahead) = (radius * turns * turns, 2.0 * widens * turns);
        [-inward * cos - ahead * sin, -inward * sin + ahead * cos]
    }

    /// To the right, up, to the left, down, as far as it comes there.
    pub(super) fn turning_points(&self, see: &mut dyn FnMut(Place)) {
        let (begins, sweep) = (self.begins / FRAC_PI_2, self.sweep / FRAC_PI_2);
        let (low, high) = (begins.min(begins + sweep), begins.max(begins + sweep));
        let first = libm::ceil(low);
        for quarter in 0..5 {
            let angle = first + f64::from(quarter);
            if angle <= high {
                see(self.spot((angle - begins) / sweep * self.length()).at);
            }
        }
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

fn squared(number: f64) -> f64 {
    number * number
}
