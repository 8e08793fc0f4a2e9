//! Reads a run back.

use super::bytes::Reader;
use super::encoder::checksum;
use super::entry::{self, Expected};
use super::error::{RecordError, RecordFault};
use super::{Entry, Event, FORMAT, HEAD, LONGEST_BLOCK, MOST_AXES, OutputsHash};
use abbe_core::compensate::ErrorMap;
use abbe_core::{Command, Pos};

/// Reads a recording, entry by entry. It trusts nothing: every block is checked before it is read.
#[derive(Clone, Debug)]
pub struct Decoder<'a, const N: usize> {
    cursor: Cursor<'a, N>,
    /// The last map; an entry borrows it, because it is a thousand times larger than most entries.
    map: ErrorMap,
}

impl<'a, const N: usize> Decoder<'a, N> {
    /// Begins at the beginning of a recording.
    pub fn new(bytes: &'a [u8]) -> Self {
        const { assert!(N <= MOST_AXES, "no more axes have their bits in an entry") };
        let block = Reader { left: &[] };
        let cursor = Cursor { bytes, next_block: 0, block, expected: Expected::new(), run: 0 };
        Self { cursor, map: ErrorMap::NONE }
    }

    /// How far it has read, bytes.
    pub fn at(&self) -> usize {
        self.cursor.at()
    }

    /// The next entry; none at the end, and after an error.
    ///
    /// # Errors
    /// When the recording is cut off, altered, or of another format; with the place.
    pub fn next_entry(&mut self) -> Result<Option<Entry<'_, N>>, RecordError> {
        let Self { cursor, map } = self;
        if let Some(inputs) = cursor.next_of_run() {
            return Ok(Some(Entry::Event(Event::Tick(inputs))));
        }
        while cursor.block.left.is_empty() {
            let at = cursor.next_block;
            if at == cursor.bytes.len() {
                return Ok(None);
            }
            cursor.open_block().map_err(|fault| cursor.give_up(at, fault))?;
        }
        let at = cursor.at();
        match cursor.entry(map) {
            Ok(entry) => Ok(Some(entry)),
            Err(fault) => Err(cursor.give_up(at, fault)),
        }
    }
}

/// What the first block of `bytes` holds, once it is known to be whole and unaltered.
pub(super) fn payload_of(bytes: &[u8]) -> Result<&[u8], RecordFault> {
    let (head, rest) = bytes.split_first_chunk::<HEAD>().ok_or(RecordFault::Truncated)?;
    let [low, high, crc @ ..] = *head;
    let length = u16::from_le_bytes([low, high]);
    if length == 0 || usize::from(length) > LONGEST_BLOCK - HEAD {
        return Err(RecordFault::Length(length));
    }
    let payload = rest.get(..usize::from(length)).ok_or(RecordFault::Truncated)?;
    let (written, found) = (u32::from_le_bytes(crc), checksum([low, high], payload));
    if written != found {
        return Err(RecordFault::Checksum { written, found });
    }
    Ok(payload)
}

#[derive(Clone, Copy, Debug)]
struct Cursor<'a, const N: usize> {
    bytes: &'a [u8],
    /// Where the block after this one begins.
    next_block: usize,
    /// What is left of this block.
    block: Reader<'a>,
    expected: Expected<N>,
    /// Ticks as expected that are still to come.
    run: u8,
}

impl<const N: usize> Cursor<'_, N> {
    fn at(&self) -> usize {
        self.next_block.saturating_sub(self.block.left.len())
    }

    /// Nothing after a fault can be trusted.
    fn give_up(&mut self, at: usize, fault: RecordFault) -> RecordError {
        self.next_block = self.bytes.len();
        self.block.left = &[];
        self.run = 0;
        RecordError { at, fault }
    }

    fn next_of_run(&mut self) -> Option<abbe_core::Inputs<N>> {
        self.run = self.run.checked_sub(1)?;
        let inputs = self.expected.inputs;
        self.expected.pass(&inputs);
        Some(inputs)
    }

    fn open_block(&mut self) -> Result<(), RecordFault> {
        let bytes = self.bytes.get(self.next_block..).unwrap_or_default();
        let payload = payload_of(bytes)?;
        self.block.left = payload;
        let kind = self.block.byte()?;
        if kind >> 4 != FORMAT {
            return Err(RecordFault::Format(kind >> 4));
        }
        if usize::from(kind & 0x0f) != N {
            return Err(RecordFault::Axes { recorded: kind & 0x0f, here: N as u8 });
        }
        self.expected = Expected::new();
        self.next_block = self.next_block.saturating_add(HEAD).saturating_add(payload.len());
        Ok(())
    }

    fn entry<'m>(&mut self, map: &'m mut ErrorMap) -> Result<Entry<'m, N>, RecordFault> {
        let opening = self.block.byte()?;
        let event = match opening {
            0..entry::RUN => {
                let inputs = self.expected.read(opening, &mut self.block)?;
                self.expected.pass(&inputs);
                Event::Tick(inputs)
            }
            entry::RUN..entry::ENABLE => {
                self.run = opening & (entry::LONGEST_RUN - 1);
                let inputs = self.expected.inputs;
                self.expected.pass(&inputs);
                Event::Tick(inputs)
            }
            entry::ENABLE => Event::Command(Command::Enable),
            entry::DISABLE => Event::Command(Command::Disable),
            entry::HOME => Event::Command(Command::Home),
            entry::MOVE_TO => Event::Command(Command::MoveTo(self.places()?)),
            entry::MOVE_BY => Event::Command(Command::MoveBy(self.places()?)),
            entry::GO => Event::Command(Command::Go(self.block.segment()?)),
            entry::COMPARE => Event::Command(Command::Compare(self.block.compare()?)),
            entry::HOLD => Event::Command(Command::Hold),
            entry::RESUME => Event::Command(Command::Resume),
            entry::FEED_RATE => Event::Command(Command::FeedRate(self.block.number16()?)),
            entry::SPANS => Event::Spans(self.block.batch()?),
            entry::STOP => Event::Command(Command::Stop),
            entry::RESET => Event::Command(Command::Reset),
            entry::PLAN => Event::Plan { number: self.block.number32()?, start: self.block.number32()? },
            entry::REFINE => Event::Refine { axis: self.axis()? },
            entry::NO_MAP => Event::Map { axis: self.axis()?, map: None },
            entry::MAP => {
                let axis = self.axis()?;
                *map = self.map()?;
                Event::Map { axis, map: Some(map) }
            }
            entry::HASH => return Ok(Entry::Hash(OutputsHash::of_value(self.block.whole()?))),
            unknown => return Err(RecordFault::Entry(unknown)),
        };
        Ok(Entry::Event(event))
    }

    fn axis(&mut self) -> Result<usize, RecordFault> {
        usize::try_from(self.block.number()?).map_err(|_| RecordFault::Number)
    }

    fn places(&mut self) -> Result<[Pos; N], RecordFault> {
        let mut places = [Pos::ZERO; N];
        for place in &mut places {
            *place = Pos::from_pm(self.block.signed()?);
        }
        Ok(places)
    }

    fn map(&mut self) -> Result<ErrorMap, RecordFault> {
        let low = Pos::from_pm(self.block.signed()?);
        let (mut node, mut fault) = (0i32, None);
        // A map is made only by sampling, which judges it: a forged one is refused.
        let map = ErrorMap::sample(low, |_| {
            match self.block.signed32() {
                Ok(difference) => node = node.wrapping_add(difference),
                Err(cut) => fault = Some(cut),
            }
            Pos::from_pm(i64::from(node))
        });
        match fault {
            Some(fault) => Err(fault),
            None => map.map_err(RecordFault::Map),
        }
    }
}
