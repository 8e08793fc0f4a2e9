//! The stage's own commands on the twin.

use crate::ended::{abbe, done, refused};
use serde_json::Value;
use std::fs;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn homing_finds_the_same_zero() {
    let dir = tempfile::tempdir().unwrap();
    let found = done(dir.path(), &["home", "--twin", "--times", "3"]);
    assert_eq!(found["homed"], true);
    for axis in ["x", "y"] {
        assert_eq!(found[axis]["homings"].as_array().unwrap().len(), 3);
        assert!(number(&found[axis]["largest_zero_shift_um"]) < 0.15, "{found}");
    }
    let plain = abbe(dir.path(), &["home", "--twin"]);
    assert_eq!((plain.status, plain.stderr.as_str()), (Some(0), "homing …\n"));
    assert!(plain.stdout.contains("x: homed at") && plain.stdout.contains("y: homed at"));
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn a_move_arrives() {
    let dir = tempfile::tempdir().unwrap();
    let found = done(dir.path(), &["move", "10", "20", "--twin"]);
    for (axis, target) in [10.0, 20.0].into_iter().enumerate() {
        assert_eq!(number(&found["target_mm"][axis]), target);
        assert!((number(&found["position_mm"][axis]) - target).abs() < 0.5e-3, "{found}");
    }
}

#[test]
fn paper_b_s_stage_homes_and_grades_its_signals() {
    let dir = tempfile::tempdir().unwrap();
    let found = done(dir.path(), &["home", "--twin", "--preset", "litho-120", "--times", "2"]);
    for axis in ["x", "y"] {
        // Row B9: to one count, of 0.2 µm.
        assert!(number(&found[axis]["largest_zero_shift_um"]) < 0.25, "{found}");
        // The twin's converter loses a sample now and then.
        let signals = &found["signals"][axis];
        assert!(
            signals["fail"] == "" && (signals["warn"] == "" || signals["warn"] == "samples missed"),
            "{found}"
        );
    }
}

#[test]
fn paper_b_s_stage_goes_over_all_of_its_travel() {
    let dir = tempfile::tempdir().unwrap();
    let asked = ["move", "120", "120", "--twin", "--preset", "litho-120"];
    let found = done(dir.path(), &asked);
    for axis in 0..2 {
        // The window of the preset; paper B stays within 0.8 µm.
        assert!((number(&found["position_mm"][axis]) - 120.0).abs() < 0.4e-3, "{found}");
    }
    assert!(number(&found["settle_s"]) < 0.5, "{found}");
    let told = abbe(dir.path(), &asked).stdout;
    for axis in ["x", "y"] {
        assert!(told.contains(&format!("{axis}: encoder signals good (amplitude ")), "{told}");
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn a_move_outside_the_travel_names_axis_value_and_limits() {
    let dir = tempfile::tempdir().unwrap();
    for (x, y, names) in [
        ("-1", "5", ["x = -1.0", "0.0", "100.0"]),
        ("5", "100.001", ["y = 100.001", "0.0", "100.0"]),
        ("-2e-3", "5", ["x = -0.002", "0.0", "100.0"]),
    ] {
        refused(dir.path(), &["move", x, y, "--twin"], 1, &names);
    }
}

#[test]
fn from_measuring_to_the_certificate() {
    let dir = tempfile::tempdir().unwrap();
    let measure = ["measure", "--twin", "--runs", "2", "--step", "14", "--warm-up", "0", "--out", "m"];
    let found = done(dir.path(), &measure);
    assert_eq!(found["readings"][1]["axis"], "y");
    let bare = done(dir.path(), &["iso230", "m/readings-y.csv"]);
    assert!(number(&bare["A"]) > 50.0, "the bare stage is too kind: {bare}");

    let readings = ["m/readings-x.csv", "m/readings-y.csv"];
    done(dir.path(), &[&["compensate"], &readings[..], &["--out", "c.toml"]].concat());
    let verify = ["verify", "--twin", "--runs", "2", "--targets", "5", "--warm-up", "0"];
    let found = done(dir.path(), &[&verify[..], &["--compensation", "c.toml", "--out", "v"]].concat());
    assert_eq!(found["checks"].as_array().unwrap().len(), 8);
    assert_eq!(found["notes"].as_array().unwrap().len(), 0);
    let report = fs::read_to_string(dir.path().join("v/report.html")).unwrap();
    assert!(report.contains("</html>") && !report.contains("NaN"));

    for axis in ["x", "y"] {
        let figures = done(dir.path(), &["iso230", &format!("v/readings-{axis}.csv")]);
        for key in ["A", "A_up", "A_down", "R", "R_up", "R_down", "E", "E_up", "E_down", "M", "B", "B_mean"] {
            let apart = number(&figures[key]) - number(&found[axis]["iso230"][key]);
            assert!(apart.abs() < 1e-6, "{axis} {key}: the file is written to 1e-7 µm, apart by {apart}");
        }
        assert!(number(&figures["A"]) < 5.0, "{axis}: {figures}");
    }
}

#[test]
fn an_axis_without_compensation_is_noted() {
    let dir = tempfile::tempdir().unwrap();
    let measure = ["measure", "--twin", "--axis", "x", "--runs", "2", "--step", "20", "--warm-up", "0"];
    done(dir.path(), &[&measure[..], &["--out", "m"]].concat());
    done(dir.path(), &["compensate", "m/readings-x.csv", "--out", "c.toml"]);
    let verify = ["verify", "--twin", "--runs", "2", "--targets", "3", "--warm-up", "0"];
    let found = done(dir.path(), &[&verify[..], &["--compensation", "c.toml", "--out", "v"]].concat());
    assert!(found["notes"][0].as_str().unwrap().contains("no y axis"), "{found}");
}

#[test]
fn the_same_seed_gives_the_same_readings_and_another_does_not() {
    let dir = tempfile::tempdir().unwrap();
    for (out, seed) in [("one", "7"), ("same", "7"), ("other", "8")] {
        let measure = ["measure", "--twin", "--axis", "y", "--runs", "2", "--step", "49", "--warm-up", "0"];
        done(dir.path(), &[&measure[..], &["--out", out, "--seed", seed]].concat());
    }
    let bytes = |out: &str| fs::read(dir.path().join(out).join("readings-y.csv")).unwrap();
    assert_eq!(bytes("one"), bytes("same"));
    assert_ne!(bytes("one"), bytes("other"));
}
