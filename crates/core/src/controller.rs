//! The controller: N axes and one coordinator, one function a tick.

use crate::background::{MoveRequest, PLAN_MISSING_TICKS};
use crate::command::{Accepted, Command, Refusal};
use crate::compensate::ErrorMap;
use crate::design::{AxisConfig, Config, GLIDE_BITS};
use crate::drive::Drive;
use crate::edge::{AxisInputs, AxisOutputs, Inputs, Outputs};
use crate::guard::{self, Guard, Watch};
use crate::machine::homing::Homing;
use crate::machine::{Event, State, Stop, transition};
use crate::plan::{LinePlan, Path, Ramp};
use crate::publish::{AxisStatus, Fault, HomeReport, MoveReport, Outcome, Status};
use crate::sense::Sense;
use crate::sense::head::{Head, Refined};
use crate::servo::IncrementalPid;
use crate::units::Pos;
use crate::wide;

/// One axis: sense, guard, compensate, servo, drive.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Axis {
    config: AxisConfig,
    sense: Sense,
    guard: Guard,
    map: Option<ErrorMap>,
    /// Readings at the ends of the travel, margin included.
    travel: [Pos; 2],
    servo: IncrementalPid,
    drive: Drive,
    homing: Option<Homing>,
    glide: Glide,
    /// Set-point of the last tick, scale frame.
    set_point: Pos,
    /// The same in the stage frame, if it was made from there.
    place: Pos,
    homed: bool,
    home: HomeReport,
    /// The side of the zero that counts: see [`Axis::pass_zero`].
    is_below_zero: bool,
    illegal: u32,
    glitches: u32,
}

/// A set-point in the scale frame that moves at a wanted speed, for homing: the zero is not known yet, so there is no
/// stage frame and no path.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Glide {
    ramp: Ramp,
    wanted: i64,
    /// Part of a picometre left over, [`GLIDE_BITS`] fractional bits.
    rest: i64,
}

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
}

impl<const N: usize> Controller<N> {
    /// A controller that has just been switched on: drives off, nothing homed.
    pub fn new(config: Config<N>) -> Self {
        Self {
            config,
            axes: config.axes.each_ref().map(Axis::new),
            state: State::Off,
            fault: None,
            path: Path::holding([Pos::ZERO; N]),
            target: [Pos::ZERO; N],
            current: None,
            last_move: None,
            move_number: 0,
            last_tick: None,
            published: [AxisStatus::default(); N],
            heads: config.axes.map(|axis| axis.sense.head.map(|head| Head::new(&head))),
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
        let outputs = self.drive(&speeds);
        self.publish();
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
        match command {
            Command::Enable => self.request(Event::Enable)?,
            Command::Disable => self.disable(),
            Command::Home => self.request(Event::Home)?,
            Command::MoveTo(to) => self.begin_move(to)?,
            Command::MoveBy(way) => self.begin_move(self.beyond_target(&way))?,
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
            axes: self.published,
        }
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
        if self.state == State::Ready {
            // The table stays; the place where it stands gets its true name.
            self.hold_set_point();
        }
        Ok(())
    }

    /// The move that waits for a plan, if one does; see [`crate::background`].
    ///
    /// Ask between two ticks; [`background::advance`](crate::background::advance) asks, plans and answers in one call. To
    /// plan elsewhere (another core, another thread), take the request, make its [`LinePlan`] and give it to
    /// [`take_plan`](Self::take_plan). Until then the stage holds where it stands, in [`State::Moving`], and can be stopped.
    pub fn wanted_plan(&self) -> Option<MoveRequest<N>> {
        let current = self.current.filter(|current| current.wants_plan && self.state == State::Moving)?;
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
            State::Moving if self.path_ended() => self.end_path(tick),
            State::Moving if self.plan_is_missing(tick) => self.fail(Fault::PlanMissing),
            State::Settling => self.settle(tick),
            State::Stopping => self.halt(),
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
        if transition(self.state, Event::Move).is_none() {
            return Err(self.refusal());
        }
        self.check_target(&to)?;
        _ = self.happen(Event::Move);
        self.target = to;
        self.move_number = self.move_number.wrapping_add(1);
        let number = self.move_number;
        let report = MoveReport { number, outcome: Outcome::Aborted, path_ticks: 0, settle_ticks: 0 };
        let began = self.last_tick.unwrap_or(0);
        self.current =
            Some(CurrentMove { report, began, path_ended: began, inside_since: None, wants_plan: true });
        Ok(())
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

    fn path_ended(&self) -> bool {
        self.path.is_holding() && self.current.as_ref().is_some_and(|current| !current.wants_plan)
    }

    fn plan_is_missing(&self, tick: u32) -> bool {
        self.current.as_ref().is_some_and(|current| {
            current.wants_plan && tick.wrapping_sub(current.began) > PLAN_MISSING_TICKS
        })
    }

    fn end_path(&mut self, tick: u32) {
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

    fn halt(&mut self) {
        let stands = self.path.is_holding() && self.axes.iter().all(|axis| axis.glide.ramp.is_at_rest());
        if !stands {
            return;
        }
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
        self.path.brake();
        for axis in &mut self.axes {
            axis.glide.wanted = 0;
        }
    }

    fn cut(&mut self) {
        self.end_move(Outcome::Aborted);
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

impl Axis {
    fn new(config: &AxisConfig) -> Self {
        Self {
            config: *config,
            sense: Sense::default(),
            guard: Guard::default(),
            map: None,
            travel: [config.low - config.margin, config.high + config.margin],
            servo: IncrementalPid::default(),
            drive: Drive::default(),
            homing: None,
            glide: Glide::default(),
            set_point: Pos::ZERO,
            place: Pos::ZERO,
            homed: false,
            home: HomeReport::default(),
            is_below_zero: false,
            illegal: 0,
            glitches: 0,
        }
    }

    #[cold]
    fn count_disturbances(&mut self, inputs: &AxisInputs) {
        self.illegal = self.illegal.wrapping_add(u32::from(inputs.illegal));
        self.glitches = self.glitches.wrapping_add(u32::from(inputs.glitches));
    }

    fn begin_homing(&mut self, was_on: bool) {
        if !was_on {
            self.set_point = self.sense.now.position;
            self.servo.reset();
        }
        self.homing = Some(Homing::new(&self.sense.now, &self.config.homing));
        self.glide = Glide::default();
    }

    fn guard(&mut self, number: usize, on: bool, homing: bool) -> Option<Fault> {
        let watch = Watch { set_point: self.set_point, travel: &self.travel, on, homing, homed: self.homed };
        let found = self.guard.judge(number, &self.sense.now, &watch, &self.config.guard);
        if found.is_some() || self.sense.now.illegal > 0 {
            self.doubt_the_zero(found, on);
        }
        found.map(|fault| self.in_stage_frame(fault))
    }

    #[cold]
    fn in_stage_frame(&self, fault: Fault) -> Fault {
        match fault {
            Fault::SoftLimit { axis, position } => {
                Fault::SoftLimit { axis, position: self.stage_from_scale(position) }
            }
            fault => fault,
        }
    }

    /// Counts may be missing after an encoder was lost, or when it was disturbed while nobody looked.
    #[cold]
    #[inline(never)]
    fn doubt_the_zero(&mut self, found: Option<Fault>, on: bool) {
        // The signals may have failed in the tick of another fault, and for that tick only.
        let lost = self.sense.now.signal.is_some()
            || matches!(found, Some(Fault::EncoderLost { .. } | Fault::EncoderIllegal { .. }));
        if lost || (!on && self.sense.now.illegal > 0) {
            self.homed = false;
        }
    }

    /// Where the scale reads at the ends of the travel: the guard compares readings.
    fn find_ends(&mut self) {
        let (low, high) = (self.config.low - self.config.margin, self.config.high + self.config.margin);
        self.travel = [low, high].map(|end| self.map.as_ref().map_or(end, |map| map.scale_from_stage(end)));
    }

    fn has_homed(&self) -> bool {
        self.homing.as_ref().is_some_and(Homing::is_done) && self.glide.ramp.is_at_rest()
    }

    fn end_homing(&mut self, head: Option<&Head>) {
        let Some(found) = self.homing.as_ref().and_then(Homing::found) else {
            return;
        };
        self.homing = None;
        let shift = self.sense.set_origin(found.zero, &self.config.sense, head);
        let switch = (found.switch - found.zero).to_pos(self.config.sense.count_pm);
        let again = self.home.count > 0;
        self.home = HomeReport {
            count: self.home.count.saturating_add(1),
            zero_shift: again.then_some(shift),
            switch,
            switch_shift: again.then_some(switch - self.home.switch),
        };
        self.homed = true;
        // The frame moves under the stage: nothing else may.
        self.set_point = self.set_point - shift;
        self.servo.reset();
    }

    fn is_inside(&self) -> bool {
        wide::is_within(self.set_point.way_from(self.sense.now.position), self.config.window.pm())
    }

    fn glide(&mut self) {
        if self.homing.is_none() {
            return;
        }
        let speed = self.glide.ramp.tick(self.glide.wanted, &self.config.glide);
        let way = self.glide.rest.wrapping_add(speed);
        self.set_point = self.set_point + Pos::from_pm(way >> GLIDE_BITS);
        self.glide.rest = way & ((1 << GLIDE_BITS) - 1);
    }

    /// The place of the set-point, which from now on is where the path begins.
    fn hold(&mut self) -> Pos {
        self.place = self.stage_from_scale(self.set_point);
        self.place
    }

    fn stage_from_scale(&self, reading: Pos) -> Pos {
        self.map.as_ref().map_or(reading, |map| map.stage_from_scale(reading))
    }

    /// Puts the set-point where the scale reads when the table is at `place`.
    fn follow(&mut self, place: Pos) {
        // From one tick to the next the reading goes about as far as the table.
        let near = Pos::from_pm(self.set_point.pm().wrapping_add(place.way_from(self.place)));
        self.place = place;
        self.set_point = self.map.as_ref().map_or(place, |map| map.scale_from_stage_near(place, near));
    }

    /// The reading is on the other side of the zero: only a count beyond is it passed, or a stage that stands there would
    /// pass it again and again. Before homing there is no zero to be passed, and homing moves it.
    #[cold]
    fn pass_zero(&mut self, reading: Pos, status: &mut AxisStatus) {
        let known = status.homed && self.homed;
        if known && wide::is_within(reading.pm(), i64::from(self.config.sense.count_pm)) {
            return;
        }
        self.is_below_zero = reading.pm() < 0;
        status.zero_crossings = status.zero_crossings.wrapping_add(u32::from(known));
    }

    fn publish(&mut self, status: &mut AxisStatus, target: Pos, set_point: Pos) {
        let reading = self.sense.now.position;
        let following_error = Pos::from_pm(self.set_point.way_from(reading));
        status.position = self.stage_from_scale(reading);
        status.set_point = set_point;
        status.target = target;
        if (reading.pm() < 0) != self.is_below_zero {
            self.pass_zero(reading, status);
        }
        status.reading = reading;
        status.following_error = following_error;
        status.in_window = self.is_inside();
        status.homed = self.homed;
        status.mapped = self.map.is_some();
        status.limit_low = self.sense.now.limit_low;
        status.limit_high = self.sense.now.limit_high;
        status.illegal = self.illegal;
        status.glitches = self.glitches;
        if status.home.count != self.home.count {
            status.home = self.home;
        }
    }
}
