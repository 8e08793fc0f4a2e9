//! An image on core 0 of an emulated RP2040, instruction by instruction, and the cycles of functions in it.
//!
//! The emulator counts the cycles of the processor as its manual gives them, and takes the flash for as fast as the
//! RAM: what a miss of its cache costs is not in them.

use anyhow::{Result, bail, ensure};
use rp2040_emu::{Config, Emulator, EmulatorBuilder};

use crate::image::{FLASH, Image};

/// From the beginning of the flash to the vectors.
const VECTORS: u32 = 0x100;
const CLOCK_HZ: u32 = 125_000_000;

/// Where the functions begin whose cycles are counted.
#[derive(Debug)]
pub struct Entries {
    /// The number of the function that begins at each halfword of the flash.
    numbers: Vec<Option<u8>>,
}

impl Entries {
    /// Functions of an image by the addresses of their first instructions; each has the number of its place.
    pub fn of(image: &Image, addresses: &[u32]) -> Self {
        let mut numbers = vec![None; image.flash.len() / 2];
        for (number, &address) in (0..).zip(addresses) {
            numbers[halfword(address)] = Some(number);
        }
        Self { numbers }
    }

    #[inline]
    fn at(&self, address: u32) -> Option<u8> {
        self.numbers.get(halfword(address)).copied().flatten()
    }
}

fn halfword(address: u32) -> usize {
    (address.wrapping_sub(FLASH) / 2) as usize
}

/// An image that runs and is metered. Core 1 sleeps and no peripheral is clocked: such an image uses none.
pub struct Metered<'a> {
    emulator: Emulator,
    entries: &'a Entries,
    meter: Meter,
}

impl<'a> Metered<'a> {
    /// Powers it on.
    ///
    /// # Errors
    /// The emulator does not start.
    pub fn switched_on(image: &Image, entries: &'a Entries) -> Result<Self> {
        let Ok(mut emulator) = EmulatorBuilder::new(Config { sys_clk_hz: CLOCK_HZ }).step_quantum(1).build()
        else {
            bail!("the emulator of the RP2040 does not start");
        };
        emulator.load_flash(&image.flash);
        emulator.reset();
        emulator.direct_boot_from_flash(VECTORS);
        emulator.bus.set_active_core(0);
        Ok(Self { emulator, entries, meter: Meter::default() })
    }

    /// One instruction. The function that returned just before it, if one did.
    #[inline]
    pub fn step(&mut self) -> Option<Left> {
        let core = &mut self.emulator.cores[0];
        let at = core.reg(15) & !1;
        let left = if self.meter.back == Some(at) { self.meter.leave(core.cycles()) } else { None };
        if let Some(number) = self.entries.at(at) {
            self.meter.enter(number, core.reg(14) & !1, core.cycles());
        }
        core.step(&mut self.emulator.bus);
        left
    }

    /// A word of the memory.
    pub fn peek(&self, address: u32) -> u32 {
        self.emulator.peek(address)
    }

    /// Fails when the processor has faulted or has taken more cycles than `most`.
    ///
    /// # Errors
    /// So it is.
    pub fn is_well(&self, most: u64) -> Result<()> {
        let core = &self.emulator.cores[0];
        ensure!(!core.is_in_hardfault(), "the image has faulted");
        ensure!(core.cycles() < most, "the image hangs at {:#x}", core.reg(15));
        Ok(())
    }
}

/// A function that has returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Left {
    /// Its number.
    pub number: u8,
    /// From its first instruction to the first after its return.
    pub cycles: u32,
    /// No other function is running any more.
    pub outermost: bool,
}

/// Counts the cycles of the functions that are entered and left.
#[derive(Debug, Default)]
struct Meter {
    /// Where the innermost of them returns to.
    back: Option<u32>,
    /// Those that are running, the innermost last.
    running: Vec<Running>,
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

    fn leave(&mut self, now: u64) -> Option<Left> {
        let Running { number, began, .. } = self.running.pop()?;
        self.back = self.running.last().map(|last| last.back);
        Some(Left { number, cycles: (now - began) as u32, outermost: self.running.is_empty() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_inside_another_is_counted_from_its_entry_to_its_return() {
        let mut meter = Meter::default();
        meter.enter(0, 100, 10);
        meter.enter(1, 50, 15);
        meter.enter(1, 60, 17);
        assert_eq!(meter.back, Some(50));
        assert_eq!(meter.leave(25), Some(Left { number: 1, cycles: 10, outermost: false }));
        assert_eq!(meter.leave(40), Some(Left { number: 0, cycles: 30, outermost: true }));
        assert_eq!((meter.back, meter.leave(50)), (None, None));
    }

    #[test]
    fn a_function_begins_at_its_address_and_nowhere_else() {
        let mut image = Image::default();
        image.load(FLASH, &[0; 8]).unwrap();
        let entries = Entries::of(&image, &[FLASH + 4, FLASH]);
        assert_eq!(
            [0, 2, 4, 6, 8].map(|offset| entries.at(FLASH + offset)),
            [Some(1), None, Some(0), None, None]
        );
    }
}
