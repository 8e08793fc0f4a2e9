//! Where one curve goes over into the next without a stop, if one of them is bent at least; with or without a kink.
//!
//! The end of the first is laid over the beginning of the second, for T ticks, each as a motion along its own curve: the
//! first slows down from v to rest while the second speeds up from rest to v, so that both speeds sum up to v. With τ the
//! part of T, g(τ) = τ³(10 − 15τ + 6τ²), S its integral, A(0) the end of the first and B(0) the beginning of the second,
//!
//! p = A(−vT S(1 − τ)) + B(vT S(τ)) − A(0).
//!
//! At both ends it is on its curve, at the speed v along it, and all else is as the curve alone has it there. Between:
//!
//! * It is never faster than v, nor an axis faster than on the faster of both curves.
//! * The acceleration is g'v/T · (B' − A') + v²((1 − g)² A'' + g² B''). B' − A' is the kink of the directions and what the
//!   curves have turned since, so with curvatures of κ at most it is below 1.875 v/T · kink + 1.13 κv²: [`SECOND`].
//! * The jerk is g''v/T² · kink, and v²/T (P(τ) B'' − P(1 − τ) A'') with P = g''S + 3g'g and the curvatures at the place
//!   where both meet: sums and differences of both weigh differently, and what goes on as it was weighs least
//!   ([`THIRD`]). That the curvatures change, and what a curve asks for at constant speed, is below 1.27 v³ times the
//!   largest third derivative of a curve.
//! * From the place that is vT |S(τ) − S(1 − τ)| from where they meet, on the nearer curve, it is as far as the integral of a
//!   difference of directions over a way of vT S(1 − τ) at most: [`OFF`].
//!
//! `no_weight_is_exceeded` holds these numbers against the polynomials, and the tests of programs against set-points. Each
//! condition asks for a longest or a shortest T at a speed; T is the shortest, and all of it grows with the speed. Limits are
//! those of the weaker axis, in all directions.
//!
//! Where the second curve goes on as the first has ended, to what rounding leaves, nothing has to be laid over.

use super::curve::{Bend, Curve, Place, distance};
use super::pieces::{MOST_OFF, Piece, SHORT, hermite};
use super::profile::Limits;
use super::root::highest;
use super::steps::lay_out;
use super::transfer::{Phase, State};

/// What a kink weighs in the acceleration and the curvature in it.
const SECOND: [f64; 2] = [1.875, 1.13];
/// The same of the jerk: a kink; the mean of both curvatures, half of their difference, and each alone; third derivatives.
const THIRD: Weights = Weights { kink: 5.7736, mean: 1.667, half: 5.6251, alone: 3.168, third: 1.2695 };
/// How far it is from the nearer curve: of vT what a kink weighs, of its square the larger and the smaller curvature.
const OFF: [f64; 3] = [0.078_126, 0.0045, 0.001_61];
/// Largest third derivative of g.
const FOURTH: f64 = 60.0;

/// Part of the jerk that is used: cubics have it on the mean, but leave seams in the acceleration.
const USED: f64 = 0.97;
/// With so many times the cube root of T in ticks the seams between pieces leave less of the jerk than that.
const PIECES: f64 = 6.0;
/// Part of the jerk that a step of speed and acceleration may make of differences.
const SMOOTH: f64 = 0.02;

struct Weights {
    kink: f64,
    mean: f64,
    half: f64,
    alone: f64,
    third: f64,
}

/// Two curves laid over each other where they meet, at a speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    curves: [Curve; 2],
    /// Where they meet.
    at: Place,
    /// By how much the direction changes there.
    kink: f64,
    /// By how much the curvature does, 1/pm.
    step: f64,
    /// What the curvatures there ask of the jerk, 1/pm.
    turning: f64,
    /// The larger and the smaller curvature that the curves have at most.
    curvatures: [f64; 2],
    /// The largest third derivative of a curve, 1/pm².
    third: f64,
    /// Speed at both ends, pm a tick.
    pub speed: f64,
    /// Of the weaker axis, pm a tick² and a tick³.
    acceleration: f64,
    jerk: f64,
}

impl Joint {
    /// The fastest up to a top that leaves the curves by the tolerance at most, pm, and begins and ends within `room` pm of
    /// where they meet. The top is no faster than both curves may be gone along.
    pub fn fastest(curves: [Curve; 2], axes: &[Limits; 2], top: f64, tolerance: f64, room: f64) -> Self {
        let joint = Self::of(curves, axes);
        let left = |speed: f64| {
            let joint = joint.at_speed(speed);
            (tolerance - joint.off()).min(room - joint.reach())
        };
        joint.at_speed(highest(top, left))
    }

    fn of(curves: [Curve; 2], axes: &[Limits; 2]) -> Self {
        let [first, second] = curves;
        let length = first.length();
        let (end, begin) = (first.spot(length), second.spot(0.0));
        let [before, behind] = [first.turning(length), second.turning(0.0)];
        let step = distance(before, behind);
        let mean = libm::hypot(before[0] + behind[0], before[1] + behind[1]) / 2.0;
        let both = THIRD.mean * mean + THIRD.half * step / 2.0;
        let alone = THIRD.alone * (libm::hypot(before[0], before[1]) + libm::hypot(behind[0], behind[1]));
        let [a, b] = curves.map(|curve| curve.bend().unwrap_or_default());
        let [x, y] = axes;
        Self {
            curves,
            at: begin.at,
            kink: distance(end.tangent, begin.tangent),
            step,
            turning: both.min(alone),
            curvatures: [a.curvature.max(b.curvature), a.curvature.min(b.curvature)],
            third: third(&a).max(third(&b)),
            speed: 0.0,
            acceleration: x.acceleration.min(y.acceleration),
            jerk: x.jerk.min(y.jerk),
        }
    }

    pub(super) fn at_speed(self, speed: f64) -> Self {
        Self { speed, ..self }
    }

    /// How long it takes, ticks.
    pub fn ticks(&self) -> f64 {
        let Self { speed, acceleration, jerk, .. } = *self;
        let (kink, squared) = (speed * self.kink, speed * speed);
        if kink + squared * self.step <= SMOOTH * jerk {
            return 0.0;
        }
        let acceleration = acceleration - SECOND[1] * self.curvatures[0] * squared;
        let jerk = USED * jerk - THIRD.third * self.third * squared * speed;
        if !(acceleration > 0.0 && jerk > 0.0) {
            return f64::INFINITY;
        }
        // The shortest in which kink/T² and what turns, /T, leave the jerk its limit.
        let half = self.turning * squared / (2.0 * jerk);
        let by_jerk = half + libm::sqrt(half * half + THIRD.kink * kink / jerk);
        by_jerk.max(SECOND[0] * kink / acceleration)
    }

    /// From where it begins to where the curves meet, as from there to where it ends, pm.
    pub fn reach(&self) -> f64 {
        self.speed * self.ticks() / 2.0
    }

    /// From the curves to where it is farthest from them, pm, or less.
    pub fn off(&self) -> f64 {
        let way = self.speed * self.ticks();
        let [larger, smaller] = self.curvatures;
        // No farther than one is from where they meet, whatever they do.
        let most = OFF[0] * way * self.kink.min(1.0);
        (most + (OFF[1] * larger + OFF[2] * smaller) * way * way).min(OFF[0] * way)
    }

    /// How many pieces it is cut into: [`MOST_OFF`] from it at most, and no shorter than a tick.
    fn parts(&self, ticks: f64) -> f64 {
        let fourth = self.fourth(ticks);
        let near = ticks * libm::sqrt(libm::sqrt(fourth / (384.0 * MOST_OFF)));
        libm::ceil(near.max(PIECES * libm::cbrt(ticks)).min(ticks)).max(1.0)
    }

    /// More than the fourth derivative of its places.
    fn fourth(&self, ticks: f64) -> f64 {
        let [larger, smaller] = self.curvatures;
        let turned = self.kink + (larger + smaller) * self.speed * ticks / 2.0;
        let acceleration = SECOND[0] * self.speed / ticks;
        let jerk = THIRD.kink * self.speed / (ticks * ticks);
        let of = |curve: &Curve| {
            curve.bend().map_or(0.0, |bend| bend.fourth_derivative(self.speed, acceleration, jerk))
        };
        let [first, second] = &self.curves;
        FOURTH * self.speed / (ticks * ticks * ticks) * turned + of(first) + of(second)
    }

    /// A piece by its number, of one that begins at a time, ticks, and when the next begins, if one does. The piece is none
    /// if it does not fit a tick's integers.
    pub fn piece(&self, number: usize, begins: f64) -> Option<(Option<Piece>, Option<f64>)> {
        let ticks = self.ticks();
        let (parts, number) = (self.parts(ticks), number as f64);
        if number >= parts || ticks == 0.0 {
            return None;
        }
        let [from, to] = [number / parts, (number + 1.0) / parts];
        let ends = [from, to].map(|part| self.at_part(part, ticks));
        let next = (number + 1.0 < parts).then_some(begins + to * ticks);
        Some((cubics(begins + from * ticks, (to - from) * ticks, &ends), next))
    }

    /// Place and speed of both axes at a part of its time.
    fn at_part(&self, part: f64, ticks: f64) -> [State; 2] {
        let ([first, second], left) = (&self.curves, 1.0 - part);
        let before = first.spot(first.length() - self.speed * ticks * gone(left));
        let behind = second.spot(self.speed * ticks * gone(part));
        let speed = [self.speed * share(left), self.speed * share(part)];
        let of = |pair: &Place, axis: usize| pair.get(axis).copied().unwrap_or(0.0);
        [0, 1].map(|axis| State {
            position: of(&before.at, axis) + (of(&behind.at, axis) - of(&self.at, axis)),
            speed: speed[0] * of(&before.tangent, axis) + speed[1] * of(&behind.tangent, axis),
            acceleration: 0.0,
        })
    }
}

/// g: which part of the speed the second curve has.
fn share(part: f64) -> f64 {
    part * part * part * (10.0 + part * (6.0 * part - 15.0))
}

/// S, its integral.
fn gone(part: f64) -> f64 {
    let squared = part * part;
    squared * squared * (2.5 + part * (part - 3.0))
}

/// The largest third derivative of the places of a curve by its length.
fn third(bend: &Bend) -> f64 {
    libm::hypot(bend.curvature * bend.curvature, bend.change)
}

fn cubics(begins: f64, length: f64, [from, to]: &[[State; 2]; 2]) -> Option<Piece> {
    let of = |from: State, to: State| {
        let (state, jerk) = if length < SHORT { (from, 0.0) } else { hermite(from, to, length) };
        lay_out(begins, state, &Phase { ticks: length, jerk })
    };
    Some([of(from[0], to[0])?, of(from[1], to[1])?])
}

#[cfg(test)]
mod tests {
    use super::{OFF, SECOND, THIRD, gone, share};

    /// The weights are the largest values of polynomials, rounded up, and not by much.
    #[test]
    fn no_weight_is_exceeded() {
        let mut most = [0.0_f64; 10];
        for step in 0..=100_000 {
            let at = f64::from(step) / 100_000.0;
            let [now, then] = [at, 1.0 - at].map(Shape::at);
            let (near, far) = (now.gone.min(then.gone), now.gone.max(then.gone));
            let seen = [
                now.first,
                now.curved() + then.curved(),
                now.second.abs(),
                (now.turning() - then.turning()).abs(),
                (now.turning() + then.turning()).abs(),
                now.turning().abs(),
                now.changing() + then.changing(),
                near,
                near * (far - near / 2.0),
                near * far,
            ];
            most.iter_mut().zip(seen).for_each(|(most, seen)| *most = most.max(seen));
        }
        let weights = [
            SECOND[0],
            SECOND[1],
            THIRD.kink,
            THIRD.mean,
            THIRD.half,
            THIRD.alone,
            THIRD.third,
            OFF[0],
            OFF[1],
            OFF[1] + OFF[2],
        ];
        for (most, weight) in most.into_iter().zip(weights) {
            assert!(most <= weight && weight < most * 1.003, "{most} {weight}");
        }
    }

    /// g, its derivatives and its integral.
    struct Shape {
        gone: f64,
        share: f64,
        first: f64,
        second: f64,
    }

    impl Shape {
        fn at(part: f64) -> Self {
            let left = 1.0 - part;
            Self {
                gone: gone(part),
                share: share(part),
                first: 30.0 * part * part * left * left,
                second: 60.0 * part * left * (left - part),
            }
        }

        fn curved(&self) -> f64 {
            self.first * self.gone + self.share * self.share
        }

        fn turning(&self) -> f64 {
            self.second * self.gone + 3.0 * self.first * self.share
        }

        /// A third derivative counts by g³ where it is now, and where it was between by what is still felt of it.
        fn changing(&self) -> f64 {
            let between = (0..50).map(|k| (f64::from(k) + 0.5) / 50.0).map(|part| {
                (self.second * self.gone * part + 3.0 * self.first * self.share).abs() * self.gone / 50.0
            });
            self.share * self.share * self.share + between.sum::<f64>()
        }
    }
}
