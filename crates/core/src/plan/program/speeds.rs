//! How a block is gone along: from the state it begins with, to the corner at its end.

use super::super::curve::Place;
use super::super::overlap::Overlap;
use super::super::pieces::Along;
use super::super::profile::Limits;
use super::super::root::{Point, root};
use super::super::transfer::{State, Transfer};
use super::Program;
use super::block::Block;
use super::line::Line;
use super::passage::Passage;

/// A motion along a curve never goes back by more than this part of its highest speed: what is rounded.
const ROUNDED: f64 = 1e-6;
/// How often a corner that cannot be reached is tried again, nearer to the one that can.
const TRIES: usize = 10;

/// What was decided of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decided {
    /// One after the other.
    pub(super) runs: [Option<Along>; 2],
    /// At its end.
    pub(super) end: End,
}

impl Decided {
    /// Whether it comes to the end of its block at a speed or slower.
    pub(super) fn is_as_slow_as(&self, speed: f64) -> bool {
        if let End::Round(corner) = self.end { corner.speed() <= speed } else { true }
    }
}

/// What comes at the end of a block.
#[derive(Clone, Copy, Debug)]
pub(super) enum End {
    /// A corner at speed.
    Round(Passage),
    /// A corner in which the next line is laid over it.
    Overlap(Overlap),
    /// A rest at its end.
    Rest(Place),
    /// A rest within it, after a way.
    Within(f64, Place),
}

impl Program {
    /// As fast as all that is known allows.
    pub(super) fn along(&mut self, number: usize, state: State) -> Option<Decided> {
        let corner = self.look_ahead(number, state)?;
        let is_last = number.saturating_add(1) == self.blocks.len();
        let block = self.blocks.get(number)?;
        let overlap = block.overlap.filter(|_| corner.speed() == 0.0 && !is_last);
        overlap
            .and_then(|overlap| block.overlapped(state, overlap))
            .or_else(|| block.run(state, corner))
            .or_else(|| block.run(state, block.corner.at_speed(block.promised)))
            .or_else(|| block.around(state, corner))
            .or_else(|| block.stop(state))
    }

    /// To rest as soon as the path allows: within the block, or around the corner at its end as slowly as can be.
    pub(super) fn slowly(&mut self, number: usize, state: State) -> Option<Decided> {
        if let Some(stop) = self.blocks.get(number)?.stop(state) {
            return Some(stop);
        }
        let corner = self.look_ahead(number, state)?;
        self.blocks.get(number)?.around(state, corner)
    }

    /// The corner at the end of a block: none is faster than the block behind it can slow down from, nor than this one can
    /// speed up to.
    fn look_ahead(&mut self, number: usize, state: State) -> Option<Passage> {
        let (mut corner, mut behind) = (Passage::default(), None::<Line>);
        for number in (number..self.blocks.len()).rev() {
            let block = self.blocks.get_mut(number)?;
            corner = behind.map_or(Passage::default(), |behind| behind.slowed(block.corner, &corner));
            block.ahead = corner.speed();
            behind = Some(block.line());
        }
        // First the acceleration of the state is taken back.
        let line = behind?;
        let jerk = line.limits.jerk;
        let settled = state.settled(jerk);
        Some(line.slowed_for(corner, settled.position, settled.speed))
    }

    /// What was looked ahead for last is what is gone by from now on.
    pub(super) fn promise(&mut self) {
        for number in self.next..self.blocks.len() {
            if let Some(block) = self.blocks.get_mut(number) {
                block.promised = block.ahead;
            }
        }
    }
}

impl Block {
    /// From a state to a corner; None if it cannot be reached without going back.
    fn run(&self, state: State, corner: Passage) -> Option<Decided> {
        let position = self.curve.length() - corner.reach();
        let to = State { position, speed: corner.speed(), acceleration: 0.0 };
        let end = if corner.speed() > 0.0 { End::Round(corner) } else { End::Rest(self.end()) };
        Some(Decided { runs: self.runs(state, to)?, end })
    }

    /// From a state to where the next line is laid over it.
    fn overlapped(&self, state: State, overlap: Overlap) -> Option<Decided> {
        let runs = self.runs(state, overlap.before(self.curve.length()))?;
        Some(Decided { runs, end: End::Overlap(overlap) })
    }

    fn runs(&self, from: State, to: State) -> Option<[Option<Along>; 2]> {
        let motions = self.motions(from, to)?;
        Some(motions.map(|motion| motion.map(|motion| Along::of(self.curve, motion))))
    }

    /// One motion, or down to the highest speed first, where the block before was faster or the feed has changed.
    fn motions(&self, from: State, to: State) -> Option<[Option<Transfer>; 2]> {
        let forward = |from: State, limits: &Limits| {
            Transfer::fastest(from, to, limits)
                .ok()
                .filter(|motion| motion.is_forward(ROUNDED * limits.speed))
        };
        if let Some(motion) = forward(from, &self.limits) {
            return Some([Some(motion), None]);
        }
        let slow = Transfer::to_speed(from, self.limits.speed, &self.limits).ok()?;
        if slow.end().position <= to.position
            && let Some(rest) = forward(slow.end(), &self.limits)
        {
            return Some([Some(slow), Some(rest)]);
        }
        // No way is left for that: as fast as it is.
        let speed = from.speed.max(from.settled(self.limits.jerk).speed).max(self.limits.speed);
        let motion = forward(from, &Limits { speed, ..self.limits })?;
        Some([Some(motion), None])
    }

    /// A rest within the block, if it can be.
    fn stop(&self, state: State) -> Option<Decided> {
        let stop = Transfer::to_speed(state, 0.0, &self.limits).ok()?;
        let at = stop.end().position;
        if at > self.curve.length() || !stop.is_forward(ROUNDED * self.limits.speed) {
            return None;
        }
        let end = End::Within(at, super::whole(self.curve.spot(at).at));
        Some(Decided { runs: [Some(Along::of(self.curve, stop)), None], end })
    }

    /// Around the corner at its end as slowly as the state can; faster than the feed, if that was lowered too late for it.
    fn around(&self, state: State, corner: Passage) -> Option<Decided> {
        let unhurried = self.corner.at_speed(corner.speed().max(self.cap.min(state.speed)));
        self.between(state, corner)
            .or_else(|| self.run(state, self.corner.at_speed(self.promised)))
            .or_else(|| self.between(state, unhurried))
    }

    /// Around the corner at the lowest speed that can be, up to a highest.
    fn between(&self, state: State, fastest: Passage) -> Option<Decided> {
        let mut slowest = self.slowest(state, fastest);
        for _ in 0..TRIES {
            if let Some(decided) = self.run(state, slowest) {
                return Some(decided);
            }
            // Rounded, or the state slows down already, which was not thought of.
            slowest = slowest.at_speed(f64::midpoint(slowest.speed(), fastest.speed()));
        }
        self.run(state, fastest)
    }

    /// The corner at its end at the lowest speed to which the state can slow down.
    fn slowest(&self, state: State, fastest: Passage) -> Passage {
        let line = self.line();
        let settled = state.settled(line.limits.jerk);
        let left = |speed: f64| {
            let corner = fastest.at_speed(speed);
            line.length - corner.reach() - settled.position - line.change(settled.speed, speed)
        };
        let (stopped, passed) = (Point::of(0.0, left), Point::of(fastest.speed(), left));
        if stopped.f < 0.0 && passed.f > 0.0 {
            fastest.at_speed(root(stopped, passed, left))
        } else {
            fastest
        }
    }
}
