//! Slower than a tick: planning. Floats are allowed here (+ − × ÷ √ and `libm`).
//!
//! A result takes effect at a tick it names, so that a recorded run does not depend on how fast planning was.

use crate::controller::Controller;
use crate::plan::{Limits, LinePlan};
use crate::units::Pos;

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

/// Plans whatever the controller asks for; call it between ticks.
pub fn advance<const N: usize>(controller: &mut Controller<N>) {
    if let Some(request) = controller.wanted_plan() {
        let plan = LinePlan::new(request.from, request.to, &request.limits);
        controller.take_plan(request.number, plan, request.asked_at.wrapping_add(PLANNING_TICKS));
    }
}
