//! A straight line, point by point.

use super::{Axis, Sign, Step, TooFar, within_reach};
use crate::units::Counts;

/// A straight line that is being walked; the proofs are in [the module above](super).
///
/// No point lies farther beside the line than (a + b) / 2√(a² + b²) of a step, for a and b steps of the axes: at most
/// √½. Checked for every line of a window in `no_point_is_beyond_the_bound_and_some_are_on_it`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Line {
    /// Steps of the whole line: a and b.
    way: [i64; 2],
    signs: [Sign; 2],
    /// F = a y − b x at the point that is reached, in steps along both axes.
    deviation: i64,
    remaining: u64,
    ended: bool,
}

impl Line {
    /// A line between two points, each coordinate within ± [`FARTHEST`](super::FARTHEST). One without length has no steps.
    ///
    /// # Errors
    /// The first coordinate that lies beyond.
    pub fn new(from: [Counts; 2], to: [Counts; 2]) -> Result<Self, TooFar> {
        let ([x, y], [to_x, to_y]) = (within_reach(from)?, within_reach(to)?);
        let (x, y) = (to_x.saturating_sub(x), to_y.saturating_sub(y));
        let remaining = x.unsigned_abs().saturating_add(y.unsigned_abs());
        Ok(Self {
            way: [x.saturating_abs(), y.saturating_abs()],
            signs: [Sign::of(x), Sign::of(y)],
            deviation: 0,
            remaining,
            ended: remaining == 0,
        })
    }

    /// Steps still to go.
    pub fn remaining(&self) -> u64 {
        self.remaining
    }

    /// The next step; `None` at the end.
    pub fn next_step(&mut self) -> Option<Step> {
        if self.ended {
            return None;
        }
        let axis = self.judge();
        let step = self.feed(axis);
        self.deviate(axis);
        self.ended = self.is_at_end();
        Some(step)
    }

    /// 1. Judge the deviation, that of the middle of the square ahead: F + (a − b)/2. Above the line x is fed.
    fn judge(&self) -> Axis {
        let [a, b] = self.way;
        let twice = self.deviation.wrapping_mul(2).wrapping_add(a).wrapping_sub(b);
        if twice >= 0 { Axis::X } else { Axis::Y }
    }

    /// 2. Feed one step.
    fn feed(&mut self, axis: Axis) -> Step {
        self.remaining = self.remaining.saturating_sub(1);
        let [x, y] = self.signs;
        Step { axis, sign: if axis == Axis::X { x } else { y } }
    }

    /// 3. Compute the new deviation.
    fn deviate(&mut self, axis: Axis) {
        let [a, b] = self.way;
        self.deviation = match axis {
            Axis::X => self.deviation.wrapping_sub(b),
            Axis::Y => self.deviation.wrapping_add(a),
        };
    }

    /// 4. Test for the end.
    fn is_at_end(&self) -> bool {
        self.remaining == 0
    }
}

#[cfg(test)]
mod tests;
