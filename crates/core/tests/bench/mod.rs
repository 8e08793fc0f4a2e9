//! A controller of two axes on slides that hide nothing.

#![allow(dead_code, reason = "not every test uses all of it")]

pub(crate) mod ideal;

use crate::walked::assert_within;
use abbe_core::background::{self, Planner};
use abbe_core::design::StageSettings;
use abbe_core::machine::State;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::Place;
use abbe_core::plan::segment::Segment;
use abbe_core::publish::Outcome;
use abbe_core::{Command, Controller, Outputs, Pos, Refusal, Status};
use ideal::Ideal;

/// Who plans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Plans {
    /// A planner with a memory.
    Everything,
    /// [`background::advance`] alone.
    MovesFromRest,
    Nothing,
}

pub(crate) struct Bench {
    pub(crate) plant: Ideal,
    pub(crate) controller: Controller<2>,
    pub(crate) planner: Planner,
    pub(crate) plans: Plans,
    pub(crate) outputs: Outputs<2>,
    /// Set-points since the last look, pm.
    pub(crate) places: Vec<Place>,
}

impl Bench {
    /// Switched on, with a planner.
    pub(crate) fn new() -> Self {
        Self::of(Controller::with_planner, Plans::Everything)
    }

    /// Switched on, with a controller that goes from rest to rest.
    pub(crate) fn plain() -> Self {
        Self::of(Controller::new, Plans::MovesFromRest)
    }

    fn of(controller: fn(abbe_core::design::Config<2>) -> Controller<2>, plans: Plans) -> Self {
        let mut bench = Self {
            plant: Ideal::new(),
            controller: controller(StageSettings::<2>::default().build().unwrap()),
            planner: Planner::default(),
            plans,
            outputs: Outputs::OFF,
            places: Vec::new(),
        };
        bench.tick();
        bench
    }

    pub(crate) fn homed(mut self) -> Self {
        self.ask(Command::Home);
        self.settle();
        assert_eq!(self.status().state, State::Ready, "{:?}", self.status().fault);
        self.places.clear();
        self.keep();
        self
    }

    pub(crate) fn tick(&mut self) {
        let inputs = self.plant.step(&self.outputs);
        self.outputs = self.controller.tick(&inputs);
        match self.plans {
            Plans::Everything => _ = self.planner.advance(&mut self.controller),
            Plans::MovesFromRest => _ = background::advance(&mut self.controller),
            Plans::Nothing => {}
        }
        self.keep();
    }

    fn keep(&mut self) {
        self.places.push(self.status().axes.map(|axis| axis.set_point.pm() as f64));
    }

    pub(crate) fn run(&mut self, ticks: u32) {
        (0..ticks).for_each(|_| self.tick());
    }

    pub(crate) fn settle(&mut self) {
        self.tick();
        for _ in 0..600_000 {
            if !self.status().state.is_busy() {
                return;
            }
            self.tick();
        }
        panic!("still {}", self.status().state);
    }

    pub(crate) fn ask(&mut self, command: Command<2>) {
        self.controller.command(command).unwrap();
    }

    pub(crate) fn status(&self) -> Status<2> {
        self.controller.status()
    }

    pub(crate) fn limits(&self) -> [Limits; 2] {
        self.controller.config().axes.map(|axis| axis.limits)
    }

    /// A single move, to its end.
    pub(crate) fn move_to(&mut self, x: f64, y: f64) {
        self.ask(Command::MoveTo(mm(x, y)));
        self.settle();
    }

    /// All segments, as there is room for them.
    pub(crate) fn go(&mut self, segments: &[Segment]) {
        for segment in segments {
            while self.controller.command(Command::Go(*segment)) == Err(Refusal::QueueFull) {
                self.tick();
            }
        }
    }

    pub(crate) fn outcome(&self) -> Outcome {
        self.status().last_move.unwrap().outcome
    }

    pub(crate) fn assert_moved_within_limits(&self) {
        assert_within(&self.places, &self.limits());
    }
}

pub(crate) fn mm(x: f64, y: f64) -> [Pos; 2] {
    [Pos::from_mm(x), Pos::from_mm(y)]
}
