//! The circle of an arc: which points of the grid are drawn for it, and where in their ring. Outside the tick.

use super::{Axis, FARTHEST, Sign, Step, TooFar, within_reach};
use crate::units::Counts;
use core::fmt;

/// A circle around a point of the grid; the square of its radius is a whole number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Circle {
    centre: [i64; 2],
    /// R², 1 … [`FARTHEST`]².
    square: u64,
    /// The whole number nearest to R: where the drawn points cut the axes.
    rounded: u64,
}

/// Which end of an arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// Where it begins.
    Start,
    /// Where it ends.
    End,
}

/// Why there is no such circle or arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CircleError {
    /// A centre or an end lies too far off.
    TooFar(TooFar),
    /// The radius is zero or negative.
    NoRadius,
    /// The radius is larger than [`FARTHEST`].
    TooLarge,
    /// An end lies more than one count beside the circle.
    Beside {
        /// Which.
        end: Which,
        /// By how much, thousandths of a count, rounded up; negative inside the circle.
        thousandths: i64,
    },
}

impl fmt::Display for CircleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooFar(too_far) => write!(f, "{too_far}"),
            Self::NoRadius => f.write_str("an arc needs a radius above zero"),
            Self::TooLarge => write!(f, "the radius is larger than {FARTHEST} counts; use a coarser count"),
            Self::Beside { end, thousandths } => {
                let end = if end == Which::Start { "start" } else { "end" };
                let side = if thousandths < 0 { "inside" } else { "outside" };
                let size = thousandths.unsigned_abs();
                let (whole, part) =
                    (size.checked_div(1000).unwrap_or(0), size.checked_rem(1000).unwrap_or(0));
                write!(f, "the {end} of the arc lies {whole}.{part:03} counts {side} its circle; ")?;
                f.write_str("one count is allowed: mend the radius, the centre or that point")
            }
        }
    }
}

impl core::error::Error for CircleError {}

impl From<TooFar> for CircleError {
    fn from(too_far: TooFar) -> Self {
        Self::TooFar(too_far)
    }
}

impl Circle {
    /// A circle by its radius, 1 … [`FARTHEST`].
    ///
    /// # Errors
    /// A radius or a centre beyond.
    pub fn new(centre: [Counts; 2], radius: Counts) -> Result<Self, CircleError> {
        let square = i128::from(radius.get()).saturating_mul(i128::from(radius.get()));
        if radius.get() < 1 { Err(CircleError::NoRadius) } else { Self::of_square(centre, square) }
    }

    /// A circle through a point.
    ///
    /// # Errors
    /// A radius or a coordinate beyond ± [`FARTHEST`]; the point is the centre.
    pub fn through(centre: [Counts; 2], point: [Counts; 2]) -> Result<Self, CircleError> {
        let [x, y] = from_centre(within_reach(centre)?, within_reach(point)?);
        Self::of_square(centre, square_of([x, y]))
    }

    /// A circle by the square of its radius, which may be any whole number from 1 to [`FARTHEST`]².
    ///
    /// # Errors
    /// A radius or a centre beyond.
    pub fn with_square(centre: [Counts; 2], square: u64) -> Result<Self, CircleError> {
        Self::of_square(centre, i128::from(square))
    }

    fn of_square(centre: [Counts; 2], square: i128) -> Result<Self, CircleError> {
        let centre = within_reach(centre)?;
        if square < 1 {
            return Err(CircleError::NoRadius);
        }
        if square > square_of([FARTHEST, 0]) {
            return Err(CircleError::TooLarge);
        }
        let square = square as u64;
        // (r + ½)² is no whole number: R² is above it if it is above r² + r.
        let below = square.isqrt();
        let up = square > below.saturating_mul(below.saturating_add(1));
        Ok(Self { centre, square, rounded: below.saturating_add(u64::from(up)) })
    }

    /// Steps once around: 8 r.
    pub(super) fn steps_around(&self) -> u64 {
        self.rounded.saturating_mul(8)
    }

    /// A point of the grid as seen from the centre.
    ///
    /// # Errors
    /// It is beyond reach, or more than one count beside the circle.
    pub(super) fn end(&self, point: [Counts; 2], end: Which) -> Result<Offset, CircleError> {
        let offset = Offset(from_centre(self.centre, within_reach(point)?));
        if self.is_within_a_count(offset) {
            Ok(offset)
        } else {
            Err(CircleError::Beside { end, thousandths: self.thousandths_beside(offset) })
        }
    }

    /// | ρ − R | ≤ 1, without a root: |F| = |ρ − R| (ρ + R) is at most 1 + 2 min(ρ, R).
    fn is_within_a_count(&self, offset: Offset) -> bool {
        let beyond = self.deviation(offset).saturating_abs().saturating_sub(1);
        let smaller = square_of(offset.0).min(i128::from(self.square));
        beyond <= 0 || beyond.saturating_mul(beyond) <= smaller.saturating_mul(4)
    }

    /// ρ − R in thousandths of a count, away from zero.
    fn thousandths_beside(&self, offset: Offset) -> i64 {
        let sum = libm::sqrt(square_of(offset.0) as f64) + libm::sqrt(self.square as f64);
        let beside = 1000.0 * self.deviation(offset) as f64 / sum;
        if beside < 0.0 { libm::floor(beside) as i64 } else { libm::ceil(beside) as i64 }
    }

    /// F = ρ² − R².
    pub(super) fn deviation(&self, offset: Offset) -> i128 {
        square_of(offset.0).saturating_sub(i128::from(self.square))
    }

    /// Whether the circle crosses the diagonal of the square of one count around a point.
    fn is_drawn(&self, offset: Offset) -> bool {
        let [x, y] = offset.0;
        let reach = i128::from(x.saturating_abs()).saturating_add(i128::from(y.saturating_abs()));
        (reach.saturating_neg()..reach).contains(&self.deviation(offset))
    }

    /// The drawn point that belongs to a point within a count of the circle, and the step there if it is another.
    ///
    /// One step along the longer coordinate u, towards the circle, gets there. From outside F' = F − 2 u + 1 and
    /// u' = u − 1: with F ≥ u + v, F' ≥ −(u' + v); and F ≤ 2 ρ − 1 leaves 2 ρ < 3 u + v − 1 to be shown for F' < u' + v. As
    /// 3 u + v − 2 ρ ≥ u for v ≤ u, that holds from u = 2 on, and nearer no point is outside a circle of R ≥ 1. From inside
    /// F' = F + 2 u + 1 and u' = u + 1 in the same way. Tried in `a_point_within_a_count_is_a_step_from_the_ring`.
    pub(super) fn drawn_beside(&self, offset: Offset) -> (Offset, Option<Step>) {
        if self.is_drawn(offset) {
            return (offset, None);
        }
        let [x, y] = offset.0;
        let axis = if x.saturating_abs() >= y.saturating_abs() { Axis::X } else { Axis::Y };
        let outwards = Sign::of(if axis == Axis::X { x } else { y });
        let sign = if self.deviation(offset) > 0 { outwards.opposite() } else { outwards };
        let step = Step { axis, sign };
        (Offset(step.from(offset.0.map(Counts::new)).map(Counts::get)), Some(step))
    }

    /// The place of a drawn point in the ring, steps counter-clockwise from the axis +x: 0 … 8 r − 1.
    pub(super) fn place(&self, offset: Offset) -> u64 {
        let InQuadrant { quadrant, falling, rising } = offset.in_quadrant();
        let before = u64::from(quadrant).saturating_mul(2).saturating_add(1).saturating_mul(self.rounded);
        before.saturating_add(rising.unsigned_abs()).saturating_sub(falling.unsigned_abs())
    }
}

/// A point as seen from the centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Offset(pub(super) [i64; 2]);

/// The same by its quadrant, counter-clockwise: which coordinate falls there, and which rises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct InQuadrant {
    /// 0 from the axis +x on, 1 from +y, 2 from −x, 3 from −y.
    pub(super) quadrant: u8,
    /// Size of the coordinate that falls, x in the quadrants 0 and 2; at least 1.
    pub(super) falling: i64,
    /// Size of the other.
    pub(super) rising: i64,
}

impl Offset {
    /// The mirror image across the x axis: what is clockwise becomes counter-clockwise.
    pub(super) fn mirrored(self) -> Self {
        let [x, y] = self.0;
        Self([x, y.saturating_neg()])
    }

    /// An axis belongs to the quadrant that begins there.
    pub(super) fn in_quadrant(self) -> InQuadrant {
        let [x, y] = self.0;
        let (quadrant, falling, rising) = match (x, y) {
            (1.., 0..) => (0, x, y),
            (..=0, 1..) => (1, y, x),
            (..=-1, ..=0) => (2, x, y),
            _ => (3, y, x),
        };
        InQuadrant { quadrant, falling: falling.saturating_abs(), rising: rising.saturating_abs() }
    }
}

fn from_centre(centre: [i64; 2], [x, y]: [i64; 2]) -> [i64; 2] {
    let [centre_x, centre_y] = centre;
    [x.saturating_sub(centre_x), y.saturating_sub(centre_y)]
}

fn square_of([x, y]: [i64; 2]) -> i128 {
    let (x, y) = (i128::from(x), i128::from(y));
    x.saturating_mul(x).saturating_add(y.saturating_mul(y))
}
