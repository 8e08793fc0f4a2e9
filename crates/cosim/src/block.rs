//! An emulated PIO block, set up through its registers as firmware sets it up.

use picoem_common::pio::PioBlock;
use pio::Program;

const CTRL: u32 = 0x000;
const TXF: u32 = 0x010;
const RXF: u32 = 0x020;
const INSTRUCTIONS: u32 = 0x048;
const MACHINES: u32 = 0x0C8;
const MACHINE_STRIDE: u32 = 0x18;
const CLKDIV: u32 = 0x00;
const EXECCTRL: u32 = 0x04;
const SHIFTCTRL: u32 = 0x08;
const INSTR: u32 = 0x10;
const PINCTRL: u32 = 0x14;
/// The alias of a register that writes it whole.
const PLAIN: u32 = 0;
/// `out pindirs, n` is not used; directions are set by force, with `set pindirs`.
const SET_PINDIRS_1: u32 = 0xE081;

/// Where a state machine's FIFO memory goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fifo {
    /// Four words each way.
    Both,
    /// Eight words to the program.
    Send,
    /// Eight words from the program.
    Receive,
}

/// How a state machine is set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setup {
    /// (last address before the wrap, address after it); the program's own if `None`.
    pub wrap: Option<(u8, u8)>,
    /// Pin of `jmp pin`.
    pub jmp_pin: u8,
    /// First pin of `in pins` and `wait pin`.
    pub in_base: u8,
    /// `in` shifts right.
    pub in_right: bool,
    /// The pin of `out pins`; driven if given.
    pub out_pin: Option<u8>,
    /// The pin of the side-set; driven if given.
    pub side_pin: Option<u8>,
    /// FIFO memory.
    pub fifo: Fifo,
    /// Clocks of the block in a clock of the machine, in 1/256.
    pub divider: u32,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            wrap: None,
            jmp_pin: 0,
            in_base: 0,
            in_right: false,
            out_pin: None,
            side_pin: None,
            fifo: Fifo::Both,
            divider: 256,
        }
    }
}

/// A block with one program at address 0.
pub struct Block {
    pio: PioBlock,
    wrap: (u8, u8),
}

impl Block {
    /// Loads a program.
    pub fn load(program: &Program<32>) -> Self {
        let mut pio = PioBlock::new();
        for (address, instruction) in program.code.iter().enumerate() {
            pio.write32(INSTRUCTIONS + 4 * address as u32, u32::from(*instruction), PLAIN);
        }
        Self { pio, wrap: (program.wrap.source, program.wrap.target) }
    }

    /// Sets up a machine, 0 … 3, at rest at address 0.
    pub fn set_up(&mut self, machine: usize, setup: &Setup) {
        let (top, bottom) = setup.wrap.unwrap_or(self.wrap);
        let fifo = match setup.fifo {
            Fifo::Both => 0,
            Fifo::Send => 1 << 30,
            Fifo::Receive => 1 << 31,
        };
        let field = |value: u8, bit: u32| u32::from(value) << bit;
        self.write(machine, CLKDIV, setup.divider << 8);
        self.write(machine, EXECCTRL, field(setup.jmp_pin, 24) | field(top, 12) | field(bottom, 7));
        self.write(machine, SHIFTCTRL, fifo | (1 << 19) | (u32::from(setup.in_right) << 18));
        for pin in [setup.out_pin, setup.side_pin].into_iter().flatten() {
            self.write(machine, PINCTRL, (1 << 26) | field(pin, 5));
            self.write(machine, INSTR, SET_PINDIRS_1);
        }
        let side = setup.side_pin.map_or(0, |pin| (1 << 29) | field(pin, 10));
        let out = setup.out_pin.map_or(0, |pin| (1 << 20) | field(pin, 0));
        self.write(machine, PINCTRL, side | out | field(setup.in_base, 15));
        // `jmp 0`
        self.write(machine, INSTR, 0);
    }

    fn write(&mut self, machine: usize, register: u32, value: u32) {
        self.pio.write32(MACHINES + MACHINE_STRIDE * machine as u32 + register, value, PLAIN);
    }

    /// Starts machines in one clock, one bit each.
    pub fn start(&mut self, machines: u32) {
        self.pio.write32(CTRL, machines, PLAIN);
    }

    /// One clock with these levels at the pins.
    #[inline]
    pub fn step(&mut self, pins: u32) {
        self.pio.step(pins);
    }

    /// Levels that the block drives.
    #[inline]
    pub fn driven(&self) -> u32 {
        self.pio.pad_out & self.pio.pad_oe
    }

    /// Hands a word to a machine; false when its FIFO is full.
    pub fn give(&mut self, machine: usize, word: u32) -> bool {
        let room = !self.pio.sm[machine].tx_fifo_full();
        if room {
            self.pio.write32(TXF + 4 * machine as u32, word, PLAIN);
        }
        room
    }

    /// Takes a word from a machine, if there is one.
    #[inline]
    pub fn take(&mut self, machine: usize) -> Option<u32> {
        let any = !self.pio.sm[machine].rx_fifo_empty();
        any.then(|| self.pio.read32(RXF + 4 * machine as u32))
    }
}
