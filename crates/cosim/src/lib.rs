//! The firmware's parts in an emulator, against the models that the twin runs.
//!
//! [`golden`] replays recorded runs of the controller on this machine, on an emulated RP2040 and in QEMU, and counts
//! what a tick costs a Cortex-M0+. [`image`] reads what the linker made of an image.

pub mod golden;
pub mod image;
