//! The Pico's image in an emulator: levels at its pins, pulses from its pins, a serial line, and its telemetry.
//!
//! Both cores, both PIO blocks, the timer and the UART are the emulator's. What it lacks is made up for here: a core
//! that waits for an event is woken by an interrupt, and bytes come in bit by bit at the pin.

use crate::image::Image;
use anyhow::Result;
use design::{AXES, DRIVE_FAULT, EMERGENCY_STOP, SERIAL_IN};
use rp2040_emu::{Config, Emulator, EmulatorBuilder};
use std::collections::BTreeMap;

/// Pins and times of the board, from the firmware itself.
#[path = "../../../firmware/pico/src/design.rs"]
pub mod design;

/// Clocks in a second.
pub const CLOCK_HZ: u64 = design::CLOCK_HZ as u64;
/// Clocks in a tick.
pub const TICK_CLOCKS: u64 = design::TICK_CLOCKS as u64;

/// The vector table lies behind the second boot stage.
const VECTORS: u32 = 0x100;
/// Clocks after which pins are looked at and set; shorter than a step pulse is high.
const QUANTUM: u32 = 16;
/// Clocks of a bit on the serial line.
const BIT_CLOCKS: u64 = CLOCK_HZ / design::BAUD as u64;

/// The last tick as the board tells it; see `firmware/pico/src/telemetry.rs`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Telemetry {
    /// Number of the tick.
    pub tick: u32,
    /// Commands taken.
    pub commands: u32,
    /// State, as an index into [`abbe_core::machine::STATES`].
    pub state: usize,
    /// It is in a fault, or stops for one.
    pub fault: bool,
    /// The drives are on.
    pub on: bool,
    /// Moves begun.
    pub moves: u32,
    /// Set-points in the stage frame, picometres.
    pub set_points_pm: [i64; 2],
    /// Readings in the scale frame, picometres.
    pub readings_pm: [i64; 2],
    /// Step rates, pulses a tick with 16 fractional bits.
    pub rates: [i32; 2],
    /// Longest tick, µs, from when it was due to its end.
    pub longest_us: u32,
    /// Ticks missed.
    pub missed: u32,
    /// Clock at which the tick was due.
    pub due: u64,
    /// Ticks that the slowest plan took to come.
    pub planning: u32,
}

/// A rise of a STEP pin.
#[derive(Clone, Copy, Debug)]
pub struct Rise {
    /// It lies in these clocks: after the first, not after the second.
    pub between: [u64; 2],
    /// DIR was high.
    pub up: bool,
}

/// A board with its image, powered on.
pub struct Board {
    emulator: Emulator,
    telemetry: u32,
    /// Levels to come: (clock, order) → (pins, levels).
    to_come: BTreeMap<(u64, u64), (u32, u32)>,
    /// The clock of the first of them.
    next: u64,
    order: u64,
    step_pins: u32,
    rises: [Vec<Rise>; 2],
    emitters_since: Option<u64>,
    line_free: u64,
    heard: Vec<u8>,
    deepest: [u32; 2],
    interrupt: Interrupt,
}

/// Cycles that core 1 takes for an interrupt, which is a tick and all around it: sensors, telemetry, pulses.
///
/// Seen every [`QUANTUM`], so each is up to twice that too short or too long.
#[derive(Clone, Debug, Default)]
struct Interrupt {
    /// Cycles of the core when it began, while one runs.
    began: Option<u64>,
    /// Cycles of each that is over.
    over: Vec<u32>,
}

impl Interrupt {
    fn look(&mut self, running: bool, cycles: u64) {
        match (running, self.began) {
            (true, None) => self.began = Some(cycles),
            (false, Some(began)) => {
                self.over.push((cycles - began) as u32);
                self.began = None;
            }
            _ => {}
        }
    }
}

impl Board {
    /// Powers the image on. Every input is low but the serial line.
    ///
    /// # Errors
    /// The image has no telemetry.
    pub fn power_on(image: &Image) -> Result<Self> {
        let mut emulator = EmulatorBuilder::new(Config::default())
            .step_quantum(QUANTUM)
            .build()
            .map_err(|e| anyhow::anyhow!("{e}"))?;
        emulator.load_flash(&image.flash);
        emulator.reset();
        emulator.direct_boot_from_flash(VECTORS);
        let mut board = Self {
            emulator,
            telemetry: image.place_of("ABBE_TELEMETRY")?,
            to_come: BTreeMap::new(),
            next: u64::MAX,
            order: 0,
            step_pins: 0,
            rises: Default::default(),
            emitters_since: None,
            line_free: 0,
            heard: Vec::new(),
            deepest: [u32::MAX; 2],
            interrupt: Interrupt::default(),
        };
        let low = AXES.iter().flat_map(|axis| [axis.a, axis.a + 1, axis.z, axis.limit_low, axis.limit_high]);
        for pin in low.chain([DRIVE_FAULT, EMERGENCY_STOP]) {
            board.set(pin, false);
        }
        board.set(SERIAL_IN, true);
        Ok(board)
    }

    /// Clocks since power-on.
    pub fn clock(&self) -> u64 {
        self.emulator.clock.cycles
    }

    /// Sets the level of an input now.
    pub fn set(&mut self, pin: u8, high: bool) {
        self.set_at(self.clock(), pin, high);
    }

    /// Sets the level of an input at a clock to come.
    pub fn set_at(&mut self, clock: u64, pin: u8, high: bool) {
        self.order += 1;
        self.to_come.insert((clock, self.order), (1 << pin, u32::from(high) << pin));
        self.next = self.next.min(clock);
    }

    /// Whether the board drives this pin high.
    pub fn is_high(&self, pin: u8) -> bool {
        self.emulator.gpio_read(pin)
    }

    /// Lets the board run until a clock, or an instruction or two beyond.
    pub fn run_until(&mut self, clock: u64) {
        while self.clock() < clock {
            self.step();
        }
    }

    /// The same with core 1 standing still, as if it hung in a tick.
    pub fn run_without_core_1(&mut self, clocks: u64) {
        let until = self.clock() + clocks;
        self.emulator.cores[1].halt();
        // An interrupt that is pending would wake it.
        let enabled: Vec<u8> = (0..26).filter(|&irq| self.emulator.bus.nvics[1].is_enabled(irq)).collect();
        for &irq in &enabled {
            self.emulator.bus.nvics[1].clear_enabled(irq);
        }
        self.run_until(until);
        for &irq in &enabled {
            self.emulator.bus.nvics[1].set_enabled(irq);
        }
        self.emulator.cores[1].wake();
    }

    fn step(&mut self) {
        let now = self.clock();
        if self.next <= now {
            self.set_what_is_due(now);
        }
        let bus = &mut self.emulator.bus;
        if bus.wfe_waiting[0] && bus.nvics[0].pending_and_enabled() != 0 {
            bus.wfe_waiting[0] = false;
        }
        // The emulator's own errors concern its other way of running.
        _ = self.emulator.step();
        self.look_at_pulses(now);
        for (core, deepest) in self.emulator.cores.iter().zip(&mut self.deepest) {
            if !core.is_halted() {
                *deepest = (*deepest).min(core.regs.r[13]);
            }
        }
        let core = &self.emulator.cores[1];
        self.interrupt.look(core.regs.in_handler_mode(), core.cycles());
    }

    fn set_what_is_due(&mut self, now: u64) {
        while let Some(next) = self.to_come.first_entry().filter(|next| next.key().0 <= now) {
            let (pins, levels) = next.remove();
            let bus = &mut self.emulator.bus;
            bus.external_gpio_in_mask |= pins;
            bus.external_gpio_in_override = (bus.external_gpio_in_override & !pins) | levels;
        }
        self.next = self.to_come.first_key_value().map_or(u64::MAX, |(key, _)| key.0);
    }

    fn look_at_pulses(&mut self, before: u64) {
        let pio = &self.emulator.bus.pio[1];
        let running = pio.sm_enabled_mask() & 1 != 0;
        self.emitters_since = running.then(|| self.emitters_since.unwrap_or(before));
        let pins = pio.pad_out & pio.pad_oe;
        let rose = pins & !self.step_pins;
        self.step_pins = pins;
        let between = [before, self.clock()];
        for (axis, rises) in AXES.iter().zip(&mut self.rises) {
            if rose & (1 << axis.step) != 0 {
                rises.push(Rise { between, up: pins & (1 << axis.direction) != 0 });
            }
        }
    }

    /// Rises of STEP since this was asked last.
    pub fn take_rises(&mut self, axis: usize) -> Vec<Rise> {
        std::mem::take(&mut self.rises[axis])
    }

    /// The clock at which the emitters began their line of time, while they run.
    pub fn emitters_since(&self) -> Option<u64> {
        self.emitters_since
    }

    /// The last tick.
    pub fn telemetry(&self) -> Telemetry {
        let word = |number: u32| self.emulator.peek(self.telemetry + 4 * number);
        let long = |number: u32| (u64::from(word(number)) | u64::from(word(number + 1)) << 32).cast_signed();
        let flags = word(2);
        Telemetry {
            tick: word(0),
            commands: word(1),
            state: (flags & 0xff) as usize,
            fault: flags & (1 << 8) != 0,
            on: flags & (1 << 9) != 0,
            moves: word(3),
            set_points_pm: [long(4), long(6)],
            readings_pm: [long(8), long(10)],
            rates: [word(12).cast_signed(), word(13).cast_signed()],
            longest_us: word(14),
            missed: word(15),
            due: u64::from(word(16)) * (CLOCK_HZ / 1_000_000),
            planning: word(17),
        }
    }

    /// Runs until the number of the last tick changes; gives up after `ticks`.
    pub fn run_to_next_tick(&mut self, ticks: u64) -> Option<Telemetry> {
        let last = self.emulator.peek(self.telemetry);
        let until = self.clock() + ticks * TICK_CLOCKS;
        while self.emulator.peek(self.telemetry) == last {
            if self.clock() >= until {
                return None;
            }
            self.step();
        }
        Some(self.telemetry())
    }

    /// Sends bytes over the serial line, bit by bit, behind whatever is still on its way.
    pub fn say(&mut self, bytes: &[u8]) {
        let mut clock = self.line_free.max(self.clock() + BIT_CLOCKS);
        for &byte in bytes {
            self.set_at(clock, SERIAL_IN, false);
            for bit in 0..8_u8 {
                self.set_at(clock + (u64::from(bit) + 1) * BIT_CLOCKS, SERIAL_IN, byte >> bit & 1 != 0);
            }
            self.set_at(clock + 9 * BIT_CLOCKS, SERIAL_IN, true);
            clock += 10 * BIT_CLOCKS;
        }
        self.line_free = clock;
    }

    /// Whole lines that the board has sent since this was asked last.
    pub fn hear(&mut self) -> Vec<String> {
        self.heard.extend(self.emulator.drain_uart0_tx_log());
        let Some(end) = self.heard.iter().rposition(|&byte| byte == b'\n') else { return Vec::new() };
        let lines: Vec<u8> = self.heard.drain(..=end).collect();
        String::from_utf8_lossy(&lines).lines().map(str::to_owned).collect()
    }

    /// The lowest stack pointer of each core so far.
    pub fn deepest_stacks(&self) -> [u32; 2] {
        self.deepest
    }

    /// Cycles of each interrupt of core 1 so far.
    pub fn interrupts(&self) -> &[u32] {
        &self.interrupt.over
    }

    /// Whether a core ended in a hard fault.
    pub fn has_crashed(&self) -> bool {
        self.emulator.cores.iter().any(rp2040_emu::CortexM0Plus::is_in_hardfault)
    }
}
