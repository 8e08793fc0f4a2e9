//! No lost count within the limits of `front::quadrature`, and what is lost, and seen of it, beyond them.

#[path = "../examples/edges/line.rs"]
mod line;

use abbe_core::front::quadrature::levels;
use abbe_core::front::{QuadratureCounter, Reading, filter_for};
use line::{Line, Tally};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Five million edges at each speed; `cargo xtask figures edges` runs ten thousand million.
const EDGES: u64 = 5_000_000;
const FILTER: u8 = 14;

#[test]
fn of_ten_million_disturbed_edges_none_is_lost() {
    assert_eq!(filter_for(100), Ok(FILTER));
    let run = |speed_mm_s| Line::at(speed_mm_s, 0.2, FILTER).run(EDGES, 1);
    let (slow, fast) = (run(5.0), run(50.0));
    assert_eq!(slow, run(5.0), "the same for the same seed");
    let tally: Tally = slow.and(&fast);
    assert_eq!(tally.edges, 2 * EDGES);
    assert_eq!((tally.lost, tally.illegal), (0, 0));
    // All of it happened: turns both ways at each phase, chatter, noise, and the filter at work.
    assert!(tally.turns.as_flattened().iter().all(|&turns| turns > 1000), "{:?}", tally.turns);
    assert!(tally.bounces > EDGES / 10 && tally.pulses > EDGES / 10);
    assert!(tally.glitches > tally.pulses, "each pulse, and of the bounces the short ones");
}

#[test]
fn noise_three_times_as_long_as_the_filter_costs_counts_and_the_run_says_so() {
    let line = Line { noise: 3 * FILTER, ..Line::at(5.0, 0.2, FILTER) };
    let tally = line.run(EDGES / 10, 1);
    assert!(tally.lost > 1000 && tally.illegal > 1000, "{tally:?}");
}

/// What a counter reads after levels at their clocks.
fn read(filter: u8, changes: &[(u64, (bool, bool))]) -> Reading {
    let mut counter = QuadratureCounter::new(filter, false, false);
    for &(clock, (a, b)) in changes {
        counter.edge(clock, a, b, false);
    }
    counter.read(u64::MAX - 1)
}

/// Forward without noise, an edge each `spacing` clocks.
fn steady(spacing: u64, edges: i64) -> Reading {
    let changes: Vec<_> = (1..=edges).map(|n| (n as u64 * spacing, levels(n))).collect();
    read(FILTER, &changes)
}

#[test]
fn a_channel_whose_pulses_are_as_long_as_the_filter_is_counted_and_shorter_ones_are_glitches() {
    let reading = steady(7, 4000);
    assert_eq!((reading.counter, reading.illegal, reading.glitches), (4000, 0, 0));
    let reading = steady(6, 4000);
    assert_eq!((reading.counter, reading.illegal, reading.glitches), (0, 0, 2000), "nothing illegal to see");
}

/// However fast and uneven the way: an orderly line that loses counts leaves glitches behind.
#[test]
fn no_count_of_an_orderly_line_is_lost_without_a_glitch() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let (mut exact, mut lost) = (0, 0);
    for way in 0..20_000 {
        let (mut clock, mut place, longest) = (0, 0, 2 + way % 30);
        let changes: Vec<_> = (0..random.random_range(1..60))
            .map(|_| {
                clock += random.random_range(1..=longest);
                place += if random.random_bool(0.8) { 1 } else { -1 };
                (clock, levels(place))
            })
            .collect();
        let reading = read(FILTER, &changes);
        if i64::from(reading.counter.cast_signed()) == place {
            exact += 1;
        } else {
            lost += 1;
            assert!(reading.glitches > 0, "{changes:?}");
        }
    }
    assert!(exact > 1000 && lost > 1000, "{exact}, {lost}");
}

#[test]
fn two_edges_between_two_clocks_are_illegal_and_three_or_four_alias() {
    let (counter, illegal) = (|r: Reading| r.counter.cast_signed(), |r: Reading| r.illegal);
    for (edges, seen) in [(2, (0, 1)), (3, (-1, 0)), (4, (0, 0))] {
        let reading = read(FILTER, &[(10, levels(edges))]);
        assert_eq!((counter(reading), illegal(reading)), seen, "{edges} edges");
    }
}

/// A pulse on A that the filter lets pass, with an edge of B inside: B counts the wrong way, and A twice.
#[test]
fn noise_longer_than_the_filter_across_an_edge_costs_four_counts_and_leaves_nothing_behind() {
    let (with_noise, after) = ((true, true), levels(-1));
    let reading = read(FILTER, &[(100, (true, false)), (120, with_noise), (140, after)]);
    assert_eq!((reading.counter.cast_signed(), reading.illegal, reading.glitches), (3, 0, 0));
}

/// A short pulse on A just after its edge starts the filter again, and B, which comes before that is over, overtakes.
#[test]
fn noise_that_delays_an_edge_past_the_next_costs_four_counts_and_is_a_glitch() {
    let (a, a_and_b) = (levels(1), levels(2));
    let reading = read(
        FILTER,
        &[(100, a), (110, levels(0)), (112, a), (115, a_and_b), (116, (false, true)), (118, a_and_b)],
    );
    assert_eq!((reading.counter.cast_signed(), reading.illegal), (-2, 0), "instead of 2");
    assert!(reading.glitches > 0);
}
