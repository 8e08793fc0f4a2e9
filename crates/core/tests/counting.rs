//! Counting square signals: paper B's counter and what is wrong with it, and a proof by exhaustion that ours is free of that.
//!
//! What is proven, over *all* sequences of the stated lengths, from each of the four states:
//! - legal steps only (A or B changes, 14 steps): the count is where the signals are, so every way back to a place is a way
//!   back to its count;
//! - any steps (A, B or both change, 10 steps): a change of both is flagged, each once, and never counted;
//! - any levels at any clock (10 clocks, filters of 1 … 4 clocks): the count is that of shift registers clocked one by one,
//!   as the data sheet of the HCTL-2032 draws them; nothing shorter than the filter is ever counted.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use abbe_core::front::QuadratureCounter;
use abbe_core::front::quadrature::{Decode, filter_clocks, levels};

const MODES: [Decode; 3] = [Decode::X1, Decode::X2, Decode::X4];

// ---- Paper B's counter (row B4) -----------------------------------------------------------------------------------

/// Six 74LS190 in a row: they count where A rises, up if B is low there and down if it is high. A test model: nothing of
/// abbe uses it.
#[derive(Clone, Copy, Default)]
struct PaperCounter {
    a: bool,
    count: i32,
    /// The paper's two corrections are made.
    corrected: bool,
    /// The count stands half a pulse below the place (set by the second correction).
    half: bool,
}

impl PaperCounter {
    fn step(&mut self, a: bool, b: bool) {
        let (rises, falls) = (a && !self.a, !a && self.a);
        self.a = a;
        if rises {
            self.count += if b { -1 } else { 1 };
            // Second correction (INT0): B high at a rise is a way back through the falling edge; the pulse is not left yet.
            self.half = self.corrected && b;
        }
        if falls && !b && self.corrected {
            // First correction (T0): A falls with B low only on the way back through its rising edge.
            self.count -= i32::from(!self.half);
            self.half = false;
        }
    }

    /// Position in half pulses.
    fn halves(self) -> i32 {
        2 * self.count + i32::from(self.half)
    }
}

/// Walks quarter by quarter; the count, in half pulses, and the place.
fn paper(corrected: bool, way: &[i64]) -> (i32, i64) {
    let mut counter = PaperCounter { corrected, ..PaperCounter::default() };
    let mut place = 0;
    for step in way {
        place += step;
        let (a, b) = levels(place);
        counter.step(a, b);
    }
    (counter.halves(), place)
}

/// Up by n quarters, back by m.
fn there_and_back(up: usize, back: usize) -> Vec<i64> {
    [vec![1; up], vec![-1; back]].concat()
}

#[test]
fn paper_b_s_counter_is_off_by_one_when_the_stage_shakes_back_through_the_rising_edge() {
    // Over the rising edge and back: the stage is where it was, the count is one too many.
    assert_eq!(paper(false, &there_and_back(1, 1)), (2, 0));
    assert_eq!(paper(true, &there_and_back(1, 1)), (0, 0));
    // Each shake adds another.
    let shakes: Vec<i64> = there_and_back(1, 1).repeat(10);
    assert_eq!(paper(false, &shakes), (20, 0));
    assert_eq!(paper(true, &shakes), (0, 0));
}

#[test]
fn paper_b_s_counter_is_off_by_half_when_the_stage_shakes_back_through_the_falling_edge() {
    // Past the falling edge and back into the pulse: a count is taken off though the pulse was not left.
    assert_eq!(paper(false, &there_and_back(3, 1)), (0, 2));
    // The correction puts half of it back.
    assert_eq!(paper(true, &there_and_back(3, 1)), (1, 2));
}

#[test]
fn what_paper_b_s_corrections_leave_is_a_count_for_each_shake_over_the_falling_edge() {
    // Over the falling edge, back, and over it again: no edge of A says that the half has become a whole again.
    let shakes: Vec<i64> = [there_and_back(3, 1), vec![1], [-1, 1].repeat(9)].concat();
    let (halves, place) = paper(true, &shakes);
    assert_eq!(place, 3);
    assert!(halves <= 2 - 2 * 9, "{halves}");
    // Ours, over the same way.
    let mut counter = QuadratureCounter::with(Decode::X1, 1, false, false);
    let mut at = 0;
    for (clock, step) in (1..).zip(&shakes) {
        at += step;
        let (a, b) = levels(at);
        counter.edge(10 * clock, a, b, false);
    }
    assert_eq!(counter.read(10_000).counter, 0);
}

// ---- Ours, by exhaustion -------------------------------------------------------------------------------------------

/// The count of a place, in quarters from a state in which count 0 lies.
fn count_of(place: i64, first: i64, decode: Decode) -> u32 {
    let width = 4 / i64::from(decode.counts());
    (place.div_euclid(width) - first.div_euclid(width)) as u32
}

struct Walk {
    decode: Decode,
    first: i64,
    seen: u64,
}

impl Walk {
    /// Every way of `left` more steps from here.
    fn go(&mut self, counter: &QuadratureCounter, place: i64, clock: u64, left: u32) {
        self.seen += 1;
        let reading = counter.clone().read(clock);
        assert_eq!(reading.counter, count_of(place, self.first, self.decode), "{:?} at {place}", self.decode);
        assert_eq!(reading.illegal, 0);
        if left == 0 {
            return;
        }
        for step in [-1, 1] {
            let mut next = counter.clone();
            let (a, b) = levels(place + step);
            next.edge(clock + 1, a, b, false);
            self.go(&next, place + step, clock + 2, left - 1);
        }
    }

    /// The same where both lines may change at once; `flagged` did.
    fn go_anywhere(
        &mut self,
        counter: &QuadratureCounter,
        state: i64,
        counted: i64,
        flagged: u16,
        left: u32,
    ) {
        self.seen += 1;
        let clock = u64::from(100 - left) * 2;
        let reading = counter.clone().read(clock);
        assert_eq!(reading.illegal, flagged);
        assert_eq!(reading.counter, count_of(self.first + counted, self.first, self.decode));
        if left == 0 {
            return;
        }
        for (step, illegal) in [(-1, false), (1, false), (2, true)] {
            let mut next = counter.clone();
            let (a, b) = levels(state + step);
            next.edge(clock + 1, a, b, false);
            let counted = if illegal { counted } else { counted + step };
            self.go_anywhere(&next, state + step, counted, flagged + u16::from(illegal), left - 1);
        }
    }
}

#[test]
fn every_way_of_legal_steps_ends_at_the_count_of_its_place() {
    for decode in MODES {
        for first in 0..4 {
            let (a, b) = levels(first);
            let mut walk = Walk { decode, first, seen: 0 };
            walk.go(&QuadratureCounter::with(decode, 1, a, b), first, 0, 14);
            assert_eq!(walk.seen, (1 << 15) - 1);
        }
    }
}

#[test]
fn every_change_of_both_lines_is_flagged_once_and_never_counted() {
    for decode in MODES {
        for first in 0..4 {
            let (a, b) = levels(first);
            let mut walk = Walk { decode, first, seen: 0 };
            walk.go_anywhere(&QuadratureCounter::with(decode, 1, a, b), first, 0, 0, 10);
            assert_eq!(walk.seen, (3_u64.pow(11) - 1) / 2);
        }
    }
}

/// Shift registers, clock by clock.
#[derive(Clone, Copy)]
struct Registers {
    filter: u8,
    run: [u8; 2],
    passed: [bool; 2],
    quarters: i64,
    illegal: u16,
}

impl Registers {
    fn clock(&mut self, lines: [bool; 2]) {
        let before = self.passed;
        for ((line, run), passed) in lines.into_iter().zip(&mut self.run).zip(&mut self.passed) {
            *run = if line == *passed { 0 } else { *run + 1 };
            if *run >= self.filter {
                *passed = line;
                *run = 0;
            }
        }
        let place = |[a, b]: [bool; 2]| (0..4).find(|&n| levels(n) == (a, b)).unwrap();
        match (place(self.passed) - place(before)).rem_euclid(4) {
            1 => self.quarters += 1,
            3 => self.quarters -= 1,
            2 => self.illegal += 1,
            _ => {}
        }
    }
}

#[test]
fn every_sequence_of_levels_is_counted_as_registers_clocked_one_by_one_count_it() {
    const CLOCKS: u32 = 10;
    for filter in 1..=4 {
        for sequence in 0..4_u32.pow(CLOCKS) {
            let lines = |clock: u32| [sequence >> (2 * clock) & 1 != 0, sequence >> (2 * clock) & 2 != 0];
            let mut registers =
                Registers { filter, run: [0; 2], passed: [false; 2], quarters: 0, illegal: 0 };
            let mut counter = QuadratureCounter::with(Decode::X4, filter, false, false);
            let mut before = [false; 2];
            for clock in 0..CLOCKS {
                let now = lines(clock);
                if now != before {
                    counter.edge(clock.into(), now[0], now[1], false);
                    before = now;
                }
                registers.clock(now);
            }
            // Clock k of the registers sees the level that stands from k on: the last look is at CLOCKS − 1.
            let end = u64::from(CLOCKS) - 1 + u64::from(filter);
            (CLOCKS..CLOCKS + u32::from(filter)).for_each(|_| registers.clock(before));
            let reading = counter.read(end);
            assert_eq!(reading.counter, registers.quarters as u32, "filter {filter}, sequence {sequence:o}");
            assert_eq!(reading.illegal, registers.illegal, "filter {filter}, sequence {sequence:o}");
        }
    }
}

#[test]
fn fewer_counts_wrap_where_32_bits_do_and_latch_the_index_in_their_own_counts() {
    for decode in MODES {
        let mut counter = QuadratureCounter::with(decode, 1, false, false);
        let mut clock = 0;
        for place in (-40..0).rev().chain(-39..=57) {
            clock += 3;
            let (a, b) = levels(place);
            counter.edge(clock, a, b, place == 50);
            let reading = counter.read(clock + 1);
            assert_eq!(reading.counter, count_of(place, 0, decode));
            assert_eq!(reading.index, (place == 50).then(|| count_of(50, 0, decode)), "{place}");
        }
    }
    assert_eq!(MODES.map(Decode::counts), [1, 2, 4]);
}

#[test]
fn a_filter_is_asked_for_in_nanoseconds() {
    assert_eq!([0, 7, 8, 40, 100, 2040].map(|ns| filter_clocks(ns).unwrap()), [1, 1, 1, 5, 12, 255]);
    assert!(filter_clocks(2041).unwrap_err().to_string().contains("2040 ns"));
    // What it promises: a pulse of that length passes, one clock less does not.
    for ns in [16, 40, 100, 2040] {
        let clocks = u64::from(filter_clocks(ns).unwrap());
        for (length, counts) in [(clocks, 1), (clocks - 1, 0)] {
            let mut counter = QuadratureCounter::new(clocks as u8, false, false);
            counter.edge(1000, true, false, false);
            let inside = counter.read(1000 + length).counter;
            counter.edge(1000 + length, false, false, false);
            assert_eq!((inside, counter.read(9000).counter), (counts, 0), "{ns} ns, {length} clocks");
        }
    }
}
