//! Subdivision by a table of arctangents, as paper B does it (row B6).
//!
//! The quadrant comes from the signs, each quadrant is split at π/4 so that the ratio of the signals never exceeds 1,
//! and a table says how many steps lie below that ratio. Paper B divides and looks the quotient up; here the table holds
//! the ratios at which a step begins, so that no division is needed and no step is off by a rounding of the quotient.

use crate::wide;

/// A vector folded into the first eighth of a turn: 0 ≤ minor ≤ major.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Octant {
    /// The longer component.
    pub(super) major: u32,
    /// The shorter.
    pub(super) minor: u32,
    /// Beyond π/4 of its quadrant.
    swapped: bool,
    left: bool,
    below: bool,
}

impl Octant {
    #[inline]
    pub(super) fn fold(sin: i32, cos: i32) -> Self {
        let (x, y) = (cos.unsigned_abs(), sin.unsigned_abs());
        let swapped = y > x;
        let (major, minor) = if swapped { (y, x) } else { (x, y) };
        Self { major, minor, swapped, left: cos < 0, below: sin < 0 }
    }

    /// The angle in the whole turn of one in the first eighth; `quarter` is a quarter of a turn in its unit. A whole
    /// turn is what its unit makes of it: 2³² wraps to 0.
    #[inline]
    pub(super) fn unfold(self, angle: u32, quarter: u32) -> u32 {
        let in_quadrant = if self.swapped { quarter.wrapping_sub(angle) } else { angle };
        let half = quarter.wrapping_mul(2);
        let in_half = if self.left { half.wrapping_sub(in_quadrant) } else { in_quadrant };
        if self.below { half.wrapping_mul(2).wrapping_sub(in_half) } else { in_half }
    }
}

/// Steps of a period at most.
pub const LARGEST_FACTOR: u16 = 4096;
/// Steps begin in an eighth of a period at most so many times.
const ENTRIES: usize = LARGEST_FACTOR as usize / 8;

/// A table that subdivides a period into a number of steps.
#[derive(Clone, Debug)]
pub struct Subdivider {
    factor: u16,
    /// Tangents at which the next step begins, 2⁻³², rising; behind them nothing is ever reached.
    tangents: [u32; ENTRIES],
    entries: usize,
}

/// A factor by which a period cannot be divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadFactor(pub u16);

impl core::fmt::Display for BadFactor {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self(factor) = self;
        write!(
            f,
            "a period cannot be divided by {factor}: the table takes multiples of 4 from 4 to {LARGEST_FACTOR}"
        )
    }
}

impl core::error::Error for BadFactor {}

impl Subdivider {
    /// The table for `factor` steps in a period. Floats: before the first tick, not in one.
    ///
    /// # Errors
    /// The factor is not a multiple of 4 in 4 … 4096: the constants of the quadrants, 0, n/4, n/2 and 3n/4, must be
    /// whole. [`Phase::step_of`](super::phase::Phase::step_of) takes any.
    pub fn new(factor: u16) -> Result<Self, BadFactor> {
        if factor == 0 || factor > LARGEST_FACTOR || !factor.is_multiple_of(4) {
            return Err(BadFactor(factor));
        }
        let step = core::f64::consts::TAU / f64::from(factor);
        let mut table = Self { factor, tangents: [u32::MAX; ENTRIES], entries: 0 };
        for (entry, tangent) in (0_u32..).zip(&mut table.tangents) {
            let angle = (f64::from(entry) + 0.5) * step;
            if angle > core::f64::consts::FRAC_PI_4 {
                break;
            }
            // An angle of π/4 itself has tangent 1, which is the last ratio that there is.
            *tangent = libm::round(libm::ldexp(libm::tan(angle), 32)).min(4_294_967_295.0) as u32;
            table.entries = table.entries.saturating_add(1);
        }
        Ok(table)
    }

    /// Steps of a period.
    pub fn factor(&self) -> u16 {
        self.factor
    }

    /// The nearest step of the angle of (`cos`, `sin`), 0 … factor − 1; 0 for the zero vector.
    ///
    /// Exact but for halves, which the quantised table may round either way: at most ½ step from the angle of the two
    /// numbers (`is_half_a_step_off_at_most_in_every_entry_and_quadrant`).
    #[inline]
    pub fn step(&self, sin: i32, cos: i32) -> u16 {
        let folded = Octant::fold(sin, cos);
        let begins = self.tangents.get(..self.entries).unwrap_or_default();
        // minor / major ≥ tangent, without the division.
        let reached = |tangent: &u32| u64::from(folded.minor) << 32 >= wide::mul_u32(folded.major, *tangent);
        let below = if folded.major == 0 { 0 } else { begins.partition_point(reached) };
        let step = folded.unfold(below as u32, u32::from(self.factor / 4));
        if step >= u32::from(self.factor) { 0 } else { step as u16 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sense::phase::polar;
    use core::f64::consts::TAU;

    /// Steps from the angle of (`cos`, `sin`) to `step`.
    fn off(step: u16, factor: u16, angle: f64) -> f64 {
        let off = f64::from(step) - angle / TAU * f64::from(factor);
        off - (off / f64::from(factor)).round() * f64::from(factor)
    }

    /// Both sides of every boundary, in the whole turn, at the amplitude of an 8-bit and of a 16-bit converter.
    fn around_every_boundary(factor: u16, mut look: impl FnMut(f64)) {
        for boundary in 0..factor {
            let at = (f64::from(boundary) + 0.5) / f64::from(factor) * TAU;
            for aside in [-0.4, -1e-3, -1e-6, 1e-6, 1e-3, 0.4] {
                look(at + aside / f64::from(factor) * TAU);
            }
        }
    }

    #[test]
    fn is_half_a_step_off_at_most_in_every_entry_and_quadrant() {
        for factor in [4, 8, 12, 20, 100, 160, 1000, 1024, 4096] {
            let table = Subdivider::new(factor).unwrap();
            let mut seen = vec![false; usize::from(factor)];
            for amplitude in [120.0, 30_000.0, 1e9] {
                around_every_boundary(factor, |angle| {
                    let (sin, cos) = ((amplitude * angle.sin()) as i32, (amplitude * angle.cos()) as i32);
                    let step = table.step(sin, cos);
                    seen[usize::from(step)] = true;
                    let off = off(step, factor, f64::from(sin).atan2(f64::from(cos)));
                    assert!(off.abs() <= 0.5 + 1e-6, "{factor}, {angle}: {off}");
                });
            }
            assert!(seen.iter().all(|&seen| seen), "{factor}");
        }
    }

    /// Row B6: ½ step of rounding, and ½ step of a quadrature error of 1.125°.
    #[test]
    fn a_quadrature_error_of_1_125_degrees_costs_half_a_step_before_rounding() {
        let (table, error) = (Subdivider::new(160).unwrap(), 1.125_f64.to_radians());
        let (mut before, mut after): (f64, f64) = (0.0, 0.0);
        for at in 0..160_000 {
            let angle = f64::from(at) / 160_000.0 * TAU;
            for error in [error, -error] {
                let (sin, cos) = (1e9 * (angle + error).sin(), 1e9 * angle.cos());
                let seen = off(0, 160, angle) - off(0, 160, sin.atan2(cos));
                before = before.max((seen - (seen / 160.0).round() * 160.0).abs());
                after = after.max(off(table.step(sin as i32, cos as i32), 160, angle).abs());
            }
        }
        assert!((0.49..=0.5 + 1e-3).contains(&before), "{before}");
        assert!(after <= 1.0, "{after}");
    }

    /// Every pair of codes of an 8-bit converter.
    #[test]
    fn table_and_phase_agree_but_for_halves() {
        let table = Subdivider::new(160).unwrap();
        for sin in -128..128_i32 {
            for cos in -128..128_i32 {
                let (step, fine) = (table.step(sin, cos), polar(sin, cos).phase);
                if step != fine.step_of(160) {
                    let off = off(step, 160, f64::from(sin).atan2(f64::from(cos)));
                    assert!((off.abs() - 0.5).abs() < 1e-4, "{sin}, {cos}: {off}");
                }
            }
        }
    }

    #[test]
    fn a_factor_without_whole_quadrants_is_refused() {
        for factor in [0, 2, 6, 4098, 4100, u16::MAX] {
            assert_eq!(Subdivider::new(factor).unwrap_err(), BadFactor(factor));
        }
        assert!(BadFactor(6).to_string().contains("multiples of 4"));
    }
}
