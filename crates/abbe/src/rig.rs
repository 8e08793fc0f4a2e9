//! The controller and the twin, joined: the loop that on a board is read pins, tick, write pins.

use crate::interrupt::{self, Interrupted};
use crate::preset::Preset;
use abbe_core::command::Refusal;
use abbe_core::compensate::{ErrorMap, MapError};
use abbe_core::publish::{Fault, MoveReport, Outcome};
use abbe_core::{Command, Controller, Outputs, Pos, Status, background};
use abbe_metrology::compensation::Compensation;
use abbe_metrology::{Axis, measure::Arrival};
use abbe_twin::{Truth, Twin};

/// Why the stage did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RigError {
    /// The controller refused.
    #[error("{0}")]
    Refused(#[from] Refusal),
    /// The drives were switched off.
    #[error("the stage stopped: {0}")]
    Fault(Fault),
    /// The move ended elsewhere.
    #[error(
        "the stage did not arrive within {time_s:.1} s: x is {x_um:+.2} µm and y {y_um:+.2} µm from the set-point"
    )]
    NotArrived { time_s: f64, x_um: f64, y_um: f64 },
    /// The work took longer than any work may.
    #[error("the stage was still {state} after {time_s:.0} s")]
    TooLong { state: String, time_s: f64 },
    /// A map that the controller does not accept.
    #[error("the compensation of the {axis} axis is not accepted: {fault}")]
    Map { axis: Axis, fault: MapError },
    /// The user asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// A place and a time of the truth, for the trace.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) truth: Truth,
    pub(crate) reading_mm: [f64; 2],
}

/// A stage under control.
pub(crate) struct Rig {
    pub(crate) twin: Twin,
    pub(crate) controller: Controller<2>,
    outputs: Outputs<2>,
    tick_hz: f64,
    ticks: u64,
    /// Every so many ticks a sample of the truth is kept; 0: none.
    trace_every: u64,
    pub(crate) trace: Vec<Sample>,
}

/// Ticks between two looks for Ctrl-C.
const INTERRUPT_TICKS: u64 = 1024;
/// No single request takes longer, s.
const LONGEST_S: f64 = 300.0;

impl Rig {
    /// Powers a stage on. Nothing moves.
    pub(crate) fn new(preset: &Preset, seed: u64) -> Self {
        let tick_hz = preset.controller.settings.tick_hz;
        let mut rig = Self {
            twin: Twin::new(&preset.plant, tick_hz, seed),
            controller: Controller::new(preset.controller.config),
            outputs: Outputs::OFF,
            tick_hz,
            ticks: 0,
            trace_every: 0,
            trace: Vec::new(),
        };
        rig.tick();
        rig
    }

    /// Keeps a sample of the truth every `every_s` seconds.
    pub(crate) fn keep_trace(&mut self, every_s: f64) {
        self.trace_every = (every_s * self.tick_hz).max(1.0) as u64;
    }

    /// One tick of both.
    pub(crate) fn tick(&mut self) {
        let inputs = self.twin.step(&self.outputs);
        self.outputs = self.controller.tick(&inputs);
        background::advance(&mut self.controller);
        self.ticks += 1;
        if self.trace_every > 0 && self.ticks.is_multiple_of(self.trace_every) {
            self.trace.push(Sample { truth: self.twin.truth(), reading_mm: self.position_mm() });
        }
    }

    /// Simulated time since power-on, s.
    pub(crate) fn time_s(&self) -> f64 {
        self.ticks as f64 / self.tick_hz
    }

    /// The snapshot.
    pub(crate) fn status(&self) -> Status<2> {
        self.controller.status()
    }

    /// Where the stage believes to be, mm.
    pub(crate) fn position_mm(&self) -> [f64; 2] {
        self.status().axes.map(|axis| axis.position.mm())
    }

    /// Finds the zero of both axes.
    pub(crate) fn home(&mut self) -> Result<(), RigError> {
        self.controller.command(Command::Home)?;
        self.work()
    }

    /// Goes to a place and waits for measured arrival.
    pub(crate) fn move_to(&mut self, to_mm: [f64; 2]) -> Result<Arrival, RigError> {
        self.controller.command(Command::MoveTo(to_mm.map(Pos::from_mm)))?;
        self.work()?;
        self.arrival(self.status().last_move)
    }

    /// The same, keeping set-point and position of one axis at every tick (s, mm, mm).
    pub(crate) fn move_to_and_watch(
        &mut self,
        to_mm: [f64; 2],
        axis: usize,
    ) -> Result<(Vec<[f64; 3]>, Arrival), RigError> {
        self.controller.command(Command::MoveTo(to_mm.map(Pos::from_mm)))?;
        let (began_s, mut seen) = (self.time_s(), Vec::new());
        loop {
            self.tick();
            let status = self.status();
            let axis = &status.axes[axis];
            seen.push([self.time_s() - began_s, axis.set_point.mm(), axis.position.mm()]);
            if !status.state.is_busy() {
                break;
            }
        }
        self.check()?;
        Ok((seen, self.arrival(self.status().last_move)?))
    }

    /// Lets time pass, s.
    pub(crate) fn wait(&mut self, seconds: f64) -> Result<(), RigError> {
        let ticks = (seconds * self.tick_hz).round() as u64;
        for tick in 0..ticks {
            self.tick();
            if tick.is_multiple_of(INTERRUPT_TICKS) {
                self.check()?;
            }
        }
        self.check()
    }

    /// Puts a compensation in use on both axes.
    pub(crate) fn compensate(&mut self, compensation: &Compensation) -> Result<(), RigError> {
        for (number, axis) in [Axis::X, Axis::Y].into_iter().enumerate() {
            let Some(found) = compensation.axis(axis) else { continue };
            // 5 mm beyond the low end: readings go there while homing.
            let low = self.controller.config().axes[number].low - Pos::from_mm(5.0);
            let map = ErrorMap::sample(low, |reading| Pos::from_um(found.curve.error_um(reading.mm())))
                .map_err(|fault| RigError::Map { axis, fault })?;
            self.controller.set_error_map(number, Some(map))?;
        }
        Ok(())
    }

    /// Ticks until the request is done or failed.
    fn work(&mut self) -> Result<(), RigError> {
        let began = self.ticks;
        self.tick();
        while self.status().state.is_busy() {
            self.tick();
            let taken = self.ticks - began;
            if taken.is_multiple_of(INTERRUPT_TICKS) {
                interrupt::check()?;
            }
            let time_s = taken as f64 / self.tick_hz;
            if time_s > LONGEST_S {
                return Err(RigError::TooLong { state: self.status().state.to_string(), time_s });
            }
        }
        self.check()
    }

    fn check(&self) -> Result<(), RigError> {
        interrupt::check()?;
        self.status().fault.map_or(Ok(()), |fault| Err(RigError::Fault(fault)))
    }

    fn arrival(&self, report: Option<MoveReport>) -> Result<Arrival, RigError> {
        let seconds = |ticks: u32| f64::from(ticks) / self.tick_hz;
        match report {
            Some(report) if report.outcome == Outcome::Arrived => Ok(Arrival {
                moved_s: seconds(report.path_ticks),
                settle_s: seconds(report.settle_ticks) + seconds(self.controller.config().dwell_ticks),
                position_mm: self.position_mm(),
            }),
            report => {
                let [x_um, y_um] = self.status().axes.map(|axis| axis.following_error.um());
                let time_s = report.map_or(0.0, |report| seconds(report.settle_ticks));
                Err(RigError::NotArrived { time_s, x_um, y_um })
            }
        }
    }
}
