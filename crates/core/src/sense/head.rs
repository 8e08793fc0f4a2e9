//! An analogue reading head, tick by tick: a sine and a cosine become a position, corrected, counted and watched.

use super::correct::{Correction, Residual};
use super::course::Course;
use super::ellipse::Ellipse;
use super::harmonics::Harmonics;
use super::health::{Findings, Health, Report, Sample, SignalFault, shape};
use super::limit::{CountLimit, SampleLimit};
use super::moments::Block;
use super::periods::{Join, Periods, Unwrap};
use super::phase::Phase;
use super::recursive::{FASTEST, Gather, Recursive, Update};
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
    /// Follow drift: let the recursion change the correction. Without it the recursion only looks, for the grade.
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

/// What a head remembers. In this order, what each tick needs lies within reach of a Cortex-M0+'s short loads.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Head {
    join: Join,
    course: Course,
    last: Periods,
    unwrap: Unwrap,
    correction: Correction,
    nominal: u32,
    /// 2³² / factor, for the position of a step.
    step: u32,
    /// The sample of this tick was put in the place of another.
    replaced: bool,
    /// A block is whole, and none is begun until its [`Refined`] comes.
    ready: bool,
    tracks: bool,
    health: Health,
    gather: Gather,
    residual: Residual,
    limits: [SampleLimit; 2],
    count_limit: CountLimit,
    recursive: Recursive,
}

impl Head {
    /// A head that has seen nothing yet. Floats: before the first tick.
    pub fn new(config: &Config) -> Self {
        let recursive = Recursive::new(config.ellipse);
        let Ellipse { p, q, radius, .. } = config.ellipse;
        let centre = [p, q].map(|offset| libm::round(offset) as i16);
        let mut health = Health::new(recursive.nominal());
        health.take_shape(shape(&config.ellipse));
        // What the recursion follows, the table must leave to it, or both take it off.
        let harmonics = if config.tracks { config.harmonics.beyond_an_ellipse() } else { config.harmonics };
        Self {
            correction: recursive.correction(),
            residual: harmonics.residual(),
            nominal: recursive.nominal(),
            join: Join::default(),
            unwrap: Unwrap::default(),
            limits: [SampleLimit::new(config.sample_limit); 2],
            replaced: false,
            count_limit: CountLimit::default(),
            health,
            gather: Gather::new(centre, libm::round(radius) as u16),
            ready: false,
            recursive,
            tracks: config.tracks,
            course: Course::default(),
            last: Periods(0),
            step: u32::MAX.checked_div(u32::from(config.factor)).unwrap_or(0),
        }
    }

    /// One tick: a sample, if one came, and the count of the same instant, extended to 64 bit.
    #[inline]
    pub fn read(&mut self, sample: Option<SinCos>, count: i64, config: &Config) -> Read {
        let Some(sample) = sample else { return self.bridge(count, config) };
        let clipped = is_beyond(sample.sin, config.rail) || is_beyond(sample.cos, config.rail);
        let sample = if config.sample_limit == 0 { sample } else { self.limited(sample) };
        let polar = self.correction.polar(sample);
        let phase = self.residual.take_off(polar.phase);
        let meets = config.counted && !self.join.is_sure();
        // A vector too short to have a phase says nothing about the place.
        let (position, beside, slipped) = if self.health.is_short(polar.radius) {
            // Its comparators may not count any more.
            self.course.coast();
            (self.bridged(count, config), 0, false)
        } else {
            self.place(count, phase, config)
        };
        let seen = Sample { radius: polar.radius, clipped, beside, counted: config.counted, slipped };
        let fault = self.health.sample(&seen);
        if fault.is_some() {
            self.begin_anew(count, (!self.health.is_short(polar.radius)).then_some(phase));
        }
        // Gathering can wait for a tick that has nothing else to do: no tick does all that a tick may do.
        let busy = meets || self.health.ends_block();
        // What the converter has cut off, or a filter put in its place, draws no ellipse.
        if !self.ready && !busy && !seen.clipped && !self.replaced && self.is_slow(config) {
            self.ready = self.gather.sample(sample, polar, self.nominal);
        }
        self.last = position;
        let position = if config.factor == 0 { self.last } else { self.stepped(config) };
        Read { position, fault }
    }

    /// After a fault nothing that was known of the period holds; what is read from now on does, once the zero is found.
    #[cold]
    fn begin_anew(&mut self, count: i64, phase: Option<Phase>) {
        match phase {
            Some(phase) => self.join.begin_anew(count, phase, self.last),
            None => self.join.doubt(),
        }
        self.unwrap = Unwrap::from(self.last);
        self.course = Course::default();
    }

    /// What count and phase were to each other, and the speed, may have come from signals that were false: both are found
    /// anew with the next sample. Only while nobody relies on the zero: the position may move by half a period.
    #[cold]
    pub fn doubt(&mut self) {
        self.begin_anew(0, None);
        if !self.ready {
            self.gather.begin();
        }
    }

    /// Where the head is, what of it is not as it should be, and whether it slipped.
    #[inline]
    fn place(&mut self, count: i64, phase: Phase, config: &Config) -> (Periods, i32, bool) {
        if config.counted {
            let joined = self.join.join(count, phase);
            (joined.position, joined.disagreement, self.course.next(joined.position))
        } else {
            let followed = self.unwrap.next(phase);
            (followed.position, followed.surprise, false)
        }
    }

    /// Slow enough for a sample to lie where it seems to: the channels are not sampled at quite the same time.
    #[inline]
    fn is_slow(&self, config: &Config) -> bool {
        if config.counted { self.course.is_slower_than(FASTEST) } else { self.unwrap.is_slower_than(FASTEST) }
    }

    /// No sample.
    #[cold]
    fn bridge(&mut self, count: i64, config: &Config) -> Read {
        let missed = self.health.miss();
        self.last = self.bridged(count, config);
        // Before count and phase have met there is no place to go on from.
        let slipped = config.counted && self.join.has_met() && self.course.next(self.last);
        let fault = if slipped { Some(SignalFault::Slipped) } else { missed };
        let position = if config.factor == 0 { self.last } else { self.stepped(config) };
        Read { position, fault }
    }

    /// Where the head is without a phase: as far as it went in the ticks before, but within what the count says.
    #[cold]
    fn bridged(&mut self, count: i64, config: &Config) -> Periods {
        if config.counted {
            let gone_on = Periods(self.last.0.wrapping_add(self.course.way()));
            self.join.nearest_to(gone_on, count)
        } else {
            self.unwrap.miss().unwrap_or(self.last)
        }
    }

    #[cold]
    fn limited(&mut self, sample: SinCos) -> SinCos {
        let [cos, sin] = &mut self.limits;
        let passed = SinCos { cos: cos.pass(sample.cos), sin: sin.pass(sample.sin) };
        self.replaced = passed != sample;
        passed
    }

    /// The position in whole steps of the period.
    #[inline(never)]
    fn stepped(&mut self, config: &Config) -> Periods {
        let factor = config.factor;
        let turns = (self.last.0 >> 32) as i32;
        // From the beginning of the period, rounded to nearest: may be all of its steps.
        let step = (wide::mul_u32_u16(self.last.0 as u32, factor).wrapping_add(1 << 31) >> 32) as u16;
        if config.count_limit { self.filtered(turns, step, factor) } else { self.at(turns, step) }
    }

    /// Paper B's second filter may leave a step in another period than it came from.
    #[cold]
    fn filtered(&mut self, turns: i32, step: u16, factor: u16) -> Periods {
        let (step, factor) = (i32::from(step), i32::from(factor));
        let steps = wide::mul_i32(turns, factor).wrapping_add(i64::from(step));
        let passed = self.count_limit.pass(steps);
        // At most the way of a sample from where it came from.
        let step = step.wrapping_add(passed.wrapping_sub(steps) as i32);
        let before = step.checked_div_euclid(factor).unwrap_or(0);
        self.at(turns.wrapping_add(before), step.wrapping_sub(before.wrapping_mul(factor)) as u16)
    }

    /// A step of a period, 0 … factor.
    fn at(&self, turns: i32, step: u16) -> Periods {
        // A step is a little more than its 32 bits say.
        let part = wide::mul_u32_u16(self.step, step).wrapping_add(u64::from(step / 2));
        Periods((i64::from(turns) << 32).wrapping_add(part.cast_signed()))
    }

    /// A block of samples has just been graded.
    #[inline]
    pub fn has_graded(&self) -> bool {
        self.health.ends_block()
    }

    /// What the last block of samples was like; none before the first has ended.
    pub fn report(&self) -> Option<Report> {
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

    /// A block of samples is ready for a fit; see [`Head::refining`].
    #[inline]
    pub fn wants_refining(&self) -> bool {
        self.ready
    }

    /// What a fit needs, to take along: a fit is slower than a tick, and the head goes on meanwhile. Bring what comes of it
    /// to [`Head::take_refined`]. None while no block is ready.
    pub fn refining(&self) -> Option<Refining> {
        self.ready.then(|| Refining { block: self.gather.block(), recursive: self.recursive })
    }

    /// Takes what a fit came to: a few words, in force from the next sample on. The next block begins.
    pub fn take_refined(&mut self, refined: Refined) {
        self.ready = false;
        self.gather.begin();
        if self.tracks && !self.recursive.has_learned() {
            self.health.forget();
        }
        self.recursive = refined.recursive;
        if let Some(changed) = refined.changed {
            self.health.take_shape(changed.shape);
            if self.tracks {
                self.correction = changed.correction;
                self.nominal = changed.nominal;
            }
        }
        self.gather.has_fitted(self.nominal);
    }

    /// All of it at once, for who can wait for a fit.
    pub fn refine(&mut self) {
        if let Some(refining) = self.refining() {
            self.take_refined(refining.fit());
        }
    }

    /// The ellipse of the signals as the recursion has it; in use, if the head tracks.
    pub fn ellipse(&self) -> &Ellipse {
        self.recursive.ellipse()
    }
}

/// A code as far from zero as the end of the converter, or farther.
#[inline]
fn is_beyond(code: i16, rail: i16) -> bool {
    let (code, rail) = (i32::from(code), i32::from(rail));
    code.wrapping_add(rail) <= 0 || code >= rail
}

/// A block of samples and the estimate that it is to join.
#[derive(Clone, Copy, Debug)]
pub struct Refining {
    block: Block,
    recursive: Recursive,
}

/// The estimate after a block, and what the tick takes off from now on.
#[derive(Clone, Copy, Debug)]
pub struct Refined {
    recursive: Recursive,
    changed: Option<Changed>,
}

/// Everything that belongs to a new ellipse, ready for the tick.
#[derive(Clone, Copy, Debug)]
struct Changed {
    correction: Correction,
    nominal: u32,
    shape: [Findings; 2],
}

impl Refining {
    /// Fits, in floats: between ticks, or beside them.
    pub fn fit(&self) -> Refined {
        let mut recursive = self.recursive;
        let update = recursive.update(&self.block.moments());
        let changed = matches!(update, Update::Changed(_)).then(|| Changed {
            correction: recursive.correction(),
            nominal: recursive.nominal(),
            shape: shape(recursive.ellipse()),
        });
        Refined { recursive, changed }
    }
}
