//! Ctrl-C: one sentence, exit status 1, no half-written file, and soon.

use crate::ended::{Ended, command, everything_in};
use crate::pictures::tiles;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Starts `abbe`, presses Ctrl-C when stderr says `moment`, and waits for the end.
fn pressed(dir: &Path, arguments: &[&str], moment: &str, times: usize) -> Ended {
    let mut child = command(dir, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut told = String::new();
    while !told.contains(moment) {
        assert_ne!(stderr.read_line(&mut told).unwrap(), 0, "ended before `{moment}`: {told}");
    }
    let pressed = Instant::now();
    for _ in 0..times {
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
    }
    stderr.read_to_string(&mut told).unwrap();
    let mut ended = Ended::from(child.wait_with_output().unwrap());
    assert!(pressed.elapsed() < Duration::from_secs(5), "{arguments:?} took {:?}", pressed.elapsed());
    ended.stderr = told;
    ended
}

#[test]
fn ctrl_c_leaves_whole_files_or_none() {
    let stitch = ["stitch", tiles().to_str().unwrap(), "--out", "new/mosaic.tif"];
    let sweep = "sweep --twin --area 50x50 --lines 200 --speed 1 --every 100 --events new/e.csv";
    let sweep: Vec<&str> = sweep.split(' ').collect();
    let cases: [(&[&str], &str); 8] = [
        (&["home", "--twin", "--times", "10000"], "homing again"),
        (&["measure", "--twin", "--out", "m"], "warming up"),
        (&["measure", "--twin", "--runs", "100", "--warm-up", "0", "--out", "m"], "measuring"),
        (&["scan", "--twin", "--area", "20x20", "--out", "s"], "scanning"),
        (&["demo"], "warming up"),
        (&stitch, "registering"),
        (&sweep, "sweeping"),
        // A line without end.
        (&["run", "/dev/zero", "--check"], "checking the program"),
    ];
    for (arguments, moment) in cases {
        let dir = tempfile::tempdir().unwrap();
        let ended = pressed(dir.path(), &[arguments, &["--json"]].concat(), moment, 1);
        assert_eq!(ended.status, Some(1), "{arguments:?}: {ended:?}");
        assert_eq!(ended.sentence(), "stopped by Ctrl-C; every file written so far is whole");
        assert_eq!(ended.document(), serde_json::json!({ "error": ended.sentence() }));
        let left = everything_in(dir.path());
        if arguments[0] == "scan" {
            assert!(left.keys().all(|path| path.ends_with("s") || is_tile(path)), "{:?}", left.keys());
        } else {
            assert!(left.is_empty(), "{arguments:?} left {:?}", left.keys());
        }
    }
}

fn is_tile(path: &Path) -> bool {
    let name = path.file_name().unwrap().to_string_lossy();
    name.starts_with("tile_") && path.extension().is_some_and(|ending| ending == "tif")
}

#[test]
fn a_second_ctrl_c_is_no_worse() {
    for (arguments, moment) in [
        (&["scan", "--twin", "--area", "20x20", "--out", "s"][..], "scanning"),
        (&["stitch", tiles().to_str().unwrap(), "--out", "mosaic.tif"], "registering"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let ended = pressed(dir.path(), arguments, moment, 2);
        assert_eq!(ended.status, Some(1), "{arguments:?}: {ended:?}");
        assert!(ended.stderr.trim_end().ends_with("every file written so far is whole"), "{ended:?}");
        let left = everything_in(dir.path());
        assert!(left.keys().all(|path| path.ends_with("s") || is_tile(path)), "{:?}", left.keys());
    }
}

/// A program is left on its path, and the stage is told where it stands.
#[test]
fn ctrl_c_stops_a_program() {
    let dir = tempfile::tempdir().unwrap();
    // Hours.
    std::fs::write(dir.path().join("long.nc"), "G0 X50 Y50\nG1 X60 F1\nX50\nG4 P100000\n").unwrap();
    let before = everything_in(dir.path());
    let ended = pressed(dir.path(), &["run", "long.nc", "--twin", "--trace", "long.csv"], "running", 1);
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert_eq!(ended.sentence(), "stopped by Ctrl-C; every file written so far is whole");
    let told = ended.stderr.lines().find(|line| line.starts_with("note: ")).unwrap();
    assert!(told.starts_with("note: the stage has stopped at x "), "{told}");
    assert_eq!(everything_in(dir.path()), before);
}
