//! Blocks that are accepted, and what they give.

use super::*;

/// Lines that were read before, a line, and its effect. A `|` parts the lines before.
#[rustfmt::skip]
const BLOCKS: &[(&str, &str, &str)] = &[
    // How a line may look.
    ("", "", "nothing"),
    ("", " \t\r\n", "nothing"),
    ("", "%", "nothing"),
    ("", "% (head) ; of a program", "nothing"),
    ("", "(only a comment: G1 X* / % \u{e9}\u{ff})", "nothing"),
    ("", "; G1 X1", "nothing"),
    ("", "N10", "nothing"),
    ("", "g0x1.5y-.25", "line (0, 0) to (1.5, -0.25) rapid"),
    ("", "  G 00\tX +001. (here) Y 2 ; there", "line (0, 0) to (1, 2) rapid"),
    ("", "X1(a)Y2", "line (0, 0) to (1, 2) rapid"),
    ("", "/G0 X1", "nothing"),
    ("", "N999999999 X1", "line (0, 0) to (1, 0) rapid"),
    ("", "N3 X1*52", "line (0, 0) to (1, 0) rapid"),
    ("", "N3 X1*52 (sum) ; of all", "line (0, 0) to (1, 0) rapid"),
    ("", "X0.30000000000000004", "line (0, 0) to (0.3, 0) rapid"),
    // Lines.
    ("", "G1 X1 F60", "line (0, 0) to (1, 0) F60"),
    ("G1 F60", "X1", "line (0, 0) to (1, 0) F60"),
    ("G1 F60|X1 Y1", "Y0.000000001", "line (1, 1) to (1, 0.000000001) F60"),
    ("G1 F60", "G0", "nothing"),
    ("G1 F60|G80", "G0 X1", "line (0, 0) to (1, 0) rapid"),
    ("G80", "G90 G40 G49 G17 G91.1 M5 M9", "nothing"),
    ("X1", "X1", "line (1, 0) to (1, 0) rapid"),
    // Distance and units hold for their whole block.
    ("X1 Y1", "X1 G91", "line (1, 1) to (2, 1) rapid"),
    ("X1 Y1 G91|X.1|X.2", "Y-.1", "line (1.3, 1) to (1.3, 0.9) rapid"),
    ("", "X1 Y.1 G20", "line (0, 0) to (25.4, 2.54) rapid"),
    ("G20", "X0.00000001", "line (0, 0) to (0.000000254, 0) rapid"),
    ("G20|G1 F1", "X1", "line (0, 0) to (25.4, 0) F25.4"),
    ("G20|G1 F1", "X1 G21", "line (0, 0) to (1, 0) F25.4"),
    // Feed.
    ("G93", "G1 X1 F0.5", "line (0, 0) to (1, 0) 0.5/min"),
    ("G93", "G0 X1", "line (0, 0) to (1, 0) rapid"),
    ("G1 F60|G93", "X1 G94 F7", "line (0, 0) to (1, 0) F7"),
    ("G94 F60", "G94 G1 X1", "line (0, 0) to (1, 0) F60"),
    ("", "G1 X1 F0.000000001", "line (0, 0) to (1, 0) F0.000000001"),
    // Corners.
    ("G64 P.001", "X1", "line (0, 0) to (1, 0) rapid blend 0.001"),
    ("G64 P.001", "G64 X1", "line (0, 0) to (1, 0) rapid blend"),
    ("G20 G64 P.001", "X1 G21", "line (0, 0) to (1, 0) rapid blend 0.0254"),
    ("G64 P.001", "G61 X1", "line (0, 0) to (1, 0) rapid"),
    ("G64 P.001", "X1 G61.1", "line (0, 0) to (1, 0) rapid"),
    // Coordinate systems.
    ("", "G10 L2 P1 X1 Y2", "origin 0 (1, 2)"),
    ("G10 L2 P1 X1 Y2", "G10 L2 P0 Y3", "origin 0 (1, 3)"),
    ("G10 L2 P1 X1 Y2", "X1 Y1", "line (0, 0) to (2, 3) rapid"),
    ("G10 L2 P6 X1", "G59 X1", "line (0, 0) to (2, 0) rapid"),
    ("X5 Y6", "G10 L20 P3 X1", "origin 2 (4, 0)"),
    ("X5 Y6|G92 X1", "G10 L20 P0 X1 Y1", "origin 0 (0, 5)"),
    ("G10 L2 P2 X1 Y2|G55", "G53 G1 X1 F1", "line (0, 0) to (1, 0) F1"),
    ("G10 L2 P2 X1 Y2|G55 G91|X1", "G53 X3", "line (1, 0) to (3, 0) rapid"),
    ("X5 Y6", "G92 X1 Y1", "shift (4, 5)"),
    ("X5 Y6|G92 X1", "X2 Y2", "line (5, 6) to (6, 2) rapid"),
    ("X5 Y6|G92 X1|G92.1", "X2", "line (5, 6) to (2, 6) rapid"),
    ("X5 Y6|G92 X1", "G92.1", "shift (0, 0)"),
    ("G10 L2 P1 X10|X5|G92 X0", "G54 X1", "line (15, 0) to (16, 0) rapid"),
    // References.
    ("X5", "G28", "reference (5, 0) via (5, 0) to (0, 0)"),
    ("X5|G28.1|X7 Y7", "G28", "reference (7, 7) via (7, 7) to (5, 0)"),
    ("X5 Y5", "G28 G91 X1", "reference (5, 5) via (6, 5) to (0, 5)"),
    ("X5 Y5", "G30 X6 Y7", "reference (5, 5) via (6, 7) to (0, 0)"),
    ("X5 Y5|G30.1", "G28.1", "reference 0 is (5, 5)"),
    ("X5 Y5|G30 Y6", "X1", "line (5, 0) to (1, 0) rapid"),
    // Waiting and stopping.
    ("", "G4 P0.25", "dwell 250000000 ns"),
    ("", "P0 G4", "dwell 0 ns"),
    ("", "M0", "nothing, pause"),
    ("", "G0 X1 M2", "line (0, 0) to (1, 0) rapid, end"),
    ("G91 G55 G93 G0 G20|M30|F1", "X1", "line (0, 0) to (25.4, 0) F25.4"),
    // Arcs: every sense, from I and J and from R.
    ("G1 F9", "G3 X1 Y1 J1", "arc ccw (0, 0) to (1, 1) about (0, 1) F9"),
    ("G1 F9", "G2 X1 Y1 J1", "arc cw (0, 0) to (1, 1) about (0, 1) F9"),
    ("G1 F9", "G2 X0 Y0 I1 J1", "circle cw (0, 0) to (0, 0) about (1, 1) F9"),
    ("G3 F9", "I-1", "circle ccw (0, 0) to (0, 0) about (-1, 0) F9"),
    ("G3 F9|G93", "I-1 F2", "circle ccw (0, 0) to (0, 0) about (-1, 0) 2/min"),
    ("G1 F9 G20", "G2 X2 I1", "arc cw (0, 0) to (50.8, 0) about (25.4, 0) F228.6"),
    ("G1 F9 X1 Y1", "G91 G3 X1 Y1 J1", "arc ccw (1, 1) to (2, 2) about (1, 2) F9"),
    ("G1 F9", "G3 X1 Y1 R1", "arc ccw (0, 0) to (1, 1) about (0, 1) F9"),
    ("G1 F9", "G3 X1 Y1 R-1", "arc ccw (0, 0) to (1, 1) about (1, 0) F9"),
    ("G1 F9", "G2 X1 Y1 R1", "arc cw (0, 0) to (1, 1) about (1, 0) F9"),
    ("G1 F9", "G2 X1 Y1 R-1", "arc cw (0, 0) to (1, 1) about (0, 1) F9"),
    ("G1 F9", "G2 X-1 Y-1 R1", "arc cw (0, 0) to (-1, -1) about (-1, 0) F9"),
    ("G1 F9", "G3 X2 R1", "arc ccw (0, 0) to (2, 0) about (1, 0) F9"),
    ("G1 F9", "G3 X2.006 R1", "arc ccw (0, 0) to (2.006, 0) about (1.003, 0) F9"),
    ("G1 F9", "G3 X1.003 Y1 J1", "arc ccw (0, 0) to (1.003, 1) about (0, 1) F9"),
    ("G1 F9", "G3 X0 Y0.001 I-1", "arc ccw (0, 0) to (0, 0.001) about (-1, 0) F9"),
    // Sines.
    ("G1 F9", "G5.5 X10 P0.5 L2", "sine (0, 0) to (10, 0) 0.5 high 5 times from 0 F9"),
    ("G5.5 F9", "X3 Y4 P1 L2.501 Q90", "sine (0, 0) to (3, 4) 1 high 2 times from 90 F9"),
    ("G5.5 F9 G20", "Y-1 P.1 L.3333 Q0.5", "sine (0, 0) to (0, -25.4) 2.54 high 3 times from 0.5 F228.6"),
];

#[test]
fn each_block_gives_what_it_says() {
    let mut wrong = Vec::new();
    for (before, line, expected) in BLOCKS {
        let mut state = after(&before.split('|').collect::<Vec<_>>());
        let given =
            read(&mut state, line.as_bytes()).map_or_else(|error| error.to_string(), |effect| show(&effect));
        if given != *expected {
            wrong.push(format!("{before} then {line} gives {given}, not {expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_word_of_the_table_is_accepted() {
    for row in TABLE {
        let name = row.name;
        let line = match row.word {
            Word::Clockwise | Word::Counterclockwise => format!("{name} I1 F1"),
            Word::Sine => format!("{name} X2 P1 L1 F1"),
            Word::Dwell => format!("{name} P1"),
            Word::SetOrigin => format!("{name} L2 P1 X1"),
            Word::Machine | Word::Shift => format!("{name} X1"),
            _ => name.to_string(),
        };
        let mut state = after(&["X1 Y1"]);
        assert!(read(&mut state, line.as_bytes()).is_ok(), "{line}");
        if row.group.is_modal() {
            assert_eq!(state.in_force(row.group), Some(row.word), "{line}");
        }
    }
}

#[test]
fn a_deleted_block_is_done_when_it_is_not_skipped() {
    let mut state = after(&[]);
    state.skip_deleted(false);
    assert_eq!(show(&read(&mut state, b"/ X1").unwrap()), "line (0, 0) to (1, 0) rapid");
}

#[test]
fn a_block_tells_what_stood_beside_its_words() {
    let block = parse(b"N12 G0 X1").unwrap();
    assert_eq!((block.line_number(), block.is_deleted(), block.is_empty()), (Some(12), false, false));
    let block = parse(b"/N13 (text)").unwrap();
    assert_eq!((block.line_number(), block.is_deleted(), block.is_empty()), (Some(13), true, true));
    assert!(parse(b" %").unwrap().is_percent());
}

#[test]
fn what_was_kept_can_be_set_again() {
    let mut state = after(&[]);
    state.set_origin(1, [mm(1.0), mm(2.0)]);
    state.set_origin(6, [mm(9.0), mm(9.0)]);
    state.set_reference(0, [mm(3.0), mm(4.0)]);
    state.set_position([mm(5.0), mm(6.0)]);
    assert_eq!(state.origin(), [Pos::ZERO; 2]);
    assert_eq!(show(&read(&mut state, b"G55 X1").unwrap()), "line (5, 6) to (2, 6) rapid");
    assert_eq!(state.origin(), [mm(1.0), mm(2.0)]);
    assert_eq!(show(&read(&mut state, b"G28").unwrap()), "reference (2, 6) via (2, 6) to (3, 4)");
    assert_eq!((state.origin_of(6), state.reference(0)), ([Pos::ZERO; 2], [mm(3.0), mm(4.0)]));
}
