//! The ways to switch off that need nothing to work but the pins.

use crate::design::NOT_ENABLE;
use crate::pins::{Function, give};
use embassy_rp::pac;

/// The first thing of all: whenever the pin is given to the processor, it is high.
pub fn drives_off_before_all_else() {
    enable_drives(false);
    pac::SIO.gpio_oe(0).value_set().write_value(1 << NOT_ENABLE);
}

/// Gives the pin to the processor; until now the resistor held it.
pub fn drives_off() {
    drives_off_before_all_else();
    give(NOT_ENABLE, Function::Processor);
}

/// Switches both power stages; atomic, from either core.
pub fn enable_drives(on: bool) {
    let pin = 1 << NOT_ENABLE;
    if on {
        pac::SIO.gpio_out(0).value_clr().write_value(pin);
    } else {
        pac::SIO.gpio_out(0).value_set().write_value(pin);
    }
}

/// Whatever goes on elsewhere: no torque.
pub fn last_resort() -> ! {
    enable_drives(false);
    // The watchdog is not fed from here: the chip starts anew, with the drives off.
    loop {
        cortex_m::asm::nop();
    }
}

/// A panic of the program itself.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    last_resort()
}

/// The processor cannot go on.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    last_resort()
}
