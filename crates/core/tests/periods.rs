//! No lost period: comparators, counter, converter and head from end to end, beside the truth in every tick; and what is
//! lost, and seen of it, beyond the limits.

#[path = "../examples/periods/grating.rs"]
mod grating;
#[path = "../examples/periods/motion.rs"]
mod motion;
#[path = "../examples/periods/track.rs"]
mod track;

use motion::Pace;
use track::{Tally, Track};

/// Edges of each of four runs with a counter; `cargo xtask figures periods` runs thousands of millions.
const EDGES: u64 = 2_500_000;
/// 14 clocks: pulses shorter than 100 ns.
const FILTER: u8 = 14;

/// A run at each speed, with the ellipse known and not; nothing is lost in any.
fn runs(counted: bool, edges: u64) -> Tally {
    let mut tally = Tally::default();
    for (speed_mm_s, known) in [(5.0, true), (5.0, false), (50.0, true), (50.0, false)] {
        let track = Track { counted, known, ..Track::at(Pace::of_a_stage(speed_mm_s), FILTER) };
        let run = track.run(edges, 1);
        assert!(run.is_within(track.bound()), "{track:?}: {run:?}");
        assert!(run.worst_periods() > track.bound() / 4.0, "no poor signal: {track:?}: {run:?}");
        tally = tally.and(&run);
    }
    // The stage turned everywhere.
    assert!(tally.edges >= 4 * edges && tally.turns.as_flattened().iter().all(|&turns| turns > 100));
    tally
}

#[test]
fn of_ten_million_edges_of_a_poor_signal_none_costs_a_period() {
    let tally = runs(true, EDGES);
    // The comparators chattered, and the filter was at work.
    assert!(tally.changes > tally.edges + tally.edges / 200 && tally.glitches > 10_000, "{tally:?}");
}

#[test]
fn without_a_counter_no_period_is_lost_at_the_accelerations_of_a_stage() {
    runs(false, EDGES);
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let track = Track::at(Pace::of_a_stage(5.0), FILTER);
    assert_eq!(track.run(10_000, 7), track.run(10_000, 7));
    assert_ne!(track.run(10_000, 7), track.run(10_000, 8));
}

/// A level lasts two counts, 250 clocks at 200 mm/s: shorter than this filter.
#[test]
fn counts_that_a_filter_swallows_are_a_fault_of_the_signals() {
    let track = Track::at(Pace::of_a_stage(200.0), 255);
    let tally = track.run(EDGES, 1);
    assert!(tally.lost > 100 && tally.periods > 10 && tally.faults > 10, "{tally:?}");
}

/// Half a period in a tick's square is 40 m/s².
#[test]
fn without_a_counter_too_much_acceleration_is_a_fault_of_the_signals() {
    let pace = Pace { speed_mm_s: 50.0, accelerations_m_s2: [45.0, 60.0] };
    let tally = Track { counted: false, ..Track::at(pace, FILTER) }.run(EDGES, 1);
    assert!(tally.periods > 100 && tally.faults > 10, "{tally:?}");
}

/// At 50 mm/s the stage goes 0.4 µm, half a period, in 8 µs.
#[test]
fn samples_and_counts_of_different_places_are_a_fault_of_the_signals() {
    let track = Track { jitter: 1000, ..Track::at(Pace::of_a_stage(50.0), FILTER) };
    let tally = track.run(EDGES, 1);
    assert!(tally.lost == 0 && tally.faults > 1000, "{tally:?}");
}
