//! Row B9: homing repeats to one count, from wherever the stage stands.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use abbe_core::Pos;
use abbe_twin::Event;
use abbe_twin::noise::Noise;
use common::{Stage, plant};

const COUNT: Pos = Pos::from_pm(100_000);

/// Homings in CI; `cargo xtask figures homing` makes 200.
const HOMINGS: usize = 20;

#[test]
fn the_zero_repeats_to_one_count_from_random_places() {
    let mut stage = Stage::homed(&plant(), 11);
    let first = stage.twin.truth().slides_um;
    let mut places = Noise::new(11, "places");
    let mut moved = 0;
    for _ in 0..HOMINGS {
        stage.go(places.uniform(0.0, 30.0), places.uniform(0.0, 30.0));
        stage.home();
        for axis in stage.controller.status().axes {
            let shift = axis.home.zero_shift.unwrap();
            assert!(shift.abs() <= COUNT, "{shift:?}");
            moved += u32::from(shift != Pos::ZERO);
        }
    }
    assert!(moved > 0, "the reference mark of a real scale does not repeat better than to a count");
    // And it is truly the same place, not only by the stage's own reckoning.
    stage.go(0.0, 0.0);
    let again = stage.twin.truth().slides_um;
    stage.home();
    stage.go(0.0, 0.0);
    for ((first, again), now) in first.iter().zip(again).zip(stage.twin.truth().slides_um) {
        assert!((again - now).abs() < 1.2, "{again} {now}");
        assert!((first - now).abs() < 500.0);
    }
}

#[test]
fn a_moved_switch_is_reported_and_the_zero_stays() {
    let mut stage = Stage::homed(&plant(), 12);
    stage.twin.happen(Event::MoveSwitch { axis: 1, um: -300.0 }).unwrap();
    stage.home();
    let [x, y] = stage.controller.status().axes.map(|axis| axis.home);
    assert!(y.zero_shift.unwrap().abs() <= COUNT);
    // Two closings, each with a scatter of 20 µm rms: three sigma of their difference are 85 µm.
    assert!((y.switch_shift.unwrap().um() + 300.0).abs() < 85.0, "{:?}", y.switch_shift);
    assert!(x.switch_shift.unwrap().um().abs() < 85.0, "{:?}", x.switch_shift);
}

#[test]
fn a_zero_that_moved_is_reported() {
    // Counts that nobody saw: the plug is out while the drives are off and somebody pushes the slide.
    let mut stage = Stage::homed(&plant(), 13);
    stage.go(20.0, 20.0);
    stage.controller.command(abbe_core::Command::Disable).unwrap();
    stage.wait(0.1);
    let before = stage.twin.truth().slides_um[0];
    stage.twin.happen(Event::Encoder { axis: 0, connected: false }).unwrap();
    stage.twin.happen(Event::Push { axis: 0, newton: 40.0 }).unwrap();
    stage.wait(0.3);
    stage.twin.happen(Event::Push { axis: 0, newton: 0.0 }).unwrap();
    stage.wait(0.1);
    stage.twin.happen(Event::Encoder { axis: 0, connected: true }).unwrap();
    stage.wait(0.1);
    let pushed = stage.twin.truth().slides_um[0] - before;
    assert!(pushed > 20.0, "pushed {pushed} µm");
    stage.home();
    let shift = stage.controller.status().axes[0].home.zero_shift.unwrap().um();
    // The counter missed the push, so the mark is found so much lower than expected.
    assert!((shift + pushed).abs() < 0.01 * pushed + 1.0, "{shift} after {pushed}");
}
