//! The twin: a stage that is not there, as unkind as a real one.
//!
//! [`Twin::step`] takes what the controller puts out and returns what it would see: counters, samples, switches, pulses. The
//! truth (where the table really is) leaves only through [`Twin::truth`], and only instruments may ask.
//!
//! Everything is seeded: the same preset, seed and outputs give the same inputs, on every platform.

pub mod plant;
pub mod preset;

pub mod friction;
pub mod noise;
pub mod trig;

pub mod analogue;
pub mod axis;
pub mod dc_motor;
pub mod geometry;
pub mod heat;
pub mod scale;
pub mod stepper;
pub mod switches;

pub mod camera;
pub mod instruments;
pub mod pins;
pub mod specimen;

pub mod script;

mod event;
mod table;
mod twin;
mod vibration;
mod wander;

pub use event::{DigitalHead, Event};
pub use plant::Plant;
pub use twin::{Truth, Twin};
