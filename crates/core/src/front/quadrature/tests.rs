use super::*;
use proptest::prelude::*;
use std::collections::HashSet;

/// The chip as its data sheet draws it: shift registers sampled at every clock. It knows no table: it counts by the
/// floors that [`Decode`] names.
#[derive(Clone)]
struct EveryClock {
    decode: Decode,
    filter: u32,
    run: [u32; 3],
    passed: [bool; 3],
    counter: i64,
    illegal: u16,
    glitches: u16,
    index: Option<u32>,
}

/// The counter at a place, up to where it began.
fn counted(decode: Decode, place: i64) -> i64 {
    match decode {
        Decode::X1 => (place + 3).div_euclid(4),
        Decode::X2 => (place + 1).div_euclid(2),
        Decode::X4 => place,
    }
}

fn phase([a, b, _]: [bool; 3]) -> i64 {
    match (a, b) {
        (false, false) => 0,
        (true, false) => 1,
        (true, true) => 2,
        (false, true) => 3,
    }
}

impl EveryClock {
    fn new(decode: Decode, filter: u8, levels: [bool; 3]) -> Self {
        Self {
            decode,
            filter: u32::from(filter),
            run: [0; 3],
            passed: levels,
            counter: 0,
            illegal: 0,
            glitches: 0,
            index: None,
        }
    }

    fn clock(&mut self, raw: [bool; 3]) {
        let before = self.passed;
        for (raw, (run, passed)) in raw.into_iter().zip(self.run.iter_mut().zip(&mut self.passed)) {
            self.glitches += u16::from(raw == *passed && *run > 0);
            *run = if raw == *passed { 0 } else { *run + 1 };
            if *run >= self.filter {
                *passed = raw;
                *run = 0;
            }
        }
        let place = phase(before);
        let step = match (phase(self.passed) - place).rem_euclid(4) {
            2 => {
                self.illegal += 1;
                0
            }
            3 => -1,
            step => step,
        };
        self.counter += counted(self.decode, place + step) - counted(self.decode, place);
        if self.passed[2] && !before[2] {
            self.index = self.index.or(Some(self.counter as u32));
        }
    }

    fn read(&mut self) -> Reading {
        let reading = Reading {
            counter: self.counter as u32,
            illegal: self.illegal,
            glitches: self.glitches,
            index: self.index,
        };
        (self.illegal, self.glitches, self.index) = (0, 0, None);
        reading
    }
}

/// All of a counter that decides what it does next: times as they lie ahead of `clock`, the past all alike.
fn future(counter: &QuadratureCounter, clock: u64) -> (u8, u8, u64, [u64; 3]) {
    let ahead = |due: u64| if due == NEVER { NEVER } else { due.saturating_sub(clock) };
    (counter.raw, counter.passed, ahead(counter.next), counter.due.map(ahead))
}

fn pins(levels: u8) -> [bool; 3] {
    [A, B, Z].map(|bit| levels & bit != 0)
}

/// For every sequence of levels, of any length, one change in a clock at most, whatever the clocks between: from each
/// state that both models together can reach, every level for every time that makes a difference.
#[test]
fn every_state_is_that_of_a_model_that_steps_every_clock() {
    for (decode, filter) in MODES.into_iter().flat_map(|decode| (1..=5).map(move |filter| (decode, filter))) {
        let start = QuadratureCounter::decoding(decode, filter, false, false);
        let mut waiting = vec![(start, EveryClock::new(decode, filter, [false; 3]), 0)];
        let mut seen = HashSet::new();
        while let Some((fast, slow, clock)) = waiting.pop() {
            for (levels, wait) in
                (0..8).flat_map(|levels| (1..=u64::from(filter) + 1).map(move |w| (levels, w)))
            {
                let (mut fast, mut slow, [a, b, z]) = (fast.clone(), slow.clone(), pins(levels));
                fast.edge(clock, a, b, z);
                (0..wait).for_each(|_| slow.clock([a, b, z]));
                let clock = clock + wait;
                assert_eq!(fast.read(clock), slow.read());
                if seen.insert((future(&fast, clock), slow.run, slow.passed)) {
                    waiting.push((fast, slow, clock));
                }
            }
        }
        let slow: HashSet<_> = seen.into_iter().map(|(_, run, passed)| (run, passed)).collect();
        assert_eq!(
            slow.len(),
            8 * usize::from(filter).pow(3),
            "three pins, all levels, all times in the filter"
        );
    }
}

const MODES: [Decode; 3] = [Decode::X1, Decode::X2, Decode::X4];

/// A motion and its disturbances within the limits of the module's head, and the counter that sees them.
#[derive(Clone)]
struct Disturbed {
    counter: QuadratureCounter,
    clock: u64,
    place: i64,
    /// The pin whose last edge is not settled yet, and for how many clocks it has held.
    unsettled: Option<(usize, u64)>,
    /// Clocks for which a settled pin has left its level.
    away: [u64; 2],
}

impl Disturbed {
    /// One clock: perhaps a step of the motion, then these levels at the pins. `None` if that is beyond the limits.
    fn clock(&self, step: i64, raw: [bool; 2]) -> Option<Self> {
        let mut next = self.clone();
        let filter = self.counter.filter;
        if step != 0 {
            next.place += step;
            let (before, now) = (levels(self.place), levels(next.place));
            let pin = usize::from(before.0 == now.0);
            next.unsettled = self.unsettled.is_none().then_some((pin, 0));
            next.unsettled?;
            next.away[pin] = 0;
        }
        let (a, b) = levels(next.place);
        for (pin, level) in [a, b].into_iter().enumerate() {
            let held = raw[pin] == level;
            match &mut next.unsettled {
                Some((edge, clocks)) if *edge == pin => *clocks = if held { *clocks + 1 } else { 0 },
                _ => next.away[pin] = if held { 0 } else { next.away[pin] + 1 },
            }
        }
        next.unsettled = next.unsettled.filter(|(_, clocks)| *clocks < filter);
        next.counter.edge(next.clock, raw[0], raw[1], false);
        next.clock += 1;
        next.away.iter().all(|away| *away < filter).then_some(next)
    }
}

/// For every motion and disturbance within the limits of the module's head, of any length.
#[test]
fn no_disturbance_within_the_limits_costs_a_count() {
    for (decode, filter) in MODES.into_iter().flat_map(|decode| (1..=5).map(move |filter| (decode, filter))) {
        let counter = QuadratureCounter::decoding(decode, filter, false, false);
        let mut waiting = vec![Disturbed { counter, clock: 0, place: 0, unsettled: None, away: [0; 2] }];
        let (mut seen, mut turned) = (HashSet::new(), HashSet::new());
        while let Some(state) = waiting.pop() {
            for (step, levels) in (-1..=1).flat_map(|step| (0..4).map(move |levels| (step, pins(levels)))) {
                let Some(mut next) = state.clock(step, [levels[0], levels[1]]) else { continue };
                let reading = next.counter.read(next.clock);
                let lost = counted(decode, next.place) - i64::from(reading.counter.cast_signed());
                assert_eq!(reading.illegal, 0);
                assert!(lost.abs() <= 1, "never more than the edge that is under way");
                assert!(lost == 0 || next.unsettled.is_some(), "{decode:?}, filter {filter}");
                if step != 0 {
                    turned.insert((state.place.rem_euclid(4), step));
                }
                let place = next.place.rem_euclid(4);
                if seen.insert((future(&next.counter, next.clock), place, lost, next.unsettled, next.away)) {
                    waiting.push(next);
                }
            }
        }
        assert_eq!(turned.len(), 8, "both ways from every phase");
    }
}

/// As above, at times without a pattern.
mod random {
    use super::*;

    proptest! {
        #[test]
        fn matches_a_model_that_steps_every_clock(
            changes in proptest::collection::vec((1u64..12, 0u8..8), 1..200),
            filter in 1u8..9,
            mode in 0usize..3,
        ) {
            let mut fast = QuadratureCounter::decoding(MODES[mode], filter, false, false);
            let mut slow = EveryClock::new(MODES[mode], filter, [false; 3]);
            let (mut clock, mut raw) = (0u64, [false; 3]);
            for (wait, levels) in changes.into_iter().chain([(12, 0), (12, 0)]) {
                (0..wait).for_each(|_| slow.clock(raw));
                clock += wait;
                raw = pins(levels);
                fast.edge(clock, raw[0], raw[1], raw[2]);
            }
            prop_assert_eq!(fast.read(clock), slow.read());
        }
    }
}

#[test]
fn every_edge_counts_as_its_mode_says_through_the_wrap_and_back() {
    for decode in MODES {
        for start in 0..4 {
            let (a, b) = levels(start);
            let mut counter = QuadratureCounter::decoding(decode, 1, a, b);
            for (clock, place) in (start - 9..start).rev().chain(start - 8..start + 9).enumerate() {
                let (a, b) = levels(place);
                counter.edge(clock as u64, a, b, false);
                let expected = counted(decode, place) - counted(decode, start);
                let reading = counter.read(clock as u64 + 1);
                assert_eq!((reading.counter, reading.illegal), (expected as u32, 0), "{decode:?} at {place}");
            }
        }
    }
}

#[test]
fn no_pulse_shorter_than_asked_passes_and_a_longer_one_does() {
    assert_eq!(filter_for(0), Ok(1));
    assert_eq!(filter_for(16), Ok(3), "the chip's three clocks for a width of two");
    assert_eq!(filter_for(2032), Ok(255));
    assert_eq!(filter_for(2033), Err(FilterError { pulse_ns: 2033 }));
    for pulse_ns in 0..=2032 {
        let filter = filter_for(pulse_ns).unwrap();
        // A pulse of w ns is seen by at most ⌈w / 8⌉ clocks, one just shorter than asked by as many.
        assert!(pulse_ns.div_ceil(8) < u32::from(filter));
        assert!(filter == 1 || (pulse_ns + 8).div_ceil(8) <= u32::from(filter), "no longer than needed");
    }
}

#[test]
fn the_index_latches_the_counter_of_each_mode() {
    for decode in MODES {
        let mut counter = QuadratureCounter::decoding(decode, 3, false, false);
        for n in 1..20 {
            let (a, b) = levels(n);
            counter.edge(n as u64 * 10, a, b, n == 7);
        }
        assert_eq!(counter.read(500).index, Some(counted(decode, 7) as u32));
    }
}

#[test]
fn both_channels_at_once_is_an_error_in_each_mode_from_each_phase() {
    for (decode, place) in MODES.into_iter().flat_map(|decode| (0..4).map(move |place| (decode, place))) {
        let ((a, b), (c, d)) = (levels(place), levels(place + 2));
        let mut counter = QuadratureCounter::decoding(decode, 3, a, b);
        counter.edge(10, c, d, false);
        let reading = counter.read(100);
        assert_eq!((reading.counter, reading.illegal), (0, 1));
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
