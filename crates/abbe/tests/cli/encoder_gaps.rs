//! Recorded encoder signals with gaps and bad stretches: positions behind them are true, or it is said that nobody knows.

use crate::encoder::{columns, figure, judged};
use crate::ended::{abbe, refused};
use crate::signals::{MADE, Made, PERIOD_UM, write_rows};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::ops::Range;
use std::path::Path;

/// Rows at 10 kHz without some of them.
fn write_without(dir: &Path, rows: &[[f64; 2]], lost: &dyn Fn(usize) -> bool) {
    let mut text = String::from("t_s,a,b\n");
    for (k, [a, b]) in rows.iter().enumerate().filter(|(k, _)| !lost(*k)) {
        writeln!(text, "{:.4},{a:.6},{b:.6}", k as f64 * 1e-4).unwrap();
    }
    fs::write(dir.join("s.csv"), text).unwrap();
}

fn named<'f>(found: &'f Value, what: &str) -> Option<&'f Value> {
    found["findings"].as_array().unwrap().iter().find(|finding| finding["what"] == what)
}

/// The most that a position is off, µm.
fn most_off(dir: &Path, truth: impl Fn(f64) -> f64, samples: Range<f64>) -> f64 {
    let (_, rows) = columns(dir, "p.csv");
    let of_interest = rows.iter().filter(|row| samples.contains(&(1e4 * row[0]).round()));
    let off = of_interest.map(|row| (row[1] - PERIOD_UM * truth((1e4 * row[0]).round())).abs());
    off.fold(0.0, f64::max)
}

#[test]
fn no_period_is_lost_over_missing_samples_at_any_speed() {
    let dir = tempfile::tempdir().unwrap();
    for speed in [0.0007, 0.0473, -0.2113, 0.371, -0.4719] {
        for lost in [5000..5001, 5000..5007, 5000..5135, 5000..5900] {
            let made = Made { speed, ..MADE };
            write_without(dir.path(), &made.rows(), &|k| lost.contains(&k));
            let found = judged(dir.path(), "s.csv", &["--positions", "p.csv", "--force"]);
            // A file that begins faster than a quarter of a period a sample is followed all the same.
            let off = most_off(dir.path(), |k| made.truth(k as u32), 0.0..2e4);
            assert!(off < 0.01, "{speed} {lost:?}: {off} µm");
            assert_eq!(found["missing_samples"], lost.len(), "{speed}");
            let finding = named(&found, "missing samples").unwrap();
            assert_eq!((&finding["grade"], &found["grade"]), (&"warn".into(), &"warn".into()), "{found:#}");
            let reason = finding["reason"].as_str().unwrap();
            assert!(reason.contains(&format!("{} samples", lost.len())) && reason.contains("line 5002"));
        }
    }
    // Every fiftieth.
    write_without(dir.path(), &MADE.rows(), &|k| k % 50 == 7);
    let found = judged(dir.path(), "s.csv", &["--positions", "p.csv", "--force"]);
    assert!(most_off(dir.path(), |k| MADE.truth(k as u32), 0.0..2e4) < 0.01);
    assert_eq!((&found["missing_samples"], &found["grade"]), (&400.into(), &"warn".into()));
}

#[test]
fn a_gap_over_which_the_speed_has_changed_is_said_not_to_tell_the_period() {
    let dir = tempfile::tempdir().unwrap();
    // Over 135 samples a sine of the speed goes on by 3 periods more or less than at the speed before.
    let place = |k: f64| 0.0473 * k + 20.0 * (k * 0.004).sin();
    let rows: Vec<[f64; 2]> =
        (0..12_000).map(|k| TAU * place(f64::from(k))).map(|angle| [angle.cos(), angle.sin()]).collect();
    write_without(dir.path(), &rows, &|k| (5000..5135).contains(&k));
    let found = judged(dir.path(), "s.csv", &[]);
    let finding = named(&found, "missing samples").unwrap();
    assert_eq!((&finding["grade"], &found["grade"]), (&"fail".into(), &"fail".into()));
    assert!(finding["reason"].as_str().unwrap().contains("from line 5002 on"), "{found:#}");
    // Longer than all that was seen before it: nobody knows.
    write_without(dir.path(), &MADE.rows(), &|k| (2000..5000).contains(&k));
    assert_eq!(named(&judged(dir.path(), "s.csv", &[]), "missing samples").unwrap()["grade"], "fail");
}

#[test]
fn a_stretch_without_signal_does_not_spoil_the_rest_of_the_file() {
    let dir = tempfile::tempdir().unwrap();
    for (speed, dead) in [(0.0473, 5000..5060), (0.213, 5000..5500), (-0.371, 7000..7800)] {
        let made = Made { speed, noise: 0.003, ..MADE };
        let mut rows = made.rows();
        // What is left of the signals is noise around their middle.
        rows[dead.clone()].iter_mut().for_each(|row| *row = [0.05 + 0.1 * (row[0] - 0.05), -0.03]);
        write_rows(dir.path(), "s.csv", 6, &rows);
        let found = judged(dir.path(), "s.csv", &["--positions", "p.csv", "--force"]);
        let off = most_off(dir.path(), |k| made.truth(k as u32), 0.0..2e4);
        assert!(off < 0.06, "{speed}: {off} µm");
        let behind = most_off(dir.path(), |k| made.truth(k as u32), dead.end as f64..2e4);
        assert!(behind < 0.02, "{speed}: {behind} µm");
        assert_eq!(found["samples_without_phase"], dead.len());
        let reason = named(&found, "no phase").unwrap()["reason"].as_str().unwrap();
        assert!(reason.contains(&format!("line {}", dead.start + 2)), "{reason}");
        assert!(named(&found, "speed").is_none(), "{found:#}");
    }
}

#[test]
fn a_sample_far_from_where_it_was_expected_is_told_by_its_line() {
    let dir = tempfile::tempdir().unwrap();
    let mut rows = MADE.rows();
    rows[6000] = rows[6000].map(|value| -value);
    write_rows(dir.path(), "s.csv", 6, &rows);
    let found = judged(dir.path(), "s.csv", &[]);
    let speed = named(&found, "speed").unwrap();
    assert!(speed["reason"].as_str().unwrap().contains("from line 6002 on"), "{found:#}");
}

/// A filter with a step smaller than those of the signals keeps many samples in place of those that follow.
#[test]
fn samples_of_the_limit_filter_do_not_bend_the_fit() {
    let dir = tempfile::tempdir().unwrap();
    let made = Made { noise: 0.002, ..MADE };
    made.write(dir.path(), "s.csv");
    for (method, step) in [("heydemann", "0.29"), ("recursive", "0.318")] {
        let found = judged(dir.path(), "s.csv", &["--limit-samples", step, "--method", method]);
        assert!(figure(&found, "/kept_by_filter") > 300.0, "{found:#}");
        let off = [
            figure(&found, "/taken_off/offset_a_percent") - 5.0,
            figure(&found, "/taken_off/offset_b_percent") + 3.0,
            100.0 * (figure(&found, "/taken_off/gain") - 1.08),
            figure(&found, "/taken_off/phase_deg") - 4.0,
        ];
        assert!(off.iter().all(|off| off.abs() < 0.3), "{method}: {off:?}");
        assert_ne!(named(&found, "limit filter").unwrap()["grade"], "good");
    }
    let found = judged(dir.path(), "s.csv", &["--limit-samples", "0.5"]);
    assert_eq!((named(&found, "limit filter"), &found["grade"]), (None, &"good".into()));
}

#[test]
fn a_sample_that_is_cut_off_in_both_channels_counts_once() {
    let dir = tempfile::tempdir().unwrap();
    // Squares, nearly: most samples are at the ends of both channels.
    let made = Made { amplitude: 6000.0, samples: 5000, ..MADE };
    let rows: Vec<[f64; 2]> =
        made.rows().into_iter().map(|row| row.map(|code| code.round().clamp(-2048.0, 2047.0))).collect();
    write_rows(dir.path(), "s.csv", 0, &rows);
    let is_end = |code: f64| code <= -2048.0 || code >= 2047.0;
    let cut = rows.iter().filter(|row| row.iter().any(|code| is_end(*code))).count();
    assert!(rows.iter().map(|row| row.iter().filter(|code| is_end(**code)).count()).sum::<usize>() > 5000);
    let asked = ["encoder", "s.csv", "--period-um", "0.8", "--bits", "12", "--method", "peaks"];
    refused(dir.path(), &asked, 1, &[&format!("({cut} samples")]);
    let milder: Vec<[f64; 2]> = made
        .rows()
        .into_iter()
        .map(|row| row.map(|code| (0.36 * code).round().clamp(-2048.0, 2047.0)))
        .collect();
    let cut = milder.iter().filter(|row| row.iter().any(|code| is_end(*code))).count();
    write_rows(dir.path(), "s.csv", 0, &milder);
    let found = judged(dir.path(), "s.csv", &["--bits", "12"]);
    assert_eq!(found["cut_off"]["samples"], cut);
    let reason = named(&found, "saturation").unwrap()["reason"].as_str().unwrap();
    assert!(reason.starts_with(&format!("{cut} samples")), "{reason}");
}

#[test]
fn a_stage_that_rests_at_a_crest_is_not_cut_off() {
    let dir = tempfile::tempdir().unwrap();
    let place = |k: u32| TAU * 0.0473 * f64::from(k.saturating_sub(3000));
    let rows: Vec<[f64; 2]> = (0..12_000)
        .map(place)
        .map(|angle| [angle.cos(), angle.sin()].map(|part| (100.0 * part).round()))
        .collect();
    write_rows(dir.path(), "s.csv", 0, &rows);
    for bits in [&["--bits", "8"][..], &[]] {
        let found = judged(dir.path(), "s.csv", bits);
        assert_eq!(
            (named(&found, "saturation"), &found["cut_off"]["samples"]),
            (None, &0.into()),
            "{found:#}"
        );
    }
}

#[test]
fn dirt_on_a_tenth_of_the_file_does_not_make_the_error_inside_a_period() {
    let dir = tempfile::tempdir().unwrap();
    let made = Made { noise: 0.003, ..MADE };
    let mut rows = made.rows();
    made.write(dir.path(), "clean.csv");
    rows[8000..10_000].iter_mut().for_each(|row| *row = [0.2 + 0.5 * row[0], 0.4 * row[1]]);
    write_rows(dir.path(), "s.csv", 6, &rows);
    let clean = judged(dir.path(), "clean.csv", &["--method", "none"]);
    let found = judged(dir.path(), "s.csv", &["--method", "none"]);
    assert!(figure(&found, "/stretches/left_out") >= 2.0, "{found:#}");
    assert_eq!(
        (&clean["stretches"]["left_out"], &found["error_after"]["from"]),
        (&0.into(), &"motion".into())
    );
    let [clean, dirty] = [clean, found].map(|found| figure(&found, "/error_after/rms_nm"));
    assert!((dirty / clean - 1.0).abs() < 0.02, "{dirty} nm, {clean} nm without dirt");
}

#[test]
fn numbers_from_far_away_are_told_by_their_middle() {
    let dir = tempfile::tempdir().unwrap();
    let text: String = (0..4000).fold("a,b\n".into(), |mut text, k| {
        let angle = TAU * 0.0473 * f64::from(k);
        writeln!(text, "{:.3},{:.3}", 1e9 + 1000.0 * angle.cos(), 1e9 - 5.0 + 1000.0 * angle.sin()).unwrap();
        text
    });
    fs::write(dir.path().join("s.csv"), text).unwrap();
    let found = judged(dir.path(), "s.csv", &[]);
    for ellipse in ["ellipse", "taken_off"] {
        assert_eq!(found[ellipse]["offset_a_percent"], Value::Null);
        assert_eq!(found[ellipse]["offset_b_percent"], Value::Null);
        assert!((figure(&found[ellipse], "/middle_a") - 1e9).abs() < 0.1, "{found:#}");
        assert!((figure(&found[ellipse], "/middle_b") - (1e9 - 5.0)).abs() < 0.1, "{found:#}");
    }
    let text = abbe(dir.path(), &["encoder", "s.csv", "--period-um", "0.8"]).stdout;
    let offsets = text.lines().find(|line| line.trim_start().starts_with("offsets")).unwrap();
    assert!(
        !offsets.contains('%') && offsets.contains("a 100000000") && offsets.contains("b 99999999"),
        "{offsets}"
    );
}
