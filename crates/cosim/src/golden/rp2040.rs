//! Golden traces on an emulated RP2040, and what every tick of them costs its Cortex-M0+.
//!
//! The emulator counts the cycles of the processor as its manual gives them, and takes the flash for as fast as the
//! RAM: what a miss of its cache costs is not in them.

use std::path::Path;

use anyhow::{Result, bail, ensure};
use rp2040_emu::{Config, Emulator, EmulatorBuilder};

use super::{End, Expected, Found};
use crate::image::{FLASH, Image};

/// Where the image looks for the trace: its length, then its bytes.
const TRACE: u32 = 0x1010_0000;
/// From the beginning of the flash to the vectors.
const VECTORS: u32 = 0x100;
const CLOCK_HZ: u32 = 125_000_000;
/// Instructions between two looks whether the image is done.
const GLANCE: u32 = 1 << 16;
/// A replay that takes more cycles a tick than a tick has hangs; building the stage in soft floats comes on top.
const MOST_CYCLES: u64 = 12_500;
const MOST_CYCLES_AT_START: u64 = 20_000_000;

/// The functions of the controller that are measured; the first is the whole tick, the others its stages in order.
pub const MEASURED: [&str; 9] =
    ["tick", "sense", "guard", "machine", "plan", "compensate", "servo", "drive", "publish"];

/// Cycles of each of [`MEASURED`] in one tick, from its first instruction to the first after its return.
pub type TickCycles = [u32; MEASURED.len()];

/// The image of `firmware/golden` for the RP2040.
#[derive(Debug)]
pub struct Board {
    image: Image,
    /// Addresses of its answer.
    end: u32,
    found: u32,
    /// Number in [`MEASURED`] of the function that begins at each halfword of the flash.
    entries: Vec<Option<u8>>,
}

impl Board {
    /// Reads the image.
    ///
    /// # Errors
    /// It cannot be read, or lacks one of the functions or statics that are looked at.
    pub fn read(file: &Path) -> Result<Self> {
        let image = Image::read(file)?;
        let mut entries = vec![None; image.flash.len() / 2];
        for (number, name) in (0..).zip(MEASURED) {
            let entry = image.entry_of("abbe_core::controller::Controller<_>::", &format!("::{name}"))?;
            entries[halfword(entry)] = Some(number);
        }
        let (end, found) = (image.place_of("GOLDEN_END")?, image.place_of("GOLDEN_FOUND")?);
        Ok(Self { image, end, found, entries })
    }

    /// Replays a trace; what it found, and the cycles of each tick.
    ///
    /// # Errors
    /// The trace does not fit the flash, or the image stops without an answer.
    pub fn replay(&self, trace: &[u8], expected: &Expected) -> Result<(Found, Vec<TickCycles>)> {
        let mut emulator = self.switched_on(trace)?;
        let mut meter = Meter::default();
        let most = MOST_CYCLES_AT_START + MOST_CYCLES * u64::from(expected.ticks);
        while emulator.peek(self.end) == 0 {
            for _ in 0..GLANCE {
                self.step(&mut emulator, &mut meter);
            }
            let (cycles, at) = (emulator.cores[0].cycles(), emulator.cores[0].reg(15));
            ensure!(
                !emulator.cores[0].is_in_hardfault(),
                "the image has faulted, after {} ticks",
                meter.ticks.len()
            );
            ensure!(cycles < most, "the image hangs at {at:#x}, after {} ticks", meter.ticks.len());
        }
        Ok((self.answer(&emulator)?, meter.ticks))
    }

    fn switched_on(&self, trace: &[u8]) -> Result<Emulator> {
        let mut image = self.image.clone();
        image.load(TRACE, &u32::try_from(trace.len())?.to_le_bytes())?;
        image.load(TRACE + 4, trace)?;
        let Ok(mut emulator) = EmulatorBuilder::new(Config { sys_clk_hz: CLOCK_HZ }).step_quantum(1).build()
        else {
            bail!("the emulator of the RP2040 does not start");
        };
        emulator.load_flash(&image.flash);
        emulator.reset();
        emulator.direct_boot_from_flash(VECTORS);
        emulator.bus.set_active_core(0);
        Ok(emulator)
    }

    /// One instruction. Core 1 sleeps and the image uses no peripheral, so nothing else needs to be clocked.
    #[inline]
    fn step(&self, emulator: &mut Emulator, meter: &mut Meter) {
        let core = &mut emulator.cores[0];
        let at = core.reg(15) & !1;
        if meter.back == Some(at) {
            meter.leave(core.cycles());
        }
        if let Some(&Some(number)) = self.entries.get(halfword(at)) {
            meter.enter(number, core.reg(14) & !1, core.cycles());
        }
        core.step(&mut emulator.bus);
    }

    fn answer(&self, emulator: &Emulator) -> Result<Found> {
        let [ticks, proven, low, high] = [0, 4, 8, 12].map(|offset| emulator.peek(self.found + offset));
        let end = match emulator.peek(self.end) {
            1 => End::Whole,
            2 => End::Differs,
            4 => bail!("the image cannot build its stage"),
            5 => bail!("the image has panicked after tick {ticks}"),
            at => End::Unreadable(format!("byte {} of a block", at.saturating_sub(16))),
        };
        Ok(Found { ticks, proven, hash: u64::from(high) << 32 | u64::from(low), end })
    }
}

fn halfword(address: u32) -> usize {
    (address.wrapping_sub(FLASH) / 2) as usize
}

/// Counts the cycles of the functions that are entered and left.
#[derive(Debug, Default)]
struct Meter {
    /// Where the innermost of them returns to.
    back: Option<u32>,
    /// Those that are running, the innermost last.
    running: Vec<Running>,
    this: TickCycles,
    ticks: Vec<TickCycles>,
}

#[derive(Clone, Copy, Debug)]
struct Running {
    number: u8,
    back: u32,
    began: u64,
}

impl Meter {
    fn enter(&mut self, number: u8, back: u32, now: u64) {
        // A loop may lead back to the first instruction of a function.
        if self.running.last().is_none_or(|last| last.number != number) {
            self.running.push(Running { number, back, began: now });
            self.back = Some(back);
        }
    }

    fn leave(&mut self, now: u64) {
        let Some(left) = self.running.pop() else { return };
        self.back = self.running.last().map(|last| last.back);
        self.this[usize::from(left.number)] = (now - left.began) as u32;
        if self.running.is_empty() {
            self.ticks.push(std::mem::take(&mut self.this));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_inside_a_tick_is_counted_from_its_entry_to_its_return() {
        let mut meter = Meter::default();
        meter.enter(0, 100, 10);
        meter.enter(1, 50, 15);
        meter.enter(1, 60, 17);
        assert_eq!(meter.back, Some(50));
        meter.leave(25);
        meter.leave(40);
        assert_eq!(meter.ticks, [[30, 10, 0, 0, 0, 0, 0, 0, 0]]);
        assert_eq!(meter.back, None);
    }
}
