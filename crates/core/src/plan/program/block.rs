//! A segment that was asked for, and the corner at its end.

use super::super::corner::Corner;
use super::super::curve::{Curve, Place};
use super::super::overlap::Overlap;
use super::super::profile::Limits;
use super::super::scan::{Scan, ScanPlan};
use super::super::segment::place;
use super::line::{Line, ROUNDED, worth_it};

/// A segment of a program's path.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Block {
    pub(super) curve: Curve,
    /// What was asked for, pm a tick.
    feed: f64,
    /// Of the corner at its end, pm.
    tolerance: f64,
    /// Along the curve.
    pub(super) limits: Limits,
    /// How the corner at its end can be passed at most; at rest where no line follows.
    pub(super) corner: Corner,
    /// How the lines are laid over each other where the corner is not passed at speed.
    pub(super) overlap: Option<Overlap>,
    /// How fast its corner can be passed whatever the feed, pm a tick.
    pub(super) cap: f64,
    /// The speed of the corner by what is known now, and by the last that a motion was decided on: from there to the end of
    /// what was known then each can be reached. More that is known may ask for less: a faster corner takes more of its lines.
    pub(super) ahead: f64,
    pub(super) promised: f64,
    /// It is a scan, and no curve.
    pub(super) scan: Option<Scan>,
}

impl Block {
    /// None if the feed is not above zero, or a limit no number.
    pub(super) fn new(
        curve: Curve,
        feed: f64,
        tolerance: f64,
        axes: &[Limits; 2],
        rate: f64,
    ) -> Option<Self> {
        let mut block = Self { curve, feed, tolerance, ..Self::default() };
        block.limit(axes, rate);
        let numbers = axes.iter().chain([&block.limits]).all(Limits::are_numbers);
        (numbers && tolerance >= 0.0).then_some(block)
    }

    /// A scan: the curve leads straight to its end.
    pub(super) fn scan(scan: Scan, plan: &ScanPlan) -> Self {
        let curve = Curve::Line { from: place(plan.start()), to: place(plan.end()) };
        Self { curve, scan: Some(scan), ..Self::default() }
    }

    /// Takes another part of the feed: of a rapid, of what the axes can go.
    pub(super) fn limit(&mut self, axes: &[Limits; 2], rate: f64) {
        if self.scan.is_some() {
            return;
        }
        let top = if self.feed.is_finite() { self.feed } else { self.curve.limits(axes, f64::MAX).speed };
        self.limits = self.curve.limits(axes, top * rate);
    }

    /// Finds how the corner to the next can be passed.
    pub(super) fn meet(&mut self, next: &Self, axes: &[Limits; 2]) {
        (self.corner, self.cap, self.overlap) = (Corner::default(), 0.0, None);
        let (Curve::Line { from, to: at }, Curve::Line { to, .. }) = (self.curve, next.curve) else { return };
        if self.tolerance > 0.0 && next.scan.is_none() {
            let lines = [self.line(), next.line()];
            // A little less than half, or two corners that meet leave a way that rounding makes less than none.
            let room = (1.0 - ROUNDED) * lines[0].length.min(lines[1].length) / 2.0;
            let feed = self.limits.speed.min(next.limits.speed);
            let places = [from, at, to];
            let fastest = Corner::fastest(places, axes, feed, self.tolerance, room);
            self.cap = Corner::fastest(places, axes, f64::MAX, self.tolerance, room).speed;
            let ends = [(lines[0].length, &lines[0].limits), (lines[1].length, &lines[1].limits)];
            self.overlap = Overlap::longest(places, axes, ends, self.tolerance);
            let saved = self.overlap.map_or(0.0, |overlap| overlap.ticks());
            self.corner = worth_it(fastest, &lines, saved);
        }
    }

    /// How far and how fast.
    pub(super) fn line(&self) -> Line {
        Line { length: self.curve.length(), limits: self.limits }
    }

    /// Where it ends, to a picometre.
    pub(super) fn end(&self) -> Place {
        super::whole(self.curve.spot(self.curve.length()).at)
    }
}
