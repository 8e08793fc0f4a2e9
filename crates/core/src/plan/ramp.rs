//! A jerk-limited change of speed, decided tick by tick.
//!
//! Homing uses it to glide at a wanted speed, a stop uses it to brake on the path. It needs no plan, so it can start
//! from any state at once.

/// Limits of a ramp, in whatever unit its speed has, a tick and a tick².
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RampLimits {
    /// Largest acceleration, at least `jerk`; at most 2³¹.
    pub acceleration: i64,
    /// Largest change of acceleration in a tick, at least 1; at most 2³¹.
    pub jerk: i64,
}

/// Speed and acceleration of a ramp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ramp {
    /// Units a tick.
    pub speed: i64,
    /// Units a tick².
    pub acceleration: i64,
}

impl Ramp {
    /// Standing still.
    pub const AT_REST: Self = Self { speed: 0, acceleration: 0 };

    /// One tick towards `wanted`; returns the new speed. Arrives exactly, with no acceleration left.
    pub fn tick(&mut self, wanted: i64, limits: &RampLimits) -> i64 {
        let missing = wanted.saturating_sub(self.speed);
        // Mirrored, so that the speed always has to rise.
        let sign = if missing < 0 { -1 } else { 1 };
        let rise = missing.saturating_mul(sign);
        let acceleration = next_acceleration(rise, self.acceleration.saturating_mul(sign), limits);
        if rise <= limits.jerk && self.acceleration.saturating_abs() <= limits.jerk {
            *self = Self { speed: wanted, acceleration: 0 };
        } else {
            self.acceleration = acceleration.saturating_mul(sign);
            self.speed = self.speed.saturating_add(self.acceleration);
        }
        self.speed
    }

    /// Whether it stands still.
    pub fn is_at_rest(&self) -> bool {
        *self == Self::AT_REST
    }
}

/// The largest acceleration within one jerk of `now` that can still be taken back before `rise` is used up.
fn next_acceleration(rise: i64, now: i64, limits: &RampLimits) -> i64 {
    let up = now.saturating_add(limits.jerk).min(limits.acceleration);
    let down = now.saturating_sub(limits.jerk);
    [up, now].into_iter().find(|&a| gained(a, limits.jerk) <= rise).unwrap_or(down)
}

/// Speed gained by a tick at acceleration `a` and by all the ticks that take it back to zero:
/// a + (a − j) + (a − 2j) + … ≈ a (a + j) / 2j. An acceleration a ≤ 0 is always affordable.
fn gained(a: i64, jerk: i64) -> i64 {
    if a <= 0 {
        return i64::MIN;
    }
    // One division only for a positive acceleration; jerk is at least 1.
    let product = a.saturating_mul(a.saturating_add(jerk));
    product.checked_div(jerk.saturating_mul(2)).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn arrives_from_any_state_within_its_limits(
            speed in -1_000_000i64..1_000_000,
            start_jerks in -40i64..40,
            wanted in -1_000_000i64..1_000_000,
            jerk in 1i64..500,
        ) {
            let limits = RampLimits { acceleration: jerk * 40, jerk };
            let mut ramp = Ramp { speed, acceleration: start_jerks * jerk };
            let mut ticks = 0i64;
            while ramp != (Ramp { speed: wanted, acceleration: 0 }) {
                let before = ramp;
                ramp.tick(wanted, &limits);
                let change = ramp.acceleration - before.acceleration;
                prop_assert!(change.abs() <= jerk, "jerk {change} of {jerk}");
                prop_assert!(ramp.acceleration.abs() <= limits.acceleration);
                ticks += 1;
                let longest = (wanted - speed).abs() / jerk + 400 + 4 * (speed.abs() / limits.acceleration);
                prop_assert!(ticks <= longest, "{ramp:?} still going after {ticks}");
            }
        }
    }

    #[test]
    fn does_not_overshoot_from_rest() {
        let limits = RampLimits { acceleration: 5000, jerk: 20 };
        let mut ramp = Ramp::AT_REST;
        let fastest = (0..3000).map(|_| ramp.tick(1_234_567, &limits)).max();
        assert_eq!(fastest, Some(1_234_567));
        assert_eq!(ramp, Ramp { speed: 1_234_567, acceleration: 0 });
    }
}
