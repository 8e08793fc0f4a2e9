//! The controller as a stranger meets it: his plant, the two types of the edge, and nothing else.

#[allow(dead_code, reason = "`main` of the example prints what is checked here")]
#[path = "../examples/my_own_plant.rs"]
mod my_own_plant;

use abbe_core::machine::State;
use abbe_core::publish::Outcome;

#[test]
fn a_plant_of_ones_own_homes_and_arrives() {
    let (status, true_mm) = my_own_plant::drive();
    assert_eq!((status.state, status.fault), (State::Ready, None));
    assert_eq!(status.last_move.map(|report| report.outcome), Some(Outcome::Arrived), "{status:?}");
    assert_eq!(status.axes[0].home.count, 1);
    // The window is half a micrometre, a count a tenth.
    assert!((true_mm - 8.0).abs() < 0.6e-3, "{true_mm} mm");
}

#[test]
fn fifty_lines_are_enough() {
    let source = include_str!("../examples/my_own_plant.rs");
    let (_, body) = source.rsplit_once("\nuse ").expect("the example imports the controller");
    let is_code = |line: &&str| !line.trim().is_empty() && !line.trim().starts_with("//");
    // The first line is the rest of the last import.
    let lines = body.lines().skip(1).filter(is_code).count();
    assert!(lines <= 50, "{lines} lines");
}
