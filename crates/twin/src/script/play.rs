//! Plays a script on a stage and looks whether it does what the script expects.

use super::{Expectation, Step, Within};
use crate::{DigitalHead, Event, Twin};
use abbe_core::plan::Segment;
use abbe_core::plan::segment::Feed;
use abbe_core::publish::{End, Fault, HomingFailure};
use abbe_core::sense::health::SignalFault;
use abbe_core::units::PM_PER_MM;
use abbe_core::{Accepted, Command, Pos, Refusal, Status};

/// Nothing is waited for longer, s of the stage's time.
const LONGEST_S: f64 = 60.0;
/// Slides slower than this stand, mm/s, once they have done so for so many ticks.
const STANDING_MM_S: f64 = 0.01;
const STANDING_TICKS: u32 = 500;

/// A controller joined to a twin.
pub trait Stage {
    /// Why a tick cannot be done.
    type Error;

    /// One tick of both.
    ///
    /// # Errors
    /// When the run must end here.
    fn tick(&mut self) -> Result<(), Self::Error>;

    /// Asks the controller.
    ///
    /// # Errors
    /// When the controller refuses.
    fn command(&mut self, command: Command<2>) -> Result<Accepted, Refusal>;

    /// The snapshot of the controller.
    fn status(&self) -> Status<2>;

    /// Ticks a second.
    fn tick_hz(&self) -> f64;

    /// The stage itself.
    fn twin(&self) -> &Twin;

    /// The stage itself, for something to happen to it.
    fn twin_mut(&mut self) -> &mut Twin;
}

impl<S: Stage> Stage for &mut S {
    type Error = S::Error;

    fn tick(&mut self) -> Result<(), S::Error> {
        S::tick(self)
    }

    fn command(&mut self, command: Command<2>) -> Result<Accepted, Refusal> {
        S::command(self, command)
    }

    fn status(&self) -> Status<2> {
        S::status(self)
    }

    fn tick_hz(&self) -> f64 {
        S::tick_hz(self)
    }

    fn twin(&self) -> &Twin {
        S::twin(self)
    }

    fn twin_mut(&mut self) -> &mut Twin {
        S::twin_mut(self)
    }
}

/// Why a script ends before its end.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlayError<E> {
    /// An expectation is not met.
    #[error("{0}")]
    Unmet(String),
    /// The stage has no such head.
    #[error(transparent)]
    Digital(#[from] DigitalHead),
    /// The stage ended the run.
    #[error(transparent)]
    Stage(E),
}

/// Plays scripts on a stage, and remembers what their expectations ask for.
#[derive(Debug)]
pub struct Player<S> {
    stage: S,
    refused: Option<String>,
    /// Slides when the last event happened, µm.
    at_event: [f64; 2],
    worst_following_um: f64,
    /// Farthest from the straight line between the last two targets, µm.
    worst_off_line_um: f64,
    line: [[f64; 2]; 2],
}

impl<S: Stage> Player<S> {
    /// Nothing is played yet.
    pub fn new(stage: S) -> Self {
        Self {
            stage,
            refused: None,
            at_event: [0.0; 2],
            worst_following_um: 0.0,
            worst_off_line_um: 0.0,
            line: [[0.0; 2]; 2],
        }
    }

    /// Plays one step, and a tick after it.
    ///
    /// # Errors
    /// When an expectation is not met or the stage ends the run.
    pub fn step(&mut self, step: &Step) -> Result<(), PlayError<S::Error>> {
        match step {
            Step::Do(command) => {
                self.command(*command);
                self.tick()?;
                self.settle()?;
            }
            Step::Ask(command) => self.command(*command),
            Step::Go(segment, feed) => self.go(*segment, *feed)?,
            Step::Wait(seconds) => self.run(*seconds, |_| false)?,
            Step::Settle => self.settle()?,
            Step::WaitUntilFault => self.run(LONGEST_S, |stage| stage.status().fault.is_some())?,
            Step::WaitUntilRest => self.wait_until_rest()?,
            Step::Repeat(times, step) => {
                for _ in 0..*times {
                    self.step(step)?;
                }
            }
            Step::Happen(event) => self.event(*event)?,
            Step::Expect(expectation) => self.expect(expectation).map_err(PlayError::Unmet)?,
        }
        self.tick()
    }

    fn tick(&mut self) -> Result<(), PlayError<S::Error>> {
        self.stage.tick().map_err(PlayError::Stage)?;
        let axes = self.stage.status().axes;
        for axis in &axes {
            self.worst_following_um = self.worst_following_um.max(axis.following_error.um().abs());
        }
        self.worst_off_line_um = self.worst_off_line_um.max(self.off_line(axes.map(|a| a.set_point.um())));
        Ok(())
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

    fn run(&mut self, seconds: f64, mut until: impl FnMut(&S) -> bool) -> Result<(), PlayError<S::Error>> {
        for _ in 0..(seconds * self.stage.tick_hz()) as u64 {
            self.tick()?;
            if until(&self.stage) {
                break;
            }
        }
        Ok(())
    }

    fn settle(&mut self) -> Result<(), PlayError<S::Error>> {
        self.run(LONGEST_S, |stage| !stage.status().state.is_busy())?;
        let state = self.stage.status().state;
        let waited = || PlayError::Unmet(format!("the stage is still {state} after {LONGEST_S} s"));
        if state.is_busy() { Err(waited()) } else { Ok(()) }
    }

    fn wait_until_rest(&mut self) -> Result<(), PlayError<S::Error>> {
        let mut quiet = 0;
        self.run(LONGEST_S, |stage| {
            let moving = stage.twin().truth().speed_mm_s.iter().any(|v| v.abs() > STANDING_MM_S);
            quiet = if moving { 0 } else { quiet + 1 };
            quiet > STANDING_TICKS
        })
    }

    fn command(&mut self, command: Command<2>) {
        self.line[0] = self.stage.status().axes.map(|axis| axis.set_point.um());
        self.refused = self.stage.command(command).err().map(|refusal| refusal.to_string());
        self.line[1] = match command {
            Command::MoveTo(to) if self.refused.is_none() => to.map(Pos::um),
            _ => self.line[0],
        };
        self.worst_off_line_um = 0.0;
    }

    /// The controller takes a few segments at a time.
    fn go(&mut self, mut segment: Segment, feed_mm_s: Option<f64>) -> Result<(), PlayError<S::Error>> {
        if let Some(feed) = feed_mm_s {
            segment.feed = Feed::from_pm(feed * PM_PER_MM / self.stage.tick_hz());
        }
        let mut answer = self.stage.command(Command::Go(segment));
        while answer == Err(Refusal::QueueFull) {
            self.tick()?;
            answer = self.stage.command(Command::Go(segment));
        }
        self.refused = answer.err().map(|refusal| refusal.to_string());
        Ok(())
    }

    fn event(&mut self, event: Event) -> Result<(), DigitalHead> {
        self.at_event = self.stage.twin().truth().slides_um;
        self.stage.twin_mut().happen(event)
    }

    fn expect(&self, expectation: &Expectation) -> Result<(), String> {
        let status = self.stage.status();
        match expectation {
            Expectation::State(state) => {
                let why = status.fault.map(|fault| format!(" ({fault})")).unwrap_or_default();
                holds(status.state == *state, || format!("the state is {}{why}, not {state}", status.state))
            }
            Expectation::Fault(words) => {
                let found = status.fault.as_ref().map_or("none".into(), name_of);
                holds(words.split(" or ").any(|one| one == found), || {
                    format!("the fault is `{found}`, not `{words}`")
                })
            }
            Expectation::NoFault => match status.fault {
                Some(fault) => Err(format!("there is a fault: {fault}")),
                None => Ok(()),
            },
            Expectation::Refused(words) => match &self.refused {
                Some(answer) => {
                    holds(answer.contains(words), || format!("the answer is `{answer}`, without `{words}`"))
                }
                None => Err(format!("nothing was refused, where `{words}` was to be the answer")),
            },
            Expectation::Accepted => match &self.refused {
                Some(answer) => Err(format!("the request was refused: {answer}")),
                None => Ok(()),
            },
            Expectation::Targets(asked) => {
                let targets = status.axes.map(|axis| axis.target);
                holds(targets == *asked, || format!("the targets are {:?} mm", targets.map(Pos::mm)))
            }
            Expectation::Signals(axis, grade) => {
                let found =
                    status.axes[*axis].signals.ok_or("the axis has no sine and cosine to be graded")?;
                let (worst, all) = (found.grade(), found.warn.and(found.fail));
                holds(worst == *grade, || format!("the signals are {worst} ({all}), not {grade}"))
            }
            _ => self.expect_measured(expectation, &status),
        }
    }

    /// Whatever has a tolerance, in µm.
    fn expect_measured(&self, expectation: &Expectation, status: &Status<2>) -> Result<(), String> {
        let (what, found, limit) = match *expectation {
            Expectation::At(asked, limit) => {
                let off = [0, 1].map(|k: usize| (status.axes[k].position - asked[k]).um().abs());
                ("the table is off its place by", off[0].max(off[1]), limit)
            }
            Expectation::SlidesStopped(limit) => {
                let now = self.stage.twin().truth().slides_um;
                let gone = [0, 1].map(|k: usize| (now[k] - self.at_event[k]).abs());
                ("the slides went on for", gone[0].max(gone[1]), limit)
            }
            Expectation::FollowingErrorBelow(limit) => {
                ("the following error reached", self.worst_following_um, limit)
            }
            Expectation::PathWithin(limit) => ("the path left its line by", self.worst_off_line_um, limit),
            Expectation::ZeroShift(axis, limit) => {
                let shift = status.axes[axis].home.zero_shift.ok_or("the axis has not homed twice")?;
                ("the zero moved by", shift.um().abs(), limit)
            }
            Expectation::SwitchShift(axis, expected, limit) => {
                let shift = status.axes[axis].home.switch_shift.ok_or("the axis has not homed twice")?;
                ("the switch is off its expected place by", (shift.um() - expected).abs(), limit)
            }
            _ => {
                let lowest = status.axes.iter().map(|axis| axis.position.um()).fold(f64::INFINITY, f64::min);
                ("a position is below zero by", -lowest, Within(1.0))
            }
        };
        holds(found <= limit.0, || format!("{what} {found:.3} µm, more than {} µm", limit.0))
    }
}

fn holds(holds: bool, otherwise: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(otherwise()) }
}

/// A fault in the words of the scripts.
fn name_of(fault: &Fault) -> String {
    let axis_name = |axis: &usize| ["x", "y"].get(*axis).copied().unwrap_or("?");
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
        Fault::Signal { axis, what } => {
            let what = match what {
                SignalFault::Lost => "lost",
                SignalFault::OffCircle => "off circle",
                SignalFault::Missed => "missed",
                SignalFault::Disagrees => "disagrees",
                SignalFault::Fast => "fast",
                SignalFault::Slipped => "slipped",
            };
            format!("signal {} {what}", axis_name(axis))
        }
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
