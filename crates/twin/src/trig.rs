//! Sine of an angle in turns: fast, and the same on every platform.

/// sin(2π·`turns`), to 4·10⁻⁹.
pub fn sin_turns(turns: f64) -> f64 {
    // Folded to a quarter turn either side of zero.
    let t = turns - floor(turns + 0.5) as f64;
    let t = if t > 0.25 {
        0.5 - t
    } else if t < -0.25 {
        -0.5 - t
    } else {
        t
    };
    let x = core::f64::consts::TAU * t;
    let s = x * x;
    // Taylor to x¹³: the next term is 7·10⁻¹⁰ at a quarter turn.
    let p = 1.0 / 6_227_020_800.0;
    let p = p * s - 1.0 / 39_916_800.0;
    let p = p * s + 1.0 / 362_880.0;
    let p = p * s - 1.0 / 5040.0;
    let p = p * s + 1.0 / 120.0;
    let p = p * s - 1.0 / 6.0;
    x + x * s * p
}

/// The next whole number at or below `x`, for |x| < 2⁶³: without a call, unlike the library's.
pub fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(towards_zero as f64 > x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_library_all_the_way_round() {
        for i in -3000..3000 {
            let turns = f64::from(i) / 700.0;
            let expected = libm::sin(core::f64::consts::TAU * turns);
            assert!((sin_turns(turns) - expected).abs() < 4e-9, "{turns}");
        }
    }
}
