//! A grating's signals, poor ones: offsets, unequal amplitudes, quadrature; its comparators, and its converter.
//!
//! Signals are parts of the amplitude, places 2⁻³² of a period.

use abbe_core::edge::SinCos;
use abbe_core::sense::ellipse::Ellipse;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Paper B's grating.
pub(crate) const PERIOD_UM: f64 = 0.8;
/// Offsets of cosine and sine.
const OFFSETS: [f64; 2] = [0.05, -0.03];
/// Amplitude of the sine.
const GAIN: f64 = 1.08;
/// The sine leads quadrature by so much.
const PHASE_DEG: f64 = 4.0;
/// Amplitude of the cosine, codes, and one step of the converter: 12 bits.
const AMPLITUDE: f64 = 22_000.0;
const STEP: f64 = 16.0;
/// Noise of the samples, rms: the converter is slower than the comparators, and sees less of it.
const SAMPLE_NOISE: f64 = 0.003;
/// Hysteresis of the comparators, to each side.
const HYSTERESIS: f64 = 0.0075;
/// Nothing of the noise is farther out, in its rms: √12.
const FARTHEST: f64 = 3.4642;
/// Places of a period at which the comparators know the signals: 0.2 nm apart.
const PLACES: usize = 4096;
const BITS: u32 = 32 - PLACES.trailing_zeros();
/// From one to the next, 2⁻³² of a period.
pub(crate) const PLACE: i64 = 1 << BITS;

/// The ellipse that these signals draw, codes.
pub(crate) fn ellipse() -> Ellipse {
    Ellipse {
        p: OFFSETS[0] * AMPLITUDE,
        q: OFFSETS[1] * AMPLITUDE,
        r: 1.0 / GAIN,
        alpha: -PHASE_DEG.to_radians(),
        radius: AMPLITUDE,
    }
}

/// The circle for which somebody takes it who knows the amplitude alone.
pub(crate) fn circle() -> Ellipse {
    Ellipse::circle(AMPLITUDE)
}

fn signals(place: i64) -> [f64; 2] {
    let angle = f64::from(place as u32) / 4_294_967_296.0 * TAU;
    [angle.cos() + OFFSETS[0], GAIN * (angle + PHASE_DEG.to_radians()).sin() + OFFSETS[1]]
}

/// Four even numbers together: a bell with rms 1 that ends at [`FARTHEST`].
#[inline]
fn noise(random: &mut Pcg64Mcg) -> f64 {
    let even: u64 = random.random();
    let halves = 0x0000_ffff_0000_ffff;
    let pairs = (even & halves) + (even >> 16 & halves);
    let sum = (pairs as u32).wrapping_add((pairs >> 32) as u32);
    (f64::from(sum) - 131_070.0) / 37_837.2
}

/// What the converter gives at a place.
pub(crate) fn sample(place: i64, random: &mut Pcg64Mcg) -> SinCos {
    let mut code = |signal: f64| {
        let noisy = (signal + SAMPLE_NOISE * noise(random)) * AMPLITUDE / STEP;
        (noisy.round() * STEP).clamp(-32_768.0, 32_752.0) as i16
    };
    let [cos, sin] = signals(place).map(&mut code);
    SinCos { sin, cos }
}

/// Levels of A and B, as bits 0 and 1.
type Levels = usize;

/// Two comparators and the noise at their inputs.
#[derive(Debug)]
pub(crate) struct Comparators {
    noise: f64,
    signals: Vec<[f64; 2]>,
    /// For each place and each levels: how many places away a level may change, to either side.
    quiet: Vec<[u32; 4]>,
}

impl Comparators {
    /// For noise of so much rms.
    pub(crate) fn new(noise: f64) -> Self {
        let middle = |place: usize| place as i64 * PLACE + PLACE / 2;
        let signals: Vec<_> = (0..PLACES).map(|place| signals(middle(place))).collect();
        let mut comparators = Self { noise, signals, quiet: vec![[PLACES as u32; 4]; PLACES] };
        for levels in 0..4 {
            comparators.find_quiet(levels);
        }
        comparators
    }

    fn find_quiet(&mut self, levels: Levels) {
        let mut sweep = |places: &mut dyn Iterator<Item = usize>| {
            let mut since = PLACES as u32;
            for place in places {
                since = if self.may_change(levels, place) { 0 } else { (since + 1).min(PLACES as u32) };
                let quiet = &mut self.quiet[place][levels];
                *quiet = since.min(*quiet);
            }
        };
        // Twice around, so that the first places know what lies before them.
        sweep(&mut (0..2 * PLACES).map(|k| k % PLACES));
        sweep(&mut (0..2 * PLACES).rev().map(|k| k % PLACES));
    }

    fn may_change(&self, levels: Levels, place: usize) -> bool {
        let farthest = self.noise * FARTHEST;
        let reach = |far: f64| self.signals[place].map(|signal| signal + far);
        below(levels, reach(farthest)) != levels || below(levels, reach(-farthest)) != levels
    }

    /// The way from a place on which no level can change, [`PLACE`]s; 0 if one may change now.
    #[inline]
    pub(crate) fn quiet(&self, place: i64, levels: Levels) -> u32 {
        self.quiet[index(place)][levels].saturating_sub(1)
    }

    /// The levels at a place, and at this moment's noise; where one of them may change, the other may not, and both
    /// may have the same.
    #[inline]
    pub(crate) fn compare(&self, place: i64, levels: Levels, random: &mut Pcg64Mcg) -> Levels {
        let noise = self.noise * noise(random);
        below(levels, self.signals[index(place)].map(|signal| signal + noise))
    }

    /// The levels at a place where somebody switches on.
    pub(crate) fn first(&self, place: i64) -> Levels {
        below(0, self.signals[index(place)].map(|signal| signal - HYSTERESIS))
    }
}

#[inline]
fn index(place: i64) -> usize {
    (place as u32 >> BITS) as usize
}

/// A level is high while its signal is below zero; it changes when the signal is beyond by the hysteresis.
#[inline]
fn below(levels: Levels, [x, y]: [f64; 2]) -> Levels {
    let level = |signal: f64, was: bool| signal < if was { HYSTERESIS } else { -HYSTERESIS };
    usize::from(level(x, levels & 1 != 0)) | usize::from(level(y, levels & 2 != 0)) << 1
}
