//! A disturbed encoder line and the counter that reads it, edge by edge.
//!
//! All times are clocks of 125 MHz. The disturbances stay within the limits of `abbe_core::front::quadrature`: every
//! edge settles before the next begins, and a settled channel leaves its level for less than the filter, unless a test
//! asks for longer noise.

use abbe_core::front::quadrature::levels;
use abbe_core::front::{CLOCK_HZ, QuadratureCounter};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Largest number of bounces of a comparator at an edge.
const MOST_BOUNCES: u64 = 6;
/// Places between two readings, at most: what a reading counts must fit 16 bits.
const LONGEST_RUN: u64 = 4096;

/// A line at one speed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Clocks from edge to edge.
    pub(crate) spacing: u64,
    /// The filter, clocks.
    pub(crate) filter: u8,
    /// Noise is shorter than so many clocks; within the limits if that is the filter.
    pub(crate) noise: u8,
}

/// What was put on a line, and what came of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Edges of the true motion.
    pub(crate) edges: u64,
    /// Turns by the phase at which they happened, backwards and forwards.
    pub(crate) turns: [[u64; 4]; 2],
    /// Changes of a comparator that chattered.
    pub(crate) bounces: u64,
    /// Pulses of noise.
    pub(crate) pulses: u64,
    /// Pulses that the filter says it removed, of noise and of chatter.
    pub(crate) glitches: u64,
    /// Counts by which readings differed from the true place.
    pub(crate) lost: u64,
    /// Illegal transitions.
    pub(crate) illegal: u64,
}

impl Tally {
    /// Both together.
    pub(crate) fn and(mut self, other: &Self) -> Self {
        for (turns, more) in self.turns.as_flattened_mut().iter_mut().zip(other.turns.as_flattened()) {
            *turns += more;
        }
        Self {
            edges: self.edges + other.edges,
            turns: self.turns,
            bounces: self.bounces + other.bounces,
            pulses: self.pulses + other.pulses,
            glitches: self.glitches + other.glitches,
            lost: self.lost + other.lost,
            illegal: self.illegal + other.illegal,
        }
    }
}

impl Line {
    /// The line of a scale with counts of `count_um` at `speed_mm_s`.
    pub(crate) fn at(speed_mm_s: f64, count_um: f64, filter: u8) -> Self {
        let spacing = (f64::from(CLOCK_HZ) * count_um * 1e-3 / speed_mm_s).round() as u64;
        let line = Self { spacing, filter, noise: filter };
        assert!(line.quiet() > 0, "no room between edges for bounces, filter and noise");
        line
    }

    /// An edge comes up to so much too early or too late.
    fn jitter(self) -> u64 {
        self.spacing / 8
    }

    /// Longest gap between two bounces: the filter removes half of them, the others count, there and back.
    fn gap(self) -> u64 {
        2 * u64::from(self.filter)
    }

    /// An edge has settled after this time, whatever its chatter.
    fn settled(self) -> u64 {
        MOST_BOUNCES * self.gap() + u64::from(self.filter)
    }

    /// Of what is left until the next edge, the time in which a pulse may begin: it ends, and another may begin, before
    /// that edge.
    fn quiet(self) -> u64 {
        let taken = 2 * self.jitter() + self.settled() + 2 * u64::from(self.noise) + u64::from(self.filter);
        self.spacing.saturating_sub(taken)
    }

    /// Runs over `edges` edges, forward and back; the same for the same seed.
    pub(crate) fn run(self, edges: u64, seed: u64) -> Tally {
        let (a, b) = levels(0);
        let counter = QuadratureCounter::new(self.filter, a, b);
        let mut run = Run {
            line: self,
            random: Pcg64Mcg::seed_from_u64(seed),
            counter,
            due: self.spacing,
            place: 0,
            ahead: true,
            missing: 0,
            tally: Tally::default(),
        };
        while run.tally.edges < edges {
            run.one_way(edges);
        }
        run.tally
    }
}

struct Run {
    line: Line,
    random: Pcg64Mcg,
    counter: QuadratureCounter,
    /// When the next edge comes if it is neither early nor late.
    due: u64,
    place: i64,
    ahead: bool,
    /// What is lost already: each count is lost once.
    missing: i64,
    tally: Tally,
}

/// Random bits, each used once: an edge with all its disturbances takes 62 at most, chatter has its own.
struct Bits(u64);

impl Bits {
    /// `count` of them, at most 32.
    fn take(&mut self, count: u32) -> u64 {
        let taken = self.0 & ((1 << count) - 1);
        self.0 >>= count;
        taken
    }

    /// Below `end`, from `count` of them.
    fn below(&mut self, end: u64, count: u32) -> u64 {
        (self.take(count) * end) >> count
    }
}

impl Run {
    /// From one turn to the next, then a reading. Half of the ways are a few edges long, as of a stage that shakes.
    fn one_way(&mut self, edges: u64) {
        let mut bits = Bits(self.random.random());
        let longest = [4, 4, 64, LONGEST_RUN][bits.take(2) as usize];
        for _ in 0..(1 + bits.below(longest, 16)).min(edges - self.tally.edges) {
            self.edge();
        }
        self.turn();
        self.read();
    }

    fn turn(&mut self) {
        self.ahead = !self.ahead;
        self.tally.turns[usize::from(self.ahead)][self.place.rem_euclid(4) as usize] += 1;
    }

    /// One edge of the motion and what disturbs it; all has ended when the next may come.
    fn edge(&mut self) {
        let mut bits = Bits(self.random.random());
        let at = self.due - self.line.jitter() + bits.below(2 * self.line.jitter() + 1, 16);
        let before = levels(self.place);
        self.place += if self.ahead { 1 } else { -1 };
        let after = levels(self.place);
        self.due += self.line.spacing;
        self.tally.edges += 1;
        match bits.take(4) {
            0 => self.chatter(at, before, after),
            1 => self.across(at, before, after, &mut bits),
            _ => self.put(at, after),
        }
        if bits.take(3) == 0 {
            self.pulse(at + self.line.settled(), after, &mut bits);
        }
    }

    #[inline]
    fn put(&mut self, clock: u64, (a, b): (bool, bool)) {
        self.counter.edge(clock, a, b, false);
    }

    /// The comparator changes its mind 2, 4 or 6 times before it stays.
    fn chatter(&mut self, mut at: u64, before: (bool, bool), after: (bool, bool)) {
        let mut bits = Bits(self.random.random());
        self.put(at, after);
        for _ in 0..=bits.take(2).min(2) {
            for levels in [before, after] {
                at += 1 + bits.below(self.line.gap(), 8);
                self.put(at, levels);
                self.tally.bounces += 1;
            }
        }
    }

    /// A pulse on the other channel that begins before the edge and ends after it, or with it.
    fn across(&mut self, at: u64, before: (bool, bool), after: (bool, bool), bits: &mut Bits) {
        let length = self.length(bits);
        let early = 1 + bits.below(length, 7);
        let on_a = before.0 == after.0;
        let other = |(a, b)| (a ^ on_a, b ^ !on_a);
        self.put(at - early, other(before));
        if early < length {
            self.put(at, other(after));
        }
        self.put(at - early + length, after);
        self.tally.pulses += 1;
    }

    /// A pulse in the quiet time before the next edge, on A, on B, or on both.
    fn pulse(&mut self, settled: u64, levels: (bool, bool), bits: &mut Bits) {
        let length = self.length(bits);
        let (begin, on) = (settled + bits.below(self.line.quiet(), 16), 1 + bits.take(2).min(2));
        self.put(begin, (levels.0 ^ (on & 1 != 0), levels.1 ^ (on & 2 != 0)));
        self.put(begin + length, levels);
        self.tally.pulses += u64::from(on.count_ones());
    }

    /// Of a pulse.
    fn length(&self, bits: &mut Bits) -> u64 {
        1 + bits.below(u64::from(self.line.noise) - 1, 7)
    }

    fn read(&mut self) {
        // The next edge is due a spacing later than the last; nothing of it has begun.
        let clock = self.due - self.line.jitter() - u64::from(self.line.noise);
        let reading = self.counter.read(clock);
        let missing = i64::from((self.place as u32).wrapping_sub(reading.counter).cast_signed());
        self.tally.lost += missing.abs_diff(self.missing);
        self.missing = missing;
        self.tally.glitches += u64::from(reading.glitches);
        self.tally.illegal += u64::from(reading.illegal);
    }
}
