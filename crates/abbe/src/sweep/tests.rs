//! Sweeps against the controller that does them.

use super::plan::Planned;
use super::turns::Turn;
use crate::cli::{Cli, Command};
use crate::preset::{self, Preset};
use abbe_core::Pos;
use abbe_core::plan::Limits;
use clap::Parser;

fn usual() -> Preset {
    preset::load(preset::USUAL).unwrap()
}

fn planned(preset: &Preset, options: &str) -> Result<Planned, String> {
    let line = format!("abbe sweep --twin {options}");
    let cli = Cli::try_parse_from(line.split(' ')).unwrap();
    let Command::Sweep(asked) = cli.command else { panic!("{cli:?}") };
    Planned::new(preset, &asked).map_err(|failure| {
        assert_eq!(failure.status(), 2);
        failure.sentence()
    })
}

#[test]
fn what_is_left_out_is_chosen() {
    let preset = usual();
    let sweep = planned(&preset, "--area 2x0.5 --lines 3 --speed 10 --every 100").unwrap();
    assert_eq!(sweep.scan.corners.map(|corner| corner.map(Pos::mm)), [[49.0, 49.75], [51.0, 50.25]]);
    assert_eq!((sweep.scan.settle, sweep.places.play, sweep.places.number), (200, 1_000_000, 21));
    assert_eq!((sweep.scan.speed, sweep.fast(), sweep.length().mm()), (1e6, 0, 2.0));
    let sweep =
        planned(&preset, "--area 2x0.5 --at 1,2 --pitch 200 --speed 10 --every 300 --along y").unwrap();
    assert_eq!((sweep.plan.lines(), sweep.places.number, sweep.place(1).mm()), (11, 2, 2.3));
}

/// The figures of ADR 16.
#[test]
fn a_turn_and_what_stopping_would_take() {
    let preset = usual();
    let turn = |more: &str| {
        let options = format!("--area 10x5 --lines 11 --speed 20 --every 100 --settle 0{more}");
        Turn::of(&planned(&preset, &options).unwrap()).unwrap()
    };
    let Turn { ticks, stop_and_go } = turn("");
    assert!((ticks - 1050.0).abs() < 2.0 && (stop_and_go - 2226.0).abs() < 10.0, "{ticks} {stop_and_go}");
    let Turn { ticks, stop_and_go } = turn(" --fly-back");
    assert!(ticks < stop_and_go && ticks > 5000.0, "{ticks} {stop_and_go}");
    let one = planned(&preset, "--area 10x5 --lines 1 --speed 20 --every 100").unwrap();
    assert_eq!(Turn::of(&one), None);
}

/// Where the acceleration is there within a tick: v/a to stop and to start, and 2 √(pitch/a) across.
#[test]
fn stopping_is_what_it_is_by_hand() {
    let mut preset = usual();
    for axis in &mut preset.controller.config.axes {
        axis.limits = Limits { jerk: 5000.0, ..axis.limits };
    }
    let options = "--area 10x5 --lines 11 --speed 20 --every 100 --settle 0";
    let found = Turn::of(&planned(&preset, options).unwrap()).unwrap().stop_and_go;
    let by_hand = 2.0 * 2e6 / 5000.0 + 2.0 * (5e8_f64 / 5000.0).sqrt();
    assert!((by_hand..by_hand + 4.0).contains(&found), "{found} {by_hand}");
}

#[test]
fn what_the_stage_cannot_do_is_told_before_it_moves() {
    let preset = usual();
    for (options, names) in [
        (
            "--area 101x1 --lines 2 --speed 10 --every 100",
            &["x = -", "travel is 0.000000 … 100.000000 mm"][..],
        ),
        // The area is within the travel, and its turns are not.
        ("--area 2x1 --at 0,0 --lines 2 --speed 10 --every 100", &["with its turns", "x = -0."]),
        ("--area 2x1 --lines 2 --speed 25 --every 100", &["--speed 25", "25 mm/s", "20 mm/s"]),
        ("--area -2x1 --lines 2 --speed 10 --every 100", &["--area -2x1"]),
        ("--area 0x1 --lines 2 --speed 10 --every 100", &["lines of the scan have no length"]),
        ("--area 2x0 --lines 2 --speed 10 --every 100", &["two in one place"]),
        ("--area 2x1 --lines 2 --speed 10 --every 0.0000001", &["pitch of position compare is 0"]),
        ("--area 2x1 --lines 2 --speed 10 --every 0.1", &["--every 0.1", "10.0 events in a tick", "8 fit"]),
        ("--area 50x1 --lines 2 --speed 10 --every 0.000001", &["50000000000 places"]),
        ("--area 2x1 --lines 2 --speed 0.05 --every 1", &["--settle", "play of 1.000000 µm"]),
        ("--area 50x1 --lines 1 --speed 0.001 --every 1", &["134217728 ticks"]),
    ] {
        let told = planned(&preset, options).unwrap_err();
        assert!(names.iter().all(|name| told.contains(name)), "{options}: {told}");
    }
    // One line turns nowhere.
    planned(&preset, "--area 0.1x0 --lines 1 --speed 0.01 --every 1").unwrap();
    planned(&preset, "--area 2x1 --lines 2 --speed 0.05 --every 1 --settle 40").unwrap();
}
