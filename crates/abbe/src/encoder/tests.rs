//! Whatever a file holds, it is answered or refused.

use super::method::Learned;
use super::samples::Samples;
use super::signals::Signals;
use super::survey::Survey;
use crate::cli::{Cli, Command, Encoder, Method};
use crate::commands::encoder_answer;
use abbe_core::sense::ellipse::Ellipse;
use clap::Parser as _;
use proptest::prelude::*;
use std::f64::consts::TAU;
use std::fs;

fn asked(file: &str, more: &[&str]) -> Encoder {
    let line = [&["abbe", "encoder", file, "--period-um", "0.8"], more].concat();
    let Command::Encoder(asked) = Cli::try_parse_from(line).unwrap().command else { unreachable!() };
    asked
}

/// Every method on a file; how many gave an answer.
fn tried(bytes: &[u8]) -> usize {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("s.csv");
    fs::write(&file, bytes).unwrap();
    let wishes: [&[&str]; 6] = [
        &["--bits", "8"],
        &["--method", "moments", "--factor", "160", "--limit-counts"],
        &["--method", "peaks"],
        &["--method", "recursive", "--limit-samples", "40"],
        &["--method", "none", "--harmonics"],
        &["--plot", "s.svg", "--force"],
    ];
    let answered = |more: &&[&str]| {
        let mut asked = asked(file.to_str().unwrap(), more);
        asked.plot = asked.plot.map(|plot| dir.path().join(plot));
        asked.positions = Some(dir.path().join("p.csv"));
        encoder_answer(&asked, Samples::of(&asked.samples).unwrap(), &|_| ()).is_ok()
    };
    wishes.iter().filter(|more| answered(more)).count()
}

/// Lines that look like samples, and now and then do not.
fn lines() -> impl Strategy<Value = Vec<u8>> {
    let cell = prop_oneof![
        8 => (-300_i32..300).prop_map(|code| code.to_string()),
        4 => (-2.0..2.0_f64).prop_map(|volts| volts.to_string()),
        1 => any::<f64>().prop_map(|any| any.to_string()),
        1 => "[\"a-z,.\r;µ -]{0,6}",
    ];
    let row = proptest::collection::vec(cell, 1..4).prop_map(|cells| cells.join(","));
    let pair = (-300_i32..300, -300_i32..300).prop_map(|(a, b)| format!("{a},{b}"));
    let rows = proptest::collection::vec(prop_oneof![30 => pair, 1 => row], 0..60);
    ("(a,b|b,a|a,b,t_s|\"a\",b|a)", rows)
        .prop_map(|(header, rows)| format!("{header}\n{}", rows.join("\n")).into_bytes())
}

proptest! {
    #[test]
    fn any_bytes_are_answered_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        tried(&bytes);
    }

    #[test]
    fn any_lines_are_answered_or_refused(bytes in lines()) {
        tried(&bytes);
    }

    /// Circles of any size and place, most of them far from what a converter gives.
    #[test]
    fn any_size_is_answered(
        decades in -200.0..25.0_f64, far in -1e3..1e3_f64, speed in -0.6..0.6_f64, samples in 20..3000_u32,
    ) {
        let size = 10_f64.powf(decades);
        let rows = (0..samples).map(|k| {
            let angle = TAU * speed * f64::from(k);
            format!("{:e},{:e}\n", size * (far + angle.cos()), size * (angle.sin() - far))
        });
        tried(&rows.fold("a,b\n".into(), |text: String, row| text + &row).into_bytes());
    }
}

#[test]
fn the_trials_above_reach_answers() {
    let circle = (0..1500).fold("a,b\n".into(), |text: String, k| {
        let angle = f64::from(k) * 0.297;
        text + &format!("{},{}\n", (100.0 * angle.cos()).round(), (100.0 * angle.sin()).round())
    });
    assert_eq!(tried(circle.as_bytes()), 6);
}

/// Offsets of 96 and −58 codes, amplitudes 1600 and 1728, 4° from quadrature.
fn drawn(k: u32) -> [f64; 2] {
    let angle = f64::from(k) * 0.0473 * TAU;
    [1600.0 * angle.cos() + 96.0, 1728.0 * (angle + 4_f64.to_radians()).sin() - 58.0]
}

/// What a method takes off signals that grow by `size`, from a converter of 12 bits.
fn taken(method: Method, size: impl Fn(u32) -> f64) -> (Ellipse, [u64; 2]) {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("s.csv");
    let rows = (0..20_000).fold("a,b\n".into(), |text: String, k| {
        let [a, b] = drawn(k).map(|code| (code * size(k)).round().clamp(-2048.0, 2047.0));
        text + &format!("{a},{b}\n")
    });
    fs::write(&file, rows).unwrap();
    let samples = Samples::of(&file).unwrap();
    let survey = Survey::of(&samples, Some(12), &|_| ()).unwrap();
    let learned = Learned::of(&Signals::new(samples, survey, None), method, &|_| ()).unwrap();
    (learned.taken, learned.cut)
}

/// How far an ellipse's codes are from those drawn, as parts of the amplitude: offsets, radius, gain; and its angle.
fn off(found: &Ellipse, size: f64) -> f64 {
    [
        found.p / 1600.0 - 0.06 * size,
        found.q / 1600.0 + 0.03625 * size,
        found.radius / 1600.0 - size,
        1.0 / found.r - 1.08,
        found.alpha + 4_f64.to_radians(),
    ]
    .into_iter()
    .fold(0.0, |most, off| most.max(off.abs()))
}

/// With the samples at the ends of the converter, the recursion was off by 2.2 % of the amplitude.
#[test]
fn what_the_converter_cuts_off_does_not_bend_the_recursion() {
    for (size, cut_at_least) in [(1.0, 0), (1.25, 1500)] {
        let (found, cut) = taken(Method::Recursive, |_| size);
        assert!(cut.iter().all(|&cut| cut >= cut_at_least), "{size}: {cut:?}");
        assert!(off(&found, size) < 3e-4, "{size}: off by {}, {found:?}", off(&found, size));
    }
}

/// With cut extremes the offsets were 42 and 57 codes off. A sample meets an extreme to 1.1 % at this speed.
#[test]
fn extremes_that_the_converter_cut_off_do_not_move_the_offsets() {
    let (found, cut) = taken(Method::Peaks, |k| if k < 10_000 { 1.0 } else { 1.3 });
    assert!(cut.iter().all(|&cut| cut > 1000), "{cut:?}");
    assert!((found.p - 96.0).abs() < 12.0 && (found.q + 58.0).abs() < 12.0, "{found:?}");
}
