//! The flight recorder: what happened to a controller, kept, written down, and made to happen again.
//!
//! | file | is |
//! |---|---|
//! | [`recorder`] | a controller that nothing reaches unrecorded; keeps the last minutes, or all |
//! | [`file`] | a recording as a file, and every reason to refuse one |
//! | [`replay`] | the same run once more, proven bit for bit |
//! | [`samples`] | the samples of its analogue encoders |
//! | [`trace`] | what a replay shows, over time: rows and lines |
//! | [`plot`] | the picture of it |
//!
//! The words: a *recording* is a row of *stretches*, each some seconds long; a stretch opens with a *snapshot* of the
//! whole controller, so that the first ones can be forgotten and the rest still be replayed.

pub(crate) mod file;
pub(crate) mod plot;
pub(crate) mod recorder;
pub(crate) mod replay;
pub(crate) mod samples;
mod snapshot;
pub(crate) mod trace;

pub(crate) use file::{Recording, RecordingError};
pub(crate) use recorder::{Keep, Recorder};
