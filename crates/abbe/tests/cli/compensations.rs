//! Making compensation files, and refusing those that are none.

use crate::ended::{PRESET, done, refused};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Readings of an axis that is wrong by `per_mm` µm for each millimetre.
fn write_readings(file: &Path, per_mm: f64) {
    let mut text = String::from("approach,target_mm,run1,run2\n");
    for approach in ["up", "down"] {
        for target in (0..=100).step_by(10).map(f64::from) {
            let actual = target * (1.0 + per_mm * 1e-3);
            _ = writeln!(text, "{approach},{target},{actual},{actual}");
        }
    }
    fs::write(file, text).unwrap();
}

#[test]
fn a_line_is_fitted_exactly() {
    let dir = tempfile::tempdir().unwrap();
    write_readings(&dir.path().join("readings-x.csv"), 1.0);
    write_readings(&dir.path().join("other.csv"), -2.0);
    let found =
        done(dir.path(), &["compensate", "readings-x.csv", "y=other.csv", "--out", "new/folder/c.toml"]);
    for (axis, slope) in [("x", 1.0), ("y", -2.0)] {
        let coefficients = found[axis]["coefficients_um_mm"].as_array().unwrap();
        assert!((coefficients[1].as_f64().unwrap() - slope).abs() < 1e-9, "{axis}: {coefficients:?}");
    }
    assert!(found["notes"][0].as_str().unwrap().contains("2 runs"), "{found}");
    assert!(dir.path().join("new/folder/c.toml").exists());
}

#[test]
fn wishes_that_are_not_clear_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["readings-x.csv", "readings.csv", "again-x.csv"] {
        write_readings(&dir.path().join(name), 1.0);
    }
    write_readings(&dir.path().join("steep-y.csv"), 500.0);
    fs::write(dir.path().join("mine.toml"), "mine").unwrap();
    let cases: [(&[&str], i32, &[&str]); 8] = [
        (&["readings.csv", "--out", "c.toml"], 2, &["readings.csv", "axis", "x=readings.csv"]),
        (
            &["readings-x.csv", "again-x.csv", "--out", "c.toml"],
            2,
            &["again-x.csv", "readings-x.csv", "x axis"],
        ),
        (&["readings-x.csv", "x=readings.csv", "--out", "c.toml"], 2, &["x axis", "already"]),
        (&["readings-x.csv", "--out", "mine.toml"], 2, &["mine.toml", "--force"]),
        (&["readings-x.csv", "--out", "."], 2, &["folder"]),
        (&["readings-x.csv", "--out", "mine.toml/c.toml"], 1, &["mine.toml", "cannot be written"]),
        (&["readings-x.csv", "--out", "/proc/nope/c.toml"], 1, &["/proc/nope", "cannot be written"]),
        (&["steep-y.csv", "--out", "c.toml"], 1, &["steep-y.csv", "µm"]),
    ];
    for (arguments, status, names) in cases {
        refused(dir.path(), &[&["compensate"], arguments].concat(), status, names);
    }
    done(dir.path(), &["compensate", "readings-x.csv", "--out", "mine.toml", "--force"]);
    assert_ne!(fs::read(dir.path().join("mine.toml")).unwrap(), b"mine");
}

#[test]
fn files_that_are_no_compensation_name_file_line_and_value() {
    let dir = tempfile::tempdir().unwrap();
    write_readings(&dir.path().join("readings-x.csv"), 1.0);
    done(dir.path(), &["compensate", "readings-x.csv", "--out", "good.toml"]);
    let good = fs::read_to_string(dir.path().join("good.toml")).unwrap();
    let first = good.split("chebyshev_um = [").nth(1).unwrap().split([',', ']']).next().unwrap().trim();
    let cases = [
        ("garbage".to_owned(), &["line 1"][..]),
        (good.replace("degree", "degre"), &["line", "`degre`", "`degree`"]),
        (good.replace(first, "1e6"), &["line", "µm"]),
        (good.replace(first, "nan"), &["line", "NaN"]),
        (good.replace("version = 1", "version = 99"), &["line", "99"]),
        (good.replace("microscope-100", "litho-120"), &["`litho-120`", "`microscope-100`", "--preset"]),
    ];
    for (text, names) in cases {
        fs::write(dir.path().join("bad.toml"), text).unwrap();
        let names = [&["bad.toml"], names].concat();
        let verify = ["verify", "--twin", "--compensation", "bad.toml", "--out", "v"];
        refused(dir.path(), &verify, 1, &names);
        refused(dir.path(), &["move", "1", "2", "--twin", "--compensation", "bad.toml"], 1, &names);
    }
    let none = ["verify", "--twin", "--compensation", "none.toml", "--out", "v"];
    refused(dir.path(), &none, 1, &["none.toml", "cannot be read"]);
}

#[test]
fn a_compensation_belongs_to_the_stage_it_was_measured_on() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("mine.toml"), PRESET).unwrap();
    write_readings(&dir.path().join("readings-x.csv"), 1.0);
    let compensate = ["compensate", "readings-x.csv", "--out", "c.toml", "--preset", "mine.toml"];
    done(dir.path(), &compensate);
    let go = ["move", "10", "20", "--twin", "--compensation", "c.toml"];
    refused(dir.path(), &go, 1, &["c.toml", "`mine`", "`microscope-100`"]);
    done(dir.path(), &[&go[..], &["--preset", "mine.toml"]].concat());
}
