//! The emitters of two axes, fed with the words of [`Runs`], and the pulses that their trains promise.

use std::collections::VecDeque;

use crate::block::{Block, Fifo, Setup};
use abbe_core::edge::StepRate;
use abbe_core::front::emitter::Train;
use abbe_core::front::pulse_words::{HIGH, LAG};
use abbe_core::front::{Runs, StepEmitter};

/// A direction changes no later than this before its first pulse, in clocks.
const SETUP: u64 = 67;
/// A direction holds at least so long after its last pulse, in clocks.
const HOLD: u64 = 33;

/// Two state machines of one block: STEP of axis n at pin 2n, DIR at pin 2n + 1.
pub struct Emitters {
    block: Block,
    axes: [Axis; 2],
    clock: u64,
    /// When the next tick's pulses begin, without their lag.
    tick_start: u64,
    clocks: u32,
}

struct Axis {
    emitter: StepEmitter,
    runs: Runs,
    promised: VecDeque<(u64, bool)>,
    watch: Watch,
    /// Pulses seen, signed.
    seen: i64,
}

/// The pins of one axis as an oscilloscope sees them.
#[derive(Clone, Copy, Default)]
struct Watch {
    step: bool,
    up: bool,
    rose: Option<u64>,
    turned: Option<u64>,
}

/// Something that the pins did and no train promised.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// A pulse at another clock or in another direction than promised: (seen, promised).
    Pulse((u64, bool), Option<(u64, bool)>),
    /// A pulse of another length than 32 clocks.
    Length(u64),
    /// The direction changed so many clocks before a pulse.
    Setup(u64),
    /// The direction changed so many clocks after a pulse.
    Hold(u64),
}

impl Emitters {
    /// Loaded and started, with no words.
    pub fn new(clocks_per_tick: u32) -> Self {
        let program = pio::pio_file!("../../firmware/pico/pio/emitter.pio");
        let mut block = Block::load(&program.program);
        for (machine, pin) in [(0, 0), (1, 2)] {
            let setup =
                Setup { side_pin: Some(pin), out_pin: Some(pin + 1), fifo: Fifo::Send, ..Setup::default() };
            block.set_up(machine, &setup);
        }
        block.start(0b11);
        let axis = || Axis {
            emitter: StepEmitter::new(clocks_per_tick),
            runs: Runs::new(clocks_per_tick),
            promised: VecDeque::new(),
            watch: Watch::default(),
            seen: 0,
        };
        Self { block, axes: [axis(), axis()], clock: 0, tick_start: 0, clocks: clocks_per_tick }
    }

    /// Hands over the words of the next tick; returns the trains.
    ///
    /// # Panics
    /// If a FIFO has no room for them.
    pub fn begin_tick(&mut self, rates: [StepRate; 2]) -> [Train; 2] {
        let mut trains = [Train::default(); 2];
        for (machine, (axis, rate)) in self.axes.iter_mut().zip(rates).enumerate() {
            let train = axis.emitter.begin_tick(rate);
            for &word in axis.runs.words(&train).as_slice() {
                assert!(
                    self.block.give(machine, word),
                    "the FIFO has no room for the words of the next tick"
                );
            }
            axis.promise(self.tick_start + u64::from(LAG), &train);
            trains[machine] = train;
        }
        self.tick_start += u64::from(self.clocks);
        trains
    }

    /// The emitters ran dry: the next words count from now.
    pub fn start_again(&mut self) {
        self.tick_start = self.clock;
        for axis in &mut self.axes {
            axis.runs = Runs::new(self.clocks);
        }
    }

    /// One clock.
    ///
    /// # Errors
    /// If the pins of an axis do what its trains did not promise.
    pub fn step(&mut self) -> Result<(), Wrong> {
        self.block.step(0);
        let driven = self.block.driven();
        for (pin, axis) in [0, 2].into_iter().zip(&mut self.axes) {
            let (step, up) = ((driven >> pin) & 1 == 1, (driven >> (pin + 1)) & 1 == 1);
            if step != axis.watch.step || up != axis.watch.up {
                axis.change(self.clock, step, up)?;
            }
        }
        self.clock += 1;
        Ok(())
    }

    /// Clocks so far.
    pub fn clock(&self) -> u64 {
        self.clock
    }

    /// When the words handed over so far are used up.
    pub fn promised_until(&self) -> u64 {
        self.tick_start
    }

    /// Pulses promised and not yet seen, of both axes.
    pub fn outstanding(&self) -> usize {
        self.axes.iter().map(|axis| axis.promised.len()).sum()
    }

    /// Pulses seen, signed, and pulses that the axes' emitters have counted.
    pub fn seen_and_counted(&self) -> [(i64, i64); 2] {
        let clocks = self.clocks;
        self.axes.each_ref().map(|axis| (axis.seen, i64::from(axis.emitter.pulses_at(clocks))))
    }
}

impl Axis {
    fn promise(&mut self, start: u64, train: &Train) {
        let mut rise = start + u64::from(train.first);
        for k in 1..=train.pulses {
            self.promised.push_back((rise, train.up));
            rise += u64::from(train.gap) + u64::from(k <= train.longer);
        }
    }

    fn change(&mut self, clock: u64, step: bool, up: bool) -> Result<(), Wrong> {
        let before = self.watch;
        self.watch.step = step;
        self.watch.up = up;
        if up != before.up {
            self.watch.turned = Some(clock);
            let since = before.rose.map_or(u64::MAX, |rose| clock - rose);
            if since < HOLD {
                return Err(Wrong::Hold(since));
            }
        }
        match (before.step, step) {
            (false, true) => self.rise(clock, up),
            (true, false) => {
                let length = clock - before.rose.unwrap_or(0);
                if length == u64::from(HIGH) { Ok(()) } else { Err(Wrong::Length(length)) }
            }
            _ => Ok(()),
        }
    }

    fn rise(&mut self, clock: u64, up: bool) -> Result<(), Wrong> {
        self.watch.rose = Some(clock);
        self.seen += if up { 1 } else { -1 };
        let promised = self.promised.pop_front();
        if promised != Some((clock, up)) {
            return Err(Wrong::Pulse((clock, up), promised));
        }
        let since = self.watch.turned.map_or(u64::MAX, |turned| clock - turned);
        if since < SETUP { Err(Wrong::Setup(since)) } else { Ok(()) }
    }
}
