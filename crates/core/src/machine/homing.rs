//! Homing of one axis (row B9): fast to the switch, back off, slowly to the switch, back off to the reference mark.
//!
//! The zero is the reference mark, always passed in the same direction at the same low speed, so that lost motion
//! and elasticity do not spoil it. It lies at the low end: positions stay positive.

use crate::publish::HomingFailure;
use crate::sense::Sensed;
use crate::units::{Counts, Pos};
use crate::wide;

/// How an axis homes. Speeds are picometres a tick with 16 fractional bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// Speed of the first approach.
    pub fast: i64,
    /// Speed of the second approach and over the reference mark.
    pub slow: i64,
    /// Farthest way to the switch.
    pub search: Pos,
    /// How far beyond the switch's release to back off before the slow approach.
    pub back_off: Pos,
    /// Farthest way from the switch to the reference mark.
    pub index_search: Pos,
    /// Position of the zero from the reference mark.
    pub zero_from_index: Counts,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Phase {
    SeekFast,
    BackOff,
    SeekSlow,
    SeekIndex,
    Done,
}

/// What homing found on an axis, extended counts from power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Found {
    /// The zero.
    pub zero: Counts,
    /// Where the switch closed on the slow approach.
    pub switch: Counts,
}

/// The homing of one axis under way.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Homing {
    phase: Phase,
    /// Where the phase began.
    began: Pos,
    /// Where the switch was last seen pressed, while backing off.
    released: Pos,
    /// The speed of the phase.
    speed: i64,
    found: Found,
}

impl Homing {
    /// Begins where the axis stands; from a pressed switch it backs off first.
    pub fn new(sensed: &Sensed, config: &Config) -> Self {
        let phase = if sensed.limit_low { Phase::BackOff } else { Phase::SeekFast };
        let mut homing =
            Self { phase, began: Pos::ZERO, released: Pos::ZERO, speed: 0, found: Found::default() };
        homing.enter(phase, sensed, config);
        homing
    }

    /// What was found, once it is.
    pub fn found(&self) -> Option<Found> {
        self.is_done().then_some(self.found)
    }

    /// Whether the zero is found.
    pub fn is_done(&self) -> bool {
        self.phase == Phase::Done
    }

    /// Takes one tick; returns the speed wanted now (picometres a tick, 16 fractional bits).
    ///
    /// # Errors
    /// When the switch or the mark is not found within its distance.
    pub fn tick(&mut self, sensed: &Sensed, config: &Config) -> Result<i64, HomingFailure> {
        let gone = sensed.position.way_from(self.began);
        match self.phase {
            Phase::SeekFast if sensed.limit_low => self.enter(Phase::BackOff, sensed, config),
            Phase::BackOff => self.back_off(sensed, config, gone)?,
            Phase::SeekSlow if sensed.limit_low => {
                self.found.switch = sensed.raw;
                self.enter(Phase::SeekIndex, sensed, config);
            }
            Phase::SeekIndex => self.seek_index(sensed, config, gone)?,
            Phase::SeekFast | Phase::SeekSlow if is_beyond(gone, config.search) => {
                return Err(HomingFailure::SwitchNotFound);
            }
            _ => {}
        }
        Ok(self.speed)
    }

    fn back_off(&mut self, sensed: &Sensed, config: &Config, gone: i64) -> Result<(), HomingFailure> {
        if sensed.limit_low {
            self.released = sensed.position;
            if is_beyond(gone, config.search) {
                return Err(HomingFailure::SwitchStuck);
            }
        } else if sensed.position - self.released > config.back_off {
            self.enter(Phase::SeekSlow, sensed, config);
        }
        Ok(())
    }

    fn seek_index(&mut self, sensed: &Sensed, config: &Config, gone: i64) -> Result<(), HomingFailure> {
        if let Some(index) = sensed.index {
            self.found.zero = index + config.zero_from_index;
            self.enter(Phase::Done, sensed, config);
        } else if is_beyond(gone, config.index_search) {
            return Err(HomingFailure::IndexNotFound);
        }
        Ok(())
    }

    fn enter(&mut self, phase: Phase, sensed: &Sensed, config: &Config) {
        self.phase = phase;
        self.began = sensed.position;
        self.released = sensed.position;
        self.speed = match phase {
            Phase::SeekFast => config.fast.saturating_neg(),
            Phase::BackOff => config.fast,
            Phase::SeekSlow => config.slow.saturating_neg(),
            Phase::SeekIndex => config.slow,
            Phase::Done => 0,
        };
    }
}

/// Whether a way of so many picometres is longer than a distance, in either direction.
fn is_beyond(way: i64, distance: Pos) -> bool {
    !wide::is_within(way, distance.pm())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: Config = Config {
        fast: 1000,
        slow: 50,
        search: Pos::from_pm(115_000_000_000),
        back_off: Pos::from_pm(500_000_000),
        index_search: Pos::from_pm(5_000_000_000),
        zero_from_index: Counts::ZERO,
    };

    fn at(mm: f64, limit_low: bool) -> Sensed {
        let position = Pos::from_mm(mm);
        Sensed { position, raw: Counts::new(position.pm() / 100_000), limit_low, ..Sensed::default() }
    }

    /// Walks through places; the speed of each tick, or what was missing.
    fn walk(places: &[Sensed]) -> Result<Vec<i64>, HomingFailure> {
        let mut homing = Homing::new(&places[0], &CONFIG);
        places.iter().map(|sensed| homing.tick(sensed, &CONFIG)).collect()
    }

    #[test]
    fn goes_fast_backs_off_goes_slowly_and_takes_the_mark() {
        let mark = Sensed { index: Some(Counts::new(7)), ..at(0.1, false) };
        let places = [
            at(3.0, false),
            at(-2.0, true),
            at(-1.9, false),
            at(-1.3, false),
            at(-2.0, true),
            at(-1.0, false),
            mark,
        ];
        assert_eq!(walk(&places), Ok(vec![-1000, 1000, 1000, -50, 50, 50, 0]));
        let mut homing = Homing::new(&places[0], &CONFIG);
        for sensed in &places {
            homing.tick(sensed, &CONFIG).unwrap();
        }
        let found = Found { zero: Counts::new(7), switch: Counts::new(-20_000) };
        assert_eq!(homing.found(), Some(found));
    }

    #[test]
    fn a_mark_passed_on_the_way_to_the_switch_is_not_taken() {
        let mark = Sensed { index: Some(Counts::new(7)), ..at(0.0, false) };
        assert_eq!(walk(&[at(3.0, false), mark, at(-1.0, false)]), Ok(vec![-1000, -1000, -1000]));
    }

    #[test]
    fn what_is_missing_is_named() {
        assert_eq!(walk(&[at(3.0, false), at(-112.1, false)]), Err(HomingFailure::SwitchNotFound));
        assert_eq!(walk(&[at(-2.0, true), at(113.1, true)]), Err(HomingFailure::SwitchStuck));
        let places = [at(-2.0, true), at(-1.9, false), at(-1.3, false), at(-2.0, true), at(3.1, false)];
        assert_eq!(walk(&places), Err(HomingFailure::IndexNotFound));
        let places = [at(-2.0, true), at(-1.9, false), at(-1.3, false), at(-117.0, false)];
        assert_eq!(walk(&places), Err(HomingFailure::SwitchNotFound));
    }
}
