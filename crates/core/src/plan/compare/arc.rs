//! An arc, point by point.

use super::circle::{Circle, CircleError, InQuadrant, Which};
use super::{Axis, Sign, Step};
use crate::units::Counts;

/// The sense of an arc, seen with x to the right and y up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Turn {
    /// As G2.
    Clockwise,
    /// As G3.
    Counterclockwise,
}

/// An arc that is being walked; the proofs are in [the module above](super).
///
/// Its points lie less than √½ of a step beside the circle, ends that are farther off excepted. Checked for every arc
/// of small circles in `every_point_is_drawn_and_the_ring_is_the_same_both_ways`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Arc {
    /// A clockwise arc is walked as its mirror image.
    turn: Turn,
    /// 0 … 3, counter-clockwise.
    quadrant: u8,
    /// u: the coordinate that falls in this quadrant.
    falling: i64,
    /// v: the one that rises.
    rising: i64,
    /// F = u² + v² − R².
    deviation: i64,
    /// Steps still to go in the ring.
    steps: u64,
    ended: bool,
    /// A step onto the ring, from a start beside it.
    onto: Option<Step>,
    /// A step off it, to an end beside it.
    off: Option<Step>,
}

/// What a step does to the point in its quadrant.
#[derive(Clone, Copy)]
enum Feed {
    Fall,
    Rise,
}

impl Arc {
    /// An arc of `circle` between two points that lie at most one count beside it; from a point to itself, once around.
    ///
    /// An end beside the ring of drawn points is joined to it by one step. If both ends belong to the same point of the
    /// ring without being one, these steps are all.
    ///
    /// # Errors
    /// An end beyond ± [`FARTHEST`](super::FARTHEST), or more than one count beside the circle.
    pub fn new(circle: &Circle, from: [Counts; 2], to: [Counts; 2], turn: Turn) -> Result<Self, CircleError> {
        let (start, onto) = circle.drawn_beside(circle.end(from, Which::Start)?);
        let (end, away) = circle.drawn_beside(circle.end(to, Which::End)?);
        let (start, end) = match turn {
            Turn::Counterclockwise => (start, end),
            Turn::Clockwise => (start.mirrored(), end.mirrored()),
        };
        let (around, start_place) = (circle.steps_around(), circle.place(start));
        let steps = if from == to { around } else { steps_between(start_place, circle.place(end), around) };
        let InQuadrant { quadrant, falling, rising } = start.in_quadrant();
        let off = away.map(|step| Step { axis: step.axis, sign: step.sign.opposite() });
        // A drawn point's deviation is below its |x| + |y|.
        let deviation = circle.deviation(start) as i64;
        Ok(Self { turn, quadrant, falling, rising, deviation, steps, ended: steps == 0, onto, off })
    }

    /// Steps still to go.
    pub fn remaining(&self) -> u64 {
        let joints = u64::from(self.onto.is_some()).saturating_add(u64::from(self.off.is_some()));
        self.steps.saturating_add(joints)
    }

    /// The next step; `None` at the end.
    pub fn next_step(&mut self) -> Option<Step> {
        if let Some(step) = self.onto.take() {
            return Some(step);
        }
        if self.ended {
            return self.off.take();
        }
        let feed = self.judge();
        let step = self.feed(feed);
        self.deviate(feed);
        self.ended = self.is_at_end();
        Some(step)
    }

    /// 1. Judge the deviation, that of the middle of the square ahead: F − u + v + ½. Outside, u falls.
    fn judge(&self) -> Feed {
        let middle = self.deviation.wrapping_sub(self.falling).wrapping_add(self.rising);
        if middle >= 0 { Feed::Fall } else { Feed::Rise }
    }

    /// 2. Feed one step.
    fn feed(&mut self, feed: Feed) -> Step {
        let step = self.step(feed);
        self.steps = self.steps.saturating_sub(1);
        match feed {
            Feed::Fall => self.falling = self.falling.wrapping_sub(1),
            Feed::Rise => self.rising = self.rising.wrapping_add(1),
        }
        step
    }

    /// 3. Compute the new deviation. On an axis the next quadrant begins, where what rose falls; F is the same there.
    fn deviate(&mut self, feed: Feed) {
        let change = match feed {
            Feed::Fall => self.falling.wrapping_mul(-2).wrapping_sub(1),
            Feed::Rise => self.rising.wrapping_mul(2).wrapping_sub(1),
        };
        self.deviation = self.deviation.wrapping_add(change);
        if self.falling == 0 {
            self.quadrant = self.quadrant.wrapping_add(1) & 3;
            (self.falling, self.rising) = (self.rising, 0);
        }
    }

    /// 4. Test for the end.
    fn is_at_end(&self) -> bool {
        self.steps == 0
    }

    /// The step of the axes. Counter-clockwise x falls and y rises from +x on, y falls and x goes on from +y on, and so forth.
    fn step(&self, feed: Feed) -> Step {
        let x_falls = self.quadrant & 1 == 0;
        let (axis, up) = match feed {
            Feed::Fall => (if x_falls { Axis::X } else { Axis::Y }, matches!(self.quadrant, 2 | 3)),
            Feed::Rise => (if x_falls { Axis::Y } else { Axis::X }, matches!(self.quadrant, 0 | 3)),
        };
        let mirrored = self.turn == Turn::Clockwise && axis == Axis::Y;
        Step { axis, sign: if up == mirrored { Sign::Minus } else { Sign::Plus } }
    }
}

/// Steps from one place in a ring to another, forward; 0 if they are one.
fn steps_between(from: u64, to: u64, around: u64) -> u64 {
    if to >= from { to.saturating_sub(from) } else { to.saturating_add(around).saturating_sub(from) }
}

#[cfg(test)]
mod tests;
