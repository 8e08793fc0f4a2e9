//! Lines that are refused: the column and the whole sentence.

use super::*;

/// Lines that were read before, parted by `|`, a line, and what is said.
#[rustfmt::skip]
const LINES: &[(&str, &str, &str)] = &[
    // Text.
    ("", "G0 X\u{e9}", "column 4: X has no number behind it; write one, like X1.5"),
    ("", "G0 \u{e9}", "column 4: the byte 195 is no character of a program; only comments may hold it"),
    ("", "G0 X1\u{7}", "column 6: the byte 7 is no character of a program; only comments may hold it"),
    ("", "G0\nX1", "column 3: the byte 10 is no character of a program; only comments may hold it"),
    ("", "G0 X1 & Y1", "column 7: & begins no word; remove it"),
    ("", "G0 X1)", "column 6: ) begins no word; remove it"),
    ("", "G0 X#5", "column 4: # stands for something to be computed, which is not done here; write the number"),
    ("", "#5=1", "column 1: # stands for something to be computed, which is not done here; write the number"),
    ("", "X[1+2]", "column 1: [ stands for something to be computed, which is not done here; write the number"),
    ("", "o<probe> call", "column 1: < stands for something to be computed, which is not done here; write the number"),
    ("", "X1 2", "column 4: a number without a letter; write a letter before it"),
    ("", "X1.2.3", "column 5: a number without a letter; write a letter before it"),
    ("", "X--1", "column 1: X has no number behind it; write one, like X1.5"),
    ("", "G1 X Y1", "column 4: X has no number behind it; write one, like X1.5"),
    ("", "X1e3", "column 3: E is no word, and numbers have no exponent; write 1000 for 1E3"),
    ("", "X1e", "column 3: E has no number behind it; write one, like E1.5"),
    ("", "Y1000000000", "column 1: the number of Y has more than nine digits before its point; correct it"),
    ("", "G1 (to X1", "column 4: the comment does not end; write a closing bracket"),
    ("", "G1 (to (X1)", "column 8: a bracket opens inside a comment; remove it"),
    ("", "G0 /X1", "column 4: a slash is not the first character of its line; put it there or remove it"),
    ("", "//X1", "column 2: a slash is not the first character of its line; put it there or remove it"),
    ("", "% G0", "column 1: a percent sign is not alone in its line; give it a line of its own"),
    ("", "X1 %", "column 4: a percent sign is not alone in its line; give it a line of its own"),
    ("", "G0 N1", "column 4: a line number is a whole number before all words; put it there, or leave it out"),
    ("", "N1 N2", "column 4: a line number is a whole number before all words; put it there, or leave it out"),
    ("", "N1.5", "column 1: a line number is a whole number before all words; put it there, or leave it out"),
    ("", "N3 X1*99", "column 6: the checksum is 99 and the line gives 52; send the line again"),
    ("", "N3 X1*", "column 6: a checksum is a number from 0 to 255 behind all words; correct it, or leave it out with its *"),
    ("", "N3 X1*256", "column 6: a checksum is a number from 0 to 255 behind all words; correct it, or leave it out with its *"),
    ("", "N3 X1*52 Y1", "column 6: a checksum is a number from 0 to 255 behind all words; correct it, or leave it out with its *"),
    // Words.
    ("", "G1 X1 Z2", "column 7: the stage has no Z, only X and Y, so there is no helix either; leave Z out"),
    ("", "G2 X1 K2", "column 7: the stage has no K, only X and Y, so there is no helix either; leave K out"),
    ("", "S1000", "column 1: S means nothing to a stage; leave it out"),
    ("", "M3", "column 1: M3 is not in the table of words; leave it out or write another one"),
    ("", "G0 G38.2", "column 4: G38.2 is not in the table of words; leave it out or write another one"),
    ("", "G1.25", "column 1: G1.25 is not in the table of words; leave it out or write another one"),
    ("", "G-1", "column 1: G-1 is not in the table of words; leave it out or write another one"),
    ("", "G18", "column 1: G18 chooses a plane with Z in it, and the stage has X and Y only; leave it out"),
    ("", "G19.0", "column 1: G19 chooses a plane with Z in it, and the stage has X and Y only; leave it out"),
    ("", "X1 Y2 X3", "column 7: X stands twice in the block; keep one"),
    ("", "G0 G1 X1", "column 4: G0 and G1 both choose the motion; keep one"),
    ("", "G1 G01", "column 4: G1 stands twice in the block and chooses the motion; keep one"),
    ("", "G20 G21", "column 5: G20 and G21 both choose the unit of lengths; keep one"),
    ("", "M2 M30", "column 4: M2 and M30 both choose where the program goes; keep one"),
    ("", "G53 G28", "column 5: G53 and G28 both choose what is done once; keep one"),
    // Numbers that words need, and those that nobody needs.
    ("", "G4", "column 1: G4 needs P, the seconds in its block; add what is missing"),
    ("", "G4 P-1", "column 4: P-1 is not a time of zero or more; correct the number"),
    ("", "G4 P1 X1", "column 7: no word of this block wants X; leave it out, or write it on a line of its own"),
    ("", "G4 P1 G1 X1", "column 7: G1 and G4 both want X and Y; write them on two lines"),
    ("", "X1 P2", "column 4: no word of this block wants P; leave it out, or write it on a line of its own"),
    ("", "X1 I2", "column 4: no word of this block wants I; leave it out, or write it on a line of its own"),
    ("", "G4 G64 P1", "column 8: two words of this block want P; write them on two lines"),
    ("", "G64 P0", "column 5: P0 is not more than zero; give a larger number"),
    ("", "G10 P1 X1", "column 1: G10 needs L2 or L20 in its block; add what is missing"),
    ("", "G10 L2 X1", "column 1: G10 needs P, the number of a coordinate system in its block; add what is missing"),
    ("", "G10 L2 P1", "column 1: G10 needs X or Y in its block; add what is missing"),
    ("", "G10 L3 P1 X1", "column 5: L3 is not 2 or 20; correct the number"),
    ("", "G10 L2 P7 X1", "column 8: P7 is not a coordinate system, 0 to 6; correct the number"),
    ("", "G10 L2 P1.5 X1", "column 8: P1.5 is not a coordinate system, 0 to 6; correct the number"),
    ("", "G92", "column 1: G92 needs X or Y in its block; add what is missing"),
    ("", "G92 G1 X1", "column 5: G1 and G92 both want X and Y; write them on two lines"),
    ("", "G1 G92 X1", "column 4: G1 and G92 both want X and Y; write them on two lines"),
    ("", "G28 G0 X1", "column 5: G0 and G28 both want X and Y; write them on two lines"),
    // Motion.
    ("G80", "X1", "column 1: G80 has switched motion off; write G0, G1, G2 or G3 before X and Y"),
    ("", "G80 Y1", "column 5: G80 has switched motion off; write G0, G1, G2 or G3 before X and Y"),
    ("", "G1 X1", "column 1: no feed was set for this motion; add F, a length in a minute"),
    ("G1", "Y2 X1", "column 1: no feed was set for this motion; add F, a length in a minute"),
    ("G1 F9|G93|G94", "X1", "column 1: no feed was set for this motion; add F, a length in a minute"),
    ("G1 F9|G93 X1 F2", "X2", "column 1: in G93 each motion needs a feed of its own; add F, one over its minutes, or write G94"),
    ("", "G1 X1 F0", "column 7: F0 is not more than zero; give a larger number"),
    ("", "G1 X1 F-5.50", "column 7: F-5.5 is not more than zero; give a larger number"),
    ("G20", "F100000000", "column 1: F100000000 is more than a million metres in a minute; correct it"),
    ("", "G53", "column 1: G53 needs X or Y in its block; add what is missing"),
    ("G3 F9", "G53 X1", "column 1: G53 goes with G0 and G1 only, and G3 is in force; write one of them"),
    ("G80", "G53 X1", "column 1: G53 goes with G0 and G1 only, and G80 is in force; write one of them"),
    ("", "X100000.1", "column 1: X leads more than 100 m away; correct the number or the unit"),
    ("G20", "Y-4000", "column 1: Y leads more than 100 m away; correct the number or the unit"),
    ("X100000|G91", "Y1 X1", "column 4: X leads more than 100 m away; correct the number or the unit"),
    ("X100000", "G92 X-1", "column 5: X leads more than 100 m away; correct the number or the unit"),
    ("X100000", "G10 L20 P1 X-1", "column 12: X leads more than 100 m away; correct the number or the unit"),
    // Arcs.
    ("G1 F9", "G2 X1", "column 1: G2 has no centre; add I and J, or R"),
    ("G2 F9", "X1", "column 1: G2 has no centre; add I and J, or R"),
    ("G1 F9", "G2 X1 I1 R1", "column 10: the arc has a centre and a radius; keep I and J, or R"),
    ("G1 F9", "G2 X1 I0", "column 7: the radius of the arc is zero; correct I and J, or R"),
    ("G1 F9", "G2 X1 R0", "column 7: the radius of the arc is zero; correct I and J, or R"),
    ("G1 F9", "G2 X0 R1", "column 7: the arc ends where it begins, and R does not tell where the centre of a full circle is; use I and J"),
    ("G1 F9", "G2 R1", "column 4: the arc ends where it begins, and R does not tell where the centre of a full circle is; use I and J"),
    ("G1 F9", "G2 X2.007 R1", "column 11: the ends are 2.007000 mm apart, more than twice the radius of 1.000000 mm; correct R, X or Y"),
    ("G1 F9", "G2 X20 Y0 I4", "column 11: the arc begins 4.000000 mm from its centre and ends 16.000000 mm from it, 12.000000 mm differ and 0.003000 mm may; correct I, J, X or Y"),
    ("G1 F9", "G3 X1.0031 Y1 J1", "column 15: the arc begins 1.000000 mm from its centre and ends 1.003100 mm from it, 0.003100 mm differ and 0.003000 mm may; correct I, J, X or Y"),
    ("G1 F9", "G3 X.0112 Y.01 J.01", "column 16: the arc begins 0.010000 mm from its centre and ends 0.011200 mm from it, 0.001200 mm differ and 0.001000 mm may; correct I, J, X or Y"),
    ("G1 F9", "G3 Y-.001 I-1", "column 11: the arc ends 0.001000 mm from its beginning, which may mean a full circle or none; leave X and Y out for a full circle, or use G1"),
    ("G1 F9", "G2 X.001 I-1", "column 10: the arc ends 0.001000 mm from its beginning, which may mean a full circle or none; leave X and Y out for a full circle, or use G1"),
    ("G1 F9", "G3 X.0005 I-1", "column 11: the arc ends 0.000500 mm from its beginning, which may mean a full circle or none; leave X and Y out for a full circle, or use G1"),
    ("G1 F9", "G2 X-.0005 I-1", "column 12: the arc ends 0.000500 mm from its beginning, which may mean a full circle or none; leave X and Y out for a full circle, or use G1"),
    // Sines.
    ("G1 F9", "G5.5 X10 L2", "column 1: G5.5 needs P, the amplitude in its block; add what is missing"),
    ("G5.5 F9", "X10 P1", "column 1: G5.5 needs L, the period in its block; add what is missing"),
    ("G1 F9", "G5.5 X10 P0 L2", "column 10: P0 is not more than zero; give a larger number"),
    ("G1 F9", "G5.5 X10 P1 L-2", "column 13: L-2 is not more than zero; give a larger number"),
    ("G1 F9", "G5.5 X10 P1 L2 Q360", "column 16: Q360 is not a phase from 0 to less than 360 degrees; correct the number"),
    ("G1 F9", "G5.5 X0 P1 L2", "column 1: the sine ends where it begins; correct X or Y"),
    ("G1 F9", "G5.5 X10 P1 L3", "column 13: the way of 10.000000 mm is no whole number of periods of 3.000000 mm, the nearest is 3; correct L, X or Y"),
    ("G1 F9", "G5.5 X1 P1 L3", "column 12: the way of 1.000000 mm is no whole number of periods of 3.000000 mm, the nearest is 0; correct L, X or Y"),
    ("G1 F9", "G5.5 X10.000001 P1 L.000001", "column 20: the sine has 10000001 periods, a million may be; divide it, or correct L"),
    ("G1 F9", "G5.5 P1 L3", "column 6: no word of this block wants P; leave it out, or write it on a line of its own"),
    ("G1 F9", "G64 G5.5 X9 P1 L3", "column 13: two words of this block want P; write them on two lines"),
];

#[test]
fn what_is_wrong_is_said_with_its_column_and_nothing_changes() {
    let mut wrong = Vec::new();
    for (before, line, expected) in LINES {
        let mut state = after(&before.split('|').collect::<Vec<_>>());
        let untouched = state;
        let said =
            read(&mut state, line.as_bytes()).map_or_else(|error| error.to_string(), |effect| show(&effect));
        if said != *expected {
            wrong.push(format!("{before} then {line} says {said}\n    not {expected}"));
        }
        assert_eq!(state, untouched, "{line}");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_line_may_have_256_characters() {
    let mut line = vec![b' '; 254];
    line.extend_from_slice(b"X1\r\n");
    assert!(read(&mut after(&[]), &line).is_ok());
    line.insert(0, b' ');
    let error = read(&mut after(&[]), &line).unwrap_err();
    assert_eq!(error.to_string(), "column 257: the line has 257 characters, 256 are read; divide it");
}

/// A fault without words would say nothing: every kind that a line can lead to is in the table above or here.
#[test]
fn every_fault_says_something_and_what_to_do() {
    let kinds: std::collections::HashSet<_> = LINES
        .iter()
        .map(|(before, line, _)| {
            let mut state = after(&before.split('|').collect::<Vec<_>>());
            core::mem::discriminant(&read(&mut state, line.as_bytes()).unwrap_err().fault)
        })
        .collect();
    // All of `Fault` but `TooLong`, which has a test of its own.
    assert_eq!(kinds.len(), 41);
}
