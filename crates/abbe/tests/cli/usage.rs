//! Wrong command lines, and calls for help.

use crate::ended::{abbe, refused};

#[test]
fn a_wrong_command_line_is_told_in_one_sentence_and_exit_status_2() {
    let dir = tempfile::tempdir().unwrap();
    let cases: [(&[&str], &[&str]); 19] = [
        (&["frobnicate"], &["'frobnicate'", "`abbe help`"]),
        (&["hom"], &["'hom'", "'home'"]),
        (&["serve"], &["`abbe serve`", "not in this version"]),
        (&["move", "--twin", "5"], &["<Y>", "usage: abbe move"]),
        (&["move", "--twin", "5", "six"], &["`six`", "not a number"]),
        (&["move", "--tvin", "5"], &["`--tvin`", "option"]),
        (&["move", "--twin", "5", "NaN"], &["`NaN`", "finite"]),
        (&["move", "--twin", "5", "1e300"], &["`1e300`", "±1000000 mm"]),
        (&["home", "--twin", "--seed", "-1"], &["--seed", "-1"]),
        (&["home", "--twin", "--times", "0"], &["--times", "0 is not in 1..=10000"]),
        (&["home", "--tvin"], &["'--tvin'", "'--twin'"]),
        (&["measure", "--twin", "--out", "m", "--runs", "1"], &["--runs", "1 is not in 2..=1000"]),
        (&["measure", "--twin", "--out", "m", "--step", "0"], &["--step", "0 mm"]),
        (&["measure", "--twin", "--out", "m", "--step", "-2"], &["--step", "-2 mm"]),
        (&["measure", "--twin", "--out", "m", "--step", "200"], &["--step", "200 mm"]),
        (&["measure", "--twin", "--out", "m", "--warm-up", "-5"], &["--warm-up", "`-5` min"]),
        (&["measure", "--twin"], &["--out <DIR>", "usage: abbe measure"]),
        (&["compensate", "readings-x.csv"], &["--out <FILE>"]),
        (&["verify", "--out", "v"], &["--compensation FILE"]),
    ];
    for (arguments, names) in cases {
        refused(dir.path(), arguments, 2, names);
    }
}

#[test]
fn help_goes_to_stdout() {
    let dir = tempfile::tempdir().unwrap();
    for (arguments, says) in [
        (&[][..], "Usage: abbe"),
        (&["help"], "stitch"),
        (&["--help"], "Exit status"),
        (&["help", "move"], "mm"),
        (&["scan", "--help"], "Overlap of neighbouring tiles, %"),
        (&["sweep", "--help"], "Distance of the places at which an event fires, µm"),
        (&["help"], "  sweep "),
        (&["--version"], env!("CARGO_PKG_VERSION")),
    ] {
        let ended = abbe(dir.path(), arguments);
        assert_eq!((ended.status, ended.stderr.as_str()), (Some(0), ""), "{arguments:?}");
        assert!(ended.stdout.contains(says), "{arguments:?}: {}", ended.stdout);
    }
    let ended = abbe(dir.path(), &["--json"]);
    assert_eq!(ended.status, Some(0));
    assert!(ended.document()["help"].as_str().unwrap().contains("Usage: abbe"));
}

#[test]
fn without_a_stage_both_ways_to_one_are_named() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("c.toml"), "not read").unwrap();
    let cases: [&[&str]; 5] = [
        &["home"],
        &["move", "1", "2"],
        &["measure", "--out", "m"],
        &["verify", "--compensation", "c.toml", "--out", "v"],
        &["scan", "--out", "s"],
    ];
    for arguments in cases {
        refused(dir.path(), arguments, 1, &["`abbe serve`", "--twin"]);
    }
}
