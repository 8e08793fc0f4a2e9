//! How long a step takes.
//!
//! A step of a stage begins and ends at rest, within its limits, as each pulse of paper A's motors does. The least time of
//! one bounds the feed: no step begins before the last has ended. A program rests at a tick, and sets out at the one behind it,
//! so a step lasts a tick less than the time from one to the next. Not chosen: a constant speed from step to step. Its
//! jumps of speed ask for many times the jerk that the stage is allowed.

use super::Grid;
use crate::program::steps::feed;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::Curve;
use abbe_core::plan::segment::Feed;
use abbe_core::plan::transfer::{State, Transfer};
use abbe_proto::gcode::Move;

/// From the tick of a rest to that in which the next step begins.
const REST: f64 = 1.0;
/// Part of a tick.
const ROUNDED: f64 = 0.01;

/// The steps of a stage.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    limits: [Limits; 2],
    step: f64,
    /// Least ticks of a step of x and of y.
    least: [f64; 2],
}

impl Pace {
    pub(crate) fn new(grid: &Grid, limits: [Limits; 2]) -> Self {
        let step = grid.step().pm() as f64;
        Self { limits, step, least: limits.map(|limits| lasts(step, &limits)) }
    }

    /// The least ticks from step to step, on the slower one of the axes that take steps.
    pub(crate) fn least(&self, steps: [u64; 2]) -> f64 {
        let used = self.least.iter().zip(steps).filter(|(_, steps)| *steps > 0);
        used.map(|(least, _)| least.ceil() + REST).fold(0.0, f64::max)
    }

    /// With this feed a step of x, and one of y, comes so many whole ticks before the next.
    pub(crate) fn feeds(&self, ticks: f64) -> [Feed; 2] {
        // A little sooner, or what is rounded ends it a tick later.
        self.limits.map(|limits| Feed::from_pm(self.speed(&limits, ticks - REST - ROUNDED)))
    }

    /// The slower the longer: between the mean speed of such a step and the limit.
    fn speed(&self, limits: &Limits, ticks: f64) -> f64 {
        let (mut low, mut high) = (self.step / ticks, limits.speed);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            if lasts(self.step, &Limits { speed: middle, ..*limits }) > ticks {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}

/// Ticks of the fastest motion from rest to rest; infinite if there is none.
pub(super) fn lasts(way: f64, limits: &Limits) -> f64 {
    let end = State { position: way, ..State::default() };
    Transfer::fastest(State::default(), end, limits).map_or(f64::INFINITY, |transfer| transfer.ticks())
}

/// How long a motion takes at its feed, ticks, within the speeds of the stage; `rate` is the part of its feed.
pub(crate) fn ticks_of(there: &Move, curve: &Curve, limits: &[Limits; 2], tick_hz: f64, rate: f64) -> f64 {
    let length = curve.length();
    let feed = feed(there.rate, length, tick_hz).pm() * rate;
    length / curve.limits(limits, feed).speed
}
