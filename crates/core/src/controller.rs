//! The controller: N axes and one coordinator, one function a tick.

mod axis;
mod compare;
mod program;

use crate::background::{MoveRequest, PLAN_MISSING_TICKS};
use crate::command::{Accepted, Command, Refusal};
use crate::compensate::ErrorMap;
use crate::design::Config;
use crate::edge::{AxisOutputs, Inputs, Outputs};
use crate::front::compare::{Passage, Sampled};
use crate::guard;
use crate::machine::{Event, State, Stop, transition};
use crate::plan::steps::SetPoint;
use crate::plan::{LinePlan, Path};
use crate::publish::{AxisStatus, Fault, MoveReport, Outcome, Status};
use crate::sense::head::{Head, Refined};
use crate::units::Pos;
use axis::{Axis, Glide};
use program::Program;

pub use program::QUEUE;

/// Where a move stands.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct CurrentMove<const N: usize> {
    report: MoveReport,
    began: u32,
    path_ended: u32,
    /// Since when all axes have been inside their windows.
    inside_since: Option<u32>,
    /// Still wants a plan to these places.
    wants_plan: bool,
}

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

    /// The move from rest that waits for its plan, if one does; see [`crate::background`]. What a planner that remembers
    /// has to do is asked elsewhere: [`program`](Self::program) and [`wanted_turn`](Self::wanted_turn).
    ///
    /// Ask between two ticks; [`background::advance`](crate::background::advance) asks, plans and answers in one call. To
    /// plan elsewhere (another core, another thread), take the request, make its [`LinePlan`] and give it to
    /// [`take_plan`](Self::take_plan). Until then the stage holds where it stands, in [`State::Moving`], and can be stopped.
    pub fn wanted_plan(&self) -> Option<MoveRequest<N>> {
        let current = self.current.filter(|current| current.wants_plan && self.state == State::Moving)?;
        if self.program.is_open() || !self.path.stands() {
            return None;
        }
        Some(MoveRequest {
            number: current.report.number,
            from: self.path.set_point(),
            to: self.target,
            limits: self.config.axes.map(|axis| axis.limits),
            asked_at: current.began,
        })
    }

    /// Hands over the plan of move `number`, to begin at tick `start`.
    ///
    /// `start` is a tick number as in [`Inputs::tick`], by custom `asked_at` plus
    /// [`PLANNING_TICKS`](crate::background::PLANNING_TICKS): a start that is named, not found, keeps a run the same however
    /// long planning took. Be early: a plan whose start has passed begins at once, and so the run differs. The plan must
    /// begin where the request said `from`, or the set-point jumps.
    ///
    /// A plan that nobody waits for any more (the move was stopped, failed, or has its plan) is dropped.
    pub fn take_plan(&mut self, number: u32, plan: LinePlan<N>, start: u32) {
        let moving = self.state == State::Moving;
        let waiting =
            |current: &&mut CurrentMove<N>| moving && current.wants_plan && current.report.number == number;
        if !self.path.stands() || self.program.is_open() {
            return;
        }
        if let Some(current) = self.current.as_mut().filter(waiting) {
            current.wants_plan = false;
            self.path.follow(plan, start);
        }
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

    /// One row of the table, if there is one. Returns whether there was.
    fn happen(&mut self, event: Event) -> bool {
        let Some(row) = transition(self.state, event) else {
            return false;
        };
        let was_on = self.state.is_on();
        match row.stop {
            Stop::None => {}
            Stop::Controlled => self.brake(),
            Stop::Cut => self.cut(),
        }
        self.state = row.to;
        match row.to {
            State::Homing => self.begin_homing(was_on),
            State::Ready if !was_on => self.hold_reading(),
            State::Off => {
                self.fault = None;
                self.doubt_heads();
            }
            _ => {}
        }
        true
    }

    /// A head that cost its axis the zero may have been false until now, when somebody says that it no longer is.
    #[cold]
    fn doubt_heads(&mut self) {
        for (axis, head) in self.axes.iter().zip(&mut self.heads) {
            if let (false, Some(head)) = (axis.homed, head) {
                head.doubt();
            }
        }
    }

    fn request(&mut self, event: Event) -> Result<(), Refusal> {
        if self.happen(event) || (event == Event::Enable && self.state == State::Ready) {
            return Ok(());
        }
        Err(self.refusal())
    }

    fn refusal(&self) -> Refusal {
        match (self.state, self.fault) {
            (State::Off, _) => Refusal::DrivesOff,
            (State::Fault, Some(fault)) => Refusal::InFault(fault),
            (state, _) => Refusal::Busy(state),
        }
    }

    fn disable(&mut self) {
        // Off while braking for a fault is still a fault: it stays explained until the reset.
        let event = if self.fault.is_some() { Event::HaltedInFault } else { Event::Disable };
        _ = self.happen(event);
    }

    fn begin_move(&mut self, to: [Pos; N]) -> Result<(), Refusal> {
        // From where it will be going only a planner that remembers finds another way.
        let cannot_turn = self.state == State::Moving && !self.has_planner;
        if cannot_turn || transition(self.state, Event::Move).is_none() {
            return Err(self.refusal());
        }
        self.check_target(&to)?;
        self.number_move();
        _ = self.happen(Event::Move);
        self.program.close();
        self.target = to;
        Ok(())
    }

    /// Another move begins; the one before, if it has not ended, is replaced.
    fn number_move(&mut self) {
        self.end_move(Outcome::Replaced);
        self.move_number = self.move_number.wrapping_add(1);
        let number = self.move_number;
        let report = MoveReport { number, outcome: Outcome::Aborted, path_ticks: 0, settle_ticks: 0 };
        let began = self.last_tick.unwrap_or(0);
        self.current =
            Some(CurrentMove { report, began, path_ended: began, inside_since: None, wants_plan: true });
    }

    fn check_target(&self, to: &[Pos; N]) -> Result<(), Refusal> {
        for (number, (axis, &asked)) in self.axes.iter().zip(to).enumerate() {
            if !axis.homed {
                return Err(Refusal::NotHomed);
            }
            let (low, high) = (axis.config.low, axis.config.high);
            if asked < low || asked > high {
                return Err(Refusal::OutOfTravel { axis: number, asked, low, high });
            }
        }
        Ok(())
    }

    fn beyond_target(&self, way: &[Pos; N]) -> [Pos; N] {
        let mut to = self.target;
        for (to, &way) in to.iter_mut().zip(way) {
            *to = *to + way;
        }
        to
    }

    fn begin_homing(&mut self, was_on: bool) {
        self.disarm();
        for axis in &mut self.axes {
            axis.begin_homing(was_on);
        }
    }

    fn home(&mut self) {
        let mut failed = None;
        for (number, axis) in self.axes.iter_mut().enumerate() {
            if let Some(homing) = axis.homing.as_mut() {
                match homing.tick(&axis.sense.now, &axis.config.homing) {
                    Ok(speed) => axis.glide.wanted = speed,
                    Err(failure) => failed = failed.or(Some(Fault::Homing { axis: number, failure })),
                }
            }
        }
        if let Some(fault) = failed {
            self.fail(fault);
        } else if let Some(number) = self.axes.iter().position(Axis::has_homed) {
            // One a tick: it is the longest work there is.
            self.end_homing(number);
        } else if self.axes.iter().all(|axis| axis.homing.is_none()) {
            _ = self.happen(Event::Homed);
        }
    }

    fn end_homing(&mut self, number: usize) {
        let axis_and_target = self.axes.get_mut(number).zip(self.target.get_mut(number));
        if let Some((axis, target)) = axis_and_target {
            axis.end_homing(self.heads.get(number).and_then(Option::as_ref));
            *target = axis.hold();
            self.path.hold_axis(number, *target);
        }
    }

    fn follow_path(&mut self, tick: u32) {
        if self.path_ended() {
            self.end_path(tick);
        } else if self.plan_is_missing(tick) {
            self.fail(Fault::PlanMissing);
        }
    }

    fn path_ended(&self) -> bool {
        let planned = self.current.as_ref().is_some_and(|current| !current.wants_plan);
        planned && self.path.is_holding() && self.program.is_over()
    }

    fn plan_is_missing(&mut self, tick: u32) -> bool {
        let lost = self.path.is_starved() || self.program_is_lost(PLAN_MISSING_TICKS);
        lost || self.current.as_ref().is_some_and(|current| {
            current.wants_plan && tick.wrapping_sub(current.began) > PLAN_MISSING_TICKS
        })
    }

    fn end_path(&mut self, tick: u32) {
        self.program.close();
        if let Some(current) = self.current.as_mut() {
            current.path_ended = tick;
            current.report.path_ticks = tick.wrapping_sub(current.began);
        }
        _ = self.happen(Event::PathEnd);
    }

    /// Done means measured: all axes inside their windows for the dwell time.
    fn settle(&mut self, tick: u32) {
        let inside = self.axes.iter().all(Axis::is_inside);
        let Some(current) = self.current.as_mut() else {
            return;
        };
        let since = if inside { Some(current.inside_since.unwrap_or(tick)) } else { None };
        current.inside_since = since;
        let dwelt = since.is_some_and(|since| tick.wrapping_sub(since) >= self.config.dwell_ticks);
        if dwelt {
            current.report.settle_ticks = since.unwrap_or(tick).wrapping_sub(current.path_ended);
            self.end_move(Outcome::Arrived);
            _ = self.happen(Event::InPosition);
        } else if tick.wrapping_sub(current.path_ended) > self.config.settle_timeout_ticks {
            current.report.settle_ticks = tick.wrapping_sub(current.path_ended);
            self.end_move(Outcome::NotArrived);
            _ = self.happen(Event::TimedOut);
        }
    }

    fn halt(&mut self, tick: u32) {
        self.stop_without_planner(tick);
        let stands = self.path.is_holding() && self.axes.iter().all(|axis| axis.glide.ramp.is_at_rest());
        if !stands {
            return;
        }
        self.program.close();
        for axis in &mut self.axes {
            axis.homing = None;
        }
        if self.fault.is_some() {
            _ = self.happen(Event::HaltedInFault);
        } else {
            self.end_move(Outcome::Stopped);
            _ = self.happen(Event::Halted);
            self.hold_reading();
        }
    }

    fn end_move(&mut self, outcome: Outcome) {
        if let Some(current) = self.current.take() {
            self.last_move = Some(MoveReport { outcome, ..current.report });
        }
    }

    fn brake(&mut self) {
        if !self.stop_program() {
            self.path.brake();
        }
        for axis in &mut self.axes {
            axis.glide.wanted = 0;
        }
    }

    fn cut(&mut self) {
        self.end_move(Outcome::Aborted);
        self.program.close();
        for axis in &mut self.axes {
            axis.homing = None;
            axis.glide = Glide::default();
        }
        self.path.hold(self.path.set_point());
    }

    /// Takes the reading for the target, once: after this the target no longer follows the reading.
    fn hold_reading(&mut self) {
        for axis in &mut self.axes {
            axis.set_point = axis.sense.now.position;
            axis.servo.reset();
        }
        self.hold_set_point();
    }

    /// The place of the set-point becomes path and target; the table does not move.
    fn hold_set_point(&mut self) {
        for (target, axis) in self.target.iter_mut().zip(&mut self.axes) {
            *target = axis.hold();
        }
        self.path.hold(self.target);
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
