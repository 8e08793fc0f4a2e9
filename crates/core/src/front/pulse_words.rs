//! The words by which the board's emitter repeats a tick's pulses to the clock.

use super::emitter::{CLOSEST, Train};

/// A run's first pulse rises so many clocks after its word was taken, and its gap. Three instructions take the word,
/// one loads the gap, and counting it down takes one clock more than its length and the jump.
const FIRST: u32 = 6;
/// From one pulse of a run to the next, and its gap: 32 clocks of high level and the same instructions.
const PERIOD: u32 = 38;
/// The next word is taken so many clocks after the last pulse rose: how long STEP is high.
pub const HIGH: u32 = 32;
/// A run without pulses takes so many clocks, and its gap.
const PAUSE: u32 = 7;
/// Pulses rise so many clocks later than the train says: room for the shortest pause that the tick before may have
/// had to let overhang, with a pulse at the first clock.
pub const LAG: u32 = 12;

/// Turns trains into words; each tick's words take exactly the clocks of a tick, so that the pulses of all ticks lie
/// on one line of time, [`LAG`] clocks late, whatever the jitter of the processor that hands them over.
///
/// That holds while each tick's words arrive before the ones before are used up. The emitter that runs dry waits with
/// STEP low, and all later pulses are late by that wait.
///
/// A direction changes at least 67 clocks before its first pulse ([`super::emitter::DIRECTION_SETUP`]) and at least 33
/// after the last of the other one.
#[derive(Clone, Copy, Debug)]
pub struct Runs {
    clocks: u32,
    /// Clocks by which the last word of the tick before goes on into this one.
    carry: u32,
}

/// The words of one tick, in the order in which the emitter takes them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Words {
    words: [u32; 4],
    len: usize,
}

impl Words {
    /// All of them.
    pub fn as_slice(&self) -> &[u32] {
        self.words.get(..self.len).unwrap_or_default()
    }

    fn run(&mut self, up: bool, pulses: u32, gap: u32) {
        if let Some(word) = self.words.get_mut(self.len) {
            *word = u32::from(up) | (pulses << 1) | (gap << 12);
            self.len = self.len.saturating_add(1);
        }
    }
}

const _: () = assert!(CLOSEST >= PERIOD && LAG >= FIRST.saturating_add(PAUSE).saturating_sub(1));

impl Runs {
    /// For ticks of `clocks_per_tick` clocks, as [`super::StepEmitter::clocks_per_tick`] says.
    pub fn new(clocks_per_tick: u32) -> Self {
        Self { clocks: clocks_per_tick, carry: 0 }
    }

    /// The words of the tick with these pulses, which must come from the emitter that this follows tick by tick.
    pub fn words(&mut self, train: &Train) -> Words {
        let mut words = Words::default();
        let pulses = u32::from(train.pulses);
        if pulses == 0 {
            let gap = self.clocks.saturating_sub(self.carry).saturating_sub(PAUSE);
            words.run(train.up, 0, gap);
            self.carry = 0;
            return words;
        }
        let lead = train.first.saturating_add(LAG).saturating_sub(FIRST).saturating_sub(self.carry);
        words.run(train.up, 1, lead);
        let gap = train.gap.saturating_sub(PERIOD);
        let longer = u32::from(train.longer);
        if longer != 0 {
            words.run(train.up, longer, gap.saturating_add(1));
        }
        let rest = pulses.saturating_sub(1).saturating_sub(longer);
        if rest != 0 {
            words.run(train.up, rest, gap);
        }
        self.pause_to_the_end(train, &mut words);
        words
    }

    /// Fills the tick, or remembers by how much it is over.
    fn pause_to_the_end(&mut self, train: &Train, words: &mut Words) {
        let end = train.last().saturating_add(LAG).saturating_add(HIGH);
        let Some(left) = self.clocks.checked_sub(end) else {
            self.carry = end.saturating_sub(self.clocks);
            return;
        };
        words.run(train.up, 0, left.saturating_sub(PAUSE));
        self.carry = PAUSE.saturating_sub(left);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::StepRate;
    use crate::front::StepEmitter;
    use crate::front::emitter::{TICK_CLOCKS, fastest};
    use proptest::prelude::*;

    /// The emitter's program, instruction by instruction, fed with words and asked for what its pins do.
    #[derive(Default)]
    struct Machine {
        clock: u64,
        rises: Vec<(u64, bool)>,
        falls: Vec<u64>,
        direction: Vec<(u64, bool)>,
    }

    impl Machine {
        fn take(&mut self, word: u32) {
            let (up, mut pulses, gap) = (word & 1 == 1, (word >> 1) & 0x7FF, u64::from(word >> 12));
            self.direction.push((self.clock + 1, up));
            self.clock += 3;
            loop {
                // mov, the loop, jmp y--
                self.clock += 1 + (gap + 1) + 1;
                if pulses == 0 {
                    self.clock += 1;
                    return;
                }
                pulses -= 1;
                self.rises.push((self.clock, up));
                self.clock += 32;
                self.falls.push(self.clock);
                if pulses == 0 {
                    return;
                }
                self.clock += 3;
            }
        }
    }

    fn rates() -> impl Strategy<Value = Vec<f64>> {
        proptest::collection::vec(
            prop_oneof![-1.0..=1.0f64, -0.03..0.03f64, Just(1.0), Just(-1.0), Just(0.0)],
            1..60,
        )
    }

    proptest! {
        #[test]
        fn every_pulse_of_every_tick_rises_at_its_clock(
            clocks in prop_oneof![Just(12_500u32), TICK_CLOCKS, Just(1250u32)], rates in rates(),
        ) {
            let (mut emitter, mut runs) = (StepEmitter::new(clocks), Runs::new(clocks));
            let mut machine = Machine::default();
            let mut expected = Vec::new();
            for (tick, part) in rates.iter().enumerate() {
                let train = emitter.begin_tick(StepRate((f64::from(fastest(clocks).0) * part) as i32));
                let start = tick as u64 * u64::from(clocks);
                let gaps = (1..train.pulses).map(|k| u64::from(train.gap) + u64::from(k <= train.longer));
                let mut rise = start + u64::from(train.first + LAG);
                if train.pulses != 0 {
                    expected.push((rise, train.up));
                }
                for gap in gaps {
                    rise += gap;
                    expected.push((rise, train.up));
                }
                let words = runs.words(&train);
                prop_assert!(words.as_slice().iter().all(|word| word >> 12 <= clocks + LAG));
                for &word in words.as_slice() {
                    machine.take(word);
                }
                let end = start + u64::from(clocks);
                prop_assert_eq!(machine.clock, end + u64::from(runs.carry));
            }
            prop_assert_eq!(&machine.rises, &expected);
            direction_is_ready(&machine)?;
        }
    }

    fn direction_is_ready(machine: &Machine) -> Result<(), TestCaseError> {
        let mut level = None;
        for &(changed, up) in &machine.direction {
            if level.replace(up) == Some(up) {
                continue;
            }
            let before = machine.rises.iter().take_while(|rise| rise.0 < changed).last();
            let after = machine.rises.iter().find(|rise| rise.0 >= changed);
            prop_assert!(before.is_none_or(|rise| changed - rise.0 >= 33));
            prop_assert!(after.is_none_or(|rise| rise.0 - changed >= 67), "{:?} {}", after, changed);
        }
        Ok(())
    }
}
