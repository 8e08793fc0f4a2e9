//! An angle inside a signal period, and how it comes from a sine and a cosine: the nearest of 129 tangents whose angles are
//! known, and a parabola from there. CORDIC (Volder, 1959), at which the table is aimed, needs no product, but 22 rotations
//! one after the other; the Cortex-M0+ of the RP2040 multiplies in a cycle.

use super::subdivide::Octant;
use crate::wide;
use core::f64::consts::TAU;

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

/// Parts of the tangents from 0 to 1, each with a node at its beginning.
const PARTS: u32 = 128;

/// What is known beforehand of the angle with tangent T = k / 128: it and its length, and how they change.
#[derive(Clone, Copy)]
struct Node {
    /// atan T, 2⁻³² of a turn.
    angle: u32,
    /// √(1 + T²) − 1, 2⁻¹⁸.
    longer: u32,
    /// The angle's derivative, 1 / (1 + T²), 2⁻¹⁸ of a turn.
    slope: u16,
    /// Half of its second, T / (1 + T²)², taken off, 2⁻¹⁶ of a turn.
    bend: u16,
    /// The length's derivative, T / √(1 + T²), 2⁻¹⁵.
    rise: u16,
}

/// Made by the compiler, in floats.
static NODES: [Node; 1 + PARTS as usize] = nodes();

/// 2³¹ over the middle of each 128th of 2¹⁵ … 2¹⁶.
static RECIPROCALS: [u16; 128] = reciprocals();

#[allow(clippy::indexing_slicing, reason = "while compiling")]
const fn nodes() -> [Node; 1 + PARTS as usize] {
    let mut nodes = [Node { angle: 0, longer: 0, slope: 0, bend: 0, rise: 0 }; 1 + PARTS as usize];
    let (part, mut k, mut before, mut angle) = (1.0 / PARTS as f64, 0, 0.0, 0.0);
    while k < nodes.len() {
        let t = k as f64 * part;
        // From node to node by atan a − atan b = atan (a − b) / (1 + ab); of its series h⁷ is below 10⁻¹⁴.
        let h = (t - before) / (1.0 + t * before);
        angle += h - h * h * h / 3.0 + h * h * h * h * h / 5.0;
        let (slope, length) = (1.0 / (1.0 + t * t), root(1.0 + t * t));
        nodes[k] = Node {
            angle: (angle / TAU * 4_294_967_296.0 + 0.5) as u32,
            longer: ((length - 1.0) * 262_144.0 + 0.5) as u32,
            slope: (slope / TAU * 262_144.0 + 0.5) as u16,
            bend: (t * slope * slope / TAU * 65_536.0 + 0.5) as u16,
            rise: (t / length * 32_768.0 + 0.5) as u16,
        };
        before = t;
        k = k.wrapping_add(1);
    }
    nodes
}

/// √x for 1 ≤ x ≤ 2, by Newton's method: there is no other while compiling.
const fn root(x: f64) -> f64 {
    let (mut root, mut turns) = (x, 0_u32);
    while turns < 6 {
        root = f64::midpoint(root, x / root);
        turns = turns.wrapping_add(1);
    }
    root
}

#[allow(clippy::indexing_slicing, reason = "while compiling")]
const fn reciprocals() -> [u16; 128] {
    let (mut reciprocals, mut k) = ([0; 128], 0);
    while k < reciprocals.len() {
        reciprocals[k] = (2_147_483_648.0 / (256.0 * (128.5 + k as f64)) + 0.5) as u16;
        k = k.wrapping_add(1);
    }
    reciprocals
}

impl Phase {
    /// Half a period.
    pub const HALF: Self = Self(1 << 31);

    /// The phase as one of `factor` steps of a period, rounded to nearest: 0 … `factor` − 1. Any factor.
    #[inline]
    pub const fn step_of(self, factor: u16) -> u16 {
        let scaled = wide::mul_u32(self.0, factor as u32).wrapping_add(1 << 31);
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
/// Off by at most 2⁻²⁴ of a period, 0.05 pm of 0.8 µm (`is_off_by_a_24th_power_of_two_at_most`).
#[inline]
pub fn polar(sin: i32, cos: i32) -> Polar {
    let folded = Octant::fold(sin, cos);
    if folded.major == 0 {
        return Polar::default();
    }
    // The longer component to 31 bits: what is shifted out below is less than the last of them.
    let room = wide::leading_zeros(folded.major).wrapping_sub(1);
    let (x, y) = (folded.major.wrapping_shl(room), folded.minor.wrapping_shl(room));
    let over_x = reciprocal(x);
    // The nearest node, or its neighbour where it makes no difference.
    let k = (y >> 15).wrapping_mul(over_x).wrapping_add(1 << 23) >> 24;
    let Some(node) = NODES.get(k as usize) else { return Polar::default() };
    // From its tangent to y/x, 2⁻²³: k x and 128 y both wrap, and what is between them does not.
    let beyond = (y << 7).wrapping_sub(k.wrapping_mul(x)).cast_signed();
    let way = rounded(rounded(beyond, 15).wrapping_mul(over_x.cast_signed()), 15);
    let bend = rounded(i32::from(node.bend).wrapping_mul(way), 21);
    let angle = i32::from(node.slope).wrapping_sub(bend).wrapping_mul(way) >> 9;
    let longer =
        node.longer.wrapping_add_signed(i32::from(node.rise).wrapping_mul(way) >> 20).wrapping_add(1);
    let angle = folded.unfold(node.angle.wrapping_add_signed(angle), 1 << 30);
    Polar { phase: Phase(angle), radius: x.wrapping_add(part(x, longer)).wrapping_shr(room) }
}

/// 2⁴⁶ / x for 2³⁰ ≤ x < 2³¹: from the table, and once by Newton's method. To 1 in 2¹⁵.
#[inline]
fn reciprocal(x: u32) -> u32 {
    let nearly = RECIPROCALS.get((x >> 23 & 127) as usize).copied().map_or(0, u32::from);
    let short = x.wrapping_add(1 << 14) >> 15;
    let off = (1_u32 << 31).wrapping_sub(nearly.wrapping_mul(short)).cast_signed();
    let more = rounded(nearly.cast_signed().wrapping_mul(off >> 9), 22);
    nearly.wrapping_add_signed(more)
}

/// `way / 2ⁿ`, rounded to nearest.
#[inline]
fn rounded(way: i32, n: u32) -> i32 {
    way.wrapping_add((1 << n) >> 1) >> n
}

/// `x · part / 2¹⁸` for x < 2³¹, part < 2¹⁷, both factors in halves.
#[inline]
fn part(x: u32, part: u32) -> u32 {
    let low = (x & 0xffff).wrapping_mul(part >> 2) >> 14;
    (x >> 16).wrapping_mul(part).wrapping_add(low) >> 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn turns(sin: i32, cos: i32) -> f64 {
        (f64::from(sin).atan2(f64::from(cos)) / TAU).rem_euclid(1.0)
    }

    fn off(sin: i32, cos: i32) -> f64 {
        let off = polar(sin, cos).phase.turns() - turns(sin, cos);
        (off - off.round()).abs()
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

    #[test]
    fn every_part_and_its_edges_are_right_at_every_length() {
        for amplitude in [1.06e6, 1.4e7, 5.0e8, 1.0e9] {
            for step in 0..1_000_000 {
                let angle = f64::from(step) / 1e6 * TAU;
                let (sin, cos) = ((amplitude * angle.sin()) as i32, (amplitude * angle.cos()) as i32);
                assert!(off(sin, cos) < 0.5_f64.powi(24), "{sin}, {cos}: {}", off(sin, cos));
                let long = f64::from(polar(sin, cos).radius) / f64::from(sin).hypot(f64::from(cos)) - 1.0;
                assert!(long.abs() < 1e-5, "{sin}, {cos}: {long}");
            }
        }
    }

    #[test]
    fn the_nodes_are_those_of_the_formulas() {
        for (node, k) in NODES.iter().zip(0..) {
            let tangent = f64::from(k) / 128.0;
            let angle = libm::atan(tangent) / TAU * 4_294_967_296.0;
            let longer = (libm::hypot(1.0, tangent) - 1.0) * 262_144.0;
            assert!((f64::from(node.angle) - angle).abs() < 0.51, "{k}: {angle}");
            assert!((f64::from(node.longer) - longer).abs() < 0.51, "{k}: {longer}");
        }
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
