//! Every number of a stage in one place: [`StageSettings`] in the units people use, built once into the integers of
//! the tick. Units enter here and nowhere else.

mod devices;
mod front;

pub use devices::{Analogue, Encoder, Motor};

use crate::front::{self as front_end, emitter};
use crate::plan::Limits;
use crate::plan::ramp::RampLimits;
use crate::servo::SPEED_BITS;
use crate::units::{Counts, Pos};
use crate::{drive, guard, machine::homing, sense, servo};
use core::fmt;

/// What a builder knows of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisSettings {
    /// Travel of one encoder count, after [`decode`](Self::decode), µm; 0.001 … 100.
    pub count_um: f64,
    /// Counts in a signal period of the encoder: 1, 2 or 4.
    pub decode: u8,
    /// A pulse on an encoder line that is shorter than this is no edge, ns; 0 … 2032, and at most half the time between
    /// two edges at the largest speed that the law may ask for. 0: no filter.
    pub filter_ns: u32,
    /// Travel of one step pulse, µm; 0.001 … 100.
    pub step_um: f64,
    /// Lowest target, mm, stage frame; −1000 … 1000.
    pub travel_low_mm: f64,
    /// Highest target, mm, stage frame.
    pub travel_high_mm: f64,
    /// How far the table may lie outside the travel before the stage brakes, mm.
    pub travel_margin_mm: f64,
    /// Largest speed, mm/s.
    pub speed_mm_s: f64,
    /// Largest acceleration, mm/s².
    pub acceleration_mm_s2: f64,
    /// Largest jerk, mm/s³.
    pub jerk_mm_s3: f64,
    /// Proportional gain: mm/s per mm of error, 1/s.
    pub kp_per_s: f64,
    /// Integral gain: mm/s² per mm of error, 1/s².
    pub ki_per_s2: f64,
    /// Derivative gain: mm per mm, no unit.
    pub kd: f64,
    /// Part of the set-point's speed that is fed forward, 0 … 1.
    pub feed_forward: f64,
    /// Error within which a standing axis is left alone, µm.
    pub dead_band_um: f64,
    /// In-position window, ± µm.
    pub in_position_um: f64,
    /// Largest following error, µm; at most 2000, where the servo stops looking.
    pub following_error_um: f64,
    /// Commanded travel without a single count that means a lost encoder, µm.
    pub encoder_lost_um: f64,
    /// Fast loss of steps against the encoder that means a stall, µm; at most 500.
    pub stall_um: f64,
    /// Illegal transitions that are allowed in a block of 256 ticks.
    pub illegal_transitions: u16,
    /// Homing: first approach, mm/s.
    pub home_fast_mm_s: f64,
    /// Homing: second approach and reference mark, mm/s.
    pub home_slow_mm_s: f64,
    /// Homing: farthest way to the switch, mm.
    pub home_search_mm: f64,
    /// Homing: distance to back off beyond the switch, mm.
    pub home_back_off_mm: f64,
    /// Homing: farthest way from the switch to the reference mark, mm.
    pub home_index_search_mm: f64,
    /// Homing: position of the reference mark in the scale frame, mm.
    pub home_index_mm: f64,
    /// A switch is believed pressed after this time, ms.
    pub switch_press_ms: f64,
    /// A switch is believed free after this time, ms; longer than it bounces.
    pub switch_release_ms: f64,
    /// What reads the position.
    pub encoder: Encoder,
    /// What moves the axis.
    pub motor: Motor,
}

/// What a builder knows of a stage.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StageSettings<const N: usize> {
    /// Servo rate, Hz; 1000 … 100 000.
    pub tick_hz: f64,
    /// Time inside the in-position window that means arrival, ms.
    pub dwell_ms: f64,
    /// Time after the end of the path in which arrival must come, ms.
    pub settle_timeout_ms: f64,
    /// Silence of the host after which the stage brakes, ms; 0 never.
    pub host_timeout_ms: f64,
    /// Each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub axes: [AxisSettings; N],
}

/// A setting that no stage can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignError {
    /// Which axis, if the setting belongs to one.
    pub axis: Option<usize>,
    /// Name of the setting.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// What would be accepted.
    pub accepted: &'static str,
    /// The largest value that would be accepted, where that depends on other settings.
    pub at_most: Option<u32>,
}

impl fmt::Display for DesignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(axis) = self.axis {
            write!(f, "axis {}: ", crate::command::axis_name(axis))?;
        }
        // The value is a float, which cannot be written here without a panic path; whoever can, adds it.
        write!(f, "{} is not accepted: it must be {}", self.key, self.accepted)?;
        self.at_most.map_or(Ok(()), |most| write!(f, ", here at most {most}"))
    }
}

impl core::error::Error for DesignError {}

/// An axis as the tick uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisConfig {
    /// For whoever sets up the front end: a board or the twin, at power-on. The tick does not look at it.
    pub front: front_end::Setup,
    /// For [`crate::sense`].
    pub sense: sense::Config,
    /// For [`crate::guard`].
    pub guard: guard::Config,
    /// For [`crate::machine::homing`].
    pub homing: homing::Config,
    /// For [`crate::servo`].
    pub servo: servo::Config,
    /// For [`crate::drive`].
    pub drive: drive::Config,
    /// For gliding without a plan, picometres a tick with [`GLIDE_BITS`] fractional bits.
    pub glide: RampLimits,
    /// For planning.
    pub limits: Limits,
    /// Lowest target, stage frame.
    pub low: Pos,
    /// Highest target, stage frame.
    pub high: Pos,
    /// How far beyond both the table may be before the stage brakes.
    pub margin: Pos,
    /// In-position window.
    pub window: Pos,
}

/// A stage as the tick uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config<const N: usize> {
    /// Each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub axes: [AxisConfig; N],
    /// Ticks in a second.
    pub tick_hz: f64,
    /// Ticks inside the window that mean arrival.
    pub dwell_ticks: u32,
    /// Ticks after the end of the path in which arrival must come.
    pub settle_timeout_ticks: u32,
    /// Ticks of silence after which the stage brakes; 0 never.
    pub host_timeout_ticks: u32,
}

/// Fractional bits of a gliding speed.
pub const GLIDE_BITS: u32 = 16;

const POSITIVE: &str = "a positive number";

impl AxisSettings {
    /// An axis of paper A's size: 0.1 µm counts, 312.5 nm steps, 100 mm, 20 mm/s.
    pub const DEFAULT: Self = Self {
        count_um: 0.1,
        decode: 4,
        filter_ns: 300,
        step_um: 0.3125,
        travel_low_mm: 0.0,
        travel_high_mm: 100.0,
        travel_margin_mm: 0.9,
        speed_mm_s: 20.0,
        acceleration_mm_s2: 500.0,
        jerk_mm_s3: 20_000.0,
        kp_per_s: 60.0,
        ki_per_s2: 800.0,
        kd: 0.0,
        feed_forward: 1.0,
        dead_band_um: 0.2,
        in_position_um: 0.5,
        following_error_um: 150.0,
        encoder_lost_um: 40.0,
        stall_um: 80.0,
        illegal_transitions: 8,
        home_fast_mm_s: 10.0,
        home_slow_mm_s: 0.5,
        home_search_mm: 115.0,
        home_back_off_mm: 0.5,
        home_index_search_mm: 5.0,
        home_index_mm: 0.0,
        switch_press_ms: 0.3,
        switch_release_ms: 5.0,
        encoder: Encoder::Digital,
        motor: Motor::Stepper,
    };
}

impl Default for AxisSettings {
    /// [`AxisSettings::DEFAULT`].
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl<const N: usize> StageSettings<N> {
    /// Axes of paper A's size, 10 kHz.
    pub const DEFAULT: Self = Self {
        tick_hz: 10_000.0,
        dwell_ms: 20.0,
        settle_timeout_ms: 2000.0,
        host_timeout_ms: 0.0,
        axes: [AxisSettings::DEFAULT; N],
    };
}

impl<const N: usize> Default for StageSettings<N> {
    /// [`StageSettings::DEFAULT`].
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl<const N: usize> StageSettings<N> {
    /// Builds the integers of the tick.
    ///
    /// # Errors
    /// Names the first setting that is not a number, has the wrong sign or cannot be represented.
    pub fn build(&self) -> Result<Config<N>, DesignError> {
        check(None, "tick_hz", self.tick_hz, (1000.0..=100_000.0).contains(&self.tick_hz), "1000 … 100000")?;
        for (key, value) in [
            ("dwell_ms", self.dwell_ms),
            ("settle_timeout_ms", self.settle_timeout_ms),
            ("host_timeout_ms", self.host_timeout_ms),
        ] {
            check(None, key, value, (0.0..=1e6).contains(&value), "0 … 1000000")?;
        }
        let longer = self.settle_timeout_ms > self.dwell_ms;
        check(None, "settle_timeout_ms", self.settle_timeout_ms, longer, "longer than dwell_ms")?;
        let ticks = |ms: f64| libm::ceil(ms * 1e-3 * self.tick_hz) as u32;
        for (number, axis) in self.axes.iter().enumerate() {
            axis.check(number)?;
            axis.check_devices(number)?;
            axis.check_front(number)?;
            axis.check_pulses(number, self.tick_hz)?;
            axis.check_gains(number, self.tick_hz)?;
            axis.check_ticks(number, self.tick_hz)?;
        }
        Ok(Config {
            axes: self.axes.map(|axis| axis.build(self.tick_hz)),
            tick_hz: self.tick_hz,
            dwell_ticks: ticks(self.dwell_ms),
            settle_timeout_ticks: ticks(self.settle_timeout_ms),
            host_timeout_ticks: ticks(self.host_timeout_ms),
        })
    }
}

fn check(
    axis: Option<usize>,
    key: &'static str,
    value: f64,
    fine: bool,
    accepted: &'static str,
) -> Result<(), DesignError> {
    if fine { Ok(()) } else { Err(DesignError { axis, key, value, accepted, at_most: None }) }
}

impl AxisSettings {
    fn check(&self, number: usize) -> Result<(), DesignError> {
        let axis = Some(number);
        for (key, value) in [("count_um", self.count_um), ("step_um", self.step_um)] {
            check(axis, key, value, (0.001..=100.0).contains(&value), "0.001 … 100 µm")?;
        }
        for (key, value) in self.positive() {
            check(axis, key, value, value > 0.0 && value <= 1e6, POSITIVE)?;
        }
        for (key, value) in [("kp_per_s", self.kp_per_s), ("ki_per_s2", self.ki_per_s2), ("kd", self.kd)] {
            check(axis, key, value, (0.0..=1e6).contains(&value), "0 … 1000000")?;
        }
        let travel = (-1000.0..=1000.0).contains(&self.travel_low_mm);
        check(axis, "travel_low_mm", self.travel_low_mm, travel, "-1000 … 1000 mm")?;
        let travel = self.travel_high_mm > self.travel_low_mm && self.travel_high_mm <= 1000.0;
        check(axis, "travel_high_mm", self.travel_high_mm, travel, "above travel_low_mm, at most 1000 mm")?;
        let share = (0.0..=1.0).contains(&self.feed_forward);
        check(axis, "feed_forward", self.feed_forward, share, "0 … 1")?;
        let index = (-1000.0..=1000.0).contains(&self.home_index_mm);
        check(axis, "home_index_mm", self.home_index_mm, index, "-1000 … 1000 mm")?;
        let following = self.following_error_um <= 2000.0;
        check(axis, "following_error_um", self.following_error_um, following, "at most 2000 µm")?;
        let stall = self.stall_um <= 500.0;
        check(axis, "stall_um", self.stall_um, stall, "at most 500 µm")?;
        for (key, value) in [("home_fast_mm_s", self.home_fast_mm_s), ("home_slow_mm_s", self.home_slow_mm_s)]
        {
            check(axis, key, value, value <= self.speed_mm_s, "at most speed_mm_s")?;
        }
        let band = (0.0..self.in_position_um).contains(&self.dead_band_um);
        check(axis, "dead_band_um", self.dead_band_um, band, "0 or more, and below in_position_um")
    }

    fn check_devices(&self, number: usize) -> Result<(), DesignError> {
        self.motor.check(number, self.speed_mm_s)?;
        match &self.encoder {
            Encoder::Digital => Ok(()),
            Encoder::Analogue(analogue) => analogue.check(number, self.count_um),
        }
    }

    /// The law may ask for pulses as fast as the drive's limit: the front end must be able to emit them.
    fn check_pulses(&self, number: usize, tick_hz: f64) -> Result<(), DesignError> {
        let fastest = emitter::fastest(emitter::clocks_per_tick(tick_hz)).0;
        let fits = self.motor != Motor::Stepper || self.drive(tick_hz).fastest <= fastest;
        let accepted = "smaller, or step_um larger: 1.2 times this speed needs more step pulses than one each 64 \
                        clocks of 125 MHz";
        check(Some(number), "speed_mm_s", self.speed_mm_s, fits, accepted)
    }

    /// A gain that the servo's integers cannot hold is refused, not clamped.
    fn check_gains(&self, number: usize, tick_hz: f64) -> Result<(), DesignError> {
        let [kp, ki, kd] = self.gains(tick_hz);
        for (key, value, gain) in
            [("kp_per_s", self.kp_per_s, kp), ("ki_per_s2", self.ki_per_s2, ki), ("kd", self.kd, kd)]
        {
            let accepted = "smaller: with this step_um and tick_hz the servo cannot hold it";
            check(Some(number), key, value, gain <= f64::from(i32::MAX), accepted)?;
            let accepted =
                "0 or larger: with this step_um and tick_hz the servo would round it by 5 % or more";
            check(Some(number), key, value, gain == 0.0 || gain >= 10.0, accepted)?;
        }
        Ok(())
    }

    /// Durations and accelerations that the integers of plan and ramp cannot hold are refused, not clamped.
    fn check_ticks(&self, number: usize, tick_hz: f64) -> Result<(), DesignError> {
        let axis = Some(number);
        let (v, a, j) = (self.speed_mm_s, self.acceleration_mm_s2, self.jerk_mm_s3);
        let accepted = "larger: its phase would be longer than 65536 ticks";
        check(axis, "jerk_mm_s3", j, a / j * tick_hz <= 65_536.0, accepted)?;
        let accepted = "larger: full speed would be reached after more than 262144 ticks";
        check(axis, "acceleration_mm_s2", a, v / a * tick_hz <= 262_144.0, accepted)?;
        // The diagonal of a square travel is the longest way.
        let way = 1.5 * (self.travel_high_mm - self.travel_low_mm);
        let accepted = "larger: a move over the travel would take more than 16777216 ticks";
        check(axis, "speed_mm_s", v, way / v * tick_hz <= 16_777_216.0, accepted)?;
        let limits = self.limits(tick_hz);
        let accepted = "smaller, or tick_hz larger: its part of a tick does not fit the ramp";
        check(axis, "acceleration_mm_s2", a, glide(limits.acceleration) <= 1 << 31, accepted)?;
        check(axis, "jerk_mm_s3", j, glide(limits.jerk) <= 1 << 31, accepted)
    }

    /// Kp, Ki, Kd as speeds of the servo per picometre.
    fn gains(&self, tick_hz: f64) -> [f64; 3] {
        let one = self.pulse_speed();
        [self.kp_per_s * one / tick_hz, self.ki_per_s2 * one / (tick_hz * tick_hz), self.kd * one]
    }

    /// Speed in step pulses a tick, as the servo writes it, for one picometre a tick.
    fn pulse_speed(&self) -> f64 {
        libm::ldexp(1.0, SPEED_BITS as i32) / (self.step_um * crate::units::PM_PER_UM)
    }

    fn positive(&self) -> [(&'static str, f64); 16] {
        [
            ("travel_margin_mm", self.travel_margin_mm),
            ("speed_mm_s", self.speed_mm_s),
            ("acceleration_mm_s2", self.acceleration_mm_s2),
            ("jerk_mm_s3", self.jerk_mm_s3),
            ("in_position_um", self.in_position_um),
            ("following_error_um", self.following_error_um),
            ("encoder_lost_um", self.encoder_lost_um),
            ("stall_um", self.stall_um),
            ("home_fast_mm_s", self.home_fast_mm_s),
            ("home_slow_mm_s", self.home_slow_mm_s),
            ("home_search_mm", self.home_search_mm),
            ("home_back_off_mm", self.home_back_off_mm),
            ("home_index_search_mm", self.home_index_search_mm),
            ("switch_press_ms", self.switch_press_ms),
            ("switch_release_ms", self.switch_release_ms),
            ("illegal_transitions", f64::from(self.illegal_transitions)),
        ]
    }

    fn build(&self, tick_hz: f64) -> AxisConfig {
        let (low, high) = (Pos::from_mm(self.travel_low_mm), Pos::from_mm(self.travel_high_mm));
        let limits = self.limits(tick_hz);
        AxisConfig {
            front: self.front(),
            sense: self.sense(tick_hz),
            guard: self.guard(),
            homing: self.homing(tick_hz),
            servo: self.servo(tick_hz),
            drive: self.drive(tick_hz),
            glide: RampLimits::new(glide(limits.acceleration), glide(limits.jerk)),
            limits,
            low,
            high,
            margin: Pos::from_mm(self.travel_margin_mm),
            window: Pos::from_um(self.in_position_um),
        }
    }

    /// What a DC motor is told shows an encoder that does not move at all, but not how far it should have: friction eats
    /// from it, and a stall is a following error.
    fn guard(&self) -> guard::Config {
        let stepper = self.motor == Motor::Stepper;
        let lost = libm::floor(self.encoder_lost_um / self.step_um) as u32;
        guard::Config {
            following_error: Pos::from_um(self.following_error_um),
            encoder_lost_pulses: lost,
            stall_pm: if stepper { Pos::from_um(self.stall_um).pm() as u32 } else { u32::MAX },
            step: guard::Travel::of(Pos::from_um(self.step_um).pm() as i32),
            count: guard::Travel::of(Pos::from_um(self.count_um).pm() as i32),
            illegal_transitions: self.illegal_transitions,
        }
    }

    fn sense(&self, tick_hz: f64) -> sense::Config {
        let ticks = |ms: f64| libm::ceil(ms * 1e-3 * tick_hz).clamp(1.0, 65_535.0) as u16;
        sense::Config {
            count_pm: Pos::from_um(self.count_um).pm() as i32,
            switch_press_ticks: ticks(self.switch_press_ms),
            switch_release_ticks: ticks(self.switch_release_ms),
            head: match &self.encoder {
                Encoder::Digital => None,
                Encoder::Analogue(analogue) => Some(analogue.build()),
            },
        }
    }

    fn limits(&self, tick_hz: f64) -> Limits {
        let pm = |mm: f64| mm * crate::units::PM_PER_MM;
        Limits {
            speed: pm(self.speed_mm_s) / tick_hz,
            acceleration: pm(self.acceleration_mm_s2) / (tick_hz * tick_hz),
            jerk: pm(self.jerk_mm_s3) / (tick_hz * tick_hz * tick_hz),
        }
    }

    fn homing(&self, tick_hz: f64) -> homing::Config {
        let speed = |mm_s: f64| glide(mm_s * crate::units::PM_PER_MM / tick_hz);
        homing::Config {
            fast: speed(self.home_fast_mm_s),
            slow: speed(self.home_slow_mm_s),
            search: Pos::from_mm(self.home_search_mm),
            back_off: Pos::from_mm(self.home_back_off_mm),
            index_search: Pos::from_mm(self.home_index_search_mm),
            zero_from_index: Counts::new(libm::round(-self.home_index_mm * 1e3 / self.count_um) as i64),
        }
    }

    fn servo(&self, tick_hz: f64) -> servo::Config {
        let one = self.pulse_speed();
        let [kp, ki, kd] = self.gains(tick_hz).map(|gain| libm::round(gain) as i32);
        let fastest = self.motor.fastest_mm_s(self.speed_mm_s) * crate::units::PM_PER_MM / tick_hz;
        servo::Config {
            kp,
            ki,
            kd,
            feed_forward: libm::round(self.feed_forward * one) as i64,
            limit: libm::round(fastest * one) as i64,
            dead_band: Pos::from_um(self.dead_band_um),
        }
    }

    fn drive(&self, tick_hz: f64) -> drive::Config {
        let pulses = |mm: f64| mm * 1e3 / self.step_um * 65_536.0;
        let fastest = pulses(self.motor.fastest_mm_s(self.speed_mm_s)) / tick_hz;
        let change = pulses(3.0 * self.acceleration_mm_s2) / (tick_hz * tick_hz);
        drive::Config {
            fastest: fastest.clamp(1.0, 2_147_483_647.0) as i32,
            change: change.clamp(1.0, 2_147_483_647.0) as i32,
            stage: match self.motor {
                Motor::Stepper => drive::PowerStage::Steps,
                Motor::Dc { full_speed_mm_s, friction_mm_s } => {
                    let whole = |value: f64, least| libm::round(value).clamp(least, 2_147_483_647.0) as i32;
                    let duty = 32_768.0 * self.step_um * 1e-3 * tick_hz / full_speed_mm_s;
                    drive::PowerStage::Pwm {
                        duty: whole(duty, 1.0),
                        held: whole(pulses(friction_mm_s) / tick_hz, 0.0),
                    }
                }
            },
        }
    }
}

/// Picometres a tick (or tick², tick³) as a gliding speed.
fn glide(pm: f64) -> i64 {
    libm::round(libm::ldexp(pm, GLIDE_BITS as i32)).clamp(1.0, 9e15) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    type Spoil = fn(&mut StageSettings<2>);

    #[test]
    fn the_default_stage_builds_and_bad_settings_are_named() {
        let good = StageSettings::<2>::default();
        assert!(good.build().is_ok());
        let cases: [(&str, Spoil); 14] = [
            ("stall_um", |s| s.axes[0].stall_um = 501.0),
            ("tick_hz", |s| s.tick_hz = 999.0),
            ("speed_mm_s", |s| s.axes[1].step_um = 0.012),
            ("acceleration_mm_s2", |s| s.tick_hz = 1000.0),
            ("speed_mm_s", |s| {
                s.axes[0].speed_mm_s = 0.05;
                s.axes[0].home_fast_mm_s = 0.05;
                s.axes[0].home_slow_mm_s = 0.01;
            }),
            ("ki_per_s2", |s| s.axes[0].ki_per_s2 = 0.05),
            ("jerk_mm_s3", |s| s.axes[1].jerk_mm_s3 = f64::NAN),
            ("tick_hz", |s| s.tick_hz = -1.0),
            ("kp_per_s", |s| s.axes[0].kp_per_s = 30_000.0),
            ("kd", |s| s.axes[0].kd = 3.0),
            ("settle_timeout_ms", |s| s.settle_timeout_ms = 10.0),
            ("home_fast_mm_s", |s| s.axes[0].home_fast_mm_s = 21.0),
            ("following_error_um", |s| s.axes[0].following_error_um = 2500.0),
            ("dead_band_um", |s| s.axes[0].dead_band_um = 0.5),
        ];
        for (key, spoil) in cases {
            let mut bad = good;
            spoil(&mut bad);
            let error = bad.build().unwrap_err();
            assert_eq!(error.key, key, "{error}");
        }
    }
}
