//! The front end: what is faster than a tick.
//!
//! 0.1 µm counts at 20 mm/s are 200 000 edges a second; no tick could decode them. A board does this in hardware
//! (an HCTL-2032, or PIO programs); the models here are exact and are fed edge by edge.

pub mod compare;
pub mod emitter;
pub mod quadrature;
pub mod setup;

// What the board's hardware is told and tells.
pub mod decoder_words;
pub mod pulse_words;

/// Clock of the front end on the board, Hz.
pub const CLOCK_HZ: u32 = 125_000_000;

pub use decoder_words::DecoderWords;
pub use emitter::{StepEmitter, Train};
pub use pulse_words::Runs;
pub use quadrature::{Decode, QuadratureCounter, Reading, filter_for};
pub use setup::Setup;
