//! Programs of lines, arcs and sines with cut corners, held, resumed and told other feeds at any time.

use super::bytes::Bytes;
use super::walk::{LONGEST, assert_within};
use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::{Curve, Place};
use abbe_core::plan::program::Program;
use abbe_core::plan::segment::{Feed, Segment, Shape};
use abbe_core::plan::span::{Span, Until};
use abbe_core::plan::steps::Walker;
use abbe_core::plan::transfer::Infeasible;
use std::collections::VecDeque;

/// Most segments of a program.
const SEGMENTS: u8 = 24;
/// Near the wrap of the ticks.
const BEGINS: u32 = u32::MAX - 2000;

pub(crate) fn walked(bytes: &mut Bytes) {
    let axes = [(); 2].map(|()| bytes.limits(1.0));
    let feed = 2e6 * bytes.decades(-4.0, 1.0);
    let tolerance = if bytes.byte().is_multiple_of(4) { 0.0 } else { bytes.decades(0.0, 9.0) };
    let (from, chain) = chain(bytes);
    let curves = curves(from, &chain);
    let case = || format!("{from:?} {chain:?} {axes:?} {feed} {tolerance}");
    let mut tick = Tick::new(from, axes);
    for segment in &chain {
        let tolerance = Pos::from_pm(tolerance as i64);
        let segment = Segment { feed: Feed::from_pm(feed), tolerance, ..*segment };
        match tick.program.take(&segment) {
            Ok(()) => {}
            // Slower than a feed can tell.
            Err(_) => return assert!(segment.feed == Feed::default(), "{}", case()),
        }
    }
    while tick.places.len() < LONGEST as usize && !tick.is_over() {
        let wish = bytes.byte();
        match wish % 4 {
            _ if !tick.program.can_change() => {}
            0 if tick.program.is_held() => tick.program.go_on(),
            0 => tick.wish(|program, start| program.rest(start)),
            1 => {
                let rate = bytes.decades(-1.0, 0.3);
                tick.wish(|program, start| program.set_rate(rate, start));
            }
            _ => {}
        }
        for _ in 0..u32::from(bytes.byte()) * 4 + 1 {
            if tick.tick().is_err() {
                // The only reason that such numbers leave: it takes longer than what fits.
                return assert!(longest(&curves, &axes, feed) > 1e7, "{}", case());
            }
        }
        // Behind the last byte it comes to its end, if it does so soon.
        if wish == 0 && tick.program.is_held() {
            tick.program.go_on();
        }
    }
    assert_within(&tick.places, &axes, case);
    if tick.is_over() {
        let end = tick.places.last().map(|place| pm(*place));
        assert_eq!(end, chain.last().map(|last| last.to), "{}", case());
    }
    let step = if curves.iter().all(|curve| curve.bend().is_none()) { 7 } else { 1 + tick.places.len() / 40 };
    for place in tick.places.iter().step_by(step) {
        let off = curves.iter().map(|curve| beside(curve, *place)).fold(f64::INFINITY, f64::min);
        assert!(off <= tolerance + 12.0, "{off} pm beside {}", case());
    }
}

/// A tick that walks what a program gives it.
struct Tick {
    program: Program,
    now: u32,
    spans: VecDeque<Span<2>>,
    walkers: [Walker; 2],
    until: Until,
    places: Vec<Place>,
}

impl Tick {
    fn new(from: Place, axes: [Limits; 2]) -> Self {
        let program = Program::new(pm(from), axes, 1.0, BEGINS.wrapping_add(3));
        let (spans, walkers) = (VecDeque::new(), [Walker::default(); 2]);
        Self { program, now: BEGINS, spans, walkers, until: Until::Rest, places: vec![from] }
    }

    fn wish(&mut self, ask: impl FnOnce(&mut Program, u32) -> Option<u32>) {
        if let Some(cut) = ask(&mut self.program, self.now.wrapping_add(20)) {
            assert!(cut.wrapping_sub(self.now).cast_signed() > 0, "cut in the past");
            self.spans.retain(|span| span.first.wrapping_sub(cut).cast_signed() < 0);
        }
    }

    fn tick(&mut self) -> Result<(), Infeasible> {
        while self.spans.len() < 8
            && let Some(span) = self.program.span(self.now)?
        {
            assert!(span.first.wrapping_sub(self.now).cast_signed() > 0, "a span in the past");
            self.spans.push_back(span);
        }
        self.now = self.now.wrapping_add(1);
        if let Some(span) = self.spans.front().filter(|span| span.first == self.now) {
            self.walkers
                .iter_mut()
                .zip(span.legs.iter().flatten())
                .for_each(|(walker, leg)| walker.begin(leg));
            self.until = span.until;
            self.spans.pop_front();
        } else if let Until::Tick(until) = self.until {
            assert_ne!(until, self.now, "nothing comes after");
            self.walkers.iter_mut().for_each(Walker::step);
        } else {
            self.places.extend(self.places.last().copied());
            return Ok(());
        }
        self.places.push(self.walkers.map(|walker| walker.position().pm() as f64));
        Ok(())
    }

    fn is_over(&self) -> bool {
        self.program.is_done() && self.spans.is_empty() && self.until == Until::Rest
    }
}

fn pm(place: Place) -> [Pos; 2] {
    place.map(|at| Pos::from_pm(at as i64))
}

/// Segments to places in whole picometres: far ones, near ones, some twice, straight on, and back; arcs that go on as the
/// last step and arcs that do not, and sines.
fn chain(bytes: &mut Bytes) -> (Place, Vec<Segment>) {
    let from = bytes.place();
    let (mut at, mut step, mut chain) = (from, [0.0; 2], Vec::new());
    for _ in 0..=bytes.byte() % SEGMENTS {
        let (kind, last) = (bytes.byte(), step);
        step = match kind % 8 {
            0 => [0.0; 2],
            1 => step.map(|part| -part),
            2 => step,
            3 => [step[1], -step[0]],
            4 => [step[0], step[1] + bytes.length(6.0)],
            _ => [(); 2].map(|()| bytes.length(10.5)),
        };
        let segment = match kind / 8 % 4 {
            2 => arc(at, last, bytes),
            3 => sine(at, step, bytes),
            _ => None,
        };
        let line = || Segment { to: pm(plus(at, step)), ..Segment::default() };
        let segment = segment.filter(|segment| segment.curve(pm(at)).is_some()).unwrap_or_else(line);
        let to = segment.to.map(|at| at.pm() as f64);
        // Of an arc it is the direction of its end.
        step = if let Shape::Arc { centre, counterclockwise } = segment.shape {
            let [x, y] = [0, 1].map(|axis| to[axis] - centre[axis].pm() as f64);
            if counterclockwise { [-y, x] } else { [y, -x] }
        } else {
            plus(to, at.map(|at| -at))
        };
        at = to;
        chain.push(segment);
    }
    (from, chain)
}

fn plus(at: Place, step: Place) -> Place {
    [0, 1].map(|axis| (at[axis] + step[axis]).round())
}

/// From a place in the direction of a step: with its length for a radius, or another.
fn arc(at: Place, [x, y]: Place, bytes: &mut Bytes) -> Option<Segment> {
    let (kind, length) = (bytes.byte(), x.hypot(y));
    let radius = if kind.is_multiple_of(2) { length } else { bytes.decades(4.0, 10.0) };
    let counterclockwise = kind / 2 % 2 == 0;
    let turn = if counterclockwise { 1.0 } else { -1.0 };
    let across = [-y * radius / length * turn, x * radius / length * turn];
    let centre = plus(at, across);
    let (sin, cos) = (turn * 6.28 * bytes.part()).sin_cos();
    let out = [0, 1].map(|axis| at[axis] - centre[axis]);
    let to = match kind / 4 % 3 {
        0 => at,
        1 => [centre[0] - turn * out[1], centre[1] + turn * out[0]],
        _ => plus(centre, [cos * out[0] - sin * out[1], sin * out[0] + cos * out[1]]),
    };
    let shape = Shape::Arc { centre: pm(centre), counterclockwise };
    (length > 0.0).then_some(Segment { shape, to: pm(to), ..Segment::default() })
}

fn sine(at: Place, step: Place, bytes: &mut Bytes) -> Option<Segment> {
    let amplitude = step[0].hypot(step[1]) * 0.2 * bytes.part();
    let kind = bytes.byte();
    let (periods, phase) = (u32::from(kind % 3) + 1, i64::from(kind / 3 % 4) * 90_000_000_000);
    let shape = Shape::Sine { amplitude: Pos::from_pm(amplitude as i64), periods, phase };
    Some(Segment { shape, to: pm(plus(at, step)), ..Segment::default() })
}

fn curves(from: Place, chain: &[Segment]) -> Vec<Curve> {
    let mut at = pm(from);
    let of = |segment: &Segment| {
        let curve = segment.curve(at);
        at = segment.to;
        curve
    };
    chain.iter().filter_map(of).collect()
}

/// What it takes at most, with a stop in each corner and a tenth of the feed.
fn longest(curves: &[Curve], axes: &[Limits; 2], feed: f64) -> f64 {
    curves.iter().map(|curve| 10.0 * curve.length() / curve.limits(axes, feed).speed).sum::<f64>()
}

/// From a place to the nearest of a curve, pm; of a bent one by samples and a search about each that is nearer than its
/// neighbours.
fn beside(curve: &Curve, [x, y]: Place) -> f64 {
    let off = |way: f64| {
        let [px, py] = curve.spot(way).at;
        (px - x).hypot(py - y)
    };
    let length = curve.length();
    if let Curve::Line { from, to } = curve {
        let along = (x - from[0]) * (to[0] - from[0]) + (y - from[1]) * (to[1] - from[1]);
        return off((along / length.max(1.0)).clamp(0.0, length));
    }
    let part = length / 48.0;
    let samples: Vec<f64> = (0..=48).map(|k| off(f64::from(k) * part)).collect();
    let sample = |k: usize| samples.get(k).copied().unwrap_or(f64::INFINITY);
    let nearest = (0..samples.len())
        .filter(|k| sample(*k) <= sample(k.wrapping_sub(1)) && sample(*k) <= sample(k + 1))
        .map(|k| {
            let at = k as f64 * part;
            let (mut low, mut high) = ((at - part).max(0.0), (at + part).min(length));
            for _ in 0..60 {
                let third = (high - low) / 3.0;
                if off(low + third) < off(high - third) { high -= third } else { low += third }
            }
            off(f64::midpoint(low, high))
        });
    nearest.fold(f64::INFINITY, f64::min)
}
