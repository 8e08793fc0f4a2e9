//! The same stage without a board: the controller and the twin in this process, in step with the board.

use crate::board::design::STAGE;
use abbe_core::edge::{Actuation, StepRate};
use abbe_core::front::StepEmitter;
use abbe_core::{Command, Controller, Outputs, Status, background};
use abbe_twin::Twin;
use anyhow::Result;

/// Clocks in a tick.
const CLOCKS: u32 = 12_500;

/// Controller and twin.
pub struct Alone {
    controller: Controller<2>,
    /// The stage.
    pub twin: Twin,
    outputs: Outputs<2>,
    /// What moves the twin in its next step: its outputs are a tick late.
    acting: Outputs<2>,
    emitters: [StepEmitter; 2],
}

impl Alone {
    /// Powers a stage on that is to run in step with a [`crate::wired::Wired`] one made from the same twin.
    ///
    /// # Errors
    /// The board's stage does not build.
    pub fn power_on(mut twin: Twin) -> Result<Self> {
        let config = STAGE.build()?;
        // The wired twin has made a step before the board's first tick.
        twin.step(&Outputs::OFF);
        Ok(Self {
            controller: Controller::new(config),
            twin,
            outputs: Outputs::OFF,
            acting: Outputs::OFF,
            emitters: [StepEmitter::new(CLOCKS); 2],
        })
    }

    /// Asks for something between two ticks.
    pub fn command(&mut self, command: Command<2>) {
        // Refused here as there, or the ticks that follow will show it.
        _ = self.controller.command(command);
    }

    /// One tick, with the number that the board's has.
    pub fn tick(&mut self, number: u32) -> (Status<2>, Outputs<2>) {
        let acting = std::mem::replace(&mut self.acting, self.outputs);
        for (emitter, output) in self.emitters.iter_mut().zip(&acting.axes) {
            let rate = match output.actuation {
                Actuation::Steps(rate) if output.enable => rate,
                _ => StepRate(0),
            };
            emitter.begin_tick(rate);
        }
        let mut inputs = self.twin.step(&self.outputs);
        inputs.tick = number;
        self.outputs = self.controller.tick(&inputs);
        background::advance(&mut self.controller);
        (self.controller.status(), self.outputs)
    }

    /// Pulses that moved the twin in this tick: until the middle and until the end, signed, from power-on.
    pub fn pulses(&self) -> [[i32; 2]; 2] {
        self.emitters.each_ref().map(|emitter| [CLOCKS / 2, CLOCKS].map(|clock| emitter.pulses_at(clock)))
    }
}
