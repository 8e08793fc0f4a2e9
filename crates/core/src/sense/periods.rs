//! From phases, which know no period, to a position that counts them.
//!
//! With a counter (row A3) its count says which period, and the phase says where in it: [`Join`]. Without one the phase
//! is followed from sample to sample: [`Unwrap`].

use super::phase::Phase;
use crate::wide;

/// A position in signal periods, 32 fractional bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Periods(pub i64);

/// One period.
const PERIOD: i64 = 1 << 32;
/// A count of a 4× decoder.
const QUARTER: i64 = PERIOD / 4;

impl Periods {
    /// The position with this phase that is nearest to this one: less than half a period away.
    #[inline]
    #[must_use]
    pub const fn nearest(self, phase: Phase) -> Self {
        let way = phase.0.wrapping_sub(self.0 as u32).cast_signed();
        Self(self.0.wrapping_add(way as i64))
    }

    /// The part of a period.
    #[inline]
    pub const fn phase(self) -> Phase {
        Phase(self.0 as u32)
    }

    /// From another position to this one.
    #[inline]
    pub const fn way_from(self, other: Self) -> i64 {
        self.0.wrapping_sub(other.0)
    }

    /// Picometres, for a period of `period_pm`, rounded down.
    #[inline]
    pub const fn pm(self, period_pm: i32) -> i64 {
        let whole = wide::mul_i32((self.0 >> 32) as i32, period_pm);
        let part = wide::mul_u32(self.0 as u32, period_pm.cast_unsigned()) >> 32;
        whole.wrapping_add(part.cast_signed())
    }

    /// Periods as a number. For the edges, not the tick.
    pub fn turns(self) -> f64 {
        self.0 as f64 / PERIOD as f64
    }
}

/// Joins the count of a 4× decoder (coarse) and the phase (fine).
///
/// Comparators turn the same two signals into the levels that are counted, so a count is a quarter of a period and the
/// phase lies in it, but for the comparators' hysteresis, the offsets of the signals and the time between count and
/// sample. The position is the one with the sample's phase that is nearest to the middle of the count: as long as both
/// agree to half a period it is right, and noise in neither carries it off. By how much they disagree is told, and it is
/// a fault long before that ([`super::health`]). What no disagreement shows is a loss of whole periods between two
/// samples: four counts, or eight. The position jumps then, and [`super::course`] sees that.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Join {
    /// What is added to the count so that count 0 is the quadrant from phase 0 on.
    offset: Option<i64>,
    /// The offset was taken in the middle of a quadrant, where no hysteresis can spoil it.
    sure: bool,
    /// Counts may have been lost since: the next phase makes the offset anew.
    doubted: bool,
}

/// A joined position and by how much its two halves disagree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Joined {
    /// The position.
    pub position: Periods,
    /// From the middle of the count to the position, 2⁻³² of a period: within ± 1/8 when all is well. 0 until both have met
    /// in the middle of a quadrant, within a period of motion.
    pub disagreement: i32,
}

/// Around the middle of a quadrant, 2⁻³² of a period: 1/16.
const MIDDLE: i32 = 1 << 28;

impl Join {
    /// Joins a count, extended to 64 bit, and the phase of the same instant.
    #[inline]
    pub fn join(&mut self, count: i64, phase: Phase) -> Joined {
        let offset = match self.offset {
            Some(offset) if self.sure => offset,
            _ => self.agree(count, phase),
        };
        let middle = Periods(count.wrapping_add(offset).wrapping_mul(QUARTER).wrapping_add(QUARTER / 2));
        let position = middle.nearest(phase);
        // Beside its own count until the offset is sure: up to 3/8 of a period, and no sign of anything.
        let disagreement = if self.sure { position.way_from(middle) as i32 } else { 0 };
        Joined { position, disagreement }
    }

    /// Count and phase have met where no hysteresis can spoil it.
    #[inline]
    pub fn is_sure(&self) -> bool {
        self.sure
    }

    /// The place in the quadrant of a count that is nearest to another; that place itself until count and phase have met.
    pub fn nearest_to(&self, place: Periods, count: i64) -> Periods {
        if self.offset.is_none() {
            return place;
        }
        let begin = self.begin(count);
        place.max(begin).min(Periods(begin.0.wrapping_add(QUARTER)))
    }

    /// Where a count begins.
    pub fn begin(&self, count: i64) -> Periods {
        Periods(count.wrapping_add(self.offset.unwrap_or(0)).wrapping_mul(QUARTER))
    }

    /// Makes the count's quadrant that of the phase: at once, and once more as soon as the phase is in the middle of
    /// one. Until then it may be off by the one count of a hysteresis; the position is not, which needs two.
    #[cold]
    fn agree(&mut self, count: i64, phase: Phase) -> i64 {
        let in_quadrant = (phase.0 & ((1 << 30) - 1)).cast_signed().wrapping_sub(1 << 29);
        self.sure = in_quadrant.wrapping_abs() <= MIDDLE;
        match self.offset {
            Some(offset) if !self.sure && !self.doubted => offset,
            _ => self.meet(count, phase),
        }
    }

    /// Counts were lost or won, and the position with them: begins anew from here, without a jump of more than half a
    /// period. Somebody has to find the zero again.
    #[cold]
    pub fn begin_anew(&mut self, count: i64, phase: Phase, last: Periods) {
        self.sure = false;
        let before = self.begin(count);
        let offset = self.meet(count, phase);
        // Half a period lies as near on both sides of the count, but not of where the head was.
        let way = self.begin(count).way_from(before);
        if way == 2 * QUARTER && last < before {
            self.offset = Some(offset.wrapping_sub(4));
        }
    }

    /// There is no phase: count and phase must meet again where no hysteresis spoils it.
    pub fn doubt(&mut self) {
        self.sure = false;
        self.doubted = true;
    }

    /// Count and phase have met.
    pub fn has_met(&self) -> bool {
        self.offset.is_some()
    }

    /// Takes the offset by which the count's quadrant is that of the phase: the one nearest to that before, so that no
    /// period is lost or won.
    fn meet(&mut self, count: i64, phase: Phase) -> i64 {
        let wanted = i64::from(phase.0 >> 30).wrapping_sub(count);
        let near = self.offset.unwrap_or(wanted);
        let way = wanted.wrapping_sub(near) & 3;
        let way = if way > 2 { way.wrapping_sub(4) } else { way };
        let offset = near.wrapping_add(way);
        self.offset = Some(offset);
        self.doubted = false;
        offset
    }
}

/// Follows the phase from sample to sample without a counter, expecting each sample where the last two point.
///
/// What must stay below half a period is the change of the way from one sample to the next: |a| < P/2 · fs², 40 m/s² for
/// 0.8 µm at 10 kHz, at any speed that it has reached from a known one. Without the expectation the way itself must, which
/// ends at 4 mm/s. After a fault no speed is known: until the phase has stood still it is followed without an expectation,
/// so that a stage at rest is never taken for one that goes a period a sample.
///
/// A sample that is the one before came late, or the stage went whole periods: at 8 mm/s it goes one in each tick of
/// 10 kHz. Which, shows where it lies from where it was expected: beyond 1/4 of a period it came late (the stage would have
/// changed its speed by 20 m/s²), nearer it is believed until the next new sample shows which surprises less. What never
/// changes is a stage that has stopped, or a converter: above 5/16 of a period a tick (2.5 mm/s) that is a surprise after
/// [`FROZEN`] ticks at most, below it nothing here tells them apart. More than 250 ticks without a sample are too many to
/// count; [`super::health`] makes a fault of far fewer.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Unwrap {
    /// At the last new sample; at the last tick if samples are missing.
    course: Straight,
    /// The last sample that came.
    seen: Phase,
    odd: Odd,
}

/// Where a head is and how far it goes in a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Straight {
    at: Periods,
    speed: i64,
}

impl Straight {
    /// So many samples later, at a speed.
    fn after(self, samples: u8, speed: i64) -> Periods {
        Periods(self.at.0.wrapping_add(speed.wrapping_mul(i64::from(samples))))
    }

    /// Whole periods a sample, and how much more than the speed that is.
    fn whole(self) -> (i64, i32) {
        let whole = self.speed.wrapping_add(PERIOD / 2) & !(PERIOD - 1);
        (whole, whole.wrapping_sub(self.speed) as i32)
    }

    /// Through the next sample, and from where it was expected to where it is.
    #[inline]
    const fn through(self, phase: Phase) -> (Self, i32) {
        let expected = Periods(self.at.0.wrapping_add(self.speed));
        let at = expected.nearest(phase);
        (Self { at, speed: at.way_from(self.at) }, at.way_from(expected) as i32)
    }
}

/// What the next sample must be looked at for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Odd {
    /// It is the first.
    #[default]
    First,
    /// Nothing.
    No,
    /// So many before it did not come.
    Missed(u8),
    /// None was new for so many ticks, in which so many were the one before.
    Old(u8, u8),
    /// So many more must stand still before a speed is believed.
    Unsettled(u8),
}

/// Beside where it was expected by more than 1/4 of a period, as after 20 m/s², a sample like the one before came late.
const CAME_LATE: u32 = super::health::FAST_WARN;
/// A second one in a row shows a stage that stays at a speed of whole periods; it has not come there at once, by 1/8.
const SUDDEN: u32 = 1 << 29;
/// Slower than 1/128 of a period a sample, the stage stands.
const STOOD: u64 = (PERIOD / 128).cast_unsigned();
/// More late samples are a stage that has stopped.
const LATE: u8 = 3;
/// More of one that goes whole periods are a converter that stands. One of 8 bits whose noise is 0.5 % gives the same again
/// in about one of three cases; so often in a row, in less than one of 10¹⁰ ticks.
const FROZEN: u8 = 24;
/// 2 / (n + 1), 2⁻¹⁶, for n ticks; after more than these a speed is left as it was.
const LAST_PARTS: [i32; 10] =
    [131_072, 65_536, 43_691, 32_768, 26_214, 21_845, 18_725, 16_384, 14_564, 13_107];
/// The phase stands for so many samples, within 1/32 of a period from one to the next.
const STILL: u8 = 8;
const STANDS: u64 = (PERIOD / 32).cast_unsigned();

/// A followed position and how far it lies from where it was expected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// The position.
    pub position: Periods,
    /// From the expected to the found position, 2⁻³² of a period.
    pub surprise: i32,
}

impl Unwrap {
    /// Goes on from a place, after a fault: at what speed is not known.
    pub const fn from(place: Periods) -> Self {
        Self { course: Straight { at: place, speed: 0 }, seen: place.phase(), odd: Odd::Unsettled(STILL) }
    }

    /// The position of the next sample.
    #[inline]
    pub fn next(&mut self, phase: Phase) -> Followed {
        match self.odd {
            Odd::No if phase != self.seen => (),
            Odd::Missed(_) if phase != self.seen => self.odd = Odd::No,
            Odd::First => return self.begin(phase),
            _ => return self.look(phase),
        }
        self.seen = phase;
        self.go_to(self.course.through(phase))
    }

    #[inline]
    fn go_to(&mut self, (course, surprise): (Straight, i32)) -> Followed {
        self.course = course;
        Followed { position: course.at, surprise }
    }

    /// In the first period, at rest as far as anybody knows.
    fn begin(&mut self, phase: Phase) -> Followed {
        (self.seen, self.odd) = (phase, Odd::No);
        self.go_to((Straight { at: Periods(i64::from(phase.0)), speed: 0 }, 0))
    }

    #[cold]
    fn look(&mut self, phase: Phase) -> Followed {
        match self.odd {
            Odd::Unsettled(left) => self.settle(phase, left),
            Odd::Old(row, repeats) if phase != self.seen => self.renew(phase, row, repeats),
            Odd::Old(row, repeats) => self.repeat(row.saturating_add(1), repeats.saturating_add(1)),
            Odd::Missed(row) => {
                self.course.at = self.course.after(row, self.course.speed.wrapping_neg());
                self.repeat(row.saturating_add(1), 1)
            }
            Odd::No | Odd::First => self.repeat(1, 1),
        }
    }

    /// The sample is the one before, the last new one so many ticks ago.
    fn repeat(&mut self, row: u8, repeats: u8) -> Followed {
        let (whole, more) = self.course.whole();
        let fresh = self.may_be_fresh(row, repeats);
        let most = if fresh && whole != 0 { FROZEN } else { LATE };
        if repeats > most || self.course.speed.unsigned_abs() < STOOD {
            return self.stop();
        }
        self.odd = Odd::Old(row, repeats);
        Followed { position: self.old(row, repeats), surprise: if fresh && repeats == 1 { more } else { 0 } }
    }

    /// The stage may have gone whole periods in each tick. If some are missing between, what is there came late, too.
    fn may_be_fresh(&self, row: u8, repeats: u8) -> bool {
        let (_, more) = self.course.whole();
        row == repeats && more.unsigned_abs() <= if repeats == 1 { CAME_LATE } else { SUDDEN }
    }

    /// Where the head is so many ticks after the last new sample.
    fn old(&self, row: u8, repeats: u8) -> Periods {
        let (whole, _) = self.course.whole();
        self.course.after(row, if self.may_be_fresh(row, repeats) { whole } else { self.course.speed })
    }

    /// It has stopped where it was seen, or its converter has.
    fn stop(&mut self) -> Followed {
        self.odd = Odd::No;
        let lost = self.course.speed.wrapping_neg();
        let surprise = lost.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        self.go_to((Straight { speed: 0, ..self.course }, surprise))
    }

    /// A new sample behind so many ticks without one: what came in these was late or fresh, whichever surprises less.
    fn renew(&mut self, phase: Phase, row: u8, repeats: u8) -> Followed {
        (self.seen, self.odd) = (phase, Odd::No);
        let (ticks, (whole, _)) = (row.saturating_add(1), self.course.whole());
        let late = self.beside(phase, ticks, self.course.speed);
        let fresh = self.beside(phase, ticks, whole);
        let nearer = fresh.unsigned_abs() < late.unsigned_abs();
        if nearer && self.may_be_fresh(row, repeats) {
            self.after_a_row(ticks, whole, fresh)
        } else {
            self.after_a_row(ticks, self.course.speed, late)
        }
    }

    /// From where it is expected, so many ticks after the last new sample at a speed, to a phase.
    fn beside(&self, phase: Phase, ticks: u8, speed: i64) -> i32 {
        // The phase is the lower half.
        let gone = (speed as u32).wrapping_mul(u32::from(ticks));
        phase.0.wrapping_sub(self.course.at.phase().0).wrapping_sub(gone).cast_signed()
    }

    /// The same place. What surprises there is how the speed has changed in all the ticks: the last has changed it by two
    /// parts of as many and one.
    fn after_a_row(&mut self, ticks: u8, speed: i64, surprise: i32) -> Followed {
        let at = Periods(self.course.after(ticks, speed).0.wrapping_add(i64::from(surprise)));
        let part = LAST_PARTS.get(usize::from(ticks)).copied().unwrap_or(0);
        let changed = wide::mul_i32(surprise, part) >> 16;
        self.go_to((Straight { at, speed: speed.wrapping_add(changed) }, surprise))
    }

    /// The speed is not known: each sample is as near to the one before as it can be.
    fn settle(&mut self, phase: Phase, left: u8) -> Followed {
        let at = self.course.at.nearest(phase);
        let stands = at.way_from(self.course.at).unsigned_abs() < STANDS;
        self.odd = match (stands, left) {
            (true, 0..=1) => Odd::No,
            (true, left) => Odd::Unsettled(left.wrapping_sub(1)),
            (false, _) => Odd::Unsettled(STILL),
        };
        self.go_to((Straight { at, speed: 0 }, 0))
    }

    /// Whether it goes slower than a part of a period in a tick, 2⁻³².
    #[inline]
    pub fn is_slower_than(&self, way: u32) -> bool {
        self.course.speed.unsigned_abs() < u64::from(way)
    }

    /// A sample that did not come: goes on at the same speed.
    #[inline]
    pub fn miss(&mut self) -> Option<Periods> {
        let missed = match self.odd {
            Odd::First => return None,
            Odd::Old(row, repeats) => {
                let row = row.saturating_add(1);
                self.odd = Odd::Old(row, repeats);
                return Some(self.old(row, repeats));
            }
            Odd::No => Odd::Missed(1),
            Odd::Missed(row) => Odd::Missed(row.saturating_add(1)),
            unsettled @ Odd::Unsettled(_) => unsettled,
        };
        self.odd = missed;
        self.course.at = self.course.after(1, self.course.speed);
        Some(self.course.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn phase(turns: f64) -> Phase {
        Phase(((turns - turns.floor()) * 4_294_967_296.0) as u32)
    }

    /// At 0, and at a speed in periods a sample.
    fn at_speed(speed: f64) -> Unwrap {
        let course = Straight { at: Periods(0), speed: (speed * PERIOD as f64) as i64 };
        Unwrap { course, odd: Odd::No, ..Unwrap::default() }
    }

    #[test]
    fn periods_become_picometres() {
        assert_eq!(Periods(3 * PERIOD + PERIOD / 2).pm(800_000), 2_800_000);
        assert_eq!(Periods(-PERIOD / 4).pm(800_000), -200_000);
        assert_eq!(Periods(150_000 * PERIOD).pm(800_000), 120_000_000_000);
        assert_eq!(Periods(-1).pm(800_000), -1);
    }

    proptest! {
        /// The count is wrong by the hysteresis, everywhere and in each way, from the very first sample on.
        #[test]
        fn count_and_phase_never_disagree_by_a_period(
            ways in proptest::collection::vec(-0.6..0.6_f64, 1..400),
            from in -5.0..5.0_f64,
            hysteresis in 0.0..0.06_f64,
            first in -1_000_000_000_i64..1_000_000_000,
        ) {
            let (mut truth, mut join) = (from, Join::default());
            let mut count = (truth * 4.0).floor();
            let power_on = count;
            let mut zero = None;
            for way in ways {
                truth += way;
                // The comparators switch late by the hysteresis, in the direction of motion.
                let late = truth - hysteresis * way.signum();
                if (late * 4.0).floor() != count {
                    count = if way > 0.0 { count.max((late * 4.0).floor()) } else { count.min((late * 4.0).floor()) };
                }
                let joined = join.join(first + (count - power_on) as i64, phase(truth));
                let zero = *zero.get_or_insert(joined.position.turns() - truth);
                prop_assert!((joined.position.turns() - truth - zero).abs() < 1e-6, "{} {}", joined.position.turns(), truth);
                let off = f64::from(joined.disagreement) / 4_294_967_296.0;
                prop_assert!(off.abs() <= if join.sure { 0.125 + 0.061 } else { 0.376 + 0.061 }, "{}", off);
            }
        }

        #[test]
        fn no_speed_is_too_fast_to_follow_only_an_acceleration(
            speed in -40.0..40.0_f64, accelerations in proptest::collection::vec(-0.45..0.45_f64, 1..300),
        ) {
            let mut unwrap = at_speed(speed);
            let (mut truth, mut speed) = (0.0, speed);
            for change in accelerations {
                speed += change;
                truth += speed;
                let followed = unwrap.next(phase(truth));
                prop_assert!((followed.position.turns() - truth).abs() < 1e-6);
                let surprise = f64::from(followed.surprise) / 4_294_967_296.0;
                prop_assert!((surprise - change).abs() < 1e-6, "{} {}", surprise, change);
            }
        }
    }

    #[test]
    fn a_lost_count_shows_as_a_quarter_and_costs_no_period() {
        let mut join = Join::default();
        join.join(0, phase(0.125));
        // Counts 1 and 2 of the second period were lost.
        let joined = join.join(5 - 1, phase(1.375));
        assert_eq!(joined.position, Periods(PERIOD + 3 * PERIOD / 8));
        assert_eq!(joined.disagreement, (QUARTER) as i32);
    }

    /// A stage at 6 periods a tick, whose samples now and then differ by nothing, at an even speed and when it sets out and
    /// stops.
    #[test]
    fn a_stage_that_goes_whole_periods_in_a_sample_has_not_stopped() {
        let mut unwrap = Unwrap::default();
        let (mut truth, mut speed) = (0.0, 0.0);
        for tick in 0..400 {
            speed = f64::clamp(speed + if tick < 200 { 0.125 } else { -0.125 }, 0.0, 6.0);
            truth += speed;
            let noise = if tick % 20 == 0 { 1e-3 } else { 0.0 };
            let off = unwrap.next(phase(truth + noise)).position.turns() - truth;
            assert!(off.abs() < 0.0011, "tick {tick}: {off}");
        }
        assert_eq!(speed, 0.0);
    }

    /// Samples that never change again: the head is where it was seen, and above 5/16 of a period a tick that is told.
    #[test]
    fn a_converter_that_stands_still_is_a_surprise_and_the_head_stays_where_it_was_seen() {
        for hundredths in (1..900).chain(-900..-1) {
            // Never quite whole: the first sample is a new one.
            let speed = f64::from(hundredths) / 100.0 + 0.003;
            let mut unwrap = at_speed(speed);
            unwrap.next(phase(speed));
            let followed = [(); 40].map(|()| unwrap.next(phase(speed)));
            assert!((followed[39].position.turns() - speed).abs() < 1e-6, "{speed}: {followed:?}");
            let told =
                |followed: &Followed| followed.surprise.unsigned_abs() > super::super::health::FAST_FAULT;
            let first = followed.iter().position(told);
            assert_eq!(first.is_some(), speed.abs() > 5.0 / 16.0, "{speed}: {first:?}");
            assert!(first.is_none_or(|first| first <= usize::from(FROZEN)), "{speed}: {first:?}");
        }
    }

    proptest! {
        /// Late and missing samples, mixed as they may be, at a speed and an acceleration: 0.07 of a period (5.6 m/s² of
        /// 0.8 µm at 10 kHz) for one, less for more. `odd` names those of 23 ticks that are not as they should be.
        #[test]
        fn late_and_missing_samples_cost_no_period(
            speed in -8.0..8.0_f64, most in -1.0..1.0_f64, odd in prop::collection::vec(prop::bool::ANY, 1..=4),
            noise in 0.0..0.01_f64,
        ) {
            // Three late ones are the most.
            let odd = if odd == [true; 4] { vec![true; 3] } else { odd };
            let change = most * [0.07, 0.04, 0.02, 0.01][odd.len() - 1];
            let mut unwrap = at_speed(speed);
            let (mut truth, mut speed, mut shown) = (0.0, speed, 0.0);
            for tick in 0..400_u32 {
                speed += change * if tick / 46 % 2 == 0 { 1.0 } else { -1.0 };
                truth += speed;
                let odd = (tick as usize % 23).checked_sub(10).and_then(|at| odd.get(at));
                if odd.is_none() {
                    shown = truth + noise * f64::from(tick * 7919 % 101) / 101.0;
                }
                let followed = match odd {
                    Some(false) => Followed { position: unwrap.miss().unwrap_or_default(), surprise: 0 },
                    _ => unwrap.next(phase(shown)),
                };
                let off = followed.position.turns() - truth;
                prop_assert!(odd.is_some() || off.abs() < 0.011, "tick {tick}: {off}");
                prop_assert!(off.abs() < 1.1, "tick {tick}: {off}");
                let surprise = f64::from(followed.surprise) / 4_294_967_296.0;
                prop_assert!(surprise.abs() < 5.0 / 16.0, "tick {tick}: {surprise}");
            }
        }
    }

    #[test]
    fn a_missed_sample_is_bridged_at_the_same_speed() {
        let mut unwrap = Unwrap::default();
        for k in 0..10 {
            unwrap.next(phase(0.4 * f64::from(k)));
        }
        unwrap.miss();
        assert!((unwrap.next(phase(0.4 * 11.0)).position.turns() - 4.4).abs() < 1e-6);
        assert_eq!(Unwrap::default().miss(), None);
    }
}
