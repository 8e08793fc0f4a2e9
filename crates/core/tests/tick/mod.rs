//! A tick that walks a program.

#![allow(dead_code, reason = "not every test uses all of it")]

use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::Place;
use abbe_core::plan::program::Program;
use abbe_core::plan::segment::{Feed, Segment};
use abbe_core::plan::span::{Span, Until};
use abbe_core::plan::steps::Walker;
use std::collections::VecDeque;

/// Far from zero, so that numbers wrap.
const BEGINS: u32 = u32::MAX - 1000;

/// A tick that walks what a program gives it.
pub(crate) struct Tick {
    pub(crate) program: Program,
    pub(crate) now: u32,
    spans: VecDeque<Span<2>>,
    walkers: [Walker; 2],
    /// Up to which tick what is walked holds.
    until: Option<u32>,
    pub(crate) places: Vec<Place>,
}

impl Tick {
    pub(crate) fn new(from: [Pos; 2], axes: [Limits; 2]) -> Self {
        let places = vec![from.map(|at| at.pm() as f64)];
        Self {
            program: Program::new(from, axes, 1.0, BEGINS.wrapping_add(3)),
            now: BEGINS,
            spans: VecDeque::new(),
            walkers: [Walker::default(); 2],
            until: None,
            places,
        }
    }

    fn plan(&mut self) {
        while self.spans.len() < 12 {
            match self.program.span(self.now).expect("it can be planned") {
                Some(span) => self.spans.push_back(span),
                None => break,
            }
        }
    }

    pub(crate) fn cut(&mut self, cut: Option<u32>) {
        if let Some(cut) = cut {
            assert!(cut.wrapping_sub(self.now).cast_signed() > 0);
            self.spans.retain(|span| span.first.wrapping_sub(cut).cast_signed() < 0);
        }
    }

    pub(crate) fn tick(&mut self) {
        self.plan();
        self.now = self.now.wrapping_add(1);
        if let Some(span) = self.spans.front().filter(|span| span.first == self.now) {
            for (walker, leg) in self.walkers.iter_mut().zip(span.legs) {
                walker.begin(&leg.expect("a program moves both"));
            }
            self.until = if let Until::Tick(until) = span.until { Some(until) } else { None };
            self.spans.pop_front();
        } else if self.until.is_some() {
            assert_ne!(self.until, Some(self.now), "nothing comes after {}", self.places.len());
            self.walkers.iter_mut().for_each(Walker::step);
        } else {
            let last = *self.places.last().expect("it began");
            self.places.push(last);
            return;
        }
        self.places.push(self.walkers.map(|walker| walker.position().pm() as f64));
    }

    /// Until it stands.
    pub(crate) fn settle(&mut self) {
        for _ in 0..300_000 {
            if self.stands() {
                return;
            }
            self.tick();
        }
        panic!("still on its way: {:?} {:?}", self.places.last(), self.program);
    }

    pub(crate) fn stands(&self) -> bool {
        self.until.is_none() && self.spans.is_empty()
    }

    /// Until there is room for another segment.
    pub(crate) fn make_room(&mut self) {
        for _ in 0..300_000 {
            if self.program.has_room() {
                return;
            }
            self.tick();
        }
        panic!("no room: {:?}", self.program);
    }

    /// To the end of all that is known.
    pub(crate) fn finish(&mut self) {
        for _ in 0..3_000_000 {
            self.plan();
            if self.program.is_done() && self.stands() {
                (0..5).for_each(|_| self.tick());
                return;
            }
            self.tick();
        }
        panic!("still on its way");
    }
}

pub(crate) fn pm(place: Place) -> [Pos; 2] {
    place.map(|at| Pos::from_pm(at as i64))
}

pub(crate) fn line(to: Place, feed: f64, tolerance: f64) -> Segment {
    Segment {
        to: pm(to),
        feed: Feed::from_pm(feed),
        tolerance: Pos::from_pm(tolerance as i64),
        ..Segment::default()
    }
}
