//! Drive: turns the speed of the law into what the power stage is told.

use crate::edge::{Actuation, AxisOutputs, StepRate};
use crate::servo::SPEED_BITS;

/// Limits of a step drive; rates are step pulses a tick with 16 fractional bits, from 0 on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// Largest rate; below 2³⁰, which is far more than can be emitted.
    pub fastest: i32,
    /// Largest change of rate in a tick: a stepper that is asked for more loses steps.
    pub change: i32,
}

/// What a step drive remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepDrive {
    rate: i32,
}

/// A value within ± `limit`, which is 0 or more. Unlike `clamp` it has no case that panics.
fn within(value: i32, limit: i32) -> i32 {
    value.max(limit.wrapping_neg()).min(limit)
}

impl StepDrive {
    /// One tick with the drive on. `speed` has [`SPEED_BITS`] fractional bits.
    pub fn on(&mut self, speed: i64, config: &Config) -> AxisOutputs {
        // Of 48 fractional bits 16 are left: the upper half.
        let wanted = within((speed >> (SPEED_BITS - 16)) as i32, config.fastest);
        // Two rates below 2³⁰ and what lies between them cannot wrap.
        let change = within(wanted.wrapping_sub(self.rate), config.change);
        self.rate = self.rate.wrapping_add(change);
        AxisOutputs { actuation: Actuation::Steps(StepRate(self.rate)), piezo: 0, enable: true }
    }

    /// One tick with the drive off: no torque, no pulses.
    pub fn off(&mut self) -> AxisOutputs {
        self.rate = 0;
        AxisOutputs::OFF
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_and_its_change_are_limited_and_off_is_off_at_once() {
        let config = Config { fastest: 700_000, change: 2000 };
        let mut drive = StepDrive::default();
        let mut last = 0;
        for _ in 0..1000 {
            let Actuation::Steps(StepRate(rate)) = drive.on(i64::MAX / 2, &config).actuation else {
                unreachable!()
            };
            assert!(rate - last <= 2000 && rate <= 700_000);
            last = rate;
        }
        assert_eq!(last, 700_000);
        assert_eq!(drive.off(), AxisOutputs::OFF);
    }
}
