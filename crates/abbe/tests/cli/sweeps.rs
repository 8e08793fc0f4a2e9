//! `abbe sweep` on the twin: events at their places, line by line, and what is said of them.

use crate::ended::{abbe, done, everything_in, refused};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

const HEADER: &str = "t_s,line,place,direction,x_mm,y_mm,true_x_mm,true_y_mm";

/// A row of a file of events.
#[derive(Debug)]
struct Event {
    t_s: f64,
    line: usize,
    place: usize,
    up: bool,
    /// mm.
    measured: [f64; 2],
    table: [f64; 2],
}

fn events(file: &Path) -> Vec<Event> {
    let text = fs::read_to_string(file).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    assert_eq!(header, HEADER);
    let event = |row: &str| {
        let cells: Vec<&str> = row.split(',').collect();
        assert_eq!(cells.len(), 8, "{row}");
        let mm = |column: usize| {
            assert_eq!(cells[column].split_once('.').unwrap().1.len(), 9, "{row}");
            cells[column].parse().unwrap()
        };
        Event {
            t_s: mm(0),
            line: cells[1].parse().unwrap(),
            place: cells[2].parse().unwrap(),
            up: cells[3] == "up",
            measured: [mm(4), mm(5)],
            table: [mm(6), mm(7)],
        }
    };
    rows.lines().map(event).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// Lines along x, of 21 places from 30 mm on, 0.1 mm apart.
fn each_line_passes_each_place_once(events: &[Event], speed_mm_s: f64, lines_mm: &[f64]) {
    assert_eq!(events.len(), lines_mm.len() * 21);
    assert!(events.windows(2).all(|pair| pair[0].t_s < pair[1].t_s));
    for (number, (line, y_mm)) in events.chunks(21).zip(lines_mm).enumerate() {
        let up = number % 2 == 0;
        for (turn, event) in line.iter().enumerate() {
            let place = if up { turn } else { 20 - turn };
            assert_eq!((event.line, event.place, event.up), (number, place, up));
            // To the nearest billionth of a millimetre.
            assert!((event.measured[0] - (30.0 + place as f64 * 0.1)).abs() < 2e-9, "{event:?}");
            assert!((event.measured[1] - y_mm).abs() < 5e-3, "{event:?}");
        }
        for pair in line.windows(2) {
            let speed = 0.1 / (pair[1].t_s - pair[0].t_s);
            assert!((speed / speed_mm_s - 1.0).abs() < 0.03, "{speed} mm/s: {pair:?}");
        }
    }
}

/// The figures of the truth are those of the file.
fn the_truth_is_told(found: &Value, events: &[Event]) {
    for (name, up) in [("up", true), ("down", false)] {
        let off: Vec<f64> = events
            .iter()
            .filter(|event| event.up == up)
            .map(|event| (event.table[0] - (30.0 + event.place as f64 * 0.1)) * 1e3)
            .collect();
        let count = off.len() as f64;
        let told = |key: &str| number(&found["truth"][name][key]);
        let mean = off.iter().sum::<f64>() / count;
        let rms = (off.iter().map(|off| off * off).sum::<f64>() / count).sqrt();
        let scatter = (off.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / count).sqrt();
        let most = off.iter().map(|off| off.abs()).fold(0.0, f64::max);
        for (key, value) in [("mean_um", mean), ("rms_um", rms), ("scatter_um", scatter), ("max_um", most)] {
            assert!((told(key) - value).abs() < 1e-4, "{name}, {key}: {value} {found}");
        }
    }
}

/// A reading is a tick old when the controller has it, so the table is a tick's way ahead, in both directions.
fn the_age_of_a_reading_shows(found: &Value, tick_um: f64, reversal_um: f64) {
    let mean = |name: &str| number(&found["truth"][name]["mean_um"]);
    let apart = mean("up") - mean("down");
    assert!((apart - 2.0 * tick_um).abs() < reversal_um, "{apart} µm: {found}");
}

const AREA: [&str; 7] = ["sweep", "--twin", "--area", "2x0.5", "--at", "30,40", "--every"];

#[test]
fn the_microscope_s_stage_fires_at_its_places() {
    let dir = tempfile::tempdir().unwrap();
    let more = ["100", "--lines", "3", "--speed", "10", "--events", "out/events.csv"];
    let found = done(dir.path(), &[&AREA[..], &more].concat());
    let events = events(&dir.path().join("out/events.csv"));
    each_line_passes_each_place_once(&events, 10.0, &[40.0, 40.25, 40.5]);
    the_truth_is_told(&found, &events);
    // 1 µm a tick; the table gives way by half a micrometre when it turns.
    the_age_of_a_reading_shows(&found, 1.0, 0.8);
    for (key, value) in [
        ("lines", json!(3)),
        ("places", json!(21)),
        ("every_um", json!(100.0)),
        ("play_um", json!(1.0)),
        ("settle_ms", json!(20.0)),
        ("events", json!({ "fired": 63, "lost": 0, "file": "out/events.csv" })),
        ("faulty", json!(0)),
        ("area_mm", json!({ "x": [30.0, 32.0], "y": [40.0, 40.5] })),
    ] {
        assert_eq!(found[key], value, "{key}");
    }
    // Three lines of 0.2 s, two turns, a run-up and a stop.
    let [time_s, turn, stopping] = ["time_s", "turn_ms", "stop_and_go_ms"].map(|key| number(&found[key]));
    let ends_s = time_s - 0.6 - 2e-3 * turn;
    assert!(ends_s > 0.08 && ends_s < 0.12 && turn < 0.7 * stopping, "{found}");
    let [first, last] = [&events[0], &events[62]].map(|event| event.t_s);
    assert!((last - first - 0.6 - 2e-3 * turn).abs() < 2e-3, "{first} {last}: {found}");
    let [rms, most] = ["rms_percent", "max_percent"].map(|key| number(&found["speed"][key]));
    assert!(rms > 0.1 && rms < 3.0 && most > rms && most < 15.0, "{found}");
    for axis in ["x", "y"] {
        let [rms, most] = ["rms_um", "max_um"].map(|key| number(&found["following"][axis][key]));
        assert!(rms > 0.05 && rms < 2.0 && most >= rms && most < 10.0, "{found}");
    }
}

#[test]
fn paper_b_s_stage_fires_at_its_places() {
    let dir = tempfile::tempdir().unwrap();
    let more = ["100", "--pitch", "250", "--speed", "4", "--preset", "litho-120", "--events", "events.csv"];
    let found = done(dir.path(), &[&AREA[..], &more].concat());
    let events = events(&dir.path().join("events.csv"));
    each_line_passes_each_place_once(&events, 4.0, &[40.0, 40.25, 40.5]);
    the_truth_is_told(&found, &events);
    the_age_of_a_reading_shows(&found, 0.4, 0.2);
    let scatter = number(&found["truth"]["up"]["scatter_um"]);
    assert!(scatter > 0.002 && scatter < 0.2, "{found}");
    assert_eq!(found["signals"]["x"]["fail"], "");
}

#[test]
fn a_way_back_fires_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let more =
        ["200", "--lines", "3", "--speed", "5", "--along", "y", "--fly-back", "--events", "events.csv"];
    let found = done(dir.path(), &[&AREA[..], &more].concat());
    assert_eq!((&found["places"], &found["along"]), (&json!(3), &json!("y")));
    assert_eq!(found["truth"]["down"], Value::Null);
    let events = events(&dir.path().join("events.csv"));
    let told: Vec<_> = events.iter().map(|event| (event.line, event.place, event.up)).collect();
    let all: Vec<_> = (0..9).map(|number| (number / 3, number % 3, true)).collect();
    assert_eq!(told, all);
    for event in &events {
        let place = [30.0 + event.line as f64, 40.0 + event.place as f64 * 0.2];
        assert!((event.measured[0] - place[0]).abs() < 5e-3, "{event:?}");
        assert!((event.measured[1] - place[1]).abs() < 2e-9, "{event:?}");
    }
}

#[test]
fn a_sweep_is_told_in_words_and_is_the_same_again() {
    let dir = tempfile::tempdir().unwrap();
    let swept = |file: &str, seed: &str| {
        let more = ["500", "--lines", "2", "--speed", "20", "--seed", seed, "--events", file];
        let told = abbe(dir.path(), &[&AREA[..], &more].concat());
        assert_eq!(told.status, Some(0), "{told:?}");
        (told, fs::read(dir.path().join(file)).unwrap())
    };
    let (told, one) = swept("one.csv", "3");
    assert_eq!(told.stderr, "homing …\nsweeping …\n");
    for part in [
        "a sweep along x on the stage microscope-100\n",
        "lines           2 at 20 mm/s\n",
        "places          5 a line, 500 µm apart\n",
        "if it stopped on the way\n",
        "events          10 fired, 0 lost\n",
        "following error inside the area",
        "the table truly was from the places, along x, µm:\n",
        "each line has passed each place once; arrived at x ",
        "10 events → one.csv\n",
    ] {
        assert!(told.stdout.contains(part), "{part}: {}", told.stdout);
    }
    assert!(one == swept("same.csv", "3").1 && one != swept("other.csv", "4").1);
}

/// A stage that creeps goes back now and then. Without play it fires places again; the file is there all the same.
#[test]
fn lines_that_pass_places_again_are_told_and_the_sweep_has_failed() {
    let dir = tempfile::tempdir().unwrap();
    let asked = ["sweep", "--twin", "--area", "0.2x0.01", "--lines", "2", "--speed", "0.1", "--every", "1"];
    let ended = abbe(dir.path(), &[&asked[..], &["--play", "0", "--json", "--events", "e.csv"]].concat());
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(ended.stderr.contains("line 0 (from 0)") && ended.stderr.contains("again"), "{ended:?}");
    let document = ended.document();
    assert!(document["error"].as_str().unwrap().contains("lines missed places or passed them again"));
    let again: f64 =
        document["faulty_lines"].as_array().unwrap().iter().map(|line| number(&line["again"])).sum();
    let events = events(&dir.path().join("e.csv"));
    assert!(again > 0.0 && events.len() as f64 == 402.0 + again, "{again} of {}", events.len());
    done(dir.path(), &asked);
}

#[test]
fn what_cannot_be_swept_is_refused_before_anything_moves() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("mine.csv"), "mine").unwrap();
    let good = "--area 2x0.5 --lines 3 --speed 10 --every 100";
    let cases = [
        (good.to_owned(), 1, &["`abbe serve`", "--twin"][..]),
        (format!("{good} --twin --at 0,0"), 2, &["with its turns", "x = -0.", "100.000000 mm"]),
        (format!("{good} --twin --at 99,0"), 2, &["x = ", "101.", "travel"]),
        (format!("{good} --twin --events mine.csv"), 2, &["mine.csv", "--force"]),
        (format!("{good} --twin --pitch 10"), 2, &["--lines", "--pitch"]),
        (format!("{good} --twin --settle -1"), 2, &["--settle", "`-1` ms"]),
        (format!("{good} --twin --play -1"), 2, &["--play", "`-1`"]),
        ("--twin --area 2x0.5 --speed 10 --every 100".into(), 2, &["--lines <N>"]),
        ("--twin --area 2x0.5 --lines 0 --speed 10 --every 100".into(), 2, &["--lines", "0"]),
        ("--twin --area 2x0.5 --lines 3 --speed 21 --every 100".into(), 2, &["--speed 21", "20 mm/s"]),
        (
            "--twin --area 2x0.5 --lines 3 --speed 0 --every 100".into(),
            2,
            &["--speed", "`0` is not more than 0"],
        ),
        (
            "--twin --area 2x0.5 --lines 3 --speed 10 --every 0".into(),
            2,
            &["--every", "`0` is not more than 0"],
        ),
        ("--twin --area 2 --lines 3 --speed 10 --every 100".into(), 2, &["`2`", "10x8"]),
        ("--twin --area 2x0.5 --lines 3 --speed 10 --every 0.1".into(), 2, &["--every 0.1", "8 fit"]),
    ];
    for (options, status, names) in cases {
        let line = format!("sweep {options}");
        refused(dir.path(), &line.split(' ').collect::<Vec<_>>(), status, names);
    }
    assert_eq!(everything_in(dir.path()).len(), 1);
}
