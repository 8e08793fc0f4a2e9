//! Where a position is expected next, from where it went: counts lost or won by whole periods show here and nowhere else.
//!
//! Count and phase still agree when a counter loses four counts between two samples, or eight. But the position jumps by a
//! period, and no stage does: that would take 80 m/s² of 0.8 µm at 10 kHz. A second-order (α-β) filter expects each
//! position; one that is more than half a period beside it strays. A sample that came late strays, too, and the next one is
//! back on course; [`IN_A_ROW`](super::health::IN_A_ROW) in a row are lost counts. (Two late ones in a row pass for lost
//! counts while the stage goes 0.3 to 0.5 periods in a tick: a fault too many rather than one too few.)

use super::health::IN_A_ROW;
use super::periods::Periods;

/// Bits of a period; positions wrap after ± 128 periods, and half of that in a tick is 0.5 m/s.
const BITS: u32 = 24;
/// 32 bits less these.
const CUT: u32 = 32_u32.saturating_sub(BITS);
/// A position farther than this from the expected one strays. A steady acceleration lags by four times its way in a
/// tick, so one of P/8 · fs² (10 m/s² for 0.8 µm at 10 kHz) strays as well.
const STRAYS: u32 = 1 << (BITS - 1);

/// Nothing was seen yet; one position was. Two make a speed, whatever it is.
const FIRST: u8 = u8::MAX;
const SECOND: u8 = FIRST - 1;
/// From the first position to where the second surely strays: as far as there is.
const FAR: i32 = i32::MIN;

/// Follows a position that count and phase give.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Course {
    /// Where it is, and what it goes in a tick: periods with [`BITS`], modulo 256 of them.
    at: i32,
    speed: i32,
    /// Positions in a row that strayed, or [`FIRST`], or [`SECOND`].
    strays: u8,
}

impl Default for Course {
    fn default() -> Self {
        Self { at: FAR, speed: 0, strays: FIRST }
    }
}

impl Course {
    /// The position of this tick. True when counts were lost; then the course begins anew.
    #[inline]
    #[must_use]
    pub fn next(&mut self, position: Periods) -> bool {
        let at = (position.0 >> CUT) as i32;
        let expected = self.at.wrapping_add(self.speed);
        let beside = at.wrapping_sub(expected);
        if beside.unsigned_abs() > STRAYS {
            return self.stray(at, expected);
        }
        // α = 1/2, β = 1/4: fast, and a late sample does not make the next one stray.
        self.at = expected.wrapping_add(beside >> 1);
        self.speed = self.speed.wrapping_add(beside >> 2);
        self.strays = 0;
        false
    }

    #[cold]
    fn stray(&mut self, at: i32, expected: i32) -> bool {
        match self.strays {
            FIRST => *self = Self { at: at.wrapping_add(FAR), speed: 0, strays: SECOND },
            SECOND => *self = Self { at, speed: at.wrapping_sub(self.at).wrapping_sub(FAR), strays: 0 },
            strays if strays.wrapping_add(1) < IN_A_ROW => {
                *self = Self { at: expected, strays: strays.wrapping_add(1), ..*self };
            }
            _ => {
                *self = Self::default();
                return true;
            }
        }
        false
    }

    /// A tick without a position: the way that it went, as far as is known.
    #[inline]
    pub fn coast(&mut self) -> i64 {
        self.at = self.at.wrapping_add(self.speed);
        i64::from(self.speed) << CUT
    }

    /// Whether it goes slower than a part of a period in a tick, 2⁻³².
    #[inline]
    pub fn is_slower_than(&self, way: u32) -> bool {
        self.speed.unsigned_abs() < way >> CUT
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PERIOD: f64 = 4_294_967_296.0;

    fn at(turns: f64) -> Periods {
        Periods((turns * PERIOD) as i64)
    }

    /// Positions at a speed, periods a tick, from a power-on in motion.
    fn going(speed: f64) -> (Course, impl Fn(u32) -> f64) {
        let place = move |tick: u32| 1234.3 + speed * f64::from(tick);
        let mut course = Course::default();
        (0..50).for_each(|tick| assert!(!course.next(at(place(tick))), "tick {tick}"));
        (course, place)
    }

    #[test]
    fn whole_periods_lost_or_won_are_told_in_the_third_sample_at_any_speed() {
        for speed in [0.0, 0.1, -0.625, 3.0, -6.25, 40.0] {
            for lost in [-64.0, -3.0, -1.0, 1.0, 2.0, 60.0] {
                let (mut course, place) = going(speed);
                let told = (50..100).find(|&tick| course.next(at(place(tick) + lost)));
                assert_eq!(told, Some(52), "{speed} {lost}");
                let again = (53..100).find(|&tick| course.next(at(place(tick) + lost)));
                assert_eq!(again, None, "{speed} {lost}");
            }
        }
    }

    #[test]
    fn late_samples_are_no_lost_counts() {
        for speed in [0.05, 0.2, 0.3, 0.4, -0.49, 0.5, 0.51, -0.625, 1.0, 2.0, -6.25, 30.0] {
            for late in if (0.3..=0.5).contains(&f64::abs(speed)) { 1..2 } else { 1..3 } {
                let (mut course, place) = going(speed);
                for tick in 50..200 {
                    let seen = if (60..60 + late).contains(&tick) { 59 } else { tick };
                    assert!(!course.next(at(place(seen))), "{speed}, {late} late, tick {tick}");
                }
            }
        }
    }

    #[test]
    fn a_tick_without_a_position_goes_on_at_the_same_speed() {
        let (mut course, place) = going(0.625);
        let way = course.coast() as f64 / PERIOD;
        assert!((way - 0.625).abs() < 1e-3, "{way}");
        assert!(!course.next(at(place(51))));
    }

    proptest! {
        /// 0.07 periods in a tick, each tick: 5.6 m/s² of 0.8 µm at 10 kHz; and noise of a hundredth.
        #[test]
        fn accelerations_and_noise_of_a_stage_are_no_lost_counts(
            changes in proptest::collection::vec((-0.07..0.07_f64, -0.03..0.03_f64), 1..400),
            speed in -8.0..8.0_f64,
        ) {
            let (mut course, _) = going(speed);
            let (mut place, mut speed) = (1234.3 + speed * 49.0, speed);
            for (change, noise) in changes {
                speed += change;
                place += speed;
                prop_assert!(!course.next(at(place + noise)));
            }
        }
    }
}
