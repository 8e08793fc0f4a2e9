//! `abbe run --stepwise`: steps on paper and on the twin, judged by their traces alone.

use crate::ended::{abbe, done, everything_in, refused};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// Rows of a trace as numbers.
fn rows(file: &Path, header: &str) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(file).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    assert_eq!(head, header);
    rows.lines().map(|row| row.split(',').map(|cell| cell.parse().unwrap()).collect()).collect()
}

/// A program on paper: its document, and the points in steps with their times.
fn on_paper(program: &str, step_mm: f64) -> (Value, Vec<[i64; 2]>, Vec<f64>) {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), program).unwrap();
    let option = format!("--stepwise={}", step_mm * 1e3);
    let found = done(dir.path(), &["run", "a.nc", &option, "--trace", "out/a.csv"]);
    let rows = rows(&dir.path().join("out/a.csv"), "t_s,x_mm,y_mm,vx,vy,ax,ay");
    let points = rows.iter().map(|row| {
        [row[1], row[2]].map(|mm| {
            let steps = (mm / step_mm).round();
            assert!((mm - steps * step_mm).abs() < 1e-9, "{mm} mm is no point");
            steps as i64
        })
    });
    (found["stepwise"].clone(), points.collect(), rows.iter().map(|row| row[0]).collect())
}

/// Each row is a step of one on one axis, and all take the same time.
fn are_steps(points: &[[i64; 2]], times: &[f64], each_s: f64) {
    for (pair, time) in points.windows(2).zip(times.windows(2)) {
        let way = (pair[1][0] - pair[0][0]).abs() + (pair[1][1] - pair[0][1]).abs();
        assert_eq!(way, 1, "{pair:?}");
        assert!((time[1] - time[0] - each_s).abs() < 2e-9, "{time:?}, not {each_s}");
    }
}

#[test]
fn a_line_is_stairs_beside_it() {
    let (told, points, times) = on_paper("G1 X0.7 Y0.3 F60\nM2\n", 0.001);
    assert_eq!((points[0], points[points.len() - 1], points.len()), ([0, 0], [700, 300], 1001));
    are_steps(&points, &times, 0.7_f64.hypot(0.3) / 1000.0);
    let beside = points.iter().map(|&[x, y]| (700 * y - 300 * x).abs() as f64 / 700_f64.hypot(300.0));
    let most = beside.fold(0.0, f64::max);
    assert!((told["beside"]["steps"].as_f64().unwrap() - most).abs() < 1e-9 && most < 0.7072, "{most}");
    assert!((told["beside"]["nm"].as_f64().unwrap() - 1e3 * most).abs() < 1e-6);
    assert_eq!(told["steps"], json!({ "x": 700, "y": 300, "total": 1000 }));
    assert_eq!(told["ends_exact"], true);
    // A count of the scale, unless a step is named.
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), "G1 X0.7 Y0.3 F60\nM2\n").unwrap();
    let counted = done(dir.path(), &["run", "--stepwise", "a.nc"])["stepwise"].clone();
    assert_eq!((&counted["step_um"], &counted["steps"]["total"]), (&json!(0.1), &json!(10_000)));
    let fringes =
        done(dir.path(), &["run", "--stepwise=count", "a.nc", "--preset", "litho-120"])["stepwise"].clone();
    assert_eq!(fringes["step_um"], json!(0.2));
}

#[test]
fn circles_go_through_all_quadrants_in_both_senses() {
    for (word, sense) in [("G3", 1), ("G2", -1)] {
        let (told, points, times) = on_paper(&format!("G0 X3 Y2\n{word} I-1 F60\nM2\n"), 0.001);
        // The start, where the rapid leads, and the circle.
        let (circle, times) = (&points[1..], &times[1..]);
        assert_eq!((circle[0], circle[circle.len() - 1], circle.len()), ([3000, 2000], [3000, 2000], 8001));
        are_steps(circle, times, std::f64::consts::TAU / 8000.0);
        let mut quadrants = [0; 4];
        for pair in circle.windows(2) {
            let [[x, y], [to_x, to_y]] = [pair[0], pair[1]].map(|[x, y]| [x - 2000, y - 2000]);
            assert!(sense * (x * to_y - y * to_x) >= 0, "it turns back at {x} {y}");
            assert!(((to_x as f64).hypot(to_y as f64) - 1000.0).abs() < 0.7072, "{to_x} {to_y}");
            quadrants[usize::from(to_x < 0) + 2 * usize::from(to_y < 0)] += 1;
        }
        assert!(quadrants.iter().all(|&steps| (1998..=2002).contains(&steps)), "{quadrants:?}");
        let bound = told["beside"]["bound_steps"].as_f64().unwrap();
        assert!((bound - 0.5_f64.sqrt()).abs() < 1e-9 && told["beside"]["steps"].as_f64().unwrap() <= bound);
    }
}

#[test]
fn tiny_arcs_are_arcs() {
    let (told, points, _) = on_paper("G0 X1 Y1\nG2 I0.001 F6\nM2\n", 0.001);
    let expected = [[0, 0], [1, 1], [1, 2], [2, 2], [3, 2], [3, 1], [3, 0], [2, 0], [1, 0], [1, 1]];
    let expected = expected.map(|[x, y]| if (x, y) == (0, 0) { [0, 0] } else { [x + 999, y + 999] });
    assert_eq!(points, expected);
    assert_eq!(told["steps"]["total"], 8);
}

#[test]
fn a_sine_is_chords_within_their_tolerance() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), "G0 Y1\nG5.5 X4 Y1 P0.5 L2 F60\nM2\n").unwrap();
    let asked = ["run", "a.nc", "--stepwise=1", "--chord-tolerance", "5", "--trace", "a.csv"];
    let told = done(dir.path(), &asked)["stepwise"].clone();
    // n ≥ π / 2 asin √(5 / 1000) = 22.2.
    let chords = &told["motions"][0]["chords"];
    assert_eq!((&chords["per_period"], &chords["count"]), (&json!(24), &json!(48)));
    let farthest = chords["farthest_um"].as_f64().unwrap();
    assert!((farthest - 500.0 * (1.0 - (std::f64::consts::PI / 24.0).cos())).abs() < 1e-6, "{farthest} µm");
    let rows = rows(&dir.path().join("a.csv"), "t_s,x_mm,y_mm,vx,vy,ax,ay");
    for row in &rows[1..] {
        let across = |x: f64| 1.0 + 0.5 * (std::f64::consts::PI * x).sin();
        let near = (-40..=40).map(|n| row[1] + f64::from(n) * 2e-4);
        let off = near.map(|x| (x - row[1]).hypot(across(x) - row[2])).fold(f64::MAX, f64::min);
        assert!(off <= 0.005 + 2_f64.sqrt() * 1e-3 + 1e-4, "{row:?}: {off} mm");
    }
    assert_eq!(rows[rows.len() - 1][1..3], [4.0, 1.0]);
}

#[test]
fn steps_are_told_in_words_and_drawn() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), "G0 X1 Y1\nG3 I0.5 F60\nG1 X2 Y2.5\nG4 P1\nM2\n").unwrap();
    let told = abbe(dir.path(), &["run", "a.nc", "--stepwise", "--plot", "a.svg"]);
    assert_eq!(told.status, Some(0), "{told:?}");
    for part in [
        "a.nc: the program step by step, on paper, for the stage microscope-100\n",
        "  in steps of 0.1 µm\n",
        "        2 arc          20000       20000        40000",
        "        3 line         10000       15000        25000",
        "that may be; ends exact\n",
        "note: line 2: the feed of 1.000000 mm/s is more than 0.0",
        "with --twin this is an error",
    ] {
        assert!(told.stdout.contains(part), "{part}: {}", told.stdout);
    }
    let svg = fs::read_to_string(dir.path().join("a.svg")).unwrap();
    assert!(svg.contains("single steps") && svg.contains("true path") && svg.contains("<circle"));
    assert!(!svg.contains("NaN"));
}

const PM: f64 = 1e9;
/// Limits of the preset in picometres and ticks of 0.1 ms; places are rounded, and differences of them three times.
const LIMITS: [f64; 3] = [2_000_001.0, 5_002.0, 24.0];

/// The stage is asked for the points of the paper, one after the other, each axis for itself, and within its limits.
#[test]
fn a_stage_goes_the_steps_of_the_paper() {
    let program = "G0 X1 Y1\nG3 I0.1 F12\nG1 X1.2 Y1.08\nG5.5 X1.6 Y1.08 P0.06 L0.2 F15\nM2\n";
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), program).unwrap();
    let twin = ["run", "a.nc", "--stepwise=20", "--twin", "--trace", "a.csv", "--plot", "a.svg"];
    let found = done(dir.path(), &twin);
    let (told, points, times) = on_paper(program, 0.02);
    assert_eq!(found["stepwise"], told);
    assert_eq!(found["segments"], json!(points.len() - 1), "one a step, and the rapid");

    let rows = rows(&dir.path().join("a.csv"), "t_s,x_mm,y_mm,vx,vy,ax,ay,xm_mm,ym_mm");
    let asked: Vec<[i64; 2]> =
        rows.iter().map(|row| [row[1], row[2]].map(|mm| (mm * PM).round() as i64)).collect();
    let first = asked.iter().position(|place| *place == [1_000_000_000; 2]).unwrap();
    let mut visited: Vec<[i64; 2]> = Vec::new();
    for place in &asked[first..] {
        let on = place.map(|pm| pm % 20_000_000 == 0);
        assert!(on[0] || on[1], "{place:?}: both axes between points");
        if on[0] && on[1] && visited.last() != Some(&place.map(|pm| pm / 20_000_000)) {
            visited.push(place.map(|pm| pm / 20_000_000));
        }
    }
    // Between ticks it stands in a point; a tick sees it there only if it is a picometre near.
    let mut next = points[1..].iter();
    assert!(visited.iter().all(|seen| next.any(|point| point == seen)), "another way");
    assert!(visited.len() > points.len() / 2, "{} of {}", visited.len(), points.len());
    for axis in 0..2 {
        let mut values: Vec<i64> = asked.iter().map(|place| place[axis]).collect();
        for limit in LIMITS {
            values = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let most = values.iter().map(|value| value.abs()).max().unwrap() as f64;
            assert!(most <= limit, "axis {axis}: {most} of {limit}");
        }
    }
    // As long as on paper: the program begins 4 ms after it was sent.
    let on_stage = rows
        [asked.len() - 1 - asked.iter().rev().position(|place| *place != asked[asked.len() - 1]).unwrap()][0];
    let on_paper = times[times.len() - 1];
    assert!((on_stage - on_paper).abs() < 0.01, "{on_stage} s, {on_paper} s on paper");
    let arrived = [0, 1].map(|axis| found["position_mm"][axis].as_f64().unwrap());
    assert!((arrived[0] - 1.6).abs() < 0.6e-3 && (arrived[1] - 1.08).abs() < 0.6e-3, "{arrived:?}");
    assert!(found["following"]["x"]["max_um"].as_f64().unwrap() < 10.0);
}

#[test]
fn what_has_no_steps_is_refused_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), "G1 X0.5 F60\nX101\n").unwrap();
    fs::write(dir.path().join("b.nc"), "G1 X0.4 F60\n").unwrap();
    fs::write(dir.path().join("c.toml"), "").unwrap();
    let usage: [(&[&str], &[&str]); 9] = [
        (&["run", "b.nc", "--stepwise=0"], &["--stepwise", "0.001 to 1000 µm"]),
        (&["run", "b.nc", "--stepwise=-1"], &["--stepwise", "0.001 to 1000 µm"]),
        (&["run", "b.nc", "--stepwise=NaN"], &["--stepwise", "0.001 to 1000 µm"]),
        (&["run", "b.nc", "--stepwise=1e9"], &["--stepwise", "0.001 to 1000 µm"]),
        (&["run", "b.nc", "--stepwise", "--chord-tolerance", "-1"], &["--chord-tolerance"]),
        (&["run", "b.nc", "--chord-tolerance", "1"], &["--stepwise"]),
        (&["run", "b.nc", "--stepwise", "--check"], &["--stepwise", "--check"]),
        (&["run", "-", "--stepwise"], &["stdin"]),
        (&["run", "b.nc", "--stepwise", "--compensation", "c.toml"], &["--compensation", "--twin"]),
    ];
    for (arguments, names) in usage {
        refused(dir.path(), arguments, 2, names);
    }
    let before = everything_in(dir.path());
    let cases: [(&[&str], &str); 3] = [
        (
            &["run", "a.nc", "--stepwise", "--trace", "t.csv"],
            "a.nc, line 2, column 1: the line ends at x = 101 mm",
        ),
        (
            &["run", "b.nc", "--stepwise=1000", "--trace", "t.csv", "--plot", "out/p.svg"],
            "b.nc, line 1: in steps of 1000 µm: ",
        ),
        (
            &["run", "b.nc", "--stepwise", "--twin", "--trace", "t.csv"],
            "b.nc, line 1: the feed of 1.000000 mm/s is more than 0.0178",
        ),
    ];
    for (arguments, sentence) in cases {
        let ended = abbe(dir.path(), arguments);
        assert_eq!((ended.status, ended.stdout.as_str()), (Some(1), ""), "{ended:?}");
        assert!(ended.sentence().starts_with(sentence) && !ended.stderr.contains("homing"), "{ended:?}");
        assert_eq!(everything_in(dir.path()), before);
    }
}

/// The nearest point of the grid to a rapid's end may lie outside, and is told before anything moves.
#[test]
fn a_rapid_to_a_point_outside_the_travel_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), "G0 X10 Y10\nF1\nG1 X14 Y10\nG0 X100 Y50\n").unwrap();
    for twin in [&["run", "a.nc", "--stepwise=700"][..], &["run", "a.nc", "--stepwise=700", "--twin"]] {
        let told = abbe(dir.path(), twin);
        assert_eq!(told.status, Some(1), "{told:?}");
        assert!(told.sentence().contains("line 4") && told.sentence().contains("x = 100.1"), "{told:?}");
    }
}

/// What is written must not be what is read, whatever is forced.
#[test]
fn a_program_is_not_overwritten_by_its_trace() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nc"), "G1 X0.7 Y0.3 F60\n").unwrap();
    for run in [&["--twin"][..], &["--stepwise"]] {
        let arguments = [&["run", "a.nc", "--trace", "./a.nc", "--force"], run].concat();
        refused(dir.path(), &arguments, 2, &["--trace", "the program itself"]);
    }
}

/// A stage that begins beside the points would go to the first of them across.
#[test]
fn a_stage_that_begins_beside_the_points_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let preset = include_str!("../../../../presets/microscope-100.toml");
    let beside = preset.replace("travel_low_mm = 0.0 ", "travel_low_mm = 0.0005 ");
    fs::write(dir.path().join("beside.toml"), beside).unwrap();
    fs::write(dir.path().join("a.nc"), "G1 X0.7 Y0.7 F1\n").unwrap();
    let run = ["run", "a.nc", "--stepwise=0.7", "--twin", "--preset", "beside.toml"];
    refused(dir.path(), &run, 1, &["begins at x = 0.000500 mm", "--stepwise"]);
}
