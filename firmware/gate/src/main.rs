//! A proof by linking that the controller cannot panic.
//!
//! The panic handler calls `abbe_can_panic`, which exists nowhere. With fat link-time optimisation, a handler that no
//! code reaches disappears together with its call; if a single panic path is left in anything that
//! [`every_public_entry`] calls, the linker stops with `undefined symbol: abbe_can_panic`.
//!
//! Nothing here is ever run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use abbe_core::design::{Config, StageSettings};
use abbe_core::{Controller, Inputs};

/// Calls every public entry of `abbe-core` and `abbe-proto`.
///
/// Every argument goes through [`black_box`], so that no branch can be left out because its input is known; so does
/// every answer, so that no call can be left out because nobody reads it. A new public entry gets its line here.
fn every_public_entry() {
    if let Ok(config) = black_box(StageSettings::<2>::default()).build() {
        controller(black_box(config));
    }
}

fn controller(config: Config<2>) {
    let mut controller = Controller::new(config);
    loop {
        black_box(controller.tick(black_box(&Inputs::at_rest(0))));
        black_box(controller.status());
    }
}

/// Where the image would start.
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> ! {
    loop {
        every_public_entry();
        #[cfg(feature = "known-panic")]
        black_box(black_box([1_u8, 2, 3])[black_box(7_usize)]);
    }
}

unsafe extern "C" {
    /// Defined nowhere: a reference to it fails the link, and that failure is the finding.
    fn abbe_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: an image in which this call is left does not link, so it is never executed.
    unsafe { abbe_can_panic() }
}
