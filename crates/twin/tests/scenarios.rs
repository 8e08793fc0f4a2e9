//! Runs every folder of `tests/scenarios`: one behaviour each, named after its danger.
//!
//! A folder holds `README.md` (what may go wrong), `script.txt` (what is done and what must be seen, line by line)
//! and, where the usual stage will not do, `stage.toml` (which preset, and what differs from it).

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod preset;

use abbe_core::background::Planner;
use abbe_core::edge::{Actuation, StepRate};
use abbe_core::{Accepted, Command, Controller, Outputs, Refusal, Status};
use abbe_twin::script::{self, Player, Stage};
use abbe_twin::{Plant, Twin};
use std::fs;
use std::path::{Path, PathBuf};

struct Scenario {
    planner: Planner,
    controller: Controller<2>,
    twin: Twin,
    outputs: Outputs<2>,
    tick_hz: f64,
}

impl Scenario {
    fn load(folder: &Path) -> Self {
        let stage = fs::read_to_string(folder.join("stage.toml")).unwrap_or_default();
        let stage: toml::Table = toml::from_str(&stage).expect("stage.toml is TOML");
        let own = stage.get("plant").and_then(toml::Value::as_table).cloned().unwrap_or_default();
        let preset = match stage.get("preset").map(|name| name.as_str().unwrap()) {
            None => preset::MICROSCOPE_100,
            Some("litho-120") => preset::LITHO_120,
            Some(name) => panic!("no preset {name}"),
        };
        let plant = Plant::read_with("scenario", preset, &own).unwrap();
        let number = |key: &str, default: f64| stage.get(key).map_or(default, |v| v.as_float().expect(key));
        let mut settings = preset::settings(preset).unwrap();
        settings.host_timeout_ms = number("host_timeout_ms", settings.host_timeout_ms);
        let at = [number("x_mm", 40.0), number("y_mm", 60.0)];
        let config = settings.build().unwrap();
        Self {
            controller: Controller::with_planner(config),
            planner: Planner::default(),
            twin: Twin::standing_at(&plant, &config, number("seed", 1.0) as u64, at),
            outputs: Outputs::OFF,
            tick_hz: settings.tick_hz,
        }
    }

    /// What holds in every tick of every scenario.
    fn check_invariants(&self) -> Result<(), String> {
        let state = self.controller.status().state;
        for output in &self.outputs.axes {
            if output.enable != state.is_on() {
                return Err(format!("torque is {} in state {state}", output.enable));
            }
            if !output.enable && output.actuation != Actuation::Steps(StepRate(0)) {
                return Err(format!("pulses in state {state}"));
            }
        }
        Ok(())
    }
}

impl Stage for Scenario {
    type Error = String;

    fn tick(&mut self) -> Result<(), String> {
        let inputs = self.twin.step(&self.outputs);
        self.outputs = self.controller.tick(&inputs);
        self.planner.advance(&mut self.controller);
        self.check_invariants()
    }

    fn command(&mut self, command: Command<2>) -> Result<Accepted, Refusal> {
        self.controller.command(command)
    }

    fn status(&self) -> Status<2> {
        self.controller.status()
    }

    fn tick_hz(&self) -> f64 {
        self.tick_hz
    }

    fn twin(&self) -> &Twin {
        &self.twin
    }

    fn twin_mut(&mut self) -> &mut Twin {
        &mut self.twin
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

/// Plays the script of a folder; what went wrong, with its line.
fn play(folder: &Path) -> Result<(), String> {
    let text = fs::read_to_string(folder.join("script.txt")).expect("script.txt");
    let lines = script::parse(&text).map_err(|error| error.to_string())?;
    assert!(!lines.is_empty(), "{} says nothing", folder.display());
    let mut scenario = Scenario::load(folder);
    scenario.tick()?;
    let mut player = Player::new(scenario);
    for line in &lines {
        player.step(&line.step).map_err(|error| format!("line {}: {error}", line.number))?;
    }
    Ok(())
}

#[test]
fn every_scenario_goes_as_its_script_says() {
    let folders = folders();
    assert!(folders.len() >= 15, "{} scenarios", folders.len());
    let mut failed = Vec::new();
    for folder in &folders {
        assert!(folder.join("README.md").exists(), "{} has no README", folder.display());
        if let Err(error) = play(folder) {
            failed.push(format!("{}/script.txt, {error}", folder.file_name().unwrap().display()));
        }
    }
    assert!(failed.is_empty(), "failed: {failed:#?}");
}

#[test]
fn an_expectation_that_is_not_met_ends_the_script_in_its_words() {
    let folder = folders().remove(0);
    let mut player = Player::new(Scenario::load(&folder));
    for (line, words) in [
        ("expect state ready", "the state is off, not ready"),
        ("expect fault emergency stop", "the fault is `none`, not `emergency stop`"),
        ("expect refused home first", "nothing was refused"),
        ("expect zero shift x within 1 um", "the axis has not homed twice"),
        ("expect at 0 50 within 1 um", "the table is off its place by 50000.000 µm, more than 1 µm"),
        ("expect targets 1 0", "the targets are"),
        ("expect signals y good", "no sine and cosine to be graded"),
        ("light x 0.5", "the head of axis x is digital"),
    ] {
        let step = &script::parse(line).unwrap()[0].step;
        let unmet = player.step(step).unwrap_err().to_string();
        assert!(unmet.contains(words), "{unmet}");
    }
    for line in ["expect state off", "expect no fault", "expect accepted", "expect position positive"] {
        player.step(&script::parse(line).unwrap()[0].step).unwrap();
    }
}
