//! Counts edges for hours of a stage's life and says how many were lost: `edges [EDGES]`, 10 000 000 if not said.
//!
//! A grating of 0.8 µm has an edge each 0.2 µm. They come with jitter, with the chatter of comparators, and with noise
//! shorter than the filter; the motion turns round again and again, at every phase and from both sides. What was lost is
//! counted against where the stage really is, after every stretch. Ends with 1 if a count was lost.

use abbe_core::front::QuadratureCounter;
use abbe_core::front::quadrature::levels;
use std::process::ExitCode;

/// Clocks of the front end in a second, and of its filter: 40 ns.
const CLOCK_HZ: f64 = 125e6;
const FILTER: u8 = 5;
/// Edges between two looks.
const STRETCH: u64 = 1 << 16;

/// A speed, and what its edges came to.
#[derive(Clone, Copy, Default)]
pub(crate) struct Tally {
    pub(crate) edges: u64,
    /// Turns at each phase, going up and going down.
    pub(crate) turns: [[u64; 2]; 4],
    noise: u64,
    /// Pulses that the filter took for noise.
    pub(crate) filtered: u64,
    chatter: u64,
    pub(crate) illegal: u64,
    pub(crate) lost: u64,
}

struct Random(u64);

impl Random {
    /// xorshift64* (Vigna, 2016): an edge is a few nanoseconds, and so must this be.
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
}

/// Edges with a spacing of `spacing` clocks, ± half of it.
struct Stage {
    random: Random,
    spacing: u64,
    clock: u64,
    place: i64,
    up: bool,
    counter: QuadratureCounter,
    tally: Tally,
}

impl Stage {
    fn new(seed: u64, spacing: u64) -> Self {
        Self {
            random: Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1),
            spacing,
            clock: 0,
            place: 0,
            up: true,
            counter: QuadratureCounter::new(FILTER, false, false),
            tally: Tally::default(),
        }
    }

    fn edge(&mut self) {
        let random = self.random.next();
        // Jitter: ± half of the spacing, evenly.
        self.clock += self.spacing / 2 + (random & 0xffff) * self.spacing / 0x1_0000;
        // One edge in 64 turns round, one in 16 chatters, one in 8 is followed by noise.
        if random >> 58 == 0 {
            self.up = !self.up;
            self.tally.turns[(self.place & 3) as usize][usize::from(self.up)] += 1;
        }
        let from = levels(self.place);
        self.place += if self.up { 1 } else { -1 };
        let to = levels(self.place);
        if (random >> 40).is_multiple_of(16) {
            self.chatter(from, to, random >> 16);
        }
        self.counter.edge(self.clock, to.0, to.1, false);
        self.tally.edges += 1;
        if (random >> 32).is_multiple_of(8) {
            self.noise(to, random >> 20);
        }
    }

    /// The comparator goes there and back before it stays: long enough to be counted there and back, or not.
    fn chatter(&mut self, from: (bool, bool), to: (bool, bool), random: u64) {
        let long = 1 + (random & 15);
        self.counter.edge(self.clock, to.0, to.1, false);
        self.counter.edge(self.clock + long, from.0, from.1, false);
        self.clock += 2 * long + 1;
        self.tally.chatter += 1;
    }

    /// A pulse on a line, shorter than the filter, long after the edge.
    fn noise(&mut self, (a, b): (bool, bool), random: u64) {
        let long = 1 + random % (u64::from(FILTER) - 1);
        let on_a = random & 64 == 0;
        self.clock += u64::from(FILTER) + 1;
        self.counter.edge(self.clock, a ^ on_a, b ^ !on_a, false);
        self.counter.edge(self.clock + long, a, b, false);
        self.clock += long + u64::from(FILTER) + 1;
        self.tally.noise += 1;
    }

    fn run(mut self, edges: u64) -> Tally {
        let mut off = 0;
        while self.tally.edges < edges {
            for _ in 0..STRETCH.min(edges - self.tally.edges) {
                self.edge();
            }
            let reading = self.counter.read(self.clock + u64::from(FILTER));
            self.tally.filtered += u64::from(reading.glitches);
            self.tally.illegal += u64::from(reading.illegal);
            // A count that was lost once stays lost: only what is new counts.
            let now = (self.place as u32).wrapping_sub(reading.counter).cast_signed();
            self.tally.lost += u64::from(now.wrapping_sub(off).unsigned_abs());
            off = now;
        }
        self.tally
    }
}

impl Tally {
    fn with(mut self, other: &Self) -> Self {
        self.edges += other.edges;
        self.noise += other.noise;
        self.filtered += other.filtered;
        self.chatter += other.chatter;
        self.illegal += other.illegal;
        self.lost += other.lost;
        for (mine, theirs) in self.turns.iter_mut().flatten().zip(other.turns.iter().flatten()) {
            *mine += theirs;
        }
        self
    }
}

/// All edges of a speed, on both cores of a small machine.
pub(crate) fn tally(mm_s: f64, edges: u64) -> Tally {
    let spacing = (0.2e-3 / mm_s * CLOCK_HZ) as u64;
    let halves = [1, 2]
        .map(|seed| std::thread::spawn(move || Stage::new(seed + mm_s as u64 * 10, spacing).run(edges / 2)));
    halves
        .into_iter()
        .map(|half| half.join().expect("a thread ends"))
        .fold(Tally::default(), |all, half| all.with(&half))
}

fn main() -> ExitCode {
    let asked = std::env::args().nth(1).unwrap_or_else(|| "10000000".into());
    let Ok(edges) = asked.parse::<u64>() else {
        eprintln!("edges: {asked} is not a number of edges");
        return ExitCode::from(2);
    };
    println!(
        "| speed, mm/s | edges | turns, each phase and side | noise | chatter | filtered | illegal | lost |"
    );
    println!("|---:|---:|---|---:|---:|---:|---:|---:|");
    let mut lost = 0;
    for mm_s in [5.0, 50.0] {
        let all = tally(mm_s, edges / 2);
        let turns: Vec<u64> = all.turns.iter().flatten().copied().collect();
        let (least, most) = (turns.iter().min().unwrap_or(&0), turns.iter().max().unwrap_or(&0));
        println!(
            "| {mm_s} | {} | {least} … {most} | {} | {} | {} | {} | {} |",
            all.edges, all.noise, all.chatter, all.filtered, all.illegal, all.lost
        );
        lost += all.lost + all.illegal + u64::from(*least == 0);
    }
    ExitCode::from(u8::from(lost != 0))
}
