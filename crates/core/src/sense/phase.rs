//! An angle inside a signal period, and how it comes from a sine and a cosine: CORDIC (Volder, 1959) in integers.

use super::subdivide::Octant;

/// A part of a signal period, 2⁻³² of it; wraps with the period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Phase(pub u32);

/// A phase and how long the vector was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Polar {
    /// Angle from the positive cosine axis.
    pub phase: Phase,
    /// Length in the units of the signals, 0 … 2³¹ − 1; to 1 in 10⁵, and short by less than one unit.
    pub radius: u32,
}

/// Rotations. The last is by 2⁻²² rad, 0.04 parts in a million of a period: finer than any converter.
const ROTATIONS: usize = 22;
/// atan(2⁻ⁱ) for i = 1 … 22, 2⁻³² of a turn.
const ANGLES: [u32; ROTATIONS] = [
    316_933_406,
    167_458_907,
    85_004_756,
    42_667_331,
    21_354_465,
    10_679_838,
    5_340_245,
    2_670_163,
    1_335_087,
    667_544,
    333_772,
    166_886,
    83_443,
    41_722,
    20_861,
    10_430,
    5_215,
    2_608,
    1_304,
    652,
    326,
    163,
];
/// The rotations make the vector longer, by √(1 + 4⁻¹) √(1 + 4⁻²) …; 2⁻³² of the inverse.
const SHORTER: u32 = 3_688_454_934;
/// Bits that the longer component has before rotating: as many as leave room for growing by √2 · 1.17.
const BITS: u32 = 30;

impl Phase {
    /// Half a period.
    pub const HALF: Self = Self(1 << 31);

    /// The phase as one of `factor` steps of a period, rounded to nearest: 0 … `factor` − 1. Any factor.
    #[inline]
    pub const fn step_of(self, factor: u16) -> u16 {
        let scaled = crate::wide::mul_u32(self.0, factor as u32).wrapping_add(1 << 31);
        let step = (scaled >> 32) as u16;
        if step == factor { 0 } else { step }
    }

    /// From another phase to this one the short way, 2⁻³² of a period.
    #[inline]
    pub const fn way_from(self, other: Self) -> i32 {
        self.0.wrapping_sub(other.0).cast_signed()
    }

    /// In turns, 0 ≤ turns < 1. For the edges, not the tick.
    pub fn turns(self) -> f64 {
        f64::from(self.0) / 4_294_967_296.0
    }

    /// The eighth of the period that it lies in, 0 … 7.
    #[inline]
    pub const fn octant(self) -> u8 {
        (self.0 >> 29) as u8
    }
}

/// Phase and length of the vector (`cos`, `sin`), |cos|, |sin| < 2³⁰. The zero vector has phase zero.
///
/// Off by at most 2⁻²⁴ of a period, 0.05 pm of 0.8 µm (`is_off_by_a_24th_power_of_two_at_most`). 22 rotations of four
/// instructions each, where a division alone would cost a Cortex-M0+ as much.
#[inline]
pub fn polar(sin: i32, cos: i32) -> Polar {
    let folded = Octant::fold(sin, cos);
    let (mut x, mut y) = (folded.major, folded.minor.cast_signed());
    if x == 0 {
        return Polar::default();
    }
    // As many bits as there is room for: what a shift loses is then below the last rotation.
    let room = x.leading_zeros().wrapping_sub(u32::BITS.wrapping_sub(BITS));
    x <<= room;
    y <<= room;
    let mut angle = 0_u32;
    for (turn, by) in (1_u32..).zip(ANGLES) {
        let (along, across) = ((x >> turn).cast_signed(), y >> turn);
        if y >= 0 {
            x = x.wrapping_add_signed(across);
            y = y.wrapping_sub(along);
            angle = angle.wrapping_add(by);
        } else {
            x = x.wrapping_add_signed(across.wrapping_neg());
            y = y.wrapping_add(along);
            angle = angle.wrapping_sub(by);
        }
    }
    let radius = (crate::wide::mul_u32(x, SHORTER) >> 32) as u32 >> room;
    Polar { phase: Phase(folded.unfold(angle, 1 << 30)), radius }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    fn turns(sin: i32, cos: i32) -> f64 {
        (f64::from(sin).atan2(f64::from(cos)) / TAU).rem_euclid(1.0)
    }

    fn off(sin: i32, cos: i32) -> f64 {
        let off = polar(sin, cos).phase.turns() - turns(sin, cos);
        (off - off.round()).abs()
    }

    #[test]
    fn the_angles_are_those_of_the_formula() {
        for (turn, by) in (1..).zip(ANGLES) {
            let exact = libm::atan(libm::ldexp(1.0, -turn)) / TAU * 4_294_967_296.0;
            assert!((f64::from(by) - exact).abs() < 0.51, "{turn}: {exact}");
        }
        let growth: f64 = (1..=22).map(|turn| (1.0 + 0.25_f64.powi(turn)).sqrt()).product();
        assert!((f64::from(SHORTER) - 4_294_967_296.0 / growth).abs() < 1.0, "{}", 4_294_967_296.0 / growth);
    }

    #[test]
    fn the_axes_and_the_diagonals_are_exact_to_the_last_rotation() {
        for (sin, cos, turns) in [
            (0, 1, 0.0),
            (7, 7, 0.125),
            (5, 0, 0.25),
            (9, -9, 0.375),
            (0, -3, 0.5),
            (-2, -2, 0.625),
            (-1, 0, 0.75),
            (-4, 4, 0.875),
        ] {
            let off = polar(sin, cos).phase.turns() - turns;
            assert!((off - off.round()).abs() < 6e-8, "{sin}, {cos}: {off}");
        }
        assert_eq!(polar(0, 0), Polar::default());
    }

    #[test]
    fn steps_round_to_the_nearest_and_wrap() {
        let at = |turns: f64| Phase((turns * 4_294_967_296.0) as u32);
        assert_eq!([0.0, 0.0031, 0.0032, 0.9968, 0.9969].map(|t| at(t).step_of(160)), [0, 0, 1, 159, 0]);
        assert_eq!(at(0.4999).step_of(4096), 2048);
        assert_eq!(at(0.7).step_of(10), 7);
    }

    proptest! {
        #[test]
        fn is_off_by_a_24th_power_of_two_at_most(
            sin in -(1 << 30)..1_i32 << 30, cos in -(1 << 30)..1_i32 << 30, small in 0..30_u32,
        ) {
            let (sin, cos) = (sin >> small, cos >> small);
            prop_assume!(sin != 0 || cos != 0);
            prop_assert!(off(sin, cos) < 6e-8, "{}", off(sin, cos));
            let radius = f64::from(sin).hypot(f64::from(cos));
            let found = f64::from(polar(sin, cos).radius);
            prop_assert!(found <= radius * 1.00001 && found >= radius * 0.99999 - 1.0, "{} {}", found, radius);
        }
    }
}
