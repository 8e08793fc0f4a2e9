//! Replays a golden trace on this processor and tells what its outputs hash to.
//!
//! The same source runs on every body: on the RP2040's emulator (feature `rp2040`), where the trace lies in the flash
//! and the answer in memory, and in QEMU, where both go through semihosting.
#![no_std]
#![no_main]

#[cfg_attr(feature = "rp2040", path = "rp2040.rs")]
#[cfg_attr(not(feature = "rp2040"), path = "qemu.rs")]
mod host;

use abbe_core::Controller;
use abbe_proto::record::{Decoder, Entry, LONGEST_BLOCK, OutputsHash, RecordError, apply, stage};

/// How a replay ended.
#[derive(Clone, Copy)]
pub(crate) enum End {
    /// At the end of the trace.
    Whole,
    /// The outputs differ from those of the recorded run.
    Differs,
    /// The trace cannot be read.
    Unreadable(RecordError),
}

/// What a replay found.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    pub(crate) end: End,
    pub(crate) ticks: u32,
    /// Ticks of them that are proven by a hash in the trace.
    pub(crate) proven: u32,
    pub(crate) hash: OutputsHash,
}

/// Length of a block's head, and where in it the length of the rest stands.
const HEAD: usize = 6;

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut found = Found { end: End::Whole, ticks: 0, proven: 0, hash: OutputsHash::EMPTY };
    let mut trace = host::Trace::open();
    let mut memory = [0_u8; LONGEST_BLOCK];
    let mut block = next_block(&mut trace, &mut memory);
    let settings = match stage::of_block::<2>(block.unwrap_or_default()) {
        Ok(settings) => settings,
        Err(error) => {
            found.end = End::Unreadable(error);
            host::answer(&found);
        }
    };
    if settings.is_some() {
        block = next_block(&mut trace, &mut memory);
    }
    // The stage, the default one if the trace is of no other, is built here, in the floats of this processor.
    let Ok(config) = settings.unwrap_or_default().build() else { host::nothing_to_do() };
    let mut controller = Controller::with_planner(config);
    while let Some(entries) = block {
        replay(entries, &mut controller, &mut found);
        if !matches!(found.end, End::Whole) {
            break;
        }
        block = next_block(&mut trace, &mut memory);
    }
    host::answer(&found)
}

/// The next block of the trace, with its head.
fn next_block<'a>(trace: &mut host::Trace, block: &'a mut [u8]) -> Option<&'a [u8]> {
    let head = block.get_mut(..HEAD)?;
    if !trace.read(head) {
        return None;
    }
    let length = usize::from(u16::from_le_bytes([head[0], head[1]]));
    let end = HEAD + length;
    // What is not there is found out by the checksum.
    if let Some(rest) = block.get_mut(HEAD..end) {
        trace.read(rest);
    }
    block.get(..end.min(LONGEST_BLOCK))
}

fn replay(block: &[u8], controller: &mut Controller<2>, found: &mut Found) {
    let mut decoder = Decoder::<2>::new(block);
    loop {
        match decoder.next_entry() {
            Ok(Some(Entry::Event(event))) => {
                if let Some(outputs) = apply(controller, &event) {
                    found.hash.add(&outputs);
                    found.ticks += 1;
                }
            }
            Ok(Some(Entry::Hash(hash))) if hash == found.hash => found.proven = found.ticks,
            Ok(Some(Entry::Hash(_))) => {
                found.end = End::Differs;
                return;
            }
            Ok(None) => return,
            Err(error) => {
                found.end = End::Unreadable(error);
                return;
            }
        }
    }
}
