//! Recorded encoder signals: read more than once from a file of any size, fitted, followed and judged.
//!
//! | module | does |
//! |---|---|
//! | [`samples`] | a CSV file, row by row, each fault with its line |
//! | [`rails`] | the ends of a channel, and samples cut off there |
//! | [`survey`] | first pass: ends, converter codes, times |
//! | [`signals`] | the samples as codes, through paper B's first limit filter if asked |
//! | [`method`] | second pass: the ellipse that the signals draw, and what a method takes off |
//! | [`paces`] | the usual step of time, and samples that are missing |
//! | [`turns`] | extremes of a channel that were seen whole |
//! | [`way`] | phases to positions, over gaps too |
//! | [`follow`] | third pass: positions, radius and noise |
//! | [`stretches`] | harmonics of the phase error beside a smooth motion |
//! | [`error`] | the error inside a period before and after |
//! | [`health`] | grades with their reasons |
//! | [`plot`] | two panels: the signals, the error over the phase |

pub(crate) mod error;
pub(crate) mod follow;
pub(crate) mod health;
pub(crate) mod method;
pub(crate) mod paces;
pub(crate) mod plot;
pub(crate) mod rails;
pub(crate) mod samples;
pub(crate) mod signals;
pub(crate) mod stretches;
pub(crate) mod survey;
pub(crate) mod turns;
pub(crate) mod way;
#[cfg(test)]
mod tests;
