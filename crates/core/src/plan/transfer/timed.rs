//! Motions that take a time at which none of constant speed between is there.
//!
//! What can be done in a time is convex: of two motions between the same speeds and accelerations, a mixture is one, too. So
//! a time can be met if one motion leads too far in it, and one not far enough. Less jerk, or less acceleration, brings both
//! together, and on the way there one of them leads just to the end.

use super::motion::Stretch;
use super::super::root::{Point, root};
use super::task::Scale;
use super::{Limits, Transfer};

impl Transfer {
    /// With a part of the jerk, or of the acceleration.
    pub(super) fn with_less(&self, limits: &Limits, ticks: f64) -> Option<Self> {
        let less_jerk = |part: f64| Limits { jerk: part * limits.jerk, ..*limits };
        let less_acceleration = |part: f64| Limits { acceleration: part * limits.acceleration, ..*limits };
        self.with_part(ticks, less_jerk).or_else(|| self.with_part(ticks, less_acceleration))
    }

    fn with_part(&self, ticks: f64, part: impl Fn(f64) -> Limits) -> Option<Self> {
        let room = |x: f64| self.nearer_extreme(&part(x), ticks).map_or(-f64::MAX, |(room, _)| room);
        let all = Point::of(1.0, room);
        if all.f < 0.0 {
            return None;
        }
        let at = part(root(all, Point { x: 0.0, f: -f64::MAX }, room));
        let scale = Scale::of(&at).ok()?;
        let task = scale.task(self.from, self.to, &at).ok()?;
        let (_, phases) = self.nearer_extreme(&at, ticks)?;
        scale.motion(self.from, self.to, &task, phases).ok()
    }

    /// Of what leads farthest in a time and what leads least far within limits, that which is nearer to the end: how far
    /// beyond, on its side, and its phases.
    fn nearer_extreme(&self, limits: &Limits, ticks: f64) -> Option<(f64, [Stretch; 7])> {
        let scale = Scale::of(limits).ok()?;
        let task = scale.task(self.from, self.to, limits).ok()?;
        let [(far, farthest), (near, nearest)] = task.extremes(ticks / scale.time)?;
        let (room, phases) = if far < -near { (far, farthest) } else { (-near, nearest) };
        Some((room * scale.length, phases))
    }

    /// The soonest that takes longer.
    pub(super) fn soonest_after(&self, limits: &Limits, ticks: f64) -> Option<Self> {
        let scale = Scale::of(limits).ok()?;
        let task = scale.task(self.from, self.to, limits).ok()?;
        let phases = task.soonest_after(ticks / scale.time)?;
        scale.motion(self.from, self.to, &task, phases).ok()
    }
}
