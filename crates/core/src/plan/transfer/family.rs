//! The profiles +, −, + between two speeds and accelerations: one parameter, and what comes of it.

use super::super::root::{Point, root};
use super::leg::cut;
use super::{Motion, Stretch, Task, time, way};

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
    from: Motion,
    /// The end, as the start of the way back.
    to: Motion,
    /// The acceleration of the end.
    a_end: f64,
    /// C.
    apart: f64,
    /// From the speed at which the start settles up to full speed.
    room: f64,
    /// Start and end have changed places.
    backwards: bool,
    /// The acceleration stays above zero.
    above: bool,
}

impl Family {
    pub(super) fn of(task: &Task) -> Self {
        let (forth, back) = (task.start, task.end.reversed());
        let backwards = back.settled() > forth.settled();
        let (start, end) = if backwards { (back, forth) } else { (forth, back) };
        Self {
            from: start,
            to: end,
            a_end: -end.a,
            apart: (start.settled() - end.settled()).max(0.0) + squared(end.a.max(0.0)),
            room: (task.top - start.settled()).max(0.0),
            backwards,
            above: false,
        }
    }

    /// Those that stay above zero.
    pub(super) fn above(self) -> Option<Self> {
        let there_are =
            self.from.a > 0.0 && self.a_end > 0.0 && self.apart < squared(self.from.a.min(self.a_end));
        there_are.then_some(Self { above: true, ..self })
    }

    /// The parameter of the straightest.
    pub(super) fn least(&self) -> f64 {
        self.from.a.min(0.0)
    }

    /// The parameter of those that reach full speed, or the acceleration of the end before they fall below it.
    fn most(&self) -> f64 {
        libm::sqrt(if self.above { squared(self.a_end) - self.apart } else { self.room })
    }

    /// With a rest at the peak.
    fn phases(&self, y: f64, rest: f64) -> [Stretch; 7] {
        let (up, up_pause) = self.rise(y);
        let (down, down_pause) = self.fall(y);
        // Where it does not fall through zero there is no peak to rest at: one fall.
        let (fall, on) = if up < 0.0 || self.above { (0.0, up + down) } else { (up, down) };
        [
            ((up - self.from.a).max(0.0), 1.0),
            (up_pause, 0.0),
            (fall, -1.0),
            (rest, 0.0),
            (on.max(0.0), -1.0),
            (down_pause, 0.0),
            ((self.a_end + down).max(0.0), 1.0),
        ]
    }

    /// The highest acceleration, and the pause at it.
    fn rise(&self, y: f64) -> (f64, f64) {
        if y < 0.0 { (y, 0.0) } else { cut(y * y + squared(self.from.a.max(0.0))) }
    }

    /// How far below zero the acceleration falls, and the pause there.
    fn fall(&self, y: f64) -> (f64, f64) {
        let square = y * y + self.apart;
        if self.above { (-libm::sqrt(square), 0.0) } else { cut(square) }
    }

    /// How far the one with a parameter goes.
    fn way(&self, y: f64) -> f64 {
        // From both ends to the peak: two short sums are done sooner than a long one.
        let [a, b, c, _, e, f, g] = self.phases(y, 0.0);
        way(self.from, &[a, b, c]) + way(self.to, &[g, f, e])
    }

    /// The phases of the one that goes the way of a task soonest; none if none goes it.
    pub(super) fn reaching(&self, task: &Task) -> Option<[Stretch; 7]> {
        let at = |y: f64| Point { x: y, f: self.way(y) - task.way };
        // A larger parameter takes longer; those above zero take less.
        let last = if self.above { 0.0 } else { self.most() };
        let mut from = at(if self.above { self.most() } else { self.least() });
        // The straightest leads there, but for what was rounded.
        if !self.above && from.f.abs() <= task.blur + ROUNDED * task.top * time(&self.phases(from.x, 0.0)) {
            return Some(self.forth(from.x, 0.0));
        }
        if from.f > 0.0 && self.surely_grows() {
            return None;
        }
        for turn in self.turns().into_iter().flatten().chain([last]) {
            let to = at(turn);
            if (from.f <= 0.0) == (to.f >= 0.0) {
                return Some(self.forth(root(from, to, |y| at(y).f), 0.0));
            }
            from = to;
        }
        // Full speed, for as long as it takes.
        (from.f < 0.0 && !self.above).then(|| self.forth(from.x, -from.f / task.top))
    }

    /// A larger parameter always leads farther.
    fn surely_grows(&self) -> bool {
        !self.above && self.from.settled() >= 0.0 && self.from.a >= 0.0
    }

    /// Parameters at which the ways turn from growing to shrinking and back, in the order of the time taken.
    ///
    /// Going backwards for longer leads less far, and what starts by slowing down has first to speed up again: there is at
    /// most one longest way and then one shortest, the longest before the acceleration comes to zero.
    fn turns(&self) -> [Option<f64>; 2] {
        if self.above {
            return [self.turn_above(), None];
        }
        let shrinks = if self.surely_grows() { None } else { self.shrinks() };
        let Some((growing, shrinking)) = shrinks else { return [None; 2] };
        let slope = |y: f64| self.slope(y);
        let longest = if growing < shrinking {
            root(Point::of(growing, slope), Point::of(shrinking, slope), slope)
        } else {
            growing
        };
        let shortest = root(Point::of(shrinking, slope), Point::of(self.most(), slope), slope);
        [Some(longest), Some(shortest)]
    }

    /// The same of those above zero, which have one turn at most.
    fn turn_above(&self) -> Option<f64> {
        let slope = |y: f64| self.slope(y);
        // At its very beginning the slope is zero: all of it comes with y².
        let first = Point::of(self.most() / 1024.0, slope);
        let last = Point::of(self.most(), slope);
        (first.f * last.f < 0.0).then(|| root(first, last, slope))
    }

    /// Where the ways still grow, and where they shrink.
    fn shrinks(&self) -> Option<(f64, f64)> {
        let least = self.least();
        let mut growing = least;
        for part in PARTS {
            let y = least * part;
            if self.slope(y) < 0.0 {
                return Some((growing, y));
            }
            growing = y;
        }
        None
    }

    /// By how much farther it goes for a larger parameter.
    ///
    /// A phase that lasts longer moves all that comes after by its last speed, and changes speed and acceleration.
    fn slope(&self, y: f64) -> f64 {
        let phases = self.phases(y, 0.0);
        let mut left = time(&phases);
        let mut motion = self.from;
        let mut slope = 0.0;
        for ((time, jerk), longer) in phases.into_iter().zip(self.longer(y)) {
            motion = motion.after(time, jerk);
            left -= time;
            slope += longer * motion.after(left, jerk).v;
        }
        slope
    }

    /// By how much longer each phase lasts for a larger parameter.
    fn longer(&self, y: f64) -> [f64; 7] {
        let (mut down, down_pause) = cut_slope(y, y * y + self.apart);
        if self.above {
            down = -down;
        }
        if y < 0.0 {
            return [1.0, 0.0, 0.0, 0.0, 1.0 + down, down_pause, down];
        }
        let (up, up_pause) = cut_slope(y, y * y + squared(self.from.a.max(0.0)));
        [up, up_pause, up, 0.0, down, down_pause, down]
    }

    /// The phases in the order of the motion.
    pub(super) fn forth(&self, y: f64, rest: f64) -> [Stretch; 7] {
        let mut phases = self.phases(y, rest);
        if self.backwards {
            phases.reverse();
        }
        phases
    }
}

fn squared(number: f64) -> f64 {
    number * number
}

/// By how much height and pause of [`cut`] grow with y, of a square y² + c.
fn cut_slope(y: f64, square: f64) -> (f64, f64) {
    if square > 1.0 {
        return (0.0, 2.0 * y);
    }
    (if square > 0.0 { y / libm::sqrt(square) } else { 1.0 }, 0.0)
}

/// What sums of a few phases may have rounded, part of the way at full speed.
const ROUNDED: f64 = 1e-14;

/// Where the slope is looked at, parts of the parameter of the first. If the ways shrink between two of these alone, the
/// first that goes a way is hardly sooner than the next.
const PARTS: [f64; 6] = [1.0, 0.8, 0.6, 0.4, 0.2, 0.0];
