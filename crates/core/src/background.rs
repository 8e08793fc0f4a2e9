//! Slower than a tick: planning, and the fits of the encoders' signals. Floats are allowed here (+ − × ÷ √ and `libm`).
//!
//! A result takes effect at a tick it names, so that a recorded run does not depend on how fast planning was.

mod planner;

use crate::controller::Controller;
use crate::plan::path::Going;
use crate::plan::span::Batch;
use crate::plan::{Limits, LinePlan};
use crate::sense::head::Head;
use crate::units::Pos;

pub use planner::Planner;

/// Ticks from a request to the first set-point of its path: what a board needs for planning.
pub const PLANNING_TICKS: u32 = 20;

/// A move whose plan has not come after so many ticks is given up: whoever plans is gone.
pub const PLAN_MISSING_TICKS: u32 = 2000;

/// A move that wants a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveRequest<const N: usize> {
    /// Number of the move.
    pub number: u32,
    /// Where the set-point stands.
    pub from: [Pos; N],
    /// Where it is to go, stage frame.
    pub to: [Pos; N],
    /// Limits of each axis.
    pub limits: [Limits; N],
    /// Tick of the request.
    pub asked_at: u32,
}

/// A move that wants to go elsewhere from where it is going.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnRequest<const N: usize> {
    /// Number of the move.
    pub number: u32,
    /// What the stage will be doing at tick `start`.
    pub going: Going<N>,
    /// Where it is to go, stage frame.
    pub to: [Pos; N],
    /// Limits of each axis.
    pub limits: [Limits; N],
    /// Lowest and highest place of each axis.
    pub travel: [[Pos; 2]; N],
    /// From this tick on.
    pub start: u32,
}

/// What is asked of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked<const N: usize> {
    /// Number of its move.
    pub number: u32,
    /// Number of the last tick.
    pub now: u32,
    /// Where the set-point is.
    pub at: [Pos; N],
    /// Another one with every wish of the user.
    pub revision: u32,
    /// It is to rest.
    pub rest: bool,
    /// It is to stop, and nothing of it is wanted any more.
    pub stop: bool,
    /// Percent of its feeds.
    pub percent: u16,
    /// Limits of each axis.
    pub limits: [Limits; N],
    /// Lowest and highest place of each axis.
    pub travel: [[Pos; 2]; N],
    /// Room for spans.
    pub room: usize,
}

/// Work that was done between two ticks: with this alone a recorded run repeats it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done<const N: usize> {
    /// A plan was handed over.
    Plan {
        /// Number of the move.
        number: u32,
        /// Tick at which its path begins.
        start: u32,
    },
    /// Spans of a program or of a turn were handed over.
    Spans(Batch<N>),
    /// The samples of an analogue encoder went into its correction. They were gathered before, and none while they were
    /// fitted: the tick of the hand-over alone decides what comes of it.
    Refined {
        /// Which axis.
        axis: usize,
    },
}

/// Does a piece of what the controller asks for, and says what; call it between ticks, once or until there is nothing
/// left. Without a memory it plans single moves from rest and fits signals, for a
/// controller that asks for no more; a [`Planner`] does all there is.
pub fn advance<const N: usize>(controller: &mut Controller<N>) -> Option<Done<N>> {
    if let Some(request) = controller.wanted_plan() {
        let start = request.asked_at.wrapping_add(PLANNING_TICKS);
        hand_over(controller, &request, start);
        return Some(Done::Plan { number: request.number, start });
    }
    let axis = controller.wants_refining()?;
    refine(controller, axis);
    Some(Done::Refined { axis })
}

/// Does once more what [`advance`] did. What nobody waits for is left.
pub fn repeat<const N: usize>(controller: &mut Controller<N>, done: &Done<N>) {
    match *done {
        Done::Plan { number, start } => {
            let wanted = controller.wanted_plan().filter(|request| request.number == number);
            if let Some(request) = wanted {
                hand_over(controller, &request, start);
            }
        }
        Done::Refined { axis } => refine(controller, axis),
        Done::Spans(ref batch) => _ = controller.take_spans(batch),
    }
}

/// The fit needs no controller: where ticks do not wait, it is made beside them.
fn refine<const N: usize>(controller: &mut Controller<N>, axis: usize) {
    let refining = controller.head(axis).and_then(Head::refining);
    if let Some(refined) = refining.map(|refining| refining.fit()) {
        controller.take_refined(axis, refined);
    }
}

fn hand_over<const N: usize>(controller: &mut Controller<N>, request: &MoveRequest<N>, start: u32) {
    let plan = LinePlan::new(request.from, request.to, &request.limits);
    controller.take_plan(request.number, plan, start);
}
