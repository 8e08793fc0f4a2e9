//! Measure, fit, compensate, certify, report.
//!
//! The crate knows no stage and no simulation: it drives whatever implements the small traits of [`measure`], and
//! works on files. The order of the modules is the order of the work:
//!
//! | module | does |
//! |---|---|
//! | [`targets`] | where to measure |
//! | [`measure`] | drives a stage to the targets and reads an instrument |
//! | [`readings`] | holds, reads and writes what was read |
//! | [`iso230`] | the figures of ISO 230-2:2014 |
//! | [`fit`] | polynomials through the mean error, and the choice of degree |
//! | [`compensation`] | the file that corrects a stage, and the inverse that applies it |
//! | [`verify`] | what is left after compensation, beside what paper A left |
//! | [`report`] | one HTML file with all of it |
//!
//! Signs: an error is *actual minus commanded*, so a compensation subtracts it. Units are in the names: positions in
//! mm, errors in µm.

pub mod axis;
pub mod compensation;
pub mod fit;
pub mod iso230;
pub mod measure;
pub mod polynomial;
pub mod readings;
pub mod report;
pub mod targets;
pub mod verify;
mod whole_file;

pub use axis::{Approach, Axis};
