//! The whole way of a position: signals, comparators, filter, counter, converter, head; tick by tick beside the truth.

use super::grating::{Comparators, PLACE, circle, ellipse, sample};
use super::motion::{Motion, PERIOD, Pace, Turn};
use abbe_core::edge::SinCos;
use abbe_core::front::QuadratureCounter;
use abbe_core::front::quadrature::levels;
use abbe_core::sense::harmonics::Harmonics;
use abbe_core::sense::head::{Config, Head, Read};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Clocks of a tick: 10 kHz.
const TICK: u64 = 12_500;
/// From one look of the comparators at their noise to the next, clocks: shorter than the filter, so that it works.
const LOOK: u64 = 10;
/// A quadrant, which a count is.
const QUADRANT: i64 = PERIOD / 4;
/// Parts of a period in which turns are told apart.
const PARTS: usize = 16;

/// A head over a grating.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    pub(crate) pace: Pace,
    /// With the counter; without, the phase is followed.
    pub(crate) counted: bool,
    /// The head knows the ellipse that the signals draw; else it takes them as they are.
    pub(crate) known: bool,
    /// The filter, clocks.
    pub(crate) filter: u8,
    /// Noise at the comparators, rms, part of the amplitude.
    pub(crate) noise: f64,
    /// A sample is taken up to so many clocks before or after the count of its tick.
    pub(crate) jitter: u64,
}

/// What a head went through, and what came of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Edges of the true motion: quarters of a period.
    pub(crate) edges: u64,
    pub(crate) ticks: u64,
    /// Turns by the part of the period in which they happened, backwards and forwards.
    pub(crate) turns: [[u64; PARTS]; 2],
    /// Changes of the comparators' levels.
    pub(crate) changes: u64,
    /// Pulses that the filter says it removed.
    pub(crate) glitches: u64,
    /// Counts by which the counter differed from the true place.
    pub(crate) lost: u64,
    /// Illegal transitions.
    pub(crate) illegal: u64,
    /// Periods by which the position differed from the true place.
    pub(crate) periods: u64,
    /// Ticks with a fault of the signals.
    pub(crate) faults: u64,
    /// The largest difference of the position from the true place at the sample, 2⁻³² of a period.
    pub(crate) worst: u64,
}

impl Tally {
    /// Both together.
    pub(crate) fn and(mut self, other: &Self) -> Self {
        for (turns, more) in self.turns.as_flattened_mut().iter_mut().zip(other.turns.as_flattened()) {
            *turns += more;
        }
        Self {
            edges: self.edges + other.edges,
            ticks: self.ticks + other.ticks,
            turns: self.turns,
            changes: self.changes + other.changes,
            glitches: self.glitches + other.glitches,
            lost: self.lost + other.lost,
            illegal: self.illegal + other.illegal,
            periods: self.periods + other.periods,
            faults: self.faults + other.faults,
            worst: self.worst.max(other.worst),
        }
    }

    /// Nothing was lost, no signal was taken for a fault, and the position was never off by more, periods.
    pub(crate) fn is_within(&self, bound: f64) -> bool {
        self.lost + self.illegal + self.periods + self.faults == 0 && self.worst_periods() < bound
    }

    /// The largest difference, periods.
    pub(crate) fn worst_periods(&self) -> f64 {
        self.worst as f64 / PERIOD as f64
    }
}

impl Track {
    /// What the project says a head may be asked for.
    pub(crate) fn at(pace: Pace, filter: u8) -> Self {
        Self { pace, counted: true, known: true, filter, noise: 0.005, jitter: 60 }
    }

    /// By how much its position may be off, periods: 2 nm when it knows the ellipse, 20 nm when it takes the signals for a
    /// circle at first. The ellipse's own error is 12.9 nm beside its mean.
    pub(crate) const fn bound(&self) -> f64 {
        if self.known { 1.0 / 400.0 } else { 1.0 / 40.0 }
    }

    /// Runs over `edges` edges or a tick's more; the same for the same seed.
    pub(crate) fn run(&self, edges: u64, seed: u64) -> Tally {
        let mut run = Run::new(self, seed);
        while run.way >> 30 < edges {
            run.tick();
        }
        Tally { edges: run.way >> 30, ..run.tally }
    }

    fn config(&self) -> Config {
        Config {
            period_pm: 800_000,
            ellipse: if self.known { ellipse() } else { circle() },
            harmonics: Harmonics([[0.0; 2]; 8]),
            rail: 32_700,
            counted: self.counted,
            factor: 0,
            sample_limit: 0,
            count_limit: false,
            tracks: true,
        }
    }
}

struct Run<'t> {
    track: &'t Track,
    config: Config,
    head: Head,
    random: Pcg64Mcg,
    motion: Motion,
    comparators: Comparators,
    levels: usize,
    counter: QuadratureCounter,
    /// The count of the quadrant in which the counter began.
    first: i64,
    clock: u64,
    /// The clock of the last tick.
    due: u64,
    /// What has been gone so far, forth and back, 2⁻³² of a period.
    way: u64,
    /// From the head's zero to that of the truth: whole periods.
    zero: Option<i64>,
    counts: Missing,
    periods: Missing,
    tally: Tally,
}

impl<'t> Run<'t> {
    fn new(track: &'t Track, seed: u64) -> Self {
        let motion = Motion::new(track.pace, seed);
        let comparators = Comparators::new(track.noise);
        let levels = comparators.first(motion.at(0));
        let (a, b) = pins(levels);
        let config = track.config();
        Self {
            track,
            config,
            head: Head::new(&config),
            random: Pcg64Mcg::seed_from_u64(!seed),
            first: quadrant(levels, motion.at(0)),
            motion,
            comparators,
            levels,
            counter: QuadratureCounter::new(track.filter, a, b),
            clock: 0,
            due: 0,
            way: 0,
            zero: None,
            // A count is off by half of a quadrant where all is well, and by the comparators' lateness.
            counts: Missing { step: QUADRANT, room: 3 * QUADRANT / 4, steps: 0 },
            periods: Missing { step: PERIOD, room: PERIOD / 2, steps: 0 },
            tally: Tally::default(),
        }
    }

    /// The count of a tick and a sample, one a little before the other, through the head.
    fn tick(&mut self) {
        self.due += TICK;
        let jitter = self.track.jitter;
        let taken = self.due - jitter + self.random.random_range(0..=2 * jitter);
        let early = (taken < self.due).then(|| self.sample(taken));
        let count = self.count();
        let (sample, truth) = early.unwrap_or_else(|| self.sample(taken));
        let read = self.read(sample, count);
        self.judge(read, truth);
    }

    /// What the converter gives, and where the stage is.
    fn sample(&mut self, taken: u64) -> (SinCos, i64) {
        self.go_to(taken);
        let place = self.motion.at(taken);
        (sample(place, &mut self.random), place)
    }

    /// The counter of the tick, which is judged by itself, too. No run is long enough for it to wrap.
    fn count(&mut self) -> i64 {
        self.go_to(self.due);
        let reading = self.counter.read(self.due);
        let count = self.first + i64::from(reading.counter.cast_signed());
        self.tally.glitches += u64::from(reading.glitches);
        self.tally.illegal += u64::from(reading.illegal);
        if self.track.counted {
            let middle = count * QUADRANT + QUADRANT / 2;
            self.tally.lost += self.counts.since(self.motion.at(self.due) - middle);
        }
        count
    }

    /// As a tick of the controller does it, and who has time between ticks.
    fn read(&mut self, sample: SinCos, count: i64) -> Read {
        let read = self.head.read(Some(sample), count, &self.config);
        self.head.refine();
        read
    }

    fn judge(&mut self, read: Read, truth: i64) {
        let off = truth - read.position.0;
        let zero = *self.zero.get_or_insert((off + PERIOD / 2).div_euclid(PERIOD) * PERIOD);
        self.tally.ticks += 1;
        self.tally.periods += self.periods.since(off - zero);
        self.tally.faults += u64::from(read.fault.is_some());
        self.tally.worst = self.tally.worst.max((off - zero).unsigned_abs());
    }

    /// Goes on to a clock, from stretch to stretch.
    fn go_to(&mut self, clock: u64) {
        while self.clock < clock {
            let end = clock.min(self.motion.end());
            self.way += self.motion.at(end).abs_diff(self.motion.at(self.clock));
            if self.track.counted {
                self.look_until(end);
            }
            self.clock = end;
            if end == self.motion.end()
                && let Some(Turn { ahead, place }) = self.motion.go_on()
            {
                self.tally.turns[usize::from(ahead)][(place as u32 >> 28) as usize] += 1;
            }
        }
    }

    /// The comparators look at their noise wherever it could matter; in between the stage goes straight on.
    fn look_until(&mut self, end: u64) {
        let clocks_a_place = PLACE as f64 / self.motion.speed(self.clock).max(self.motion.speed(end));
        let mut quiet = self.comparators.quiet(self.motion.at(self.clock), self.levels);
        loop {
            self.clock += if quiet == 0 {
                LOOK
            } else {
                // Nothing is as far as 2³² clocks.
                u64::from((f64::from(quiet) * clocks_a_place) as u32).max(LOOK)
            };
            if self.clock > end {
                return;
            }
            let place = self.motion.at(self.clock);
            let levels = self.comparators.compare(place, self.levels, &mut self.random);
            if levels != self.levels {
                let (a, b) = pins(levels);
                self.counter.edge(self.clock, a, b, false);
                self.tally.changes += 1;
                self.levels = levels;
            }
            quiet = self.comparators.quiet(place, levels);
        }
    }
}

/// How many whole steps something is beside the truth; each is lost once.
struct Missing {
    step: i64,
    /// Beside a step by no more than this is as good as there.
    room: i64,
    steps: i64,
}

impl Missing {
    /// The steps that were lost since the last look.
    fn since(&mut self, off: i64) -> u64 {
        if (off - self.steps * self.step).abs() <= self.room {
            return 0;
        }
        let steps = (off + self.step / 2).div_euclid(self.step);
        steps.abs_diff(std::mem::replace(&mut self.steps, steps))
    }
}

fn pins(levels: usize) -> (bool, bool) {
    (levels & 1 != 0, levels & 2 != 0)
}

/// The quadrant that has these levels and is nearest to a place.
fn quadrant(in_it: usize, place: i64) -> i64 {
    let n = (0..4).find(|&n| levels(n) == pins(in_it)).unwrap_or(0);
    let off = place - (n * QUADRANT + QUADRANT / 2);
    n + 4 * (off + PERIOD / 2).div_euclid(PERIOD)
}
