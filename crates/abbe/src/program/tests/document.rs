//! The document says what the check says.

use super::checked;
use crate::program::{check, feed, steps};

const DOCUMENT: &str = include_str!("../../../../../docs/gcode.md");

#[test]
fn the_error_in_the_document_is_said() {
    let checked = checked(&b"G0 X95 Y40\nG3 Y60 J10 F60"[..]);
    let said = format!("\nfield.nc, {}\n", checked.errors[0]);
    assert!(DOCUMENT.contains(&said), "docs/gcode.md must say: {said}");
}

#[test]
fn the_document_says_how_many_are_told() {
    for said in [
        format!("the first {} one by one, then", check::MOST),
        format!("the first {} one by one. ", feed::MOST),
    ] {
        assert!(DOCUMENT.contains(&said), "docs/gcode.md must say: {said}");
    }
}

#[test]
fn the_document_says_what_a_corner_without_a_tolerance_has() {
    let said = format!("without P by {} µm.", steps::USUAL_TOLERANCE.um());
    assert!(DOCUMENT.contains(&said), "docs/gcode.md must say: {said}");
}

/// The program at the head of the document is good, and no feed of it is too fast.
#[test]
fn the_program_in_the_document_fits_the_stage() {
    let program = DOCUMENT.split("```").nth(1).and_then(|block| block.split_once('\n')).unwrap().1;
    let checked = checked(program.as_bytes());
    assert_eq!((checked.count, checked.feeds.limited.len(), checked.summary.ends), (0, 0, true));
}

/// The error of steps that are too fast, as a run on a stage tells it.
#[test]
fn the_document_says_what_steps_cannot_do() {
    let survey = crate::program::stepwise::tests::survey("G1 X10 F60\n", 0.1, true);
    let said = format!("\nfield.nc, {}\n", survey.checked.errors[0]);
    assert!(DOCUMENT.contains(&said), "docs/gcode.md must say: {said}");
    let said = format!("the first {} motions one by one.", crate::program::stepwise::survey::MOST);
    assert!(DOCUMENT.contains(&said), "docs/gcode.md must say: {said}");
}
