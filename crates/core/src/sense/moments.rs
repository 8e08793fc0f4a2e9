//! Sums of powers of a pair of signals, which is all that an ellipse fit needs to remember of its samples.
//!
//! The tick adds integers, a sample at a time; fits read the sums between ticks, in floats.

use super::ellipse::{Ellipse, FIRST, FitError, LARGEST_ALPHA, RATIOS};
use super::phase::Phase;
use core::sync::atomic::{Ordering, compiler_fence};

/// Sums go up to this power.
pub(super) const ORDER: usize = 4;
/// Sums of xⁱyʲ with i + j ≤ 4.
const SUMS: usize = 15;

/// Sums of samples around a centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Moments {
    samples: u32,
    octants: u8,
    centre: [f64; 2],
    /// In the order of [`place`].
    sums: [f64; SUMS],
}

/// Where the sum of xⁱyʲ stands: by order, then by the power of y.
const fn place(i: usize, j: usize) -> usize {
    let order = i.wrapping_add(j);
    (order.wrapping_mul(order.wrapping_add(1)) / 2).wrapping_add(j)
}

impl Moments {
    /// No samples yet, around a centre that should lie inside the ellipse.
    pub fn around(centre: [f64; 2]) -> Self {
        Self { centre, ..Self::default() }
    }

    /// Sums of samples that are all there, (cosine, sine): around the middle of their extremes.
    pub fn of_all(samples: impl Iterator<Item = [f64; 2]> + Clone) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for sample in samples.clone() {
            for ((low, high), value) in low.iter_mut().zip(&mut high).zip(sample) {
                *low = low.min(value);
                *high = high.max(value);
            }
        }
        let middle = |axis: usize| match (low.get(axis), high.get(axis)) {
            (Some(low), Some(high)) if low <= high => (low + high) / 2.0,
            _ => 0.0,
        };
        let mut moments = Self::around([middle(0), middle(1)]);
        samples.for_each(|sample| moments.add(sample));
        moments
    }

    /// One sample, (cosine, sine).
    pub fn add(&mut self, sample: [f64; 2]) {
        let (x, y) = (sample[0] - self.centre[0], sample[1] - self.centre[1]);
        self.samples = self.samples.saturating_add(1);
        self.octants |= 1 << octant(x, y);
        let (xx, yy, xy) = (x * x, y * y, x * y);
        let powers = [
            1.0,
            x,
            y,
            xx,
            xy,
            yy,
            xx * x,
            xx * y,
            x * yy,
            yy * y,
            xx * xx,
            xx * xy,
            xx * yy,
            xy * yy,
            yy * yy,
        ];
        self.sums.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
    }

    /// How many samples.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// The eighths that were seen from the centre, a bit each.
    pub fn octants(&self) -> u8 {
        self.octants
    }

    /// Σ xⁱyʲ around the centre; 0 beyond the fourth power.
    pub fn sum(&self, i: usize, j: usize) -> f64 {
        self.sums.get(place(i, j)).copied().unwrap_or(0.0)
    }

    /// The same samples, each with a part of its weight.
    #[must_use]
    pub fn faded(&self, part: f64) -> Self {
        let samples = libm::round(f64::from(self.samples) * part) as u32;
        Self { samples, sums: self.sums.map(|sum| sum * part), ..*self }
    }

    /// These samples and others, around the same centre; others around another centre are left out.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        if self.centre != other.centre {
            return *self;
        }
        let mut both = Self {
            samples: self.samples.saturating_add(other.samples),
            octants: self.octants | other.octants,
            ..*self
        };
        both.sums.iter_mut().zip(other.sums).for_each(|(sum, more)| *sum += more);
        both
    }

    /// What x and y are counted from.
    pub fn centre(&self) -> [f64; 2] {
        self.centre
    }

    /// The constants of the model from the sums up to the second power alone (the moments estimator): offsets are means,
    /// amplitudes come from variances, the quadrature error from the covariance.
    ///
    /// Right only for samples that cover whole periods evenly; where they do not, [`Ellipse::fit`] is
    /// right still. Cheaper and blunter.
    ///
    /// # Errors
    /// As for the fit.
    pub fn estimate(&self) -> Result<Ellipse, FitError> {
        if (self.samples as usize) < FIRST {
            return Err(FitError::TooFew { samples: self.samples });
        }
        let n = f64::from(self.samples);
        let mean = |i: usize, j: usize| self.sum(i, j) / n;
        let (x, y) = (mean(1, 0), mean(0, 1));
        let (xx, yy, xy) = (mean(2, 0) - x * x, mean(0, 2) - y * y, mean(1, 1) - x * y);
        if !(xx > 0.0 && yy > 0.0) {
            return Err(FitError::Constant);
        }
        if self.octants != u8::MAX {
            return Err(FitError::PartialArc { octants: self.octants });
        }
        let found = Ellipse {
            p: self.centre[0] + x,
            q: self.centre[1] + y,
            r: libm::sqrt(xx / yy),
            alpha: -libm::asin((xy / libm::sqrt(xx * yy)).clamp(-1.0, 1.0)),
            radius: libm::sqrt(2.0 * xx),
        };
        let likely = found.alpha.abs() <= LARGEST_ALPHA && RATIOS.contains(&found.r);
        if likely { Ok(found) } else { Err(FitError::Unlikely(found)) }
    }
}

fn octant(x: f64, y: f64) -> u8 {
    let (left, below, steep) = (x < 0.0, y < 0.0, y.abs() > x.abs());
    let in_quadrant = u8::from(steep);
    match (left, below) {
        (false, false) => in_quadrant,
        (true, false) => 3_u8.saturating_sub(in_quadrant),
        (true, true) => 4_u8.saturating_add(in_quadrant),
        (false, true) => 7_u8.saturating_sub(in_quadrant),
    }
}

/// Samples of one block at most.
pub const BLOCK: u16 = 2048;
/// Samples are brought to ± this by a shift, before they are summed.
const REACH: i32 = 1 << 12;
/// Bits that are rounded off a square before it goes into a higher power.
const SQUARE_BITS: u32 = 9;
/// Sums of 64 bits: x², xy, y², and all of the third and fourth power.
const LONG: usize = 12;

/// The same sums in integers, for the tick: up to [`BLOCK`] samples around a whole centre, brought to 13 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Block {
    samples: u16,
    octants: u8,
    shift: u8,
    centre: [i16; 2],
    short: [i32; 2],
    long: [i64; LONG],
    /// The last sample, while its higher powers are still to come.
    begun: Option<[i32; 2]>,
}

impl Block {
    /// An empty block of samples that lie within `reach` of `centre`; farther ones are counted at the edge.
    pub fn around(centre: [i16; 2], reach: u16) -> Self {
        let shift = reach.max(1).ilog2().saturating_sub(REACH.ilog2().saturating_sub(1)) as u8;
        Self { samples: 0, octants: 0, shift, centre, short: [0; 2], long: [0; LONG], begun: None }
    }

    /// One sample, (cosine, sine), whose phase is known. A full block takes no more.
    pub fn add(&mut self, cos: i16, sin: i16, phase: Phase) {
        self.begin(cos, sin, phase);
        self.go_on();
    }

    /// The half of [`Block::add`] that must be done at once; [`Block::go_on`] is the other. False when it is full.
    #[inline]
    pub fn begin(&mut self, cos: i16, sin: i16, phase: Phase) -> bool {
        if self.samples >= BLOCK {
            return false;
        }
        self.octants |= 1 << phase.octant();
        self.begin_shared(cos, sin);
        true
    }

    /// The same for who keeps an eye on the eighths by himself, and on the number of samples: at most [`BLOCK`].
    #[inline]
    pub(super) fn begin_shared(&mut self, cos: i16, sin: i16) {
        self.samples = self.samples.wrapping_add(1);
        let [p, q] = self.centre;
        let (x, y) = (self.near(cos, p), self.near(sin, q));
        self.begun = Some([x, y]);
        let [sum_x, sum_y] = &mut self.short;
        *sum_x = sum_x.wrapping_add(x);
        *sum_y = sum_y.wrapping_add(y);
        let squares = [x.wrapping_mul(x), x.wrapping_mul(y), y.wrapping_mul(y)];
        self.long.iter_mut().zip(squares).for_each(|(sum, square)| *sum = sum.wrapping_add(square.into()));
    }

    /// Takes note that every eighth of the period was seen.
    pub(super) fn round(self) -> Self {
        Self { octants: u8::MAX, ..self }
    }

    /// Adds the higher powers of the sample that was begun; false when there is none.
    #[inline(never)]
    pub fn go_on(&mut self) -> bool {
        let Some([x, y]) = self.begun.take() else { return false };
        // At most 2¹⁵ each, so that no product leaves a word. The rounding is 10⁻⁴ of a sample at worst, and it is
        // another one in every sample.
        let [xx, xy, yy] = [x.wrapping_mul(x), x.wrapping_mul(y), y.wrapping_mul(y)]
            .map(|square| square.wrapping_add(1 << (SQUARE_BITS - 1)) >> SQUARE_BITS);
        let [_, _, _, higher @ ..] = &mut self.long;
        let factors = [(xx, x), (xx, y), (yy, x), (yy, y), (xx, xx), (xx, xy), (xx, yy), (xy, yy), (yy, yy)];
        for (sum, (a, b)) in higher.iter_mut().zip(factors) {
            *sum = sum.wrapping_add(i64::from(a.wrapping_mul(b)));
            // One after another: what the compiler puts off costs registers that a small processor does not have.
            compiler_fence(Ordering::SeqCst);
        }
        true
    }

    #[inline]
    fn near(&self, code: i16, centre: i16) -> i32 {
        let way = i32::from(code).wrapping_sub(i32::from(centre)) >> (self.shift & 15);
        way.clamp(REACH.wrapping_neg(), REACH)
    }

    /// How many samples.
    pub fn samples(&self) -> u16 {
        self.samples
    }

    /// Every eighth of the period was seen.
    #[inline]
    pub fn is_round(&self) -> bool {
        self.octants == u8::MAX
    }

    /// The sums as a fit reads them.
    pub fn moments(&self) -> Moments {
        let unit = libm::ldexp(1.0, i32::from(self.shift));
        // The shift cut off half of the last bit that is left, in the mean.
        let cut = (unit - 1.0) / 2.0;
        let mut sums = [0.0; SUMS];
        let integers = [i64::from(self.samples), i64::from(self.short[0]), i64::from(self.short[1])];
        // Third powers hold one rounded square, fourth powers two.
        let square = unit * unit * libm::ldexp(1.0, SQUARE_BITS as i32);
        let units = [(1, 1.0), (2, unit), (3, unit * unit), (4, square * unit), (5, square * square)];
        let units = units.into_iter().flat_map(|(times, unit)| core::iter::repeat_n(unit, times));
        for ((sum, integer), unit) in sums.iter_mut().zip(integers.into_iter().chain(self.long)).zip(units) {
            *sum = integer as f64 * unit;
        }
        Moments {
            samples: u32::from(self.samples),
            octants: self.octants,
            centre: self.centre.map(|code| f64::from(code) + cut),
            sums,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sense::phase::polar;
    use core::f64::consts::TAU;

    fn codes(ellipse: Ellipse, number: u32, periods: f64) -> Vec<[i16; 2]> {
        let Ellipse { p, q, r, alpha, radius } = ellipse;
        (0..number)
            .map(|k| {
                let angle = f64::from(k) / f64::from(number) * TAU * periods;
                let sin = (angle - alpha).sin();
                [radius * angle.cos() + p, radius / r * sin + q].map(|v| v.round() as i16)
            })
            .collect()
    }

    const POOR: Ellipse = Ellipse { p: 1250.0, q: -750.0, r: 1.0 / 1.08, alpha: -0.07, radius: 25_000.0 };

    #[test]
    fn a_block_of_integers_and_the_sums_in_floats_give_the_same_ellipse() {
        let codes = codes(POOR, 2000, 17.3);
        let mut block = Block::around([0, 0], 32_767);
        for [cos, sin] in &codes {
            block.add(*cos, *sin, polar((*sin).into(), (*cos).into()).phase);
        }
        assert!(block.is_round() && block.samples() == 2000);
        let (short, long) = (
            Ellipse::fit(&block.moments()).unwrap(),
            Ellipse::fit(&Moments::of_all(codes.iter().map(|code| code.map(f64::from)))).unwrap(),
        );
        // A code in 25 000 is 0.005 nm of 800.
        assert!((short.p - long.p).abs() < 1.0 && (short.q - long.q).abs() < 1.0, "{short:?} {long:?}");
        assert!(
            (short.r - long.r).abs() < 4e-5 && (short.alpha - long.alpha).abs() < 4e-5,
            "{short:?} {long:?}"
        );
        assert!((long.p - POOR.p).abs() < 0.1 && (short.radius - POOR.radius).abs() < 1.0, "{long:?}");
    }

    #[test]
    fn no_sum_of_a_full_block_wraps() {
        let mut block = Block::around([0, 0], 32_767);
        for _ in 0..3000 {
            block.add(i16::MIN, i16::MIN, Phase(0));
        }
        let moments = block.moments();
        assert_eq!(moments.samples(), u32::from(BLOCK));
        let fourth = moments.sum(4, 0) / f64::from(BLOCK);
        assert!((fourth.powf(0.25) - 32_768.0).abs() < 1.0, "{fourth}");
        assert!(moments.sum(3, 0) < 0.0 && (moments.sum(1, 3) - moments.sum(4, 0)).abs() < 1.0);
    }

    #[test]
    fn the_moments_estimator_is_right_over_whole_periods_and_wrong_over_a_part() {
        let sums =
            |periods| Moments::of_all(codes(POOR, 4000, periods).into_iter().map(|c| c.map(f64::from)));
        let whole = sums(20.0).estimate().unwrap();
        assert!((whole.p - POOR.p).abs() < 1.0 && (whole.alpha - POOR.alpha).abs() < 1e-4, "{whole:?}");
        let part = sums(1.4);
        assert!((part.estimate().unwrap().p - POOR.p).abs() > 500.0);
        assert!((Ellipse::fit(&part).unwrap().p - POOR.p).abs() < 1.0);
    }

    #[test]
    fn eighths_are_counted_as_the_phase_counts_them() {
        for k in 0..64 {
            let angle = (f64::from(k) + 0.5) / 64.0 * TAU;
            let (sin, cos) = (angle.sin(), angle.cos());
            assert_eq!(octant(cos, sin), polar((sin * 1e6) as i32, (cos * 1e6) as i32).phase.octant());
        }
    }
}
