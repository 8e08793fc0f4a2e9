//! Speed and acceleration, and how far stretches of constant jerk lead from them; jerk and full acceleration are 1.

use super::SLACK;

/// Speed and acceleration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub(super) v: f64,
    pub(super) a: f64,
}

impl Motion {
    /// The speed at which the acceleration has been taken back with full jerk.
    pub(super) fn settled(self) -> f64 {
        self.v + self.a * self.a.abs() / 2.0
    }

    pub(super) fn mirrored(self) -> Self {
        Self { v: -self.v, a: -self.a }
    }

    /// Run backwards, and mirrored: it goes the same way.
    pub(super) fn reversed(self) -> Self {
        Self { v: self.v, a: -self.a }
    }

    pub(super) fn after(self, time: f64, jerk: f64) -> Self {
        Self { v: self.v + time * (self.a + time / 2.0 * jerk), a: self.a + time * jerk }
    }

    pub(super) fn is_within(self, top: f64) -> bool {
        let room = 1.0 + SLACK;
        self.a.abs() <= room && self.v.abs() <= top * room && self.settled().abs() <= top * room
    }
}

/// A time and a jerk.
pub(super) type Stretch = (f64, f64);

/// How far phases lead.
pub(super) fn way(from: Motion, phases: &[Stretch]) -> f64 {
    let (mut way, mut motion) = (0.0, from);
    for &(time, jerk) in phases {
        way += time * (motion.v + time / 2.0 * (motion.a + time / 3.0 * jerk));
        motion = motion.after(time, jerk);
    }
    way
}

/// The same of all seven, of which the fourth goes at constant speed, whatever rounding left of an acceleration.
pub(super) fn way_of_all(from: Motion, phases: &[Stretch; 7]) -> f64 {
    let [a, b, c, cruise, e, f, g] = *phases;
    let mut peak = [a, b, c].into_iter().fold(from, |motion, (time, jerk)| motion.after(time, jerk));
    if cruise.0 > 0.0 {
        peak.a = 0.0;
    }
    way(from, &[a, b, c]) + way(peak, &[cruise, e, f, g])
}

pub(super) fn mirrored<const N: usize>(phases: [Stretch; N]) -> [Stretch; N] {
    phases.map(|(time, jerk)| (time, -jerk))
}

pub(super) fn time(phases: &[Stretch]) -> f64 {
    phases.iter().map(|(time, _)| time).sum()
}
