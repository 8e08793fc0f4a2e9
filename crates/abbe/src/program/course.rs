//! What a motion is on its way: how far it goes to each side, how long it is, and what each axis takes of its speed.
//!
//! Its beginning is the end of the motion before, and is looked at there.

use super::{arc, sine};
use abbe_core::Pos;
use abbe_proto::gcode::{Move, Path, Place};

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

impl Course {
    pub(crate) fn of(there: &Move) -> Self {
        match &there.path {
            Path::Line => line(there.from, there.to),
            Path::Arc(arc) => arc::course(there.from, there.to, arc),
            Path::Sine(sine) => sine::course(there.from, there.to, sine),
        }
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
    let length = way[0].hypot(way[1]);
    let shares = if length > 0.0 { way.map(|way| way.abs() / length) } else { [0.0; 2] };
    Course { reach: Reach::to(to), length_mm: in_mm(length), shares }
}

/// From one place to another, pm. Up to 9000 km a float holds each picometre.
pub(super) fn way(from: Place, to: Place) -> [f64; 2] {
    [0, 1].map(|axis| (to[axis] - from[axis]).pm() as f64)
}

/// A place by its offset from another one, pm.
pub(super) fn beside(place: Place, offset: [f64; 2]) -> Place {
    [0, 1].map(|axis| place[axis] + Pos::from_pm(offset[axis].round() as i64))
}

pub(super) fn in_mm(pm: f64) -> f64 {
    pm / abbe_core::units::PM_PER_MM
}
