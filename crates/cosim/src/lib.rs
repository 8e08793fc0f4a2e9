//! The firmware in an emulator, against the models that the twin runs, and against the twin itself.
//!
//! The PIO programs are assembled from the files of the firmware, `firmware/pico/pio/*.pio`. An emulated PIO block
//! without a processor runs them clock by clock ([`block`]); [`decoder`], [`emitter`] and [`serial`] wire them up as
//! the board does and compare what they do with [`abbe_core::front`].
//!
//! [`golden`] replays recorded runs of the controller on this machine, on an emulated RP2040 and in QEMU, and counts
//! what a tick costs a Cortex-M0+. [`sensing`] does so for analogue axes. Both are [`metered`].
//!
//! The whole image runs on an emulated [`board`], [`wired`] to the twin pin by pin, and is compared with the controller
//! and the twin [`alone`]. [`image`] reads what the linker made.

pub mod alone;
pub mod block;
pub mod board;
pub mod decoder;
pub mod emitter;
pub mod golden;
pub mod image;
pub mod metered;
pub mod rates;
pub mod sensing;
pub mod serial;
pub mod signal;
pub mod wired;
