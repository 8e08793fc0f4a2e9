//! The serial receiver and a line that is driven bit by bit.

use crate::block::{Block, Fifo, Setup};

/// Clock of the board, Hz.
const CLOCK_HZ: f64 = 125e6;
/// Clocks of the receiver in a bit.
const OVERSAMPLING: f64 = 8.0;

/// What a word of the receiver says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// A byte.
    Byte(u8),
    /// The stop bit was missing.
    Framing,
}

/// A receiver at pin 0 that is set up for a baud rate.
pub struct Receiver {
    block: Block,
    /// Clocks of a bit of the sender.
    bit: f64,
    /// When the sender's next bit begins, in clocks.
    next: f64,
    clock: u64,
    received: Vec<Received>,
}

impl Receiver {
    /// Started, with a sender that is faster by `error` (0.02 is 2 %).
    pub fn new(baud: f64, error: f64) -> Self {
        let program = pio::pio_file!("../../firmware/pico/pio/serial_rx.pio");
        let mut block = Block::load(&program.program);
        let divider = (CLOCK_HZ / (OVERSAMPLING * baud) * 256.0).round() as u32;
        block.set_up(0, &Setup { in_right: true, fifo: Fifo::Receive, divider, ..Setup::default() });
        block.start(1);
        Self { block, bit: CLOCK_HZ / (baud * (1.0 + error)), next: 0.0, clock: 0, received: Vec::new() }
    }

    /// Holds the line at a level for so many bits of the sender.
    pub fn hold(&mut self, level: bool, bits: f64) {
        self.next += bits * self.bit;
        while (self.clock as f64) < self.next {
            self.block.step(u32::from(level));
            self.clock += 1;
            if let Some(word) = self.block.take(0) {
                self.received.push(meaning(word));
            }
        }
    }

    /// Sends a byte: start bit, eight bits, low first, stop bit.
    pub fn send(&mut self, byte: u8) {
        self.send_with_stop(byte, true);
    }

    /// The same with a stop bit of this level.
    pub fn send_with_stop(&mut self, byte: u8, stop: bool) {
        self.hold(false, 1.0);
        for bit in 0..8 {
            self.hold((byte >> bit) & 1 == 1, 1.0);
        }
        self.hold(stop, 1.0);
    }

    /// What was received since the last time.
    pub fn received(&mut self) -> Vec<Received> {
        std::mem::take(&mut self.received)
    }
}

fn meaning(word: u32) -> Received {
    if word << 8 == 0 { Received::Byte((word >> 24) as u8) } else { Received::Framing }
}
