//! Profiles with a phase of constant speed, which last as long as that speed is low.

use super::super::root::{Point, root};
use super::family::cut;
use super::{Motion, Stretch, Task, mirrored, time, way};

/// Most ranges of speeds at which the changes lead too far.
const GAPS: usize = 4;

/// To a speed as fast as can be, on at this speed, and from there as fast as can be to the end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cruise<'t> {
    task: &'t Task,
    /// Of the speed: the way that is left after a stop goes there.
    sign: f64,
}

impl<'t> Cruise<'t> {
    pub(super) fn of(task: &'t Task) -> Self {
        let ahead = Self { task, sign: 1.0 };
        if ahead.left(0.0) < 0.0 { Self { sign: -1.0, ..ahead } } else { ahead }
    }

    /// The profile that takes so long, or the one at the highest speed if that takes longer. `peak` may be the highest speed.
    pub(super) fn lasting(&self, long: f64, peak: f64) -> [Stretch; 7] {
        let mut highest = if self.is_highest(peak) { peak.abs() } else { self.highest(self.task.top) };
        let mut speed = self.speed_of(long, highest);
        // Of the speeds between there may be some at which the changes alone lead too far.
        for _ in 0..GAPS {
            if self.left(speed) >= 0.0 || speed >= highest {
                break;
            }
            highest = self.highest(speed);
            speed = self.speed_of(long, highest);
        }
        let for_the_rest = speed < highest || speed == 0.0;
        let rest = if for_the_rest { long - self.time_of_changes(speed) } else { self.left(speed) / speed };
        self.phases(speed, if rest > 0.0 { rest } else { 0.0 })
    }

    /// The speed up to a highest at which it takes so long: slower is longer, without end.
    fn speed_of(&self, long: f64, highest: f64) -> f64 {
        let early = |speed: f64| long - self.time(speed);
        root(Point { x: 0.0, f: f64::NEG_INFINITY }, Point::of(highest, early), early)
    }

    /// The fastest of all has its peak at this speed, mostly.
    fn is_highest(&self, peak: f64) -> bool {
        let way = self.task.way.abs() + peak.abs() * self.time_of_changes(peak.abs());
        peak * self.sign > 0.0 && self.left(peak.abs()).abs() <= 1e-12 * way
    }

    /// A speed up to a limit from which on no way is left for it, or the limit.
    fn highest(&self, limit: f64) -> f64 {
        let left = |speed: f64| self.left(speed);
        root(Point::of(0.0, left), Point::of(limit, left), left)
    }

    /// The way left for a speed, positive if it leads there.
    fn left(&self, speed: f64) -> f64 {
        let task = self.task;
        let changes =
            [task.start, task.end.reversed()].map(|motion| way(motion, &self.change(motion, speed)));
        self.sign * (task.way - changes[0] - changes[1])
    }

    /// How long the whole takes with a speed.
    fn time(&self, speed: f64) -> f64 {
        if speed > 0.0 { self.time_of_changes(speed) + self.left(speed) / speed } else { f64::INFINITY }
    }

    fn time_of_changes(&self, speed: f64) -> f64 {
        let task = self.task;
        time(&self.change(task.start, speed)) + time(&self.change(task.end.reversed(), speed))
    }

    fn phases(&self, speed: f64, rest: f64) -> [Stretch; 7] {
        let [a, b, c] = self.change(self.task.start, speed);
        let [g, f, e] = self.change(self.task.end.reversed(), speed);
        [a, b, c, (rest, 0.0), e, f, g]
    }

    fn change(&self, from: Motion, speed: f64) -> [Stretch; 3] {
        change(from, self.sign * speed)
    }
}

/// From a motion to a speed without acceleration, as fast as can be.
pub(super) fn change(from: Motion, speed: f64) -> [Stretch; 3] {
    if speed >= from.settled() {
        return rise(from, speed);
    }
    mirrored(rise(from.mirrored(), -speed))
}

/// From a motion to a speed at which it settles, or a higher one.
fn rise(from: Motion, speed: f64) -> [Stretch; 3] {
    let before = from.a.max(0.0);
    let (peak, pause) = cut((speed - from.settled()).max(0.0) + before * before);
    [((peak - from.a).max(0.0), 1.0), (pause, 0.0), (peak, -1.0)]
}
