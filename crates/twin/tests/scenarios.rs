//! Runs every folder of `tests/scenarios`: one behaviour each, named after its danger.
//!
//! A folder holds `README.md` (what may go wrong), `script.txt` (what is done and what must be seen, line by line)
//! and, where the usual stage will not do, `stage.toml` (what differs from `presets/microscope-100.toml`).

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use abbe_core::background;
use abbe_core::design::StageSettings;
use abbe_core::edge::{Actuation, StepRate};
use abbe_core::publish::{End, Fault, HomingFailure};
use abbe_core::{Command, Controller, Inputs, Outputs, Pos};
use abbe_twin::{Event, Plant, Twin};
use std::fs;
use std::path::{Path, PathBuf};

const PRESET: &str = include_str!("../../../presets/microscope-100.toml");
/// No scenario waits longer, s of the stage's time.
const LONGEST_S: f64 = 60.0;

struct Scenario {
    controller: Controller<2>,
    twin: Twin,
    outputs: Outputs<2>,
    inputs: Inputs<2>,
    tick_hz: f64,
    refused: Option<String>,
    /// Slides when the last event happened, µm.
    at_event: [f64; 2],
    worst_following_um: f64,
    /// Farthest from the straight line between the last two targets, µm.
    worst_off_line_um: f64,
    line: [[f64; 2]; 2],
}

impl Scenario {
    fn load(folder: &Path) -> Self {
        let stage = fs::read_to_string(folder.join("stage.toml")).unwrap_or_default();
        let stage: toml::Table = toml::from_str(&stage).expect("stage.toml is TOML");
        let mut preset: toml::Table = toml::from_str(PRESET).unwrap();
        if let Some(plant) = stage.get("plant") {
            merge(preset.get_mut("plant").unwrap(), plant);
        }
        let plant = Plant::read("scenario", &toml::to_string(&preset).unwrap()).unwrap();
        let number = |key: &str, default: f64| stage.get(key).map_or(default, |v| v.as_float().expect(key));
        let settings =
            StageSettings { host_timeout_ms: number("host_timeout_ms", 0.0), ..StageSettings::default() };
        let at = [number("x_mm", 40.0), number("y_mm", 60.0)];
        let mut scenario = Self {
            controller: Controller::new(settings.build().unwrap()),
            twin: Twin::standing_at(&plant, settings.tick_hz, number("seed", 1.0) as u64, at),
            outputs: Outputs::OFF,
            inputs: Inputs::at_rest(0),
            tick_hz: settings.tick_hz,
            refused: None,
            at_event: [0.0; 2],
            worst_following_um: 0.0,
            worst_off_line_um: 0.0,
            line: [[0.0; 2]; 2],
        };
        scenario.tick();
        scenario
    }

    fn tick(&mut self) {
        self.inputs = self.twin.step(&self.outputs);
        self.outputs = self.controller.tick(&self.inputs);
        background::advance(&mut self.controller);
        self.check_invariants();
        let axes = self.controller.status().axes;
        for axis in &axes {
            self.worst_following_um = self.worst_following_um.max(axis.following_error.um().abs());
        }
        self.worst_off_line_um = self.worst_off_line_um.max(self.off_line(axes.map(|a| a.set_point.um())));
    }

    /// What holds in every tick of every scenario.
    fn check_invariants(&self) {
        let state = self.controller.status().state;
        for output in &self.outputs.axes {
            assert_eq!(output.enable, state.is_on(), "torque in state {state}");
            if !output.enable {
                assert_eq!(output.actuation, Actuation::Steps(StepRate(0)), "pulses in state {state}");
            }
        }
    }

    fn off_line(&self, point: [f64; 2]) -> f64 {
        let [from, to] = self.line;
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy);
        if length == 0.0 {
            0.0
        } else {
            ((point[0] - from[0]) * dy - (point[1] - from[1]) * dx).abs() / length
        }
    }

    fn run(&mut self, seconds: f64, mut until: impl FnMut(&Self) -> bool) {
        for _ in 0..(seconds * self.tick_hz) as u64 {
            self.tick();
            if until(self) {
                return;
            }
        }
    }

    fn settle(&mut self) {
        self.run(LONGEST_S, |s| !s.controller.status().state.is_busy());
        assert!(!self.controller.status().state.is_busy(), "still {}", self.controller.status().state);
    }

    fn command(&mut self, command: Command<2>) {
        self.line[0] = self.controller.status().axes.map(|axis| axis.set_point.um());
        self.refused = self.controller.command(command).err().map(|refusal| refusal.to_string());
        self.line[1] = match command {
            Command::MoveTo(to) if self.refused.is_none() => to.map(Pos::um),
            _ => self.line[0],
        };
        self.worst_off_line_um = 0.0;
    }

    fn event(&mut self, event: Event) {
        self.at_event = self.twin.truth().slides_um;
        self.twin.happen(event);
    }

    /// One line of a script.
    fn line(&mut self, line: &str) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["home"] => self.then_settle(Command::Home),
            ["start", "home"] => self.command(Command::Home),
            ["enable"] => self.then_settle(Command::Enable),
            ["disable"] => self.command(Command::Disable),
            ["reset"] => self.command(Command::Reset),
            ["stop"] => self.command(Command::Stop),
            ["move", x, y] => self.then_settle(Command::MoveTo([mm(x), mm(y)])),
            ["start", "move", x, y] => self.command(Command::MoveTo([mm(x), mm(y)])),
            ["move", "by", x, y] => self.then_settle(Command::MoveBy([mm(x), mm(y)])),
            ["repeat", times, rest @ ..] => {
                for _ in 0..times.parse::<u32>().unwrap() {
                    self.line(&rest.join(" "));
                }
            }
            ["wait", seconds] => self.run(number(seconds), |_| false),
            ["settle"] => self.settle(),
            ["wait", "until", "fault"] => self.run(LONGEST_S, |s| s.controller.status().fault.is_some()),
            ["wait", "until", "rest"] => self.wait_until_rest(),
            ["expect", rest @ ..] => self.expect(rest),
            _ => self.event(event(&words)),
        }
        self.tick();
    }

    fn then_settle(&mut self, command: Command<2>) {
        self.command(command);
        self.tick();
        self.settle();
    }

    fn wait_until_rest(&mut self) {
        let mut quiet = 0;
        self.run(LONGEST_S, |s| {
            let moving = s.twin.truth().speed_mm_s.iter().any(|v| v.abs() > 0.01);
            quiet = if moving { 0 } else { quiet + 1 };
            quiet > 500
        });
    }

    fn expect(&self, words: &[&str]) {
        let status = self.controller.status();
        match words {
            ["state", state] => assert_eq!(status.state.to_string(), *state, "{:?}", status.fault),
            ["fault", fault @ ..] => {
                assert_eq!(status.fault.map(|f| fault_name(&f)), Some(fault.join(" ")));
            }
            ["no", "fault"] => assert_eq!(status.fault, None),
            ["refused", text @ ..] => {
                let refused = self.refused.as_deref().expect("nothing was refused");
                assert!(refused.contains(&text.join(" ")), "{refused}");
            }
            ["accepted"] => assert_eq!(self.refused, None),
            ["at", x, y, "within", um, "um"] => {
                for (axis, asked) in status.axes.iter().zip([mm(x), mm(y)]) {
                    let off = (axis.position - asked).um().abs();
                    assert!(off <= number(um), "{off} µm off, {:?}, {:?}", status.fault, status.last_move);
                }
            }
            ["slides", "stopped", "within", limit, "mm"] => {
                for (now, then) in self.twin.truth().slides_um.iter().zip(self.at_event) {
                    assert!((now - then).abs() <= number(limit) * 1e3, "{} µm", (now - then).abs());
                }
            }
            ["following", "error", "below", um, "um"] => {
                assert!(self.worst_following_um < number(um), "{} µm", self.worst_following_um);
            }
            ["path", "within", um, "um"] => {
                assert!(self.worst_off_line_um <= number(um), "{} µm", self.worst_off_line_um);
            }
            ["targets", x, y] => {
                for (axis, asked) in status.axes.iter().zip([mm(x), mm(y)]) {
                    assert_eq!(axis.target, asked);
                }
            }
            ["zero", "shift", axis, "within", um, "um"] => {
                let shift = status.axes[axis_number(axis)].home.zero_shift.expect("homed twice").um();
                assert!(shift.abs() <= number(um), "zero moved {shift} µm");
            }
            ["switch", "shift", axis, expected, "within", um, "um"] => {
                let shift = status.axes[axis_number(axis)].home.switch_shift.expect("homed twice").um();
                assert!((shift - number(expected)).abs() <= number(um), "switch moved {shift} µm");
            }
            ["position", "positive"] => {
                assert!(status.axes.iter().all(|axis| axis.position >= Pos::from_um(-1.0)));
            }
            _ => panic!("no such expectation: {words:?}"),
        }
    }
}

fn event(words: &[&str]) -> Event {
    match words {
        ["pull", "encoder", axis] => Event::Encoder { axis: axis_number(axis), connected: false },
        ["plug", "encoder", axis] => Event::Encoder { axis: axis_number(axis), connected: true },
        ["jam", axis] => Event::Jam { axis: axis_number(axis), jammed: true },
        ["free", axis] => Event::Jam { axis: axis_number(axis), jammed: false },
        ["push", axis, newton] => Event::Push { axis: axis_number(axis), newton: number(newton) },
        ["shift", "switch", axis, um] => Event::MoveSwitch { axis: axis_number(axis), um: number(um) },
        ["break", "switch", axis] => Event::LoseSwitch { axis: axis_number(axis) },
        ["press", "emergency", "stop"] => Event::EmergencyStop { pressed: true },
        ["release", "emergency", "stop"] => Event::EmergencyStop { pressed: false },
        ["drive", "fault", axis] => Event::DriveFault { axis: axis_number(axis), faulty: true },
        ["drive", "repaired", axis] => Event::DriveFault { axis: axis_number(axis), faulty: false },
        ["skip", ticks, "ticks"] => Event::SkipTicks { ticks: ticks.parse().unwrap() },
        ["host", "falls", "silent"] => Event::HostSilent { silent: true },
        ["host", "speaks"] => Event::HostSilent { silent: false },
        _ => panic!("no such line: {words:?}"),
    }
}

fn fault_name(fault: &Fault) -> String {
    let axis_name = |axis: &usize| ["x", "y"][*axis];
    match fault {
        Fault::EmergencyStop => "emergency stop".into(),
        Fault::TickOverrun { missed } => format!("tick overrun {missed}"),
        Fault::HostGone => "host gone".into(),
        Fault::PlanMissing => "plan missing".into(),
        Fault::DriveFault { axis } => format!("drive {}", axis_name(axis)),
        Fault::LimitSwitch { axis, end: End::Low } => format!("limit low {}", axis_name(axis)),
        Fault::LimitSwitch { axis, end: End::High } => format!("limit high {}", axis_name(axis)),
        Fault::SoftLimit { axis, .. } => format!("soft limit {}", axis_name(axis)),
        Fault::FollowingError { axis, .. } => format!("following error {}", axis_name(axis)),
        Fault::EncoderLost { axis } => format!("encoder lost {}", axis_name(axis)),
        Fault::EncoderIllegal { axis, .. } => format!("encoder illegal {}", axis_name(axis)),
        Fault::Stall { axis } => format!("stall {}", axis_name(axis)),
        Fault::Homing { axis, failure } => {
            let what = match failure {
                HomingFailure::SwitchNotFound => "switch not found",
                HomingFailure::SwitchStuck => "switch stuck",
                HomingFailure::IndexNotFound => "index not found",
            };
            format!("homing {} {what}", axis_name(axis))
        }
    }
}

fn axis_number(name: &str) -> usize {
    ["x", "y"].iter().position(|known| *known == name).unwrap_or_else(|| panic!("no axis {name}"))
}

fn number(word: &str) -> f64 {
    word.parse().unwrap_or_else(|_| panic!("{word} is not a number"))
}

fn mm(word: &str) -> Pos {
    Pos::from_mm(number(word))
}

fn merge(into: &mut toml::Value, from: &toml::Value) {
    match (into, from) {
        (toml::Value::Table(into), toml::Value::Table(from)) => {
            for (key, value) in from {
                merge(into.get_mut(key).unwrap_or_else(|| panic!("unknown key {key}")), value);
            }
        }
        (into, from) => *into = from.clone(),
    }
}

fn folders() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenarios");
    let mut folders: Vec<PathBuf> = fs::read_dir(root)
        .expect("tests/scenarios exists")
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir())
        .collect();
    folders.sort();
    folders
}

#[test]
fn every_scenario_goes_as_its_script_says() {
    let folders = folders();
    assert!(folders.len() >= 15, "{} scenarios", folders.len());
    let mut failed = Vec::new();
    for folder in &folders {
        assert!(folder.join("README.md").exists(), "{} has no README", folder.display());
        let script = fs::read_to_string(folder.join("script.txt")).expect("script.txt");
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        let mut now = 0;
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let mut scenario = Scenario::load(folder);
            for (number, line) in script.lines().enumerate() {
                now = number + 1;
                let line = line.split('#').next().unwrap_or_default().trim();
                if !line.is_empty() {
                    scenario.line(line);
                }
            }
        }));
        if outcome.is_err() {
            failed.push(format!("{name}/script.txt:{now}"));
        }
    }
    assert!(failed.is_empty(), "failed: {failed:#?}");
}
