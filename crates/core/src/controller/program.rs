//! Programs: segments that wait, wishes of the user, and the spans that a planner hands over.

use super::Controller;
use crate::background::{Asked, PLANNING_TICKS, TurnRequest};
use crate::command::Refusal;
use crate::design::Config;
use crate::machine::{Event, State};
use crate::plan::Limits;
use crate::plan::ring::Ring;
use crate::plan::scan::Scan;
use crate::plan::segment::{Feed, Segment, rounded};
use crate::plan::span::{Batch, has_come};
use crate::units::Pos;

/// Segments that wait for the planner.
pub const QUEUE: usize = 8;

/// A planner that has not answered a stop after so many ticks is not waited for.
const STOP_TICKS: u32 = 3 * PLANNING_TICKS;

/// Longest segment, ticks: half of what a motion of the planner may last.
const LONGEST: f64 = 67_108_864.0;

/// A program as the controller knows it.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Program {
    /// One is being gone through.
    open: bool,
    queue: Ring<Segment, QUEUE>,
    /// The planner has nothing more to say.
    done: bool,
    held: bool,
    percent: u16,
    /// Another one with every wish.
    revision: u32,
    /// A stop was asked for at this tick, and the planner has not yet answered.
    stopping: Option<u32>,
    /// Ticks for which the path has stood and nobody said why.
    idle: u32,
}

impl Default for Program {
    fn default() -> Self {
        Self {
            open: false,
            queue: Ring::default(),
            done: false,
            held: false,
            percent: 100,
            revision: 0,
            stopping: None,
            idle: 0,
        }
    }
}

impl Program {
    fn begin(&mut self) {
        self.close();
        self.open = true;
    }

    /// Feed rate and revision stay. Field by field: the queue is long, and a tick has no time to write all of it.
    pub(super) fn close(&mut self) {
        self.open = false;
        self.queue.clear();
        (self.done, self.held) = (false, false);
        self.stopping = None;
        self.idle = 0;
    }

    pub(super) const fn is_open(&self) -> bool {
        self.open
    }

    fn wish(&mut self) {
        self.revision = self.revision.wrapping_add(1);
    }

    pub(super) const fn is_held(&self) -> bool {
        self.held
    }

    pub(super) const fn percent(&self) -> u16 {
        self.percent
    }

    /// Nothing of it is left, or there is none.
    pub(super) const fn is_over(&self) -> bool {
        !self.open || (self.done && !self.held && self.queue.is_empty())
    }
}

impl Controller<2> {
    /// A [new](Self::new) controller for which a [`Planner`](crate::background::Planner) plans, or whose run, recorded with
    /// one, is repeated: it takes programs, and another target while it moves. Without one they end in
    /// [`Fault::PlanMissing`](crate::publish::Fault::PlanMissing).
    pub fn with_planner(config: Config<2>) -> Self {
        let mut controller = Self::new(config);
        controller.has_planner = true;
        controller
    }
}

impl<const N: usize> Controller<N> {
    /// What is asked of the program that is being gone through, if one is; see [`crate::background::Planner`].
    pub fn program(&self) -> Option<Asked<N>> {
        let driven = matches!(self.state, State::Moving | State::Stopping);
        (self.program.open && driven).then(|| Asked {
            number: self.move_number,
            now: self.last_tick.unwrap_or(0),
            at: self.path.set_point(),
            revision: self.program.revision,
            rest: self.program.held || self.state == State::Stopping,
            stop: self.state == State::Stopping,
            percent: self.program.percent,
            limits: self.config.axes.map(|axis| axis.limits),
            travel: self.config.axes.map(|axis| [axis.low, axis.high]),
            room: self.path.room(),
        })
    }

    /// A segment that waits for the planner; number 0 is the first.
    pub fn segment(&self, number: usize) -> Option<&Segment> {
        self.program.queue.get(number)
    }

    /// Room for spans.
    pub fn room(&self) -> usize {
        self.path.room()
    }

    /// The move that wants to go elsewhere from where it is going, if one does.
    pub fn wanted_turn(&self) -> Option<TurnRequest<N>> {
        let current = self.current.filter(|current| current.wants_plan && self.state == State::Moving)?;
        if self.path.stands() {
            return None;
        }
        let now = self.last_tick.unwrap_or(0);
        let start = now.wrapping_add(PLANNING_TICKS);
        Some(TurnRequest {
            number: current.report.number,
            going: self.path.going(start, now),
            to: self.target,
            limits: self.config.axes.map(|axis| axis.limits),
            travel: self.config.axes.map(|axis| [axis.low, axis.high]),
            start,
        })
    }

    /// Takes spans of a program or of a turn: between two ticks. False, and nothing is changed, if they come too late or
    /// belong to another move.
    pub fn take_spans(&mut self, batch: &Batch<N>) -> bool {
        let now = self.last_tick.unwrap_or(0);
        let late = batch.cut.is_some_and(|cut| has_come(cut, now))
            || batch.spans.get(0).is_some_and(|span| has_come(span.first, now));
        // What stops is a program, on its path; a turn is not waited for.
        let wanted = self.state == State::Moving || (self.state == State::Stopping && self.program.open);
        if late || batch.number != self.move_number || !wanted || !self.path.takes_spans() {
            return false;
        }
        if let Some(cut) = batch.cut {
            self.path.cut(cut);
        }
        for span in batch.spans.iter() {
            _ = self.path.append(*span);
        }
        for _ in 0..batch.took {
            _ = self.program.queue.pop();
        }
        if let Some(current) = self.current.as_mut() {
            current.wants_plan = false;
        }
        self.program.done = batch.done;
        if batch.revision == self.program.revision {
            self.program.stopping = None;
        }
        true
    }

    pub(super) fn go(&mut self, segment: &Segment) -> Result<(), Refusal> {
        if !self.has_planner {
            return Err(Refusal::NoPlanner);
        }
        let goes_on = self.program.open && self.state == State::Moving;
        if !goes_on && self.state != State::Ready {
            return Err(self.refusal());
        }
        self.check_segment(segment)?;
        if !goes_on {
            self.number_move();
            _ = self.happen(Event::Move);
            self.program.begin();
        }
        _ = self.program.queue.push(*segment);
        self.program.done = false;
        for (target, to) in self.target.iter_mut().zip(segment.to) {
            *target = to;
        }
        Ok(())
    }

    fn check_segment(&self, segment: &Segment) -> Result<(), Refusal> {
        if self.program.queue.room() == 0 {
            return Err(if self.program.held { Refusal::QueueHeld } else { Refusal::QueueFull });
        }
        if segment.feed == Feed::default() {
            return Err(Refusal::NoFeed);
        }
        if segment.tolerance < Pos::ZERO {
            return Err(Refusal::Tolerance(segment.tolerance));
        }
        // A stage of one axis has no plane, and one of three goes in its first two.
        let from = self.target.first_chunk().ok_or(Refusal::NoSuchAxis(1))?;
        if let Some(scan) = segment.scan() {
            return self.check_scan(&scan, segment, from);
        }
        self.check_plane(&segment.to)?;
        let curve = segment.curve(*from).ok_or(Refusal::NoCurve)?;
        if curve.length() > curve.limits(&self.plane_limits(), segment.feed.pm()).speed * LONGEST {
            return Err(Refusal::TooLong);
        }
        let mut within = Ok(());
        curve.turning_points(&mut |place| {
            if within.is_ok() {
                within = self.check_plane(&rounded(place));
            }
        });
        within
    }

    fn check_scan(&self, scan: &Scan, segment: &Segment, from: &[Pos; 2]) -> Result<(), Refusal> {
        let plan = scan.plan(&self.plane_limits()).map_err(Refusal::NoScan)?;
        for corner in plan.extent() {
            self.check_plane(&corner)?;
        }
        if plan.start() != *from {
            return Err(Refusal::ScanStart(plan.start()));
        }
        if plan.end() == segment.to { Ok(()) } else { Err(Refusal::NoCurve) }
    }

    fn plane_limits(&self) -> [Limits; 2] {
        let mut limits = [Limits::default(); 2];
        for (limits, axis) in limits.iter_mut().zip(&self.config.axes) {
            *limits = axis.limits;
        }
        limits
    }

    /// A place of x and y, within the travel.
    fn check_plane(&self, at: &[Pos; 2]) -> Result<(), Refusal> {
        let mut to = self.target;
        for (to, at) in to.iter_mut().zip(at) {
            *to = *at;
        }
        self.check_target(&to)
    }

    pub(super) fn hold_program(&mut self, held: bool) -> Result<(), Refusal> {
        if !self.program.open || self.state != State::Moving {
            return Err(Refusal::NoProgram);
        }
        self.program.held = held;
        self.program.wish();
        Ok(())
    }

    pub(super) fn set_feed_rate(&mut self, percent: u16) -> Result<(), Refusal> {
        if !(1..=200).contains(&percent) {
            return Err(Refusal::FeedRate(percent));
        }
        self.program.percent = percent;
        self.program.wish();
        Ok(())
    }

    /// A program that walks is stopped on its path by the planner.
    pub(super) fn stop_program(&mut self) -> bool {
        if self.path.is_holding() {
            // Nothing moves, and nothing that waits shall.
            self.program.close();
        }
        let by_planner = self.program.open && !self.path.is_starved();
        if by_planner && self.program.stopping.is_none() {
            self.program.queue.clear();
            self.program.stopping = self.last_tick;
            self.program.wish();
        }
        by_planner
    }

    /// A planner that has not answered a stop in time is not waited for.
    pub(super) fn stop_without_planner(&mut self, tick: u32) {
        if self.program.stopping.is_some_and(|asked| tick.wrapping_sub(asked) > STOP_TICKS) {
            self.program.stopping = None;
            self.path.brake();
        }
    }

    /// Whether the path of a program stands for so long that its planner must be gone.
    pub(super) fn program_is_lost(&mut self, most: u32) -> bool {
        let program = &mut self.program;
        let idle = program.open && !program.held && !program.done && self.path.is_holding();
        program.idle = if idle { program.idle.saturating_add(1) } else { 0 };
        program.idle > most
    }
}
