//! Half of a profile: from one end to the speed between.

use super::motion::{Motion, Stretch};

/// From a motion to a speed without acceleration: the acceleration goes to a height, stays there for a pause, and comes back
/// to zero. Jerk and full acceleration are 1.
///
/// Where two of them meet with heights of different signs, no acceleration comes to zero between: the time back from the
/// height below zero is less than none, and what the sums say is right nevertheless.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    from: Motion,
    /// The speed it leads to.
    speed: f64,
    /// How long the acceleration goes to its height, and with which jerk.
    rise: Stretch,
    pub(super) height: f64,
    pub(super) pause: f64,
}

impl Leg {
    pub(super) fn new(from: Motion, speed: f64, (height, pause): (f64, f64)) -> Self {
        Self { from, speed, rise: ((height - from.a).max(0.0), 1.0), height, pause }
    }

    /// The acceleration falls to a height.
    pub(super) fn falling(from: Motion, speed: f64, (height, pause): (f64, f64)) -> Self {
        Self { from, speed, rise: ((from.a - height).max(0.0), -1.0), height, pause }
    }

    /// To a speed at which the motion settles, or a higher one, as fast as can be.
    pub(super) fn rising(from: Motion, speed: f64) -> Self {
        let before = from.a.max(0.0);
        Self::new(from, speed, cut((speed - from.settled()).max(0.0) + before * before))
    }

    pub(super) fn time(&self) -> f64 {
        self.rise.0 + self.pause + self.height
    }

    /// How far it leads.
    pub(super) fn way(&self) -> f64 {
        let Self { from, speed, rise: (rise, jerk), height, pause } = *self;
        let up = rise * (from.v + rise * (0.5 * from.a + SIXTH * jerk * rise));
        let risen = from.v + rise * (from.a + 0.5 * jerk * rise);
        let on = pause * (risen + 0.5 * height * pause);
        // Backwards from its end.
        let back = height * (speed - SIXTH * height * height);
        up + on + back
    }

    pub(super) fn stretches(&self) -> [Stretch; 3] {
        [self.rise, (self.pause, 0.0), (self.height, -1.0)]
    }
}

const SIXTH: f64 = 1.0 / 6.0;

/// A peak of an acceleration whose square is given, cut off at full acceleration: its height and its pause.
pub(super) fn cut(square: f64) -> (f64, f64) {
    if square <= 1.0 { (libm::sqrt(square), 0.0) } else { (1.0, square - 1.0) }
}
