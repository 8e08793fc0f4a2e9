//! A jerk-limited change of speed, decided tick by tick.
//!
//! Homing uses it to glide at a wanted speed, a stop uses it to brake on the path. It needs no plan, so it can start
//! from any state at once.

use crate::wide;

/// Limits of a ramp, in whatever unit its speed has, a tick and a tick².
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RampLimits {
    /// Largest acceleration, 0 … 2³¹.
    acceleration: i64,
    /// Largest change of acceleration in a tick, 1 … 2³¹.
    jerk: i64,
    /// Speed gained while the largest acceleration is taken back: whatever rise is at least this, is never too small.
    longest: i64,
}

impl RampLimits {
    /// Limits of `acceleration` and `jerk`; beyond 0 … 2³¹ and 1 … 2³¹ the nearest is taken. Not for the tick: divides.
    pub fn new(acceleration: i64, jerk: i64) -> Self {
        const LARGEST: i64 = 1 << 31;
        let (acceleration, jerk) = (acceleration.clamp(0, LARGEST), jerk.clamp(1, LARGEST));
        let product = acceleration.saturating_mul(acceleration.saturating_add(jerk));
        let longest = product.checked_div(jerk.saturating_mul(2)).unwrap_or(i64::MAX);
        Self { acceleration, jerk, longest }
    }
}

/// Speed and acceleration of a ramp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    ///
    /// Speeds are below 2⁶² each way.
    pub fn tick(&mut self, wanted: i64, limits: &RampLimits) -> i64 {
        let missing = wanted.wrapping_sub(self.speed);
        if missing == 0 && self.acceleration == 0 {
            return wanted;
        }
        // Mirrored, so that the speed always has to rise.
        let mirrored = |value: i64| if missing < 0 { value.wrapping_neg() } else { value };
        let rise = mirrored(missing);
        if rise <= limits.jerk && self.acceleration.unsigned_abs() <= limits.jerk.unsigned_abs() {
            *self = Self { speed: wanted, acceleration: 0 };
        } else {
            self.acceleration = mirrored(next_acceleration(rise, mirrored(self.acceleration), limits));
            self.speed = self.speed.wrapping_add(self.acceleration);
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
    let up = now.wrapping_add(limits.jerk).min(limits.acceleration);
    let down = now.wrapping_sub(limits.jerk);
    if rise >= limits.longest {
        return up;
    }
    // From here on `rise` · 2 jerk is below 2⁶³, because `longest` · 2 jerk is.
    let affordable = wide::mul_u64_u32(rise.cast_unsigned(), limits.jerk as u32).wrapping_mul(2);
    [up, now]
        .into_iter()
        .find(|&a| gained(a, limits.jerk) <= affordable.wrapping_add(rounding(limits)))
        .unwrap_or(down)
}

/// What a division by twice the jerk would cut off.
fn rounding(limits: &RampLimits) -> u64 {
    (limits.jerk as u64).wrapping_mul(2).wrapping_sub(1)
}

/// Speed gained by a tick at acceleration `a` and by all the ticks that take it back to zero, times twice the jerk:
/// a + (a − j) + (a − 2j) + … ≈ a (a + j) / 2j. An acceleration a ≤ 0 is always affordable.
fn gained(a: i64, jerk: i64) -> u64 {
    if a <= 0 {
        return 0;
    }
    wide::mul_u64_u32(a.wrapping_add(jerk).cast_unsigned(), a as u32)
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
            let limits = RampLimits::new(jerk * 40, jerk);
            let mut ramp = Ramp { speed, acceleration: start_jerks * jerk };
            let mut ticks = 0i64;
            while ramp != (Ramp { speed: wanted, acceleration: 0 }) {
                let before = ramp;
                ramp.tick(wanted, &limits);
                let change = ramp.acceleration - before.acceleration;
                prop_assert!(change.abs() <= jerk, "jerk {change} of {jerk}");
                prop_assert!(ramp.acceleration.abs() <= jerk * 40);
                ticks += 1;
                let longest = (wanted - speed).abs() / jerk + 400 + 4 * (speed.abs() / limits.acceleration);
                prop_assert!(ticks <= longest, "{ramp:?} still going after {ticks}");
            }
        }
    }

    #[test]
    fn does_not_overshoot_from_rest() {
        let limits = RampLimits::new(5000, 20);
        let mut ramp = Ramp::AT_REST;
        let fastest = (0..3000).map(|_| ramp.tick(1_234_567, &limits)).max();
        assert_eq!(fastest, Some(1_234_567));
        assert_eq!(ramp, Ramp { speed: 1_234_567, acceleration: 0 });
    }
}
