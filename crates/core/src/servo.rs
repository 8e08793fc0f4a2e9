//! Servo: closes the position loop with paper A's incremental PID (row A4):
//!
//! Δu = Kp [e(k) − e(k−1)] + Ki e(k) + Kd [e(k) − 2 e(k−1) + e(k−2)]
//!
//! u is a speed (step pulses a tick), e the distance from the reading to the set-point in the scale frame. The speed
//! of the set-point is added to u outside the law, so that the law only corrects.

use crate::units::Pos;
use crate::wide;

/// Fractional bits of a speed inside the servo.
pub const SPEED_BITS: u32 = 48;

/// Gains and limits; speeds are step pulses a tick with [`SPEED_BITS`] fractional bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// Speed per picometre of change of error.
    pub kp: i32,
    /// Speed per picometre of error and tick.
    pub ki: i32,
    /// Speed per picometre of second difference of error.
    pub kd: i32,
    /// Speed per picometre a tick of set-point speed: one step pulse over its travel, or 0.
    pub feed_forward: i64,
    /// Largest speed of the law; 0 or more.
    pub limit: i64,
    /// Error, 0 or more, within which a standing axis is left alone: below the resolution of the drive a loop can only hunt.
    pub dead_band: Pos,
}

/// What the law remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IncrementalPid {
    /// e(k−1), picometres.
    e1: i64,
    /// e(k−2), picometres.
    e2: i64,
    /// u(k−1).
    u: i64,
    last_set_point: Option<Pos>,
}

/// A value within ± `limit`, 0 or more. Unlike `clamp` it has no case that panics.
fn within(value: i64, limit: i64) -> i64 {
    value.max(limit.wrapping_neg()).min(limit)
}

/// Errors are clamped to ±2 mm here; the guard has tripped long before. They fit a word.
const LARGEST_ERROR: i64 = 2_000_000_000;

impl Config {
    /// Speed for a set-point that goes `way` in this tick.
    fn fed_forward(&self, way: i64) -> i64 {
        // Exact up to 2¹⁵ pulses a tick; a path that is planned within its limits stays far below.
        wide::mul_i64_i32(self.feed_forward, way as i32)
    }
}

/// Gain times error. All but an error that has just changed its sign at full size fits a short product.
fn times(gain: i32, error: i64) -> i64 {
    let short = error as i32;
    if i64::from(short) == error { wide::mul_i32(gain, short) } else { error.saturating_mul(i64::from(gain)) }
}

impl IncrementalPid {
    /// One tick: the speed to drive at.
    #[inline]
    pub fn tick(&mut self, set_point: Pos, reading: Pos, config: &Config) -> i64 {
        let way = set_point.way_from(self.last_set_point.unwrap_or(set_point));
        self.last_set_point = Some(set_point);
        let error = within(set_point.way_from(reading), LARGEST_ERROR);
        if way == 0 && wide::is_within(error, config.dead_band.pm()) {
            self.rest(error);
            return 0;
        }
        let u = self.u.saturating_add(self.change(error, config));
        // The incremental form has no integrator to wind up but u itself.
        self.u = within(u, config.limit);
        self.e2 = self.e1;
        self.e1 = error;
        self.u.saturating_add(config.fed_forward(way))
    }

    /// Paper A's equation (2).
    fn change(&self, e: i64, config: &Config) -> i64 {
        // Errors are below 2³¹ each way, so that none of these sums can wrap.
        let p = times(config.kp, e.wrapping_sub(self.e1));
        let i = times(config.ki, e);
        let second = e.wrapping_sub(self.e1.wrapping_add(self.e1)).wrapping_add(self.e2);
        p.saturating_add(i).saturating_add(times(config.kd, second))
    }

    /// Forgets everything; the next tick starts from standstill without a jump.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    fn rest(&mut self, error: i64) {
        self.u = 0;
        self.e1 = error;
        self.e2 = error;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Config =
        Config { kp: 250, ki: 500, kd: 30, feed_forward: 0, limit: i64::MAX / 4, dead_band: Pos::ZERO };

    #[test]
    fn is_paper_a_s_equation_term_by_term() {
        // Kp : Ki : Kd as found in the paper, 0.25 : 0.5 : 0.03, in thousandths; error in picometres.
        let errors = [7i64, -3, 12, 12, 5, -9, 0, 4];
        let mut pid = IncrementalPid::default();
        let (mut u, mut e1, mut e2) = (0i64, 0i64, 0i64);
        for e in errors {
            u += 250 * (e - e1) + 500 * e + 30 * (e - 2 * e1 + e2);
            (e2, e1) = (e1, e);
            assert_eq!(pid.tick(Pos::from_pm(e), Pos::ZERO, &UNIT), u);
        }
    }

    #[test]
    fn a_standing_axis_within_its_dead_band_is_left_alone() {
        let config = Config { dead_band: Pos::from_um(0.2), ..UNIT };
        let mut pid = IncrementalPid::default();
        pid.tick(Pos::ZERO, Pos::from_um(5.0), &config);
        assert_ne!(pid.tick(Pos::ZERO, Pos::from_um(0.3), &config), 0);
        assert_eq!(pid.tick(Pos::ZERO, Pos::from_um(0.1), &config), 0);
        assert_eq!(pid.tick(Pos::ZERO, Pos::from_um(-0.1), &config), 0);
    }

    #[test]
    fn the_speed_is_limited_and_comes_back_at_once() {
        let config = Config { limit: 1000, ..UNIT };
        let mut pid = IncrementalPid::default();
        for _ in 0..100 {
            assert!(pid.tick(Pos::from_pm(1_000_000), Pos::ZERO, &config) <= 1000);
        }
        assert!(pid.tick(Pos::from_pm(-1_000_000), Pos::ZERO, &config) < 0);
    }

    #[test]
    fn feed_forward_is_the_speed_of_the_set_point() {
        let config = Config { kp: 0, ki: 0, kd: 0, feed_forward: 3, ..UNIT };
        let mut pid = IncrementalPid::default();
        pid.tick(Pos::from_pm(100), Pos::ZERO, &config);
        assert_eq!(pid.tick(Pos::from_pm(150), Pos::ZERO, &config), 150);
    }
}
