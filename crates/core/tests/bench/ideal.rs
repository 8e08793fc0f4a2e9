//! A plant so simple that it hides nothing.

use abbe_core::edge::{Actuation, AxisInputs, Inputs, Outputs};
use abbe_core::front::StepEmitter;

const STEP_PM: i64 = 312_500;
const COUNT_PM: i64 = 100_000;
/// A tick of 0.1 ms at 125 MHz.
const TICK_CLOCKS: u32 = 12_500;
/// The ideal slide starts so far above the reference mark.
const START_PM: i64 = 5_000_000_000;
const SWITCH_PM: i64 = -2_000_000_000;

/// Slides that follow their pulses exactly.
pub(crate) struct Ideal<const N: usize = 2> {
    tick: u32,
    emitters: [StepEmitter; N],
    counts: [i64; N],
    /// What the encoder reads too much, picometres.
    pub(crate) offset_pm: i64,
}

impl<const N: usize> Ideal<N> {
    pub(crate) fn new() -> Self {
        Self {
            tick: 0,
            emitters: [StepEmitter::new(TICK_CLOCKS); N],
            counts: [START_PM / COUNT_PM; N],
            offset_pm: 0,
        }
    }

    pub(crate) fn step(&mut self, outputs: &Outputs<N>) -> Inputs<N> {
        self.tick = self.tick.wrapping_add(1);
        let mut inputs = Inputs::at_rest(self.tick);
        for axis in 0..N {
            if let Actuation::Steps(rate) = outputs.axes[axis].actuation {
                self.emitters[axis].begin_tick(rate);
            }
            let pulses = self.emitters[axis].pulses_at(TICK_CLOCKS);
            let place = START_PM + i64::from(pulses) * STEP_PM + self.offset_pm;
            let before = self.counts[axis];
            let now = place.div_euclid(COUNT_PM);
            self.counts[axis] = now;
            inputs.axes[axis] = AxisInputs {
                counter: now as u32,
                index: (before < 0 && now >= 0).then_some(0),
                pulses,
                limit_low: place < SWITCH_PM,
                ..AxisInputs::default()
            };
        }
        inputs
    }
}
