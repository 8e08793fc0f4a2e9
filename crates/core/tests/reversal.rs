//! Row B4: paper B's reversible counter, what a shaking stage does to it, and that [`QuadratureCounter`] has no such
//! fault.
//!
//! # What is proven
//!
//! The walks here go through the public interface, one sample a clock, over *all* sequences of levels of A and B of
//! [`SAMPLES`] clocks, 4¹² of them from all four phases, in all three modes, without a filter and with filters of 2 and
//! 3 clocks. In each of them, at every clock:
//!
//! 1. A legal step behind the filter counts by the floor that [`Decode`] names. The count is a function of the place,
//!    so that whoever comes back to a place by legal steps finds its count.
//! 2. An illegal transition behind the filter is reported, once, and counts nothing.
//! 3. When the last level has held, and no glitch was reported, the count is that of the line *before* the filter: an
//!    error leaves an illegal transition or a glitch behind. (Not so what lies between two samples.)
//!
//! Without a filter the decoder knows nothing but the levels before and now, so that 1 and 2 hold for sequences of any
//! length. That the filtered one is right at any length, and how much disturbance it stands, is shown from state to
//! state in the unit tests of `front::quadrature`.

use abbe_core::front::quadrature::levels;
use abbe_core::front::{Decode, QuadratureCounter};

/// Paper B's counter as we read its section 3.3, in half pulses.
///
/// Six decimal counters in a row count A's rising edges; B at that edge says which way, 0 forward, 1 back, and the
/// counters keep that way until the next rising edge. When a stage that moves forward shakes back inside a pulse, two
/// interrupts mend the count.
#[derive(Clone, Copy, Debug)]
struct PaperCounter {
    mends: Mends,
    a: bool,
    forward: bool,
    halves: i32,
}

/// What the interrupts do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mends {
    /// The counters alone.
    Nothing,
    /// For a stage that moves forward, as the paper says it:
    /// * A was high, and the stage goes back over the edge at which A rose: A falls with B low while the counters are
    ///   set to count up. No edge takes the pulse back; the interrupt does.
    /// * A was low, and the stage goes back over the edge at which A fell: A rises with B high. The counters take a
    ///   whole pulse back, and the place is half a pulse from where they gave it; the interrupt adds that half.
    AsPrinted,
    /// The same for a stage that moves back, too, which the paper does not say.
    BothWays,
}

impl PaperCounter {
    fn at(place: i64, mends: Mends) -> Self {
        Self { mends, a: levels(place).0, forward: true, halves: 0 }
    }

    fn step_to(&mut self, place: i64) {
        let (a, b) = levels(place);
        match (self.a, a) {
            (false, true) => self.rise(b),
            (true, false) => self.fall(b),
            _ => {}
        }
        self.a = a;
    }

    fn rise(&mut self, b: bool) {
        let turned = self.forward == b;
        let mended = match self.mends {
            Mends::Nothing => false,
            Mends::AsPrinted => turned && b,
            Mends::BothWays => turned,
        };
        let pulse = if mended { 1 } else { 2 };
        self.halves += if b { -pulse } else { pulse };
        self.forward = !b;
    }

    fn fall(&mut self, b: bool) {
        match (self.mends, self.forward, b) {
            (Mends::AsPrinted | Mends::BothWays, true, false) => self.halves -= 2,
            (Mends::BothWays, false, true) => self.halves += 2,
            _ => {}
        }
    }
}

/// What the paper's counter says after a way through these places, in half pulses.
fn halves(mends: Mends, way: impl IntoIterator<Item = i64>) -> i32 {
    let mut way = way.into_iter();
    let mut counter = PaperCounter::at(way.next().unwrap_or(0), mends);
    way.for_each(|place| counter.step_to(place));
    counter.halves
}

/// A way there, then `times` over the edge between two places and back.
fn shaken(there: &[i64], edge: [i64; 2], times: usize) -> Vec<i64> {
    there.iter().copied().chain(edge.into_iter().cycle().take(2 * times)).collect()
}

#[test]
fn the_paper_counts_a_steady_way_both_ways() {
    for mends in [Mends::Nothing, Mends::AsPrinted, Mends::BothWays] {
        assert_eq!(halves(mends, 0..=40), 20);
        let back = halves(mends, (-40..=0).rev());
        assert_eq!(back, if mends == Mends::Nothing { -20 } else { -19 }, "half of the turn is mended");
    }
}

/// The first fault: A rises, and the stage shakes back over that edge and again forward.
#[test]
fn without_mending_each_shake_over_a_rising_edge_gains_a_whole_count() {
    for times in 0..5 {
        let way = shaken(&[0], [1, 0], times);
        assert_eq!(halves(Mends::Nothing, way.clone()), 2 * times as i32, "the place is that of the start");
        assert_eq!(halves(Mends::AsPrinted, way), 0);
    }
}

/// The second fault: A rose and fell, and the stage shakes back over the falling edge. It is half a period from where
/// it was given the pulse that is now taken.
#[test]
fn without_mending_a_turn_between_pulses_is_off_by_half() {
    let way = [0, 1, 2, 3, 2];
    assert_eq!(halves(Mends::Nothing, way), 0);
    assert_eq!(halves(Mends::AsPrinted, way), 1, "half a pulse: where it is");
}

/// What remains of both faults when only the forward way is mended.
#[test]
fn as_printed_a_stage_that_shakes_on_its_way_back_still_drifts() {
    for times in 0..5 {
        let once = halves(Mends::AsPrinted, [4, 3, 2]);
        let over_an_edge = shaken(&[4, 3, 2], [3, 2], times);
        assert_eq!(halves(Mends::AsPrinted, over_an_edge) - once, -2 * times as i32, "a count a shake");
        let over_a_pulse =
            [4, 3, 2].into_iter().chain([1, 0, 1, 2, 3, 2].into_iter().cycle().take(6 * times));
        assert_eq!(halves(Mends::AsPrinted, over_a_pulse) - once, times as i32, "half a count a turn");
    }
}

/// All ways of `steps` steps from here: the least and the largest count of any that is back where it began.
fn back_at_the_start(counter: PaperCounter, start: i64, place: i64, steps: u32, range: &mut (i32, i32)) {
    if place == start {
        *range = (range.0.min(counter.halves), range.1.max(counter.halves));
    }
    if steps == 0 {
        return;
    }
    for next in [place - 1, place + 1] {
        let mut counter = counter;
        counter.step_to(next);
        back_at_the_start(counter, start, next, steps - 1, range);
    }
}

#[test]
fn over_all_ways_of_sixteen_steps_the_paper_s_counter_does_not_come_home() {
    let range = |mends| {
        let mut range = (0, 0);
        for start in 0..4 {
            back_at_the_start(PaperCounter::at(start, mends), start, start, 16, &mut range);
        }
        range
    };
    assert_eq!(range(Mends::Nothing), (-16, 16), "a count each time there and back");
    assert_eq!(range(Mends::AsPrinted), (-15, 2), "still, when it moves back");
    assert_eq!(range(Mends::BothWays), (-1, 1), "half a count, by where it comes from: there is no drift");
}

/// The same ways through the decoder.
#[test]
fn over_the_same_ways_the_decoder_does_come_home() {
    for start in 0..4 {
        let (a, b) = levels(start);
        let counters = MODES.map(|decode| QuadratureCounter::decoding(decode, 1, a, b));
        let mut homes = 0;
        come_home(&counters, start, start, 16, &mut homes);
        assert!(homes > 10_000);
    }
}

fn come_home(counters: &[QuadratureCounter; 3], start: i64, place: i64, steps: u64, homes: &mut u32) {
    for next in [place - 1, place + 1] {
        let (mut counters, (a, b), clock) = (counters.clone(), levels(next), 16 - steps);
        for counter in &mut counters {
            counter.edge(clock, a, b, false);
            let reading = counter.read(clock + 1);
            assert!(next != start || reading.counter == 0);
            assert_eq!(reading.illegal, 0);
        }
        *homes += u32::from(next == start);
        if steps > 1 {
            come_home(&counters, start, next, steps - 1, homes);
        }
    }
}

/// So many samples a sequence has; the first is what the decoder finds when it is made.
const SAMPLES: usize = 12;
const MODES: [Decode; 3] = [Decode::X1, Decode::X2, Decode::X4];

/// The counter at a place, up to where it began.
fn counted(decode: Decode, place: i64) -> i64 {
    match decode {
        Decode::X1 => (place + 3).div_euclid(4),
        Decode::X2 => (place + 1).div_euclid(2),
        Decode::X4 => place,
    }
}

/// Phase of levels 2·B + A.
const fn phase(levels: u8) -> i64 {
    (levels ^ (levels >> 1)) as i64
}

/// The motion from one pair of levels to the next; `None` if both changed.
fn step(before: u8, now: u8) -> Option<i64> {
    match (phase(now) - phase(before)).rem_euclid(4) {
        2 => None,
        3 => Some(-1),
        step => Some(step),
    }
}

/// Decoders, and what they must have counted.
#[derive(Clone)]
struct Walk {
    counters: [QuadratureCounter; 3],
    /// Levels behind the filter, by the definition of the filter.
    passed: u8,
    /// The place since the last illegal transition, where it was the phase.
    place: i64,
    /// Where the count of that place began, mode by mode.
    origin: [i64; 3],
    glitches: u16,
    illegal: u16,
    /// Motion and illegal transitions of the line before the filter.
    line: (i64, u16),
}

impl Walk {
    fn begin(filter: u8, levels: u8) -> Self {
        let (a, b) = (levels & 1 != 0, levels & 2 != 0);
        Self {
            counters: MODES.map(|decode| QuadratureCounter::decoding(decode, filter, a, b)),
            passed: levels,
            place: phase(levels),
            origin: MODES.map(|decode| -counted(decode, phase(levels))),
            glitches: 0,
            illegal: 0,
            line: (0, 0),
        }
    }

    /// The last of `samples` comes.
    fn sample(&mut self, filter: u8, samples: &[u8]) {
        let [.., before, now] = *samples else { return };
        match step(before, now) {
            Some(step) => self.line.0 += step,
            None => self.line.1 += 1,
        }
        let passed = passed(filter, samples, self.passed);
        let illegal = u16::from(step(self.passed, passed).is_none());
        match step(self.passed, passed) {
            Some(step) => self.place += step,
            None => self.begin_again(phase(passed)),
        }
        (self.passed, self.illegal) = (passed, self.illegal + illegal);
        let clock = samples.len() as u64;
        for (mode, counter) in self.counters.iter_mut().enumerate() {
            counter.edge(clock, now & 1 != 0, now & 2 != 0, false);
            let reading = counter.read(clock + 1);
            let expected = self.origin[mode] + counted(MODES[mode], self.place);
            assert_eq!(i64::from(reading.counter.cast_signed()), expected, "{:?}: {samples:?}", MODES[mode]);
            assert_eq!(reading.illegal, illegal, "{samples:?}");
            self.glitches += if mode == 0 { reading.glitches } else { 0 };
        }
        self.check_the_line(filter, clock);
    }

    /// An illegal transition moves nothing, and the place is anywhere of this phase.
    fn begin_again(&mut self, place: i64) {
        for (origin, decode) in self.origin.iter_mut().zip(MODES) {
            *origin += counted(decode, self.place) - counted(decode, place);
        }
        self.place = place;
    }

    /// If the levels held from here, and nothing was filtered away, the line itself would have been counted.
    fn check_the_line(&self, filter: u8, clock: u64) {
        if self.glitches == 0 {
            let held = self.counters[2].clone().read(clock + u64::from(filter));
            assert_eq!(i64::from(held.counter.cast_signed()), self.line.0);
            assert_eq!(self.illegal + held.illegal, self.line.1);
        }
    }
}

/// The filter by its definition: a pin passes a level that it had in the last `filter` samples.
fn passed(filter: u8, samples: &[u8], passed: u8) -> u8 {
    let first = samples.first().copied().unwrap_or(0);
    let (mut all, mut none) = (3, 3);
    for levels in samples.iter().rev().copied().chain([first; 3]).take(usize::from(filter)) {
        all &= levels;
        none &= !levels;
    }
    (passed | all) & !none
}

/// All continuations of a sequence; how many sequences of the full length there were.
fn descend(filter: u8, walk: &Walk, samples: &mut Vec<u8>) -> u64 {
    if samples.len() == SAMPLES {
        return 1;
    }
    let mut sequences = 0;
    for levels in 0..4 {
        let mut walk = walk.clone();
        samples.push(levels);
        walk.sample(filter, samples);
        sequences += descend(filter, &walk, samples);
        samples.pop();
    }
    sequences
}

fn every_sequence(filter: u8) {
    let begin = |levels| descend(filter, &Walk::begin(filter, levels), &mut vec![levels]);
    assert_eq!((0..4).map(begin).sum::<u64>(), 4_u64.pow(SAMPLES as u32));
}

#[test]
fn no_sequence_of_levels_costs_a_count_without_a_filter() {
    every_sequence(1);
}

#[test]
fn no_sequence_of_levels_costs_a_count_behind_a_filter_of_two() {
    every_sequence(2);
}

#[test]
fn no_sequence_of_levels_costs_a_count_behind_a_filter_of_three() {
    every_sequence(3);
}
