//! Profiles with a phase of constant speed, which last as long as that speed is low.

use super::super::root::{Point, Slope, root, root_by_slope};
use super::leg::Leg;
use super::motion::{Motion, Stretch, mirrored};
use super::task::Task;

/// Most ranges of speeds at which the changes lead too far.
const GAPS: usize = 4;

/// To a speed as fast as can be, on at this speed, and from there as fast as can be to the end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cruise<'t> {
    task: &'t Task,
    /// Of the speed: the way that is left after a stop goes there.
    sign: f64,
    /// With a speed of zero.
    stopping: Changes,
}

/// The changes of speed at both ends.
#[derive(Clone, Copy, Debug)]
struct Changes {
    time: f64,
    /// The way that is left between them, positive if the speed leads there.
    left: f64,
    /// The sum of the highest accelerations.
    heights: f64,
}

impl<'t> Cruise<'t> {
    pub(super) fn of(task: &'t Task) -> Self {
        let stopping = Changes::of(task, 1.0, 0.0);
        if stopping.left < 0.0 {
            return Self { task, sign: -1.0, stopping: Changes { left: -stopping.left, ..stopping } };
        }
        Self { task, sign: 1.0, stopping }
    }

    /// The profile that takes so long, or the one at the highest speed if that takes longer. `peak` may be the highest speed.
    pub(super) fn lasting(&self, long: f64, peak: f64) -> [Stretch; 7] {
        let mut highest = if self.is_highest(peak) { peak.abs() } else { self.highest(self.task.top) };
        let mut speed = self.speed_of(long, highest);
        // Of the speeds between there may be some at which the changes alone lead too far.
        for _ in 0..GAPS {
            if self.changes(speed).left >= 0.0 || speed >= highest {
                break;
            }
            highest = self.highest(speed);
            speed = self.speed_of(long, highest);
        }
        let Changes { time, left, .. } = self.changes(speed);
        let rest = if speed < highest || speed == 0.0 { long - time } else { left / speed };
        self.phases(speed, if rest > 0.0 { rest } else { 0.0 })
    }

    /// The speed up to a highest at which it takes so long: slower is longer, without end.
    fn speed_of(&self, long: f64, highest: f64) -> f64 {
        // By how much farther than the way that is left the speed leads in the time that is left.
        let beyond = |speed: f64| {
            let Changes { time, left, heights } = self.changes(speed);
            Slope { f: speed * (long - time) - left, slope: long - time + 0.5 * heights }
        };
        let stopping = self.stopping;
        // Where a stop leads just there, it is the answer only if there is the time for it.
        let short = if long < stopping.time { f64::MIN_POSITIVE } else { 0.0 };
        let slowest = Point { x: 0.0, f: -stopping.left - short };
        root_by_slope(slowest, Point { x: highest, f: beyond(highest).f }, beyond)
    }

    /// The fastest of all has its peak at this speed, mostly.
    fn is_highest(&self, peak: f64) -> bool {
        let Changes { time, left, .. } = self.changes(peak.abs());
        let way = self.task.way.abs() + peak.abs() * time;
        peak * self.sign > 0.0 && left.abs() <= 1e-12 * way
    }

    /// A speed up to a limit from which on no way is left for it, or the limit.
    fn highest(&self, limit: f64) -> f64 {
        let left = |speed: f64| self.changes(speed).left;
        root(Point { x: 0.0, f: self.stopping.left }, Point::of(limit, left), left)
    }

    fn changes(&self, speed: f64) -> Changes {
        Changes::of(self.task, self.sign, speed)
    }

    fn phases(&self, speed: f64, rest: f64) -> [Stretch; 7] {
        let speed = self.sign * speed;
        let [a, b, c] = change(self.task.start, speed);
        let [g, f, e] = change(self.task.end.reversed(), speed);
        [a, b, c, (rest, 0.0), e, f, g]
    }
}

impl Changes {
    fn of(task: &Task, sign: f64, speed: f64) -> Self {
        let speed = sign * speed;
        let (one, one_sign) = leg(task.start, speed);
        let (two, two_sign) = leg(task.end.reversed(), speed);
        Self {
            time: one.time() + two.time(),
            left: sign * (task.way - one_sign * one.way() - two_sign * two.way()),
            heights: one.height + two.height,
        }
    }
}

/// From a motion to a speed without acceleration, as fast as can be.
pub(super) fn change(from: Motion, speed: f64) -> [Stretch; 3] {
    let (leg, sign) = leg(from, speed);
    if sign < 0.0 { mirrored(leg.stretches()) } else { leg.stretches() }
}

/// The same, or its image with a sign of −1.
fn leg(from: Motion, speed: f64) -> (Leg, f64) {
    if speed >= from.settled() {
        (Leg::rising(from, speed), 1.0)
    } else {
        (Leg::rising(from.mirrored(), -speed), -1.0)
    }
}
