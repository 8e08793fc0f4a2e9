//! Readings files that are no evidence: each names the file, the line and the value.

use crate::ended::{abbe, done, refused};
use std::fs;

const HEADER: &str = "approach,target_mm,run1,run2\n";

#[test]
fn bad_readings_name_file_line_and_value() {
    let dir = tempfile::tempdir().unwrap();
    let full = format!("{HEADER}up,0,0,0\nup,10,10,10\ndown,0,0,0\ndown,10,10,10\n");
    let changed = |from: &str, to: &str| full.replacen(from, to, 1);
    let cases = [
        (changed("up,10,10,10", "up,10,10,"), &["line 3", "run2", "missing"][..]),
        (changed("up,10,10,10", "up,10,10"), &["line 3", "run2", "missing"]),
        (changed("up,10,10,10", "up,10,10,10,10"), &["line 3", "`10`"]),
        (format!("{full}down,20,20,20\ndown,15,15,15\n"), &["line 7", "15 mm", "20 mm"]),
        (changed("up,10,10,10", "up,10,10,10\nup,10,10,10"), &["line 4", "10 mm", "second time"]),
        (changed("up,10,10,10", "up,10,NaN,10"), &["line 3", "`NaN`", "run1"]),
        (changed("up,10,10,10", "up,10,inf,10"), &["line 3", "`inf`", "run1"]),
        (changed("up,10,10,10", "up,10,ten,10"), &["line 3", "`ten`", "run1"]),
        (changed("down,0,", "sideways,0,"), &["line 4", "`sideways`"]),
        (changed("target_mm", "target_um"), &["line 1", "`target_um`", "`target_mm`"]),
        (changed("down,10,10,10\n", ""), &["10 mm", "up"]),
        (format!("{HEADER}up,0,0,0\nup,10,10,10\n"), &["up", "down"]),
        (format!("{HEADER}up,0,0,0\ndown,0,0,0\n"), &["1 target", "2"]),
        ("approach,target_mm,run1\nup,0,0\nup,1,1\ndown,0,0\ndown,1,1\n".into(), &["line 1", "one run"]),
        (String::new(), &["empty"]),
        (HEADER.into(), &["0 target"]),
    ];
    for (text, names) in cases {
        fs::write(dir.path().join("bad-x.csv"), &text).unwrap();
        let names = [&["bad-x.csv"], names].concat();
        refused(dir.path(), &["iso230", "bad-x.csv"], 1, &names);
        refused(dir.path(), &["compensate", "bad-x.csv", "--out", "new/c.toml"], 1, &names);
    }
    refused(dir.path(), &["iso230", "none.csv"], 1, &["none.csv", "cannot be read"]);
    refused(dir.path(), &["compensate", "none-y.csv", "--out", "c.toml"], 1, &["none-y.csv"]);
}

#[test]
fn two_runs_are_enough_and_noted() {
    let dir = tempfile::tempdir().unwrap();
    let text = format!("{HEADER}up,0,0,0\nup,10,10,10\ndown,10,10,10\ndown,0,0,0\n");
    fs::write(dir.path().join("two.csv"), text).unwrap();
    let plain = abbe(dir.path(), &["iso230", "two.csv"]);
    assert_eq!((plain.status, plain.stderr.as_str()), (Some(0), ""));
    assert!(plain.stdout.contains("note: 2 runs, ISO 230-2 asks for 5"), "{}", plain.stdout);
    let notes = done(dir.path(), &["iso230", "two.csv"])["notes"].clone();
    assert!(
        notes[0].as_str().unwrap().contains("2 runs") && notes[1].as_str().unwrap().contains("2 targets")
    );
}
