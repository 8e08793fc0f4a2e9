//! A change of speed, and the way back over a line: how the fast axis of a scan turns.

use crate::plan::corner::changing;
use crate::plan::profile::Limits;
use crate::plan::root::{Point, root};
use crate::plan::transfer::{Phase, State};

/// A speed changes by a constant: with full jerk, a pause at full acceleration, and full jerk back. One that takes longer is
/// the same with less of both.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Change {
    /// Never 0.
    by: f64,
    rise: f64,
    pause: f64,
}

impl Change {
    pub(super) fn soonest(by: f64, limits: &Limits) -> Self {
        let (rise, pause) = changing(by.abs(), limits.acceleration, limits.jerk);
        Self { by, rise, pause }
    }

    /// The same in a longer time.
    pub(super) fn lasting(self, ticks: f64) -> Self {
        let longer = ticks / self.ticks();
        Self { rise: self.rise * longer, pause: self.pause * longer, ..self }
    }

    pub(super) fn ticks(&self) -> f64 {
        2.0 * self.rise + self.pause
    }

    /// The way from a speed on: the mean of both speeds, because the change is symmetric.
    pub(super) fn way(&self, from: f64) -> f64 {
        (from + self.by / 2.0) * self.ticks()
    }

    /// The farthest it comes on its way from a speed above zero to one below.
    pub(super) fn farthest(&self, from: f64) -> f64 {
        let speed = |ticks: f64| self.at(from, ticks).speed;
        let turns = root(Point::of(0.0, speed), Point::of(self.ticks(), speed), speed);
        self.at(from, turns).position
    }

    pub(super) fn phases(&self) -> [Phase; 3] {
        let jerk = self.by / (self.rise * (self.rise + self.pause));
        [(self.rise, jerk), (self.pause, 0.0), (self.rise, -jerk)].map(|(ticks, jerk)| Phase { ticks, jerk })
    }

    fn at(&self, from: f64, ticks: f64) -> State {
        let mut left = ticks;
        let mut state = State { speed: from, ..State::default() };
        for phase in self.phases() {
            state = state.after(left.min(phase.ticks), phase.jerk);
            left = (left - phase.ticks).max(0.0);
        }
        state
    }
}

/// Back over a line, from its speed at one end to the same speed at the other: a change to a speed backwards, a time at that,
/// and the same change back.
///
/// The faster backwards, the sooner it is over, until nothing is left of the time between: so the time is a steady function
/// of that speed, and every time that is long enough has one.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlyBack {
    speed: f64,
    back: f64,
    limits: Limits,
}

impl FlyBack {
    /// The soonest over a distance.
    pub(super) fn soonest(speed: f64, back: f64, limits: &Limits) -> Self {
        let fly_back = Self { speed, back, limits: *limits };
        let between = |at: f64| fly_back.between(at);
        let top = limits.speed;
        // Backwards as slow as forwards, both changes lead nowhere and all of the distance is left.
        let at = if between(top) >= 0.0 {
            top
        } else {
            root(Point::of(speed, between), Point::of(top, between), between)
        };
        Self { limits: Limits { speed: at, ..*limits }, ..fly_back }
    }

    /// One that takes just so long, which is no less than the soonest takes.
    pub(super) fn lasting(self, ticks: f64) -> Self {
        let over = |at: f64| self.ticks_at(at) - ticks;
        // So slow it has not even gone the distance.
        let slow = Point::of(self.back / ticks, over);
        let at = root(slow, Point::of(self.limits.speed, over), over);
        Self { limits: Limits { speed: at, ..self.limits }, ..self }
    }

    pub(super) fn ticks(&self) -> f64 {
        self.ticks_at(self.limits.speed)
    }

    /// How far it goes beyond either end.
    pub(super) fn farthest(&self) -> f64 {
        self.change(self.limits.speed).farthest(self.speed)
    }

    pub(super) fn phases(&self) -> [Phase; 7] {
        let at = self.limits.speed;
        let [a, b, c] = self.change(at).phases();
        let turned = |phase: Phase| Phase { jerk: -phase.jerk, ..phase };
        let between = Phase { ticks: (self.between(at) / at).max(0.0), jerk: 0.0 };
        [a, b, c, between, turned(a), turned(b), turned(c)]
    }

    fn change(&self, at: f64) -> Change {
        Change::soonest(-(self.speed + at), &self.limits)
    }

    fn ticks_at(&self, at: f64) -> f64 {
        2.0 * self.change(at).ticks() + self.between(at) / at
    }

    /// What both changes leave of the distance.
    fn between(&self, at: f64) -> f64 {
        self.back + 2.0 * self.change(at).way(self.speed)
    }
}
