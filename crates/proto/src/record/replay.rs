//! Gives a recorded run to another controller and proves that it answers the same.

use super::error::RecordError;
use super::{Decoder, Entry, Event, OutputsHash, apply};
use abbe_core::{Accepted, Command, Controller, Outputs, Refusal};
use core::fmt;

/// A run that happens again.
#[derive(Clone, Debug)]
pub struct Replay<'a, const N: usize> {
    decoder: Decoder<'a, N>,
    hash: OutputsHash,
    ticks: u32,
    proven: u32,
}

/// What happened in one step of a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Played<const N: usize> {
    /// A tick, and what the controller answered.
    Tick(Outputs<N>),
    /// A request, and how it was answered.
    Command(Command<N>, Result<Accepted, Refusal>),
    /// Work between two ticks: a plan was handed over, or an encoder's correction learned.
    Background,
    /// The error map of this axis was offered or taken.
    Map(usize),
    /// All outputs up to here are those of the recorded run.
    Proven,
}

/// Why a replay cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayError {
    /// The recording cannot be read.
    Record(RecordError),
    /// The controller answered something else than in the recorded run.
    Differs {
        /// Ticks whose outputs are the same.
        same: u32,
        /// Ticks within which they first differ.
        within: u32,
    },
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Record(error) => error.fmt(f),
            Self::Differs { same, within } => write!(
                f,
                "the outputs differ from the recorded run: the same for {same} ticks, not within the {within} after them"
            ),
        }
    }
}

impl core::error::Error for ReplayError {}

impl From<RecordError> for ReplayError {
    fn from(error: RecordError) -> Self {
        Self::Record(error)
    }
}

impl<'a, const N: usize> Replay<'a, N> {
    /// Begins at the beginning of a recording.
    pub fn new(recording: &'a [u8]) -> Self {
        Self { decoder: Decoder::new(recording), hash: OutputsHash::EMPTY, ticks: 0, proven: 0 }
    }

    /// Ticks that have happened again.
    pub fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Of those, the first so many are proven to be the same; the rest waits for the next hash.
    pub fn proven(&self) -> u32 {
        self.proven
    }

    /// What the outputs so far hash to.
    pub fn hash(&self) -> OutputsHash {
        self.hash
    }

    /// Lets the next thing happen to `controller`, which must be as it was when the recording began; none at the end.
    ///
    /// # Errors
    /// When the recording cannot be read, and when the outputs differ.
    pub fn step(&mut self, controller: &mut Controller<N>) -> Result<Option<Played<N>>, ReplayError> {
        let Some(entry) = self.decoder.next_entry()? else { return Ok(None) };
        let played = match entry {
            Entry::Event(Event::Command(command)) => Played::Command(command, controller.command(command)),
            Entry::Event(event) => match (apply(controller, &event), event) {
                (Some(outputs), _) => {
                    self.hash.add(&outputs);
                    self.ticks = self.ticks.saturating_add(1);
                    Played::Tick(outputs)
                }
                (None, Event::Map { axis, .. }) => Played::Map(axis),
                (None, _) => Played::Background,
            },
            Entry::Hash(hash) if hash == self.hash => {
                self.proven = self.ticks;
                Played::Proven
            }
            Entry::Hash(_) => {
                let within = self.ticks.saturating_sub(self.proven);
                return Err(ReplayError::Differs { same: self.proven, within });
            }
        };
        Ok(Some(played))
    }

    /// Lets all the rest happen; the ticks that are proven to be the same.
    ///
    /// # Errors
    /// As [`Replay::step`].
    pub fn run(&mut self, controller: &mut Controller<N>) -> Result<u32, ReplayError> {
        while self.step(controller)?.is_some() {}
        Ok(self.proven)
    }
}
