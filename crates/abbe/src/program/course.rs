//! What a motion is on its way: how far it goes to each side, how long it is, and what each axis takes of its speed.
//!
//! Its beginning is the end of the motion before, and is looked at there.

use super::steps::shape;
use abbe_core::plan::curve::Curve;
use abbe_core::plan::segment::{Segment, rounded};
use abbe_proto::gcode::{Arc, Move, Path, Place, Sine};
use std::f64::consts::TAU;

/// How a motion comes to a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum How {
    /// It ends there.
    Ends,
    /// It passes through it on its way to a reference.
    Passes,
    /// An arc turns back there.
    Bulges,
    /// A sine turns back there.
    Swings,
}

/// A place on a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Point {
    pub(crate) place: Place,
    pub(crate) how: How,
}

/// The lowest and the highest place of a motion, for x and for y; its beginning does not count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach(pub(crate) [[Point; 2]; 2]);

impl Reach {
    /// Of a motion that has turned back nowhere yet.
    pub(super) fn to(end: Place) -> Self {
        Self([[Point { place: end, how: How::Ends }; 2]; 2])
    }

    /// A place where it turns back, or nearly.
    pub(super) fn add(&mut self, point: Point) {
        for (axis, [low, high]) in self.0.iter_mut().enumerate() {
            if point.place[axis] < low.place[axis] {
                *low = point;
            }
            if point.place[axis] > high.place[axis] {
                *high = point;
            }
        }
    }
}

/// What a motion is on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Course {
    pub(crate) reach: Reach,
    /// Along the path, mm.
    pub(crate) length_mm: f64,
    /// The largest part of the speed along the path that x and y have to go, 0 … 1.
    pub(crate) shares: [f64; 2],
}

/// The path of a motion as the controller goes it; none if it takes it for no curve.
pub(crate) fn curve(there: &Move) -> Option<Curve> {
    Segment { shape: shape(&there.path), to: there.to, ..Segment::default() }.curve(there.from)
}

impl Course {
    /// Of a motion along its curve.
    pub(crate) fn of(there: &Move, curve: &Curve) -> Self {
        let mut reach = Reach::to(there.to);
        let mut turns = Vec::new();
        curve.turning_points(&mut |place| turns.push(rounded(place)));
        let how = if matches!(there.path, Path::Arc(_)) { How::Bulges } else { How::Swings };
        for &place in turns.iter().filter(|&&place| place != there.from) {
            reach.add(Point { place, how });
        }
        let shares = match &there.path {
            Path::Line => shares_along(way(there.from, there.to)),
            Path::Arc(arc) => shares_about(arc, turns.into_iter().chain([there.from, there.to])),
            Path::Sine(sine) => shares_of(sine, way(there.from, there.to)),
        };
        Self { reach, length_mm: in_mm(curve.length()), shares }
    }

    /// Straight to a place and from there straight to a reference.
    pub(crate) fn over(from: Place, via: Place, to: Place) -> Self {
        let (first, then) = (line(from, via), line(via, to));
        let mut reach = Reach::to(to);
        // Without X and Y nothing lies between.
        if via != from {
            reach.add(Point { place: via, how: How::Passes });
        }
        let shares = [0, 1].map(|axis| first.shares[axis].max(then.shares[axis]));
        Self { reach, length_mm: first.length_mm + then.length_mm, shares }
    }
}

fn line(from: Place, to: Place) -> Course {
    let way = way(from, to);
    Course { reach: Reach::to(to), length_mm: in_mm(way[0].hypot(way[1])), shares: shares_along(way) }
}

fn shares_along(way: [f64; 2]) -> [f64; 2] {
    let length = way[0].hypot(way[1]);
    if length > 0.0 { way.map(|way| way.abs() / length) } else { [0.0; 2] }
}

/// An axis goes fastest at an end of an arc, or where the other one turns back; always across the radius.
fn shares_about(arc: &Arc, places: impl Iterator<Item = Place>) -> [f64; 2] {
    places.fold([0.0, 0.0], |[x, y], place| {
        let [across, along] = shares_along(way(arc.centre, place));
        [f64::max(x, along), f64::max(y, across)]
    })
}

/// A sine turns to both sides of its line by as much as its slope tells; where it crosses the direction of an axis, that
/// axis goes as fast as the path.
fn shares_of(sine: &Sine, way: [f64; 2]) -> [f64; 2] {
    let slope = sine.amplitude.pm() as f64 * TAU * f64::from(sine.periods) / way[0].hypot(way[1]);
    shares_along(way).map(|along| {
        // Between the line, without its sense, and the axis.
        let angle = along.min(1.0).acos();
        (angle - slope.atan()).max(0.0).cos()
    })
}

/// From one place to another, pm. Up to 9000 km a float holds each picometre.
fn way(from: Place, to: Place) -> [f64; 2] {
    [0, 1].map(|axis| (to[axis] - from[axis]).pm() as f64)
}

fn in_mm(pm: f64) -> f64 {
    pm / abbe_core::units::PM_PER_MM
}
