//! The path of all axes together: hold, wait for a plan, follow a straight line, or brake on it.

use super::profile::{Limits, Profile, Walk};
use super::ramp::{Ramp, RampLimits};
use crate::units::Pos;
use crate::wide;

/// A planned straight line. Made by [`LinePlan::new`] outside the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinePlan<const N: usize> {
    profile: Profile,
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    from: [Pos; N],
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    to: [Pos; N],
    /// Picometres per unit of way, with `shift` fractional bits, for each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    gain: [i64; N],
    shift: u32,
    /// For braking, units a tick; the path itself has a jerk of one unit.
    braking: RampLimits,
}

impl<const N: usize> LinePlan<N> {
    /// Plans a line that all axes begin and end together, each within its own limits.
    ///
    /// The deviation from the straight line is below one picometre; the end is exact.
    pub fn new(from: [Pos; N], to: [Pos; N], limits: &[Limits; N]) -> Self {
        let mut delta = [0i64; N];
        for (delta, (from, to)) in delta.iter_mut().zip(from.iter().zip(&to)) {
            *delta = (*to - *from).pm();
        }
        let way = libm::sqrt(delta.iter().map(|&d| d as f64 * d as f64).sum::<f64>());
        if way < 1.0 {
            return Self::nowhere(to);
        }
        let along = limits_along(&delta, way, limits);
        let profile = Profile::fastest(way, &along);
        let units = profile.way().max(1);
        let longest = delta.iter().map(|d| d.unsigned_abs()).max().unwrap_or(0);
        let shift = fitting_shift(longest, units);
        let unit_pm = way / units as f64;
        let mut gain = [0i64; N];
        for (gain, delta) in gain.iter_mut().zip(delta) {
            *gain = scaled_quotient(delta, units, shift);
        }
        let acceleration = (along.acceleration / unit_pm).clamp(1.0, 2_147_483_648.0) as i64;
        Self { profile, from, to, gain, shift, braking: RampLimits::new(acceleration, 1) }
    }

    fn nowhere(at: [Pos; N]) -> Self {
        let profile = Profile { jerk_ticks: 0, acceleration_ticks: 0, cruise_ticks: 0 };
        Self { profile, from: at, to: at, gain: [0; N], shift: 0, braking: RampLimits::new(1, 1) }
    }

    /// Ticks from start to end.
    pub fn ticks(&self) -> u32 {
        self.profile.ticks()
    }

    fn at(&self, way: i64) -> [Pos; N] {
        let mut position = self.from;
        for (position, gain) in position.iter_mut().zip(self.gain) {
            let along = wide::scaled(way, gain, self.shift);
            *position = Pos::from_pm(position.pm().wrapping_add(along));
        }
        position
    }
}

/// The limits along a line: the axis that reaches its own limit first decides.
fn limits_along<const N: usize>(delta: &[i64; N], way: f64, limits: &[Limits; N]) -> Limits {
    let mut along = Limits { speed: f64::MAX, acceleration: f64::MAX, jerk: f64::MAX };
    for (&delta, axis) in delta.iter().zip(limits).filter(|(delta, _)| **delta != 0) {
        let share = libm::fabs(delta as f64) / way;
        along.speed = along.speed.min(axis.speed / share);
        along.acceleration = along.acceleration.min(axis.acceleration / share);
        along.jerk = along.jerk.min(axis.jerk / share);
    }
    along
}

/// The most fractional bits with which `longest / units` still fits 62 bits.
fn fitting_shift(longest: u64, units: i64) -> u32 {
    let whole_bits = 64u32.saturating_sub(longest.leading_zeros());
    let unit_bits = 64u32.saturating_sub(units.leading_zeros());
    62u32.saturating_sub(whole_bits).saturating_add(unit_bits).saturating_sub(1).min(100)
}

/// `delta · 2^shift / units`, rounded to nearest.
fn scaled_quotient(delta: i64, units: i64, shift: u32) -> i64 {
    let units = i128::from(units);
    let numerator = i128::from(delta.unsigned_abs()) << shift.min(100);
    let quotient = numerator.saturating_add(units >> 1).checked_div(units).unwrap_or(0);
    let magnitude = i64::try_from(quotient).unwrap_or(i64::MAX);
    if delta < 0 { magnitude.saturating_neg() } else { magnitude }
}

/// What the set-point is doing.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Motion<const N: usize> {
    Hold,
    Waiting { plan: LinePlan<N>, start: u32 },
    Line { plan: LinePlan<N>, walk: Walk },
    Braking { plan: LinePlan<N>, way: i64, ramp: Ramp },
}

/// The set-point of all axes, stage frame.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Path<const N: usize> {
    motion: Motion<N>,
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    set_point: [Pos; N],
}

impl<const N: usize> Path<N> {
    /// Holding at a place.
    pub fn holding(at: [Pos; N]) -> Self {
        Self { motion: Motion::Hold, set_point: at }
    }

    /// Holds at a place from now on.
    pub fn hold(&mut self, at: [Pos; N]) {
        *self = Self::holding(at);
    }

    /// The same for one axis, whose frame has moved.
    pub fn hold_axis(&mut self, axis: usize, at: Pos) {
        self.motion = Motion::Hold;
        if let Some(set_point) = self.set_point.get_mut(axis) {
            *set_point = at;
        }
    }

    /// The last set-point.
    pub fn set_point(&self) -> [Pos; N] {
        self.set_point
    }

    /// The same, to look at.
    pub(crate) fn places(&self) -> &[Pos; N] {
        &self.set_point
    }

    /// Takes a plan that begins at tick `start`.
    pub fn follow(&mut self, plan: LinePlan<N>, start: u32) {
        self.motion = Motion::Waiting { plan, start };
    }

    /// Brakes on the path from the next tick on.
    pub fn brake(&mut self) {
        self.motion = match self.motion {
            Motion::Line { plan, walk } => {
                let ramp = Ramp { speed: walk.speed, acceleration: walk.acceleration };
                Motion::Braking { plan, way: walk.way, ramp }
            }
            braking @ Motion::Braking { .. } => braking,
            Motion::Hold | Motion::Waiting { .. } => Motion::Hold,
        };
    }

    /// Whether the set-point stands.
    pub fn is_holding(&self) -> bool {
        matches!(self.motion, Motion::Hold)
    }

    /// The set-point of tick number `tick`.
    pub fn tick(&mut self, tick: u32) -> [Pos; N] {
        if let Motion::Waiting { plan, start } = self.motion {
            // Reached also when the plan came late.
            if tick.wrapping_sub(start) < u32::MAX / 2 {
                self.motion = Motion::Line { plan, walk: Walk::default() };
            }
        }
        match &mut self.motion {
            Motion::Hold | Motion::Waiting { .. } => {}
            Motion::Line { plan, walk } => {
                if walk.tick(&plan.profile) {
                    self.set_point = plan.at(walk.way);
                } else {
                    let end = plan.to;
                    self.hold(end);
                }
            }
            Motion::Braking { plan, way, ramp } => {
                *way = way.wrapping_add(ramp.tick(0, &plan.braking));
                self.set_point = plan.at(*way);
                if ramp.is_at_rest() {
                    self.motion = Motion::Hold;
                }
            }
        }
        self.set_point
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { speed: 2e6, acceleration: 5000.0, jerk: 20.0 };

    fn run(path: &mut Path<2>, from_tick: u32) -> Vec<[Pos; 2]> {
        let mut points = Vec::new();
        let mut tick = from_tick;
        while !path.is_holding() {
            points.push(path.tick(tick));
            tick += 1;
        }
        points
    }

    proptest! {
        #[test]
        fn both_axes_stay_on_the_line_and_end_exactly(
            from in prop::array::uniform2(-200_000_000_000i64..200_000_000_000),
            to in prop::array::uniform2(-2_000_000_000i64..2_000_000_000),
            scale in 0u32..31,
        ) {
            let from = from.map(Pos::from_pm);
            let to = [from[0] + Pos::from_pm(to[0] >> scale), from[1] + Pos::from_pm(to[1] >> scale)];
            let plan = LinePlan::new(from, to, &[LIMITS; 2]);
            let mut path = Path::holding(from);
            path.follow(plan, 0);
            let points = run(&mut path, 0);
            prop_assert_eq!(path.set_point(), to);
            let delta = [(to[0] - from[0]).pm() as f64, (to[1] - from[1]).pm() as f64];
            let length = delta[0].hypot(delta[1]).max(1.0);
            for point in points {
                let gone = [(point[0] - from[0]).pm() as f64, (point[1] - from[1]).pm() as f64];
                let off = (gone[0] * delta[1] - gone[1] * delta[0]) / length;
                prop_assert!(off.abs() <= 1.0, "{off} pm off the line");
            }
        }

        #[test]
        fn braking_stays_on_the_line_within_the_limits_and_never_turns_back(at in 1u32..1600) {
            let from = [Pos::ZERO; 2];
            let to = [Pos::from_mm(1.0), Pos::from_mm(-0.5)];
            let mut path = Path::holding(from);
            path.follow(LinePlan::new(from, to, &[LIMITS; 2]), 0);
            let mut points: Vec<[Pos; 2]> = (0..at).map(|tick| path.tick(tick)).collect();
            path.brake();
            points.extend(run(&mut path, at));
            let x: Vec<i64> = points.iter().map(|p| p[0].pm()).collect();
            for pair in points.windows(2) {
                prop_assert!(pair[1][0] >= pair[0][0]);
                prop_assert!((pair[1][0].pm() + 2 * pair[1][1].pm()).abs() <= 3, "off the line");
            }
            for w in x.windows(3) {
                prop_assert!((w[2] - 2 * w[1] + w[0]).abs() as f64 <= 5000.0 + 4.0);
            }
            for w in x.windows(4) {
                let jerk = w[3] - 3 * w[2] + 3 * w[1] - w[0];
                prop_assert!(jerk.abs() as f64 <= 20.0 + 8.0, "{jerk}");
            }
        }
    }

    #[test]
    fn a_move_to_where_it_stands_ends_at_once() {
        let at = [Pos::from_mm(3.0); 2];
        let mut path = Path::holding(at);
        path.follow(LinePlan::new(at, at, &[LIMITS; 2]), 0);
        assert_eq!(run(&mut path, 0).len(), 1);
        assert_eq!(path.set_point(), at);
    }
}
