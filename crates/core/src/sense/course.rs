//! Where a position is expected next, from where it went: counts lost or won by whole periods show here and nowhere else.
//!
//! Count and phase still agree when a counter loses four counts between two samples, or eight. But the position jumps by a
//! period, and no stage does: its speed would have to change by a period in a tick, 80 m/s² of 0.8 µm at 10 kHz. So each
//! position is expected where the last two point, and one that is more than half a period beside strays. Two in a row are
//! lost counts, of a stage that accelerates by up to P/8 · fs² (10 m/s²).
//!
//! A sample that came late is the one before once more, count and phase. It says nothing, and is passed over. A position
//! that stands from one tick to the next though it went 1.5 mm/s has frozen: a plug that was pulled may leave any level.

use super::periods::Periods;

/// Bits of a period: 12 pm of 0.8 µm. Positions wrap after ± 2¹⁵ periods, 26 mm; no smaller jump is passed over, and a larger
/// one is a following error.
const BITS: u32 = 16;
/// 32 bits less these.
const CUT: u32 = 32_u32.saturating_sub(BITS);
/// A position farther than this from the expected one strays.
const STRAYS: u32 = 1 << (BITS - 1);
/// One that is farther than this from it is looked at: 3/16 of a period, 15 m/s².
const ODD: u32 = 3 << (BITS - 4);
/// A position that is this near to the one before stands.
const STANDS: u32 = 1 << (BITS - 6);
/// So many in a row are lost counts.
const IN_A_ROW: u8 = 2;
/// So many late samples in a row are passed over; a stage at rest under a coarse converter repeats itself for ever.
const LATE: u8 = 3;
/// Nothing was seen yet; one position was; a way was. Two ways that agree make a speed, whatever it is.
const FIRST: u8 = u8::MAX;
const SECOND: u8 = FIRST - 1;
const THIRD: u8 = FIRST - 2;
/// From the first positions to where the next one surely strays: as far as there is.
const FAR: i32 = i32::MIN;

/// Follows a position that count and phase give.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Course {
    /// The last position, the next one as it is expected, and the way of a tick: periods with [`BITS`], modulo 2¹⁶ of them.
    seen: i32,
    expected: i32,
    speed: i32,
    /// Positions in a row that strayed, or [`FIRST`], [`SECOND`], [`THIRD`].
    strays: u8,
    /// Positions in a row that were the one before.
    late: u8,
}

impl Default for Course {
    fn default() -> Self {
        Self { seen: 0, expected: FAR, speed: 0, strays: FIRST, late: 0 }
    }
}

impl Course {
    /// The position of this tick. True when counts were lost; then the course begins anew.
    #[inline]
    #[must_use]
    pub fn next(&mut self, position: Periods) -> bool {
        let at = (position.0 >> CUT) as i32;
        let beside = at.wrapping_sub(self.expected);
        if beside.unsigned_abs() > ODD || at == self.seen {
            return self.odd(at);
        }
        self.go_on(at, self.speed.wrapping_add(beside));
        false
    }

    #[inline]
    fn go_on(&mut self, at: i32, speed: i32) {
        *self = Self { seen: at, expected: at.wrapping_add(speed), speed, strays: 0, late: 0 };
    }

    /// The first positions, one that strays, one that was there before.
    #[cold]
    fn odd(&mut self, at: i32) -> bool {
        let beside = at.wrapping_sub(self.expected);
        match self.strays {
            FIRST => *self = Self { seen: at, expected: at.wrapping_add(FAR), strays: SECOND, ..*self },
            THIRD if self.agrees(at) => self.go_on(at, at.wrapping_sub(self.seen)),
            SECOND | THIRD => {
                let speed = at.wrapping_sub(self.seen);
                *self = Self { seen: at, expected: at.wrapping_add(FAR), speed, strays: THIRD, ..*self };
            }
            _ if at == self.seen && self.late < LATE => {
                self.late = self.late.wrapping_add(1);
                self.coast();
            }
            // No late one: it has stopped.
            _ if at == self.seen && self.speed.unsigned_abs() <= ODD => self.go_on(at, 0),
            _ if beside.unsigned_abs() <= STRAYS && !self.has_frozen(at) => {
                self.go_on(at, self.speed.wrapping_add(beside));
            }
            strays if strays.wrapping_add(1) < IN_A_ROW => {
                self.strays = strays.wrapping_add(1);
                self.coast();
            }
            _ => {
                *self = Self::default();
                return true;
            }
        }
        false
    }

    /// This way is about the one before.
    fn agrees(&self, at: i32) -> bool {
        at.wrapping_sub(self.seen).wrapping_sub(self.speed).unsigned_abs() <= ODD
    }

    /// It stands, and no stage stops so soon: the signals have frozen where they were, and the counter with them.
    fn has_frozen(&self, at: i32) -> bool {
        at.wrapping_sub(self.seen).unsigned_abs() < STANDS && self.speed.unsigned_abs() > ODD
    }

    /// A tick that says nothing.
    pub fn coast(&mut self) {
        self.expected = self.expected.wrapping_add(self.speed);
    }

    /// What it went in the last tick, 2⁻³² of a period.
    #[inline]
    pub fn way(&self) -> i64 {
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
    fn whole_periods_lost_or_won_are_told_in_the_second_sample_at_any_speed() {
        for speed in [0.0, 0.1, -0.625, 3.0, -6.25, 40.0] {
            for lost in [-16384.0, -256.0, -3.0, -1.0, 1.0, 2.0, 60.0] {
                let (mut course, place) = going(speed);
                let told = (50..100).find(|&tick| course.next(at(place(tick) + lost)));
                // What loses just its own way looks late at first.
                assert_eq!(told, Some(51 + u32::from(lost == -speed)), "{speed} {lost}");
                let again = (53..100).find(|&tick| course.next(at(place(tick) + lost)));
                assert_eq!(again, None, "{speed} {lost}");
            }
        }
    }

    #[test]
    fn late_samples_are_no_lost_counts() {
        for speed in [0.05, 0.2, 0.3, 0.4, -0.49, 0.5, 0.51, -0.625, 1.0, 2.0, -6.25, 30.0] {
            for late in 1..=u32::from(LATE) {
                let (mut course, place) = going(speed);
                for tick in 50..200 {
                    let seen = if (60..60 + late).contains(&tick) { 59 } else { tick };
                    assert!(!course.next(at(place(seen))), "{speed}, {late} late, tick {tick}");
                }
            }
        }
    }

    #[test]
    fn a_stage_that_stops_under_a_coarse_converter_has_stopped() {
        let (mut course, place) = going(0.1);
        let stopped = place(50);
        assert!((0..1000).all(|_| !course.next(at(stopped))));
        assert!((0..1000).all(|tick| !course.next(at(stopped + 0.05 * f64::from(tick / 20)))));
    }

    #[test]
    fn the_way_of_a_tick_is_known() {
        let (course, _) = going(0.625);
        let way = course.way() as f64 / PERIOD;
        assert!((way - 0.625).abs() < 1e-4, "{way}");
        assert!(course.is_slower_than(1 << 31 | 1 << 30) && !course.is_slower_than(1 << 31));
    }

    #[test]
    fn signals_that_freeze_in_motion_are_told_with_and_without_noise() {
        for speed in [0.2, -0.3, 0.45, -0.7, 3.0] {
            for (noise, after) in [(0.0, u32::from(LATE) + 2), (1e-3, 2)] {
                let (mut course, place) = going(speed);
                let told = (50..100)
                    .find(|&tick| course.next(at(place(49) + noise * (f64::from(tick * 7 % 5) - 1.9))));
                assert_eq!(told, Some(49 + after), "{speed} {noise}");
            }
        }
        // Slowly enough a stage may stop.
        let (mut course, place) = going(0.15);
        assert!((50..200).all(|tick| !course.next(at(place(49) + 1e-3 * f64::from(tick % 2)))));
    }

    #[test]
    fn a_jump_at_power_on_is_no_lost_count() {
        let mut course = Course::default();
        let places = [0.4374, 1.0684, 1.0692, 1.0701];
        assert!(places.iter().chain([1.07; 50].iter()).all(|&place| !course.next(at(place))));
    }

    proptest! {
        /// Any acceleration up to 12 m/s² of 0.8 µm at 10 kHz, another one in every tick, and noise.
        #[test]
        fn accelerations_and_noise_of_a_stage_are_no_lost_counts(
            changes in proptest::collection::vec((-0.15..0.15_f64, -0.005..0.005_f64), 1..400),
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

        /// However it accelerates, up to 10 m/s², all the time.
        #[test]
        fn periods_that_are_lost_in_an_acceleration_are_told(
            change in -0.125..0.125_f64, speed in -8.0..8.0_f64, lost in prop_oneof![-9..=-1, 1..=9],
        ) {
            let (mut course, _) = going(speed);
            let (mut place, mut speed) = (1234.3 + speed * 49.0, speed);
            let told = (50..200).find(|&tick| {
                speed += change;
                place += speed;
                course.next(at(place + if tick < 100 { 0.0 } else { f64::from(lost) }))
            });
            prop_assert_eq!(told, Some(101));
        }
    }
}
