//! Numbers as they stand in a program: exact decimals, so that no unit loses a digit.

use abbe_core::Pos;
use core::fmt;

/// One, in the unit of [`Number`].
const ONE: i64 = 1_000_000_000;

/// Digits in front of the point, without leading zeros.
const MOST_DIGITS: u32 = 9;

/// Farthest length from zero that is read, 100 m: far beyond any stage, and its square fits 96 bits with room to add.
pub const REACH: Pos = Pos::from_pm(100_000_000_000_000);

/// A decimal number in billionths, −10⁹ < n < 10⁹. As millimetres a billionth is a picometre, as seconds a nanosecond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Number(i64);

/// Why bytes are no number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unreadable {
    /// There is no digit.
    NoDigit,
    /// More than nine digits in front of the point.
    TooLarge,
}

/// What a length is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Of 25.4 mm.
    Inch,
    /// As it is.
    Millimetre,
}

impl Number {
    /// A number of billionths.
    pub const fn from_billionths(billionths: i64) -> Self {
        Self(billionths)
    }

    /// Billionths.
    pub const fn billionths(self) -> i64 {
        self.0
    }

    /// The number if it is whole and not negative.
    pub fn whole(self) -> Option<u32> {
        self.multiple_of(ONE)
    }

    /// Its tenths if it has no finer digits and is not negative: 281 for 28.1.
    pub(super) fn tenths(self) -> Option<u32> {
        self.multiple_of(ONE / 10)
    }

    fn multiple_of(self, unit: i64) -> Option<u32> {
        let rest = self.0.checked_rem(unit)?;
        if rest == 0 { u32::try_from(self.0.checked_div(unit)?).ok() } else { None }
    }

    /// As a length, or nothing beyond [`REACH`]. Millimetres are exact; a billionth of an inch is 25.4 pm, and only
    /// that ninth decimal is ever rounded, to the nearest picometre.
    pub fn length(self, unit: Unit) -> Option<Pos> {
        let pm = self.scaled(unit)?;
        if pm.unsigned_abs() <= REACH.pm().unsigned_abs() { Some(Pos::from_pm(pm)) } else { None }
    }

    /// In picometres, without a limit but that of the type.
    pub(super) fn scaled(self, unit: Unit) -> Option<i64> {
        match unit {
            Unit::Millimetre => Some(self.0),
            Unit::Inch => {
                let tenths = i128::from(self.0).saturating_mul(254);
                let half = if tenths < 0 { -5 } else { 5 };
                i64::try_from(tenths.saturating_add(half).checked_div(10)?).ok()
            }
        }
    }

    /// A length as a number, to the nearest billionth; for lengths of less than 10⁹ of the unit.
    pub(super) fn of_length(length: Pos, unit: Unit) -> Self {
        match unit {
            Unit::Millimetre => Self(length.pm()),
            Unit::Inch => {
                let doubled = i128::from(length.pm()).saturating_mul(20).checked_div(254).unwrap_or(0);
                Self((doubled.saturating_add(doubled.signum()) / 2) as i64)
            }
        }
    }

    /// Reads a number from the beginning of `text`; gives it and how many bytes it took. Digits behind the ninth decimal
    /// round to the nearest, halves away from zero.
    pub(super) fn read(text: &[u8]) -> Result<(Self, usize), Unreadable> {
        let mut reader = Reader { text, at: 0 };
        let negative = reader.sign();
        let (whole, whole_digits) = reader.whole()?;
        let (decimals, decimal_digits) = if reader.point() { reader.decimals() } else { (0, 0) };
        if whole_digits == 0 && decimal_digits == 0 {
            return Err(Unreadable::NoDigit);
        }
        let size = whole.saturating_mul(ONE).saturating_add(decimals);
        // Rounding may carry into a tenth digit.
        if size >= ONE.saturating_mul(ONE) {
            return Err(Unreadable::TooLarge);
        }
        Ok((Self(if negative { size.saturating_neg() } else { size }), reader.at))
    }
}

/// Walks through the characters of a number.
struct Reader<'a> {
    text: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    fn advance(&mut self) {
        self.at = self.at.saturating_add(1);
    }

    /// Takes a sign if there is one; true for minus.
    fn sign(&mut self) -> bool {
        let sign = self.peek();
        if matches!(sign, Some(b'+' | b'-')) {
            self.advance();
        }
        sign == Some(b'-')
    }

    fn point(&mut self) -> bool {
        let is_point = self.peek() == Some(b'.');
        if is_point {
            self.advance();
        }
        is_point
    }

    fn digit(&mut self) -> Option<i64> {
        let digit = self.peek().filter(u8::is_ascii_digit)?;
        self.advance();
        Some(i64::from(digit.wrapping_sub(b'0')))
    }

    /// The digits in front of the point and how many there were.
    fn whole(&mut self) -> Result<(i64, u32), Unreadable> {
        let (mut value, mut digits, mut counting): (i64, u32, u32) = (0, 0, 0);
        while let Some(digit) = self.digit() {
            value = value.saturating_mul(10).saturating_add(digit);
            digits = digits.saturating_add(1);
            counting = if value == 0 { 0 } else { counting.saturating_add(1) };
            if counting > MOST_DIGITS {
                return Err(Unreadable::TooLarge);
            }
        }
        Ok((value, digits))
    }

    /// The digits behind the point in billionths and how many there were.
    fn decimals(&mut self) -> (i64, u32) {
        let (mut value, mut digits, mut place) = (0_i64, 0_u32, ONE / 10);
        while let Some(digit) = self.digit() {
            value = value.saturating_add(match digits {
                0..9 => digit.saturating_mul(place),
                9 => i64::from(digit >= 5),
                _ => 0,
            });
            place = place.checked_div(10).unwrap_or(0);
            digits = digits.saturating_add(1);
        }
        (value, digits)
    }
}

impl fmt::Display for Number {
    /// With as many decimals as it needs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 < 0 {
            f.write_str("-")?;
        }
        let size = self.0.unsigned_abs();
        let one = ONE.unsigned_abs();
        fmt::Display::fmt(&size.checked_div(one).unwrap_or(0), f)?;
        let mut rest = size.checked_rem(one).unwrap_or(0);
        if rest > 0 {
            f.write_str(".")?;
        }
        while rest > 0 {
            rest = rest.saturating_mul(10);
            let digit = rest.checked_div(one).unwrap_or(0) as u8;
            fmt::Write::write_char(f, char::from(b'0'.saturating_add(digit)))?;
            rest = rest.checked_rem(one).unwrap_or(0);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(text: &str) -> Result<(i64, usize), Unreadable> {
        Number::read(text.as_bytes()).map(|(number, taken)| (number.billionths(), taken))
    }

    #[test]
    fn decimals_are_exact() {
        for (text, billionths) in [
            ("1", ONE),
            ("+01.50", 1_500_000_000),
            ("-.5", -500_000_000),
            ("5.", 5 * ONE),
            ("0.000000001", 1),
            ("999999999.999999999", ONE * ONE - 1),
            ("000000000000000000000000.25", 250_000_000),
            ("0.30000000000000004", 300_000_000),
            ("-0.0000000005", -1),
            ("0.00000000049999", 0),
        ] {
            assert_eq!(read(text), Ok((billionths, text.len())), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_told() {
        for text in ["", "+", "-", ".", "-.", "x", "--1", "+-1", " 1"] {
            assert_eq!(read(text), Err(Unreadable::NoDigit), "{text}");
        }
        for text in ["1000000000", "999999999.9999999999", "-12345678901234567890"] {
            assert_eq!(read(text), Err(Unreadable::TooLarge), "{text}");
        }
        assert_eq!(read("1.5e3"), Ok((1_500_000_000, 3)));
        assert_eq!(read("1.5.2"), Ok((1_500_000_000, 3)));
    }

    #[test]
    fn an_inch_is_25_4_mm() {
        let inch = |text: &str| Number::read(text.as_bytes()).unwrap().0.length(Unit::Inch).map(Pos::pm);
        assert_eq!(inch("1"), Some(25_400_000_000));
        assert_eq!(inch("-0.00000001"), Some(-254));
        // Only a ninth decimal rounds: 25.4 pm.
        assert_eq!([inch("0.000000001"), inch("-0.000000002")], [Some(25), Some(-51)]);
        assert_eq!(inch("3937.1"), None);
        assert_eq!(Number(100_000 * ONE).length(Unit::Millimetre), Some(REACH));
        assert_eq!(Number(100_000 * ONE + 1).length(Unit::Millimetre), None);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again(billionths in -ONE * ONE + 1..ONE * ONE) {
            let text = Number(billionths).to_string();
            prop_assert_eq!(read(&text), Ok((billionths, text.len())));
        }

        #[test]
        fn inches_are_the_nearest_picometre(billionths in -ONE * ONE + 1..ONE * ONE) {
            let tenths = i128::from(billionths) * 254;
            if let Some(pm) = Number(billionths).scaled(Unit::Inch) {
                prop_assert!((i128::from(pm) * 10 - tenths).abs() <= 5);
            } else {
                prop_assert!(tenths.abs() / 10 >= i128::from(i64::MAX));
            }
        }
    }
}
