//! Golden traces on an emulated RP2040, and what every tick of them costs its Cortex-M0+.

use std::path::Path;

use anyhow::{Context, Result, bail};

use super::{End, Expected, Found};
use crate::image::Image;
use crate::metered::{Entries, Left, Metered};

/// Where the image looks for the trace: its length, then its bytes.
const TRACE: u32 = 0x1010_0000;
/// Instructions between two looks whether the image is done.
const GLANCE: u32 = 1 << 16;
/// A replay that takes more cycles a tick than a tick has hangs; building the stage in soft floats comes on top.
const MOST_CYCLES: u64 = 12_500;
const MOST_CYCLES_AT_START: u64 = 20_000_000;

/// The functions of the controller that are measured; the first is the whole tick, the others its stages in order.
pub const MEASURED: [&str; 9] =
    ["tick", "sense", "guard", "machine", "plan", "compensate", "servo", "drive", "publish"];

/// Cycles of each of [`MEASURED`] in one tick, from its first instruction to the first after its return.
pub type TickCycles = [u32; MEASURED.len()];

/// The image of `firmware/golden` for the RP2040.
#[derive(Debug)]
pub struct Board {
    image: Image,
    /// Addresses of its answer.
    end: u32,
    found: u32,
    /// Of [`MEASURED`].
    entries: Entries,
}

impl Board {
    /// Reads the image.
    ///
    /// # Errors
    /// It cannot be read, or lacks one of the functions or statics that are looked at.
    pub fn read(file: &Path) -> Result<Self> {
        let image = Image::read(file)?;
        let entry_of = |name| image.entry_of("abbe_core::controller::Controller<_>::", &format!("::{name}"));
        let addresses = MEASURED.iter().map(entry_of).collect::<Result<Vec<u32>>>()?;
        let entries = Entries::of(&image, &addresses);
        let (end, found) = (image.place_of("GOLDEN_END")?, image.place_of("GOLDEN_FOUND")?);
        Ok(Self { image, end, found, entries })
    }

    /// Replays a trace; what it found, and the cycles of each tick.
    ///
    /// # Errors
    /// The trace does not fit the flash, or the image stops without an answer.
    pub fn replay(&self, trace: &[u8], expected: &Expected) -> Result<(Found, Vec<TickCycles>)> {
        let mut image = self.image.clone();
        image.load(TRACE, &u32::try_from(trace.len())?.to_le_bytes())?;
        image.load(TRACE + 4, trace)?;
        let mut board = Metered::switched_on(&image, &self.entries)?;
        let mut meter = TickMeter::default();
        let most = MOST_CYCLES_AT_START + MOST_CYCLES * u64::from(expected.ticks);
        while board.peek(self.end) == 0 {
            for _ in 0..GLANCE {
                if let Some(left) = board.step() {
                    meter.add(left);
                }
            }
            board.is_well(most).with_context(|| format!("after {} ticks", meter.ticks.len()))?;
        }
        Ok((self.answer(&board)?, meter.ticks))
    }

    fn answer(&self, board: &Metered<'_>) -> Result<Found> {
        let [ticks, proven, low, high] = [0, 4, 8, 12].map(|offset| board.peek(self.found + offset));
        let end = match board.peek(self.end) {
            1 => End::Whole,
            2 => End::Differs,
            4 => bail!("the image cannot build its stage"),
            5 => bail!("the image has panicked after tick {ticks}"),
            at => End::Unreadable(format!("byte {} of a block", at.saturating_sub(16))),
        };
        Ok(Found { ticks, proven, hash: u64::from(high) << 32 | u64::from(low), end })
    }
}

/// Sorts the cycles of functions by tick.
#[derive(Debug, Default)]
struct TickMeter {
    this: TickCycles,
    ticks: Vec<TickCycles>,
}

impl TickMeter {
    fn add(&mut self, left: Left) {
        self.this[usize::from(left.number)] = left.cycles;
        if left.outermost {
            self.ticks.push(std::mem::take(&mut self.this));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_ends_when_its_outermost_function_does() {
        let mut meter = TickMeter::default();
        meter.add(Left { number: 1, cycles: 10, outermost: false });
        assert!(meter.ticks.is_empty());
        meter.add(Left { number: 0, cycles: 30, outermost: true });
        assert_eq!(meter.ticks, [[30, 10, 0, 0, 0, 0, 0, 0, 0]]);
    }
}
