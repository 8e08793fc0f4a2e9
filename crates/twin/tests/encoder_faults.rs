//! What can happen to an analogue encoder is told, in time and as what it is; `cargo xtask figures faults` does the same
//! with a thousand seeds.

#[allow(dead_code, reason = "the example's main is not used here")]
#[path = "../examples/encoder_faults/main.rs"]
mod faults;

#[test]
fn every_fault_is_told_within_its_own_time_and_nothing_is_taken_for_one() {
    let broken: Vec<String> =
        faults::table(8).filter_map(|(case, tally)| faults::broken(case, &tally)).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn in_the_closed_loop_a_plug_at_any_level_ends_in_a_fault_and_chatter_costs_no_period() {
    let broken: Vec<String> =
        faults::closed::table(12).filter_map(|(row, tally)| faults::closed::broken(row, &tally)).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}
