//! Writes a golden trace: a script played on the twin, with everything unkind in it left on.

use std::fs;
use std::path::Path;

use abbe_core::background::Planner;
use abbe_core::compensate::ErrorMap;
use abbe_core::design::StageSettings;
use abbe_core::{Accepted, Command, Controller, Outputs, Pos, Refusal, Status};
use abbe_proto::record::{Encoder, Event, LONGEST_BLOCK, Sink, stage};
use abbe_twin::script::{self, Player, Stage};
use abbe_twin::{Plant, Twin, preset};
use anyhow::{Context, Result, anyhow};

use super::{Expected, Scenario, StageFile, text_of};

/// Reading of a map's first node: before the lowest place an axis can be.
const MAP_FROM_MM: f64 = -5.0;

/// Plays the script of a scenario and writes its trace and what it must end in.
///
/// # Errors
/// The script or the stage is wrong, an expectation of the script is not met, or a file cannot be written.
pub fn record(root: &Path, scenario: &Scenario) -> Result<Expected> {
    let (trace, expected) = play(root, scenario).with_context(|| format!("scenario {}", scenario.name))?;
    fs::write(scenario.folder.join("trace.rec"), trace)?;
    fs::write(scenario.folder.join("expected.toml"), expected.to_string())?;
    Ok(expected)
}

fn play(root: &Path, scenario: &Scenario) -> Result<(Vec<u8>, Expected)> {
    let lines = script::parse(&scenario.script()?).map_err(|error| anyhow!("script.txt, {error}"))?;
    let mut stage = Recorded::new(root, &scenario.stage)?;
    let mut player = Player::new(&mut stage);
    for line in &lines {
        player.step(&line.step).map_err(|error| anyhow!("script.txt, line {}: {error}", line.number))?;
    }
    let Recorded { encoder, ticks, .. } = stage;
    let expected = Expected { ticks, hash: encoder.hash().value() };
    let Ok(blocks) = encoder.finish();
    Ok((blocks.0, expected))
}

/// The blocks of a recording.
#[derive(Debug, Default)]
struct Blocks(Vec<u8>);

impl Blocks {
    /// Of this stage; the default one needs no block of its own.
    fn of(settings: &StageSettings<2>) -> Result<Self> {
        if *settings == StageSettings::default() {
            return Ok(Self::default());
        }
        Ok(Self(stage::block(settings, &mut [0; LONGEST_BLOCK])?.to_vec()))
    }
}

impl Sink for Blocks {
    type Error = std::convert::Infallible;

    fn block(&mut self, block: &[u8]) -> Result<(), Self::Error> {
        self.0.extend_from_slice(block);
        Ok(())
    }
}

/// A controller and a twin, and everything that happens to the controller written down.
struct Recorded {
    controller: Controller<2>,
    planner: Planner,
    twin: Twin,
    outputs: Outputs<2>,
    tick_hz: f64,
    encoder: Encoder<2, Blocks>,
    ticks: u32,
}

impl Recorded {
    fn new(root: &Path, stage: &StageFile) -> Result<Self> {
        let text = preset_text(root, &stage.preset)?;
        let settings = preset::settings(&text).with_context(|| format!("preset {}", stage.preset))?;
        let plant = Plant::read_with(&stage.preset, &text, &stage.plant).context("stage.toml")?;
        let config = settings.build().map_err(|error| anyhow!("{error}"))?;
        let mut recorded = Self {
            controller: Controller::with_planner(config),
            planner: Planner::default(),
            twin: Twin::standing_at(&plant, &config, stage.seed, stage.at_mm),
            outputs: Outputs::OFF,
            tick_hz: settings.tick_hz,
            encoder: Encoder::new(Blocks::of(&settings)?),
            ticks: 0,
        };
        let Ok(()) = recorded.tick();
        for (axis, polynomial) in
            stage.map.iter().enumerate().filter(|(_, polynomial)| !polynomial.is_empty())
        {
            recorded.compensate(axis, polynomial)?;
        }
        Ok(recorded)
    }

    fn write(&mut self, event: &Event<'_, 2>) {
        let Ok(()) = self.encoder.event(event);
    }

    fn compensate(&mut self, axis: usize, polynomial: &[f64]) -> Result<()> {
        let error_um = |mm: f64| polynomial.iter().rev().fold(0.0, |sum, coefficient| sum * mm + coefficient);
        let map = ErrorMap::sample(Pos::from_mm(MAP_FROM_MM), |reading| Pos::from_um(error_um(reading.mm())))
            .map_err(|error| anyhow!("stage.toml, map of axis {axis}: {error}"))?;
        self.write(&Event::Map { axis, map: Some(&map) });
        self.controller.set_error_map(axis, Some(map)).map_err(|refusal| anyhow!("{refusal}"))
    }
}

fn preset_text(root: &Path, name: &str) -> Result<String> {
    text_of(&root.join("presets").join(format!("{name}.toml")))
}

impl Stage for Recorded {
    type Error = std::convert::Infallible;

    fn tick(&mut self) -> Result<(), Self::Error> {
        let inputs = self.twin.step(&self.outputs);
        self.write(&Event::Tick(inputs));
        self.outputs = self.controller.tick(&inputs);
        let Ok(()) = self.encoder.outputs(&self.outputs);
        self.ticks += 1;
        if let Some(done) = self.planner.advance(&mut self.controller) {
            self.write(&done.into());
        }
        Ok(())
    }

    fn command(&mut self, command: Command<2>) -> Result<Accepted, Refusal> {
        self.write(&Event::Command(command));
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
