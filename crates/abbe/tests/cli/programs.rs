//! `abbe run --check`: a G-code program as a user has it checked.

use crate::ended::{abbe, command, done, everything_in, refused};
use serde_json::{Value, json};
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Stdio;

const GOOD: &str =
    "%\r\n(one field)\r\nG21 G90 G0 X10 Y20\r\nG1 X12 F1500\r\nG3 Y22 J1\r\nG4 P0.5\r\nM2\r\nend of file";

fn written(text: &[u8]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("field.nc"), text).unwrap();
    dir
}

/// Runs the check on stdin.
fn piped(dir: &Path, text: &[u8]) -> Value {
    let asked = ["run", "-", "--check", "--json"];
    let mut child = command(dir, &asked)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(text).unwrap();
    let output = child.wait_with_output().unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_good_program_is_told_in_figures() {
    let dir = written(GOOD.as_bytes());
    let before = everything_in(dir.path());
    let ended = abbe(dir.path(), &["run", "field.nc", "--check"]);
    assert_eq!(ended.status, Some(0), "{ended:?}");
    assert!(ended.stdout.starts_with("field.nc: the program fits the stage microscope-100\n"), "{ended:?}");
    for part in [
        "motions                    3",
        "rapid",
        "arc ",
        "10.000000 … 13.000000 mm",
        "note: line 4: the feed of 25.000000",
    ] {
        assert!(ended.stdout.contains(part), "{part}: {}", ended.stdout);
    }
    let document = done(dir.path(), &["run", "field.nc", "--check"]);
    for (key, value) in [
        ("program", json!("field.nc")),
        ("preset", json!("microscope-100")),
        ("lines", json!(7)),
        ("extents_mm", json!({ "x": [10.0, 13.0], "y": [20.0, 22.0] })),
        ("dwells", json!({ "count": 1, "time_s": 0.5 })),
        ("pauses", json!(0)),
        ("ends", json!(true)),
    ] {
        assert_eq!(document[key], value, "{key}");
    }
    assert_eq!(document["motions"]["line"], json!({ "count": 1, "length_mm": 2.0 }));
    let length = document["length_mm"].as_f64().unwrap();
    assert!((length - (500_f64.sqrt() + 2.0 + std::f64::consts::PI)).abs() < 1e-9, "{length}");
    assert_eq!(document["limited_feeds"][0]["motions"], json!(2));
    let mut from_stdin = piped(dir.path(), GOOD.as_bytes());
    assert_eq!(from_stdin["program"], json!("stdin"));
    from_stdin["program"] = json!("field.nc");
    assert_eq!(from_stdin, document);
    assert_eq!(everything_in(dir.path()), before);
}

#[test]
fn the_travel_is_that_of_the_preset() {
    let dir = written(b"G0 X110\nM2\n");
    assert_eq!(
        done(dir.path(), &["run", "field.nc", "--check", "--preset", "litho-120"])["ends"],
        json!(true)
    );
    let ended = abbe(dir.path(), &["run", "field.nc", "--check"]);
    assert_eq!((ended.status, ended.stdout.as_str()), (Some(1), ""));
    assert_eq!(
        ended.sentence(),
        "field.nc, line 1, column 4: the line ends at x = 110 mm of the machine, 10 mm beyond the travel of \
         0 … 100 mm; correct X, or the origin"
    );
}

#[test]
fn all_errors_are_told_in_one_go() {
    let mut text = String::from("G0 X110\nX50\nG2 I60 F60\nG1 X\nG0 X1000\n");
    for _ in 0..30 {
        text += "Z\n";
    }
    let dir = written(text.as_bytes());
    let ended = abbe(dir.path(), &["run", "field.nc", "--check"]);
    assert_eq!((ended.status, ended.stdout.as_str()), (Some(1), ""));
    let told: Vec<&str> = ended.stderr.lines().filter(|line| line.starts_with("field.nc, line ")).collect();
    assert_eq!(told.len(), 20, "{ended:?}");
    assert!(told[0].starts_with("field.nc, line 1, column 4: the line ends at x = 110 mm"), "{}", told[0]);
    assert!(told[2].starts_with("field.nc, line 3, column 4: the arc bulges to y = -60 mm"), "{}", told[2]);
    assert_eq!(
        ended.stderr.lines().last().unwrap(),
        "abbe: field.nc: the program has 34 errors, 14 of them not shown; behind line 4 only words were looked at, \
         mend it and check again"
    );
    let ended = abbe(dir.path(), &["run", "field.nc", "--check", "--json"]);
    let document = ended.document();
    assert_eq!(ended.status, Some(1));
    assert_eq!((&document["count"], &document["refused_line"]), (&json!(34), &json!(4)));
    let errors = document["errors"].as_array().unwrap();
    assert_eq!(errors.len(), 20);
    assert_eq!(
        errors[0],
        json!({
            "line": 1,
            "column": 4,
            "message": "the line ends at x = 110 mm of the machine, 10 mm beyond the travel of 0 … 100 mm; correct X, \
                or the origin",
            "axis": "x",
            "place_mm": [110.0, 0.0],
            "limit_mm": 100.0,
        })
    );
    assert_eq!(
        (&errors[3]["line"], &errors[3]["column"], &errors[3]["axis"]),
        (&json!(4), &json!(4), &Value::Null)
    );
}

#[test]
fn what_cannot_be_checked_is_refused() {
    let dir = written(GOOD.as_bytes());
    fs::create_dir(dir.path().join("folder.nc")).unwrap();
    let cases: [(&[&str], i32, &[&str]); 4] = [
        (&["run", "--check"], 2, &["<FILE.nc>", "usage: abbe run"]),
        (&["run", "none.nc", "--check"], 1, &["none.nc: the program cannot be read"]),
        (&["run", "folder.nc", "--check"], 1, &["folder.nc: the program cannot be read"]),
        (&["run", "field.nc", "--check", "--preset", "none"], 2, &["--preset none"]),
    ];
    for (arguments, status, names) in cases {
        refused(dir.path(), arguments, status, names);
    }
}

#[test]
fn any_bytes_are_no_program_and_no_fault() {
    let bytes: Vec<u8> = (0..20_000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let dir = written(&bytes);
    let ended = abbe(dir.path(), &["run", "field.nc", "--check"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.stderr.contains("field.nc, line 1, column "), "{ended:?}");
    assert!(!ended.stderr.contains("fault of the program itself"), "{ended:?}");
}

/// Lines come for as long as somebody sends them, and none of them stays.
#[cfg(target_os = "linux")]
#[test]
fn a_program_of_any_length_is_checked_in_the_memory_of_a_short_one() {
    let dir = tempfile::tempdir().unwrap();
    let mut child = command(dir.path(), &["run", "-", "--check", "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let (mut most, mut first) = (0, 0);
    for k in 0..200_000_u32 {
        // Every one leads farther out than the one before.
        writeln!(stdin, "G1 X{:.1} Y5.{k} F{}", 101.0 + 0.1 * f64::from(k), 1300 + k).unwrap();
        if k % 20_000 == 10_000 {
            most = crate::encoder_memory::most_kb(&child).unwrap();
            first = if first == 0 { most } else { first };
        }
    }
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&document["count"], document["errors"].as_array().unwrap().len()), (&json!(200_000), 20));
    assert!(first > 1000 && most <= first + 256, "{first} kB after 10 000 lines, {most} kB after 190 000");
}
