//! A stage under control, for tests.

#![allow(dead_code, reason = "each test uses its own part")]

use abbe_core::design::{Config, StageSettings};
use abbe_core::publish::Outcome;
use abbe_core::{Command, Controller, Outputs, Pos, background};
use abbe_twin::{Plant, Twin};

pub(crate) const PRESET: &str = include_str!("../../../../presets/microscope-100.toml");

pub(crate) fn plant() -> Plant {
    Plant::read("microscope-100", PRESET).unwrap()
}

pub(crate) fn config() -> Config<2> {
    StageSettings::default().build().unwrap()
}

pub(crate) struct Stage {
    pub(crate) twin: Twin,
    pub(crate) controller: Controller<2>,
    outputs: Outputs<2>,
}

impl Stage {
    pub(crate) fn new(plant: &Plant, seed: u64) -> Self {
        let config = config();
        let mut stage = Self {
            twin: Twin::new(plant, &config, seed),
            controller: Controller::new(config),
            outputs: Outputs::OFF,
        };
        stage.tick();
        stage
    }

    pub(crate) fn homed(plant: &Plant, seed: u64) -> Self {
        let mut stage = Self::new(plant, seed);
        stage.home();
        stage
    }

    pub(crate) fn tick(&mut self) {
        let inputs = self.twin.step(&self.outputs);
        self.outputs = self.controller.tick(&inputs);
        background::advance(&mut self.controller);
    }

    pub(crate) fn wait(&mut self, seconds: f64) {
        for _ in 0..(seconds * 1e4) as u64 {
            self.tick();
        }
    }

    fn work(&mut self, command: Command<2>) {
        self.controller.command(command).unwrap();
        self.tick();
        while self.controller.status().state.is_busy() {
            self.tick();
        }
        assert_eq!(self.controller.status().fault, None);
    }

    pub(crate) fn home(&mut self) {
        self.work(Command::Home);
    }

    pub(crate) fn go(&mut self, x_mm: f64, y_mm: f64) {
        self.work(Command::MoveTo([Pos::from_mm(x_mm), Pos::from_mm(y_mm)]));
        assert_eq!(self.controller.status().last_move.unwrap().outcome, Outcome::Arrived);
    }
}
