//! The decoder of one axis: its two state machines, and [`QuadratureCounter`] clocked at the same instants.

use crate::block::{Block, Fifo, Setup};
use crate::signal::{A, B, Lines, Z};
use abbe_core::front::decoder_words::{FRESH, LATCHED};
use abbe_core::front::{DecoderWords, QuadratureCounter, Reading};

/// Clocks of one loop.
pub const LOOP: u64 = 11;
/// Clocks from the start to the first look at A and B: four instructions of start, what lies between, and one.
const FIRST_LOOK: u64 = 11;
/// Z is looked at so many clocks after A and B.
const INDEX_LOOK: u64 = 8;
/// The first word, before any look, is pushed in this clock.
const FIRST_WORD: u64 = 9;

const COUNTING: usize = 0;
const LATCHING: usize = 1;

/// Both machines of an axis with A, B, Z at pins 0, 1, 2.
pub struct Decoder {
    block: Block,
    clock: u64,
    lines: Lines,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// Loaded and started.
    pub fn new() -> Self {
        let program = pio::pio_file!("../../firmware/pico/pio/decoder.pio");
        let (end, look) = (program.public_defines.end as u8, program.public_defines.look as u8);
        let mut block = Block::load(&program.program);
        let counting = Setup::default();
        let latching = Setup { wrap: Some((end, look)), jmp_pin: 2, fifo: Fifo::Receive, ..Setup::default() };
        block.set_up(COUNTING, &counting);
        block.set_up(LATCHING, &latching);
        block.start(1 << COUNTING | 1 << LATCHING);
        Self { block, clock: 0, lines: 0 }
    }

    /// One clock.
    #[inline]
    pub fn step(&mut self, lines: Lines) {
        self.lines = lines;
        self.block.step(lines);
        self.clock += 1;
    }

    /// A word of the counting machine.
    #[inline]
    pub fn counted(&mut self) -> Option<u32> {
        self.block.take(COUNTING)
    }

    /// A word of the latching machine.
    #[inline]
    pub fn latched(&mut self) -> Option<u32> {
        self.block.take(LATCHING)
    }

    /// What a processor reads in a tick, as [`DecoderWords`] says, at one FIFO access in `pace` clocks.
    ///
    /// `lines` is asked for each clock's levels and told the look whose count the fresh word will hold.
    pub fn tick(
        &mut self,
        words: &mut DecoderWords,
        pace: u32,
        mut lines: impl FnMut(u64) -> Lines,
    ) -> Ticked {
        let mut latched = Vec::new();
        let mut look = u64::MAX;
        let mut wait = |decoder: &mut Self, look: u64| {
            for _ in 0..pace {
                decoder.step(lines(look));
            }
        };
        while let Some(word) = self.latched() {
            latched.push(word);
            wait(self, look);
        }
        // The FIFO has been full for long: the word after those in it is the first that is pushed from now on.
        look = (self.clock - FIRST_WORD).div_ceil(LOOP);
        let mut fresh = 0;
        for _ in 0..FRESH {
            fresh = loop {
                let word = self.counted();
                wait(self, look);
                if let Some(word) = word {
                    break word;
                }
            };
        }
        let before = self.lines & Z != 0;
        while let Some(word) = self.latched() {
            latched.push(word);
            wait(self, look);
        }
        let z = before || self.lines & Z != 0;
        latched.truncate(LATCHED);
        Ticked { reading: words.read(fresh, &latched, z), look }
    }
}

/// What a tick read.
pub struct Ticked {
    /// The reading.
    pub reading: Reading,
    /// The look whose count the fresh word holds, as [`Model::at`] numbers them.
    pub look: u64,
}

/// The same encoder seen by [`QuadratureCounter`] with a filter of 1, clocked where the program looks at the lines.
///
/// Z is what it was in the look before A and B were looked at, and passes only if it was high in two looks.
pub struct Model {
    counter: QuadratureCounter,
    clock: u64,
    next_look: u64,
    next_index_look: u64,
    /// Looks at A and B so far.
    looks: u64,
    /// A and B of the last look, while it is not known whether Z passes.
    pending: Option<Lines>,
    /// The last three looks at Z, the newest last.
    index_looks: [bool; 3],
    /// Counter and illegal transitions after the last looks.
    log: [Seen; LOG],
    illegal: u64,
    /// Rises of the index, oldest first.
    indices: Vec<u32>,
    /// Single looks at Z.
    glitches: u64,
}

/// What was known after a look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// The counter.
    pub counter: u32,
    /// Illegal transitions so far.
    pub illegal: u64,
    /// Z was high in the look at it that follows.
    pub index_high: bool,
}

/// So many looks are remembered.
const LOG: usize = 16;

impl Model {
    /// A counter at zero whose lines stand at `lines`.
    pub fn new(lines: Lines) -> Self {
        Self {
            counter: QuadratureCounter::new(1, lines & A != 0, lines & B != 0),
            clock: 0,
            next_look: FIRST_LOOK,
            next_index_look: FIRST_LOOK - LOOP + INDEX_LOOK,
            looks: 0,
            pending: None,
            index_looks: [false; 3],
            log: [Seen::default(); LOG],
            illegal: 0,
            indices: Vec::new(),
            glitches: 0,
        }
    }

    /// One clock.
    #[inline]
    pub fn step(&mut self, lines: Lines) {
        if self.clock == self.next_look {
            self.next_look += LOOP;
            self.pending = Some(lines);
        } else if self.clock == self.next_index_look {
            self.next_index_look += LOOP;
            self.look_at_index(lines & Z != 0);
        }
        self.clock += 1;
    }

    fn look_at_index(&mut self, high: bool) {
        let [_, before, last] = self.index_looks;
        self.index_looks = [before, last, high];
        self.glitches += u64::from(last && !before && !high);
        let Some(lines) = self.pending.take() else { return };
        let passes = last && (before || high);
        self.counter.edge(self.looks, lines & A != 0, lines & B != 0, passes);
        self.looks += 1;
        let reading = self.counter.read(self.looks);
        self.illegal += u64::from(reading.illegal);
        self.indices.extend(reading.index);
        self.log[self.looks as usize % LOG] =
            Seen { counter: reading.counter, illegal: self.illegal, index_high: high };
    }

    /// What was known after a look, counted from 1; 0 is before the first.
    ///
    /// # Panics
    /// If it is not one of the last 16.
    pub fn at(&self, look: u64) -> Seen {
        assert!(look <= self.looks && look + LOG as u64 > self.looks, "look {look} of {}", self.looks);
        self.log[look as usize % LOG]
    }

    /// Looks at A and B whose meaning is known.
    pub fn looks(&self) -> u64 {
        self.looks
    }

    /// The counter at each rise of the index so far.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Single looks at Z so far.
    pub fn glitches(&self) -> u64 {
        self.glitches
    }
}
