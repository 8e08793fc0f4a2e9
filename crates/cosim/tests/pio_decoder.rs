//! The decoder program counts what [`abbe_core::front::QuadratureCounter`] counts, word by word.

use abbe_core::front::DecoderWords;
use abbe_cosim::decoder::{Decoder, LOOP, Model};
use abbe_cosim::signal::{Encoder, Lines, Motion};

/// Edges of the longest run; `ABBE_EDGES` asks for more.
fn edges(usual: u64) -> u64 {
    std::env::var("ABBE_EDGES").ok().and_then(|edges| edges.parse().ok()).unwrap_or(usual)
}

const SMOOTH: Motion =
    Motion { closest: 25, farthest: 40, stroke: 5000, disturbed: 0, index_disturbed: 0, marks: 0 };

/// Counts from one reference mark to the next.
const MARKS: i64 = 2000;

/// What the counting machine pushes when the counter and the illegal transitions stand so.
fn word(first: u32, counter: u32, illegal: u64) -> u32 {
    let counter = (first >> 8).wrapping_add(counter);
    (counter << 8) | u32::from((first as u8).wrapping_sub(illegal as u8))
}

/// Runs decoder and model side by side and compares every word of both machines; returns the encoder and how many
/// illegal transitions there were.
fn compare_every_word(motion: Motion, seed: u64, edges: u64) -> (Encoder, u64) {
    let mut encoder = Encoder::new(motion, seed);
    let mut decoder = Decoder::new();
    let mut model = Model::new(encoder.lines(0));
    let (mut first, mut clock, mut look) = (None, 0, 0);
    while encoder.edges() < edges {
        let lines = encoder.lines(clock);
        decoder.step(lines);
        model.step(lines);
        clock += 1;
        let Some(counted) = decoder.counted() else { continue };
        let Some(first) = first else {
            first = Some(counted);
            assert_eq!(decoder.latched(), None);
            continue;
        };
        look += 1;
        let seen = model.at(look);
        assert_eq!(
            counted,
            word(first, seen.counter, seen.illegal),
            "look {look}, clock {clock}, seed {seed}"
        );
        let latched = seen.index_high.then_some(0x8000_0001_u32.wrapping_add(seen.counter));
        assert_eq!(decoder.latched(), latched, "look {look}, clock {clock}, seed {seed}");
    }
    assert_eq!(look, (clock - 10) / LOOP, "a loop took another time");
    let illegal = model.at(look).illegal;
    (encoder, illegal)
}

/// Without disturbances nothing may be lost against the encoder itself.
fn loses_nothing(motion: Motion, seed: u64, edges: u64) {
    let (encoder, illegal) = compare_every_word(motion, seed, edges);
    assert_eq!(illegal, 0);
    let mut decoder = Decoder::new();
    let mut again = Encoder::new(motion, seed);
    let (mut first, mut last, mut clock) = (None, 0, 0);
    let mut rest = 0;
    // The last edge must be seen too: two loops more at its level.
    while rest < 2 * LOOP {
        let done = again.edges() >= edges;
        let lines = if done { levels_at(encoder.count()) } else { again.lines(clock) };
        rest += u64::from(done);
        decoder.step(lines);
        clock += 1;
        if let Some(counted) = decoder.counted() {
            last = counted;
            first.get_or_insert(counted);
        }
    }
    let moved = (last >> 8).wrapping_sub(first.unwrap_or(0) >> 8);
    assert_eq!(moved << 8, (encoder.count() as u32) << 8);
}

fn levels_at(count: i64) -> Lines {
    let (a, b) = abbe_core::front::quadrature::levels(count);
    Lines::from(a) | (Lines::from(b) << 1)
}

#[test]
fn not_an_edge_is_lost_at_five_million_a_second() {
    compare_every_word(SMOOTH, 1, edges(3_000_000));
    loses_nothing(SMOOTH, 2, 100_000);
}

/// An edge each 11 clocks, 11.36 million a second, is the fastest that is exact.
#[test]
fn not_an_edge_is_lost_at_one_a_loop_and_edges_are_lost_beyond() {
    let motion = Motion { closest: 11, farthest: 25, ..SMOOTH };
    compare_every_word(motion, 3, edges(6_500_000));
    loses_nothing(motion, 4, 100_000);
    let motion = Motion { closest: 10, farthest: 10, ..SMOOTH };
    let (_, illegal) = compare_every_word(motion, 5, 20_000);
    assert!(illegal > 1000, "{illegal}");
}

#[test]
fn slow_edges_count_as_fast_ones() {
    loses_nothing(Motion { closest: 100, farthest: 3000, stroke: 300, ..SMOOTH }, 6, 10_000);
}

#[test]
fn disturbances_and_illegal_transitions_are_counted_alike() {
    let motion = Motion { disturbed: 300, index_disturbed: 500, ..SMOOTH };
    let (_, illegal) = compare_every_word(motion, 7, edges(500_000));
    assert!(illegal > 10_000, "{illegal}");
}

/// One tick after another as a processor reads them; compares readings, indices and glitches of Z.
fn compare_ticks(motion: Motion, seed: u64, ticks: u64, pace: u32) -> (Vec<u32>, Encoder, u64) {
    let mut encoder = Encoder::new(motion, seed);
    let mut decoder = Decoder::new();
    let mut model = Model::new(encoder.lines(0));
    let mut clock = 0;
    let mut go_on = |decoder: Option<&mut Decoder>, model: &mut Model| {
        let lines = encoder.lines(clock);
        clock += 1;
        model.step(lines);
        if let Some(decoder) = decoder {
            decoder.step(lines);
        }
        lines
    };
    for _ in 0..10 {
        go_on(Some(&mut decoder), &mut model);
    }
    let mut words = DecoderWords::new(decoder.counted().expect("the first word is there after ten clocks"));
    let (mut indices, mut glitches, mut illegal) = (Vec::new(), 0, 0);
    for tick in 0..ticks {
        for _ in 0..12_000 {
            go_on(Some(&mut decoder), &mut model);
        }
        let mut seen = None;
        let ticked = decoder.tick(&mut words, pace, |look| {
            let lines = go_on(None, &mut model);
            if model.looks() == look {
                seen = Some(model.at(look));
            }
            lines
        });
        let seen = seen.expect("the fresh word is of this tick");
        illegal += u64::from(ticked.reading.illegal);
        assert_eq!(
            (ticked.reading.counter, illegal),
            (seen.counter, seen.illegal),
            "tick {tick}, seed {seed}"
        );
        indices.extend(ticked.reading.index);
        glitches += u64::from(ticked.reading.glitches);
    }
    // The last pulse may not have ended.
    let known = model.indices().len().min(indices.len());
    assert!(model.indices().len() - known <= 1);
    assert_eq!(indices, model.indices()[..known], "seed {seed}");
    assert!(model.glitches() - glitches <= 1, "{} and {glitches}", model.glitches());
    (indices, encoder, glitches)
}

/// Each mark is one count wide; its index must be the count at which Z rose, in both directions, to the rate at which
/// the pulse of Z lasts two loops.
#[test]
fn the_index_is_latched_where_it_rose_up_to_an_edge_in_two_loops() {
    for (seed, closest, marks) in [(8, 22, 200), (9, 25, 200), (10, 60, 100), (11, 625, 10)] {
        let motion = Motion { closest, farthest: closest + 10, marks: MARKS, ..SMOOTH };
        let ticks = marks * MARKS.unsigned_abs() * (closest + 5) / 12_000;
        let (indices, _, glitches) = compare_ticks(motion, seed, ticks, 8);
        assert!(indices.len() as u64 >= marks / 2, "{} of {marks} at {closest}", indices.len());
        assert_eq!(glitches, 0);
        for index in indices {
            assert_eq!(
                i64::from(index.cast_signed()).rem_euclid(MARKS),
                MARKS / 2,
                "{closest} clocks an edge"
            );
        }
    }
}

#[test]
fn disturbances_of_the_index_are_glitches_or_indices_as_in_the_model() {
    for pace in [6, 8, 14] {
        let motion = Motion { index_disturbed: 80_000, ..SMOOTH };
        let (indices, _, glitches) = compare_ticks(motion, 12, 3000, pace);
        assert!(indices.len() > 50 && glitches > 50, "{} {glitches}", indices.len());
    }
}
