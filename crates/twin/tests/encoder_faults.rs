//! What can happen to an analogue encoder is noticed, in time and as what it is; `cargo xtask figures faults` does the same
//! with a thousand seeds.

#[allow(dead_code, reason = "the example's main is not used here")]
#[path = "../examples/encoder_faults.rs"]
mod faults;

#[test]
fn every_fault_is_noticed_in_time_and_nothing_is_taken_for_one() {
    for (name, tally) in faults::table(10) {
        assert_eq!((tally.unnoticed, tally.wrong, tally.late), (0, 0, 0), "{name}: {tally:?}");
        // Half a grating period and what a stage goes in three ticks.
        assert!(tally.worst_um < 0.4 + 1.2, "{name}: {tally:?}");
    }
}
