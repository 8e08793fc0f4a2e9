//! Recorded encoder signals that are wrong: told with their line, and nothing is written.

use crate::encoder::judged;
use crate::ended::refused;
use crate::signals::{MADE, Made, write_rows};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;

#[test]
fn harmonics_are_not_learned_from_what_is_no_sweep() {
    let dir = tempfile::tempdir().unwrap();
    let rows = |place: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
        let angle = |k: u32| TAU * place(f64::from(k));
        (0..8000).map(|k| [angle(k).cos(), angle(k).sin()]).collect()
    };
    write_rows(dir.path(), "shaken.csv", 6, &rows(&|k| 3.0 * (k * 0.011).sin()));
    write_rows(dir.path(), "stuck.csv", 6, &rows(&|k| 0.125 * k + 0.06));
    write_rows(dir.path(), "short.csv", 6, &rows(&|k| 0.0005 * k));
    write_rows(dir.path(), "creeping.csv", 6, &rows(&|k| 0.003 * k));
    write_rows(
        dir.path(),
        "sticking.csv",
        6,
        &rows(&|k| 0.13 + 4.0 * (k / 100.0).floor() + (k % 100.0 / 10.0).min(4.0)),
    );
    fs::write(dir.path().join("uneven.csv"), uneven(&rows(&|k| 0.0473 * k))).unwrap();
    for (file, names) in [
        ("shaken.csv", &["constant speed"][..]),
        ("stuck.csv", &["parts of the period", "another speed"]),
        ("short.csv", &["too slow", "take a faster sweep"]),
        ("creeping.csv", &["too slow", "take a faster sweep"]),
        ("sticking.csv", &["constant speed"]),
        ("uneven.csv", &["even distances of time"]),
    ] {
        let names = [&[file, "--harmonics"], names].concat();
        let asked = ["encoder", file, "--period-um", "0.8", "--harmonics", "--positions", "new/p.csv"];
        refused(dir.path(), &asked, 1, &names);
        let found = judged(dir.path(), file, &[]);
        assert_eq!(found["error_after"]["from"], "radius", "{file}");
        assert!(found["notes"][0].as_str().unwrap().contains("from the radius"), "{found}");
    }
}

/// Rows of which every other one comes a quarter of a step late.
fn uneven(rows: &[[f64; 2]]) -> String {
    let mut text = String::from("t_s,a,b\n");
    for (k, [a, b]) in (0_u32..).zip(rows) {
        let late = if k % 2 == 0 { 0.0 } else { 0.25e-4 };
        writeln!(text, "{:.6},{a},{b}", f64::from(k) * 1e-4 + late).unwrap();
    }
    text
}

/// What is no fault of the motion: too noisy, too slow for its servo, without times.
#[test]
fn a_sweep_that_cannot_teach_says_what_to_do() {
    let dir = tempfile::tempdir().unwrap();
    Made { samples: 1500, noise: 0.05, ..MADE }.write(dir.path(), "noisy.csv");
    Made { samples: 300, ..MADE }.write(dir.path(), "few.csv");
    MADE.write(dir.path(), "s.csv");
    let timeless = fs::read_to_string(dir.path().join("s.csv")).unwrap().replacen("t_s", "no", 1);
    fs::write(dir.path().join("timeless.csv"), timeless).unwrap();
    for (file, servo_hz, names) in [
        ("noisy.csv", None, &["is known to ±", "a longer or a smoother sweep"][..]),
        // 473 periods a second.
        ("s.csv", Some("60"), &["the servo follows", "10 times --servo-hz", "take a faster sweep"]),
        ("timeless.csv", Some("40"), &["--servo-hz", "`t_s`"]),
    ] {
        let servo = servo_hz.map_or_else(Vec::new, |hz| vec!["--servo-hz", hz]);
        let asked = [&["encoder", file, "--period-um", "0.8", "--harmonics"], &servo[..]].concat();
        refused(dir.path(), &asked, 1, &[&[file], names].concat());
    }
    // Cut off at 80 % of the amplitude of a, on one side.
    let cut: Vec<[f64; 2]> = MADE.rows().into_iter().map(|[a, b]| [a.min(0.85), b]).collect();
    write_rows(dir.path(), "cut.csv", 6, &cut);
    let asked = ["encoder", "cut.csv", "--period-um", "0.8", "--method", "moments"];
    let names =
        ["whole periods evenly", "offsets are", "--method heydemann", "samples at full scale were left out"];
    refused(dir.path(), &asked, 1, &names);
    judged(dir.path(), "cut.csv", &[]);
    // 1.4 periods are no even cover; 8.5 come as near as is taken.
    Made { samples: 30, ..MADE }.write(dir.path(), "part.csv");
    let asked = ["encoder", "part.csv", "--period-um", "0.8", "--method", "moments"];
    refused(dir.path(), &asked, 1, &["whole periods evenly", "--method heydemann"]);
    Made { samples: 180, ..MADE }.write(dir.path(), "nearly.csv");
    judged(dir.path(), "nearly.csv", &["--method", "moments"]);
    let slow_enough = judged(dir.path(), "s.csv", &["--harmonics", "--servo-hz", "40"]);
    assert_eq!(slow_enough["notes"], serde_json::json!([]));
    assert!((slow_enough["sweep_hz"].as_f64().unwrap() - 473.0).abs() < 4.0, "{slow_enough}");
    let unasked = judged(dir.path(), "s.csv", &["--harmonics"]);
    assert!(unasked["notes"][0].as_str().unwrap().contains("more than 47 Hz"), "{unasked}");
}

#[test]
fn a_bad_file_is_told_with_its_line_and_nothing_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let good: String = (0..100).fold("t_s,a,b\n".into(), |text, k| {
        let angle = f64::from(k) * 0.7;
        format!("{text}{k},{:.4},{:.4}\n", angle.cos(), angle.sin())
    });
    // Row 4 is on line 6.
    let changed = |to: &str| {
        let line = good.lines().nth(5).unwrap();
        good.replacen(line, to, 1).into_bytes()
    };
    let rows =
        |row: &dyn Fn(u32) -> String| (0..100).fold("a,b\n".into(), |text: String, k| text + &row(k) + "\n");
    let cases: Vec<(Vec<u8>, &[&str])> = vec![
        (vec![], &["empty", "header"]),
        (b"\n\n".to_vec(), &["empty"]),
        (b"t_s,a,c\n1,2,3\n".to_vec(), &["line 1", "no column `b`", "`t_s`, `a`, `c`"]),
        (b"a;b\n1;2\n".to_vec(), &["line 1", "no column `a`", "is only `a;b`"]),
        (b"0.1,0.2\n0.3,0.4\n".to_vec(), &["line 1", "no column `a`", "`0.1`"]),
        (b"a,b,a\n1,2,3\n".to_vec(), &["line 1", "`a` twice"]),
        (b"a,b\n".to_vec(), &["no sample"]),
        (b"a,b\n1,2\n2,1\n".to_vec(), &["2 samples", "five constants"]),
        (changed("4,0.1,volt"), &["line 6", "column `b`", "`volt`"]),
        (changed("soon,0.1,0.2"), &["line 6", "column `t_s`", "`soon`"]),
        (changed("4,NaN,0.2"), &["line 6", "column `a`", "`NaN`", "finite"]),
        (changed("4,0.1,-inf"), &["line 6", "column `b`", "`-inf`", "finite"]),
        (changed("4,1e300,0.2"), &["line 6", "column `a`", "`1e300`"]),
        (changed("4,0.1"), &["line 6", "`b`", "missing"]),
        (changed("4,,0.2"), &["line 6", "`a`", "missing"]),
        (changed("4,0.1,0.2,0.3"), &["line 6", "4 cells", "3 columns"]),
        (changed("2,0.1,0.2"), &["line 6", "2 s", "3 s"]),
        (changed(&"9".repeat(70_000)), &["line 6", "longer than"]),
        ([&good.as_bytes()[..40], b"\xff\n", &good.as_bytes()[40..]].concat(), &["line 4", "UTF-8"]),
        (rows(&|k| format!("{k},0.5")).into_bytes(), &["column `b`", "stands still at 0.5"]),
        (rows(&|_| "1,2".into()).into_bytes(), &["column `a`", "stands still at 1"]),
        (
            rows(&|k| format!("{:.4},{:.4}", (0.01 * f64::from(k)).cos(), (0.01 * f64::from(k)).sin()))
                .into_bytes(),
            &["eighths", "arc"],
        ),
        (
            rows(&|k| format!("{:.4},{:.4}", (0.7 * f64::from(k)).cos(), 2.2 * (0.7 * f64::from(k)).sin()))
                .into_bytes(),
            &["no working encoder", "0.45 : 1"],
        ),
    ];
    for (bytes, names) in cases {
        fs::write(dir.path().join("bad.csv"), bytes).unwrap();
        let asked =
            ["encoder", "bad.csv", "--period-um", "0.8", "--positions", "new/p.csv", "--plot", "s.svg"];
        refused(dir.path(), &asked, 1, &[&["bad.csv"], names].concat());
    }
    let code = |row: &str| format!("a,b\n10,20\n-5,7\n{row}\n");
    for (row, names) in [
        ("0.5,3", ["line 4", "0.5 in column `a`"]),
        ("3,256", ["line 4", "256 in column `b`"]),
        ("200,3", ["line 4", "200 in column `a`"]),
        ("3,-129", ["line 4", "-129 in column `b`"]),
    ] {
        fs::write(dir.path().join("bad.csv"), code(row)).unwrap();
        let names = [&["8-bit", "--bits"][..], &names].concat();
        refused(dir.path(), &["encoder", "bad.csv", "--period-um", "0.8", "--bits", "8"], 1, &names);
    }
    refused(dir.path(), &["encoder", "none.csv", "--period-um", "0.8"], 1, &["none.csv", "cannot be read"]);
    refused(dir.path(), &["encoder", ".", "--period-um", "0.8"], 1, &["no file"]);
    // An arc that the recursion and the extremes cannot use is no file to be refused, but the method is.
    Made { samples: 300, ..MADE }.write(dir.path(), "few.csv");
    let recursive = ["encoder", "few.csv", "--period-um", "0.8", "--method", "recursive"];
    refused(dir.path(), &recursive, 1, &["--method recursive", "400 samples"]);
}

#[test]
fn wishes_that_cannot_be_asked_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    MADE.write(dir.path(), "s.csv");
    fs::write(dir.path().join("mine.svg"), "mine").unwrap();
    let cases: [(&[&str], &[&str]); 17] = [
        (&["s.csv"], &["--period-um", "usage: abbe encoder"]),
        (&["s.csv", "--period-um", "0"], &["`0` µm", "--period-um"]),
        (&["s.csv", "--period-um", "-0.8"], &["`-0.8` µm"]),
        (&["s.csv", "--period-um", "NaN"], &["`NaN`", "finite"]),
        (&["s.csv", "--period-um", "1e9"], &["`1e9` µm"]),
        (&["-", "--period-um", "0.8"], &["stdin", "name a file"]),
        (&["s.csv", "--period-um", "0.8", "--bits", "7"], &["--bits", "7 is not in 8..=16"]),
        (&["s.csv", "--period-um", "0.8", "--method", "guess"], &["'guess'", "heydemann"]),
        (&["s.csv", "--period-um", "0.8", "--factor", "6"], &["6", "multiples of 4"]),
        (&["s.csv", "--period-um", "0.8", "--factor", "-4"], &["`-4`", "4 … 4096"]),
        (&["s.csv", "--period-um", "0.8", "--limit-counts"], &["--factor"]),
        (&["s.csv", "--period-um", "0.8", "--limit-samples", "0"], &["`0`", "--limit-samples"]),
        (&["s.csv", "--period-um", "0.8", "--plot", "s.png"], &["s.png", ".svg"]),
        (&["s.csv", "--period-um", "0.8", "--plot", "mine.svg"], &["mine.svg", "--plot", "--force"]),
        (&["s.csv", "--period-um", "0.8", "--positions", "."], &["--positions .", "folder"]),
        (
            &["s.csv", "--period-um", "0.8", "--positions", "./s.csv", "--force"],
            &["--positions ./s.csv", "samples"],
        ),
        (
            &["s.csv", "--period-um", "0.8", "--positions", "x.svg", "--plot", "x.svg"],
            &["--positions", "--plot", "x.svg"],
        ),
    ];
    for (arguments, names) in cases {
        refused(dir.path(), &[&["encoder"], arguments].concat(), 2, names);
    }
}
