//! A straight line from rest to rest, planned before it is gone and walked in exact integers; and braking on it.

use super::profile::{Limits, Profile};
use super::ramp::RampLimits;
use super::steps::SetPoint;
use super::transfer::State;
use crate::units::Pos;
use crate::wide;

/// A planned straight line. Made by [`LinePlan::new`] outside the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinePlan<const N: usize> {
    pub(super) profile: Profile,
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    from: [Pos; N],
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub(super) to: [Pos; N],
    /// Picometres per unit of way, with `shift` fractional bits, for each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    gain: [i64; N],
    shift: u32,
    /// For braking, units a tick; the path itself has a jerk of one unit.
    pub(super) braking: RampLimits,
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

    /// All of a set-point of each axis, of a way, a speed, an acceleration and a jerk in units.
    pub(super) fn set_points(&self, way: i64, speed: i64, acceleration: i64, jerk: i64) -> [SetPoint; N] {
        // A speed in units is the way of the last tick: half of the acceleration later it is that of now.
        let twice = speed.wrapping_mul(2).wrapping_add(acceleration);
        let mut set_points = [SetPoint::default(); N];
        for ((set_point, position), gain) in set_points.iter_mut().zip(self.at(way)).zip(self.gain) {
            let scaled = |units: i64, bits: u32| {
                let size = wide::scaled(units.saturating_abs(), gain, self.shift.saturating_sub(bits));
                if units < 0 { size.wrapping_neg() } else { size }
            };
            *set_point = SetPoint {
                position,
                speed: scaled(twice, 37),
                acceleration: scaled(acceleration, 46),
                jerk: scaled(jerk, 50),
            };
        }
        set_points
    }

    /// The state of each axis after so many ticks, from which another motion goes on within the limits. Not for the tick.
    ///
    /// A walk in units knows sums, not derivatives. A cubic through its last places, whose jerk takes the acceleration
    /// back, is one: the third difference from there on lies between that jerk and the next.
    pub fn states(&self, ticks: u32) -> [State; N] {
        let walk = self.profile.walk(ticks);
        let jerk = walk.acceleration.signum().saturating_neg() as f64;
        let now = walk.acceleration as f64 + jerk;
        let speed = walk.speed as f64 + now / 2.0 - jerk / 6.0;
        let at = if ticks < self.ticks() { self.at(walk.way) } else { self.to };
        let mut states = [State::default(); N];
        for ((state, at), gain) in states.iter_mut().zip(at).zip(self.gain) {
            let unit = libm::ldexp(gain as f64, self.shift.cast_signed().saturating_neg());
            *state = State { position: at.pm() as f64, speed: unit * speed, acceleration: unit * now };
        }
        states
    }

    fn nowhere(at: [Pos; N]) -> Self {
        let profile = Profile { jerk_ticks: 0, acceleration_ticks: 0, cruise_ticks: 0 };
        Self { profile, from: at, to: at, gain: [0; N], shift: 0, braking: RampLimits::new(1, 1) }
    }

    /// Ticks from start to end.
    pub fn ticks(&self) -> u32 {
        self.profile.ticks()
    }

    pub(super) fn at(&self, way: i64) -> [Pos; N] {
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
