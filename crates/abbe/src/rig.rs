//! The controller and the twin, joined: the loop that on a board is read pins, tick, write pins.

use crate::flight::file::Origin;
use crate::flight::{Keep, Recorder, Recording, RecordingError};
use crate::folder;
use crate::interrupt::{self, Interrupted};
use crate::preset::Preset;
use crate::progress;
use abbe_core::command::{Accepted, Refusal};
use abbe_core::compensate::{ErrorMap, MapError};
use abbe_core::plan::segment::{Feed, Segment};
use abbe_core::publish::{Fault, Outcome};
use abbe_core::{Command, Controller, Outputs, Pos, Status};
use abbe_metrology::compensation::Compensation;
use abbe_metrology::{Axis, measure::Arrival};
use abbe_twin::{Truth, Twin, script};
use std::path::{Path, PathBuf};

/// Why the stage did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RigError {
    /// The controller refused.
    #[error("{0}")]
    Refused(#[from] Refusal),
    /// The drives were switched off.
    #[error("the stage stopped: {fault}{flight}")]
    Fault {
        fault: Fault,
        /// Where its flight recording is, or nothing.
        flight: String,
    },
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
    recorder: Recorder,
    /// Where the last minutes are written when the stage stops with a fault; once.
    flights: Option<PathBuf>,
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
    pub(crate) fn new(preset: &Preset, seed: u64, keep: Keep) -> Self {
        let twin = Twin::new(&preset.plant, &preset.controller.config, seed);
        Self::with(preset, twin, keep)
    }

    fn with(preset: &Preset, twin: Twin, keep: Keep) -> Self {
        let origin = Origin::of(preset, twin.seed());
        let mut rig = Self {
            twin,
            recorder: Recorder::new(Controller::with_planner(preset.controller.config), origin, keep),
            flights: None,
            outputs: Outputs::OFF,
            tick_hz: preset.controller.settings.tick_hz,
            ticks: 0,
            trace_every: 0,
            trace: Vec::new(),
        };
        rig.tick();
        rig
    }

    /// Writes the last minutes into this folder when the stage stops with a fault.
    pub(crate) fn dump_into(&mut self, dir: &Path) {
        self.flights = Some(dir.to_path_buf());
    }

    /// What happened so far, as far as it is kept.
    pub(crate) fn recording(&mut self) -> Result<Recording, RecordingError> {
        self.recorder.recording()
    }

    /// The controller, to look at.
    pub(crate) fn controller(&self) -> &Controller<2> {
        self.recorder.controller()
    }

    /// Keeps a sample of the truth every `every_s` seconds.
    pub(crate) fn keep_trace(&mut self, every_s: f64) {
        self.trace_every = (every_s * self.tick_hz).max(1.0) as u64;
    }

    /// One tick of both.
    pub(crate) fn tick(&mut self) {
        let inputs = self.twin.step(&self.outputs);
        self.outputs = self.recorder.tick(&inputs);
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
        self.controller().status()
    }

    /// Where the stage believes to be, mm.
    pub(crate) fn position_mm(&self) -> [f64; 2] {
        self.status().axes.map(|axis| axis.position.mm())
    }

    /// For a user who has stopped it on its way.
    pub(crate) fn tell_where_it_stopped(&self) {
        let [x, y] = self.position_mm();
        progress::note(&format!("note: the stage has stopped at x {x:.4} mm, y {y:.4} mm"));
    }

    /// Finds the zero of both axes.
    pub(crate) fn home(&mut self) -> Result<(), RigError> {
        self.recorder.command(Command::Home)?;
        self.work()
    }

    /// Goes to a place and waits for measured arrival.
    pub(crate) fn move_to(&mut self, to_mm: [f64; 2]) -> Result<Arrival, RigError> {
        self.recorder.command(Command::MoveTo(to_mm.map(Pos::from_mm)))?;
        self.work()?;
        self.arrival()
    }

    /// The same, one axis after the other: x first, and y once the set-point of x stands.
    pub(crate) fn move_in_turn_to(&mut self, to_mm: [f64; 2]) -> Result<Arrival, RigError> {
        let [x, y] = to_mm.map(Pos::from_mm);
        let [_, standing] = self.status().axes.map(|axis| axis.target);
        let [_, travel] = self.controller().config().axes.map(|axis| [axis.low, axis.high]);
        // Homing leaves an axis some micrometres beside its zero, perhaps beyond the end of its travel.
        let standing = standing.max(travel[0]).min(travel[1]);
        for to in [[x, standing], [x, y]] {
            self.recorder.command(Command::Go(Segment { to, feed: Feed::RAPID, ..Segment::default() }))?;
        }
        self.work()?;
        self.arrival()
    }

    /// Asks the controller. What was asked for begins with the next tick.
    pub(crate) fn ask(&mut self, command: Command<2>) -> Result<Accepted, Refusal> {
        self.recorder.command(command)
    }

    /// The servo rate, ticks in a second.
    pub(crate) fn tick_hz(&self) -> f64 {
        self.tick_hz
    }

    /// The same, keeping set-point and position of one axis at every tick (s, mm, mm).
    pub(crate) fn move_to_and_watch(
        &mut self,
        to_mm: [f64; 2],
        axis: usize,
    ) -> Result<(Vec<[f64; 3]>, Arrival), RigError> {
        self.recorder.command(Command::MoveTo(to_mm.map(Pos::from_mm)))?;
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
        Ok((seen, self.arrival()?))
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
            let low = self.controller().config().axes[number].low - Pos::from_mm(5.0);
            let map = ErrorMap::sample(low, |reading| Pos::from_um(found.curve.error_um(reading.mm())))
                .map_err(|fault| RigError::Map { axis, fault })?;
            self.recorder.set_error_map(number, &map)?;
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

    /// Looks for a fault and for Ctrl-C.
    pub(crate) fn check(&mut self) -> Result<(), RigError> {
        interrupt::check()?;
        match self.status().fault {
            Some(fault) => Err(RigError::Fault { fault, flight: self.dump() }),
            None => Ok(()),
        }
    }

    /// Writes the last minutes down, if that is wanted and not done yet; says where they are.
    fn dump(&mut self) -> String {
        let Some(dir) = self.flights.take() else { return String::new() };
        let bytes = self.recording().and_then(|recording| recording.to_bytes());
        let written = bytes.map_err(Into::into).and_then(|bytes| folder::write_next_flight(&dir, &bytes));
        match written {
            Ok(file) => format!("; what led to it is in {} (`abbe replay`)", file.display()),
            Err(failure) => format!("; its flight recording is lost: {}", failure.sentence()),
        }
    }

    /// How the last move ended.
    pub(crate) fn arrival(&self) -> Result<Arrival, RigError> {
        let seconds = |ticks: u32| f64::from(ticks) / self.tick_hz;
        match self.status().last_move {
            Some(report) if report.outcome == Outcome::Arrived => Ok(Arrival {
                moved_s: seconds(report.path_ticks),
                settle_s: seconds(report.settle_ticks) + seconds(self.controller().config().dwell_ticks),
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

impl script::Stage for Rig {
    type Error = Interrupted;

    fn tick(&mut self) -> Result<(), Interrupted> {
        Self::tick(self);
        if self.ticks.is_multiple_of(INTERRUPT_TICKS) { interrupt::check() } else { Ok(()) }
    }

    fn command(&mut self, command: Command<2>) -> Result<Accepted, Refusal> {
        self.recorder.command(command)
    }

    fn status(&self) -> Status<2> {
        Self::status(self)
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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::preset;

    impl Rig {
        pub(crate) fn recorder_mut(&mut self) -> &mut Recorder {
            &mut self.recorder
        }
    }

    pub(crate) fn preset() -> Preset {
        preset::load(preset::USUAL).unwrap()
    }

    /// A stage that stands near its switches, so that it homes soon.
    pub(crate) fn rig(seed: u64) -> Rig {
        let preset = preset();
        let twin = Twin::standing_at(&preset.plant, &preset.controller.config, seed, [1.0, 0.5]);
        Rig::with(&preset, twin, Keep::LastMinutes)
    }

    #[test]
    fn one_axis_stands_while_the_other_goes() {
        let mut rig = rig(1);
        rig.home().unwrap();
        rig.keep_trace(1e-3);
        let arrival = rig.move_in_turn_to([3.0, 2.0]).unwrap();
        for (axis, to) in [3.0, 2.0].into_iter().enumerate() {
            assert!((arrival.position_mm[axis] - to).abs() < 0.6e-3, "{arrival:?}");
        }
        assert!(rig.trace.len() > 300);
        for Sample { reading_mm: [x, y], .. } in &rig.trace {
            assert!((x - 3.0).abs() < 5e-3 || y.abs() < 5e-3, "x {x}, y {y}");
        }
    }

    #[test]
    fn a_fault_is_written_down_once_and_named() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("abbe-flight-1.abr"), "mine").unwrap();
        let mut rig = rig(1);
        rig.dump_into(dir.path());
        rig.home().unwrap();
        rig.twin.happen(abbe_twin::Event::EmergencyStop { pressed: true }).unwrap();
        let sentence = rig.move_to([2.0, 2.0]).unwrap_err().to_string();
        let file = dir.path().join("abbe-flight-2.abr");
        assert!(sentence.contains("emergency stop; what led to it is in"), "{sentence}");
        assert!(sentence.contains(&file.display().to_string()), "{sentence}");
        assert!(!rig.wait(0.1).unwrap_err().to_string().contains("abr"), "told twice");
        let recording = Recording::of_bytes(&std::fs::read(file).unwrap()).unwrap();
        let mut faults = 0;
        crate::flight::replay::play(&recording, |seen| {
            if let crate::flight::replay::Seen::Tick { status, .. } = seen {
                faults += u32::from(status.fault == Some(Fault::EmergencyStop));
            }
        })
        .unwrap();
        assert!(faults > 0);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    }
}
