//! A whole small program.

use super::*;

/// Scans a field in lines, then a circle about a mark, then home.
const PROGRAM: &str = "\
%
(scan of one field, 2 mm wide)
N10 G21 G17 G90 G94 G40 G49 G80
N20 G10 L2 P2 X10 Y20 (corner of the field)
N30 G55 G64 P0.0005
N40 G0 X0 Y0
N50 G1 X2 F300
N60 G3 Y0.1 R0.05 (turn outside the image)
N70 G1 X0
/N80 M0 (look at it)
N90 G4 P0.2
N100 G61 G91 G0 X1 Y0.4
N110 G90 G2 X1 Y0.5 I0.25 J0 F60
%";

const TRACE: &str = "\
origin 1 (10, 20)
line (0, 0) to (10, 20) rapid blend 0.0005
line (10, 20) to (12, 20) F300 blend 0.0005
arc ccw (12, 20) to (12, 20.1) about (12, 20.05) F300 blend 0.0005
line (12, 20.1) to (10, 20.1) F300 blend 0.0005
dwell 200000000 ns
line (10, 20.1) to (11, 20.5) rapid
circle cw (11, 20.5) to (11, 20.5) about (11.25, 20.5) F60
";

#[test]
fn a_program_gives_its_actions_in_order() {
    let mut state = State::new([Pos::ZERO; 2]);
    let mut trace = String::new();
    for line in PROGRAM.lines() {
        let effect = read(&mut state, line.as_bytes()).unwrap_or_else(|error| panic!("{line}: {error}"));
        if effect.action.is_some() {
            trace += &show(&effect);
            trace += "\n";
        }
    }
    assert_eq!(trace, TRACE);
    assert_eq!(Modes(&state).to_string(), "G2 G55 G17 G21 G90 G94 G91.1 G40 G49 G61 M5 M9 F60");
    let end = read(&mut state, b"M30").unwrap();
    assert_eq!(show(&end), "nothing, end");
    assert_eq!(Modes(&state).to_string(), "G1 G54 G17 G21 G90 G94 G91.1 G40 G49 G61 M5 M9 F60");
}

/// The words of a report, read again, give the modes they came from.
#[test]
fn modes_can_be_written_and_read_again() {
    let state = after(&["G20 G91 G57 G64 G3 F12.5"]);
    let report = Modes(&state).to_string();
    let again = after(&[&report]);
    assert_eq!(again, state);
}
