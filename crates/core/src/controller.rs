//! The controller: N axes and one coordinator, one function a tick.

mod axis;
mod compare;
mod modes;
mod moves;
mod program;

use crate::command::{Accepted, Command, Refusal};
use crate::compensate::ErrorMap;
use crate::design::Config;
use crate::edge::{AxisOutputs, Inputs, Outputs};
use crate::front::compare::{Passage, Sampled};
use crate::guard;
use crate::machine::{Event, State};
use crate::plan::Path;
use crate::plan::steps::SetPoint;
use crate::publish::{AxisStatus, Fault, MoveReport, Status};
use crate::sense::head::{Head, Refined};
use crate::units::Pos;
use axis::Axis;
use moves::CurrentMove;
use program::Program;

pub use program::QUEUE;

/// The whole controller of a stage of N axes. See the crate's first page, and [`crate::edge`] for what a plant must say.
///
/// It holds no thread, no clock and no device. Whoever owns it calls [`tick`](Self::tick) once a servo period, and between
/// two ticks, in any order and as often as he likes, [`command`](Self::command), [`status`](Self::status),
/// [`set_error_map`](Self::set_error_map) and [`crate::background::advance`]. Call `tick` once before the first command:
/// until then nothing is known of where the stage stands.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Controller<const N: usize> {
    config: Config<N>,
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    axes: [Axis; N],
    state: State,
    fault: Option<Fault>,
    path: Path<N>,
    program: Program,
    /// Whoever plans remembers: programs and turns can be asked for.
    has_planner: bool,
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    target: [Pos; N],
    current: Option<CurrentMove<N>>,
    last_move: Option<MoveReport>,
    move_number: u32,
    last_tick: Option<u32>,
    /// What the last tick has published of each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    published: [AxisStatus; N],
    /// Analogue heads, of the axes that have one.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    heads: [Option<Head>; N],
    has_heads: bool,
    /// What is compared, of which axis, and what it has fired in the last tick.
    compare: Option<(usize, Sampled)>,
    passage: Passage,
}

impl<const N: usize> Controller<N> {
    /// A controller that has just been switched on: drives off, nothing homed.
    ///
    /// It is planned for by [`crate::background::advance`] or the like, from rest to rest: it refuses programs, and another
    /// target while it is on a path. One of two axes can have more: [`with_planner`](Self::with_planner).
    pub fn new(config: Config<N>) -> Self {
        Self {
            config,
            axes: config.axes.each_ref().map(Axis::new),
            state: State::Off,
            fault: None,
            path: Path::holding([Pos::ZERO; N], config.axes.map(|axis| axis.glide)),
            program: Program::default(),
            has_planner: false,
            target: [Pos::ZERO; N],
            current: None,
            last_move: None,
            move_number: 0,
            last_tick: None,
            published: [AxisStatus::default(); N],
            heads: config.axes.map(|axis| axis.sense.head.map(|head| Head::new(&head))),
            compare: None,
            passage: Passage::default(),
            has_heads: config.axes.iter().any(|axis| axis.sense.head.is_some()),
        }
    }

    /// One tick, at the servo rate; bounded time, never fails.
    ///
    /// `inputs` are the sensors as they stand now; their tick number is one more than the last one's. The outputs are in
    /// force from now until those of the next tick. The same inputs and commands in the same ticks give the same outputs,
    /// bit for bit.
    ///
    /// What is wrong with the inputs is no error of this function but a [`Fault`]: after one that cuts, `enable` is false
    /// in these very outputs; after one that allows braking, the stage brakes on its path and is then switched off. It
    /// goes on being ticked. In [`State::Fault`] everything but [`Command::Reset`] is refused or does nothing; `Reset` leads
    /// to [`State::Off`], and back into the fault with the next tick if its cause is still there. The zero survives a
    /// fault, unless counts may be missing: then [`Command::MoveTo`] is refused until the stage has homed again.
    #[inline(never)]
    pub fn tick(&mut self, inputs: &Inputs<N>) -> Outputs<N> {
        self.sense(inputs);
        self.guard(inputs);
        self.machine(inputs.tick);
        let stage = self.plan(inputs.tick);
        self.compensate(&stage);
        let speeds = self.servo();
        let mut outputs = self.drive(&speeds);
        self.publish();
        if self.compare.is_some() {
            outputs.trigger = self.compare_position(inputs.tick);
        }
        outputs
    }

    /// Takes or refuses a request; never blocks. Busy holds from this instant.
    ///
    /// Call it between two ticks, not before the first. Its effect is in the outputs of the next tick. Positions are in
    /// the stage frame. `Accepted` means begun, not done: done is when [`status`](Self::status) is not busy any more and
    /// `last_move` has the number of this move, with how it ended. A move begins only when it has its plan, see
    /// [`wanted_plan`](Self::wanted_plan). `Stop`, `Reset` and `Disable` are never refused; where there is nothing to stop,
    /// to leave or to switch off, they do nothing.
    ///
    /// # Errors
    /// A [`Refusal`] says why nothing was done.
    pub fn command(&mut self, command: Command<N>) -> Result<Accepted, Refusal> {
        let Command::Go(segment) = command else { return self.command_without_floats(command) };
        self.go(&segment)?;
        Ok(Accepted { move_number: self.move_number })
    }

    /// The same for the core of a board that ticks. Segments of programs are looked at in floats, so they are refused there.
    ///
    /// # Errors
    /// As of [`command`](Self::command), or [`Refusal::NoPlanner`].
    #[inline(never)]
    pub fn command_without_floats(&mut self, command: Command<N>) -> Result<Accepted, Refusal> {
        match command {
            Command::Enable => self.request(Event::Enable)?,
            Command::Disable => self.disable(),
            Command::Home => self.request(Event::Home)?,
            Command::MoveTo(to) => self.begin_move(to)?,
            Command::MoveBy(way) => self.begin_move(self.beyond_target(&way))?,
            Command::Go(_) => return Err(Refusal::NoPlanner),
            Command::Compare(compare) => self.arm(compare)?,
            Command::Hold => self.hold_program(true)?,
            Command::Resume => self.hold_program(false)?,
            Command::FeedRate(percent) => self.set_feed_rate(percent)?,
            // A stage that stands has already stopped.
            Command::Stop => _ = self.happen(Event::Stop),
            Command::Reset => _ = self.happen(Event::Reset),
        }
        Ok(Accepted { move_number: self.move_number })
    }

    /// The snapshot of the last tick, a copy; never touches the loop.
    ///
    /// State, fault, move number and last move are those of this instant, so that a command is seen at once; all else is as
    /// the last tick left it. Positions are picometres: `position`, `set_point` and `target` in the stage frame, `reading` and
    /// `following_error` (set-point minus reading) in that of the scale. Before homing a position counts from where the
    /// stage stood at power-on, or, with an analogue head, from the beginning of a period near there; `homed` tells.
    pub fn status(&self) -> Status<N> {
        Status {
            tick: self.last_tick.unwrap_or(0),
            state: self.state,
            fault: self.fault,
            move_number: self.move_number,
            last_move: self.last_move,
            held: self.program.is_held(),
            feed_rate: self.program.percent(),
            axes: self.published,
        }
    }

    /// What the stage is doing, of this instant.
    pub fn state(&self) -> State {
        self.state
    }

    /// The set-points of the last tick with their speed, acceleration and jerk, stage frame: for feed-forward.
    pub fn set_points(&self) -> [SetPoint; N] {
        self.path.set_points()
    }

    /// Limits, window and rates in use.
    pub fn config(&self) -> &Config<N> {
        &self.config
    }

    /// Puts an error map in use, or none; the stage does not move by it.
    ///
    /// # Errors
    /// While the stage moves, and for an axis that it does not have.
    pub fn set_error_map(&mut self, axis: usize, map: Option<ErrorMap>) -> Result<(), Refusal> {
        if self.state.is_busy() {
            return Err(Refusal::Busy(self.state));
        }
        let axis = self.axes.get_mut(axis).ok_or(Refusal::NoSuchAxis(axis))?;
        axis.map = map;
        axis.find_ends();
        self.disarm();
        if self.state == State::Ready {
            // The table stays; the place where it stands gets its true name.
            self.hold_set_point();
        }
        Ok(())
    }

    /// An axis whose analogue encoder has gathered samples for its correction, if one has; see [`crate::background`].
    pub fn wants_refining(&self) -> Option<usize> {
        self.heads.iter().position(|head| head.as_ref().is_some_and(Head::wants_refining))
    }

    /// Takes what a fit of [`Head::refining`] came to: between two ticks, in force with the next.
    pub fn take_refined(&mut self, axis: usize, refined: Refined) {
        if let Some(head) = self.heads.get_mut(axis).and_then(Option::as_mut) {
            head.take_refined(refined);
        }
    }

    /// The analogue head of an axis, to look at.
    pub fn head(&self, axis: usize) -> Option<&Head> {
        self.heads.get(axis)?.as_ref()
    }

    // ---- sense -------------------------------------------------------------------------------------------------

    #[inline(never)]
    fn sense(&mut self, inputs: &Inputs<N>) {
        for (axis, inputs) in self.axes.iter_mut().zip(&inputs.axes) {
            axis.sense.read(inputs, &axis.config.sense);
            axis.sense.now.pulses = axis.sense.now.pulses.wrapping_add(axis.drive.told());
            if inputs.illegal != 0 || inputs.glitches != 0 {
                axis.count_disturbances(inputs);
            }
        }
        if self.has_heads {
            self.read_heads(inputs);
        }
    }

    /// Out of line: a stage with square signals need not carry it.
    #[inline(never)]
    fn read_heads(&mut self, inputs: &Inputs<N>) {
        for ((axis, inputs), head) in self.axes.iter_mut().zip(&inputs.axes).zip(&mut self.heads) {
            if let (Some(head), Some(config)) = (head, &axis.config.sense.head) {
                axis.sense.read_head(inputs, config, head);
            }
        }
    }

    // ---- guard -------------------------------------------------------------------------------------------------

    #[inline(never)]
    fn guard(&mut self, inputs: &Inputs<N>) {
        let expected = self.last_tick.map(|tick| tick.wrapping_add(1));
        self.last_tick = Some(inputs.tick);
        let host_timeout = if self.state.is_on() { self.config.host_timeout_ticks } else { 0 };
        let mut fault = guard::judge_shared(inputs, expected, host_timeout);
        let (on, homing) = (self.state.is_on(), self.axes.iter().any(|axis| axis.homing.is_some()));
        for (number, axis) in self.axes.iter_mut().enumerate() {
            // Every guard runs every tick: they remember.
            let found = axis.guard(number, on, homing);
            if found.is_some() {
                fault = Fault::worse(fault, found);
            }
        }
        if let Some(fault) = fault {
            self.fail(fault);
        }
    }

    fn fail(&mut self, fault: Fault) {
        // The first fault explains; what follows from it does not.
        let first = self.fault.is_none();
        let event = if fault.allows_braking() { Event::ControlledFault } else { Event::CutFault };
        let worse = !fault.allows_braking() && self.state.is_on();
        if first || worse {
            self.fault.get_or_insert(fault);
            _ = self.happen(event);
        }
    }

    // ---- machine -----------------------------------------------------------------------------------------------

    #[inline(never)]
    fn machine(&mut self, tick: u32) {
        match self.state {
            State::Homing => self.home(),
            State::Moving => self.follow_path(tick),
            State::Settling => self.settle(tick),
            State::Stopping => self.halt(tick),
            _ => {}
        }
    }

    // ---- plan --------------------------------------------------------------------------------------------------

    #[inline(never)]
    fn plan(&mut self, tick: u32) -> [Pos; N] {
        for axis in &mut self.axes {
            axis.glide();
        }
        self.path.tick(tick)
    }

    // ---- compensate --------------------------------------------------------------------------------------------

    #[inline(never)]
    fn compensate(&mut self, stage: &[Pos; N]) {
        let following_path = self.state.is_on();
        for (axis, &place) in self.axes.iter_mut().zip(stage) {
            if following_path && axis.homing.is_none() {
                axis.follow(place);
            }
        }
    }

    // ---- servo -------------------------------------------------------------------------------------------------

    #[inline(never)]
    fn servo(&mut self) -> [i64; N] {
        let mut speeds = [0; N];
        for (speed, axis) in speeds.iter_mut().zip(&mut self.axes) {
            if self.state.is_on() {
                *speed = axis.servo.tick(axis.set_point, axis.sense.now.position, &axis.config.servo);
            } else {
                axis.servo.reset();
            }
        }
        speeds
    }

    // ---- drive -------------------------------------------------------------------------------------------------

    #[inline(never)]
    fn drive(&mut self, speeds: &[i64; N]) -> Outputs<N> {
        let on = self.state.is_on();
        let mut axes = [AxisOutputs::OFF; N];
        for ((output, axis), &speed) in axes.iter_mut().zip(&mut self.axes).zip(speeds) {
            *output = if on { axis.drive.on(speed, &axis.config.drive) } else { axis.drive.off() };
        }
        // Not taken from `OFF`: that would be copied from the flash, byte by byte.
        Outputs { axes, compare: None, trigger: false, key_row: 0, display: 0, lamp: false }
    }

    // ---- publish -----------------------------------------------------------------------------------------------

    #[inline(never)]
    fn publish(&mut self) {
        let places = self.target.iter().zip(self.path.places());
        for ((status, axis), (&target, &set_point)) in
            self.published.iter_mut().zip(&mut self.axes).zip(places)
        {
            axis.publish(status, target, set_point);
        }
        if self.has_heads {
            self.publish_signals();
        }
    }

    /// Once in a block of samples: to tell a grade in numbers takes divisions.
    #[inline(never)]
    fn publish_signals(&mut self) {
        for (status, head) in self.published.iter_mut().zip(&self.heads) {
            if let Some(head) = head.as_ref().filter(|head| head.has_graded()) {
                status.signals = head.report();
            }
        }
    }
}
