//! Homing of one axis (row B9): fast to the switch, back off, slowly to the switch, back off to the reference mark.
//!
//! The zero is the reference mark, always passed in the same direction at the same low speed, so that lost motion
//! and elasticity do not spoil it. It lies at the low end: positions stay positive.

use crate::publish::HomingFailure;
use crate::sense::Sensed;
use crate::units::{Counts, Pos};

/// How an axis homes. Speeds are picometres a tick with 16 fractional bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
enum Phase {
    SeekFast,
    BackOff,
    SeekSlow,
    SeekIndex,
    Done,
}

/// What homing found on an axis, extended counts from power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The zero.
    pub zero: Counts,
    /// Where the switch closed on the slow approach.
    pub switch: Counts,
}

/// The homing of one axis under way.
#[derive(Clone, Copy, Debug)]
pub struct Homing {
    phase: Phase,
    /// Where the phase began.
    began: Pos,
    /// Where the switch was last seen pressed, while backing off.
    released: Pos,
    found: Found,
}

impl Homing {
    /// Begins where the axis stands; from a pressed switch it backs off first.
    pub fn new(sensed: &Sensed) -> Self {
        let phase = if sensed.limit_low { Phase::BackOff } else { Phase::SeekFast };
        Self { phase, began: sensed.position, released: sensed.position, found: Found::default() }
    }

    /// What was found, once it is.
    pub fn found(&self) -> Option<Found> {
        (self.phase == Phase::Done).then_some(self.found)
    }

    /// Takes one tick; returns the speed wanted now (picometres a tick, 16 fractional bits).
    ///
    /// # Errors
    /// When the switch or the mark is not found within its distance.
    pub fn tick(&mut self, sensed: &Sensed, config: &Config) -> Result<i64, HomingFailure> {
        let gone = (sensed.position - self.began).abs();
        match self.phase {
            Phase::SeekFast if sensed.limit_low => self.enter(Phase::BackOff, sensed),
            Phase::BackOff => self.back_off(sensed, config, gone)?,
            Phase::SeekSlow if sensed.limit_low => {
                self.found.switch = sensed.raw;
                self.enter(Phase::SeekIndex, sensed);
            }
            Phase::SeekIndex => self.seek_index(sensed, config, gone)?,
            Phase::SeekFast | Phase::SeekSlow if gone > config.search => {
                return Err(HomingFailure::SwitchNotFound);
            }
            _ => {}
        }
        Ok(self.speed(config))
    }

    fn back_off(&mut self, sensed: &Sensed, config: &Config, gone: Pos) -> Result<(), HomingFailure> {
        if sensed.limit_low {
            self.released = sensed.position;
            if gone > config.search {
                return Err(HomingFailure::SwitchStuck);
            }
        } else if sensed.position - self.released > config.back_off {
            self.enter(Phase::SeekSlow, sensed);
        }
        Ok(())
    }

    fn seek_index(&mut self, sensed: &Sensed, config: &Config, gone: Pos) -> Result<(), HomingFailure> {
        if let Some(index) = sensed.index {
            self.found.zero = index + config.zero_from_index;
            self.enter(Phase::Done, sensed);
        } else if gone > config.index_search {
            return Err(HomingFailure::IndexNotFound);
        }
        Ok(())
    }

    fn enter(&mut self, phase: Phase, sensed: &Sensed) {
        self.phase = phase;
        self.began = sensed.position;
        self.released = sensed.position;
    }

    fn speed(&self, config: &Config) -> i64 {
        match self.phase {
            Phase::SeekFast => config.fast.saturating_neg(),
            Phase::BackOff => config.fast,
            Phase::SeekSlow => config.slow.saturating_neg(),
            Phase::SeekIndex => config.slow,
            Phase::Done => 0,
        }
    }
}
