//! The shape of a motion, whatever its speed: where it is after how much of its length, and how fast it may be there.
//!
//! Places are picometres as floats: a hundred millimetres are exact to a thousandth of one.

mod arc;
mod sine;

pub use arc::Arc;
pub use sine::Sine;

use super::profile::Limits;

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
    /// About a straight line.
    Sine(Sine),
}

/// A place of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spot {
    /// Where it is, pm.
    pub at: Place,
    /// Where it goes there: the place's change for a picometre of the length.
    pub tangent: Place,
}

/// How a curve bends at most: its curvature, and the first and second derivative of that by the length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bend {
    /// One by the radius, 1/pm.
    pub curvature: f64,
    /// 1/pm².
    pub change: f64,
    /// 1/pm³.
    pub second: f64,
}

impl Bend {
    /// Of the places of a motion along the curve by time, at most.
    ///
    /// At speed v, acceleration a and jerk j along a curve of curvature κ it is (κ'' + 3κκ' + κ³)v⁴ + 6(κ' + κ²)v²a +
    /// κ(3a² + 4vj).
    pub(super) fn fourth_derivative(&self, speed: f64, acceleration: f64, jerk: f64) -> f64 {
        let Self { curvature, change, second } = *self;
        let squared = speed * speed;
        (second + 3.0 * curvature * change + curvature * curvature * curvature) * squared * squared
            + 6.0 * (change + curvature * curvature) * squared * acceleration
            + curvature * (3.0 * acceleration * acceleration + 4.0 * speed * jerk)
    }
}

impl Default for Curve {
    fn default() -> Self {
        Self::Line { from: [0.0; 2], to: [0.0; 2] }
    }
}

impl Curve {
    /// Its length, pm.
    pub fn length(&self) -> f64 {
        match self {
            Self::Line { from, to } => distance(*from, *to),
            Self::Arc(arc) => arc.length(),
            Self::Sine(sine) => sine.length(),
        }
    }

    /// The place after a way, pm.
    pub fn spot(&self, way: f64) -> Spot {
        match self {
            Self::Line { from, to } => {
                let tangent = direction(*from, *to);
                Spot { at: [from[0] + way * tangent[0], from[1] + way * tangent[1]], tangent }
            }
            Self::Arc(arc) => arc.spot(way),
            Self::Sine(sine) => sine.spot(way),
        }
    }

    /// How it bends after a way: the second derivative of the place by the length, 1/pm.
    pub fn turning(&self, way: f64) -> Place {
        match self {
            Self::Line { .. } => [0.0; 2],
            Self::Arc(arc) => arc.turning(way),
            Self::Sine(sine) => sine.turning(way),
        }
    }

    /// How it bends at most; None if it is straight, and a cubic of its length one of its places.
    pub fn bend(&self) -> Option<Bend> {
        match self {
            Self::Line { .. } => None,
            Self::Arc(arc) => Some(arc.bend()),
            Self::Sine(sine) => Some(sine.bend()),
        }
    }

    /// Shows the places, besides its ends, where x or y may be lowest or highest: those where it turns back.
    ///
    /// Of an arc whose ends are not equally far from its centre they are nearly so: beside the true ones by less than
    /// the square of the difference over the radius.
    pub fn turning_points(&self, see: &mut dyn FnMut(Place)) {
        match self {
            Self::Line { .. } => {}
            Self::Arc(arc) => arc.turning_points(see),
            Self::Sine(sine) => sine.turning_points(see),
        }
    }

    /// How fast the length may be gone through, so that no axis is beyond its limits; feed is pm a tick.
    pub fn limits(&self, axes: &[Limits; 2], feed: f64) -> Limits {
        match (self, self.bend()) {
            (Self::Line { from, to }, _) => straight(direction(*from, *to), axes, feed),
            (_, bend) => bent(bend.unwrap_or_default(), axes, feed),
        }
    }
}

pub(super) fn distance(from: Place, to: Place) -> f64 {
    libm::hypot(to[0] - from[0], to[1] - from[1])
}

/// From one place to another; nowhere if both are one.
pub(super) fn direction(from: Place, to: Place) -> Place {
    let length = distance(from, to);
    if length > 0.0 { [(to[0] - from[0]) / length, (to[1] - from[1]) / length] } else { [0.0; 2] }
}

/// The axis that comes to a limit first decides.
pub(super) fn straight(direction: Place, axes: &[Limits; 2], feed: f64) -> Limits {
    let mut along = Limits { speed: feed, acceleration: f64::MAX, jerk: f64::MAX };
    let [x, y] = axes;
    // To go nowhere takes no time, but numbers that are some.
    let shares = if direction == [0.0; 2] { [1.0; 2] } else { direction };
    for (share, axis) in shares.map(f64::abs).into_iter().zip([x, y]) {
        along.speed = along.speed.min(axis.speed / share);
        along.acceleration = along.acceleration.min(axis.acceleration / share);
        along.jerk = along.jerk.min(axis.jerk / share);
    }
    along
}

/// A bent curve goes in many directions, so the weaker of both axes decides in all.
///
/// At speed v, acceleration a and jerk j along a curve of curvature κ the acceleration is a along and κv² across, the jerk
/// j − κ²v³ along and 3κva + κ'v³ across. Shares of the limits leave room for each: the accelerations stand square upon
/// each other (√½ of it for each), as do the jerks of 0.4 + 0.4 along and 0.6 across, half of that for each if κ changes.
fn bent(bend: Bend, axes: &[Limits; 2], feed: f64) -> Limits {
    let [x, y] = axes;
    let acceleration = x.acceleration.min(y.acceleration) * core::f64::consts::FRAC_1_SQRT_2;
    let jerk = x.jerk.min(y.jerk);
    let Bend { curvature, change, .. } = bend;
    let across = if change > 0.0 { 0.3 * jerk } else { 0.6 * jerk };
    let speed = [
        x.speed.min(y.speed),
        libm::sqrt(acceleration / curvature),
        libm::cbrt(0.4 * jerk / (curvature * curvature)),
        libm::cbrt(across / change),
    ]
    .into_iter()
    .fold(feed, f64::min);
    Limits { speed, acceleration: acceleration.min(across / (3.0 * curvature * speed)), jerk: 0.4 * jerk }
}
