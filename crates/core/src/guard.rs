//! Guard: judges safety before anything is decided.
//!
//! Each trip has a name, a limit in the configuration and a way to stop (see [`crate::machine`]).

use crate::edge::Inputs;
use crate::publish::{End, Fault};
use crate::sense::Sensed;
use crate::units::Pos;
use crate::wide;

/// Limits of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// Largest distance between set-point and reading.
    pub following_error: Pos,
    /// Step pulses commanded while the encoder stands still to the count, at which it is taken for lost; `u32::MAX`: never.
    pub encoder_lost_pulses: u32,
    /// Loss of steps against the encoder, faster than about 4096 ticks, at which the motor is taken for stalled,
    /// picometres; at most [`MOST_PM`], or `u32::MAX`: never.
    pub stall_pm: u32,
    /// Travel of a step pulse.
    pub step: Travel,
    /// Travel of a count.
    pub count: Travel,
    /// Illegal transitions that the encoder may show in a block of 256 ticks.
    pub illegal_transitions: u16,
}

/// Travels of a tick that the guard tells apart, picometres: half a millimetre, 5 m/s at 10 kHz.
pub const MOST_PM: i32 = 500_000_000;

/// Counts that are no motion: a line that floats at an edge trembles by one, and back.
const TREMBLES: u32 = 1;

/// What one pulse or count is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Travel {
    unit_pm: i32,
    /// So many are [`MOST_PM`] or a little less.
    most: i32,
}

impl Travel {
    /// `unit_pm` picometres each, at least 1.
    pub const fn of(unit_pm: i32) -> Self {
        let unit_pm = if unit_pm < 1 { 1 } else { unit_pm };
        let most = match MOST_PM.checked_div(unit_pm) {
            Some(most) => most,
            None => 0,
        };
        Self { unit_pm, most }
    }

    /// The travel of `number` of them, ±[`MOST_PM`] at most.
    #[inline]
    fn pm(self, number: i32) -> i32 {
        number.min(self.most).max(self.most.wrapping_neg()).wrapping_mul(self.unit_pm)
    }
}

/// What the guard must know of an axis besides its sensors.
#[derive(Clone, Copy, Debug)]
pub struct Watch<'a> {
    /// Set-point of the last tick, scale frame.
    pub set_point: Pos,
    /// Readings at which the table is at the lowest and at the highest place it may be while homed; outside of them
    /// the stage brakes.
    pub travel: &'a [Pos; 2],
    /// The drive is on.
    pub on: bool,
    /// Switches and the zero are being looked for: travel limits do not hold yet.
    pub homing: bool,
    /// The zero is known.
    pub homed: bool,
}

/// What guarding an axis remembers.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Guard {
    /// Pulses when the encoder last moved.
    pulses_at_motion: i32,
    /// Counts since then.
    counts_since: i32,
    /// Pulses of the last tick, to see what was commanded since.
    last_pulses: i32,
    /// Commanded minus measured travel, against its own slow mean: screw pitch and scale errors are slow, steps are
    /// lost fast.
    slip_pm: i32,
    illegal: u16,
    ticks: u8,
    /// The high switch has been free since homing began: pressed again, it is no longer the one homing came from.
    left_high: bool,
}

impl Guard {
    /// Judges one axis; the first trip found is returned. The place of a soft limit is the reading.
    #[inline]
    pub fn judge(
        &mut self,
        axis: usize,
        sensed: &Sensed,
        watch: &Watch<'_>,
        config: &Config,
    ) -> Option<Fault> {
        let illegal = self.count_illegal(sensed);
        if sensed.drive_fault {
            return Some(Fault::DriveFault { axis });
        }
        if let Some(what) = sensed.signal {
            return Some(Fault::Signal { axis, what });
        }
        if illegal > config.illegal_transitions {
            return Some(Fault::EncoderIllegal { axis, transitions: illegal });
        }
        if !watch.on {
            self.forget(sensed);
            return None;
        }
        let slip_pm = self.slip_pm(sensed, config);
        if self.frozen(sensed) > config.encoder_lost_pulses {
            return Some(Fault::EncoderLost { axis });
        }
        if slip_pm > config.stall_pm {
            return Some(Fault::Stall { axis });
        }
        let error = watch.set_point.way_from(sensed.position);
        if !wide::is_within(error, config.following_error.pm()) {
            return Some(Fault::FollowingError { axis, error: Pos::from_pm(error) });
        }
        self.travel(axis, sensed, watch)
    }

    /// Pulses commanded since the encoder last moved.
    fn frozen(&mut self, sensed: &Sensed) -> u32 {
        self.counts_since = self.counts_since.wrapping_add(sensed.moved);
        if self.counts_since.unsigned_abs() > TREMBLES {
            self.pulses_at_motion = sensed.pulses;
            self.counts_since = 0;
        }
        sensed.pulses.wrapping_sub(self.pulses_at_motion).unsigned_abs()
    }

    /// Commanded minus measured travel with its slow part (time constant 4096 ticks) taken away.
    fn slip_pm(&mut self, sensed: &Sensed, config: &Config) -> u32 {
        let pulses = sensed.pulses.wrapping_sub(self.last_pulses);
        self.last_pulses = sensed.pulses;
        // Three times half a millimetre fits a word.
        let lost = config.step.pm(pulses).wrapping_sub(config.count.pm(sensed.moved));
        let slip = self.slip_pm.wrapping_add(lost);
        self.slip_pm = slip.wrapping_sub(slip >> 12).min(MOST_PM).max(MOST_PM.wrapping_neg());
        self.slip_pm.unsigned_abs()
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
        self.counts_since = 0;
        self.last_pulses = sensed.pulses;
    }

    fn travel(&mut self, axis: usize, sensed: &Sensed, watch: &Watch<'_>) -> Option<Fault> {
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
        let position = sensed.position;
        let [low, high] = watch.travel;
        let outside = position < *low || position > *high;
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
        following_error: Pos::from_pm(150_000_000),
        encoder_lost_pulses: 128,
        stall_pm: 80_000_000,
        step: Travel::of(312_500),
        count: Travel::of(100_000),
        illegal_transitions: 8,
    };
    const TRAVEL: [Pos; 2] = [Pos::from_pm(-900_000_000), Pos::from_pm(100_900_000_000)];
    const WATCH: Watch<'static> =
        Watch { set_point: Pos::ZERO, travel: &TRAVEL, on: true, homing: false, homed: true };

    /// The first trip of an axis that shows this tick after tick.
    fn trip(ticks: i32, sensed: impl Fn(i32) -> Sensed, watch: &Watch<'_>) -> Option<Fault> {
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
        // The set-point goes along.
        let at = |position| move |_| Sensed { position, ..Sensed::default() };
        let [low, high] = TRAVEL;
        for end in TRAVEL {
            assert_eq!(trip(5, at(end), &watch(end)), None);
        }
        for position in [low - Pos::from_pm(1), high + Pos::from_pm(1)] {
            let watch = watch(position);
            assert_eq!(trip(5, at(position), &watch), Some(Fault::SoftLimit { axis: 0, position }));
            assert_eq!(trip(5, at(position), &Watch { homed: false, ..watch }), None);
            assert_eq!(trip(5, at(position), &Watch { homing: true, ..watch }), None);
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
        let trembling =
            |tick| Sensed { pulses: tick, moved: if tick % 2 == 0 { 1 } else { -1 }, ..Sensed::default() };
        assert_eq!(trip(140, trembling, &WATCH), Some(Fault::EncoderLost { axis: 0 }));
        let slipping = |tick| Sensed { pulses: 2 * tick, moved: 1, ..Sensed::default() };
        assert_eq!(trip(400, slipping, &WATCH), Some(Fault::Stall { axis: 0 }));
        // 312.5 nm and 3.125 counts a pulse, as it should be: 25 counts for 8 pulses.
        let sound = |tick: i32| Sensed {
            pulses: tick,
            moved: (tick + 1) * 25 / 8 - tick * 25 / 8,
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
