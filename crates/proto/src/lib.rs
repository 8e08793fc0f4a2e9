//! What travels on wires and into files: parsers and encoders, sans I/O, without allocation and without panic.
//!
//! [`gcode`] reads programs. [`plain`] is what a person types into a terminal to try a board. [`record`] is what happened to a controller, as
//! bytes: the flight recorder and the golden traces are made of it.
#![cfg_attr(not(test), no_std)]
#![deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]
#![cfg_attr(test, allow(clippy::indexing_slicing, clippy::arithmetic_side_effects))]

pub mod gcode;
pub mod plain;
pub mod record;
