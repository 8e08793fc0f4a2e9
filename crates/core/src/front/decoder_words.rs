//! What a tick makes of the words of the board's decoder.

use super::Reading;

/// Bits of the counter in a word of the counting machine.
const BITS: u32 = 24;
/// So many words of the latching machine are of use; its FIFO holds no more.
pub const LATCHED: usize = 8;
/// So many words of the counting machine must be read for a fresh one: its FIFO holds one less, and keeps the oldest.
pub const FRESH: usize = 5;

/// Makes readings from the words of one axis's decoder (`firmware/pico/pio/decoder.pio`).
///
/// A tick reads, in this order:
/// 1. the words of the latching machine until there are none;
/// 2. [`FRESH`] words of the counting machine, waiting for each; the last is new;
/// 3. the level of Z, then what the latching machine has pushed meanwhile, then the level of Z again.
///
/// The counter and the illegal transitions are those of [`super::QuadratureCounter::new`] with a filter of 1, clocked
/// once in the 11 clocks of a loop. The index is taken when Z was high in two looks, as of the first of them; a single
/// look counts as a glitch. Two things of that model are not seen: a rise of Z in a tick that began with Z high, and
/// that two single looks in one tick were no index.
#[derive(Clone, Copy, Debug)]
pub struct DecoderWords {
    counter: u32,
    /// The last word of the counting machine.
    last: u32,
    index: Index,
}

/// What is known of Z at the end of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Index {
    Low,
    /// Seen high once, and still high.
    Rising,
    /// Seen high, and the index taken.
    High,
}

impl DecoderWords {
    /// A counter that reads zero where the counting machine stood at `word`.
    pub fn new(word: u32) -> Self {
        Self { counter: 0, last: word, index: Index::Low }
    }

    /// The last word of the counting machine.
    pub fn word(&self) -> u32 {
        self.last
    }

    /// One tick: the new word of the counting machine, the words of the latching machine (the first [`LATCHED`] of
    /// them) and whether Z was high before or after the last of them was read.
    ///
    /// Right while there are less than 2²³ counts and 256 illegal transitions between two readings.
    pub fn read(&mut self, word: u32, latched: &[u32], z: bool) -> Reading {
        let moved = moved(word >> 8, self.last >> 8);
        let illegal = (self.last as u8).wrapping_sub(word as u8);
        self.counter = self.counter.wrapping_add(moved);
        self.last = word;
        let mut reading =
            Reading { counter: self.counter, illegal: u16::from(illegal), ..Reading::default() };
        self.look(latched, z, &mut reading);
        reading
    }

    fn look(&mut self, latched: &[u32], z: bool, reading: &mut Reading) {
        let rise = match (self.index, latched) {
            (Index::Low, [_, second, ..]) | (Index::Rising, [second, ..]) => Some(*second),
            _ => None,
        };
        reading.index = rise.map(|at| self.counter.wrapping_add(moved(at, self.last >> 8)));
        let once = match self.index {
            Index::Low => latched.len() == 1 && !z,
            Index::Rising => latched.is_empty(),
            Index::High => false,
        };
        reading.glitches = u16::from(once);
        self.index = match (self.index, latched.len()) {
            (_, 0) => Index::Low,
            _ if !z => Index::Low,
            (Index::Low, 1) => Index::Rising,
            _ => Index::High,
        };
    }
}

/// Counts from `from` to `to`, of which the low 24 bits are known.
fn moved(to: u32, from: u32) -> u32 {
    let unused = u32::BITS.saturating_sub(BITS);
    ((to.wrapping_sub(from) << unused).cast_signed() >> unused).cast_unsigned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(counter: u32, illegal: u8) -> u32 {
        (counter << 8) | u32::from(!illegal)
    }

    #[test]
    fn counts_go_on_through_the_wrap_of_24_bits_and_illegal_ones_through_that_of_8() {
        let mut words = DecoderWords::new(word(0xFF_FFFE, 250));
        let reading = words.read(word(3, 4), &[], false);
        assert_eq!((reading.counter, reading.illegal), (5, 10));
        let reading = words.read(word(0xFF_FFF0, 4), &[], false);
        assert_eq!((reading.counter.cast_signed(), reading.illegal), (-14, 0));
    }

    #[test]
    fn the_second_word_is_the_index_as_the_counter_is_written() {
        let mut words = DecoderWords::new(word(0x00_0001, 0));
        let reading = words.read(word(0xFF_FFF1, 0), &[0x7FFF_FFF7, 0x7FFF_FFF6, 0x7FFF_FFF5], false);
        assert_eq!((reading.counter.cast_signed(), reading.index), (-16, Some((-11i32).cast_unsigned())));
    }

    /// Words and level of Z in a row of ticks; expected indices and glitches.
    #[test]
    fn a_pulse_of_the_index_is_taken_once_wherever_ticks_cut_it() {
        type Tick = (&'static [u32], bool, Option<u32>, u16);
        let cases: &[&[Tick]] = &[
            // Within a tick; over two and three ticks; seen once before the end of a tick.
            &[(&[], false, None, 0), (&[4, 5, 6], false, Some(4), 0), (&[], false, None, 0)],
            &[(&[4, 5, 6], true, Some(4), 0), (&[7, 8], false, None, 0), (&[9, 10], false, Some(9), 0)],
            &[(&[4, 5], true, Some(4), 0), (&[7; 8], true, None, 0), (&[8], false, None, 0)],
            &[(&[4], true, None, 0), (&[5, 6], true, Some(4), 0), (&[7], false, None, 0)],
            // It rose after the last look of the tick.
            &[(&[], true, None, 0), (&[4, 5], false, Some(4), 0)],
            // A disturbance, within a tick and at its end.
            &[(&[4], false, None, 1), (&[4, 5], false, Some(4), 0)],
            &[(&[4], true, None, 0), (&[], false, None, 1), (&[6, 7], true, Some(6), 0)],
            // Low again at once after a tick that ended high, and high again later.
            &[(&[4, 5], true, Some(4), 0), (&[], false, None, 0), (&[6, 7], false, Some(6), 0)],
        ];
        for case in cases {
            let mut words = DecoderWords::new(word(1, 0));
            for (tick, (latched, z, index, glitches)) in case.iter().enumerate() {
                let reading = words.read(word(1, 0), latched, *z);
                assert_eq!((reading.index, reading.glitches), (*index, *glitches), "{case:?} {tick}");
            }
        }
    }
}
