//! The step emitter: a rate per tick becomes evenly spaced, counted pulses, each at a whole clock.
//!
//! All of it is a function of clocks, so that hardware can repeat it exactly: [`super::Runs`] writes the same
//! pulses as words for the emitter on the board.

use super::CLOCK_HZ;
use crate::edge::StepRate;

/// Clocks from one pulse to the next at the fastest rate.
pub const SHORTEST_PERIOD: u32 = 64;
/// Clocks between two pulses that make up for a late first one after a change of direction; never closer.
pub const CLOSEST: u32 = 48;
/// The first pulse of another direction comes no sooner than this many clocks after its tick began: the power stage
/// must have seen the direction first. 0.8 µs at 125 MHz.
pub const DIRECTION_SETUP: u32 = 100;
/// Clocks that a tick may have: 100 kHz … 1 kHz at 125 MHz.
pub const TICK_CLOCKS: core::ops::RangeInclusive<u32> = 1250..=125_000;

/// One pulse of phase.
const PULSE: u32 = 1 << 16;

/// Clocks in a tick at `tick_hz`, to the nearest in [`TICK_CLOCKS`]; any number is accepted.
pub fn clocks_per_tick(tick_hz: f64) -> u32 {
    within_ticks(libm::round(f64::from(CLOCK_HZ) / tick_hz) as u32)
}

/// The fastest rate: one pulse each [`SHORTEST_PERIOD`] clocks.
pub const fn fastest(clocks_per_tick: u32) -> StepRate {
    StepRate((clocks_per_tick / SHORTEST_PERIOD).saturating_mul(PULSE) as i32)
}

fn within_ticks(clocks: u32) -> u32 {
    clocks.max(*TICK_CLOCKS.start()).min(*TICK_CLOCKS.end())
}

/// The pulses of one tick.
///
/// The first comes `first` clocks after the tick began, 1 ≤ `first` ≤ clocks of the tick; then follow `longer` gaps of
/// `gap + 1` clocks, then gaps of `gap`. The last comes within the tick too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Train {
    /// Direction; in a tick without pulses that of the last one.
    pub up: bool,
    /// How many, at most clocks of the tick / [`SHORTEST_PERIOD`] + 1.
    pub pulses: u16,
    /// Clock of the first.
    pub first: u32,
    /// Clocks of a short gap; 0 with less than two pulses.
    pub gap: u32,
    /// How many gaps are one clock longer.
    pub longer: u16,
}

impl Train {
    /// Pulses until `clock`, a pulse at `clock` counted.
    pub fn pulses_until(&self, clock: u32) -> u16 {
        let Some(since) = clock.checked_sub(self.first) else { return 0 };
        let long = self.gap.saturating_add(1);
        let change = times(u32::from(self.longer), long);
        let gaps = match since.checked_sub(change) {
            None => since.checked_div(long).unwrap_or(0),
            // Without a second pulse there is no gap, and the first is the last.
            Some(rest) => rest.checked_div(self.gap).unwrap_or(0).saturating_add(u32::from(self.longer)),
        };
        u32::from(self.pulses).min(gaps.saturating_add(1)) as u16
    }

    /// Clock of the last pulse, 0 without one.
    pub fn last(&self) -> u32 {
        let gaps = u32::from(self.pulses.saturating_sub(1));
        let way = times(self.gap, gaps).saturating_add(u32::from(self.longer));
        self.first.saturating_add(way)
    }

    /// All pulses, negative downwards.
    fn signed(&self) -> i32 {
        toward(self.up, self.pulses)
    }
}

fn toward(up: bool, pulses: u16) -> i32 {
    let pulses = i32::from(pulses);
    if up { pulses } else { pulses.saturating_neg() }
}

/// A phase accumulator: a pulse leaves whenever the phase passes a whole number.
///
/// Inside a tick the rate is constant; the remainder stays in the phase, so that over any number of ticks no pulse is
/// lost or added (`emits_exactly_what_was_asked`). The first and the last pulse of a tick leave at the very clock at
/// which the phase passes. All gaps between them differ by at most one clock, which moves a pulse at most
/// `pulses / 4 + 1` clocks from where the phase passes (`no_pulse_is_far_from_its_ideal_clock`).
///
/// After a change of direction the first pulse waits for [`DIRECTION_SETUP`] and those behind it close up, if they
/// must; all stay in their tick.
#[derive(Clone, Copy, Debug)]
pub struct StepEmitter {
    /// Clocks in a tick.
    clocks: u32,
    /// Phase at the end of the running tick, 16 fractional bits, 0 ≤ phase < 1 pulse.
    phase: u32,
    /// Pulses emitted before the running tick; wraps.
    pulses: i32,
    running: Train,
    /// Direction of the last pulse, if there was one.
    heading: Option<bool>,
}

impl StepEmitter {
    /// An emitter at rest whose ticks have `clocks_per_tick` clocks; what lies outside [`TICK_CLOCKS`] is brought to
    /// its nearer end.
    pub fn new(clocks_per_tick: u32) -> Self {
        Self {
            clocks: within_ticks(clocks_per_tick),
            phase: 0,
            pulses: 0,
            running: Train { up: true, ..Train::default() },
            heading: None,
        }
    }

    /// Clocks in a tick.
    pub fn clocks_per_tick(&self) -> u32 {
        self.clocks
    }

    /// Ends the running tick and starts the next one at `rate`; returns its pulses.
    ///
    /// A rate beyond [`fastest`] is limited to it. No stage asks for one: [`crate::design`] refuses it.
    pub fn begin_tick(&mut self, rate: StepRate) -> Train {
        self.pulses = self.pulses.wrapping_add(self.running.signed());
        let size = rate.0.unsigned_abs().min(fastest(self.clocks).0.unsigned_abs());
        let train = match rate.0 {
            0 => Train::default(),
            1.. => self.upwards(size),
            _ => self.downwards(size),
        };
        self.running = self.after_setup(train);
        self.running
    }

    /// Pulses emitted so far, `clock` clocks into the running tick; wraps. Exactly what its [`Train`] says.
    pub fn pulses_at(&self, clock: u32) -> i32 {
        self.pulses.wrapping_add(toward(self.running.up, self.running.pulses_until(clock)))
    }

    /// The k-th pulse leaves at ⌈(k − phase) clocks / rate⌉.
    fn upwards(&mut self, rate: u32) -> Train {
        let end = self.phase.saturating_add(rate);
        let to_next = PULSE.saturating_sub(self.phase);
        self.phase = end % PULSE;
        if end < PULSE {
            return Train::default();
        }
        let first = self.share(to_next, rate).up();
        // The last leaves as long before the end as its remainder takes.
        let last = self.clocks.saturating_sub(self.share(self.phase, rate).down());
        train(true, end / PULSE, first, last)
    }

    /// The k-th pulse leaves when the phase is first below −(k − 1), at ⌊(phase + k − 1) clocks / rate⌋ + 1.
    fn downwards(&mut self, rate: u32) -> Train {
        let before = self.phase;
        // Pulses round up: the phase must not stay negative.
        let pulses = rate.saturating_sub(before).saturating_add(PULSE.saturating_sub(1)) / PULSE;
        self.phase = before.saturating_add(times(pulses, PULSE)).saturating_sub(rate);
        if pulses == 0 {
            return Train::default();
        }
        let first = self.share(before, rate).down().saturating_add(1);
        let since = self.share(PULSE.saturating_sub(self.phase), rate).up();
        let last = self.clocks.saturating_sub(since).saturating_add(1);
        train(false, pulses, first, last)
    }

    /// The same pulses, late enough for the power stage to have seen their direction, which changes for a pulse only.
    fn after_setup(&mut self, train: Train) -> Train {
        if train.pulses == 0 {
            return Train { up: self.running.up, ..Train::default() };
        }
        if self.heading.replace(train.up) == Some(train.up) {
            return train;
        }
        let first = train.first.max(DIRECTION_SETUP);
        let closest = times(u32::from(train.pulses.saturating_sub(1)), CLOSEST);
        let last = train.last().max(first.saturating_add(closest));
        spread(Train { first, ..train }, last)
    }

    /// Clocks in which the phase changes by `part` ≤ 2¹⁶, at `rate` ≥ `part`.
    ///
    /// `part` · clocks has 33 bits. Half of the clocks fit, and what that division leaves is made up for: the Cortex-M0+
    /// has no 64-bit division.
    fn share(&self, part: u32, rate: u32) -> Share {
        let half = times(part, self.clocks / 2);
        let quotient = half.checked_div(rate).unwrap_or(0);
        let rest = half.saturating_sub(times(quotient, rate));
        let mut share = Share {
            clocks: times(quotient, 2),
            // Below 3 · rate.
            rest: times(rest, 2).saturating_add(times(part, self.clocks % 2)),
        };
        for _ in 0..2 {
            if share.rest >= rate {
                share.rest = share.rest.saturating_sub(rate);
                share.clocks = share.clocks.saturating_add(1);
            }
        }
        share
    }
}

/// A product that fits: of pulses and gaps of one tick, or of a phase and half of its clocks, below 2¹⁶ · 2¹⁶. A
/// saturating one would be a call for a product of 64 bits on the Cortex-M0+.
fn times(a: u32, b: u32) -> u32 {
    a.wrapping_mul(b)
}

/// Whole clocks and what is left of one.
#[derive(Clone, Copy)]
struct Share {
    clocks: u32,
    rest: u32,
}

impl Share {
    fn down(self) -> u32 {
        self.clocks
    }

    fn up(self) -> u32 {
        self.clocks.saturating_add(u32::from(self.rest != 0))
    }
}

fn train(up: bool, pulses: u32, first: u32, last: u32) -> Train {
    spread(Train { up, pulses: pulses as u16, first, gap: 0, longer: 0 }, last)
}

/// Spreads the pulses of a train evenly up to `last`; the longer gaps come first.
fn spread(train: Train, last: u32) -> Train {
    let gaps = u32::from(train.pulses).saturating_sub(1);
    let way = last.saturating_sub(train.first);
    let gap = way.checked_div(gaps).unwrap_or(0);
    let longer = if gaps == 0 { 0 } else { way.saturating_sub(times(gap, gaps)) };
    Train { gap, longer: longer as u16, ..train }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The clock at which the phase passes for the k-th time, by the definition and in wide integers.
    fn ideal(phase: i128, rate: i128, clocks: i128, k: i128) -> i128 {
        if rate > 0 {
            ((k * 65_536 - phase) * clocks + rate - 1).div_euclid(rate)
        } else {
            ((phase + (k - 1) * 65_536) * clocks).div_euclid(-rate) + 1
        }
    }

    fn clocks_of(train: &Train) -> Vec<u32> {
        let gaps = (1..train.pulses).map(|k| train.gap + u32::from(k <= train.longer));
        let mut clock = train.first;
        let rest = gaps.map(|gap| {
            clock += gap;
            clock
        });
        [train.first].into_iter().chain(rest).take(usize::from(train.pulses)).collect()
    }

    fn any_clocks() -> impl Strategy<Value = u32> {
        prop_oneof![Just(12_500u32), TICK_CLOCKS, Just(1250u32), Just(125_000u32)]
    }

    /// Rates of all sizes, as parts of the fastest, and small ones.
    fn any_rate() -> impl Strategy<Value = (i8, f64)> {
        (prop_oneof![Just(-1i8), Just(1), Just(0)], prop_oneof![0.0..1.0f64, 0.0..0.02, 0.0..0.0001])
    }

    fn rate_of((sign, part): (i8, f64), clocks: u32) -> i32 {
        i32::from(sign) * (f64::from(fastest(clocks).0) * part) as i32
    }

    proptest! {
        #[test]
        fn emits_exactly_what_was_asked(
            clocks in any_clocks(),
            rates in proptest::collection::vec(any_rate(), 1..300),
        ) {
            let mut emitter = StepEmitter::new(clocks);
            let mut asked = 0i64;
            for rate in rates {
                let rate = rate_of(rate, clocks);
                let before = emitter.pulses_at(clocks);
                emitter.begin_tick(StepRate(rate));
                prop_assert_eq!(emitter.pulses_at(0), before);
                asked += i64::from(rate);
                prop_assert_eq!(i64::from(emitter.pulses_at(clocks)), asked >> 16);
            }
        }

        #[test]
        fn no_pulse_is_far_from_its_ideal_clock(
            clocks in any_clocks(),
            rates in proptest::collection::vec(any_rate(), 1..40),
        ) {
            let mut emitter = StepEmitter::new(clocks);
            let mut heading = None;
            for rate in rates {
                let rate = rate_of(rate, clocks);
                let phase = i128::from(emitter.phase);
                let train = emitter.begin_tick(StepRate(rate));
                let times = clocks_of(&train);
                let ideals: Vec<i128> = (1..=times.len())
                    .map(|k| ideal(phase, i128::from(rate), i128::from(clocks), k as i128)).collect();
                let turned = !times.is_empty() && heading.replace(train.up) != Some(train.up);
                prop_assert!(times.iter().all(|time| (1..=clocks).contains(time)), "{:?}", train);
                prop_assert_eq!(times.last().copied().unwrap_or(0), train.last());
                if turned {
                    prop_assert!(train.first >= DIRECTION_SETUP);
                    let closest = times.windows(2).map(|pair| pair[1] - pair[0]).min();
                    prop_assert!(closest.is_none_or(|closest| closest >= CLOSEST));
                } else if let (Some(first), Some(last)) = (ideals.first(), ideals.last()) {
                    prop_assert_eq!(i128::from(train.first), *first);
                    prop_assert_eq!(i128::from(train.last()), *last);
                }
                let late = if turned { i128::from(DIRECTION_SETUP) } else { 0 };
                let bound = i128::from(train.pulses) / 4 + 1;
                for (time, ideal) in times.iter().zip(ideals) {
                    let off = i128::from(*time) - ideal;
                    prop_assert!((-bound..=bound + late).contains(&off), "{} {:?}", off, train);
                }
            }
        }

        #[test]
        fn counts_at_a_clock_what_the_train_says(
            clocks in any_clocks(), rates in proptest::collection::vec(any_rate(), 1..5), at in 0.0..1.0f64,
        ) {
            let mut emitter = StepEmitter::new(clocks);
            for rate in rates {
                let before = emitter.pulses_at(clocks);
                let train = emitter.begin_tick(StepRate(rate_of(rate, clocks)));
                let times = clocks_of(&train);
                let around = times.iter().flat_map(|&time| [time - 1, time]);
                for clock in around.chain([0, clocks, (f64::from(clocks) * at) as u32]) {
                    let passed = times.iter().filter(|&&time| time <= clock).count() as i32;
                    let counted = emitter.pulses_at(clock) - before;
                    prop_assert_eq!(counted, if train.up { passed } else { -passed });
                }
            }
        }

        #[test]
        fn pulses_of_neighbouring_ticks_never_come_closer_than_the_closest(
            clocks in any_clocks(), rates in proptest::collection::vec(any_rate(), 2..60),
        ) {
            let mut emitter = StepEmitter::new(clocks);
            let (mut start, mut last) = (0u64, None);
            for rate in rates {
                for time in clocks_of(&emitter.begin_tick(StepRate(rate_of(rate, clocks)))) {
                    let now = start + u64::from(time);
                    if let Some(last) = last.replace(now) {
                        prop_assert!(now - last >= u64::from(CLOSEST), "{}", now - last);
                    }
                }
                start += u64::from(clocks);
            }
        }
    }

    #[test]
    fn a_rate_that_no_hardware_can_follow_is_limited() {
        let mut emitter = StepEmitter::new(12_500);
        let train = emitter.begin_tick(StepRate(i32::MIN));
        assert_eq!((train.up, train.pulses), (false, 195));
        let train = emitter.begin_tick(StepRate(i32::MAX));
        assert_eq!((train.up, train.pulses), (true, 195));
    }

    #[test]
    fn clocks_of_a_tick_follow_from_its_rate() {
        assert_eq!(clocks_per_tick(10_000.0), 12_500);
        assert_eq!(clocks_per_tick(30_000.0), 4167);
        assert_eq!(clocks_per_tick(f64::NAN), 1250);
        assert_eq!(clocks_per_tick(1.0), 125_000);
    }
}
