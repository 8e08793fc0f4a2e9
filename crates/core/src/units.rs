//! Quantities with their unit in the type.
//!
//! Inside the tick a position is an integer number of picometres: whole nanometres would quantise the speed (one
//! nanometre a tick is 10 µm/s at 10 kHz) and the subdivision of a fine grating.

use crate::wide;
use core::fmt;
use core::ops::{Add, Neg, Sub};

/// Picometres in one millimetre.
pub const PM_PER_MM: f64 = 1e9;
/// Picometres in one micrometre.
pub const PM_PER_UM: f64 = 1e6;

/// A position or a distance in picometres; ±9.2 km fits. Addition and subtraction saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pos(i64);

impl Pos {
    /// The origin, or no distance at all.
    pub const ZERO: Self = Self(0);

    /// A position of `pm` picometres.
    pub const fn from_pm(pm: i64) -> Self {
        Self(pm)
    }

    /// A position from millimetres, rounded to the nearest picometre; NaN gives zero. For the edges, not the tick.
    pub fn from_mm(mm: f64) -> Self {
        Self(libm::round(mm * PM_PER_MM) as i64)
    }

    /// A position from micrometres, rounded to the nearest picometre; NaN gives zero. For the edges, not the tick.
    pub fn from_um(um: f64) -> Self {
        Self(libm::round(um * PM_PER_UM) as i64)
    }

    /// Picometres.
    pub const fn pm(self) -> i64 {
        self.0
    }

    /// Millimetres. For the edges, not the tick.
    pub fn mm(self) -> f64 {
        self.0 as f64 / PM_PER_MM
    }

    /// Micrometres. For the edges, not the tick.
    pub fn um(self) -> f64 {
        self.0 as f64 / PM_PER_UM
    }

    /// The way from another position to this one. For the tick: unlike the operator it wraps, beyond 9.2 km.
    #[must_use]
    #[inline]
    pub const fn way_from(self, other: Self) -> i64 {
        self.0.wrapping_sub(other.0)
    }

    /// The distance from the origin.
    #[must_use]
    pub const fn abs(self) -> Self {
        Self(self.0.saturating_abs())
    }
}

/// A position written in millimetres with six decimals: nanometres. In integers, because writing floats leaves panic
/// paths in the standard library.
#[derive(Clone, Copy, Debug)]
pub struct InMm(pub Pos);

/// A position written in micrometres with one decimal.
#[derive(Clone, Copy, Debug)]
pub struct InUm(pub Pos);

impl fmt::Display for InMm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_decimal(f, self.0, 1_000_000_000, 1_000)
    }
}

impl fmt::Display for InUm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_decimal(f, self.0, 1_000_000, 100_000)
    }
}

/// Writes `position` in `unit`s with decimals down to `least` (both powers of ten, picometres), cut, not rounded.
fn write_decimal(f: &mut fmt::Formatter<'_>, position: Pos, unit: u64, least: u64) -> fmt::Result {
    let size = position.0.unsigned_abs();
    if position.0 < 0 {
        f.write_str("-")?;
    }
    fmt::Display::fmt(&size.checked_div(unit).unwrap_or(0), f)?;
    f.write_str(".")?;
    let mut digit = unit;
    while digit > least {
        digit = digit.checked_div(10).unwrap_or(0);
        let number = size.checked_div(digit).unwrap_or(0).checked_rem(10).unwrap_or(0) as u8;
        fmt::Write::write_char(f, char::from(b'0'.saturating_add(number)))?;
    }
    Ok(())
}

impl Add for Pos {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Pos {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Neg for Pos {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

/// A number of encoder counts, extended to 64 bit. Addition and subtraction saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Counts(i64);

impl Counts {
    /// No counts.
    pub const ZERO: Self = Self(0);

    /// `n` counts.
    pub const fn new(n: i64) -> Self {
        Self(n)
    }

    /// How many.
    pub const fn get(self) -> i64 {
        self.0
    }

    /// The distance these counts stand for when one count is `count_pm` picometres.
    pub const fn to_pos(self, count_pm: i32) -> Pos {
        let few = self.0 as i32;
        // Travels of real stages are a short product.
        if few as i64 == self.0 {
            Pos(wide::mul_i32(few, count_pm))
        } else {
            Pos(self.0.saturating_mul(count_pm as i64))
        }
    }
}

impl Add for Counts {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Counts {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_saturate_instead_of_wrapping() {
        let far = Pos::from_pm(i64::MAX);
        assert_eq!(far + Pos::from_pm(1), far);
        assert_eq!(-Pos::from_pm(i64::MIN), far);
        assert_eq!(Counts::new(i64::MAX) + Counts::new(1), Counts::new(i64::MAX));
    }

    #[test]
    fn positions_write_themselves_without_floats() {
        let text = |pm| (InMm(Pos::from_pm(pm)).to_string(), InUm(Pos::from_pm(pm)).to_string());
        assert_eq!(text(100_001_000_000), ("100.001000".into(), "100001.0".into()));
        assert_eq!(text(-1_500_000), ("-0.001500".into(), "-1.5".into()));
        assert_eq!(text(0), ("0.000000".into(), "0.0".into()));
        assert_eq!(text(999_999_999), ("0.999999".into(), "999.9".into()));
    }

    #[test]
    fn millimetres_survive_the_round_trip_to_a_picometre() {
        for mm in [-3.25, 0.0, 0.000_000_001, 12.345_678_9, 100.0] {
            assert!((Pos::from_mm(mm).mm() - mm).abs() < 1e-9, "{mm}");
        }
        assert_eq!(Pos::from_mm(f64::NAN), Pos::ZERO);
    }
}
