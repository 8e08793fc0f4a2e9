//! Programs of lines with cut corners, held, resumed and told other feeds at any time.

use super::bytes::Bytes;
use super::walk::{LONGEST, assert_within};
use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::Place;
use abbe_core::plan::program::Program;
use abbe_core::plan::segment::{Feed, Segment};
use abbe_core::plan::span::{Span, Until};
use abbe_core::plan::steps::Walker;
use abbe_core::plan::transfer::Infeasible;
use std::collections::VecDeque;

/// Most lines of a program.
const LINES: u8 = 24;
/// Near the wrap of the ticks.
const BEGINS: u32 = u32::MAX - 2000;

pub(crate) fn walked(bytes: &mut Bytes) {
    let axes = [(); 2].map(|()| bytes.limits(1.0));
    let feed = 2e6 * bytes.decades(-4.0, 1.0);
    let tolerance = if bytes.byte().is_multiple_of(4) { 0.0 } else { bytes.decades(0.0, 9.0) };
    let places = chain(bytes);
    let case = || format!("{places:?} {axes:?} {feed} {tolerance}");
    let mut tick = Tick::new(places[0], axes);
    for to in &places[1..] {
        let tolerance = Pos::from_pm(tolerance as i64);
        let segment = Segment { to: pm(*to), feed: Feed::from_pm(feed), tolerance, ..Segment::default() };
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
                return assert!(longest(&places, &axes, feed) > 1e7, "{}", case());
            }
        }
        // Behind the last byte it comes to its end, if it does so soon.
        if wish == 0 && tick.program.is_held() {
            tick.program.go_on();
        }
    }
    assert_within(&tick.places, &axes, case);
    if tick.is_over() {
        assert_eq!(tick.places.last(), places.last(), "{}", case());
    }
    for place in tick.places.iter().step_by(7) {
        let off = beside(&places, *place);
        assert!(off <= tolerance + 2.0, "{off} pm beside {}", case());
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
            self.walkers.iter_mut().zip(span.legs.iter().flatten()).for_each(|(walker, leg)| walker.begin(leg));
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

/// Places in whole picometres: far ones, near ones, some twice, straight on, and back.
fn chain(bytes: &mut Bytes) -> Vec<Place> {
    let mut at = bytes.place();
    let mut places = vec![at];
    let mut step = [0.0; 2];
    for _ in 0..=bytes.byte() % LINES {
        step = match bytes.byte() % 8 {
            0 => [0.0; 2],
            1 => step.map(|part| -part),
            2 => step,
            3 => [step[1], -step[0]],
            4 => [step[0], step[1] + bytes.length(6.0)],
            _ => [(); 2].map(|()| bytes.length(10.5)),
        };
        at = [0, 1].map(|axis| (at[axis] + step[axis]).round());
        places.push(at);
    }
    places
}

/// What it takes at most, with a stop in each corner and a tenth of the feed.
fn longest(places: &[Place], axes: &[Limits; 2], feed: f64) -> f64 {
    let speed = axes.iter().fold(feed / 10.0, |speed, axis| speed.min(axis.speed / 10.0));
    places.windows(2).map(|ends| (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1])).sum::<f64>() / speed
}

/// From a place to the nearest of the lines, pm.
fn beside(places: &[Place], [x, y]: Place) -> f64 {
    let of = |ends: &[Place]| {
        let [dx, dy] = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        let squared = dx * dx + dy * dy;
        let part = ((x - ends[0][0]) * dx + (y - ends[0][1]) * dy) / squared.max(1.0);
        let part = part.clamp(0.0, 1.0);
        (x - ends[0][0] - part * dx).hypot(y - ends[0][1] - part * dy)
    };
    places.windows(2).map(of).fold(f64::INFINITY, f64::min)
}
