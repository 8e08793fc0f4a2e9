//! An analogue reading head, tick by tick: a sine and a cosine become a position, corrected, counted and watched.

use super::correct::{Correction, Residual};
use super::ellipse::Ellipse;
use super::harmonics::Harmonics;
use super::health::{Health, Report, Sample, SignalFault};
use super::limit::{CountLimit, SampleLimit};
use super::moments::Moments;
use super::periods::{Join, Periods, Unwrap};
use super::phase::Phase;
use super::recursive::{Gather, Recursive, Update};
use crate::edge::SinCos;
use crate::wide;

/// What a head is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// Signal period, picometres.
    pub period_pm: i32,
    /// The signals as they were when somebody looked at them: codes of ± 2¹⁵.
    pub ellipse: Ellipse,
    /// What they are off by beyond the ellipse.
    pub harmonics: Harmonics,
    /// A code this far from zero is at the end of the converter.
    pub rail: i16,
    /// A counter counts the same signals ([`Join`]); without one the phase is followed ([`Unwrap`]).
    pub counted: bool,
    /// Steps of a period; 0 as fine as the samples are.
    pub factor: u16,
    /// Largest step of a sample that passes paper B's first limit filter, codes; 0: no filter.
    pub sample_limit: u16,
    /// Paper B's second limit filter, on the steps of `factor`.
    pub count_limit: bool,
    /// Follow drift: let the recursion change the correction.
    pub tracks: bool,
}

/// What a sample came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Read {
    /// Where the head is.
    pub position: Periods,
    /// Why that cannot be trusted.
    pub fault: Option<SignalFault>,
}

/// What a head remembers.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Head {
    correction: Correction,
    residual: Residual,
    nominal: u32,
    join: Join,
    unwrap: Unwrap,
    limits: [SampleLimit; 2],
    count_limit: CountLimit,
    health: Health,
    gather: Gather,
    /// A block waits to be taken between ticks.
    ready: bool,
    recursive: Recursive,
    last: Periods,
    /// From the middle of the count to the position, when both were last seen.
    from_middle: i32,
    /// 2³² / factor, for the position of a step.
    step: u32,
}

impl Head {
    /// A head that has seen nothing yet. Floats: before the first tick.
    pub fn new(config: &Config) -> Self {
        let recursive = Recursive::new(config.ellipse);
        let Ellipse { p, q, radius, .. } = config.ellipse;
        let centre = [p, q].map(|offset| libm::round(offset) as i16);
        let mut health = Health::new(recursive.nominal());
        health.shape(&config.ellipse);
        Self {
            correction: recursive.correction(),
            residual: config.harmonics.residual(),
            nominal: recursive.nominal(),
            join: Join::default(),
            unwrap: Unwrap::default(),
            limits: [SampleLimit::new(config.sample_limit); 2],
            count_limit: CountLimit::default(),
            health,
            gather: Gather::new(centre, libm::round(radius) as u16),
            ready: false,
            recursive,
            last: Periods(0),
            from_middle: 0,
            step: u32::MAX.checked_div(u32::from(config.factor)).unwrap_or(0),
        }
    }

    /// One tick: a sample, if one came, and the count of the same instant, extended to 64 bit.
    #[inline]
    pub fn read(&mut self, sample: Option<SinCos>, count: i64, config: &Config) -> Read {
        let Some(sample) = sample else { return self.bridge(count, config) };
        let clipped = sample.sin.unsigned_abs().max(sample.cos.unsigned_abs()) >= config.rail.unsigned_abs();
        let sample = if config.sample_limit == 0 { sample } else { self.limited(sample) };
        let polar = self.correction.polar(sample);
        let phase = self.residual.take_off(polar.phase);
        let meets = config.counted && !self.join.is_sure();
        // A vector too short to have a phase says nothing about the place.
        let (position, disagreement, surprise) = if self.health.is_short(polar.radius) {
            (self.bridged(count, config), 0, 0)
        } else {
            self.place(count, phase, config)
        };
        let seen = Sample { radius: polar.radius, clipped, disagreement, surprise };
        let fault = self.health.sample(&seen);
        if fault.is_some() {
            self.begin_anew(count, phase);
        }
        // Gathering can wait for a tick that has nothing else to do: no tick does all that a tick may do.
        let busy = meets || self.health.ends_block();
        // What the converter has cut off draws no ellipse.
        if config.tracks && !self.ready && !busy && !seen.clipped {
            self.ready = self.gather.sample(sample, polar, self.nominal);
        }
        self.last = position;
        let position = if config.factor == 0 { self.last } else { self.stepped(config) };
        Read { position, fault }
    }

    /// After a fault nothing that was known of the period holds; what is read from now on does, once the zero is found.
    #[cold]
    fn begin_anew(&mut self, count: i64, phase: Phase) {
        self.join.begin_anew(count, phase);
        self.unwrap = Unwrap::from(self.last);
    }

    #[inline]
    fn place(&mut self, count: i64, phase: Phase, config: &Config) -> (Periods, i32, i32) {
        if config.counted {
            let joined = self.join.join(count, phase);
            self.from_middle = joined.disagreement;
            (joined.position, joined.disagreement, 0)
        } else {
            let followed = self.unwrap.next(phase);
            (followed.position, 0, followed.surprise)
        }
    }

    /// No sample.
    #[cold]
    fn bridge(&mut self, count: i64, config: &Config) -> Read {
        let fault = self.health.miss();
        self.last = self.bridged(count, config);
        let position = if config.factor == 0 { self.last } else { self.stepped(config) };
        Read { position, fault }
    }

    /// Where the head is without a phase: the count goes on, and what it was off by; or the speed does.
    #[cold]
    fn bridged(&mut self, count: i64, config: &Config) -> Periods {
        let beside = i64::from(self.from_middle);
        let known = if config.counted {
            self.join.middle(count).map(|middle| Periods(middle.0.wrapping_add(beside)))
        } else {
            self.unwrap.miss()
        };
        known.unwrap_or(self.last)
    }

    #[cold]
    fn limited(&mut self, sample: SinCos) -> SinCos {
        let [cos, sin] = &mut self.limits;
        SinCos { cos: cos.pass(sample.cos), sin: sin.pass(sample.sin) }
    }

    /// The position in whole steps of the period.
    #[inline(never)]
    fn stepped(&mut self, config: &Config) -> Periods {
        let factor = u32::from(config.factor);
        let turns = (self.last.0 >> 32) as i32;
        // From the beginning of the period, rounded to nearest: may be all of its steps.
        let step = (wide::mul_u32(self.last.0 as u32, factor).wrapping_add(1 << 31) >> 32) as i32;
        if config.count_limit {
            self.filtered(turns, step, factor.cast_signed())
        } else {
            self.at(turns, step)
        }
    }

    /// Paper B's second filter may leave a step in another period than it came from.
    #[cold]
    fn filtered(&mut self, turns: i32, step: i32, factor: i32) -> Periods {
        let steps = wide::mul_i32(turns, factor).wrapping_add(i64::from(step));
        let passed = self.count_limit.pass(steps);
        // Less than half of a sample's way from where it came from.
        let step = step.wrapping_add(passed.wrapping_sub(steps) as i32);
        let before = step.checked_div_euclid(factor).unwrap_or(0);
        self.at(turns.wrapping_add(before), step.wrapping_sub(before.wrapping_mul(factor)))
    }

    /// A step of a period, 0 … factor.
    fn at(&self, turns: i32, step: i32) -> Periods {
        let step = step.cast_unsigned();
        // A step is a little more than its 32 bits say.
        let part = wide::mul_u32(step, self.step).wrapping_add(u64::from(step / 2));
        Periods((i64::from(turns) << 32).wrapping_add(part.cast_signed()))
    }

    /// A block of samples has just been graded, or none was begun.
    #[inline]
    pub fn has_graded(&self) -> bool {
        self.health.ends_block()
    }

    /// What the last block of samples was like.
    pub fn report(&self) -> Report {
        self.health.report()
    }

    /// The counter saw an illegal transition.
    #[cold]
    pub fn illegal(&mut self) {
        self.health.illegal();
    }

    /// The position of the quadrant that begins at a count.
    pub fn position_of(&self, count: i64) -> Periods {
        self.join.begin(count)
    }

    /// Samples are ready for [`Head::update`].
    #[inline]
    pub fn wants_update(&self) -> bool {
        self.ready
    }

    /// Lets the recursion work on the samples that are ready: between ticks, in floats. Takes effect with the next tick.
    pub fn update(&mut self) -> Option<Update> {
        if !self.ready {
            return None;
        }
        self.ready = false;
        let block: Moments = self.gather.take().moments();
        let update = self.recursive.update(&block);
        if let Update::Changed(ellipse) = &update {
            self.correction = Correction::of(ellipse);
            self.nominal = self.recursive.nominal();
            self.health.shape(ellipse);
        }
        Some(update)
    }

    /// The ellipse in use.
    pub fn ellipse(&self) -> &Ellipse {
        self.recursive.ellipse()
    }
}
