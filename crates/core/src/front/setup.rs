//! How the front end of an axis is set up.

use super::{CLOCK_HZ, Decode};

/// What the pins and registers of a counter chip are set to at power-on. [`crate::design`] makes it of the builder's
/// settings; a board writes it before its first tick, and so does the twin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Setup {
    /// Which edges count.
    pub decode: Decode,
    /// For how long a level must hold to pass, clocks of [`CLOCK_HZ`]; 1: no filter.
    pub filter: u8,
}

impl Setup {
    /// The filter in clocks of a front end that has `clock_hz` of them a second, at most [`CLOCK_HZ`]: a level must hold
    /// at least as long there, less than one of its clocks longer.
    pub const fn filter_at(&self, clock_hz: u32) -> u8 {
        let clocks = (self.filter as u64).saturating_mul(clock_hz as u64).div_ceil(CLOCK_HZ as u64);
        if clocks > u8::MAX as u64 { u8::MAX } else { clocks as u8 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::filter_for;

    #[test]
    fn a_slower_front_end_lets_no_shorter_pulse_pass() {
        for clock_hz in [1_000_000, 10_000_000, 99_999_999, CLOCK_HZ] {
            for filter in 1..=255 {
                let there = Setup { decode: Decode::X4, filter }.filter_at(clock_hz);
                // Both durations times both rates.
                let wanted = u64::from(filter) * u64::from(clock_hz);
                let holds = u64::from(there) * u64::from(CLOCK_HZ);
                assert!(holds >= wanted && holds < wanted + u64::from(CLOCK_HZ), "{filter} at {clock_hz} Hz");
            }
        }
    }

    #[test]
    fn the_filters_of_the_presets_in_clocks_of_100_ns() {
        for (pulse_ns, clocks) in [(0, 1), (300, 4), (2000, 21)] {
            let setup = Setup { decode: Decode::X4, filter: filter_for(pulse_ns).unwrap() };
            assert_eq!(setup.filter_at(10_000_000), clocks, "{pulse_ns} ns");
        }
    }
}
