//! The first pass: what the samples reach, and whether they were cut off there.

use super::paces::Paces;
use super::samples::{CHANNELS, Fault, Sample, Samples, SamplesError};
use crate::failure::Failure;

/// How many times as many samples as at the next value make a pile. At the turn of a sine, the last code of a converter
/// holds at most 2.4 times as many as the next one.
const HIGHER: f64 = 3.0;
/// What chance may have taken from the next value: so many of its own standard deviations, and so many samples.
const CHANCE: f64 = 2.0;
const FEW: f64 = 4.0;
/// Steps of time that differ by more than this part are not even.
const UNEVEN: f64 = 0.1;

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
    fn is_cut(&self) -> bool {
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
    /// The middle of the ends.
    pub(crate) fn middle(&self) -> f64 {
        f64::midpoint(self.low.value, self.high.value)
    }

    /// A value as the ends say by now: from the middle, in halves of the way between them.
    fn part(&self, value: f64) -> f64 {
        let half = self.half();
        if half > 0.0 { (value - self.middle()) / half } else { 0.0 }
    }

    /// Half of the way between the ends.
    pub(crate) fn half(&self) -> f64 {
        (self.high.value - self.low.value) / 2.0
    }
}

/// The times of the samples, s.
#[derive(Clone, Debug)]
pub(crate) struct Times {
    first: f64,
    last: f64,
    shortest: f64,
    paces: Paces,
}

/// How a converter writes its codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coding {
    /// 0 … 2ⁿ − 1; the middle is 2ⁿ⁻¹.
    Unsigned,
    /// −2ⁿ⁻¹ … 2ⁿ⁻¹ − 1.
    Signed,
}

/// A converter whose codes the samples are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Converter {
    /// Its resolution.
    pub(crate) bits: u32,
    /// How it writes its codes.
    pub(crate) coding: Coding,
}

impl Converter {
    /// The lowest and the highest code.
    pub(crate) fn ends(self) -> [f64; 2] {
        let half = f64::from(1 << (self.bits - 1));
        match self.coding {
            Coding::Unsigned => [0.0, 2.0 * half - 1.0],
            Coding::Signed => [-half, half - 1.0],
        }
    }

    /// The code of no signal.
    pub(crate) fn zero(self) -> f64 {
        let half = f64::from(1 << (self.bits - 1));
        if self.coding == Coding::Unsigned { half } else { 0.0 }
    }
}

/// What the first pass found.
#[derive(Clone, Debug)]
pub(crate) struct Survey {
    /// How many samples.
    pub(crate) samples: u64,
    /// Cosine and sine.
    pub(crate) channels: [Channel; 2],
    /// Their times.
    pub(crate) times: Option<Times>,
    /// The converter, where its bits were given.
    pub(crate) converter: Option<Converter>,
}

impl Survey {
    /// Looks through a file; `bits` says that its numbers are codes of a converter.
    ///
    /// # Errors
    /// What is wrong with the file; too few samples; a channel that stands still.
    pub(crate) fn of(
        samples: &Samples<'_>,
        bits: Option<u32>,
        advanced: &dyn Fn(u64),
    ) -> Result<Self, Failure> {
        let none = Channel { low: End::NONE, high: End::NONE };
        let mut survey = Self { samples: 0, channels: [none; 2], times: None, converter: None };
        let mut codes = bits.map(Codes::new);
        samples.each(advanced, |sample| {
            let here = |fault| samples.error(Some(sample.line), fault);
            if let Some(codes) = &mut codes {
                codes.see(&sample).map_err(here)?;
            }
            survey.see(&sample).map_err(here)?;
            Ok(())
        })?;
        survey.converter = codes.map(|codes| codes.converter());
        survey.check(samples)?;
        Ok(survey)
    }

    fn see(&mut self, sample: &Sample<'_>) -> Result<(), Fault> {
        self.samples += 1;
        let [a, b] = sample.channels;
        let others = [self.channels[1].part(b), self.channels[0].part(a)];
        for ((channel, value), other) in self.channels.iter_mut().zip(sample.channels).zip(others) {
            channel.low.see(value, other, |value, end| value < end);
            channel.high.see(value, other, |value, end| value > end);
            let middle = channel.middle();
            if value < middle {
                channel.high.leave();
            } else if value > middle {
                channel.low.leave();
            }
        }
        let Some((t_s, _)) = sample.time else { return Ok(()) };
        let times = self.times.get_or_insert(Times {
            first: t_s,
            last: f64::NAN,
            shortest: f64::INFINITY,
            paces: Paces::default(),
        });
        let before_s = std::mem::replace(&mut times.last, t_s);
        if t_s <= before_s {
            return Err(Fault::NotAscending { t_s, before_s });
        }
        // Of the first sample it is no number, which it does not take.
        times.shortest = times.shortest.min(t_s - before_s);
        if !before_s.is_nan() {
            times.paces.add(t_s - before_s);
        }
        Ok(())
    }

    fn check(&self, samples: &Samples<'_>) -> Result<(), SamplesError> {
        match self.samples {
            0 => return Err(samples.error(None, Fault::NoSamples)),
            count @ 1..=4 => return Err(samples.error(None, Fault::TooFew { samples: count })),
            _ => {}
        }
        for (channel, column) in self.channels.iter().zip(CHANNELS) {
            let (half, value) = (channel.half(), channel.low.value);
            if half <= 1e-12 * channel.middle().abs() || half < f64::MIN_POSITIVE * 1e9 {
                return Err(samples.error(None, Fault::Constant { column, value }));
            }
        }
        Ok(())
    }

    /// The value from which on the samples of each channel are cut off, below and above; without end where they are
    /// not.
    pub(crate) fn cuts(&self) -> [[f64; 2]; 2] {
        self.channels.map(|channel| {
            let [lowest, highest] =
                self.converter.map_or([f64::NEG_INFINITY, f64::INFINITY], Converter::ends);
            let low = if channel.low.is_cut() { channel.low.value } else { lowest };
            let high = if channel.high.is_cut() { channel.high.value } else { highest };
            [low, high]
        })
    }

    /// The usual step of time, s, where there is one.
    pub(crate) fn usual_s(&self) -> Option<f64> {
        self.times.as_ref().and_then(|times| times.paces.usual_s())
    }

    /// Samples a second, where there are times.
    pub(crate) fn rate_hz(&self) -> Option<f64> {
        let times = self.times.as_ref()?;
        let mean_hz = (self.samples - 1) as f64 / (times.last - times.first);
        Some(times.paces.usual_s().map_or(mean_hz, f64::recip))
    }

    /// The samples lie at even distances of time, as far as is known; gaps of missing ones do not count.
    pub(crate) fn is_even(&self) -> bool {
        self.times.as_ref().is_none_or(|times| {
            times.paces.usual_s().is_some_and(|usual_s| {
                let longest_s = times.paces.longest_below_gap_s(usual_s);
                (longest_s - usual_s).max(usual_s - times.shortest) <= UNEVEN * usual_s
            })
        })
    }
}

/// Whether numbers are codes, and written how.
struct Codes {
    bits: u32,
    negative: bool,
    above: bool,
}

impl Codes {
    const fn new(bits: u32) -> Self {
        Self { bits, negative: false, above: false }
    }

    fn see(&mut self, sample: &Sample<'_>) -> Result<(), Fault> {
        let half = f64::from(1 << (self.bits - 1));
        for (value, column) in sample.channels.into_iter().zip(CHANNELS) {
            self.negative |= value < 0.0;
            self.above |= value >= half;
            let allowed = value.fract() == 0.0 && value >= -half && value < 2.0 * half;
            if !allowed || (self.negative && self.above) {
                let [top, signed] = [2.0 * half - 1.0, half - 1.0];
                let range = format!("whole, and all of them 0 … {top} or all of them −{half} … {signed}");
                return Err(Fault::NoCode { column, value, bits: self.bits, range });
            }
        }
        Ok(())
    }

    fn converter(&self) -> Converter {
        let coding = if self.negative { Coding::Signed } else { Coding::Unsigned };
        Converter { bits: self.bits, coding }
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
