//! Plan: makes the set-point of this tick.
//!
//! Planning itself (durations, gains) is slow work and happens in [`crate::background`]; here a plan is only walked,
//! in integers. [`compare`] and [`chords`] are the same division for paths in whole counts.

pub mod chords;
pub mod compare;
pub mod corner;
pub mod curve;
pub mod elsewhere;
pub mod joint;
pub mod line;
pub mod overlap;
pub mod path;
pub mod pieces;
pub mod profile;
pub mod program;
pub mod ramp;
pub mod ring;
mod root;
pub mod scan;
pub mod segment;
pub mod span;
pub mod steps;
pub mod transfer;

pub use line::LinePlan;
pub use path::Path;
pub use profile::{Limits, Profile};
pub use ramp::Ramp;
pub use segment::Segment;
