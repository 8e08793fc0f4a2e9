//! What is taken off a pair of samples in the tick: the ellipse, and what repeats with the phase beyond it.

use super::ellipse::Ellipse;
use super::phase::{Phase, Polar, polar};
use crate::edge::SinCos;
use crate::wide;

/// Fractional bits of a straightened sample: it is up to 2.3 times as long as its codes.
pub const CODE_BITS: u32 = 8;
/// Fractional bits of the factors.
const FACTOR_BITS: i32 = 24;

/// Offsets, gain and quadrature as the tick takes them off: Heydemann's correction with whole numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Correction {
    /// Offset of the cosine, codes with [`CODE_BITS`].
    offset_of_cos: i32,
    /// tan α and r / cos α, [`FACTOR_BITS`].
    from_cos: i32,
    from_sin: i32,
    /// What the offsets come to after the factors, [`CODE_BITS`] and [`FACTOR_BITS`].
    offset: i64,
}

impl Correction {
    /// Takes nothing off.
    pub const NONE: Self = Self { offset_of_cos: 0, from_cos: 0, from_sin: 1 << FACTOR_BITS, offset: 0 };

    /// Takes off what makes the signals this ellipse; its numbers are rounded to 1/256 of a code and to 6·10⁻⁸.
    pub fn of(ellipse: &Ellipse) -> Self {
        let whole = |value: f64, bits: i32| libm::round(libm::ldexp(value, bits)) as i32;
        let cos = libm::cos(ellipse.alpha);
        let [p, q] = [ellipse.p, ellipse.q].map(|offset| whole(offset, CODE_BITS as i32));
        let from_cos = whole(libm::sin(ellipse.alpha) / cos, FACTOR_BITS);
        let from_sin = whole(ellipse.r / cos, FACTOR_BITS);
        let offset = wide::mul_i32(p, from_cos).wrapping_add(wide::mul_i32(q, from_sin));
        Self { offset_of_cos: p, from_cos, from_sin, offset }
    }

    /// The sample on its circle: cosine and sine, codes with [`CODE_BITS`], less than 2²⁷.
    #[inline]
    pub fn straighten(&self, sample: SinCos) -> [i32; 2] {
        let u = (i32::from(sample.cos) << CODE_BITS).wrapping_sub(self.offset_of_cos);
        // (cos − p) from_cos + (sin − q) from_sin, but a code is half a word, and its products are short ones.
        let of_cos = wide::mul_i32_i16(self.from_cos, sample.cos);
        let of_sin = wide::mul_i32_i16(self.from_sin, sample.sin);
        let sum = (of_cos.wrapping_add(of_sin) << CODE_BITS).wrapping_sub(self.offset);
        [u, (sum >> FACTOR_BITS) as i32]
    }

    /// Phase and radius of a sample; the radius in codes with [`CODE_BITS`].
    #[inline]
    pub fn polar(&self, sample: SinCos) -> Polar {
        let [cos, sin] = self.straighten(sample);
        polar(sin, cos)
    }
}

/// Nodes of a [`Residual`] in a period.
pub const NODES: usize = 128;
/// Bits of a phase below a node.
const BELOW: u32 = 32_u32.saturating_sub(NODES.ilog2());
/// A node holds 2⁻²¹ of a period in a unit, so ± 1/64 in all.
const NODE_BITS: u32 = 11;
const UNIT_BITS: i32 = 21;

/// A table of what the phase is still off by after the ellipse, straight lines between its nodes. Harmonics of the
/// signals end up here: a third harmonic repeats four times in a period, and no ellipse can follow it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Residual {
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    nodes: [i16; NODES],
}

impl Residual {
    /// Takes nothing off.
    pub const NONE: Self = Self { nodes: [0; NODES] };

    /// Takes off what `error` says, turns at a phase in turns, up to ± 1/64; more is cut off.
    pub fn of(error: impl Fn(f64) -> f64) -> Self {
        let mut table = Self::NONE;
        for (node, place) in table.nodes.iter_mut().zip(0_u32..) {
            let off = error(f64::from(place) / NODES as f64);
            *node = libm::round(libm::ldexp(off, UNIT_BITS)).clamp(-32_768.0, 32_767.0) as i16;
        }
        table
    }

    /// The phase without its error.
    #[inline]
    pub fn take_off(&self, phase: Phase) -> Phase {
        let place = (phase.0 >> BELOW) as usize;
        let at = |place: usize| i32::from(self.nodes.get(place % NODES).copied().unwrap_or(0));
        let (left, right) = (at(place), at(place.wrapping_add(1)));
        // 2¹⁶ · 2¹⁴ fits a word.
        let along = ((phase.0 << NODES.ilog2()) >> 18).cast_signed();
        let rise = right.wrapping_sub(left).wrapping_mul(along) >> (14 - NODE_BITS);
        Phase(phase.0.wrapping_sub_signed((left << NODE_BITS).wrapping_add(rise)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    proptest! {
        /// 12-bit, 14-bit and 16-bit signals: integers take off what floats take off.
        #[test]
        fn integers_straighten_as_floats_do(
            p in -0.2..0.2_f64, q in -0.2..0.2_f64, r in 0.8..1.25_f64, alpha in -0.5..0.5_f64,
            angle in 0.0..1.0_f64, radius in 100.0..22_000.0_f64,
        ) {
            let ellipse = Ellipse { p: p * radius, q: q * radius, r, alpha, radius };
            let cos = (radius * (angle * TAU).cos() + ellipse.p) as i16;
            let sin = (radius / r * (angle * TAU - alpha).sin() + ellipse.q) as i16;
            let polar = Correction::of(&ellipse).polar(SinCos { sin, cos });
            let off = polar.phase.turns() - ellipse.turns(cos.into(), sin.into());
            // Half of 1/256 of a code across, and what the rotations leave.
            let limit = 1.5 / 256.0 / radius / TAU + 1e-7;
            prop_assert!((off - off.round()).abs() < limit, "{} {}", off, limit);
        }
    }

    #[test]
    fn full_scale_fits_its_words() {
        let far = Ellipse { p: 32_767.0, q: -32_768.0, r: 2.0, alpha: 0.52, radius: 20_000.0 };
        let correction = Correction::of(&far);
        for (sin, cos) in [(i16::MAX, i16::MIN), (i16::MIN, i16::MAX), (i16::MAX, i16::MAX)] {
            let [u, v] = correction.straighten(SinCos { sin, cos }).map(|v| f64::from(v) / 256.0);
            let exact = far.straighten(cos.into(), sin.into());
            assert!((u - exact[0]).abs() < 0.01 && (v - exact[1]).abs() < 0.02, "{u} {v} {exact:?}");
        }
    }

    #[test]
    fn a_fourth_harmonic_is_taken_off_to_a_hundredth() {
        let error =
            |turns: f64| 0.0016 * (4.0 * turns * TAU + 0.3).sin() - 0.0007 * (8.0 * turns * TAU).cos();
        let table = Residual::of(error);
        for k in 0..10_000_u32 {
            let phase = Phase(k.wrapping_mul(429_497));
            let taken = f64::from(phase.way_from(table.take_off(phase))) / 4_294_967_296.0;
            assert!((taken - error(phase.turns())).abs() < 2.5e-5, "{k}: {taken}");
        }
        assert_eq!(Residual::NONE.take_off(Phase(123)), Phase(123));
    }

    #[test]
    fn what_is_too_much_for_the_table_is_cut_off() {
        let table = Residual::of(|_| 0.3);
        assert_eq!(Phase(1 << 30).way_from(table.take_off(Phase(1 << 30))), 32_767 << NODE_BITS);
    }
}
