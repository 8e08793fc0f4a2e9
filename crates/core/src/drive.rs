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
        /// Rate up to which friction may hold the axis, from 0 on.
        held: i32,
    },
}

/// What a drive remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Drive {
    rate: i32,
    /// What a DC motor was told to go, at rates that friction cannot hold: pulses, and their 16 fractional bits.
    told: i32,
    part: u16,
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
            PowerStage::Pwm { .. } => self.bridge(&config.stage),
        };
        AxisOutputs { actuation, piezo: 0, enable: true }
    }

    /// Pulses that a DC motor should at least have gone; wraps. A stepper's are counted where they are emitted: always 0.
    ///
    /// A motor on a voltage goes slower than it is told, by what friction takes, but it goes. If the encoder shows none of
    /// it, motor and encoder have parted: [`crate::guard`] looks for that as it does with step pulses.
    #[inline]
    pub fn told(&self) -> i32 {
        self.told
    }

    /// Out of line: a stepper's tick need not carry the product.
    #[inline(never)]
    fn bridge(&mut self, stage: &PowerStage) -> Actuation {
        let PowerStage::Pwm { duty, held } = *stage else { return Actuation::Pwm(0) };
        if within(self.rate, held) != self.rate {
            let part = self.rate.wrapping_add(i32::from(self.part));
            self.told = self.told.wrapping_add(part >> 16);
            self.part = part as u16;
        }
        let duty = wide::mul_i32(self.rate, duty) >> 16;
        Actuation::Pwm(duty.min(FULL).max(FULL.wrapping_neg()) as i16)
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
        let stage = PowerStage::Pwm { duty: 3277, held: 0 };
        let config = Config { fastest: 1 << 29, change: 1 << 29, stage };
        let duty = |pulses: f64| {
            let speed = libm::round(libm::ldexp(pulses, SPEED_BITS as i32)) as i64;
            Drive::default().on(speed, &config).actuation
        };
        assert_eq!(duty(5.0), Actuation::Pwm(16_385));
        assert_eq!(duty(-2.5), Actuation::Pwm(-8193));
        assert_eq!([duty(11.0), duty(-11.0)], [32_767, -32_767].map(Actuation::Pwm));
    }

    #[test]
    fn what_friction_may_hold_is_not_told_and_all_else_is_to_the_last_part() {
        // Pulses a tick: 2.5 to hold.
        let stage = PowerStage::Pwm { duty: 3277, held: 5 << 15 };
        let config = Config { fastest: 1 << 29, change: 1 << 29, stage };
        for (pulses, told) in [(2.5, 0), (-2.0, 0), (3.0, 3000), (-3.0, -3000), (2.5 + 1.0 / 1024.0, 2500)] {
            let mut drive = Drive::default();
            let speed = libm::round(libm::ldexp(pulses, SPEED_BITS as i32)) as i64;
            (0..1000).for_each(|_| _ = drive.on(speed, &config));
            assert_eq!(drive.told(), told, "{pulses}");
            (0..1000).for_each(|_| _ = drive.on(-speed, &config));
            assert_eq!((drive.told(), drive.part), (0, 0), "{pulses}");
        }
    }
}
