//! The profiles +, −, + between two speeds and accelerations: one parameter, and what comes of it.

use super::super::root::{Point, Slope, root_by_slope};
use super::leg::{Leg, cut};
use super::motion::{Motion, Stretch};
use super::task::Task;
use super::turns::Turns;

/// All profiles of phases +, 0, −, 0, −, 0, + from the start to the speed and acceleration of the end.
///
/// The start is the one of both ends that would settle at the higher speed (the lower bound of the peak). With the speed of
/// the peak beyond that as y²:
///
/// - y ≥ 0: the acceleration rises to √(y² + a₀²) if a₀ > 0, else to y; it falls through zero, where the speed is at its
///   peak, down to −√(y² + C).
/// - a₀ ≤ y < 0: it rises to y, stays negative, and falls from there to the same.
///
/// If start and end both accelerate, there are others that stay above zero all the time: from √(y² + a₀²) down to
/// +√(y² + C).
///
/// C is what start and end settle apart, and what an end that slows down still adds. Full acceleration cuts off
/// the peaks and makes pauses of them that bring the same speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Family {
    pub(super) from: Motion,
    /// The end, as the start of the way back.
    pub(super) to: Motion,
    /// Where the start settles.
    pub(super) settled: f64,
    /// a₀² if the start accelerates.
    pub(super) before: f64,
    /// C.
    pub(super) apart: f64,
    /// From the speed at which the start settles up to full speed.
    room: f64,
    /// Start and end have changed places.
    backwards: bool,
    /// The acceleration stays above zero.
    pub(super) above: bool,
}

/// One of a family.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    y: f64,
    /// At the peak.
    rest: f64,
    pub(super) time: f64,
}

impl Family {
    pub(super) fn of(task: &Task) -> Self {
        let (forth, back) = (task.start, task.end.reversed());
        let (settles_forth, settles_back) = (forth.settled(), back.settled());
        let backwards = settles_back > settles_forth;
        let (from, to) = if backwards { (back, forth) } else { (forth, back) };
        let (settled, other) =
            if backwards { (settles_back, settles_forth) } else { (settles_forth, settles_back) };
        Self {
            from,
            to,
            settled,
            before: squared(from.a.max(0.0)),
            apart: (settled - other).max(0.0) + squared(to.a.max(0.0)),
            room: (task.top - settled).max(0.0),
            backwards,
            above: false,
        }
    }

    /// Itself, and those that stay above zero.
    pub(super) fn all(self) -> impl Iterator<Item = Self> {
        [Some(self), self.above()].into_iter().flatten()
    }

    /// Those that stay above zero.
    fn above(self) -> Option<Self> {
        let there_are =
            self.from.a > 0.0 && self.to.a < 0.0 && self.apart < squared(self.from.a.min(-self.to.a));
        there_are.then_some(Self { above: true, ..self })
    }

    /// The parameter of the straightest.
    pub(super) fn least(&self) -> f64 {
        self.from.a.min(0.0)
    }

    /// The parameter of those that reach full speed, or the acceleration of the end before they fall below it.
    pub(super) fn most(&self) -> f64 {
        libm::sqrt(if self.above { squared(self.to.a) - self.apart } else { self.room })
    }

    /// From both ends to the peak.
    fn legs(&self, y: f64) -> [Leg; 2] {
        let square = y * y;
        let peak = self.settled + square;
        let up = if y < 0.0 { (y, 0.0) } else { cut(square + self.before) };
        let down = square + self.apart;
        let down = if self.above { (-libm::sqrt(down), 0.0) } else { cut(down) };
        [Leg::new(self.from, peak, up), Leg::new(self.to, peak, down)]
    }

    /// How far beyond a way the one with a parameter leads, and how much farther one with a larger parameter.
    fn beyond(&self, way: f64, y: f64) -> Slope {
        let [up, down] = self.legs(y);
        // A peak higher by y² is passed later by the sum of both 1/h, and the speed on the way to it grows with h.
        let heights = up.height + down.height;
        let peak = self.settled + y * y;
        let slope = y * heights * (2.0 * peak / (up.height * down.height) + 1.0);
        Slope { f: up.way() + down.way() - way, slope }
    }

    fn point(&self, way: f64, y: f64) -> Point {
        let [up, down] = self.legs(y);
        Point { x: y, f: up.way() + down.way() - way }
    }

    fn member(&self, y: f64, rest: f64) -> Member {
        let [up, down] = self.legs(y);
        Member { y, rest, time: up.time() + rest + down.time() }
    }

    /// The straightest.
    pub(super) fn straightest(&self) -> Member {
        self.member(self.least(), 0.0)
    }

    /// The one that goes the way of a task soonest after a time; none if none goes it.
    pub(super) fn reaching(&self, task: &Task, after: f64) -> Option<Member> {
        let is_later = |member: &Member| member.time > after;
        let at = |y: f64| self.point(task.way, y);
        // A larger parameter takes longer; those above zero take less.
        let last = if self.above { 0.0 } else { self.most() };
        let mut from = at(if self.above { self.most() } else { self.least() });
        if !self.above {
            // The straightest leads there, but for what was rounded.
            let straightest = self.member(from.x, 0.0);
            let is_there = from.f.abs() <= task.blur + ROUNDED * task.top * straightest.time;
            if is_there && is_later(&straightest) {
                return Some(straightest);
            }
            if from.f > 0.0 && self.surely_grows() {
                return None;
            }
        }
        for turn in self.turns().into_iter().flatten().chain([last]) {
            let to = at(turn);
            if (from.f <= 0.0) == (to.f >= 0.0) {
                let member = self.member(self.between(task.way, from, to), 0.0);
                if is_later(&member) {
                    return Some(member);
                }
            }
            from = to;
        }
        // Full speed, for as long as it takes.
        let cruises = from.f < 0.0 && !self.above;
        cruises.then(|| self.member(from.x, -from.f / task.top)).filter(is_later)
    }

    /// The parameter between two that leads just there.
    fn between(&self, way: f64, from: Point, to: Point) -> f64 {
        let beyond = |y: f64| self.beyond(way, y);
        // From here on both accelerations are cut off.
        let square = 1.0 - self.before.min(self.apart);
        if self.above || square >= squared(to.x) || to.x <= 0.0 {
            return root_by_slope(from, to, beyond);
        }
        let from = if from.x < 0.0 || squared(from.x) < square {
            let cut = self.point(way, libm::sqrt(square.max(0.0)));
            if (from.f <= 0.0) == (cut.f >= 0.0) {
                return root_by_slope(from, cut, beyond);
            }
            cut
        } else {
            from
        };
        self.between_pauses(from, to)
    }

    /// The same where both accelerations are cut off: the way grows with v² + v, if v is the speed of the peak.
    fn between_pauses(&self, from: Point, to: Point) -> f64 {
        let [low, high] = [from.x, to.x].map(|y| self.settled + y * y);
        // Solved for by how much v grows: squares of high speeds would be rounded by more than the way.
        let slope = 2.0 * low + 1.0;
        let spread = libm::sqrt((slope * slope - 4.0 * from.f).max(0.0));
        let grown = -2.0 * from.f / (slope + if low + high + 1.0 > 0.0 { spread } else { -spread });
        libm::sqrt((from.x * from.x + grown).max(0.0)).max(from.x).min(to.x)
    }

    /// A larger parameter always leads farther.
    fn surely_grows(&self) -> bool {
        !self.above && self.settled >= 0.0 && self.from.a >= 0.0
    }

    /// Parameters at which the ways turn from growing to shrinking and back, in the order of the time taken.
    fn turns(&self) -> [Option<f64>; 2] {
        if self.surely_grows() {
            return [None; 2];
        }
        let turns = Turns { settled: self.settled, before: self.before, apart: self.apart };
        if self.above { turns.above(self.most()) } else { turns.through_zero(self.least(), self.most()) }
    }

    /// The phases of one, in the order of the motion.
    pub(super) fn phases(&self, member: &Member) -> [Stretch; 7] {
        self.joined(self.legs(member.y), member.rest)
    }

    /// Two legs with a rest at the peak.
    pub(super) fn joined(&self, [up, down]: [Leg; 2], rest: f64) -> [Stretch; 7] {
        let [a, b, (rise, _)] = up.stretches();
        let [g, f, (fall, _)] = down.stretches();
        // Where it does not fall through zero there is no peak to rest at: one fall.
        let (rise, fall) = if rise < 0.0 || self.above { (0.0, rise + fall) } else { (rise, fall) };
        let mut phases = [a, b, (rise, -1.0), (rest, 0.0), (fall.max(0.0), -1.0), f, g];
        if self.backwards {
            phases.reverse();
        }
        phases
    }
}

pub(super) fn squared(number: f64) -> f64 {
    number * number
}

/// What sums of a few phases may have rounded, part of the way at full speed.
const ROUNDED: f64 = 1e-14;

#[cfg(test)]
mod tests;
