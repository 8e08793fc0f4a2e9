//! What needs a memory between two ticks: programs, and moves that go elsewhere while the stage moves.

use super::{Asked, Done, PLANNING_TICKS};
use crate::controller::Controller;
use crate::plan::elsewhere::{Spans, turn};
use crate::plan::program::Program;
use crate::plan::span::{Batch, has_come};
use crate::plan::transfer::Infeasible;

/// Plans whatever a controller of two axes asks for that was made [for it](Controller::with_planner). Programs and turns it hands over in batches, which are all that the
/// controller gets of them: recorded, they repeat the run without a planner.
#[derive(Clone, Debug, Default)]
pub struct Planner {
    /// Of which move.
    number: u32,
    work: Work,
    /// What the controller last heard.
    told: Told,
}

#[allow(clippy::large_enum_variant, reason = "there is no other place for it")]
#[derive(Clone, Debug, Default)]
enum Work {
    #[default]
    Nothing,
    Program(Program),
    /// What of a turn is left to be handed over.
    Turn(Spans<2>),
    /// It could not be planned: the controller will miss it.
    Lost,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Told {
    revision: u32,
    done: bool,
}

impl Planner {
    /// A piece of work, if there is some, and what came of it: call it between two ticks, once or until there is nothing
    /// left.
    pub fn advance(&mut self, controller: &mut Controller<2>) -> Option<Done<2>> {
        let Some(batch) = self.batch(controller) else { return super::advance(controller) };
        if !controller.take_spans(&batch) {
            // It came too late, so the rest of it would be wrong.
            self.work = Work::Lost;
        }
        Some(Done::Spans(batch))
    }

    fn batch(&mut self, controller: &Controller<2>) -> Option<Batch<2>> {
        if let Some(request) = controller.wanted_turn() {
            let planned = turn(&request.going, &request.to, &request.limits, &request.travel, request.start);
            self.number = request.number;
            self.work = planned.map_or(Work::Lost, Work::Turn);
            return self.next_of_turn(controller, Some(request.start));
        }
        if let Work::Turn(_) = self.work {
            return self.next_of_turn(controller, None);
        }
        let Some(asked) = controller.program() else {
            self.work = Work::Nothing;
            return None;
        };
        if self.number != asked.number || matches!(self.work, Work::Nothing) {
            self.begin(&asked);
        }
        let Work::Program(program) = &mut self.work else { return None };
        let batch = next_of_program(program, &asked, controller, self.told);
        let Ok(batch) = batch else {
            self.work = Work::Lost;
            return None;
        };
        self.told = batch.map_or(self.told, |batch| Told { revision: batch.revision, done: batch.done });
        batch
    }

    fn begin(&mut self, asked: &Asked<2>) {
        // The first half is for segments that come one by one, the second for planning.
        let origin = asked.now.wrapping_add(2 * PLANNING_TICKS);
        self.number = asked.number;
        let program = Program::new(asked.at, asked.limits, rate(asked), origin).within(asked.travel);
        self.work = Work::Program(program);
        self.told = Told { revision: asked.revision.wrapping_sub(1), done: false };
    }

    fn next_of_turn(&mut self, controller: &Controller<2>, cut: Option<u32>) -> Option<Batch<2>> {
        let Work::Turn(spans) = &mut self.work else { return None };
        let mut batch = Batch { number: self.number, cut, ..Batch::default() };
        let room = if cut.is_some() { batch.spans.room() } else { controller.room().min(batch.spans.room()) };
        for _ in 0..room {
            _ = spans.pop().map(|span| batch.spans.push(span));
        }
        batch.done = spans.is_empty();
        if batch.done {
            self.work = Work::Nothing;
        }
        (cut.is_some() || !batch.spans.is_empty()).then_some(batch)
    }
}

fn rate(asked: &Asked<2>) -> f64 {
    f64::from(asked.percent) / 100.0
}

fn next_of_program(
    program: &mut Program,
    asked: &Asked<2>,
    controller: &Controller<2>,
    told: Told,
) -> Result<Option<Batch<2>>, Infeasible> {
    if asked.stop && program.is_scanning(asked.now.wrapping_add(PLANNING_TICKS)) {
        // There is no path on which a scan could stop at once: the controller does it without.
        return Ok(None);
    }
    let mut batch = Batch { number: asked.number, revision: asked.revision, ..Batch::default() };
    while let Some(segment) = controller.segment(usize::from(batch.took)).filter(|_| program.has_room()) {
        program.take(segment)?;
        batch.took = batch.took.saturating_add(1);
    }
    if asked.revision != told.revision {
        if program.can_change() {
            batch.cut = change(program, asked);
        } else {
            batch.revision = told.revision;
        }
    }
    for _ in 0..asked.room.min(batch.spans.room()) {
        let Some(span) = program.span(asked.now)? else { break };
        _ = batch.spans.push(span);
    }
    let waits = controller.segment(usize::from(batch.took)).is_some();
    batch.done = program.is_done() && !waits;
    let says = Told { revision: batch.revision, done: batch.done } != told;
    Ok((says || batch.took > 0 || !batch.spans.is_empty()).then_some(batch))
}

/// Does what the user wishes; the tick from which on all is new.
fn change(program: &mut Program, asked: &Asked<2>) -> Option<u32> {
    let start = asked.now.wrapping_add(PLANNING_TICKS);
    let faster = if program.rate() == rate(asked) { None } else { program.set_rate(rate(asked), start) };
    let rest = match (asked.rest, program.is_held()) {
        (true, false) => program.rest(start),
        (false, true) => {
            program.go_on();
            None
        }
        _ => None,
    };
    match (faster, rest) {
        (Some(one), Some(other)) => Some(if has_come(one, other) { one } else { other }),
        (one, other) => one.or(other),
    }
}
