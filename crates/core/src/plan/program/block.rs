//! A segment that was asked for, and the corner at its end.

use super::super::curve::{Curve, Place};
use super::super::overlap::Overlap;
use super::super::profile::Limits;
use super::super::scan::{Scan, ScanPlan};
use super::super::segment::place;
use super::line::{Line, ROUNDED, worth_it};
use super::passage::Passage;

/// A segment of a program's path.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Block {
    pub(super) curve: Curve,
    /// What was asked for, pm a tick.
    feed: f64,
    /// Of the corner at its end, pm.
    tolerance: f64,
    /// From its path to the end of the travel, pm.
    inside: f64,
    /// Along the curve.
    pub(super) limits: Limits,
    /// The highest speed whatever the feed: the acceleration is that of the first feed. With another one, what was decided
    /// with it would no longer be possible.
    top: f64,
    /// How the corner at its end can be passed at most; at rest where no curve follows.
    pub(super) corner: Passage,
    /// How two lines are laid over each other where the corner is not passed at speed.
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

    /// The same within a travel, pm.
    pub(super) fn within(self, travel: &[[f64; 2]; 2]) -> Self {
        let mut inside = f64::INFINITY;
        let mut see = |at: Place| {
            for (at, [low, high]) in at.into_iter().zip(travel) {
                inside = inside.min(at - low).min(high - at);
            }
        };
        see(self.curve.spot(0.0).at);
        see(self.curve.spot(self.curve.length()).at);
        self.curve.turning_points(&mut see);
        Self { inside: inside.max(0.0), ..self }
    }

    /// By how much the corner to the next may be cut: a corner of lines stays between them, but bent curves may leave the travel.
    fn may_cut(&self, next: &Self) -> f64 {
        if matches!([self.curve, next.curve], [Curve::Line { .. }, Curve::Line { .. }]) {
            self.tolerance
        } else {
            self.tolerance.min(self.inside).min(next.inside)
        }
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
        let swift = self.curve.limits(axes, f64::MAX);
        let feed = if self.feed.is_finite() { self.feed } else { swift.speed };
        let limits = self.curve.limits(axes, feed * rate);
        if self.top == 0.0 {
            // Where a curve is bent, the faster it is gone along the less acceleration is left for that.
            self.top = swift.speed * (swift.acceleration / limits.acceleration).min(1.0);
            self.limits = limits;
        } else {
            self.limits.speed = limits.speed.min(self.top);
        }
    }

    /// Finds how the corner to the next can be passed.
    pub(super) fn meet(&mut self, next: &Self, axes: &[Limits; 2]) {
        (self.corner, self.cap, self.overlap) = (Passage::default(), 0.0, None);
        let tolerance = self.may_cut(next);
        if tolerance == 0.0 || next.scan.is_some() {
            return;
        }
        let lines = [self.line(), next.line()];
        // A little less than half, or two corners that meet leave a way that rounding makes less than none.
        let room = (1.0 - ROUNDED) * lines[0].length.min(lines[1].length) / 2.0;
        let curves = [self.curve, next.curve];
        let fastest = |top| Passage::fastest(curves, axes, top, tolerance, room);
        let rounded = fastest(self.limits.speed.min(next.limits.speed));
        self.cap = fastest(self.top.min(next.top)).speed();
        if let [Curve::Line { from, to: at }, Curve::Line { to, .. }] = curves {
            let ends = [(lines[0].length, &lines[0].limits), (lines[1].length, &lines[1].limits)];
            self.overlap = Overlap::longest([from, at, to], axes, ends, tolerance);
        }
        let saved = self.overlap.map_or(0.0, |overlap| overlap.ticks());
        self.corner = worth_it(rounded, &lines, saved);
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
