//! What happened to a controller, as values and as bytes.
//!
//! The controller is a function of what it is given, so a run is its inputs, commands, plans and maps in their order:
//! [`Event`]s. [`Encoder`] writes them down in a few bytes a tick, [`Decoder`] reads them, [`Replay`] gives them to
//! another controller and proves that it answers with the same outputs, bit for bit.
//!
//! # The bytes
//!
//! A recording is a row of blocks, each at most [`LONGEST_BLOCK`] bytes:
//!
//! | bytes | hold |
//! |---|---|
//! | 2 | length of the payload, little-endian |
//! | 4 | CRC-32 (ISO-HDLC) of the length and the payload, little-endian |
//! | 1 | payload: version of the format × 16 + number of axes |
//! | … | payload: entries |
//!
//! An entry opens with one byte:
//!
//! | byte | entry |
//! |---|---|
//! | `0rbababa` | a tick: counter (a) and pulses (b) of the axes that moved, then, if r, the rest that changed |
//! | `10nnnnnn` | n + 1 ticks in which nothing changed |
//! | `11kkkkkk` | what kind: a command, a plan, spans, a map, a hash |
//!
//! A tick holds its differences from what the last one lets expect (see `Expected` in the source) as zig-zag varints.
//! A block begins as if the last tick had been [`abbe_core::Inputs::at_rest`]: its first tick is written whole, and it
//! can be read without the blocks before it.
//!
//! A recording may begin with a block that says of which stage it is ([`stage`], a feature).

mod bytes;
mod decoder;
mod encoder;
mod entry;
mod error;
mod hash;
mod replay;
mod spans;
#[cfg(feature = "stage")]
pub mod stage;
#[cfg(test)]
mod tests;

pub use decoder::Decoder;
pub use encoder::{Encoder, Full, Sink, SliceSink};
pub use error::{RecordError, RecordFault};
pub use hash::OutputsHash;
pub use replay::{Played, Replay, ReplayError};

use abbe_core::background::{self, Done};
use abbe_core::compensate::ErrorMap;
use abbe_core::plan::span::Batch;
use abbe_core::{Command, Controller, Inputs, Outputs};

/// Version of the bytes; it changes whenever a recording of one could not be read as the other.
pub const FORMAT: u8 = 3;
/// The longest block, bytes, with its head.
pub const LONGEST_BLOCK: usize = 4096;
/// Ticks from one hash of the outputs to the next.
pub const HASH_TICKS: u32 = 1000;
/// The most axes a recorded controller has.
pub const MOST_AXES: usize = 3;

/// Length and checksum of a block, bytes.
const HEAD: usize = 6;

/// One thing that happened to a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'m, const N: usize> {
    /// A tick with these inputs.
    Tick(Inputs<N>),
    /// A request, taken or refused.
    Command(Command<N>),
    /// The plan of move `number` was handed over, to begin at tick `start`. The plan itself follows from the controller.
    Plan {
        /// Number of the move.
        number: u32,
        /// Tick at which its path begins.
        start: u32,
    },
    /// A planner handed spans of a program or of a turn over.
    Spans(Batch<N>),
    /// The samples of an axis' analogue encoder went into its correction. What came of it follows from the controller.
    Refine {
        /// Which axis.
        axis: usize,
    },
    /// An error map was offered to an axis, or taken from it.
    Map {
        /// Which axis.
        axis: usize,
        /// The map, or none.
        map: Option<&'m ErrorMap>,
    },
}

impl<const N: usize> From<Done<N>> for Event<'_, N> {
    fn from(done: Done<N>) -> Self {
        match done {
            Done::Plan { number, start } => Self::Plan { number, start },
            Done::Spans(batch) => Self::Spans(batch),
            Done::Refined { axis } => Self::Refine { axis },
        }
    }
}

/// One entry of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry<'m, const N: usize> {
    /// Something happened.
    Event(Event<'m, N>),
    /// What the outputs of all ticks of the recording up to here must hash to.
    Hash(OutputsHash),
}

/// Lets an event happen to a controller; the outputs if it was a tick. Refusals are part of a run and change nothing.
pub fn apply<const N: usize>(controller: &mut Controller<N>, event: &Event<'_, N>) -> Option<Outputs<N>> {
    match *event {
        Event::Tick(ref inputs) => return Some(controller.tick(inputs)),
        Event::Command(command) => _ = controller.command(command),
        Event::Plan { number, start } => background::repeat(controller, &Done::Plan { number, start }),
        Event::Spans(ref batch) => _ = controller.take_spans(batch),
        Event::Refine { axis } => background::repeat(controller, &Done::Refined { axis }),
        Event::Map { axis, map } => _ = controller.set_error_map(axis, map.copied()),
    }
    None
}
