//! The flight recorder: a run that is recorded happens again, and what is no such run is refused.

use crate::ended::{PRESET, abbe, done, everything_in, refused};
use std::fs;
use std::path::Path;

/// Bytes of a file before what its checksum covers last.
const LENGTH_AT: usize = 10;
const CHECKSUM_AT: usize = 18;

fn recorded(dir: &Path) -> Vec<u8> {
    done(dir, &["record", "run.abr", "--twin", "--move", "1", "2", "--move", "0.5", "-0", "--seed", "4"]);
    fs::read(dir.join("run.abr")).unwrap()
}

#[test]
fn what_is_recorded_happens_again() {
    let dir = tempfile::tempdir().unwrap();
    let record = ["record", "run.abr", "--twin", "--move", "1", "2", "--move", "0.5", "0", "--seed", "4"];
    let written = done(dir.path(), &record);
    assert_eq!(written["seed"], 4);
    assert_eq!(written["faults"], serde_json::json!([]));
    let bytes = fs::metadata(dir.path().join("run.abr")).unwrap().len();
    assert_eq!(written["bytes"], bytes);
    let ticks = written["ticks"].as_u64().unwrap();
    assert!(ticks > 30_000 && bytes < ticks, "{bytes} bytes for {ticks} ticks");

    let replayed = done(dir.path(), &["replay", "run.abr", "--step", "1000"]);
    assert_eq!((&replayed["identical"], &replayed["ticks"]), (&true.into(), &ticks.into()));
    assert_eq!(replayed["preset"], "microscope-100");
    let texts: Vec<&str> =
        replayed["marks"].as_array().unwrap().iter().map(|mark| mark["text"].as_str().unwrap()).collect();
    assert_eq!(texts, ["home", "move to 1.0000, 2.0000", "move to 0.5000, 0.0000"]);
    let rows = replayed["rows"].as_array().unwrap();
    assert_eq!(rows.len() as u64, ticks.div_ceil(1000));
    assert_eq!((&rows[0]["state"], &rows[0]["t_s"]), (&"off".into(), &1e-4.into()));
    let people = abbe(dir.path(), &["replay", "run.abr", "--step", "50000"]).stdout;
    assert!(people.contains("bit for bit") && people.contains("move to 1.0000") && people.contains("homing"));
    // The same run, the same file: nothing of the machine or the hour is in it.
    let first = fs::read(dir.path().join("run.abr")).unwrap();
    done(dir.path(), &[&record[..], &["--force"]].concat());
    assert!(fs::read(dir.path().join("run.abr")).unwrap() == first);
}

#[test]
fn a_script_is_played_and_its_faults_are_told() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(
        dir.path().join("stop.txt"),
        "enable\nwait 0.1\npress emergency stop # by hand\nwait 0.1\nexpect fault emergency stop\n\
         release emergency stop\nreset\nexpect state off\n",
    )
    .unwrap();
    let written = done(dir.path(), &["record", "stop.abr", "--twin", "--script", "stop.txt"]);
    assert_eq!(written["faults"][0]["text"], "emergency stop");
    let replayed = done(dir.path(), &["replay", "stop.abr"]);
    let kinds: Vec<&str> =
        replayed["marks"].as_array().unwrap().iter().map(|mark| mark["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["command", "fault", "command"]);

    fs::write(dir.path().join("wrong.txt"), "enable\n\nexpcet state ready\n").unwrap();
    refused(
        dir.path(),
        &["record", "w.abr", "--twin", "--script", "wrong.txt"],
        1,
        &["wrong.txt, line 3", "`expcet`", "`expect`"],
    );
    fs::write(dir.path().join("empty.txt"), "# nothing\n").unwrap();
    refused(
        dir.path(),
        &["record", "w.abr", "--twin", "--script", "empty.txt"],
        1,
        &["empty.txt", "says nothing"],
    );
    refused(
        dir.path(),
        &["record", "w.abr", "--twin", "--script", "none.txt"],
        1,
        &["none.txt", "cannot be read"],
    );
    let both = ["record", "w.abr", "--twin", "--script", "stop.txt", "--move", "1", "1"];
    refused(dir.path(), &both, 2, &["--script", "--move"]);
    // What was expected and did not come is recorded all the same.
    fs::write(dir.path().join("unmet.txt"), "enable\nexpect state off\n").unwrap();
    let ended = abbe(dir.path(), &["record", "unmet.abr", "--twin", "--script", "unmet.txt"]);
    assert_eq!(ended.status, Some(1));
    for name in ["unmet.txt, line 2: the state is ready, not off", "unmet.abr"] {
        assert!(ended.sentence().contains(name), "{ended:?}");
    }
    done(dir.path(), &["replay", "unmet.abr"]);
}

#[test]
fn what_happens_to_a_head_is_recorded_and_a_digital_head_refuses_it() {
    let dir = tempfile::tempdir().unwrap();
    let script =
        "home\nmove 2 2\nstart move 20 2\nwait 1\nstick cosine x\nwait until fault\nexpect state fault\n";
    fs::write(dir.path().join("stick.txt"), script).unwrap();
    let record = ["record", "s.abr", "--twin", "--script", "stick.txt"];
    let written = done(dir.path(), &[&record[..], &["--preset", "litho-120"]].concat());
    let told = written["faults"][0]["text"].as_str().unwrap();
    assert!(told.contains("encoder"), "{written}");
    let replayed = done(dir.path(), &["replay", "s.abr"]);
    assert_eq!(replayed["marks"].as_array().unwrap().last().unwrap()["text"], told);
    let ended = abbe(dir.path(), &["record", "d.abr", "--twin", "--script", "stick.txt"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.sentence().contains("stick.txt, line 5: the head of axis x is digital"), "{ended:?}");
}

#[test]
fn a_replay_is_drawn_and_written_out() {
    let dir = tempfile::tempdir().unwrap();
    recorded(dir.path());
    let end = done(dir.path(), &["replay", "run.abr"])["to_s"].as_f64().unwrap();
    let (from, to) = (format!("{:.3}", end - 0.5), format!("{:.3}", end - 0.1));
    let window = ["replay", "run.abr", "--from", &from, "--to", &to];
    done(dir.path(), &[&window[..], &["--csv", "new/rows.csv", "--plot", "run.svg"]].concat());
    done(dir.path(), &[&window[..], &["--plot", "run.html", "--csv", "few.csv", "--step", "100"]].concat());
    let csv = fs::read_to_string(dir.path().join("new/rows.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..3], ["t_s", "state", "x_set_mm"]);
    assert!((3_999..=4_001).contains(&(rows.len() - 1)), "{}", rows.len());
    let time = |row: &[&str]| row[0].parse::<f64>().unwrap();
    assert!(rows[1..].windows(2).all(|pair| (time(&pair[1]) - time(&pair[0]) - 1e-4).abs() < 1e-9));
    assert!((time(&rows[1]) - (end - 0.5)).abs() < 1e-3);
    let few = fs::read_to_string(dir.path().join("few.csv")).unwrap();
    assert!((41..=42).contains(&few.lines().count()));
    let svg = fs::read_to_string(dir.path().join("run.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.len() > 20_000);
    for words in ["place / mm", "following error / µm", "steps a second", "settling", "move to 0.5000"] {
        assert!(svg.contains(words), "{words} is not in the plot");
    }
    let page = fs::read_to_string(dir.path().join("run.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("bit for bit") && page.contains("<svg"));
}

#[test]
fn wishes_that_cannot_be_fulfilled_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    recorded(dir.path());
    fs::write(dir.path().join("mine.svg"), "mine").unwrap();
    fs::create_dir(dir.path().join("folder.csv")).unwrap();
    let cases: [(&[&str], i32, &[&str]); 12] = [
        (&["--from", "5", "--to", "3"], 2, &["--from 5", "--to 3"]),
        (&["--from", "5", "--to", "5"], 2, &["--from 5", "--to 5"]),
        (&["--from", "5000"], 1, &["--from 5000", "covers 0.0000 …"]),
        (&["--to", "5000"], 1, &["--to 5000", "covers"]),
        (&["--from", "-1"], 1, &["--from -1", "covers"]),
        (&["--from", "nan"], 2, &["nan", "--from"]),
        (&["--step", "0"], 2, &["--step"]),
        (&["--plot", "run.png"], 2, &["run.png", ".svg or .html"]),
        (&["--plot", "mine.svg"], 2, &["mine.svg", "--plot", "--force"]),
        (&["--csv", "folder.csv"], 2, &["--csv folder.csv", "folder"]),
        (&["--csv", "mine.svg/x.csv"], 1, &["--csv mine.svg/x.csv", "cannot be written"]),
        (&["--preset", "nowhere"], 2, &["nowhere"]),
    ];
    for (arguments, status, names) in cases {
        refused(dir.path(), &[&["replay", "run.abr"], arguments].concat(), status, names);
    }
    refused(dir.path(), &["replay", "none.abr"], 1, &["none.abr", "cannot be read"]);
    refused(dir.path(), &["replay", "."], 1, &["cannot be read"]);
    refused(dir.path(), &["record", "new.abr"], 1, &["--twin", "daemon"]);
    refused(dir.path(), &["record", "run.abr", "--twin"], 2, &["run.abr", "--force"]);
    refused(dir.path(), &["record", "folder.csv", "--twin"], 2, &["folder.csv", "folder"]);
    refused(dir.path(), &["record", "new.abr", "--twin", "--move", "1"], 2, &["--move"]);
    refused(dir.path(), &["record", "new.abr", "--twin", "--move", "1", "far"], 2, &["far"]);
}

#[test]
fn files_that_are_no_recording_of_this_program_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let good = recorded(dir.path());
    let try_file = |bytes: &[u8], names: &[&str]| {
        fs::write(dir.path().join("bad.abr"), bytes).unwrap();
        refused(dir.path(), &["replay", "bad.abr"], 1, &[&["bad.abr"], names].concat());
    };
    try_file(b"", &["no recording of abbe"]);
    try_file(PRESET.as_bytes(), &["no recording of abbe"]);
    for cut in [8, 9, LENGTH_AT, CHECKSUM_AT + 3, 100, good.len() / 2, good.len() - 1] {
        try_file(&good[..cut], &["cut off"]);
    }
    for at in [CHECKSUM_AT, 30, 200, good.len() / 2, good.len() - 1] {
        let mut altered = good.clone();
        altered[at] ^= 0x10;
        try_file(&altered, &["altered", "checksum"]);
    }
    try_file(&[&good[..], b"x"].concat(), &["altered"]);
    for version in [1, 3] {
        let mut other = good.clone();
        other[8] = version;
        try_file(&other, &[&format!("version {version} of the file"), "version 2"]);
    }
}

#[test]
fn another_preset_is_refused_with_both_names() {
    let dir = tempfile::tempdir().unwrap();
    recorded(dir.path());
    fs::write(dir.path().join("same.toml"), PRESET).unwrap();
    fs::write(dir.path().join("faster.toml"), PRESET.replacen("speed_mm_s = 20.0", "speed_mm_s = 21.0", 1))
        .unwrap();
    for same in ["microscope-100", "same.toml"] {
        done(dir.path(), &["replay", "run.abr", "--preset", same]);
    }
    let names = ["run.abr", "`microscope-100`", "`faster`", "--preset"];
    refused(dir.path(), &["replay", "run.abr", "--preset", "faster.toml"], 1, &names);
    // A recording of it needs no preset to be replayed.
    done(dir.path(), &["record", "f.abr", "--twin", "--move", "1", "1", "--preset", "faster.toml"]);
    assert_eq!(done(dir.path(), &["replay", "f.abr"])["preset"], "faster");
    refused(
        dir.path(),
        &["replay", "f.abr", "--preset", "microscope-100"],
        1,
        &["`faster`", "`microscope-100`"],
    );
}

/// A stage that looks for its switch over a millimetre only, and does not find it.
fn short_search(dir: &Path) {
    let text = PRESET.replace("home_search_mm = 115.0", "home_search_mm = 1.0");
    fs::write(dir.join("short.toml"), text).unwrap();
}

#[test]
fn a_fault_leaves_its_flight_recording() {
    let dir = tempfile::tempdir().unwrap();
    short_search(dir.path());
    fs::write(dir.path().join("abbe-flight-1.abr"), "mine").unwrap();
    let ended = abbe(dir.path(), &["home", "--twin", "--preset", "short.toml"]);
    assert_eq!(ended.status, Some(1));
    for name in ["the stage stopped", "switch was not found", "abbe-flight-2.abr", "abbe replay"] {
        assert!(ended.sentence().contains(name), "{ended:?}");
    }
    assert_eq!(fs::read_to_string(dir.path().join("abbe-flight-1.abr")).unwrap(), "mine");
    let replayed = done(dir.path(), &["replay", "abbe-flight-2.abr"]);
    let marks = replayed["marks"].as_array().unwrap();
    assert_eq!(marks.last().unwrap()["kind"], "fault");
    assert!(marks.last().unwrap()["text"].as_str().unwrap().contains("switch was not found"));

    // Where there is a folder for results, it goes there.
    let measure = ["measure", "--twin", "--preset", "short.toml", "--out", "m"];
    let ended = abbe(dir.path(), &measure);
    assert!(ended.sentence().contains("m/abbe-flight-1.abr"), "{ended:?}");
    let left: Vec<_> = everything_in(&dir.path().join("m")).into_keys().collect();
    assert_eq!(left, [dir.path().join("m/abbe-flight-1.abr")]);

    // A recording of its own needs no second one.
    let ended = abbe(dir.path(), &["record", "r.abr", "--twin", "--preset", "short.toml"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.sentence().contains("what led to it is in r.abr"), "{ended:?}");
    done(dir.path(), &["replay", "r.abr"]);
    assert!(!dir.path().join("abbe-flight-3.abr").exists());
}

/// From the twin's grating into a recording, out of it, and judged: what the preset's `[plant]` makes of its signals.
#[test]
fn samples_of_an_analogue_encoder_come_out_of_a_recording() {
    let dir = tempfile::tempdir().unwrap();
    done(dir.path(), &["record", "run.abr", "--twin", "--preset", "litho-120", "--move", "4", "4"]);
    for (axis, offsets, gain, degrees) in [("x", [5.0, -3.0], 1.08, 4.0), ("y", [-3.0, 5.0], 0.93, -4.0)] {
        let samples = ["replay", "run.abr", "--samples", "s.csv", "--axis", axis, "--force"];
        let replayed = done(dir.path(), &[&samples[..], &["--from", "1", "--to", "2.5"]].concat());
        assert_eq!(replayed["samples"], "s.csv");
        let judged = done(dir.path(), &["encoder", "s.csv", "--period-um", "0.8", "--bits", "16"]);
        assert!(judged["samples"].as_u64().unwrap() > 14_990, "{judged:#}");
        let signals = &judged["ellipse"];
        let near = |name: &str, wanted: f64, within: f64| {
            let found = signals[name].as_f64().unwrap();
            assert!((found - wanted).abs() < within, "{axis} {name}: {found}, not {wanted}");
        };
        // They wander along the travel: 1 % each, rms.
        near("offset_a_percent", offsets[0], 4.0);
        near("offset_b_percent", offsets[1], 4.0);
        near("gain", gain, 0.05);
        near("phase_deg", degrees, 1.0);
    }
}

#[test]
fn a_recording_without_samples_gives_none() {
    let dir = tempfile::tempdir().unwrap();
    recorded(dir.path());
    refused(
        dir.path(),
        &["replay", "run.abr", "--samples", "s.csv", "--axis", "x"],
        1,
        &["no samples of axis x", "litho-120"],
    );
    refused(dir.path(), &["replay", "run.abr", "--samples", "s.csv"], 2, &["--axis"]);
}
