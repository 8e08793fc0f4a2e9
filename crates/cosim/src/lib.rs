//! The firmware's parts in an emulator, against the models that the twin runs.
//!
//! The PIO programs are assembled from the files of the firmware, `firmware/pico/pio/*.pio`. An emulated PIO block
//! without a processor runs them clock by clock ([`block`]); [`decoder`], [`emitter`] and [`serial`] wire them up as
//! the board does and compare what they do with [`abbe_core::front`].

pub mod alone;
pub mod block;
pub mod board;
pub mod decoder;
pub mod emitter;
pub mod image;
pub mod serial;
pub mod signal;
pub mod wired;
