//! How fast the programs are exact, found by going beyond.

use crate::decoder::{Decoder, LOOP};
use crate::emitter::{Emitters, Wrong};
use crate::signal::{Encoder, Motion};
use abbe_core::edge::StepRate;
use abbe_core::front::DecoderWords;

/// Clocks between two ticks of the processor that reads a decoder.
const TICK: u64 = 12_500;
/// A processor gets at a FIFO once in so many clocks.
const PACE: u32 = 8;
/// Counts from one reference mark to the next.
const MARKS: i64 = 2000;

/// An encoder with an edge each `clocks` clocks, in strokes of both directions.
fn steady(clocks: u64, marks: i64) -> Motion {
    Motion { closest: clocks, farthest: clocks, stroke: 5000, disturbed: 0, index_disturbed: 0, marks }
}

/// How many of `edges` edges, `clocks` clocks apart, were not counted as they should: illegal transitions, and what the
/// count is off in the end.
pub fn edges_lost(clocks: u64, edges: u64) -> u64 {
    let mut encoder = Encoder::new(steady(clocks, 0), 1);
    let mut decoder = Decoder::new();
    let (mut first, mut last, mut illegal) = (None, 0, 0);
    let mut rest = 3 * LOOP;
    let mut clock = 0;
    while rest > 0 {
        // Time stands still for the encoder once it has made its edges, so that the last one is seen.
        let done = encoder.edges() >= edges;
        rest -= u64::from(done);
        clock += u64::from(!done);
        decoder.step(encoder.lines(clock));
        if let Some(word) = decoder.counted() {
            if first.is_some() {
                illegal += u64::from((last as u8).wrapping_sub(word as u8));
            }
            last = word;
            first.get_or_insert(word);
        }
    }
    let moved = ((last >> 8).wrapping_sub(first.unwrap_or(0) >> 8) << 8).cast_signed() >> 8;
    illegal + encoder.count().abs_diff(i64::from(moved))
}

/// Indices found where they are, and marks passed, when a mark is one count wide and an edge comes each `clocks` clocks.
pub fn indices_found(clocks: u64, edges: u64) -> (usize, usize) {
    let mut encoder = Encoder::new(steady(clocks, MARKS), 2);
    let mut decoder = Decoder::new();
    let mut clock = 0;
    let mut next = |encoder: &mut Encoder| {
        clock += 1;
        encoder.lines(clock)
    };
    let mut words = loop {
        decoder.step(next(&mut encoder));
        if let Some(word) = decoder.counted() {
            break DecoderWords::new(word);
        }
    };
    let mut right = 0;
    while encoder.edges() < edges {
        for _ in 0..TICK {
            decoder.step(next(&mut encoder));
        }
        let reading = decoder.tick(&mut words, PACE, |_| next(&mut encoder)).reading;
        let found = reading.index.map(|index| i64::from(index.cast_signed()).rem_euclid(MARKS));
        right += usize::from(found == Some(MARKS / 2));
    }
    // Every stroke ends between two marks, so there was one mark every so many edges.
    (right, (encoder.edges() / MARKS.unsigned_abs()) as usize)
}

/// Pulses of both axes at once at `rate` pulses per tick (16 fractional bits), one going upwards and one turning in every
/// tick.
///
/// # Errors
/// The first thing that the pins did and no train promised.
///
/// # Panics
/// If pulses never come.
pub fn pulses_exact(clocks_per_tick: u32, rate: i32, ticks: u64) -> Result<u64, Wrong> {
    let mut emitters = Emitters::new(clocks_per_tick);
    let mut pulses = 0;
    for tick in 0..ticks {
        let turning = if tick % 2 == 0 { rate } else { -rate };
        let trains = emitters.begin_tick([StepRate(rate), StepRate(turning)]);
        pulses += trains.iter().map(|train| u64::from(train.pulses)).sum::<u64>();
        while emitters.clock() + 100 < emitters.promised_until() {
            emitters.step()?;
        }
    }
    while emitters.clock() < emitters.promised_until() + 200 {
        emitters.step()?;
    }
    let left = emitters.outstanding();
    assert!(left == 0, "{left} pulses never came");
    Ok(pulses)
}
