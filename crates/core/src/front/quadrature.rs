//! Digital filter, 4× decoder, 32-bit counter and index latch, after the HCTL-2032 of paper A (row A3).
//!
//! The chip samples its inputs at a clock and passes a level only when it was the same at `n` clocks in a row.
//! Between two edges nothing happens, so the model is fed with edges and their time in clocks and gives the same
//! counts as one that steps every clock (`matches_a_model_that_steps_every_clock`).

/// Motion by (previous state, state), state = 2·B + A: A rising while B is low counts up, as in paper B.
/// `ILLEGAL` means that both channels changed at once.
const DECODE: [i8; 16] = [0, 1, -1, ILLEGAL, -1, 0, ILLEGAL, 1, 1, ILLEGAL, 0, -1, ILLEGAL, -1, 1, 0];
const ILLEGAL: i8 = 2;

/// What the front end hands to a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// The 32-bit counter.
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
    /// A counter at zero whose inputs must hold for `filter` clocks (1…255) to pass.
    ///
    /// The highest edge rate is one edge each `filter` clocks on a channel; the delay is `filter` clocks.
    pub fn new(filter: u8, a: bool, b: bool) -> Self {
        let levels = bits(a, b, false);
        Self {
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
        match DECODE.get(row).copied().unwrap_or(ILLEGAL) {
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
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The chip as its data sheet draws it: shift registers sampled at every clock.
    struct EveryClock {
        filter: u32,
        run: [u32; 2],
        passed: [bool; 2],
        counter: i64,
        illegal: u32,
    }

    impl EveryClock {
        fn clock(&mut self, raw: [bool; 2]) {
            let before = self.passed;
            for (raw, (run, passed)) in raw.into_iter().zip(self.run.iter_mut().zip(&mut self.passed)) {
                *run = if raw == *passed { 0 } else { *run + 1 };
                if *run >= self.filter {
                    *passed = raw;
                    *run = 0;
                }
            }
            let phase = |s: [bool; 2]| match s {
                [false, false] => 0i64,
                [true, false] => 1,
                [true, true] => 2,
                [false, true] => 3,
            };
            match (phase(self.passed) - phase(before)).rem_euclid(4) {
                1 => self.counter += 1,
                3 => self.counter -= 1,
                2 => self.illegal += 1,
                _ => {}
            }
        }
    }

    proptest! {
        #[test]
        fn matches_a_model_that_steps_every_clock(
            levels in proptest::collection::vec((1u64..12, any::<bool>(), any::<bool>()), 1..200),
            filter in 1u8..6,
        ) {
            let mut fast = QuadratureCounter::new(filter, false, false);
            let mut slow = EveryClock {
                filter: u32::from(filter), run: [0; 2], passed: [false; 2], counter: 0, illegal: 0,
            };
            let (mut clock, mut raw) = (0u64, [false; 2]);
            for (wait, a, b) in levels {
                for _ in 0..wait {
                    slow.clock(raw);
                    clock += 1;
                }
                raw = [a, b];
                fast.edge(clock, a, b, false);
            }
            for _ in 0..=u64::from(filter) {
                slow.clock(raw);
                clock += 1;
            }
            let reading = fast.read(clock);
            prop_assert_eq!(reading.counter, slow.counter as u32);
            prop_assert_eq!(u32::from(reading.illegal), slow.illegal);
        }
    }

    #[test]
    fn counts_up_and_down_through_the_wrap() {
        let mut counter = QuadratureCounter::new(3, false, false);
        let mut clock = 0;
        for n in (-1000..=0).rev().chain(-999..=1000) {
            clock += 10;
            let (a, b) = levels(n);
            counter.edge(clock, a, b, false);
            assert_eq!(counter.read(clock + 3).counter, n as u32);
        }
        assert_eq!(counter.read(clock + 3).illegal, 0);
    }

    #[test]
    fn a_pulse_shorter_than_the_filter_is_a_glitch_and_never_a_count() {
        let mut counter = QuadratureCounter::new(3, false, false);
        counter.edge(10, true, false, false);
        counter.edge(12, false, false, false);
        let reading = counter.read(100);
        assert_eq!((reading.counter, reading.glitches, reading.illegal), (0, 1, 0));
    }

    #[test]
    fn both_channels_at_once_is_an_error_and_not_motion() {
        let mut counter = QuadratureCounter::new(3, false, false);
        counter.edge(10, true, true, false);
        let reading = counter.read(100);
        assert_eq!((reading.counter, reading.illegal), (0, 1));
    }

    #[test]
    fn the_index_latches_the_counter_once() {
        let mut counter = QuadratureCounter::new(3, false, false);
        for n in 1..20 {
            let (a, b) = levels(n);
            counter.edge(n as u64 * 10, a, b, n == 7);
        }
        assert_eq!(counter.read(500).index, Some(7));
        assert_eq!(counter.read(510).index, None);
    }

    #[test]
    fn of_two_rises_between_readings_the_first_is_latched() {
        let mut counter = QuadratureCounter::new(3, false, false);
        for n in 1..20 {
            let (a, b) = levels(n);
            counter.edge(n as u64 * 10, a, b, n == 7 || n == 12);
        }
        assert_eq!(counter.read(500).index, Some(7));
    }
}
