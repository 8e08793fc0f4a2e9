//! Tests of the crate from outside, one module for each of its own; one program, so that it links once.

// The lint spares test functions but not the functions they share.
#![allow(clippy::unwrap_used)]

mod compensation;
mod fit;
mod iso230;
mod measure;
mod readings;
mod report;
mod verify;
