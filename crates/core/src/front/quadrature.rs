//! Digital filter, decoder, 32-bit counter and index latch, after the HCTL-2032 of paper A (row A3).
//!
//! The chip samples its inputs at a clock and passes a level only when it was the same at `n` clocks in a row.
//! Between two edges nothing happens, so the model is fed with edges and their time in clocks and gives the same
//! counts as one that steps every clock (`every_state_is_that_of_a_model_that_steps_every_clock`).
//!
//! # When no count is lost
//!
//! Call an edge of the true motion *settled* when its channel has held its new level for `n` clocks. If every edge is
//! settled before the next one begins, on either channel, and a channel leaves a settled level for less than `n` clocks
//! at a time, then the counter is the true one whenever the last edge is settled, and no transition is illegal. A
//! comparator that chatters at an edge is not excluded: its bounces, long or short, count up and down again.
//! `no_disturbance_within_the_limits_costs_a_count` walks all of them.
//!
//! # Beyond that
//!
//! - Both channels pass in one clock: an illegal transition is counted and the motion, two 4× counts, is lost.
//! - A channel's pulse is shorter than `n` clocks: it is gone, counted as a glitch. Where it was motion and not noise,
//!   four 4× counts are lost *without* an illegal transition, because what is left looks like a small way there and
//!   back. Noise that delays an edge past the next one does the same. While no glitch is reported, the line behind the
//!   filter is the line before it, `n` clocks later.
//! - Noise that is not shorter than `n` clocks passes. Between two edges it counts there and back, on both channels at
//!   once it is two illegal transitions; across an edge of the other channel it costs four 4× counts and leaves nothing
//!   behind.
//! - Three or more edges between two clocks alias, as in every sampled decoder: three look like one the other way, four
//!   like none. Nothing can tell that.

use super::CLOCK_HZ;
use core::fmt;

/// Which edges count, after the resolution modes of the HCTL-2032.
///
/// The place `p` is the 4× count with 0 where A and B are low and A rises next, as in [`levels`]. The counter moves by
/// the change of the floor that each mode names: an edge that counts up on the way there counts down on the way back,
/// so that turning round, wherever, neither gains nor loses a count. Every mode sees every illegal transition.
///
/// The chip decides by its states, too; but where an illegal transition makes it count, abbe only reports it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Decode {
    /// One count a period, where A changes while B is low: ⌊(p + 3) / 4⌋. Paper B's pulses, without its faults.
    X1,
    /// Two counts a period, where A changes: ⌊(p + 1) / 2⌋.
    X2,
    /// Four counts a period, at every edge: p.
    #[default]
    X4,
}

impl Decode {
    /// The mode that counts so often a period, if there is one: 1, 2 or 4.
    pub const fn of_counts(a_period: u8) -> Option<Self> {
        match a_period {
            1 => Some(Self::X1),
            2 => Some(Self::X2),
            4 => Some(Self::X4),
            _ => None,
        }
    }

    /// Motion by (previous state, state), state = 2·B + A: A rising while B is low counts up, as in paper B.
    const fn steps(self) -> [i8; 16] {
        const X: i8 = ILLEGAL;
        match self {
            Self::X1 => [0, 1, 0, X, -1, 0, X, 0, 0, X, 0, 0, X, 0, 0, 0],
            Self::X2 => [0, 1, 0, X, -1, 0, X, 0, 0, X, 0, -1, X, 0, 1, 0],
            Self::X4 => [0, 1, -1, X, -1, 0, X, 1, 1, X, 0, -1, X, -1, 1, 0],
        }
    }
}

/// Both channels changed at once.
const ILLEGAL: i8 = 2;

/// Nanoseconds between two clocks.
const CLOCK_NS: u32 = 1_000_000_000 / CLOCK_HZ;
const _: () = assert!(CLOCK_NS * CLOCK_HZ == 1_000_000_000);
/// A filter's longest width: pulses shorter than this never pass a filter of 255 clocks.
const WIDEST_NS: u32 = 254 * CLOCK_NS;

/// The filter, in clocks of [`CLOCK_HZ`], that no pulse shorter than `pulse_ns` passes; 0 … 2032 ns.
///
/// A pulse of w clocks is seen by up to ⌈w⌉ of them, so that one clock more than fits into `pulse_ns` is asked for, as
/// the chip's three clocks stand for a width of two. A level that holds as many clocks as the result always passes;
/// what is longer than `pulse_ns` and shorter than that passes or not, as the clocks fall.
///
/// # Errors
/// When `pulse_ns` is longer than 2032 ns.
pub const fn filter_for(pulse_ns: u32) -> Result<u8, FilterError> {
    if pulse_ns > WIDEST_NS {
        return Err(FilterError { pulse_ns });
    }
    // At most 254, so that one more fits.
    Ok((pulse_ns.div_ceil(CLOCK_NS) as u8).saturating_add(1))
}

/// A pulse that is too long for the filter to remove.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilterError {
    /// What was asked for, ns.
    pub pulse_ns: u32,
}

impl fmt::Display for FilterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the filter removes pulses up to {WIDEST_NS} ns; {} ns were asked for", self.pulse_ns)
    }
}

impl core::error::Error for FilterError {}

/// What the front end hands to a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// The 32-bit counter. It wraps.
    pub counter: u32,
    /// Illegal transitions since the last reading.
    pub illegal: u16,
    /// Filtered pulses since the last reading.
    pub glitches: u16,
    /// The counter when the index first rose, if it did since the last reading.
    pub index: Option<u32>,
}

/// Bits of the three pins.
const A: u8 = 1;
const B: u8 = 2;
const Z: u8 = 4;
const NEVER: u64 = u64::MAX;

/// The counter of one axis.
#[derive(Clone, Debug)]
pub struct QuadratureCounter {
    /// What each transition counts, by the mode.
    steps: [i8; 16],
    filter: u64,
    /// Levels at the pins.
    raw: u8,
    /// Levels behind the filter.
    passed: u8,
    /// The soonest time at which a pin that differs from its passed level passes, if it holds.
    next: u64,
    /// That time for each pin, A, B, Z, when more than one differs.
    due: [u64; 3],
    reading: Reading,
}

impl QuadratureCounter {
    /// A 4× counter at zero whose inputs must hold for `filter` clocks (1…255, see [`filter_for`]) to pass.
    ///
    /// The highest edge rate is one edge each `filter` clocks on a channel; the delay is `filter` clocks.
    pub fn new(filter: u8, a: bool, b: bool) -> Self {
        Self::decoding(Decode::X4, filter, a, b)
    }

    /// A counter at zero that counts the edges of `decode`; the filter is that of [`QuadratureCounter::new`].
    pub fn decoding(decode: Decode, filter: u8, a: bool, b: bool) -> Self {
        let levels = bits(a, b, false);
        Self {
            steps: decode.steps(),
            filter: u64::from(filter.max(1)),
            raw: levels,
            passed: levels,
            due: [NEVER; 3],
            next: NEVER,
            reading: Reading::default(),
        }
    }

    /// New levels of the three pins at `clock`. Clocks never run backwards.
    #[inline]
    pub fn edge(&mut self, clock: u64, a: bool, b: bool, z: bool) {
        self.advance(clock);
        let levels = bits(a, b, z);
        let changed = levels ^ self.raw;
        if self.raw == self.passed && changed.is_power_of_two() {
            // One pin alone changes and nothing else is pending, as in all orderly motion: `next` is its time.
            self.raw = levels;
            self.next = clock.saturating_add(self.filter);
        } else if changed != 0 {
            self.change(clock, levels);
        }
    }

    /// Several pins change, or one changes while another is pending.
    #[cold]
    fn change(&mut self, clock: u64, levels: u8) {
        let pending = self.raw ^ self.passed;
        let changed = levels ^ self.raw;
        let due = clock.saturating_add(self.filter);
        for (bit, pin) in [A, B, Z].into_iter().zip(&mut self.due) {
            if changed & bit != 0 {
                *pin = due;
            } else if pending == bit {
                // It was alone until now.
                *pin = self.next;
            }
        }
        self.raw = levels;
        // Back at the level that had passed: the pulse was too short.
        let ended = changed & !(levels ^ self.passed);
        self.reading.glitches = self.reading.glitches.saturating_add(ended.count_ones() as u16);
        self.schedule();
    }

    /// Lets pass whatever has held long enough by `clock`, in the order of time.
    #[inline]
    pub fn advance(&mut self, clock: u64) {
        while self.next <= clock && self.next != NEVER {
            self.pass(self.next);
        }
    }

    /// When the next level passes, if one is waiting: whoever needs each count with its time advances to this.
    #[inline]
    pub fn due(&self) -> Option<u64> {
        (self.next != NEVER).then_some(self.next)
    }

    /// The counter as it stands, with what has passed.
    #[inline]
    pub fn counter(&self) -> u32 {
        self.reading.counter
    }

    /// The soonest time at which a pin passes.
    #[inline]
    fn schedule(&mut self) {
        let pending = self.raw ^ self.passed;
        self.next = NEVER;
        for (bit, due) in [A, B, Z].into_iter().zip(self.due) {
            if pending & bit != 0 {
                self.next = self.next.min(due);
            }
        }
    }

    /// All pins that are due at `clock` pass together, as in one clock of the chip.
    #[inline]
    fn pass(&mut self, clock: u64) {
        let before = self.passed;
        if (self.raw ^ before).is_power_of_two() {
            // One pin alone, as in all orderly motion.
            self.passed = self.raw;
            self.next = NEVER;
        } else {
            for (bit, due) in [A, B, Z].into_iter().zip(self.due) {
                if due == clock {
                    self.passed = (self.passed & !bit) | (self.raw & bit);
                }
            }
            self.schedule();
        }
        self.count(before & (A | B), self.passed & (A | B));
        if self.passed & !before & Z != 0 {
            self.reading.index = self.reading.index.or(Some(self.reading.counter));
        }
    }

    /// What a tick reads at `clock`; the counts since the last reading start again.
    pub fn read(&mut self, clock: u64) -> Reading {
        self.advance(clock);
        let read = self.reading;
        self.reading = Reading { counter: read.counter, ..Reading::default() };
        read
    }

    #[inline]
    fn count(&mut self, before: u8, now: u8) {
        let row = usize::from((before << 2) | now);
        match self.steps.get(row).copied().unwrap_or(ILLEGAL) {
            ILLEGAL => self.reading.illegal = self.reading.illegal.saturating_add(1),
            step => self.reading.counter = self.reading.counter.wrapping_add_signed(i32::from(step)),
        }
    }
}

const fn bits(a: bool, b: bool, z: bool) -> u8 {
    (a as u8) | ((b as u8) << 1) | ((z as u8) << 2)
}

/// Levels (A, B) of an encoder that stands at count `n`.
#[inline]
pub const fn levels(n: i64) -> (bool, bool) {
    let b = n >> 1;
    ((n ^ b) & 1 != 0, b & 1 != 0)
}

#[cfg(test)]
mod tests;
