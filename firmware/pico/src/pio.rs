//! The PIO blocks: programs loaded and state machines set up, register by register.
//!
//! The programs stand in `pio/`. They are the same that the emulator proves equal to `abbe_core::front`.

use embassy_rp::pac;
use pac::pio::Pio;
use pio::{ArrayVec, Program, RP2040_MAX_PROGRAM_SIZE};

/// A program that was loaded.
#[derive(Clone, Copy)]
pub struct Loaded {
    origin: u8,
    wrap: pio::Wrap,
    side_pins: u8,
}

/// Who gets the memory of the FIFOs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Fifo {
    /// Four words each way.
    Both,
    /// Eight words to the machine.
    Send,
    /// Eight words from the machine.
    Receive,
}

/// How a state machine is set up.
#[derive(Clone, Copy)]
pub struct Setup {
    /// Last address before the wrap and the address behind it, in the program; its own if none.
    pub wrap: Option<pio::Wrap>,
    /// Pin of `jmp pin`.
    pub jmp_pin: u8,
    /// First pin of `in` and `wait`.
    pub in_base: u8,
    /// `in` shifts right.
    pub in_right: bool,
    /// Pin of `out`, if it drives one.
    pub out_pin: Option<u8>,
    /// Pin of the side-set, if it drives one.
    pub side_pin: Option<u8>,
    /// Memory of the FIFOs.
    pub fifo: Fifo,
    /// Clocks in a clock of the machine: whole and 1/256.
    pub divider: (u16, u8),
}

impl Setup {
    /// Reads nothing, drives nothing, full speed.
    pub const PLAIN: Self = Self {
        wrap: None,
        jmp_pin: 0,
        in_base: 0,
        in_right: false,
        out_pin: None,
        side_pin: None,
        fifo: Fifo::Both,
        divider: (1, 0),
    };
}

/// State machines of a block. What the tick calls says so, to leave no path to a panic.
const MACHINES: usize = 4;
/// `jmp` to address 0: all jumps have zeros in their upper three bits.
const JUMP: u16 = 0x0000;
/// Where a register's alias lies that sets the bits written, and the one that clears them.
const ALIAS_SET: usize = 0x2000;
const ALIAS_CLEAR: usize = 0x3000;
/// `set pins, 0`.
const SET_PINS_0: u16 = 0xE000;
/// `set pindirs, 1`.
const SET_PINDIRS_1: u16 = 0xE081;
/// Operation code of an instruction.
const OPERATION: u16 = 0xE000;

/// Writes a program into a block, from `origin` on.
pub fn load(block: Pio, program: &Program<RP2040_MAX_PROGRAM_SIZE>, origin: u8) -> Loaded {
    let code: &ArrayVec<u16, RP2040_MAX_PROGRAM_SIZE> = &program.code;
    for (address, &instruction) in (usize::from(origin)..).zip(code) {
        // Jumps are written as if the program stood at 0.
        let moved =
            if instruction & OPERATION == JUMP { instruction + u16::from(origin) } else { instruction };
        block.instr_mem(address).write(|w| w.set_instr_mem(moved));
    }
    Loaded { origin, wrap: program.wrap, side_pins: program.side_set.bits() }
}

/// Sets up a stopped state machine at the beginning of its program.
pub fn set_up(block: Pio, machine: usize, program: Loaded, setup: &Setup) {
    let registers = block.sm(machine);
    let wrap = setup.wrap.unwrap_or(program.wrap);
    registers.clkdiv().write(|w| {
        w.set_int(setup.divider.0);
        w.set_frac(setup.divider.1);
    });
    registers.execctrl().write(|w| {
        w.set_jmp_pin(setup.jmp_pin);
        w.set_wrap_top(wrap.source + program.origin);
        w.set_wrap_bottom(wrap.target + program.origin);
    });
    registers.shiftctrl().write(|w| {
        w.set_fjoin_tx(setup.fifo == Fifo::Send);
        w.set_fjoin_rx(setup.fifo == Fifo::Receive);
        w.set_out_shiftdir(true);
        w.set_in_shiftdir(setup.in_right);
    });
    for pin in [setup.out_pin, setup.side_pin].into_iter().flatten() {
        registers.pinctrl().write(|w| {
            w.set_set_base(pin);
            w.set_set_count(1);
        });
        for instruction in [SET_PINS_0, SET_PINDIRS_1] {
            registers.instr().write(|w| w.set_instr(instruction));
        }
    }
    registers.pinctrl().write(|w| {
        w.set_in_base(setup.in_base);
        if let Some(pin) = setup.out_pin {
            w.set_out_base(pin);
            w.set_out_count(1);
        }
        if let Some(pin) = setup.side_pin {
            w.set_sideset_base(pin);
            w.set_sideset_count(program.side_pins);
            // For `side_low`; the program itself has no `set`.
            w.set_set_base(pin);
            w.set_set_count(1);
        }
    });
    begin_anew(block, machine, program.origin);
}

/// Forgets what a stopped machine was doing and puts it at an address.
pub fn begin_anew(block: Pio, machine: usize, address: u8) {
    let mut bits = pac::pio::regs::Ctrl::default();
    bits.set_sm_restart(1 << machine);
    bits.set_clkdiv_restart(1 << machine);
    in_one_write(block, ALIAS_SET, bits);
    block.sm(machine % MACHINES).instr().write(|w| w.set_instr(JUMP + u16::from(address)));
}

/// Brings the side-set pin of a stopped machine down.
pub fn side_low(block: Pio, machine: usize) {
    block.sm(machine % MACHINES).instr().write(|w| w.set_instr(SET_PINS_0));
}

/// Starts machines in one clock, a bit each.
pub fn start(block: Pio, machines: u8) {
    let mut bits = pac::pio::regs::Ctrl::default();
    bits.set_sm_enable(machines);
    in_one_write(block, ALIAS_SET, bits);
}

/// Stops machines, a bit each.
pub fn stop(block: Pio, machines: u8) {
    let mut bits = pac::pio::regs::Ctrl::default();
    bits.set_sm_enable(machines);
    in_one_write(block, ALIAS_CLEAR, bits);
}

/// Sets or clears bits of the control register without reading it: the other core may write it, too.
fn in_one_write(block: Pio, alias: usize, bits: pac::pio::regs::Ctrl) {
    let register = block.ctrl().as_ptr().wrapping_byte_add(alias);
    // SAFETY: every register of the chip has these aliases (data sheet, 2.1.2), and this one may be written at any time.
    unsafe { register.write_volatile(bits) };
}

/// Throws away what waits for a machine whose FIFO is joined for sending: undoing the join and doing it again empties it.
pub fn forget_words(block: Pio, machine: usize) {
    let shift = block.sm(machine % MACHINES).shiftctrl();
    shift.modify(|w| w.set_fjoin_tx(false));
    shift.modify(|w| w.set_fjoin_tx(true));
}

/// A word from a machine, if there is one.
#[inline]
pub fn take(block: Pio, machine: usize) -> Option<u32> {
    let machine = machine % MACHINES;
    let empty = block.fstat().read().rxempty() & (1 << machine) != 0;
    (!empty).then(|| block.rxf(machine).read())
}

/// Hands a word to a machine, which has room for it.
#[inline]
pub fn give(block: Pio, machine: usize, word: u32) {
    block.txf(machine % MACHINES).write_value(word);
}
