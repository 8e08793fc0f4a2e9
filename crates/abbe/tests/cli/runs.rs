//! `abbe run` on the twin: what the stage was asked, tick by tick, and what is said of it.

use crate::ended::{Ended, abbe, command, done, everything_in, refused};
use serde_json::{Value, json};
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Stdio;

const FIELD: &str = "\
G21 G90
G0 X20 Y10
G64 P0.05 (corners without a stop, 50 um beside them at most)
G1 X30 F600
Y20
X20
Y10
G61
G1 X29 Y19 F600
G3 I-10 F1200 (a circle about 19, 19)
G4 P0.1
G5.5 X33 Y19 P0.5 L2 F300
M0
G28 X40
M2
";
/// The corners that are rounded, mm.
const CORNERS: [[i64; 2]; 3] = [[30, 10], [30, 20], [20, 20]];

const PM_PER_MM: i64 = 1_000_000_000;
/// Limits of the preset in picometres and ticks of 0.1 ms; places are rounded, and differences of them three times.
const LIMITS: [i64; 3] = [2_000_000 + 1, 5_000 + 2, 20 + 4];

/// A trace, each axis for itself.
struct Trace {
    /// Set-points, pm.
    asked: [Vec<i64>; 2],
    /// Speeds, accelerations, measured places: mm and s.
    speed: [Vec<f64>; 2],
    acceleration: [Vec<f64>; 2],
    measured: [Vec<f64>; 2],
}

fn pm(cell: &str) -> i64 {
    let (whole, part) = cell.split_once('.').unwrap();
    assert_eq!(part.len(), 9, "{cell}");
    format!("{whole}{part}").parse().unwrap()
}

impl Trace {
    fn read(file: &Path) -> Self {
        let text = fs::read_to_string(file).unwrap();
        let (header, rows) = text.split_once('\n').unwrap();
        assert_eq!(header, "t_s,x_mm,y_mm,vx,vy,ax,ay,xm_mm,ym_mm");
        let rows: Vec<Vec<&str>> = rows.lines().map(|row| row.split(',').collect()).collect();
        for (tick, row) in rows.iter().enumerate() {
            assert_eq!(row.len(), 9);
            assert_eq!(row[0], format!("{:.9}", tick as f64 * 1e-4), "one row a tick, from 0 on");
        }
        let number = |column: usize| rows.iter().map(|row| row[column].parse().unwrap()).collect();
        Self {
            asked: [1, 2].map(|column| rows.iter().map(|row| pm(row[column])).collect()),
            speed: [3, 4].map(number),
            acceleration: [5, 6].map(number),
            measured: [7, 8].map(number),
        }
    }

    fn places(&self) -> impl Iterator<Item = [i64; 2]> {
        self.asked[0].iter().zip(&self.asked[1]).map(|(&x, &y)| [x, y])
    }
}

fn differences(values: &[i64]) -> Vec<i64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

fn distance([x, y]: [i64; 2], place: [i64; 2]) -> f64 {
    ((x - place[0] * PM_PER_MM) as f64).hypot((y - place[1] * PM_PER_MM) as f64)
}

fn within_limits(trace: &Trace) {
    for (axis, places) in trace.asked.iter().enumerate() {
        let mut values = places.clone();
        for (order, limit) in LIMITS.into_iter().enumerate() {
            values = differences(&values);
            let most = values.iter().map(|value| value.abs()).max().unwrap();
            assert!(most <= limit, "axis {axis}, derivative {}: {most} of {limit}", order + 1);
        }
        for (tick, around) in places.windows(3).enumerate() {
            let [speed, acceleration] = [trace.speed[axis][tick + 1], trace.acceleration[axis][tick + 1]];
            let found = (around[2] - around[0]) as f64 * 1e-9 / 2e-4;
            assert!((found - speed).abs() < 1e-3, "tick {tick}: {found} {speed} mm/s");
            let found = (around[2] - 2 * around[1] + around[0]) as f64 * 1e-9 / 1e-8;
            assert!((found - acceleration).abs() < 2.5, "tick {tick}: {found} {acceleration} mm/s²");
        }
    }
}

/// None is missed by more than the tolerance, and in none it stops.
fn corners_are_cut(trace: &Trace) {
    let places: Vec<[i64; 2]> = trace.places().collect();
    for corner in CORNERS {
        let near = places.iter().map(|&place| distance(place, corner)).fold(f64::INFINITY, f64::min);
        assert!((10e6..=50.1e6).contains(&near), "{corner:?}: {near} pm");
        let close = places.windows(2).filter(|pair| distance(pair[0], corner) < 1e9);
        let slowest = close.map(|pair| {
            let [x, y] = [0, 1].map(|axis| (pair[1][axis] - pair[0][axis]) as f64);
            x.hypot(y)
        });
        let slowest = slowest.fold(f64::INFINITY, f64::min);
        assert!(slowest > 200_000.0, "{corner:?}: {slowest} pm a tick");
    }
}

/// Behind the stop at its beginning, up to the one at its end.
fn the_circle_is_one(trace: &Trace) {
    let places: Vec<[i64; 2]> = trace.places().collect();
    let begin = [29, 19].map(|mm| mm * PM_PER_MM);
    let first = places.iter().position(|&place| place == begin).unwrap();
    let length = places[first + 100..].iter().position(|&place| place == begin).unwrap() + 100;
    let circle = &places[first..first + length];
    assert!(circle.len() > 30_000, "3.14 s at 20 mm/s: {}", circle.len());
    let off = |&place: &[i64; 2]| (distance(place, [19, 19]) - 10e9).abs();
    let most = circle.iter().map(off).fold(0.0, f64::max);
    assert!(most <= 5_000.0, "{most} pm off the circle");
}

#[test]
fn a_program_is_run_as_it_is_written() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("field.nc"), FIELD).unwrap();
    let asked = ["run", "field.nc", "--twin", "--trace", "out/field.csv", "--plot", "out/field.svg"];
    let found = done(dir.path(), &asked);
    let trace = Trace::read(&dir.path().join("out/field.csv"));
    within_limits(&trace);
    corners_are_cut(&trace);
    the_circle_is_one(&trace);
    let places: Vec<[i64; 2]> = trace.places().collect();
    assert_eq!((places[0], places[places.len() - 1]), ([0, 0], [0, 19 * PM_PER_MM]));

    for (key, value) in [
        ("program", json!("field.nc")),
        ("lines", json!(15)),
        ("segments", json!(10)),
        ("dwells", json!({ "count": 1, "time_s": 0.1 })),
        ("pauses_without_user", json!(1)),
        ("feed_rate", json!(100)),
        ("limited_feeds", json!([])),
    ] {
        assert_eq!(found[key], value, "{key}");
    }
    let ticks = places.len() as f64 * 1e-4;
    let path_s = found["path_s"].as_f64().unwrap();
    assert!(path_s > 10.0 && path_s + 0.1 < ticks && ticks < path_s + 0.6, "{path_s} of {ticks} s");
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let errors = trace.asked[axis].iter().zip(&trace.measured[axis]);
        let most = errors.map(|(&asked, mm)| (asked as f64 * 1e-6 - mm * 1e3).abs()).fold(0.0, f64::max);
        let [told, rms] = ["max_um", "rms_um"].map(|key| found["following"][name][key].as_f64().unwrap());
        assert!((most - told).abs() < 1e-3 && told < 10.0, "{name}: {most} {told} µm");
        assert!(rms > 0.05 && rms < 0.5 * told, "{name}: {rms} µm rms");
        let arrived = found["position_mm"][axis].as_f64().unwrap();
        assert!((arrived - [0.0, 19.0][axis]).abs() < 0.6e-3, "{name}: {arrived}");
    }
    let svg = fs::read_to_string(dir.path().join("out/field.svg")).unwrap();
    for words in ["<polyline", "following error of x / µm", "following error of y / µm", "measured"] {
        assert!(svg.contains(words), "{words}");
    }
    assert_eq!(everything_in(dir.path()).len(), 4, "program, folder, trace and plot");
}

#[test]
fn what_was_done_is_told_in_words() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("line.nc"), "G1 X4 F1500\nM0\nM2\n").unwrap();
    let told = abbe(dir.path(), &["run", "line.nc", "--twin", "--feed-rate", "50"]);
    assert_eq!(told.status, Some(0), "{told:?}");
    assert_eq!(told.stderr, "checking the program …\nhoming …\nrunning the program …\n");
    for part in [
        "line.nc: the program was run on the stage microscope-100\n",
        "segments                   1\n",
        "feed rate                 50 %\n",
        "µm following error at most",
        "\narrived at x ",
        "note: line 1: the feed of 25.000000 mm/s is more than x can go",
        "note: it did not wait for a user",
    ] {
        assert!(told.stdout.contains(part), "{part}: {}", told.stdout);
    }
    // 4 mm at half the feed, and 40 + 25 ms to get there.
    let slow =
        done(dir.path(), &["run", "line.nc", "--twin", "--feed-rate", "50"])["path_s"].as_f64().unwrap();
    let fast = done(dir.path(), &["run", "line.nc", "--twin"])["path_s"].as_f64().unwrap();
    assert!((slow - 4.0 / 12.5 - 0.05).abs() < 0.01 && (fast - 0.2 - 0.065).abs() < 0.01, "{slow} {fast}");
}

#[test]
fn an_error_anywhere_moves_nothing_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("bad.nc"), "G0 X1\nG1 X50 F600\nX101\n").unwrap();
    let before = everything_in(dir.path());
    let asked = ["run", "bad.nc", "--twin", "--trace", "out/bad.csv", "--plot", "bad.svg"];
    let ended = abbe(dir.path(), &asked);
    assert_eq!((ended.status, ended.stdout.as_str()), (Some(1), ""));
    assert_eq!(ended.stderr.lines().next(), Some("checking the program …"));
    assert!(!ended.stderr.contains("homing"), "{ended:?}");
    let checked = abbe(dir.path(), &["run", "bad.nc", "--check"]);
    assert_eq!(ended.sentence(), checked.sentence());
    assert!(
        ended.sentence().starts_with("bad.nc, line 3, column 1: the line ends at x = 101 mm"),
        "{ended:?}"
    );
    assert_eq!(everything_in(dir.path()), before);
}

#[test]
fn what_cannot_be_run_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("field.nc"), FIELD).unwrap();
    fs::write(dir.path().join("mine.csv"), "mine").unwrap();
    fs::write(dir.path().join("slow.nc"), "G0 X1\nG1 X2 F0.001").unwrap();
    let cases: [(&[&str], i32, &[&str]); 9] = [
        (&["run", "field.nc"], 1, &["`abbe serve`", "--twin"]),
        (&["run", "-", "--twin"], 2, &["stdin", "--stream", "--check"]),
        (&["run", "/dev/null", "--twin"], 2, &["/dev/null", "--stream", "--check"]),
        (&["run", "none.nc", "--twin"], 1, &["none.nc: the program cannot be read"]),
        (&["run", "field.nc", "--twin", "--trace", "mine.csv"], 2, &["mine.csv", "--force"]),
        (&["run", "field.nc", "--twin", "--plot", "a.png"], 2, &["a.png", ".svg"]),
        (&["run", "field.nc", "--check", "--trace", "a.csv"], 2, &["--check", "--trace"]),
        (&["run", "field.nc", "--check", "--plot", "a.svg"], 2, &["--check", "--plot"]),
        (&["run", "field.nc", "--twin", "--feed-rate", "201"], 2, &["--feed-rate", "1..=200"]),
    ];
    for (arguments, status, names) in cases {
        refused(dir.path(), arguments, status, names);
    }
    let slow = abbe(dir.path(), &["run", "slow.nc", "--twin"]);
    let told = "slow.nc, line 2: the motion takes 60000 s, at its feed or where it bends most, and one may take 6711 s";
    assert!(slow.status == Some(1) && slow.sentence().starts_with(told), "{slow:?}");
}

/// Runs a program that comes on stdin.
fn streamed(dir: &Path, text: &str, more: &[&str]) -> Ended {
    let mut child = command(dir, &[&["run", "-", "--twin", "--stream", "--json"], more].concat())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    child.wait_with_output().unwrap().into()
}

#[test]
fn a_stream_is_run_as_the_file_is() {
    let dir = tempfile::tempdir().unwrap();
    let program = "G64 G1 X2 F1200\nX2.5 Y1\nG4 P0.05\nG2 X3.5 I0.5\nG28\n";
    fs::write(dir.path().join("stdin"), program).unwrap();
    let file = done(dir.path(), &["run", "stdin", "--twin", "--trace", "file.csv"]);
    let streamed = streamed(dir.path(), program, &["--trace", "stream.csv"]);
    assert_eq!((streamed.status, &streamed.document()), (Some(0), &file), "{streamed:?}");
    let bytes = |name: &str| fs::read(dir.path().join(name)).unwrap();
    assert!(bytes("file.csv") == bytes("stream.csv"), "another path");
}

#[test]
fn an_error_in_a_stream_ends_it_where_the_line_before_ends() {
    let dir = tempfile::tempdir().unwrap();
    let ended = streamed(dir.path(), "G0 X1\nG1 Y2 F600\nG1 X500\nG0 X2\n", &["--trace", "stream.csv"]);
    assert_eq!(ended.status, Some(1), "{ended:?}");
    let told = "stdin, line 3, column 4: the line ends at x = 500 mm of the machine";
    assert!(ended.sentence().starts_with(told), "{ended:?}");
    assert!(ended.sentence().contains("; the stage rests at x 1.000"), "{ended:?}");
    let document = ended.document();
    assert_eq!((&document["count"], &document["segments"]), (&json!(1), &json!(2)));
    assert_eq!((&document["errors"][0]["line"], &document["errors"][0]["column"]), (&json!(3), &json!(4)));
    let at = |axis: usize| document["position_mm"][axis].as_f64().unwrap();
    assert!((at(0) - 1.0).abs() < 0.6e-3 && (at(1) - 2.0).abs() < 0.6e-3, "{document}");
    // What was done is there to be looked into.
    let last = Trace::read(&dir.path().join("stream.csv")).places().last();
    assert_eq!(last, Some([PM_PER_MM, 2 * PM_PER_MM]));

    let ended = streamed(dir.path(), "G0 Z1\n", &["--trace", "none.csv"]);
    assert!(ended.sentence().starts_with("stdin, line 1, column 4: the stage has no Z"), "{ended:?}");
    assert_eq!(ended.document()["refused_line"], Value::Null);
    assert!(!dir.path().join("none.csv").exists(), "nothing moved");
}

#[test]
fn one_axis_goes_after_the_other_when_asked() {
    let dir = tempfile::tempdir().unwrap();
    let found = done(dir.path(), &["move", "2", "3", "--twin", "--sequential"]);
    assert_eq!(found["sequential"], true);
    // 20 mm/s, 40 ms to get there, 25 ms for the acceleration, for each.
    let moved = found["moved_s"].as_f64().unwrap();
    assert!((moved - 5.0 / 20.0 - 2.0 * 0.065).abs() < 0.005, "{moved}");
    let told = abbe(dir.path(), &["move", "2", "3", "--twin", "--sequential"]).stdout;
    assert!(told.contains("s on the path (x first, then y)"), "{told}");
    assert_eq!(done(dir.path(), &["move", "2", "3", "--twin"])["sequential"], false);
}
