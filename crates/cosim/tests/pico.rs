//! The Pico's image in an emulator, wired pin by pin to the twin, commanded over its serial line.
//!
//! `cargo xtask firmware` builds the image; `cargo test --release -p abbe-cosim --features images` runs these.
#![cfg(feature = "images")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use abbe_core::background::PLANNING_TICKS;
use abbe_core::edge::{Actuation, StepRate};
use abbe_core::machine::{STATES, State};
use abbe_core::{Command, Outputs, Pos, Status};
use abbe_cosim::alone::Alone;
use abbe_cosim::board::Telemetry;
use abbe_cosim::board::design::{NOT_ENABLE, STAGE};
use abbe_cosim::image::Image;
use abbe_cosim::wired::{Pulses, Wired};
use abbe_twin::{Event, Plant, Twin};
use std::path::PathBuf;

const PRESET: &str = include_str!("../../../presets/microscope-100.toml");
/// Cycles that an interrupt of core 1 may take: four fifths of a tick. docs/adr/0011-cycle-budget.md.
const INTERRUPT_CYCLES: u32 = 10_000;
/// No wait takes more ticks.
const LONGEST: u32 = 90_000;

fn image() -> Image {
    let built = || {
        PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("../../firmware/pico/target/thumbv6m-none-eabi/release/abbe-pico")
    };
    let file = std::env::var_os("ABBE_PICO_IMAGE").map_or_else(built, PathBuf::from);
    Image::read(&file).expect("the image is built by `cargo xtask firmware`")
}

/// The preset's stage, but for the way from the switches to the reference marks: 0.3 mm instead of 2, because homing goes
/// it at 0.5 mm/s and the emulator takes ten times as long. With `ABBE_COSIM=long` it is the preset's.
fn plant() -> Plant {
    let mut plant = Plant::read("microscope-100", PRESET).unwrap();
    if std::env::var_os("ABBE_COSIM").is_none_or(|length| length != "long") {
        for axis in [&mut plant.x, &mut plant.y] {
            axis.switches.low_mm = -0.3;
        }
    }
    plant
}

/// A little above the reference marks.
fn near_the_marks(plant: &Plant, seed: u64) -> Twin {
    Twin::standing_at(plant, &STAGE.build().unwrap(), seed, [0.05, 0.08])
}

/// Where the pins leave it open, the later of both.
fn latest(seen: &Pulses) -> [[i32; 2]; 2] {
    seen.map(|halves| halves.map(|between| between[1]))
}

fn state(telemetry: &Telemetry) -> State {
    STATES[telemetry.state]
}

/// A board and a stage that were powered on.
fn wired(seed: u64) -> Wired {
    Wired::power_on(&image(), near_the_marks(&plant(), seed)).unwrap()
}

/// Ticks until this holds.
fn until(wired: &mut Wired, what: &str, mut holds: impl FnMut(&Telemetry) -> bool) {
    for _ in 0..LONGEST {
        if holds(&wired.tick(latest).unwrap()) {
            return;
        }
    }
    panic!("never {what}: {:?}, {:?}", wired.last(), wired.board.hear());
}

/// Says a line and waits for the answer to it.
fn ask(wired: &mut Wired, line: &str) -> String {
    wired.board.hear();
    wired.board.say(format!("{line}\n").as_bytes());
    for _ in 0..1000 {
        wired.tick(latest).unwrap();
        if let Some(answer) = wired.board.hear().into_iter().next() {
            return answer;
        }
    }
    panic!("no answer to {line}");
}

fn home(wired: &mut Wired) {
    assert_eq!(ask(wired, "home"), "ok");
    until(wired, "ready", |now| state(now) == State::Ready);
}

/// What board and twin alone must have in common in a tick.
fn in_common(status: &Status<2>, outputs: &Outputs<2>) -> ([i64; 2], [i64; 2], [i32; 2], State, bool) {
    let rate = |axis: usize| match outputs.axes[axis].actuation {
        Actuation::Steps(StepRate(rate)) => rate,
        Actuation::Pwm(_) => unreachable!(),
    };
    let axes = status.axes;
    (
        axes.map(|axis| axis.set_point.pm()),
        axes.map(|axis| axis.reading.pm()),
        [rate(0), rate(1)],
        status.state,
        outputs.axes[0].enable,
    )
}

/// Disturbed and missed samples are drawn at the twin's own sampling instants, which a board does not share: both are
/// off here, and on in the other tests.
#[test]
fn homing_and_a_move_are_those_of_the_twin_alone_tick_by_tick() {
    let mut plant = plant();
    for axis in [&mut plant.x, &mut plant.y] {
        axis.scale.glitch_probability = 0.0;
    }
    plant.timing.missed_sample_probability = 0.0;
    let twin = near_the_marks(&plant, 1);
    let mut alone = Alone::power_on(twin.clone()).unwrap();
    let mut wired = Wired::power_on(&image(), twin).unwrap();
    alone.tick(wired.last().tick);
    let script = [
        ("home", Command::Home),
        ("move 0.6 -0", Command::MoveTo([Pos::from_mm(0.6), Pos::ZERO])),
        ("by -0.25 0.125", Command::MoveBy([Pos::from_mm(-0.25), Pos::from_mm(0.125)])),
    ];
    let (mut compared, mut open) = (0, 0);
    for (line, command) in script {
        wired.board.say(format!("{line}\n").as_bytes());
        let mut asked = false;
        for tick in 0.. {
            assert!(tick < LONGEST, "{line}: {:?}", wired.last());
            let before = wired.last().commands;
            let expected = alone.pulses();
            let now = wired
                .tick(|seen| {
                    for (seen, expected) in seen.iter().flatten().zip(expected.iter().flatten()) {
                        assert!(
                            (seen[0].min(seen[1])..=seen[0].max(seen[1])).contains(expected),
                            "{seen:?} {expected}"
                        );
                        open += u32::from(seen[0] != seen[1]);
                    }
                    expected
                })
                .unwrap();
            if now.commands != before {
                alone.command(command);
                asked = true;
            }
            let (status, outputs) = alone.tick(now.tick);
            let board = (now.set_points_pm, now.readings_pm, now.rates, state(&now), now.on);
            if tick > 3 || compared > 0 {
                assert_eq!(board, in_common(&status, &outputs), "tick {} of {line}", now.tick);
                compared += 1;
            }
            if asked && !status.state.is_busy() {
                assert_eq!((status.state, status.fault), (State::Ready, None), "{line}");
                break;
            }
        }
    }
    let answers = wired.board.hear();
    assert_eq!(answers, ["ok", "ok move 1", "ok move 2"]);
    println!(
        "{compared} ticks compared; {open} times a pulse rose in the instruction that ended a half tick"
    );
    // The twin alone is a step ahead.
    let expected = alone.pulses();
    wired.tick(|_| expected).unwrap();
    // The judge: both stages stand at the same place, and the slides where they were asked to be but for their scales' errors.
    assert_eq!(wired.twin.truth(), alone.twin.truth());
    for (slide, asked) in wired.twin.truth().slides_um.iter().zip([350.0, 125.0]) {
        assert!((slide - asked).abs() < 5.0, "{slide} µm");
    }
    println!("longest tick {} µs of 100, from when it was due to its end", wired.last().longest_us);
    assert!(wired.last().longest_us < 100 && wired.last().missed == 0, "{:?}", wired.last());
    interrupts_are_within_their_budget(wired.board.interrupts());
    println!("slowest plan after {} of {PLANNING_TICKS} ticks", wired.last().planning);
    assert!((1..PLANNING_TICKS).contains(&wired.last().planning), "{:?}", wired.last());
}

/// The tick with all around it: sensors, pulses, status and telemetry.
fn interrupts_are_within_their_budget(interrupts: &[u32]) {
    let mut sorted = interrupts.to_vec();
    sorted.sort_unstable();
    let [median, worst] = [sorted.len() / 2, sorted.len() - 1].map(|place| sorted[place]);
    println!("interrupt of core 1: median {median}, worst {worst} of {INTERRUPT_CYCLES} cycles");
    assert!(worst <= INTERRUPT_CYCLES, "{worst} cycles");
}

#[test]
fn a_limit_an_encoder_lost_a_stalled_tick_and_garbage_are_met_safely() {
    let mut wired = wired(2);
    let status = ask(&mut wired, "status");
    assert!(status.starts_with("off ") && status.contains("homed -"), "{status}");
    assert_eq!(ask(&mut wired, "move 1 1"), "error: the drives are off; home or enable first");
    home(&mut wired);

    // Garbage is answered and changes nothing; what comes after it is understood.
    let garbage: Vec<u8> = (0..=255).filter(|byte| ![b'\r', b'\n'].contains(byte)).collect();
    wired.board.say(&garbage);
    assert!(ask(&mut wired, "").starts_with("error: the line is longer"));
    assert!(ask(&mut wired, "\u{7}move 1 1").starts_with("error: the line holds something that is no text"));
    assert_eq!(state(&wired.last()), State::Ready);
    assert_eq!(ask(&mut wired, "move 0.3 0.2"), "ok move 1");
    until(&mut wired, "there", |now| state(now) == State::Ready);
    let status = ask(&mut wired, "status");
    assert!(status.contains("homed xy") && status.contains("move 1 arrived"), "{status}");

    // The switch closes on the way down: off in the same tick, and the slide stands soon.
    let to_the_stage = 150.0 - plant().x.switches.low_mm * 1e3;
    wired.twin.happen(Event::MoveSwitch { axis: 0, um: to_the_stage }).unwrap();
    assert_eq!(ask(&mut wired, "move 0 0.2"), "ok move 2");
    until(&mut wired, "a fault", |now| now.fault);
    let at = wired.twin.truth().slides_um[0];
    for _ in 0..500 {
        let now = wired.tick(latest).unwrap();
        assert!(!now.on && state(&now) == State::Fault && now.rates == [0, 0]);
    }
    assert!((wired.twin.truth().slides_um[0] - at).abs() < 300.0);
    assert!(ask(&mut wired, "status").contains("fault x: low limit switch"));
    wired.twin.happen(Event::MoveSwitch { axis: 0, um: -to_the_stage }).unwrap();
    // Free switches are believed late.
    for _ in 0..100 {
        wired.tick(latest).unwrap();
    }
    assert_eq!(ask(&mut wired, "reset"), "ok");
    assert_eq!(ask(&mut wired, "on"), "ok");

    // The plug of an encoder is pulled in motion.
    assert_eq!(ask(&mut wired, "move 1.5 0.2"), "ok move 3");
    until(&mut wired, "in motion", |now| now.rates[0] > 20_000);
    wired.twin.happen(Event::Encoder { axis: 0, connected: false }).unwrap();
    until(&mut wired, "a fault", |now| now.fault);
    assert!(!wired.last().on);
    let status = ask(&mut wired, "status");
    assert!(
        status.contains("fault x: ") && status.contains("encoder") && status.contains("homed y "),
        "{status}"
    );
    wired.twin.happen(Event::Encoder { axis: 0, connected: true }).unwrap();
    assert_eq!(ask(&mut wired, "reset"), "ok");
    assert_eq!(ask(&mut wired, "move 1 0.2"), "error: the drives are off; home or enable first");
    assert_eq!(ask(&mut wired, "on"), "ok");
    assert_eq!(ask(&mut wired, "move 1 0.2"), "error: the zero is not known; home first");

    // Core 1 hangs in a tick with the drives on: core 0 switches them off within its three milliseconds.
    assert!(wired.last().on && !wired.board.is_high(NOT_ENABLE));
    wired.board.run_without_core_1(600_000);
    assert!(wired.board.is_high(NOT_ENABLE), "4.8 ms without a tick and the drives are on");
    assert!(wired.board.emitters_since().is_none());
    wired.board.run_to_next_tick(20).unwrap();
    wired.board.run_to_next_tick(20).unwrap();
    let now = wired.board.telemetry();
    assert!(now.fault && !now.on && now.missed > 40, "{now:?}");
}

#[test]
fn every_way_to_switch_off_reaches_the_pin() {
    let mut wired = wired(4);
    let is_off = |wired: &Wired| wired.board.is_high(NOT_ENABLE) && wired.board.emitters_since().is_none();
    assert!(is_off(&wired), "the drives are on at power-on");
    for (happens, is_over, words) in [
        (
            Event::EmergencyStop { pressed: true },
            Event::EmergencyStop { pressed: false },
            "fault emergency stop",
        ),
        (
            Event::DriveFault { axis: 1, faulty: true },
            Event::DriveFault { axis: 1, faulty: false },
            "the power stage reports a fault",
        ),
        (
            Event::MoveSwitch { axis: 1, um: 1000.0 },
            Event::MoveSwitch { axis: 1, um: -1000.0 },
            "y: low limit switch",
        ),
    ] {
        assert_eq!(ask(&mut wired, "on"), "ok");
        until(&mut wired, "on", |now| now.on);
        wired.tick(latest).unwrap();
        assert!(!wired.board.is_high(NOT_ENABLE));
        wired.twin.happen(happens).unwrap();
        until(&mut wired, "off", |now| now.fault && !now.on);
        assert!(is_off(&wired), "{words}");
        let status = ask(&mut wired, "status");
        assert!(status.starts_with("fault ") && status.contains(words), "{status}");
        wired.twin.happen(is_over).unwrap();
        for _ in 0..100 {
            wired.tick(latest).unwrap();
        }
        assert_eq!(ask(&mut wired, "reset"), "ok");
        assert!(ask(&mut wired, "status").starts_with("off "));
    }
    assert_eq!(ask(&mut wired, "on"), "ok");
    until(&mut wired, "on", |now| now.on);
    assert_eq!(ask(&mut wired, "off"), "ok");
    assert!(is_off(&wired));
}

#[test]
fn a_tick_that_overruns_switches_off_and_says_so() {
    let mut wired = wired(3);
    assert_eq!(ask(&mut wired, "on"), "ok");
    until(&mut wired, "on", |now| now.on);
    for _ in 0..10 {
        wired.tick(latest).unwrap();
    }
    // Two ticks late: shorter than the watch on core 0 would notice.
    wired.board.run_without_core_1(25_000);
    wired.board.run_to_next_tick(20).unwrap();
    wired.board.run_to_next_tick(20).unwrap();
    let now = wired.board.telemetry();
    assert!(now.fault && !now.on && now.missed >= 1, "{now:?}");
    assert!(wired.board.is_high(NOT_ENABLE));
    wired.board.say(b"status\n");
    let mut lines = Vec::new();
    for _ in 0..600 {
        wired.board.run_to_next_tick(20).unwrap();
        lines.extend(wired.board.hear());
    }
    assert!(
        lines.iter().any(|line| line.starts_with("fault ") && line.contains("fault tick overrun")),
        "{lines:?}"
    );
}
