//! Whole programs: what is found, what is not told twice, and what they are in figures.

use super::{USUAL, checked};
use crate::program::check::{Checked, MOST};
use crate::program::feed;
use crate::program::summary::{Kind, Motions};
use crate::program::travel::Travel;
use crate::rig::tests::rig;
use abbe_core::command::Refusal;
use abbe_core::{Command, Pos};
use std::cell::Cell;
use std::fmt::Write as _;
use std::io::{self, BufReader, Read};

/// Lines parted by `|`, and the errors.
fn errors(lines: &str) -> Vec<String> {
    checked(lines.replace('|', "\n").as_bytes()).errors.iter().map(ToString::to_string).collect()
}

/// A good program.
fn good(lines: &str) -> Checked {
    let checked = checked(lines.replace('|', "\n").as_bytes());
    assert_eq!(checked.errors, [], "{lines}");
    checked
}

#[test]
fn a_motion_that_leaves_the_travel_is_told() {
    for (lines, told) in [
        (
            "G0 X100 Y100|X100.000000001",
            "line 2, column 1: the line ends at x = 100.000000001 mm of the machine, 0.000000001 mm beyond the travel of 0 … 100 mm; correct X, or the origin",
        ),
        (
            "N7 G0 Y-2.5",
            "line 1, column 7: the line ends at y = -2.5 mm of the machine, 2.5 mm beyond the travel of 0 … 100 mm; correct Y, or the origin",
        ),
        // In the program's own coordinates all is well.
        (
            "G10 L2 P1 X95|G0 X6",
            "line 2, column 4: the line ends at x = 101 mm of the machine, 1 mm beyond the travel of 0 … 100 mm; correct X, or the origin",
        ),
        (
            "G91 G0 X60|X60",
            "line 2, column 1: the line ends at x = 120 mm of the machine, 20 mm beyond the travel of 0 … 100 mm; correct X, or the origin",
        ),
        (
            "G20 G0 X4",
            "line 1, column 8: the line ends at x = 101.6 mm of the machine, 1.6 mm beyond the travel of 0 … 100 mm; correct X, or the origin",
        ),
        // Both ends are inside.
        ("G0 X90 Y40|G3 Y60 J10 F60|G2 Y40 J-10", ""),
        (
            "G0 X95 Y40|G3 Y60 J10 F60",
            "line 2, column 8: the arc bulges to x = 105 mm of the machine, at y = 50 mm, 5 mm beyond the travel of 0 … 100 mm; correct centre or radius, or the origin",
        ),
        ("G0 X95 Y40|G2 Y60 J10 F60", ""),
        ("G0 X95 Y40|G2 Y60 R-12.5 F60", ""),
        (
            "G0 X95 Y40|G3 Y60 R-12.5 F60",
            "line 2, column 8: the arc bulges to x = 115 mm of the machine, at y = 50 mm, 15 mm beyond the travel of 0 … 100 mm; correct centre or radius, or the origin",
        ),
        ("G0 X50|G2 J50 F60", ""),
        (
            "G0 X50 Y0.000000001|G2 J50 F60",
            "line 2, column 4: the arc bulges to y = 100.000000001 mm of the machine, at x = 50 mm, 0.000000001 mm beyond the travel of 0 … 100 mm; correct centre or radius, or the origin",
        ),
        ("G0 X50 Y1|G5.5 X60 P1 L2 F60", ""),
        (
            "G0 X50 Y1|G5.5 X60 P1.5 L2 Q180 F60",
            "line 2, column 10: the sine swings to y = -0.5 mm of the machine, at x = 50.5 mm, 0.5 mm beyond the travel of 0 … 100 mm; correct P, or the origin",
        ),
        // A cosine begins at its crest.
        ("G0 X50 Y2|G5.5 X60 P1 L2 Q90 F60", ""),
        (
            "G0 X50 Y50|G28 X101",
            "line 2, column 5: the way to the reference leads through x = 101 mm of the machine, 1 mm beyond the travel of 0 … 100 mm; correct X, or the origin",
        ),
        ("G0 X50 Y50|G28 X100 Y0|G28", ""),
    ] {
        let expected: Vec<&str> = if told.is_empty() { vec![] } else { vec![told] };
        assert_eq!(errors(lines), expected, "{lines}");
    }
}

#[test]
fn both_sides_and_both_axes_are_told() {
    let told = errors("G0 X50 Y50|G2 I60 F60|G2 I-60");
    let each: Vec<&str> = told.iter().map(|error| error.split(" mm of").next().unwrap()).collect();
    let expected = [
        "line 2, column 4: the arc bulges to x = 170",
        "line 2, column 4: the arc bulges to y = -10",
        "line 2, column 4: the arc bulges to y = 110",
        "line 3, column 4: the arc bulges to x = -70",
        "line 3, column 4: the arc bulges to y = -10",
        "line 3, column 4: the arc bulges to y = 110",
    ];
    assert_eq!(each, expected);
    assert_eq!(errors("G0 X-1 Y101").len(), 2);
}

#[test]
fn what_follows_from_an_error_is_not_told() {
    // It stays out, works out there, goes farther, comes back, and leaves again.
    let told = errors("G0 X101|Y5|G1 Y6 F60|X100.5|X102|X50|X101|G28.1|X50|G28");
    let lines: Vec<&str> = told.iter().map(|error| error.split(": ").next().unwrap()).collect();
    assert_eq!(lines, ["line 1, column 4", "line 5, column 1", "line 7, column 1", "line 10"]);
    assert!(told[3].ends_with("beyond the travel of 0 … 100 mm; correct the reference"), "{}", told[3]);
    // Behind a block that is refused nobody knows where the stage stands; what is no word is wrong anyway.
    let told = errors("G1 X10|X500|G1 Z5|G91 X5|Q|M2|Z");
    let expected = [
        "line 1, column 1: no feed was set for this motion; add F, a length in a minute",
        "line 3, column 4: the stage has no Z, only X and Y, so there is no helix either; leave Z out",
        "line 5, column 1: Q has no number behind it; write one, like Q1.5",
    ];
    assert_eq!(told, expected);
    assert_eq!(checked(&b"G1 X10\n\nZ"[..]).refused, Some(1));
    // An error in the last block is one; what stands behind it is no part of the program.
    assert_eq!(errors("M2 P5|Z").len(), 1);
    assert_eq!(errors("/M2|Z|/M2|Z|M30|Z").len(), 2);
    assert_eq!(errors("/G0 X500|G0 X1|M2|G0 X500"), [""; 0]);
}

#[test]
fn what_the_reader_refuses_is_refused_with_its_place() {
    for (lines, told) in [
        ("|G1 X1 F0", "line 2, column 7: F0 is not more than zero; give a larger number"),
        ("G1 X1 F-5", "line 1, column 7: F-5 is not more than zero; give a larger number"),
        ("G93 G1 X1", "line 1, column 5: in G93 each motion needs a feed of its own"),
        ("G2 X20 Y0 I4 F1", "line 1, column 11: the arc begins 4.000000 mm from its centre"),
        ("G2 X20 R4 F1", "line 1, column 8: the ends are 20.000000 mm apart"),
        ("\u{feff}G0 X1 & Y1", "line 1, column 7: & begins no word"),
        ("G0 \u{e9}", "line 1, column 4: the byte 195 is no character of a program"),
        ("%|G0 X1|% X", "line 3, column 1: a percent sign is not alone"),
    ] {
        let errors = errors(lines);
        assert!(errors.len() == 1 && errors[0].starts_with(told), "{lines}: {errors:?}");
    }
    let long = format!("G0 X1\n(\n{}\nG0 X1000", "X".repeat(10_000));
    let errors: Vec<String> = checked(long.as_bytes()).errors.iter().map(ToString::to_string).collect();
    assert_eq!(errors[1], "line 3, column 257: the line has 10000 characters, 256 are read; divide it");
    good("%|G0 X1 (\u{e9})\r|;\u{e9}\r|%");
}

#[test]
fn a_program_is_told_in_figures() {
    let program = "%|G21 G54|G0 X30 Y40|G1 X40 F600|G3 X40 Y60 J10|G4 P0.25|M0|G5.5 Y70 P1 L5 Q90|G28 X10|G4 P1.5|/G4 P9|M2|Z";
    let summary = good(program).summary;
    assert_eq!((summary.lines, summary.dwells, summary.pauses, summary.ends), (12, 2, 1, true));
    assert_eq!(summary.dwell_s(), 1.75);
    assert_eq!(summary.extents, Some([[0.0, 50.0], [40.0, 70.0]].map(|ends| ends.map(Pos::from_mm))));
    let counts = Kind::ALL.map(|kind| summary.motions(kind).count);
    assert_eq!(counts, [1, 1, 1, 1, 1]);
    // The last goes over (10, 70), and then along x only.
    for (kind, length_mm) in [
        (Kind::Rapid, 50.0),
        (Kind::Line, 10.0),
        (Kind::Arc, std::f64::consts::PI * 10.0),
        (Kind::Reference, 40.0),
    ] {
        let found = summary.motions(kind);
        assert!((found.length_mm - length_mm).abs() < 1e-9, "{kind:?}: {found:?}");
    }
    let nothing = good("G21|(nothing)").summary;
    assert_eq!((nothing.extents, nothing.ends, nothing.all()), (None, false, Motions::default()));
}

/// 20 mm/s are 1200 mm/min.
#[test]
fn a_feed_above_the_limit_is_told_once() {
    let told =
        |lines: &str| -> Vec<String> { good(lines).feeds.limited.iter().map(ToString::to_string).collect() };
    let root = |n: f64| n.sqrt();
    for (lines, limit_mm_s, motions) in [
        ("G1 X10 F1200|X20|Y3", 0.0, 0),
        ("G1 X10 F1300|Y5|X20", 20.0, 2),
        // On the diagonal both axes go at their limits.
        ("G1 X10 Y10 F1697", 0.0, 0),
        ("G1 X10 Y10 F1698", 20.0 * root(2.0), 1),
        // A quarter turn from (10, 0) to (0, 10) about zero goes up first and to the left last.
        ("G0 X10|G3 X0 Y10 I-10 F1201", 20.0, 1),
        // An eighth from 22.5° to 67.5° never does.
        ("G0 X9.238795325 Y3.826834324|G3 X3.826834324 Y9.238795325 R10 F1298", 0.0, 0),
        ("G0 X9.238795325 Y3.826834324|G3 X3.826834324 Y9.238795325 R10 F1299", 20.0 / 0.923_879_532_5, 1),
        // A sine of slope 1 about the diagonal: it goes along each axis once a period.
        ("G0 Y20|G5.5 X10 Y30 P0.1 L1.414213562 F1285", 0.0, 0),
        ("G0 X5 Y20|G5.5 X15 Y30 P0.5 L1.414213562 F1201", 20.0, 1),
        // 10 mm in a hundredth of a minute are 16.7 mm/s.
        ("G93|G1 X10 F100|X30 F100", 20.0, 1),
        ("G0 X5|G1 X5 F90000", 0.0, 0),
        ("G20 G1 X1 F50", 20.0, 1),
    ] {
        let feeds = good(lines).feeds;
        let found: Vec<(f64, u64)> = feeds.limited.iter().map(|l| (l.limit_mm_s, l.motions)).collect();
        if motions == 0 {
            assert_eq!(found, [], "{lines}");
        } else {
            assert!((found[0].0 - limit_mm_s).abs() < 1e-6 && found[0].1 == motions, "{lines}: {found:?}");
        }
    }
    let axes = "G1 X10 F1300|Y5|X20";
    assert_eq!(
        told(axes),
        [
            "line 1: the feed of 21.666667 mm/s is more than x can go; it is limited, to 20.000000 mm/s at the slowest place of 2 motions with it",
            "line 2: the feed of 21.666667 mm/s is more than y can go; it is limited, to 20.000000 mm/s at the slowest place",
        ]
    );
    let many = (0..500).fold(String::from("G0 X1"), |mut lines, k| {
        _ = write!(lines, "|G1 X{} F{}", 10 + k % 2, 1300 + k);
        lines
    });
    let feeds = good(&many).feeds;
    assert_eq!((feeds.limited.len(), feeds.others), (feed::MOST, 490));
}

/// What the controller refuses is refused here, and nothing else.
#[test]
fn the_travel_is_that_of_the_controller() {
    let mut rig = rig(1);
    let Travel(travel) = Travel::of(&USUAL);
    rig.home().unwrap();
    for axis in [0, 1] {
        for (end, sign) in travel[axis].into_iter().zip([-1, 1]) {
            for beyond in [0, 1] {
                let mut to = [Pos::from_mm(1.0); 2];
                to[axis] = end + Pos::from_pm(sign * beyond);
                let program = format!("G0 X{:.9} Y{:.9}", to[0].mm(), to[1].mm());
                let refused = checked(program.as_bytes()).count > 0;
                assert_eq!(refused, beyond > 0, "{program}");
                let asked = rig.controller().clone().command(Command::MoveTo(to));
                assert_eq!(
                    matches!(asked, Err(Refusal::OutOfTravel { .. })),
                    refused,
                    "{program}: {asked:?}"
                );
            }
        }
    }
}

/// A program that is made while it is read.
struct Made<'a> {
    lines: u64,
    next: u64,
    line: Vec<u8>,
    at: usize,
    /// Bytes that were handed out.
    given: &'a Cell<u64>,
}

impl Read for Made<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.at == self.line.len() {
            if self.next == self.lines {
                return Ok(0);
            }
            let (x, y) = (self.next % 101, self.next / 7 % 100);
            let word = if self.next.is_multiple_of(3) { "G2 I0.5".into() } else { format!("G1 X{x} Y{y}.5") };
            // Every feed is another one, and too fast.
            self.line = format!("{word} F{}\n", 2000 + self.next).into_bytes();
            self.at = 0;
            self.next += 1;
        }
        let taken = buffer.len().min(self.line.len() - self.at);
        buffer[..taken].copy_from_slice(&self.line[self.at..self.at + taken]);
        self.at += taken;
        self.given.set(self.given.get() + taken as u64);
        Ok(taken)
    }
}

/// What is kept of a program does not grow with it: a line, the first errors, the first feeds, and figures.
#[test]
fn of_a_long_program_only_the_first_errors_and_feeds_are_kept() {
    let given = Cell::new(0);
    let lines = 200_000;
    let program = Made { lines, next: 0, line: Vec::new(), at: 0, given: &given };
    let checked = checked(BufReader::new(program));
    assert!(given.get() > 3_000_000, "{}", given.get());
    assert_eq!(checked.summary.lines, lines);
    assert_eq!(checked.summary.all().count, lines);
    assert_eq!((checked.errors.len(), checked.feeds.limited.len()), (MOST, feed::MOST));
    assert!(checked.errors.capacity() <= 2 * MOST && checked.feeds.limited.capacity() <= 2 * feed::MOST);
    // The first circle leaves at y = 0, and each one that begins at x = 100 leaves there.
    assert_eq!(checked.count, 1 + (lines - 1) / 303);
    assert_eq!(checked.feeds.others + checked.feeds.limited.iter().map(|l| l.motions).sum::<u64>(), lines);
}
