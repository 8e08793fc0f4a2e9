//! Drive: turns the speed of the law into what the power stage is told.

use crate::edge::{Actuation, AxisOutputs, StepRate};
use crate::servo::SPEED_BITS;
use crate::wide;

/// Limits of a drive; rates are step pulses a tick with 16 fractional bits, from 0 on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// Largest rate; below 2³⁰, which is far more than can be emitted.
    pub fastest: i32,
    /// Largest change of rate in a tick: a stepper that is asked for more loses steps.
    pub change: i32,
    /// What the power stage wants.
    pub stage: PowerStage,
}

/// What a power stage wants to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PowerStage {
    /// Step pulses.
    Steps,
    /// The duty of an H-bridge. A DC motor on a voltage goes about as fast as the voltage says, so the rate becomes one.
    Pwm {
        /// Duty, full scale 2¹⁵, of one pulse a tick.
        duty: i32,
    },
}

/// What a drive remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Drive {
    rate: i32,
}

/// Full duty.
const FULL: i64 = 32_767;

/// A value within ± `limit`, which is 0 or more. Unlike `clamp` it has no case that panics.
fn within(value: i32, limit: i32) -> i32 {
    value.max(limit.wrapping_neg()).min(limit)
}

impl Drive {
    /// One tick with the drive on. `speed` has [`SPEED_BITS`] fractional bits.
    pub fn on(&mut self, speed: i64, config: &Config) -> AxisOutputs {
        // Of 48 fractional bits 16 are left: the upper half.
        let wanted = within((speed >> (SPEED_BITS - 16)) as i32, config.fastest);
        // Two rates below 2³⁰ and what lies between them cannot wrap.
        let change = within(wanted.wrapping_sub(self.rate), config.change);
        self.rate = self.rate.wrapping_add(change);
        let actuation = match config.stage {
            PowerStage::Steps => Actuation::Steps(StepRate(self.rate)),
            PowerStage::Pwm { duty } => pwm(self.rate, duty),
        };
        AxisOutputs { actuation, piezo: 0, enable: true }
    }

    /// One tick with the drive off: no torque, no pulses.
    pub fn off(&mut self) -> AxisOutputs {
        self.rate = 0;
        AxisOutputs::OFF
    }
}

/// Out of line: a stepper's tick need not carry the product.
#[inline(never)]
fn pwm(rate: i32, duty: i32) -> Actuation {
    let duty = wide::mul_i32(rate, duty) >> 16;
    Actuation::Pwm(duty.min(FULL).max(FULL.wrapping_neg()) as i16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_and_its_change_are_limited_and_off_is_off_at_once() {
        let config = Config { fastest: 700_000, change: 2000, stage: PowerStage::Steps };
        let mut drive = Drive::default();
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

    #[test]
    fn a_bridge_gets_the_rate_as_a_duty_and_never_more_than_all() {
        // Ten pulses a tick are full speed.
        let stage = PowerStage::Pwm { duty: 3277 };
        let config = Config { fastest: 1 << 29, change: 1 << 29, stage };
        let duty = |pulses: f64| {
            let speed = libm::round(libm::ldexp(pulses, SPEED_BITS as i32)) as i64;
            Drive::default().on(speed, &config).actuation
        };
        assert_eq!(duty(5.0), Actuation::Pwm(16_385));
        assert_eq!(duty(-2.5), Actuation::Pwm(-8193));
        assert_eq!([duty(11.0), duty(-11.0)], [32_767, -32_767].map(Actuation::Pwm));
    }
}
