//! Programs on a stage, where the built program cannot look.

use super::USUAL;
use crate::program::ahead::Ahead;
use crate::program::runner::{Ran, Runner, start_mm};
use crate::program::steps::USUAL_TOLERANCE;
use crate::program::watch::Watch;
use crate::rig::Rig;
use crate::rig::tests::rig;
use abbe_core::Pos;
use std::time::Duration;

/// A homed stage, and what it did for a program.
fn ran(program: &'static str, patience: Option<Duration>) -> (Rig, Ran) {
    let mut rig = rig(1);
    rig.home().unwrap();
    rig.move_to(start_mm(&USUAL)).unwrap();
    let mut watch = Watch::new(rig.tick_hz(), None, false).unwrap();
    let ahead = Ahead::new(program.as_bytes(), patience, |_| ());
    let ran = Runner::new("field.nc", &USUAL, &mut rig, &mut watch, false).run(&ahead).unwrap();
    (rig, ran)
}

/// Wherever the input is thought to pause, all of it is done.
#[test]
fn pauses_of_the_input_change_only_where_the_stage_rests() {
    let program = "G64\nG1 X1 F600\nY1\n\nX0.5\n(end)\nM2\nG0 X9";
    for patience in [None, Some(Duration::ZERO)] {
        let (rig, ran) = ran(program, patience);
        assert_eq!((ran.segments, ran.checked.count), (3, 0));
        let targets = rig.status().axes.map(|axis| axis.target);
        assert_eq!(targets, [0.5, 1.0].map(Pos::from_mm));
        assert!(ran.path_s > 0.25 + 0.1, "{}", ran.path_s);
    }
}

#[test]
fn a_dwell_begins_when_the_stage_has_arrived() {
    let (rig, ran) = ran("G0 X1\nG4 P0.5\n", None);
    let (other, _) = self::ran("G0 X1\n", None);
    assert!(ran.arrival.is_some());
    assert!((rig.time_s() - other.time_s() - 0.5).abs() < 1e-9);
}

#[test]
fn nothing_to_go_is_no_segment() {
    let (rig, ran) = ran("G0 X0\nG1 F600\nG28\n", None);
    assert_eq!((ran.segments, ran.path_s, ran.arrival.is_none()), (0, 0.0, true));
    assert_eq!(rig.status().axes.map(|axis| axis.target), [Pos::ZERO; 2]);
}

/// Without P a corner is cut as by the constant: sooner than with a stop, and not as soon as with more. The corners are
/// blunt; in sharp ones a stop takes no longer.
#[test]
fn corners_without_a_tolerance_have_the_usual_one() {
    let time = |words: &str| {
        let program = format!("{words}\nG1 X1 F600\nX2 Y0.2\nX3 Y0.6\nX4 Y1.2\n").leak();
        ran(program, None).1.path_s
    };
    let usual = format!("G64 P{:.6}", USUAL_TOLERANCE.mm());
    let [stops, without, with, more] = ["G61", "G64", usual.as_str(), "G64 P0.002"].map(time);
    assert!(without == with && more < without && without < stops, "{stops} {without} {with} {more}");
}
