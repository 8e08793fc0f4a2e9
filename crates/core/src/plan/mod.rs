//! Plan: makes the set-point of this tick.
//!
//! Planning itself (durations, gains) is slow work and happens in [`crate::background`]; here a plan is only walked,
//! in integers. [`compare`] and [`chords`] are the same division for paths in whole counts.

pub mod chain;
pub mod chords;
pub mod compare;
pub mod corner;
pub mod curve;
pub mod path;
pub mod pieces;
pub mod profile;
pub mod ramp;
mod root;
pub mod scan;
pub mod steps;
pub mod transfer;

pub use path::{LinePlan, Path};
pub use profile::{Limits, Profile};
pub use ramp::Ramp;
