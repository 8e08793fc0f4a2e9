//! Whatever a file holds, it is answered or refused.

use super::samples::Samples;
use crate::cli::{Cli, Command, Encoder};
use crate::commands::encoder_answer;
use clap::Parser as _;
use proptest::prelude::*;
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
        &["--method", "recursive", "--limit-samples", "0.3"],
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
            let angle = std::f64::consts::TAU * speed * f64::from(k);
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
