//! The step emitter: a rate per tick becomes evenly spaced, counted pulses.

use crate::edge::StepRate;

/// One pulse, in 16 fractional bits.
const PULSE: i64 = 1 << 16;

/// A phase accumulator: a pulse leaves whenever the phase passes a whole number.
///
/// Inside a tick the rate is constant, so that pulses are evenly spaced; the remainder stays in the phase, so that
/// over any number of ticks no pulse is lost or added (`emits_exactly_what_was_asked`).
#[derive(Clone, Copy, Debug, Default)]
pub struct StepEmitter {
    rate: StepRate,
    /// Phase at the start of the tick, 16 fractional bits, 0 ≤ phase < 1 pulse.
    phase: i64,
    /// Pulses emitted before the start of the tick; wraps.
    pulses: i32,
}

impl StepEmitter {
    /// Ends the running tick and starts the next one at `rate`.
    pub fn begin_tick(&mut self, rate: StepRate) {
        let end = self.phase.wrapping_add(i64::from(self.rate.0));
        self.pulses = self.pulses.wrapping_add((end >> 16) as i32);
        self.phase = end & (PULSE.wrapping_sub(1));
        self.rate = rate;
    }

    /// Pulses emitted so far, `fraction`/2¹⁶ into the running tick; wraps.
    pub fn pulses_at(&self, fraction: u32) -> i32 {
        let within = (i64::from(self.rate.0).wrapping_mul(i64::from(fraction.min(1 << 16)))) >> 16;
        self.pulses.wrapping_add((self.phase.wrapping_add(within) >> 16) as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn emits_exactly_what_was_asked(rates in proptest::collection::vec(-500_000i32..500_000, 1..300)) {
            let mut emitter = StepEmitter::default();
            let mut asked = 0i64;
            for rate in rates {
                emitter.begin_tick(StepRate(rate));
                asked += i64::from(rate);
                prop_assert_eq!(i64::from(emitter.pulses_at(1 << 16)), asked >> 16);
            }
        }

        #[test]
        fn pulses_in_a_tick_are_evenly_spaced(rate in 65_536i32..2_000_000, phase in 0i32..65_536) {
            let mut emitter = StepEmitter::default();
            emitter.begin_tick(StepRate(phase));
            emitter.begin_tick(StepRate(rate));
            let times: Vec<u32> = (1..=1u32 << 16)
                .filter(|&f| emitter.pulses_at(f) != emitter.pulses_at(f - 1))
                .collect();
            let gaps: Vec<u32> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let (shortest, longest) = (gaps.iter().min(), gaps.iter().max());
            if let (Some(shortest), Some(longest)) = (shortest, longest) {
                prop_assert!(longest - shortest <= 1, "{} {}", shortest, longest);
            }
        }
    }
}
