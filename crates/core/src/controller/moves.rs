//! Single moves, from the request to the measured arrival.

use super::Controller;
use super::axis::Axis;
use crate::background::{MoveRequest, PLAN_MISSING_TICKS};
use crate::command::Refusal;
use crate::machine::{Event, State, transition};
use crate::plan::LinePlan;
use crate::publish::{Fault, MoveReport, Outcome};
use crate::units::Pos;

/// Where a move stands.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct CurrentMove<const N: usize> {
    pub(super) report: MoveReport,
    pub(super) began: u32,
    path_ended: u32,
    /// Since when all axes have been inside their windows.
    inside_since: Option<u32>,
    /// Still wants a plan to these places.
    pub(super) wants_plan: bool,
}

impl<const N: usize> Controller<N> {
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

    pub(super) fn begin_move(&mut self, to: [Pos; N]) -> Result<(), Refusal> {
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
    pub(super) fn number_move(&mut self) {
        self.end_move(Outcome::Replaced);
        self.move_number = self.move_number.wrapping_add(1);
        let number = self.move_number;
        let report = MoveReport { number, outcome: Outcome::Aborted, path_ticks: 0, settle_ticks: 0 };
        let began = self.last_tick.unwrap_or(0);
        self.current =
            Some(CurrentMove { report, began, path_ended: began, inside_since: None, wants_plan: true });
    }

    pub(super) fn check_target(&self, to: &[Pos; N]) -> Result<(), Refusal> {
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

    pub(super) fn beyond_target(&self, way: &[Pos; N]) -> [Pos; N] {
        let mut to = self.target;
        for (to, &way) in to.iter_mut().zip(way) {
            *to = *to + way;
        }
        to
    }

    pub(super) fn follow_path(&mut self, tick: u32) {
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
    pub(super) fn settle(&mut self, tick: u32) {
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

    pub(super) fn end_move(&mut self, outcome: Outcome) {
        if let Some(current) = self.current.take() {
            self.last_move = Some(MoveReport { outcome, ..current.report });
        }
    }
}
