//! Plan: makes the set-point of this tick.
//!
//! Planning itself (durations, gains) is slow work and happens in [`crate::background`]; here a plan is only walked,
//! in integers.

pub mod path;
pub mod profile;
pub mod ramp;

pub use path::{LinePlan, Path};
pub use profile::{Limits, Profile};
pub use ramp::Ramp;
