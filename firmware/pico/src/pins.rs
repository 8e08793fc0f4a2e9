//! Pins: which part of the chip drives them, and what holds them while nothing does.

use crate::design::{AXES, DRIVE_FAULT, EMERGENCY_STOP, SERIAL_IN, SERIAL_OUT, TICK_LAMP};
use embassy_rp::pac;

/// Parts of the chip that can drive a pin, by the numbers of the data sheet.
#[derive(Clone, Copy)]
#[repr(u8)]
pub enum Function {
    /// The serial interfaces.
    Uart = 2,
    /// The processor.
    Processor = 5,
    /// The first PIO block.
    Pio0 = 6,
    /// The second PIO block.
    Pio1 = 7,
}

/// Gives a pin to a part of the chip.
pub fn give(pin: u8, function: Function) {
    pac::IO_BANK0.gpio(usize::from(pin)).ctrl().write(|w| w.set_funcsel(function as u8));
}

/// Sets up every pin but the enable, which is off since the first instruction.
pub fn set_up() {
    for axis in &AXES {
        for encoder in [axis.a, axis.a + 1, axis.z] {
            input(encoder, false);
            give(encoder, Function::Pio0);
        }
        for output in [axis.step, axis.direction] {
            give(output, Function::Pio1);
        }
        for switch in [axis.limit_low, axis.limit_high] {
            input(switch, true);
            give(switch, Function::Processor);
        }
    }
    input(DRIVE_FAULT, false);
    give(DRIVE_FAULT, Function::Processor);
    input(EMERGENCY_STOP, true);
    give(EMERGENCY_STOP, Function::Processor);
    input(SERIAL_IN, true);
    give(SERIAL_IN, Function::Pio1);
    give(SERIAL_OUT, Function::Uart);
    pac::SIO.gpio_oe(0).value_set().write_value(1 << TICK_LAMP);
    give(TICK_LAMP, Function::Processor);
}

/// An input with its Schmitt trigger, pulled up or left to whoever drives it.
fn input(pin: u8, pull_up: bool) {
    pac::PADS_BANK0.gpio(usize::from(pin)).write(|w| {
        w.set_ie(true);
        w.set_od(true);
        w.set_schmitt(true);
        w.set_pue(pull_up);
        w.set_pde(false);
    });
}

/// The levels of all pins at one instant.
pub fn levels() -> u32 {
    pac::SIO.gpio_in(0).read()
}
