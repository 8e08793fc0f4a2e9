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
