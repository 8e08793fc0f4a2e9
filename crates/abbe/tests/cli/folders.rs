//! Where results go: never over somebody's files.

use crate::ended::{done, refused};
use std::fs;

const MEASURE: [&str; 10] =
    ["measure", "--twin", "--axis", "x", "--runs", "2", "--step", "49", "--warm-up", "0"];

#[test]
fn places_that_cannot_be_written_are_refused_before_the_work() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("full")).unwrap();
    fs::write(dir.path().join("full/readings-x.csv"), "mine").unwrap();
    fs::write(dir.path().join("file"), "mine").unwrap();
    let commands = [&MEASURE[..], &["scan", "--twin", "--area", "0.3x0.2"], &["demo"]];
    for command in commands {
        for (out, status, names) in [
            ("full", 2, ["--out full", "not empty", "--force"]),
            ("file", 2, ["--out file", "a file", "not a folder"]),
            ("file/below", 1, ["--out file/below", "cannot be written", "directory"]),
            ("/proc/nope", 1, ["--out /proc/nope", "cannot be written", "directory"]),
        ] {
            refused(dir.path(), &[command, &["--out", out]].concat(), status, &names);
        }
    }
    refused(
        dir.path(),
        &["scan", "--twin", "--area", "0.3x0.2", "--out", "new/one", "--truth", "full"],
        2,
        &["--truth full", "not empty"],
    );
}

#[test]
fn force_writes_among_what_is_there() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("full")).unwrap();
    fs::write(dir.path().join("full/readings-x.csv"), "mine").unwrap();
    fs::write(dir.path().join("full/other"), "mine").unwrap();
    done(dir.path(), &[&MEASURE[..], &["--out", "full", "--force"]].concat());
    assert!(fs::read_to_string(dir.path().join("full/readings-x.csv")).unwrap().starts_with("approach,"));
    assert_eq!(fs::read(dir.path().join("full/other")).unwrap(), b"mine");
    assert_eq!(fs::read_dir(dir.path().join("full")).unwrap().count(), 2);
}
