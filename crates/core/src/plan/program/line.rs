//! A block between two corners, as if it were a line: how fast it can come to each of them.

use super::super::corner::changing;
use super::super::profile::Limits;
use super::super::root::{Point, root};
use super::passage::Passage;

/// A corner between two blocks, if a stop is not sooner, of which so many ticks are saved.
pub(super) fn worth_it(rounded: Passage, lines: &[Line; 2], saved: f64) -> Passage {
    let stop = rounded.at_speed(0.0);
    if delay(&rounded, lines) < delay(&stop, lines) - saved { rounded } else { stop }
}

/// How much later than at full speed a corner is passed, ticks, between two blocks that come to it.
fn delay(corner: &Passage, lines: &[Line; 2]) -> f64 {
    let of = |line: &Line| {
        let top = line.limits.speed.min(libm::sqrt(line.limits.acceleration * line.length));
        let (rise, pause) = line.changing(top, corner.speed());
        2.0 * rise + pause - (line.change(top, corner.speed()) + corner.reach()) / top
    };
    corner.ticks() + of(&lines[0]) + of(&lines[1])
}

/// Part of a speed or of a line that is left, so that no way is too short by what was rounded.
pub(super) const ROUNDED: f64 = 1e-9;

/// A line between two corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) length: f64,
    pub(super) limits: Limits,
}

impl Line {
    /// A corner at one end, slow enough for the speed to change to that of the other within the line.
    pub(super) fn slowed(&self, corner: Passage, other: &Passage) -> Passage {
        self.slowed_for(corner, other.reach(), other.speed())
    }

    /// The same, if from the other end on some of the line is gone and the speed there is given.
    pub(super) fn slowed_for(&self, corner: Passage, gone: f64, speed: f64) -> Passage {
        let left =
            |corner: &Passage| self.length - corner.reach() - gone - self.change(corner.speed(), speed);
        if corner.speed() <= speed || left(&corner) >= 0.0 {
            return corner;
        }
        // It need not be slower than the other; from there on there is less room the faster it is.
        let left_at = |speed: f64| left(&corner.at_speed(speed));
        let (same, top) = (Point::of(speed, left_at), Point::of(corner.speed(), left_at));
        if same.f <= 0.0 {
            return corner.at_speed(speed);
        }
        // A little less, or rounding may say that there is no way.
        corner.at_speed((root(same, top, left_at) * (1.0 - ROUNDED)).max(speed))
    }

    /// Ticks of full jerk, and at full acceleration, in which a speed changes to another.
    fn changing(&self, from: f64, to: f64) -> (f64, f64) {
        changing((to - from).abs(), self.limits.acceleration, self.limits.jerk)
    }

    /// The way on which a speed changes to another.
    pub(super) fn change(&self, from: f64, to: f64) -> f64 {
        let (rise, pause) = self.changing(from, to);
        f64::midpoint(from, to) * (2.0 * rise + pause)
    }
}
