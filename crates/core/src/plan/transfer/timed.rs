//! Motions that take a time at which none of constant speed between is there.
//!
//! What can be done in a time is convex: of two motions between the same speeds and accelerations, a mixture is one, too. So
//! a time can be met if one motion leads too far in it, and one not far enough. With less acceleration both come together,
//! until there is one only, and on the way there one of them leads just to the end.

use super::super::root::{Point, root};
use super::motion::Stretch;
use super::task::{Scale, Task};
use super::{Limits, Transfer};

impl Transfer {
    /// With a part of full acceleration.
    pub(super) fn with_less(&self, limits: &Limits, ticks: f64) -> Option<Self> {
        let scale = Scale::of(limits).ok()?;
        let task = scale.task(self.from, self.to, limits).ok()?;
        let phases = task.with_less(ticks / scale.time)?;
        scale.motion(self.from, self.to, &task, phases).ok()
    }

    /// The soonest that takes longer.
    pub(super) fn soonest_after(&self, limits: &Limits, ticks: f64) -> Option<Self> {
        let scale = Scale::of(limits).ok()?;
        let task = scale.task(self.from, self.to, limits).ok()?;
        let phases = task.soonest_after(ticks / scale.time)?;
        scale.motion(self.from, self.to, &task, phases).ok()
    }
}

impl Task {
    fn with_less(&self, time: f64) -> Option<[Stretch; 7]> {
        let room = |part: f64| self.nearer_extreme(time, part).map_or(-f64::MAX, |(room, _)| room);
        let all = Point::of(1.0, room);
        if all.f < 0.0 {
            return None;
        }
        let part = root(all, Point { x: 0.0, f: -f64::MAX }, room);
        self.nearer_extreme(time, part).map(|(_, phases)| phases)
    }

    /// Of what leads farthest in a time and what leads least far, that which is nearer to the end: how far beyond, on its side,
    /// and its phases.
    fn nearer_extreme(&self, time: f64, part: f64) -> Option<(f64, [Stretch; 7])> {
        let [(far, farthest), (near, nearest)] = self.extremes(time, part)?;
        Some(if far < -near { (far, farthest) } else { (-near, nearest) })
    }
}
