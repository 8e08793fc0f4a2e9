//! How long a turn takes, and how long it would if the stage stopped for it.

use super::plan::Planned;
use abbe_core::plan::Limits;
use abbe_core::plan::scan::Order;
use abbe_core::plan::transfer::{State, Transfer};

/// From a line's leaving the area to the next one's entering it, ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    pub(crate) ticks: f64,
    /// The same with a stop behind the area, a step to the next line (and the way back), and a new run-up; without a wait for
    /// the stage to be measured there.
    pub(crate) stop_and_go: f64,
}

impl Turn {
    /// None if there is but one line.
    pub(crate) fn of(planned: &Planned) -> Option<Self> {
        let [first, second] = [planned.plan.line(0)?, planned.plan.line(1)?];
        let across = second.from[planned.slow()] - first.from[planned.slow()];
        Some(Self {
            ticks: f64::from(second.enters) - first.leaves,
            stop_and_go: stop_and_go(planned, across.pm().abs_diff(0) as f64)?,
        })
    }
}

fn stop_and_go(planned: &Planned, across: f64) -> Option<f64> {
    let [fast, slow] = [planned.fast(), planned.slow()].map(|axis| planned.limits[axis]);
    let (speed, settle) = (planned.scan.speed, f64::from(planned.scan.settle));
    let rest = State::default();
    let stop = Transfer::stop(State { speed, ..rest }, &fast).ok()?;
    let run_up = Transfer::to_speed(rest, speed, &fast).ok()?;
    // From where it stops to where the next run-up begins.
    let back = match planned.scan.order {
        Order::Serpentine => settle * speed + run_up.end().position - stop.end().position,
        Order::FlyBack => {
            settle * speed + run_up.end().position + stop.end().position + planned.length().pm() as f64
        }
    };
    let between = from_rest_to_rest(back.abs(), &fast)?.max(from_rest_to_rest(across, &slow)?);
    Some(stop.ticks() + between + run_up.ticks() + settle)
}

fn from_rest_to_rest(way: f64, limits: &Limits) -> Option<f64> {
    // Less than a picometre is what was rounded.
    if way < 1.0 {
        return Some(0.0);
    }
    let to = State { position: way, ..State::default() };
    Transfer::fastest(State::default(), to, limits).ok().map(|step| step.ticks())
}
