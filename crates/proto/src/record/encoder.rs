//! Writes a run down, block by block, through one fixed buffer.

use super::bytes::Writer;
use super::entry::{self, Expected};
use super::{Event, FORMAT, HASH_TICKS, HEAD, LONGEST_BLOCK, MOST_AXES, OutputsHash};
use abbe_core::compensate::{ErrorMap, NODES};
use abbe_core::{Command, Inputs, Outputs, Pos};
use core::fmt;
use crc::{CRC_32_ISO_HDLC, Crc};

/// The checksum of a block.
pub(super) const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Room for the longest entry that is not a map, and for the run that may come before it; a tick of three axes, the
/// longest, takes 114 bytes at most.
const ROOM: usize = 128;
/// Room for a map: ten bytes of place, five a node, and what any entry needs.
const ROOM_FOR_MAP: usize = ROOM + 5 * NODES;

/// Room for spans: four of three axes take 560 bytes at most.
const ROOM_FOR_SPANS: usize = ROOM + 640;

/// Where blocks go.
pub trait Sink {
    /// Why a block could not be kept.
    type Error;

    /// Takes one whole block.
    ///
    /// # Errors
    /// When there is no place for it.
    fn block(&mut self, block: &[u8]) -> Result<(), Self::Error>;
}

/// Any function that takes blocks.
impl<E, F: FnMut(&[u8]) -> Result<(), E>> Sink for F {
    type Error = E;

    fn block(&mut self, block: &[u8]) -> Result<(), E> {
        self(block)
    }
}

/// Blocks one after the other in memory that somebody lends.
#[derive(Debug)]
pub struct SliceSink<'a> {
    bytes: &'a mut [u8],
    used: usize,
}

impl<'a> SliceSink<'a> {
    /// Begins at the beginning of `bytes`.
    pub fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes, used: 0 }
    }

    /// The recording so far.
    pub fn written(&self) -> &[u8] {
        self.bytes.get(..self.used).unwrap_or_default()
    }
}

/// The memory was too short for the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

impl fmt::Display for Full {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("there is no room for another block of the recording")
    }
}

impl core::error::Error for Full {}

impl Sink for SliceSink<'_> {
    type Error = Full;

    fn block(&mut self, block: &[u8]) -> Result<(), Full> {
        let end = self.used.saturating_add(block.len());
        let room = self.bytes.get_mut(self.used..end).ok_or(Full)?;
        // `copy_from_slice` leaves a panic path.
        for (place, &byte) in room.iter_mut().zip(block) {
            *place = byte;
        }
        self.used = end;
        Ok(())
    }
}

/// Writes a run down. Give it every [`Event`] in its order, and after each tick what the controller answered.
///
/// A block reaches the sink when it is full, so up to [`LONGEST_BLOCK`] bytes of entries are still here until
/// [`Encoder::flush`] or [`Encoder::finish`]. When the sink takes a block not, that block is lost and the recording
/// has a gap: nothing that follows will replay.
#[derive(Debug)]
pub struct Encoder<const N: usize, S> {
    sink: S,
    block: [u8; LONGEST_BLOCK],
    used: usize,
    expected: Expected<N>,
    /// Ticks as expected that are not written yet, fewer than [`entry::LONGEST_RUN`].
    run: u8,
    hash: OutputsHash,
    since_hash: u32,
}

impl<const N: usize, S: Sink> Encoder<N, S> {
    /// Begins a recording.
    pub fn new(sink: S) -> Self {
        const { assert!(N <= MOST_AXES, "no more axes have their bits in an entry") };
        let mut encoder = Self {
            sink,
            block: [0; LONGEST_BLOCK],
            used: 0,
            expected: Expected::new(),
            run: 0,
            hash: OutputsHash::EMPTY,
            since_hash: 0,
        };
        encoder.begin_block();
        encoder
    }

    /// Where the blocks went.
    pub fn sink(&self) -> &S {
        &self.sink
    }

    /// What the outputs so far hash to.
    pub fn hash(&self) -> OutputsHash {
        self.hash
    }

    /// Writes what happened.
    ///
    /// # Errors
    /// When the sink does not take a block.
    pub fn event(&mut self, event: &Event<'_, N>) -> Result<(), S::Error> {
        match *event {
            Event::Tick(ref inputs) => return self.tick(inputs),
            Event::Command(ref command) => self.open(ROOM)?.command(command),
            Event::Plan { number, start } => {
                let mut to = self.open(ROOM)?;
                to.byte(entry::PLAN);
                to.number32(number);
                to.number32(start);
            }
            Event::Refine { axis } => {
                let mut to = self.open(ROOM)?;
                to.byte(entry::REFINE);
                to.number(axis as u64);
            }
            Event::Spans(ref batch) => {
                let mut to = self.open(ROOM_FOR_SPANS)?;
                to.byte(entry::SPANS);
                to.batch(batch);
            }
            Event::Map { axis, map: None } => {
                let mut to = self.open(ROOM)?;
                to.byte(entry::NO_MAP);
                to.number(axis as u64);
            }
            Event::Map { axis, map: Some(map) } => {
                let mut to = self.open(ROOM_FOR_MAP)?;
                to.byte(entry::MAP);
                to.number(axis as u64);
                to.map(map);
            }
        }
        Ok(())
    }

    /// Takes the answer to the last tick into the hash; every [`HASH_TICKS`] ticks the hash is written, so that a
    /// replay that differs is found where it does.
    ///
    /// # Errors
    /// When the sink does not take a block.
    pub fn outputs(&mut self, outputs: &Outputs<N>) -> Result<(), S::Error> {
        self.hash.add(outputs);
        self.since_hash = self.since_hash.wrapping_add(1);
        if self.since_hash < HASH_TICKS {
            return Ok(());
        }
        self.write_hash()
    }

    /// Writes the hash, and gives the sink the block as it is.
    ///
    /// # Errors
    /// When the sink does not take a block.
    pub fn flush(&mut self) -> Result<(), S::Error> {
        self.write_hash()?;
        self.end_block()
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// When the sink does not take the last block.
    pub fn finish(mut self) -> Result<S, S::Error> {
        self.flush()?;
        Ok(self.sink)
    }

    fn tick(&mut self, inputs: &Inputs<N>) -> Result<(), S::Error> {
        self.make_room(ROOM)?;
        if *inputs == self.expected.inputs {
            self.run = self.run.saturating_add(1);
            if self.run == entry::LONGEST_RUN {
                self.write_run();
            }
        } else {
            self.write_run();
            self.expected.write(inputs, &mut Writer::new(&mut self.block, &mut self.used));
        }
        self.expected.pass(inputs);
        Ok(())
    }

    fn write_hash(&mut self) -> Result<(), S::Error> {
        self.since_hash = 0;
        let value = self.hash.value();
        let mut to = self.open(ROOM)?;
        to.byte(entry::HASH);
        to.whole(value);
        Ok(())
    }

    /// Where an entry goes that is not a tick.
    fn open(&mut self, room: usize) -> Result<Writer<'_>, S::Error> {
        self.make_room(room)?;
        self.write_run();
        Ok(Writer::new(&mut self.block, &mut self.used))
    }

    fn write_run(&mut self) {
        if let Some(more) = self.run.checked_sub(1) {
            Writer::new(&mut self.block, &mut self.used).byte(entry::RUN | more);
            self.run = 0;
        }
    }

    fn make_room(&mut self, room: usize) -> Result<(), S::Error> {
        if self.used.saturating_add(room) <= LONGEST_BLOCK { Ok(()) } else { self.end_block() }
    }

    fn begin_block(&mut self) {
        self.used = HEAD;
        Writer::new(&mut self.block, &mut self.used).byte(FORMAT << 4 | N as u8);
        self.expected = Expected::new();
    }

    fn end_block(&mut self) -> Result<(), S::Error> {
        self.write_run();
        write_head(&mut self.block, self.used);
        let taken = self.sink.block(self.block.get(..self.used).unwrap_or_default());
        self.begin_block();
        taken
    }
}

/// Length and checksum of a block of which `used` bytes are written.
pub(super) fn write_head(block: &mut [u8; LONGEST_BLOCK], used: usize) {
    let length = (used.saturating_sub(HEAD) as u16).to_le_bytes();
    let payload = block.get(HEAD..used).unwrap_or_default();
    let checksum = checksum(length, payload).to_le_bytes();
    for (place, byte) in block.iter_mut().zip(length.into_iter().chain(checksum)) {
        *place = byte;
    }
}

/// Over the length, too: a wrong length is found before it misleads.
pub(super) fn checksum(length: [u8; 2], payload: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&length);
    digest.update(payload);
    digest.finalize()
}

impl Writer<'_> {
    fn command<const N: usize>(&mut self, command: &Command<N>) {
        match command {
            Command::Enable => self.byte(entry::ENABLE),
            Command::Disable => self.byte(entry::DISABLE),
            Command::Home => self.byte(entry::HOME),
            Command::MoveTo(to) => self.places(entry::MOVE_TO, to),
            Command::MoveBy(way) => self.places(entry::MOVE_BY, way),
            Command::Go(segment) => {
                self.byte(entry::GO);
                self.segment(segment);
            }
            Command::Compare(compare) => {
                self.byte(entry::COMPARE);
                self.compare(compare.as_ref());
            }
            Command::Hold => self.byte(entry::HOLD),
            Command::Resume => self.byte(entry::RESUME),
            Command::FeedRate(percent) => {
                self.byte(entry::FEED_RATE);
                self.number32(u32::from(*percent));
            }
            Command::Stop => self.byte(entry::STOP),
            Command::Reset => self.byte(entry::RESET),
        }
    }

    fn places<const N: usize>(&mut self, opening: u8, places: &[Pos; N]) {
        self.byte(opening);
        for place in places {
            self.signed(place.pm());
        }
    }

    fn map(&mut self, map: &ErrorMap) {
        self.signed(map.low().pm());
        let mut last = 0i32;
        for &node in map.nodes() {
            self.signed32(node.wrapping_sub(last));
            last = node;
        }
    }
}
