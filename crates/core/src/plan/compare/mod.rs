//! Point-by-point comparison (逐点比较法, paper row A7): straight lines and arcs in whole counts, one axis a step.
//!
//! A step takes four: *judge* the deviation, *feed* one step, compute the new *deviation*, *test for the end*.
//! [`Line::next_step`] and [`Arc::next_step`] read so, in sums and comparisons alone. Constructors multiply;
//! they belong outside the tick.
//!
//! # Judged in the middle
//!
//! Two points can be next, one on each axis; they are the ends of a diagonal of the square ahead. A textbook judges the
//! deviation of the point it stands on. Here that of the middle of the square is judged, which is another constant to
//! compare with and no more work. Its sign says on which half of the diagonal the path crosses, and that end is taken.
//!
//! # How far beside the path
//!
//! **Line** over a and b steps (both ≥ 0): F = a y − b x is zero on it, and F / √(a² + b²) is the distance. A step feeds x
//! where 2 F ≥ b − a and makes F − b of it, or else y and F + a. From −(a + b) ≤ 2 F < a + b the first gives
//! 2 F ≥ −(a + b), the second 2 F < a + b: it stays so, because it begins with F = 0. So the distance is at most
//!
//! ```text
//! (a + b) / 2 √(a² + b²)  ≤  √½ of a step
//! ```
//!
//! and this is the largest there is: after k steps F is −k b modulo a + b, so a whole line meets each multiple of
//! g = gcd(a, b) in that range. The bound itself is met with (a + b)/g even, and else one where |F| is g/2 less. Judged
//! where it stands, F would go from −b to a − 1: over 1 count by 40, 0.9997 of a step.
//!
//! **Arc** of radius R around 0, in a quadrant where u = |x| or |y| falls and v, the other, rises: F = u² + v² − R².
//! A point is *drawn* if −(u + v) ≤ F < u + v, which says that the circle crosses the diagonal of the square of one count
//! around it. A step from a drawn point ends on one. Where F − u + v ≥ 0, and u ≥ 1, u falls by one, and F' = F − 2 u + 1 has
//!
//! ```text
//! F' ≥ (u − v) − 2 u + 1 = −(u' + v)        F' < (u + v) − 2 u + 1 ≤ u' + v
//! ```
//!
//! and where it is below zero v rises, with F' = F + 2 v + 1:
//!
//! ```text
//! F' ≥ −(u + v) + 2 v + 1 ≥ −(u + v')       F' < (u − v) + 2 v + 1 = u + v'
//! ```
//!
//! On an axis the quadrants change names, which leaves |x| + |y| and F alone. With ρ² = u² + v² and u + v ≤ √2 ρ a drawn point
//! has R² ≤ ρ² + √2 ρ < (ρ + √½)², and, F being whole, R² ≥ ρ² − √2 ρ + 1 > (ρ − √½)²: it lies *less* than √½ of a
//! step beside the circle, whatever the radius. All that lie within half a step are drawn, and so is a point of the circle
//! rounded to whole counts.
//!
//! # Where it ends
//!
//! A line takes a + b steps, and F tells each axis that has arrived from the one that has not: with x = a and y < b,
//! 2 F ≤ −2 a; with y = b and x < a, 2 F ≥ 2 b. So the count of steps ends it, on its end.
//!
//! Each step of an arc leads to the next diagonal of its quadrant, where u − v is one less. Along a diagonal F grows by
//! 2 (u + v) + 2 from point to point, so that none has two drawn points: whoever walks, either way, meets the same ones.
//! They are a closed ring. It cuts an axis at r, the whole number nearest to R, and a quadrant has 2 r steps. Where a
//! point is in the ring follows from its quadrant, u and v; the difference of two such places is the number of
//! steps, known beforehand and never more than 8 r. It is counted down, so every arc ends, and on its end. An end beside
//! the ring, by one count at most, is next to a drawn point: the arc goes there and takes one step more. See [`Arc::new`].

mod arc;
mod circle;
mod line;

pub use arc::{Arc, Turn};
pub use circle::{Circle, CircleError, Which};
pub use line::Line;

use crate::units::Counts;
use core::fmt;

/// Coordinates lie within ± this, and radii: 2³⁰ counts, 1.07 m in nanometres.
///
/// So a line has at most 2³¹ steps an axis, and what it judges stays below 2³³. The points of an arc have
/// |x| + |y| < √2 (2³⁰ + 1), which bounds its deviation; what it judges stays below 2³². All fit 64 bit by far.
pub const FARTHEST: i64 = 1 << 30;

/// One of the two axes of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
}

impl Axis {
    /// Its place among the axes of a stage.
    pub const fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
        }
    }
}

/// A step of one count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Step {
    /// Which axis is fed.
    pub axis: Axis,
    /// Up or down.
    pub sign: Sign,
}

/// The sense of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Sign {
    /// To larger coordinates.
    Plus,
    /// To smaller ones.
    Minus,
}

impl Sign {
    /// Of a number; zero has `Plus`.
    const fn of(number: i64) -> Self {
        if number < 0 { Self::Minus } else { Self::Plus }
    }

    const fn opposite(self) -> Self {
        match self {
            Self::Plus => Self::Minus,
            Self::Minus => Self::Plus,
        }
    }

    const fn counts(self) -> i64 {
        match self {
            Self::Plus => 1,
            Self::Minus => -1,
        }
    }
}

impl Step {
    /// The point after this step.
    #[must_use]
    pub const fn from(self, point: [Counts; 2]) -> [Counts; 2] {
        let ([x, y], by) = (point, self.sign.counts());
        match self.axis {
            Axis::X => [Counts::new(x.get().saturating_add(by)), y],
            Axis::Y => [x, Counts::new(y.get().saturating_add(by))],
        }
    }
}

/// A coordinate beyond ± [`FARTHEST`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooFar {
    /// Of which axis.
    pub axis: Axis,
    /// The coordinate.
    pub at: Counts,
}

impl fmt::Display for TooFar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = crate::command::axis_name(self.axis.index());
        write!(f, "{axis} = {} counts lies beyond ±{FARTHEST}; use a coarser count", self.at.get())
    }
}

impl core::error::Error for TooFar {}

/// The point's two coordinates, if a path may have them.
pub(super) fn within_reach(point: [Counts; 2]) -> Result<[i64; 2], TooFar> {
    for (axis, at) in [Axis::X, Axis::Y].into_iter().zip(point) {
        if at.get().unsigned_abs() > FARTHEST.unsigned_abs() {
            return Err(TooFar { axis, at });
        }
    }
    Ok(point.map(Counts::get))
}
