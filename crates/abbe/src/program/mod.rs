//! G-code programs: read from a file of any size, looked at as a whole before anything moves, and run.
//!
//! | module | does |
//! |---|---|
//! | [`lines`] | a program line by line, never more in memory than the longest line may have |
//! | [`course`] | what a motion is on the way: its extremes, its length, what each axis takes of its speed |
//! | [`travel`] | the travel of a stage, and motions that leave it |
//! | [`feed`] | feeds that the stage cannot go |
//! | [`summary`] | what a program is in figures |
//! | [`check`] | all of it, once through the program |
//! | [`ahead`] | lines that are read ahead of the stage |
//! | [`steps`] | what a line asks of the controller |
//! | [`runner`] | a program on a stage |
//! | [`watch`] | what the stage shows meanwhile, tick by tick |
//! | [`picture`] | the same drawn |
//! | [`stepwise`] | a program as paper A goes through it, step by step |

pub(crate) mod ahead;
pub(crate) mod check;
pub(crate) mod course;
pub(crate) mod feed;
pub(crate) mod lines;
pub(crate) mod picture;
pub(crate) mod runner;
pub(crate) mod steps;
pub(crate) mod stepwise;
pub(crate) mod summary;
#[cfg(test)]
mod tests;
pub(crate) mod travel;
pub(crate) mod watch;
