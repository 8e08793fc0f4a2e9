//! What an encoder's lines do, clock by clock.

use abbe_core::front::quadrature::levels;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Levels of A, B, Z in bits 0, 1, 2.
pub type Lines = u32;

/// A bit of [`Lines`].
pub const A: Lines = 1;
/// A bit of [`Lines`].
pub const B: Lines = 2;
/// A bit of [`Lines`].
pub const Z: Lines = 4;

/// How an encoder moves.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Fewest clocks between two edges.
    pub closest: u64,
    /// Most clocks between two edges.
    pub farthest: u64,
    /// A move in one direction has at most so many edges, without marks.
    pub stroke: u64,
    /// Clocks between disturbances on A, B or both, on average; 0 without any.
    pub disturbed: u64,
    /// Clocks between disturbances on Z, on average and at least the half of it; 0 without any.
    pub index_disturbed: u64,
    /// Counts from one reference mark to the next; 0 without any.
    pub marks: i64,
}

/// The lines of an encoder that moves at random.
pub struct Encoder {
    motion: Motion,
    random: Pcg64Mcg,
    /// Where it stands.
    count: i64,
    edges: u64,
    up: bool,
    left: u64,
    next_edge: u64,
    gap: u64,
    /// What a disturbance turns over, and until when.
    upset: Lines,
    upset_until: u64,
    next_upset: u64,
    index_upset_until: u64,
    next_index_upset: u64,
}

impl Encoder {
    /// An encoder at count zero.
    pub fn new(motion: Motion, seed: u64) -> Self {
        Self {
            motion,
            random: Pcg64Mcg::seed_from_u64(seed),
            count: 0,
            edges: 0,
            up: true,
            left: 0,
            next_edge: 100,
            gap: motion.closest,
            upset: 0,
            upset_until: 0,
            next_upset: motion.disturbed,
            index_upset_until: 0,
            next_index_upset: motion.index_disturbed,
        }
    }

    /// Edges so far, without disturbances.
    pub fn edges(&self) -> u64 {
        self.edges
    }

    /// Where it stands.
    pub fn count(&self) -> i64 {
        self.count
    }

    /// The lines at `clock`, which goes on by one from call to call.
    #[inline]
    pub fn lines(&mut self, clock: u64) -> Lines {
        if clock >= self.next_edge {
            self.move_on(clock);
        }
        if self.motion.disturbed != 0 && clock >= self.next_upset {
            self.upset = [A, B, A | B][self.random.random_range(0..3)];
            self.upset_until = clock + self.random.random_range(1..=40);
            self.next_upset = self.upset_until + self.random.random_range(1..=2 * self.motion.disturbed);
        }
        if self.motion.index_disturbed != 0 && clock >= self.next_index_upset {
            self.index_upset_until = clock + self.random.random_range(1..=40);
            let mean = self.motion.index_disturbed;
            self.next_index_upset = self.index_upset_until + mean / 2 + self.random.random_range(0..=mean);
        }
        let upset = if clock < self.upset_until { self.upset } else { 0 };
        let index_upset = if clock < self.index_upset_until { Z } else { 0 };
        self.undisturbed() ^ upset ^ index_upset
    }

    #[inline]
    fn undisturbed(&self) -> Lines {
        let (a, b) = levels(self.count);
        let z = self.motion.marks != 0 && self.count.rem_euclid(self.motion.marks) == self.motion.marks / 2;
        Lines::from(a) | (Lines::from(b) << 1) | (Lines::from(z) << 2)
    }

    fn move_on(&mut self, clock: u64) {
        if self.left == 0 {
            // A new stroke, perhaps back, with a spacing of its own that varies by a clock or two. With marks it ends
            // halfway between two of them.
            self.left = match self.motion.marks {
                0 => self.random.random_range(1..=self.motion.stroke),
                marks => marks.unsigned_abs() * self.random.random_range(1..=3),
            };
            self.up = self.random.random_bool(0.5);
            self.gap = self.random.random_range(self.motion.closest..=self.motion.farthest);
        }
        self.left -= 1;
        self.edges += 1;
        self.count += if self.up { 1 } else { -1 };
        let gap = self.gap + self.random.random_range(0..=2);
        self.next_edge = clock + gap.min(self.motion.farthest);
    }
}
