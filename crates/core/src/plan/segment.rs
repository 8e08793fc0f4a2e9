//! What a program asks for, one after the other: a shape, how fast, and how near to its end.

use super::compare::Axis;
use super::curve::{Arc, Curve, Place, Sine};
use super::profile::Limits;
use super::scan::{Lines, Order, Scan, ScanError};
use crate::units::Pos;

/// A speed along a path: pm a tick, with 16 fractional bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Feed(pub u64);

impl Feed {
    /// As fast as the axes can go.
    pub const RAPID: Self = Self(u64::MAX);

    /// So many picometres a tick, rounded; a number below zero, or none, is zero.
    pub fn from_pm(pm: f64) -> Self {
        Self(libm::round(libm::ldexp(pm, 16)) as u64)
    }

    /// pm a tick; infinite for a rapid.
    pub fn pm(self) -> f64 {
        if self == Self::RAPID { f64::INFINITY } else { libm::ldexp(self.0 as f64, -16) }
    }
}

/// How a segment leads to its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Shape {
    /// Straight.
    #[default]
    Line,
    /// About a centre: a whole turn if it ends where it begins.
    Arc {
        /// The centre, x and y.
        centre: [Pos; 2],
        /// Seen with x to the right and y up.
        counterclockwise: bool,
    },
    /// A sine about the straight line, to its left first: see [`Sine`].
    Sine {
        /// From the line.
        amplitude: Pos,
        /// Whole periods.
        periods: u32,
        /// At which it begins, billionths of a degree.
        phase: i64,
    },
    /// Line by line over an area, at the segment's feed: see [`Scan`]. It begins where its plan says, at rest, and is gone
    /// through as it is: no feed rate changes it, and a hold comes behind it.
    Scan {
        /// Where the first line enters the area, and the corner across.
        corners: [[Pos; 2]; 2],
        /// Along which axis the lines run.
        fast: Axis,
        /// How many of them.
        lines: Lines,
        /// In which direction.
        order: Order,
        /// Ticks at constant speed before a line enters the area.
        settle: u32,
    },
}

/// A part of a program's path, in the stage frame; it begins where the one before ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Segment {
    /// How it leads there.
    pub shape: Shape,
    /// Where it ends, x and y.
    pub to: [Pos; 2],
    /// Highest speed along it.
    pub feed: Feed,
    /// Where the next begins the path may be left by this at most; zero: it stops there.
    pub tolerance: Pos,
}

impl Segment {
    /// A scan, from the start of its plan to its end.
    ///
    /// # Errors
    /// As of [`Scan::plan`].
    pub fn scanning(scan: &Scan, axes: &[Limits; 2]) -> Result<Self, ScanError> {
        let Scan { corners, fast, lines, order, speed, settle } = *scan;
        let shape = Shape::Scan { corners, fast, lines, order, settle };
        // What it will be gone through with: the feed is rounded.
        let mut segment = Self { shape, feed: Feed::from_pm(speed), ..Self::default() };
        segment.to = segment.scan().ok_or(ScanError::NoNumber)?.plan(axes)?.end();
        Ok(segment)
    }

    /// The scan that it is, if it is one.
    pub fn scan(&self) -> Option<Scan> {
        let Shape::Scan { corners, fast, lines, order, settle } = self.shape else { return None };
        Some(Scan { corners, fast, lines, order, speed: self.feed.pm(), settle })
    }

    /// Its curve from a place. None if there is no such curve: an arc about one of its ends, or one whose ends are not
    /// about equally far from the centre; a sine without amplitude, period or way; a scan.
    pub fn curve(&self, from: [Pos; 2]) -> Option<Curve> {
        let (from, to) = (place(from), place(self.to));
        match self.shape {
            Shape::Line => Some(Curve::Line { from, to }),
            Shape::Arc { centre, counterclockwise } => {
                Arc::new(from, to, place(centre), counterclockwise).map(Curve::Arc)
            }
            Shape::Sine { amplitude, periods, phase } => {
                let phase = phase as f64 / 1e9 * (core::f64::consts::PI / 180.0);
                Sine::new(from, to, amplitude.pm() as f64, periods, phase).map(Curve::Sine)
            }
            Shape::Scan { .. } => None,
        }
    }
}

/// A place for planning; up to 9 m a float holds each picometre.
pub fn place(at: [Pos; 2]) -> Place {
    at.map(|at| at.pm() as f64)
}

/// A place to go to, to the nearest picometre.
pub fn rounded(at: Place) -> [Pos; 2] {
    at.map(|at| Pos::from_pm(libm::round(at) as i64))
}
