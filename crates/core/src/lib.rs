//! The controller of an X-Y stage, sans I/O: no allocation, no panic, no clock, no float in the tick.
//!
//! The whole of it is one call at the servo rate:
//!
//! ```
//! use abbe_core::{Controller, edge::Inputs, design::StageSettings};
//! let config = StageSettings::<2>::default().build().expect("the default stage is consistent");
//! let mut controller = Controller::new(config);
//! let outputs = controller.tick(&Inputs::at_rest(0));
//! assert!(outputs.axes.iter().all(|axis| !axis.enable)); // drives are off until somebody asks
//! ```
//!
//! Inside [`Controller::tick`] the order is fixed: sense → guard → machine → plan → compensate → servo → drive →
//! publish, one module each. What is faster than a tick (edges, pulses) lives in [`front`]; what is slower
//! (planning) in [`background`].
//!
//! The feature `serde` makes a controller a value that can be written down in the middle of a run and goes on
//! elsewhere; no board needs it.
#![cfg_attr(not(test), no_std)]
#![deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]
#![cfg_attr(test, allow(clippy::indexing_slicing, clippy::arithmetic_side_effects))]

#[cfg(feature = "serde")]
mod arrays;
pub mod controller;
pub mod units;
pub mod wide;

// The edge of the world, and what crosses it.
pub mod command;
pub mod design;
pub mod edge;
pub mod front;

// One tick, top to bottom.
pub mod sense;
pub mod guard;
pub mod machine;
pub mod plan;
pub mod compensate;
pub mod servo;
pub mod drive;
pub mod publish;

// Slower than a tick.
pub mod background;

pub use command::{Accepted, Command, Refusal};
pub use controller::Controller;
pub use edge::{Inputs, Outputs};
pub use publish::Status;
pub use units::{Counts, Pos};
