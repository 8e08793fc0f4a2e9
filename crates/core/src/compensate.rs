//! Compensate: from the stage frame (where the table really is) to the scale frame (what the encoder reads).
//!
//! The error map gives e(c) = actual − reading at the reading c. To bring the table to `p` the loop must close on the
//! reading c with c + e(c) = p. Paper A subtracts e(p) once, which leaves 0.93 µm on its Y axis; here the inverse is
//! iterated: c ← p − e(c), a contraction because an accepted map has |de/dx| ≤ 5 %, hastened by Newton's step.

use crate::units::{InMm, Pos};
use crate::wide;
use core::fmt;

/// log₂ of the distance of two nodes in picometres: 0.537 mm.
const INTERVAL_BITS: u32 = 29;
/// log₂ of the number of nodes.
const NODE_BITS: u32 = 8;
/// Number of nodes; they span 136.9 mm.
pub const NODES: usize = 1 << NODE_BITS;
/// Largest error a map may hold: 1 mm.
pub const LARGEST: Pos = Pos::from_pm(1_000_000_000);
/// Largest difference of neighbouring nodes: 5 % of their distance.
const STEEPEST: i64 = (1 << INTERVAL_BITS) / 20;
/// Evaluations of the inverse at most. Each leaves at most 5 % of what was left: 1 mm · 0.05⁸ = 0.04 pm at the very limit;
/// with the slope known, within an interval nothing but rounding.
const ITERATIONS: u32 = 8;

/// The error of one axis along its travel: nodes 0.537 mm apart, straight lines between.
///
/// A second derivative κ costs κ h²/8 between two nodes: 1.2 nm on paper A's parabola (κ = 0.0336 µm/mm²), 16 nm where
/// a polynomial of degree 13 bends most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ErrorMap {
    low: Pos,
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    nodes: [i32; NODES],
}

/// Why a map is not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapError {
    /// The error is larger than 1 mm at this reading.
    TooLarge(Pos),
    /// The error changes by more than 5 % of the way at this reading: the map would fold.
    TooSteep(Pos),
}

impl fmt::Display for MapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLarge(at) => write!(f, "the error at {} mm is larger than 1 mm", InMm(*at)),
            Self::TooSteep(at) => {
                write!(f, "the error at {} mm changes by more than 5 % of the way", InMm(*at))
            }
        }
    }
}

impl core::error::Error for MapError {}

impl ErrorMap {
    /// No error anywhere.
    pub const NONE: Self = Self { low: Pos::ZERO, nodes: [0; NODES] };

    /// Samples `error(reading)` at the nodes, the first at `low`.
    ///
    /// # Errors
    /// When the error is larger than 1 mm or steeper than 5 % anywhere.
    pub fn sample(low: Pos, mut error: impl FnMut(Pos) -> Pos) -> Result<Self, MapError> {
        let mut nodes = [0; NODES];
        let mut at = low;
        let mut last: Option<Pos> = None;
        for node in &mut nodes {
            let value = error(at);
            if value.abs() > LARGEST {
                return Err(MapError::TooLarge(at));
            }
            if last.is_some_and(|last| (value - last).abs() > Pos::from_pm(STEEPEST)) {
                return Err(MapError::TooSteep(at));
            }
            *node = value.pm() as i32;
            last = Some(value);
            at = at + Pos::from_pm(1 << INTERVAL_BITS);
        }
        Ok(Self { low, nodes })
    }

    /// Reading at the first node.
    pub fn low(&self) -> Pos {
        self.low
    }

    /// The error at each node, picometres.
    pub fn nodes(&self) -> &[i32; NODES] {
        &self.nodes
    }

    /// e(c) at the reading `c`; constant beyond the ends.
    pub fn error_at(&self, reading: Pos) -> Pos {
        Pos::from_pm(self.error_and_rise(reading).0)
    }

    /// e(c), picometres, and how much it rises to the end of the interval that holds `c`.
    #[inline]
    fn error_and_rise(&self, reading: Pos) -> (i64, i32) {
        let along = reading.way_from(self.low);
        // Without a sign, so that what lies below the first node is beyond the last.
        let intervals = along.cast_unsigned() >> INTERVAL_BITS;
        let (0, interval) = (intervals >> NODE_BITS, intervals as usize) else {
            return (self.error_beyond(along), 0);
        };
        let (Some(&left), Some(&right)) =
            (self.nodes.get(interval), self.nodes.get(interval.wrapping_add(1)))
        else {
            return (self.error_beyond(along), 0);
        };
        let fraction = along as i32 & ((1 << INTERVAL_BITS) - 1);
        let rise = right.wrapping_sub(left);
        let risen = wide::mul_i32(rise, fraction) >> INTERVAL_BITS;
        (i64::from(left.wrapping_add(risen as i32)), rise)
    }

    #[cold]
    fn error_beyond(&self, along: i64) -> i64 {
        let end = if along < 0 { self.nodes.first() } else { self.nodes.last() };
        end.map_or(0, |&end| i64::from(end))
    }

    /// The place of the table at the reading `c`.
    pub fn stage_from_scale(&self, reading: Pos) -> Pos {
        let (error, _) = self.error_and_rise(reading);
        Pos::from_pm(reading.pm().wrapping_add(error))
    }

    /// The reading at which the table is at `place`, to a picometre or two.
    pub fn scale_from_stage(&self, place: Pos) -> Pos {
        self.scale_from_stage_near(place, place)
    }

    /// The same, begun at a reading that is nearly right: from one tick to the next two evaluations are enough.
    pub fn scale_from_stage_near(&self, place: Pos, near: Pos) -> Pos {
        let mut reading = near.pm();
        for _ in 0..ITERATIONS {
            let (error, rise) = self.error_and_rise(Pos::from_pm(reading));
            let missing = place.pm().wrapping_sub(error).wrapping_sub(reading);
            // Rounding can keep a picometre from ever being found.
            if wide::is_within(missing, 1) {
                break;
            }
            reading = reading.wrapping_add(missing).wrapping_sub(change_of_error(rise, missing));
        }
        Pos::from_pm(reading)
    }
}

/// How much the error changes over the way that is missing, if that is short: Newton's step. A long way does without,
/// and converges all the same.
fn change_of_error(rise: i32, missing: i64) -> i64 {
    let short = missing as i32;
    let change = if i64::from(short) == missing { wide::mul_i32(rise, short) } else { 0 };
    change.wrapping_add(1 << (INTERVAL_BITS - 1)) >> INTERVAL_BITS
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Paper A, Y axis, µm over mm.
    fn paper_y(reading: Pos) -> Pos {
        let x = reading.mm();
        Pos::from_um(0.0168 * x * x + 0.6397 * x + 1.021)
    }

    fn map() -> ErrorMap {
        ErrorMap::sample(Pos::from_mm(-5.0), paper_y).unwrap()
    }

    proptest! {
        #[test]
        fn the_two_directions_cancel(place in -3.0f64..105.0) {
            let place = Pos::from_mm(place);
            let back = map().stage_from_scale(map().scale_from_stage(place));
            prop_assert!((back - place).abs() <= Pos::from_pm(3));
        }

        #[test]
        fn the_map_follows_the_polynomial(reading in -4.0f64..120.0) {
            let reading = Pos::from_mm(reading);
            prop_assert!((map().error_at(reading) - paper_y(reading)).abs() <= Pos::from_pm(1300));
        }
    }

    #[test]
    fn one_subtraction_is_not_enough_and_the_iteration_is() {
        for (target, left_um) in [(90.0, 0.71), (100.0, 0.93)] {
            let target = Pos::from_mm(target);
            let once = target - map().error_at(target);
            let left = (map().stage_from_scale(once) - target).um().abs();
            assert!((left - left_um).abs() < 0.02, "{left}");
            let iterated = map().scale_from_stage(target);
            assert!((map().stage_from_scale(iterated) - target).abs() <= Pos::from_pm(2));
        }
    }

    #[test]
    fn maps_that_fold_or_exceed_a_millimetre_are_refused() {
        let steep = ErrorMap::sample(Pos::ZERO, |p| Pos::from_pm(p.pm() / 10));
        assert!(matches!(steep, Err(MapError::TooSteep(_))));
        let large = ErrorMap::sample(Pos::ZERO, |_| Pos::from_mm(1.1));
        assert_eq!(large, Err(MapError::TooLarge(Pos::ZERO)));
    }
}
