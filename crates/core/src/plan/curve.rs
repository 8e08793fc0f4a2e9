//! The shape of a motion, whatever its speed: where it is after how much of its length, and how fast it may be there.
//!
//! Places are picometres as floats: a hundred millimetres are exact to a thousandth of one.

use super::profile::Limits;
use core::f64::consts::TAU;

/// A place, x and y, pm.
pub type Place = [f64; 2];

/// A shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// Straight from one place to another.
    Line {
        /// Where it begins.
        from: Place,
        /// Where it ends.
        to: Place,
    },
    /// About a centre.
    Arc(Arc),
}

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

/// A place of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spot {
    /// Where it is, pm.
    pub at: Place,
    /// Where it goes there: the place's change for a picometre of the length.
    pub tangent: Place,
}

impl Arc {
    /// From a place about a centre to another, counterclockwise or clockwise; a whole turn if both are one.
    pub fn new(from: Place, to: Place, centre: Place, counterclockwise: bool) -> Self {
        let [begins, ends] = [from, to].map(|[x, y]| libm::atan2(y - centre[1], x - centre[0]));
        let radii = [from, to].map(|[x, y]| libm::hypot(x - centre[0], y - centre[1]));
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

    /// The mean of the radii at both ends, pm.
    pub fn radius(&self) -> f64 {
        f64::midpoint(self.radii[0], self.radii[1])
    }

    fn length(&self) -> f64 {
        self.sweep.abs() * self.radius()
    }

    fn spot(&self, way: f64) -> Spot {
        let (length, [first, last]) = (self.length(), self.radii);
        let part = if length > 0.0 { way / length } else { 0.0 };
        let radius = first + part * (last - first);
        let (sin, cos) = libm::sincos(self.begins + part * self.sweep);
        // A picometre of the length is so much of the angle, and of the radius.
        let (turns, widens) =
            if length > 0.0 { (self.sweep / length, (last - first) / length) } else { (0.0, 0.0) };
        Spot {
            at: [self.centre[0] + radius * cos, self.centre[1] + radius * sin],
            tangent: [widens * cos - radius * turns * sin, widens * sin + radius * turns * cos],
        }
    }

    /// Axes take what the arc needs in every direction, so the weaker of both limits holds in all. Going round at a speed
    /// takes an acceleration v²/r towards the centre and, as that turns, a jerk v³/r² backwards; speeding up meanwhile a
    /// jerk 3va/r inwards. Shares of the limits leave room for each: the acceleration's two stand square upon each other
    /// (√½), so do jerks of 0.4 + 0.4 along and 0.6 across.
    fn limits(&self, axes: &[Limits; 2], feed: f64) -> Limits {
        let [x, y] = axes;
        let radius = self.radius();
        let acceleration = x.acceleration.min(y.acceleration) * core::f64::consts::FRAC_1_SQRT_2;
        let jerk = x.jerk.min(y.jerk);
        let speed = x.speed.min(y.speed).min(feed);
        let speed =
            speed.min(libm::sqrt(acceleration * radius)).min(libm::cbrt(0.4 * jerk * radius * radius));
        Limits {
            speed,
            acceleration: acceleration.min(0.6 * jerk * radius / (3.0 * speed)),
            jerk: 0.4 * jerk,
        }
    }
}

impl Curve {
    /// Its length, pm.
    pub fn length(&self) -> f64 {
        match self {
            Self::Line { from, to } => libm::hypot(to[0] - from[0], to[1] - from[1]),
            Self::Arc(arc) => arc.length(),
        }
    }

    /// The place after a way, pm.
    pub fn spot(&self, way: f64) -> Spot {
        match self {
            Self::Line { from, to } => {
                let length = self.length();
                let share = |way: f64| if length > 0.0 { way / length } else { 0.0 };
                let tangent = [share(to[0] - from[0]), share(to[1] - from[1])];
                Spot { at: [from[0] + way * tangent[0], from[1] + way * tangent[1]], tangent }
            }
            Self::Arc(arc) => arc.spot(way),
        }
    }

    /// How fast the length may be gone through, so that no axis is beyond its limits; feed is pm a tick.
    pub fn limits(&self, axes: &[Limits; 2], feed: f64) -> Limits {
        match self {
            Self::Line { from, to } => {
                let length = self.length();
                let mut along = Limits { speed: feed, acceleration: f64::MAX, jerk: f64::MAX };
                for ((from, to), axis) in from.iter().zip(to).zip(axes) {
                    let share = if length > 0.0 { (to - from).abs() / length } else { 1.0 };
                    along.speed = along.speed.min(axis.speed / share);
                    along.acceleration = along.acceleration.min(axis.acceleration / share);
                    along.jerk = along.jerk.min(axis.jerk / share);
                }
                along
            }
            Self::Arc(arc) => arc.limits(axes, feed),
        }
    }

    /// One by its radius, 1/pm; 0 if it is straight.
    pub fn curvature(&self) -> f64 {
        match self {
            Self::Line { .. } => 0.0,
            Self::Arc(arc) => 1.0 / arc.radius(),
        }
    }

    /// It is straight: a cubic of its length is one of its places.
    pub fn is_straight(&self) -> bool {
        matches!(self, Self::Line { .. })
    }
}
