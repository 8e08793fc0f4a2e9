//! Products wider than a word, for a processor that has none.
//!
//! A Cortex-M0+ multiplies 32 × 32 bit to 32. What the compiler calls for a 64-bit product costs some 80 cycles there;
//! four products of halves cost 20. Larger processors multiply wide in one instruction and do so here. Both give the
//! same bits (`halves_give_what_the_machine_gives`).

/// Whether the processor multiplies 32 × 32 bit to 64. Of the Cortex-M family only the M0+ does not, and only it has no
/// compare-and-swap, by which it can be told at compile time.
const MULTIPLIES_WIDE: bool = cfg!(target_has_atomic = "32");

/// `a · b`, exact.
#[inline]
pub const fn mul_u32(a: u32, b: u32) -> u64 {
    if MULTIPLIES_WIDE { (a as u64).wrapping_mul(b as u64) } else { mul_u32_by_halves(a, b) }
}

#[inline]
const fn mul_u32_by_halves(a: u32, b: u32) -> u64 {
    let (a_low, a_high) = (a & 0xffff, a >> 16);
    let (b_low, b_high) = (b & 0xffff, b >> 16);
    let low = a_low.wrapping_mul(b_low);
    // Neither sum can wrap: (2¹⁶ − 1)² + 2¹⁶ − 1 < 2³².
    let middle = a_low.wrapping_mul(b_high).wrapping_add(low >> 16);
    let other = a_high.wrapping_mul(b_low).wrapping_add(middle & 0xffff);
    let high = a_high.wrapping_mul(b_high).wrapping_add(middle >> 16).wrapping_add(other >> 16);
    ((high as u64) << 32) | ((other << 16) | (low & 0xffff)) as u64
}

/// `a · b`, exact.
#[inline]
pub const fn mul_i32(a: i32, b: i32) -> i64 {
    if MULTIPLIES_WIDE { (a as i64).wrapping_mul(b as i64) } else { mul_i32_by_halves(a, b) }
}

#[inline]
const fn mul_i32_by_halves(a: i32, b: i32) -> i64 {
    let (a_low, a_high) = (a & 0xffff, a >> 16);
    let (b_low, b_high) = (b & 0xffff, b >> 16);
    let low = a_low.wrapping_mul(b_low).cast_unsigned();
    // Neither sum can wrap: − 2¹⁵ (2¹⁶ − 1) … (2¹⁵ − 1)(2¹⁶ − 1) + 2¹⁶ − 1.
    let middle = a_low.wrapping_mul(b_high).wrapping_add((low >> 16).cast_signed());
    let other = a_high.wrapping_mul(b_low).wrapping_add(middle & 0xffff);
    let high = a_high.wrapping_mul(b_high).wrapping_add(middle >> 16).wrapping_add(other >> 16);
    ((high as i64) << 32) | ((other.cast_unsigned() << 16) | (low & 0xffff)) as i64
}

/// `a · b`, exact.
#[inline]
pub const fn mul_i32_i16(a: i32, b: i16) -> i64 {
    if MULTIPLIES_WIDE { (a as i64).wrapping_mul(b as i64) } else { mul_i32_i16_by_halves(a, b) }
}

#[inline]
const fn mul_i32_i16_by_halves(a: i32, b: i16) -> i64 {
    // The lower product is above − 2³¹: 2¹⁵ (2¹⁶ − 1).
    let (low, high) = ((a & 0xffff).wrapping_mul(b as i32), (a >> 16).wrapping_mul(b as i32));
    ((high as i64) << 16).wrapping_add(low as i64)
}

/// `a · b`, exact.
#[inline]
pub const fn mul_u32_u16(a: u32, b: u16) -> u64 {
    if MULTIPLIES_WIDE { (a as u64).wrapping_mul(b as u64) } else { mul_u32_u16_by_halves(a, b) }
}

#[inline]
const fn mul_u32_u16_by_halves(a: u32, b: u16) -> u64 {
    let (low, high) = ((a & 0xffff).wrapping_mul(b as u32), (a >> 16).wrapping_mul(b as u32));
    ((high as u64) << 16).wrapping_add(low as u64)
}

/// `a · b`, its low 64 bits: exact while the product fits.
#[inline]
pub const fn mul_u64_u32(a: u64, b: u32) -> u64 {
    if MULTIPLIES_WIDE { a.wrapping_mul(b as u64) } else { mul_u64_u32_by_halves(a, b) }
}

#[inline]
const fn mul_u64_u32_by_halves(a: u64, b: u32) -> u64 {
    let high = ((a >> 32) as u32).wrapping_mul(b);
    mul_u32_by_halves(a as u32, b).wrapping_add((high as u64) << 32)
}

/// `a · b`, its low 64 bits: exact while the product fits.
#[inline]
pub const fn mul_i64_i32(a: i64, b: i32) -> i64 {
    if MULTIPLIES_WIDE { a.wrapping_mul(b as i64) } else { mul_i64_i32_by_halves(a, b) }
}

#[inline]
const fn mul_i64_i32_by_halves(a: i64, b: i32) -> i64 {
    let size = mul_u64_u32_by_halves(a.unsigned_abs(), b.unsigned_abs()).cast_signed();
    if (a < 0) == (b < 0) { size } else { size.wrapping_neg() }
}

/// Zeros before the first one of a word that is not 0.
#[inline]
pub fn leading_zeros(word: u32) -> u32 {
    if MULTIPLIES_WIDE { word.leading_zeros() } else { leading_zeros_by_product(word) }
}

/// A routine of the compiler's library takes three times as long. All ones below the first one, times a number whose
/// five-bit pieces are all different (Leiserson, Prokop, Randall, 1998), say which of 32 words of that kind it is.
#[inline]
fn leading_zeros_by_product(word: u32) -> u32 {
    const PIECES: u32 = 0x07c4_acdd;
    static ZEROS: [u8; 32] = zeros();
    #[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "while compiling")]
    const fn zeros() -> [u8; 32] {
        let (mut zeros, mut ones) = ([0; 32], 0);
        while ones < 32 {
            let place = (u32::MAX >> (31 - ones)).wrapping_mul(PIECES) >> 27;
            zeros[place as usize] = 31 - ones as u8;
            ones += 1;
        }
        zeros
    }
    let ones = word | word >> 1;
    let ones = ones | ones >> 2;
    let ones = ones | ones >> 4;
    let ones = ones | ones >> 8;
    let ones = ones | ones >> 16;
    ZEROS.get((ones.wrapping_mul(PIECES) >> 27) as usize).copied().map_or(0, u32::from)
}

/// Whether `value` lies within ± `limit`, 0 ≤ `limit` < 2⁶². Wraps instead of saturating, which a processor of 32 bit
/// does in a quarter of the time.
#[inline]
pub const fn is_within(value: i64, limit: i64) -> bool {
    value.wrapping_add(limit).cast_unsigned() <= limit.wrapping_add(limit).cast_unsigned()
}

/// `way · gain / 2^shift`, rounded to nearest, halves away from zero; `way` ≥ 0, `shift` ≤ 100, and the result fits
/// 62 bits.
#[inline]
pub fn scaled(way: i64, gain: i64, shift: u32) -> i64 {
    let (way, size) = (way.cast_unsigned(), gain.unsigned_abs());
    let doubled = if MULTIPLIES_WIDE {
        shifted_by_machine(way, size, shift)
    } else {
        shifted_by_words(way, size, shift)
    };
    let size = (doubled.wrapping_add(1) >> 1).cast_signed();
    if gain < 0 { size.wrapping_neg() } else { size }
}

/// `2 a · b / 2^shift`, the rest cut off.
fn shifted_by_machine(a: u64, b: u64, shift: u32) -> u64 {
    let product = u128::from(a).wrapping_mul(u128::from(b));
    (product.wrapping_mul(2) >> (shift & 127)) as u64
}

/// The same from words: four products, then the two words that are wanted, by shifts of a word.
fn shifted_by_words(a: u64, b: u64, shift: u32) -> u64 {
    let (a, a_high) = (a as u32, (a >> 32) as u32);
    let (b, b_high) = (b as u32, (b >> 32) as u32);
    let low = mul_u32_by_halves(a, b);
    let one = mul_u32_by_halves(a, b_high);
    let other = mul_u32_by_halves(a_high, b);
    let high = mul_u32_by_halves(a_high, b_high);
    // Neither sum can wrap, as in the product of halves.
    let middle = one.wrapping_add(low >> 32);
    let other = other.wrapping_add(middle & 0xffff_ffff);
    let high = high.wrapping_add(middle >> 32).wrapping_add(other >> 32);
    let words = [low as u32, other as u32, high as u32, (high >> 32) as u32];
    if shift == 0 {
        return u64::from(words[0]).wrapping_add(u64::from(words[1]) << 32).wrapping_mul(2);
    }
    let shift = shift.wrapping_sub(1);
    let bits = shift & 31;
    // A shift by 32 is none on this processor's terms: it is done in two.
    let pair = |low: u32, high: u32| (low >> bits) | ((high << 1) << (31 ^ bits));
    let (low, high) = match shift >> 5 {
        0 => (pair(words[0], words[1]), pair(words[1], words[2])),
        1 => (pair(words[1], words[2]), pair(words[2], words[3])),
        2 => (pair(words[2], words[3]), pair(words[3], 0)),
        _ => (pair(words[3], 0), 0),
    };
    u64::from(low) | (u64::from(high) << 32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Numbers of every size, the ends among them.
    fn any_size() -> impl Strategy<Value = i64> {
        (any::<i64>(), 0u32..64, 0u8..8).prop_map(|(number, shift, end)| match end {
            0 => i64::MAX >> shift,
            1 => i64::MIN >> shift,
            _ => number >> shift,
        })
    }

    proptest! {
        #[test]
        fn halves_give_what_the_machine_gives(a in any_size(), b in any_size(), shift in 0u32..=100) {
            let (x, y) = (a as u32, b as u32);
            prop_assert_eq!(mul_u32_by_halves(x, y), u64::from(x) * u64::from(y));
            let (p, q) = (a as i32, b as i32);
            prop_assert_eq!(mul_i32_by_halves(p, q), i64::from(p) * i64::from(q));
            prop_assert_eq!(mul_i32_i16_by_halves(p, b as i16), i64::from(p) * i64::from(b as i16));
            prop_assert_eq!(mul_u32_u16_by_halves(x, b as u16), u64::from(x) * u64::from(b as u16));
            prop_assert_eq!(leading_zeros_by_product(x | 1), (x | 1).leading_zeros());
            prop_assert_eq!(mul_u64_u32_by_halves(a as u64, y), (a as u64).wrapping_mul(u64::from(y)));
            prop_assert_eq!(mul_i64_i32_by_halves(a, q), a.wrapping_mul(i64::from(q)));
            let (way, size) = (a.unsigned_abs(), b.unsigned_abs());
            let exact = (u128::from(way) * u128::from(size)) >> shift;
            prop_assume!(exact < 1 << 62);
            prop_assert_eq!(shifted_by_words(way, size, shift), shifted_by_machine(way, size, shift));
        }
    }

    proptest! {
        #[test]
        fn within_is_within(value in any_size(), limit in any_size()) {
            let limit = limit & (i64::MAX >> 1);
            prop_assert_eq!(is_within(value, limit), value.unsigned_abs() <= limit.unsigned_abs());
        }
    }

    #[test]
    fn a_half_goes_away_from_zero() {
        assert_eq!([scaled(3, 1, 1), scaled(3, -1, 1)], [2, -2]);
        assert_eq!([scaled(1, i64::MAX, 63), scaled(1, i64::MIN + 1, 63)], [1, -1]);
        assert_eq!(scaled(i64::MAX, i64::MAX, 100), 1 << 26);
        assert_eq!(scaled(7, -5, 0), -35);
    }
}
