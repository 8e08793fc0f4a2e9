//! The ends of a channel, and whether its samples were cut off there.

/// How many times as many samples as at the next value make a pile. At the turn of a sine, the last code of a converter
/// holds at most 2.4 times as many as the next one.
const HIGHER: f64 = 3.0;
/// What chance may have taken from the next value: so many of its own standard deviations, and so many samples.
const CHANCE: f64 = 2.0;
const FEW: f64 = 4.0;
/// While the other channel stays within this part of its half range, the stage rests; so many samples of a rest count.
const REST: f64 = 1.0 / 16.0;
const AT_REST: u64 = 4;

/// The value at one end of a channel, and how many samples lie there and at the next value.
///
/// A stage that rests at a crest leaves as many there as it likes; but at a rail the other channel goes on. So a rest counts
/// by [`AT_REST`] samples, however long it is and wherever in a file. And while little of the file is known, so that
/// a rest is hard to tell, the longest visit of a pile is no part of it: the rail is met each time that the signal comes
/// back from the other half of its range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    /// The extreme.
    pub(crate) value: f64,
    count: u64,
    next: f64,
    next_count: u64,
    /// Where the other channel was at the end of the last motion, and samples at the extreme since.
    anchor: f64,
    resting: u64,
    /// Samples at the extreme since the signal came from the other half, and on the longest visit before.
    visit: u64,
    longest: u64,
}

impl End {
    const NONE: Self = Self {
        value: f64::NAN,
        count: 0,
        next: f64::NAN,
        next_count: 0,
        anchor: f64::NAN,
        resting: 0,
        visit: 0,
        longest: 0,
    };

    /// `beyond` says whether the first lies farther out than the second; it does not for a number that is none. `other` is
    /// the other channel in halves of its range.
    fn see(&mut self, value: f64, other: f64, beyond: fn(f64, f64) -> bool) {
        if self.count == 0 || beyond(value, self.value) {
            let (next, next_count) = (self.value, self.count);
            *self =
                Self { value, count: 1, next, next_count, anchor: other, resting: 1, visit: 1, longest: 0 };
        } else if value == self.value {
            self.meet(other);
        } else if self.next_count == 0 || beyond(value, self.next) {
            (self.next, self.next_count) = (value, 1);
        } else if value == self.next {
            self.next_count += 1;
        }
    }

    /// One more sample at the extreme.
    fn meet(&mut self, other: f64) {
        if (other - self.anchor).abs() > REST {
            (self.anchor, self.resting) = (other, 0);
        }
        self.resting += 1;
        if self.resting <= AT_REST {
            self.count += 1;
            self.visit += 1;
        }
    }

    /// The signal is in the other half: the visit is over.
    fn leave(&mut self) {
        self.longest = self.longest.max(self.visit);
        self.visit = 0;
        self.anchor = f64::INFINITY;
    }

    /// The samples were cut off here: they pile up, on more than one visit.
    pub(crate) fn is_cut(&self) -> bool {
        let next = self.next_count as f64;
        let pile = self.count - self.longest.max(self.visit);
        pile as f64 > HIGHER * (next + CHANCE * next.sqrt() + FEW)
    }
}

/// Both ends of a channel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channel {
    /// Below.
    pub(crate) low: End,
    /// Above.
    pub(crate) high: End,
}

impl Channel {
    /// Nothing seen yet.
    pub(crate) const NONE: Self = Self { low: End::NONE, high: End::NONE };

    /// The middle of the ends.
    pub(crate) fn middle(&self) -> f64 {
        f64::midpoint(self.low.value, self.high.value)
    }

    /// The next value; `other` is the other channel's, in halves of its range.
    pub(crate) fn see(&mut self, value: f64, other: f64) {
        self.low.see(value, other, |value, end| value < end);
        self.high.see(value, other, |value, end| value > end);
        let middle = self.middle();
        if value < middle {
            self.high.leave();
        } else if value > middle {
            self.low.leave();
        }
    }

    /// A value as the ends say by now: from the middle, in halves of the way between them.
    pub(crate) fn part(&self, value: f64) -> f64 {
        let half = self.half();
        if half > 0.0 { (value - self.middle()) / half } else { 0.0 }
    }

    /// Half of the way between the ends.
    pub(crate) fn half(&self) -> f64 {
        (self.high.value - self.low.value) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a channel whose other one moves on with each sample.
    fn high_end(values: impl Iterator<Item = f64>) -> End {
        high_end_beside(values.enumerate().map(|(k, value)| (value, k as f64)))
    }

    fn high_end_beside(values: impl Iterator<Item = (f64, f64)>) -> End {
        let mut end = End::NONE;
        for (value, other) in values {
            end.see(value, other, |value, end| value > end);
            if value < 0.0 {
                end.leave();
            }
        }
        end
    }

    /// Thousands of samples at rest near a crest, one code of noise, before and between sweeps.
    #[test]
    fn a_stage_that_rests_at_a_crest_meets_no_rail() {
        let sweep =
            |limit: f64| (0..4000_u32).map(move |k| (99.8 * (f64::from(k) * 0.297).sin()).round().min(limit));
        let rest = (0..3000_u32).map(|k| if k % 3 == 0 { 99.0 } else { 100.0 });
        assert!(!high_end(rest.clone().chain(sweep(200.0))).is_cut());
        assert!(!high_end(sweep(200.0).chain(rest.clone()).chain(sweep(200.0))).is_cut());
        assert!(high_end(rest.map(|code| code.min(90.0)).chain(sweep(90.0))).is_cut());
    }

    /// Ten rests of a thousand samples at the same crest, half a per cent of noise on the other channel, between sweeps.
    #[test]
    fn many_rests_at_one_crest_are_no_rail() {
        let file = |rail: f64| {
            (0..10_u32).flat_map(move |_| {
                let sweep = (0..1000_u32).map(move |k| {
                    let angle = f64::from(k) * 0.297;
                    ((99.8 * angle.sin()).round().min(rail), angle.cos())
                });
                let rest =
                    (0..1000_u32).map(move |k| (100_f64.min(rail), 0.015 * (f64::from(k) * 0.9).sin()));
                sweep.chain(rest)
            })
        };
        assert!(!high_end_beside(file(200.0)).is_cut(), "{:?}", high_end_beside(file(200.0)));
        assert!(high_end_beside(file(90.0)).is_cut(), "{:?}", high_end_beside(file(90.0)));
    }

    #[test]
    fn an_end_counts_its_value_and_the_next_in_any_order() {
        for values in
            [[1.0, 3.0, 2.0, 3.0, 2.0, 3.0], [3.0, 3.0, 2.0, 1.0, 2.0, 3.0], [2.0, 3.0, 1.0, 3.0, 3.0, 2.0]]
        {
            let end = high_end(values.into_iter());
            assert_eq!((end.value, end.count, end.next, end.next_count), (3.0, 3, 2.0, 2), "{values:?}");
        }
    }

    /// Every amplitude between two codes of a coarse converter, short files and long ones.
    #[test]
    fn codes_at_the_turn_of_a_sine_are_no_pile_and_cut_off_ones_are() {
        for part in 0..50 {
            for samples in [50_u32, 200, 2000, 50_000] {
                let amplitude = 100.0 + f64::from(part) / 50.0;
                let wave = |k: u32| (amplitude * (f64::from(k) * 0.297).sin()).round();
                assert!(!high_end((0..samples).map(wave)).is_cut(), "{amplitude} {samples}");
                let cut = high_end((0..samples).map(|k| wave(k).min(85.0)));
                assert!(samples < 200 || cut.is_cut(), "{amplitude} {samples}: {cut:?}");
            }
        }
    }
}
