//! Recorded encoder signals: known ones come back, and positions are true.

use crate::ended::{abbe, done, everything_in, refused};
use crate::signals::{MADE, Made, PERIOD_UM, write_rows};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

pub(crate) fn judged(dir: &Path, file: &str, more: &[&str]) -> Value {
    done(dir, &[&["encoder", file, "--period-um", "0.8"], more].concat())
}

pub(crate) fn figure(document: &Value, pointer: &str) -> f64 {
    document.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer} in {document:#}"))
}

fn near(document: &Value, figures: &[(&str, f64, f64)]) {
    for (pointer, expected, within) in figures {
        let found = figure(document, pointer);
        assert!((found - expected).abs() <= *within, "{pointer}: {found}, not {expected}");
    }
}

/// The columns of a file of positions, times first where there are any.
pub(crate) fn columns(dir: &Path, name: &str) -> (String, Vec<Vec<f64>>) {
    let text = fs::read_to_string(dir.join(name)).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().to_owned();
    (header, lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect())
}

#[test]
fn a_known_ellipse_comes_back_and_positions_are_true_to_the_noise() {
    let dir = tempfile::tempdir().unwrap();
    MADE.write(dir.path(), "s.csv");
    let found = judged(dir.path(), "s.csv", &["--positions", "new/p.csv"]);
    near(
        &found,
        &[
            ("/samples", 20_000.0, 0.0),
            ("/ellipse/offset_a_percent", 5.0, 0.05),
            ("/ellipse/offset_b_percent", -3.0, 0.05),
            ("/ellipse/gain", 1.08, 1e-3),
            ("/ellipse/phase_deg", 4.0, 0.05),
            ("/ellipse/amplitude_a", 1.0, 1e-3),
            ("/error_before/peak_nm", 12.90, 0.1),
            ("/error_before/rms_nm", 6.98, 0.05),
            ("/error_after/peak_nm", 0.0, 0.2),
            ("/error_after/uncertainty_nm", 0.035, 0.015),
            ("/residual/rms_percent", 0.96, 0.03),
            ("/noise/rms_nm", 1.23, 0.04),
            ("/travel_um", 19_999.0 * 0.0473 * PERIOD_UM, 0.01),
            ("/largest_step_mm_s", 0.0473 * PERIOD_UM * 10.0, 0.1),
            ("/aliasing_limit_nm", 400.0, 1e-9),
        ],
    );
    assert_eq!((&found["grade"], &found["findings"]), (&"good".into(), &serde_json::json!([])));
    let (header, rows) = columns(dir.path(), "new/p.csv");
    assert_eq!((header.as_str(), rows.len()), ("t_s,pos_um", 20_000));
    let off: Vec<f64> = (0..).zip(&rows).map(|(k, row)| 1e3 * (row[1] - PERIOD_UM * MADE.truth(k))).collect();
    let mean = off.iter().sum::<f64>() / 20_000.0;
    let rms = (off.iter().map(|off| off * off).sum::<f64>() / 20_000.0).sqrt();
    assert!(mean.abs() < 0.05 && rms > 1.0 && rms < 1.3, "mean {mean} nm, rms {rms} nm");
    assert!(off.iter().all(|off| off.abs() < 7.0));
    assert_eq!(rows[1234][0], 0.1234);
}

#[test]
fn a_thousand_samples_are_enough_and_say_how_well_they_know_it() {
    let dir = tempfile::tempdir().unwrap();
    Made { samples: 1000, ..MADE }.write(dir.path(), "s.csv");
    let found = judged(dir.path(), "s.csv", &[]);
    near(&found, &[("/error_before/peak_nm", 12.9, 0.4), ("/error_after/uncertainty_nm", 0.16, 0.05)]);
    let (rms, known) = (figure(&found, "/error_after/rms_nm"), figure(&found, "/error_after/uncertainty_nm"));
    assert!(rms < 2.0 * known, "{rms} ± {known}");
}

#[test]
fn a_third_harmonic_is_seen_and_taken_off_by_the_table() {
    let dir = tempfile::tempdir().unwrap();
    let made = Made { samples: 60_000, noise: 0.003, third: 0.01, ..MADE };
    made.write(dir.path(), "s.csv");
    let ellipse = judged(dir.path(), "s.csv", &[]);
    near(&ellipse, &[("/error_after/peak_nm", 1.54, 0.1)]);
    let table = judged(dir.path(), "s.csv", &["--harmonics", "--positions", "p.csv"]);
    near(
        &table,
        &[("/error_after/peak_nm", 0.0, 0.1), ("/harmonics_nm/3", 1.27, 0.1), ("/harmonics_nm/4", 0.0, 0.03)],
    );
    assert_eq!(table["error_after"]["from"], "halves");
    // The same as a preset takes it: parts of a period.
    let fourth = ["/harmonics/3/0", "/harmonics/3/1"].map(|place| figure(&table, place));
    assert!((1e3 * PERIOD_UM * fourth[0].hypot(fourth[1]) - 1.27).abs() < 0.1, "{fourth:?}");
    // Against the truth: averaged in parts of the period, what is left does not depend on the phase.
    let (_, rows) = columns(dir.path(), "p.csv");
    let mut parts = [[0.0; 2]; 40];
    for (k, row) in (0..).zip(&rows) {
        let part = &mut parts[(made.truth(k).fract() * 40.0) as usize];
        part[0] += 1.0;
        part[1] += 1e3 * (row[1] - PERIOD_UM * made.truth(k));
    }
    // What they all share only moves the zero.
    let means = parts.map(|[count, sum]| sum / count);
    let zero = means.iter().sum::<f64>() / 40.0;
    assert!(means.iter().all(|mean| (mean - zero).abs() < 0.05), "{means:?}");
}

#[test]
fn counts_are_steps_of_five_nanometres() {
    let dir = tempfile::tempdir().unwrap();
    Made { samples: 3000, noise: 0.001, ..MADE }.write(dir.path(), "s.csv");
    judged(dir.path(), "s.csv", &["--factor", "160", "--positions", "p.csv"]);
    judged(dir.path(), "s.csv", &["--factor", "160", "--limit-counts", "--positions", "steady.csv"]);
    let (_, rows) = columns(dir.path(), "p.csv");
    for (k, row) in (0..).zip(&rows) {
        let nm = (1e3 * row[1]).round();
        assert!(nm % 5.0 == 0.0 && (1e3 * row[1] - nm).abs() < 1e-6, "{}", row[1]);
        assert!((nm - 800.0 * MADE.truth(k)).abs() <= 2.5 + 0.8, "{nm}");
    }
    // At 7.6 counts a sample the filter gives half of each way: it stands 7.6 counts behind.
    let (_, steady) = columns(dir.path(), "steady.csv");
    let behind: f64 = rows[100..].iter().zip(&steady[100..]).map(|(row, steady)| row[1] - steady[1]).sum();
    assert!((1e3 * behind / 2900.0 / 5.0 - 7.57).abs() < 0.6, "{behind}");
}

#[test]
fn every_method_leaves_what_it_cannot_know() {
    let dir = tempfile::tempdir().unwrap();
    Made { noise: 0.003, ..MADE }.write(dir.path(), "s.csv");
    for (method, least, most) in [
        ("heydemann", 0.0, 0.1),
        ("moments", 0.0, 0.3),
        ("recursive", 0.0, 0.3),
        ("peaks", 6.0, 9.0),
        ("none", 12.5, 13.1),
    ] {
        let found = judged(dir.path(), "s.csv", &["--method", method]);
        let after = figure(&found, "/error_after/peak_nm");
        assert!((least..=most).contains(&after), "{method}: {after}");
        near(&found, &[("/error_before/peak_nm", 12.9, 0.1), ("/ellipse/gain", 1.08, 1e-3)]);
        assert_eq!(found["method"], method);
    }
}

#[test]
fn codes_of_a_converter_say_what_it_adds_and_where_it_ends() {
    let dir = tempfile::tempdir().unwrap();
    let made = Made { amplitude: 1600.0, decimals: 0, noise: 0.001, ..MADE };
    made.write(dir.path(), "signed.csv");
    let unsigned: Vec<[f64; 2]> =
        made.rows().into_iter().map(|row| row.map(|code| (code + 2048.0).min(3700.0))).collect();
    write_rows(dir.path(), "unsigned.csv", 0, &unsigned);
    let cut: Vec<[f64; 2]> =
        made.rows().into_iter().map(|row| row.map(|code| (code * 1.2 + 2048.0).clamp(0.0, 4095.0))).collect();
    write_rows(dir.path(), "cut.csv", 0, &cut);

    let signed = judged(dir.path(), "signed.csv", &["--bits", "12"]);
    near(
        &signed,
        &[
            ("/converter/bits", 12.0, 0.0),
            ("/converter/filled_percent", 78.1, 0.1),
            ("/converter/peak_nm", 0.0563, 1e-3),
            ("/ellipse/offset_a_percent", 5.0, 0.02),
            ("/error_after/peak_nm", 0.0, 0.05),
        ],
    );
    assert_eq!((&signed["converter"]["coding"], &signed["grade"]), (&"signed".into(), &"good".into()));
    // Cut off below the end of the range: the samples pile up.
    let piled = judged(dir.path(), "unsigned.csv", &["--bits", "12"]);
    near(&piled, &[("/ellipse/offset_a_percent", 5.0, 0.1), ("/ellipse/gain", 1.08, 2e-3)]);
    assert_eq!(piled["converter"]["coding"], "unsigned");
    assert!(figure(&piled, "/cut_off/b") > 100.0, "{piled}");
    // Beyond the end of the range.
    for bits in [&["--bits", "12"][..], &[]] {
        let cut = judged(dir.path(), "cut.csv", bits);
        assert_eq!((&cut["grade"], &cut["findings"][0]["what"]), (&"fail".into(), &"saturation".into()));
        near(&cut, &[("/ellipse/gain", 1.08, 5e-3), ("/ellipse/phase_deg", 4.0, 0.2)]);
    }
    let text = abbe(dir.path(), &["encoder", "cut.csv", "--period-um", "0.8", "--bits", "12"]).stdout;
    assert!(text.contains("health FAIL") && text.contains("FAIL: saturation: "), "{text}");
}

#[test]
fn extremes_that_were_cut_off_are_none_and_it_is_said_how_many_samples_were_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let made = Made { amplitude: 1600.0, noise: 0.001, ..MADE };
    let cut: Vec<[f64; 2]> =
        made.rows().into_iter().map(|row| row.map(|code| code.round().clamp(-2048.0, 1500.0))).collect();
    write_rows(dir.path(), "cut.csv", 0, &cut);
    let asked = ["encoder", "cut.csv", "--period-um", "0.8", "--bits", "12", "--method", "peaks"];
    refused(dir.path(), &asked, 1, &["cut.csv", "maximum", "were left out", "--method peaks"]);
}

#[test]
fn wild_samples_are_kept_out_by_the_limit_filter_and_backwards_is_backwards() {
    let dir = tempfile::tempdir().unwrap();
    let made = Made { samples: 4000, noise: 0.001, speed: -0.0313, ..MADE };
    let mut rows = made.rows();
    (500..4000).step_by(700).for_each(|k| rows[k] = [-rows[k][0], -rows[k][1]]);
    write_rows(dir.path(), "s.csv", 6, &rows);
    let plain = judged(dir.path(), "s.csv", &[]);
    let limited = judged(dir.path(), "s.csv", &["--limit-samples", "0.4", "--positions", "p.csv"]);
    assert_eq!((&plain["kept_by_filter"], &limited["kept_by_filter"]), (&0.into(), &5.into()));
    near(&limited, &[("/way_um", -0.0313 * 3999.0 * 0.8, 0.01)]);
    assert!(
        figure(&limited, "/largest_surprise_nm") < 60.0 && figure(&plain, "/largest_surprise_nm") > 300.0
    );
    assert_eq!(plain["grade"], "fail");
    let (_, rows) = columns(dir.path(), "p.csv");
    for (k, row) in (0..).zip(rows) {
        assert!((row[1] - PERIOD_UM * made.truth(k)).abs() < 0.04, "{k}: {}", row[1]);
    }
}

#[test]
fn pictures_and_tables_are_written_and_only_json_is_printed_with_json() {
    let dir = tempfile::tempdir().unwrap();
    let text: String = (0..2000).fold("a,b\n".into(), |text, k| {
        let angle = f64::from(k) * 0.297;
        format!("{text}{:.5},\"{:.5}\"\n", 3.0 + angle.cos(), 2.0 + angle.sin())
    });
    fs::write(dir.path().join("s.csv"), text).unwrap();
    let asked = ["encoder", "s.csv", "--period-um", "20", "--positions", "p.csv", "--plot", "s.svg"];
    let ended = abbe(dir.path(), &asked);
    assert_eq!(ended.status, Some(0), "{ended:?}");
    for words in ["quadrature", "error after", "counted from outside the ellipse", "→ p.csv", "→ s.svg"] {
        assert!(ended.stdout.contains(words), "{words}: {}", ended.stdout);
    }
    let svg = fs::read_to_string(dir.path().join("s.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"));
    for words in ["a (cosine)", "b (sine)", "phase / °", "error of the position / nm", "ellipse", "after"] {
        assert!(svg.contains(words), "{words} is not in the picture");
    }
    assert_eq!(columns(dir.path(), "p.csv").0, "pos_um");
    let again = [&asked[..], &["--force"]].concat();
    assert_eq!(done(dir.path(), &again)["error_before"], Value::Null);
    assert_eq!(everything_in(dir.path()).len(), 3);
    refused(dir.path(), &asked, 2, &["p.csv", "--positions", "--force"]);
}

/// Clean signals of a motion, with a third harmonic; `size` is the amplitude at a sample.
fn moved(place: impl Fn(f64) -> f64, third: f64, size: impl Fn(u32) -> f64) -> Vec<[f64; 2]> {
    let wave = |angle: f64| angle.cos() + third * (3.0 * angle).cos();
    let at = |k: u32| {
        let angle = TAU * place(f64::from(k));
        [size(k) * wave(angle), size(k) * wave(angle - TAU / 4.0)]
    };
    (0..12_000).map(at).collect()
}

#[test]
fn without_a_constant_speed_the_radius_tells_of_the_third_harmonic() {
    let dir = tempfile::tempdir().unwrap();
    write_rows(dir.path(), "s.csv", 6, &moved(|k| 3.0 * (k * 0.011).sin(), 0.01, |_| 1.0));
    let found = judged(dir.path(), "s.csv", &[]);
    assert_eq!(
        (&found["error_after"]["from"], &found["error_before"]["from"]),
        (&"radius".into(), &"ellipse".into())
    );
    near(&found, &[("/error_after/peak_nm", 1.273, 0.2), ("/error_after/rms_nm", 1.273 / 2_f64.sqrt(), 0.1)]);
    near(&found, &[("/travel_um", 4.8, 0.01)]);
}

#[test]
fn dirt_gaps_and_haste_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let steady = |k: f64| 0.0473 * k;
    let dirty = moved(steady, 0.0, |k| if (5000..5500).contains(&k) { 0.3 } else { 1.0 });
    let lumpy = moved(|k| 0.125 * k + 0.06, 0.0, |_| 1.0);
    let hasty = moved(|k| 0.0473 * k + 0.3 * (k * 1.3).sin(), 0.0, |_| 1.0);
    let small: Vec<[f64; 2]> = moved(steady, 0.0, |_| 100.0).iter().map(|row| row.map(f64::round)).collect();
    for (name, rows, more, what) in [
        ("dirty.csv", dirty, &[][..], "contamination"),
        ("lumpy.csv", lumpy, &[], "coverage"),
        ("hasty.csv", hasty, &[], "speed"),
        ("small.csv", small, &["--bits", "12"], "small signal"),
    ] {
        write_rows(dir.path(), name, if name == "small.csv" { 0 } else { 6 }, &rows);
        let found = judged(dir.path(), name, more);
        let named = found["findings"].as_array().unwrap().iter().find(|finding| finding["what"] == what);
        let named = named.unwrap_or_else(|| panic!("{what}: {found:#}"));
        assert!(named["reason"].as_str().unwrap().len() > 20 && found["grade"] != "good", "{found:#}");
    }
}
