//! One number for all outputs of a run.

use abbe_core::Outputs;
use abbe_core::edge::{Actuation, AxisOutputs};

/// FNV-1a, 64 bit, over every field of the outputs of every tick, taken in words of 32 bit: a multiplication of 64 bit
/// costs a Cortex-M0+ 90 cycles, and bytes would need four times as many.
///
/// The words of a tick are: for each axis the actuation, then piezo, enable (bit 16) and kind of actuation (bit 17);
/// the compare value or 0; then key row, display (bit 8), compare armed (bit 16), trigger (bit 17), lamp (bit 18).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputsHash(u64);

impl OutputsHash {
    /// The hash of no outputs at all.
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    /// The hash whose number is known.
    pub const fn of_value(value: u64) -> Self {
        Self(value)
    }

    /// The number.
    pub const fn value(self) -> u64 {
        self.0
    }

    /// Adds the outputs of one tick.
    pub fn add<const N: usize>(&mut self, outputs: &Outputs<N>) {
        let Outputs { axes, compare, trigger, key_row, display, lamp } = outputs;
        for axis in axes {
            self.add_axis(axis);
        }
        self.word(compare.unwrap_or(0));
        self.word(
            u32::from(*key_row)
                | u32::from(*display) << 8
                | u32::from(compare.is_some()) << 16
                | u32::from(*trigger) << 17
                | u32::from(*lamp) << 18,
        );
    }

    fn add_axis(&mut self, axis: &AxisOutputs) {
        let AxisOutputs { actuation, piezo, enable } = axis;
        let (drive, kind) = match actuation {
            Actuation::Steps(rate) => (rate.0.cast_unsigned(), 0),
            Actuation::Pwm(duty) => (u32::from(duty.cast_unsigned()), 1),
        };
        self.word(drive);
        self.word(u32::from(*piezo) | u32::from(*enable) << 16 | kind << 17);
    }

    fn word(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
    }
}

impl Default for OutputsHash {
    fn default() -> Self {
        Self::EMPTY
    }
}
