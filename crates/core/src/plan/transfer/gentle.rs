//! The profiles of a family with a part of full acceleration.

use super::super::root::{Point, root};
use super::family::{Family, squared};
use super::leg::Leg;
use super::motion::{Motion, Stretch};

/// A family whose accelerations stay within a part of the full one, but for what an end brings along: that is taken back
/// with full jerk. So every start that can be left with full acceleration can be left with less.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gentle {
    family: Family,
    part: f64,
}

impl Gentle {
    /// None if the acceleration cannot stay above zero within the part.
    pub(super) fn of(family: Family, part: f64) -> Option<Self> {
        (!family.above || squared(part) > family.apart).then_some(Self { family, part })
    }

    /// The one that takes so long, if there is one: how far it leads, and its phases. Above all there is full speed.
    pub(super) fn lasting(&self, time: f64, top: f64) -> Option<(f64, [Stretch; 7])> {
        let above = self.family.above;
        let late = |y: f64| self.time(y) - time;
        let straightest = Point::of(self.straightest(), late);
        let longest = Point::of(if above { 0.0 } else { self.family.most() }, late);
        if straightest.f > 0.0 || (above && longest.f < 0.0) {
            return None;
        }
        let (y, rest) =
            if longest.f <= 0.0 { (longest.x, -longest.f) } else { (root(straightest, longest, late), 0.0) };
        let legs = self.legs(y);
        let way = legs[0].way() + legs[1].way() + rest * top;
        Some((way, self.family.joined(legs, rest)))
    }

    /// The parameter of the one that takes the least time.
    fn straightest(&self) -> f64 {
        let Self { family, part } = *self;
        if family.above {
            libm::sqrt((squared(part.min(-family.to.a)) - family.apart).max(0.0))
        } else {
            family.least().max(-part)
        }
    }

    fn time(&self, y: f64) -> f64 {
        self.legs(y).iter().map(Leg::time).sum()
    }

    fn legs(&self, y: f64) -> [Leg; 2] {
        let Family { from, to, settled, before, apart, above, .. } = self.family;
        let square = y * y;
        let peak = settled + square;
        let up = if y < 0.0 { Leg::new(from, peak, (y, 0.0)) } else { self.leg(from, peak, square + before) };
        let down = if above {
            Leg::new(to, peak, (-libm::sqrt(square + apart), 0.0))
        } else {
            self.leg(to, peak, square + apart)
        };
        [up, down]
    }

    /// With a peak of the acceleration whose square is given, if it is not cut off.
    fn leg(&self, from: Motion, peak: f64, square: f64) -> Leg {
        let part = self.part;
        if from.a > part {
            return Leg::falling(from, peak, (part, (square - squared(from.a)) / part));
        }
        let height = if square <= squared(part) {
            (libm::sqrt(square), 0.0)
        } else {
            (part, (square - squared(part)) / part)
        };
        Leg::new(from, peak, height)
    }
}
