//! The steps of a program as a stage goes them: each one a straight motion from rest to rest.

use super::Grid;
use super::pace::{Pace, ticks_of};
use super::walk::Walk;
use crate::preset::Preset;
use crate::program::course::curve;
use abbe_core::plan::Limits;
use abbe_core::plan::segment::{Feed, Segment};
use abbe_proto::gcode::{Action, Move, Place, Rate};

/// What divides the motions of a program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Division {
    grid: Grid,
    pace: Pace,
    limits: [Limits; 2],
    tick_hz: f64,
    /// Part of the feeds, as the controller has it.
    rate: f64,
}

impl Division {
    pub(crate) fn new(preset: &Preset, percent: u16, grid: Grid) -> Self {
        let limits = preset.controller.config.axes.map(|axis| axis.limits);
        let pace = Pace::new(&grid, limits);
        let tick_hz = preset.controller.settings.tick_hz;
        Self { grid, pace, limits, tick_hz, rate: f64::from(percent) / 100.0 }
    }

    /// The segments of an action: one a step. Of motions that were surveyed; another one has none.
    pub(crate) fn segments(&self, action: &Action) -> Box<dyn Iterator<Item = Segment>> {
        match action {
            Action::Move(there) if there.rate == Rate::Rapid => self.rapids([there.from, there.to, there.to]),
            Action::Move(there) => self.steps(there),
            Action::Reference { from, via, to } => self.rapids([*from, *via, *to]),
            Action::Dwell { .. } | Action::Stored(_) => Box::new(std::iter::empty()),
        }
    }

    fn rapids(&self, places: [Place; 3]) -> Box<dyn Iterator<Item = Segment>> {
        let [from, via, to] = places.map(|place| self.grid.place(self.grid.nearest(place)));
        let ways = [(from, via), (via, to)].into_iter().filter(|(from, to)| from != to);
        Box::new(ways.map(|(_, to)| Segment { to, feed: Feed::RAPID, ..Segment::default() }))
    }

    fn steps(&self, there: &Move) -> Box<dyn Iterator<Item = Segment>> {
        let begun = Walk::begin(there, &self.grid, 0.0).ok();
        let Some((begun, curve)) = begun.zip(curve(there)) else { return Box::new(std::iter::empty()) };
        let ticks = ticks_of(there, &curve, &self.limits, self.tick_hz, self.rate);
        let each = ticks / begun.walk.clone().count().max(1) as f64;
        // Steps begin at ticks: some are a tick longer, so that all together keep to the feed. The controller takes its part of it.
        let feeds = [each.floor(), each.floor() + 1.0]
            .map(|ticks| self.pace.feeds(ticks).map(|feed| Feed::from_pm(feed.pm() / self.rate)));
        let (grid, mut walk, mut done) = (self.grid, begun.walk, 0.0);
        Box::new(std::iter::from_fn(move || {
            let step = walk.next()?;
            let to = grid.place(walk.at());
            let begins = |number: f64| (number * each).floor();
            let is_longer = begins(done + 1.0) - begins(done) > each.floor();
            done += 1.0;
            Some(Segment { to, feed: feeds[usize::from(is_longer)][step.axis.index()], ..Segment::default() })
        }))
    }
}
