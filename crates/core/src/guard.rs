//! Guard: judges safety before anything is decided.
//!
//! Each trip has a name, a limit in the configuration and a way to stop (see [`crate::machine`]).

use crate::edge::Inputs;
use crate::publish::{End, Fault};
use crate::sense::Sensed;
use crate::units::Pos;

/// Limits of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// Lowest place of the table while homed, stage frame, outside of which the stage brakes.
    pub low: Pos,
    /// Highest place of the table while homed, stage frame.
    pub high: Pos,
    /// Largest distance between set-point and reading.
    pub following_error: Pos,
    /// Commanded travel during which the encoder stands still to the count, at which it is taken for lost.
    pub encoder_lost: Pos,
    /// Loss of steps against the encoder, faster than about 4096 ticks, at which the motor is taken for stalled.
    pub stall: Pos,
    /// Travel of one step pulse, picometres.
    pub step_pm: i64,
    /// Travel of one count, picometres.
    pub count_pm: i64,
    /// Illegal transitions that the encoder may show in a block of 256 ticks.
    pub illegal_transitions: u16,
}

/// What the guard must know of an axis besides its sensors.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    /// Set-point of the last tick, scale frame.
    pub set_point: Pos,
    /// Where the table is now, stage frame.
    pub place: Pos,
    /// The drive is on.
    pub on: bool,
    /// Switches and the zero are being looked for: travel limits do not hold yet.
    pub homing: bool,
    /// The zero is known.
    pub homed: bool,
}

/// What guarding an axis remembers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guard {
    /// Pulses when the encoder last moved.
    pulses_at_motion: i32,
    /// Pulses of the last tick, to see what was commanded since.
    last_pulses: Option<i32>,
    /// Commanded minus measured travel, against its own slow mean: screw pitch and scale errors are slow, steps are
    /// lost fast.
    slip_pm: i64,
    illegal: u16,
    ticks: u8,
    /// The high switch has been free since homing began: pressed again, it is no longer the one homing came from.
    left_high: bool,
}

impl Guard {
    /// Judges one axis; the first trip found is returned.
    pub fn judge(&mut self, axis: usize, sensed: &Sensed, watch: &Watch, config: &Config) -> Option<Fault> {
        let slip = self.slip(sensed, config);
        let frozen = self.frozen(sensed, config);
        let illegal = self.count_illegal(sensed);
        if sensed.drive_fault {
            return Some(Fault::DriveFault { axis });
        }
        if illegal > config.illegal_transitions {
            return Some(Fault::EncoderIllegal { axis, transitions: illegal });
        }
        if !watch.on {
            self.forget(sensed);
            return None;
        }
        if frozen > config.encoder_lost {
            return Some(Fault::EncoderLost { axis });
        }
        if slip > config.stall {
            return Some(Fault::Stall { axis });
        }
        let error = watch.set_point - sensed.position;
        if error.abs() > config.following_error {
            return Some(Fault::FollowingError { axis, error });
        }
        self.travel(axis, sensed, watch, config)
    }

    /// Commanded travel since the encoder last moved.
    fn frozen(&mut self, sensed: &Sensed, config: &Config) -> Pos {
        if sensed.moved != 0 {
            self.pulses_at_motion = sensed.pulses;
        }
        let pulses = i64::from(sensed.pulses.wrapping_sub(self.pulses_at_motion));
        Pos::from_pm(pulses.saturating_mul(config.step_pm)).abs()
    }

    /// Commanded minus measured travel with its slow part (time constant 4096 ticks) taken away.
    fn slip(&mut self, sensed: &Sensed, config: &Config) -> Pos {
        let last = self.last_pulses.replace(sensed.pulses).unwrap_or(sensed.pulses);
        let commanded = i64::from(sensed.pulses.wrapping_sub(last)).saturating_mul(config.step_pm);
        let measured = sensed.moved.saturating_mul(config.count_pm);
        let slip = self.slip_pm.saturating_add(commanded).saturating_sub(measured);
        self.slip_pm = slip.saturating_sub(slip >> 12);
        Pos::from_pm(self.slip_pm).abs()
    }

    /// Illegal transitions since the running block of 256 ticks began.
    fn count_illegal(&mut self, sensed: &Sensed) -> u16 {
        self.illegal = self.illegal.saturating_add(sensed.illegal);
        let count = self.illegal;
        self.ticks = self.ticks.wrapping_add(1);
        if self.ticks == 0 {
            self.illegal = 0;
        }
        count
    }

    /// A stage without torque may be pushed by hand: nothing of it is slip.
    fn forget(&mut self, sensed: &Sensed) {
        self.slip_pm = 0;
        self.pulses_at_motion = sensed.pulses;
    }

    fn travel(&mut self, axis: usize, sensed: &Sensed, watch: &Watch, config: &Config) -> Option<Fault> {
        let at = |end| Some(Fault::LimitSwitch { axis, end });
        let came_from_high = watch.homing && !self.left_high;
        self.left_high = watch.homing && (self.left_high || !sensed.limit_high);
        if watch.homing {
            // The low switch is what homing looks for, and it may begin on the high one.
            return if sensed.limit_high && !came_from_high { at(End::High) } else { None };
        }
        if sensed.limit_low {
            return at(End::Low);
        }
        if sensed.limit_high {
            return at(End::High);
        }
        let position = watch.place;
        let outside = position < config.low || position > config.high;
        (watch.homed && outside).then_some(Fault::SoftLimit { axis, position })
    }
}

/// Judges what belongs to no axis. `expected_tick` is the number this tick should have.
pub fn judge_shared<const N: usize>(
    inputs: &Inputs<N>,
    expected_tick: Option<u32>,
    host_timeout_ticks: u32,
) -> Option<Fault> {
    if inputs.emergency_stop {
        return Some(Fault::EmergencyStop);
    }
    let missed = expected_tick.map_or(0, |expected| inputs.tick.wrapping_sub(expected));
    if missed != 0 {
        return Some(Fault::TickOverrun { missed });
    }
    let gone = host_timeout_ticks != 0 && inputs.heartbeat_age > host_timeout_ticks;
    gone.then_some(Fault::HostGone)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: Config = Config {
        low: Pos::from_pm(-900_000_000),
        high: Pos::from_pm(100_900_000_000),
        following_error: Pos::from_pm(150_000_000),
        encoder_lost: Pos::from_pm(40_000_000),
        stall: Pos::from_pm(80_000_000),
        step_pm: 312_500,
        count_pm: 100_000,
        illegal_transitions: 8,
    };
    const WATCH: Watch =
        Watch { set_point: Pos::ZERO, place: Pos::ZERO, on: true, homing: false, homed: true };

    /// The first trip of an axis that shows this tick after tick.
    fn trip(ticks: i32, sensed: impl Fn(i32) -> Sensed, watch: &Watch) -> Option<Fault> {
        let mut guard = Guard::default();
        (0..ticks).find_map(|tick| guard.judge(0, &sensed(tick), watch, &CONFIG))
    }

    fn at_rest(_: i32) -> Sensed {
        Sensed::default()
    }

    #[test]
    fn a_quiet_axis_never_trips() {
        assert_eq!(trip(10_000, at_rest, &WATCH), None);
    }

    #[test]
    fn each_limit_trips_beyond_it_and_not_at_it() {
        let watch = |set_point| Watch { set_point, ..WATCH };
        assert_eq!(trip(5, at_rest, &watch(CONFIG.following_error)), None);
        let error = CONFIG.following_error + Pos::from_pm(1);
        assert_eq!(trip(5, at_rest, &watch(error)), Some(Fault::FollowingError { axis: 0, error }));
        let watch = |place| Watch { place, ..WATCH };
        for end in [CONFIG.low, CONFIG.high] {
            assert_eq!(trip(5, at_rest, &watch(end)), None);
        }
        for position in [CONFIG.low - Pos::from_pm(1), CONFIG.high + Pos::from_pm(1)] {
            assert_eq!(trip(5, at_rest, &watch(position)), Some(Fault::SoftLimit { axis: 0, position }));
            assert_eq!(trip(5, at_rest, &Watch { homed: false, ..watch(position) }), None);
            assert_eq!(trip(5, at_rest, &Watch { homing: true, ..watch(position) }), None);
        }
    }

    #[test]
    fn illegal_transitions_trip_on_or_off() {
        let disturbed = |tick| Sensed { illegal: u16::from(tick < 9), ..Sensed::default() };
        let fault = Some(Fault::EncoderIllegal { axis: 0, transitions: 9 });
        assert_eq!(trip(50, disturbed, &WATCH), fault);
        assert_eq!(trip(50, disturbed, &Watch { on: false, ..WATCH }), fault);
        let seldom = |tick| Sensed { illegal: u16::from(tick % 64 == 0), ..Sensed::default() };
        assert_eq!(trip(5000, seldom, &WATCH), None);
    }

    #[test]
    fn pulses_without_counts_are_a_lost_encoder_and_with_too_few_a_stall() {
        let frozen = |tick| Sensed { pulses: tick, ..Sensed::default() };
        assert_eq!(trip(128, frozen, &WATCH), None);
        assert_eq!(trip(140, frozen, &WATCH), Some(Fault::EncoderLost { axis: 0 }));
        let slipping = |tick| Sensed { pulses: 2 * tick, moved: 1, ..Sensed::default() };
        assert_eq!(trip(400, slipping, &WATCH), Some(Fault::Stall { axis: 0 }));
        // 312.5 nm and 3.125 counts a pulse, as it should be: 25 counts for 8 pulses.
        let sound = |tick: i32| Sensed {
            pulses: tick,
            moved: i64::from((tick + 1) * 25 / 8 - tick * 25 / 8),
            ..Sensed::default()
        };
        assert_eq!(trip(100_000, sound, &WATCH), None);
        assert_eq!(trip(400, frozen, &Watch { on: false, ..WATCH }), None);
    }

    #[test]
    fn switches_trip_in_motion_and_lead_homing() {
        let low = |_| Sensed { limit_low: true, ..Sensed::default() };
        let high = |_| Sensed { limit_high: true, ..Sensed::default() };
        let homing = Watch { homing: true, ..WATCH };
        assert_eq!(trip(1, low, &WATCH), Some(Fault::LimitSwitch { axis: 0, end: End::Low }));
        assert_eq!(trip(1, high, &WATCH), Some(Fault::LimitSwitch { axis: 0, end: End::High }));
        assert_eq!(trip(9, low, &homing), None);
        // Homing may begin on the high switch, but not come back to it.
        assert_eq!(trip(9, high, &homing), None);
        let comes_back = |tick| Sensed { limit_high: tick != 4, ..Sensed::default() };
        assert_eq!(trip(9, comes_back, &homing), Some(Fault::LimitSwitch { axis: 0, end: End::High }));
    }

    #[test]
    fn a_cut_comes_before_a_brake() {
        let (brake, cut) = (Fault::HostGone, Fault::DriveFault { axis: 1 });
        assert_eq!(Fault::worse(Some(brake), Some(cut)), Some(cut));
        assert_eq!(Fault::worse(Some(cut), Some(brake)), Some(cut));
        assert_eq!(Fault::worse(None, Some(brake)), Some(brake));
        assert_eq!(Fault::worse(Some(cut), None), Some(cut));
    }
}
