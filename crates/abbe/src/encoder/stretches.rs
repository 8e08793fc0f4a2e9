//! Harmonics of the phase error, from stretches of the file that went at a constant speed.
//!
//! A stage never keeps its speed to a nanometre over a whole file, but over some ten periods it nearly does. Each stretch
//! is judged beside a straight line of its own ([`Sweep`]) and the stretches are averaged: what a ripple of the speed does
//! to one is another's to undo, unless the ripple repeats with the grating, which no file can tell from an error of the
//! signals. By how much the stretches differ says how well the mean is known. A stretch in which a sample was cut off,
//! weak or missing is left out: its harmonics are those of the fault.

use super::way::Placed;
use abbe_core::sense::harmonics::{HARMONICS, Harmonics, Sweep, SweepError};
use abbe_core::sense::periods::Periods;
use std::fmt;

/// A stretch has as many samples and periods at least.
const SAMPLES: u32 = 512;
const PERIODS: f64 = 10.0;
/// A stretch that still teaches nothing at so many times the samples is given up.
const PATIENCE: u32 = 32;
/// So many stretches tell by their differences how well their mean is known; fewer by what lies beside their lines.
const FEW: u32 = 4;

/// Stretches of a file, learned one after another.
#[derive(Debug, Default)]
pub(crate) struct Stretches {
    sweep: Sweep,
    first: Option<Periods>,
    last: Periods,
    samples: u32,
    /// Stretches with even and with odd numbers.
    halves: [Half; 2],
    /// A sample of this stretch is not to be learned from.
    is_spoilt: bool,
    spoilt: u32,
    good: u32,
    good_samples: u64,
    refused_samples: u64,
    /// Of the longest that taught nothing.
    refused: Option<(u32, SweepError)>,
}

/// Why no stretch has told anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum NoStretch {
    /// The longest that went at no constant speed, or saw too little.
    Refused(SweepError),
    /// Each had samples that were cut off, weak or missing.
    Spoilt(u32),
}

impl fmt::Display for NoStretch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(error) => error.fmt(f),
            Self::Spoilt(1) => f.write_str("the only stretch has samples that are cut off, weak or missing"),
            Self::Spoilt(stretches) => {
                write!(f, "all {stretches} stretches have samples that are cut off, weak or missing")
            }
        }
    }
}

/// Weighted sums of harmonics; the weights are samples.
#[derive(Clone, Copy, Debug, Default)]
struct Half {
    weight: f64,
    sums: [[f64; 2]; HARMONICS],
    /// Σ w², Σ w² x, Σ w² x², the last two over all coefficients.
    squared_weight: f64,
    squared_sums: [[f64; 2]; HARMONICS],
    squares: f64,
    /// Σ w · (what lay beside the line)².
    beside: f64,
}

/// What the stretches agree on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Agreed {
    /// Their mean, turns.
    pub(crate) harmonics: Harmonics,
    /// How well it is known: standard deviation of its curve, turns rms.
    pub(crate) uncertainty: f64,
    /// How many there were.
    pub(crate) stretches: u32,
    /// How many were left out, with samples that were cut off, weak or missing.
    pub(crate) left_out: u32,
    /// The part of the samples that they cover.
    pub(crate) share: f64,
    /// Half of the difference of the two halves of the stretches: what is left when the mean is taken off, seen in
    /// samples of which each has taught half of it.
    pub(crate) left: Option<Harmonics>,
}

impl Stretches {
    /// The position of the next sample; `is_sound` if it was neither cut off nor weak.
    pub(crate) fn add(&mut self, placed: Placed, is_sound: bool) {
        let position = placed.position;
        self.is_spoilt |= !(is_sound && placed.is_whole);
        self.first.get_or_insert(position);
        self.last = position;
        self.sweep.add(position);
        self.samples += 1;
        if self.samples.is_multiple_of(SAMPLES) && self.is_long() {
            self.try_to_learn(self.samples >= PATIENCE * SAMPLES);
        } else if self.samples >= 64 * PATIENCE * SAMPLES {
            // It hardly moves.
            self.try_to_learn(true);
        }
    }

    fn is_long(&self) -> bool {
        let way = Periods(self.last.way_from(self.first.unwrap_or_default()));
        way.turns().abs() >= PERIODS
    }

    /// The rest of the file counts if it is a stretch.
    pub(crate) fn end(&mut self) {
        if self.samples > 0 {
            self.try_to_learn(true);
        }
    }

    fn try_to_learn(&mut self, give_up: bool) {
        match self.sweep.learn() {
            Ok(_) if self.is_spoilt => {
                self.spoilt += 1;
                self.refused_samples += u64::from(self.samples);
            }
            Ok((harmonics, left)) => self.take(&harmonics, left),
            Err(SweepError::Gaps { .. } | SweepError::TooShort { .. }) if !give_up => return,
            Err(error) => {
                self.spoilt += u32::from(self.is_spoilt);
                if self.refused.is_none_or(|(longest, _)| self.samples > longest) {
                    self.refused = Some((self.samples, error));
                }
                self.refused_samples += u64::from(self.samples);
            }
        }
        self.sweep = Sweep::default();
        self.first = None;
        self.samples = 0;
        self.is_spoilt = false;
    }

    fn take(&mut self, harmonics: &Harmonics, left: f64) {
        self.halves[(self.good % 2) as usize].add(harmonics, f64::from(self.samples), left);
        self.good += 1;
        self.good_samples += u64::from(self.samples);
    }

    /// What the stretches agree on, or why there is none.
    pub(crate) fn agreed(&self) -> Result<Agreed, NoStretch> {
        let all = self.halves[0].with(&self.halves[1]);
        let Some(harmonics) = all.mean() else {
            return Err(self.why_none());
        };
        let left = self.halves[0].mean().zip(self.halves[1].mean()).map(|(Harmonics(a), Harmonics(b))| {
            let mut half = a;
            half.as_flattened_mut().iter_mut().zip(b.as_flattened()).for_each(|(a, b)| *a = (*a - b) / 2.0);
            Harmonics(half)
        });
        Ok(Agreed {
            harmonics,
            uncertainty: if self.good < FEW { all.by_noise() } else { all.by_scatter() },
            stretches: self.good,
            left_out: self.spoilt,
            share: self.good_samples as f64 / (self.good_samples + self.refused_samples) as f64,
            left,
        })
    }

    fn why_none(&self) -> NoStretch {
        match self.refused() {
            None if self.spoilt > 0 => NoStretch::Spoilt(self.spoilt),
            refused => NoStretch::Refused(refused.unwrap_or(SweepError::TooShort { periods: 0.0 })),
        }
    }

    /// Why the longest stretch that taught nothing did not.
    pub(crate) fn refused(&self) -> Option<SweepError> {
        self.refused.map(|(_, error)| error)
    }
}

impl Half {
    fn add(&mut self, Harmonics(harmonics): &Harmonics, weight: f64, left: f64) {
        self.weight += weight;
        self.squared_weight += weight * weight;
        self.beside += weight * left * left;
        let sums = self.sums.as_flattened_mut().iter_mut().zip(self.squared_sums.as_flattened_mut());
        for ((sum, squared), value) in sums.zip(harmonics.as_flattened()) {
            *sum += weight * value;
            *squared += weight * weight * value;
            self.squares += weight * weight * value * value;
        }
    }

    fn with(&self, other: &Self) -> Self {
        let mut both = *self;
        both.weight += other.weight;
        both.squared_weight += other.squared_weight;
        both.squares += other.squares;
        both.beside += other.beside;
        for (mine, theirs) in [(&mut both.sums, &other.sums), (&mut both.squared_sums, &other.squared_sums)] {
            let pairs = mine.as_flattened_mut().iter_mut().zip(theirs.as_flattened());
            pairs.for_each(|(mine, theirs)| *mine += theirs);
        }
        both
    }

    fn mean(&self) -> Option<Harmonics> {
        (self.weight > 0.0).then(|| Harmonics(self.sums.map(|pair| pair.map(|sum| sum / self.weight))))
    }

    /// Standard deviation of the mean curve if what lies beside the lines is white: each coefficient has a variance of
    /// 2σ²/n, and half of the sum of all is the curve's.
    fn by_noise(&self) -> f64 {
        let variance = self.beside / self.weight;
        (HARMONICS as f64 * 2.0 * variance / self.weight).sqrt()
    }

    /// The same from how the stretches differ: √(Σ w² (x − x̄)²) / Σ w for each coefficient.
    fn by_scatter(&self) -> f64 {
        let Some(Harmonics(mean)) = self.mean() else { return 0.0 };
        let pairs = mean.as_flattened().iter().zip(self.squared_sums.as_flattened());
        let moved: f64 =
            pairs.map(|(mean, squared)| mean * mean * self.squared_weight - 2.0 * mean * squared).sum();
        ((self.squares + moved).max(0.0) / 2.0).sqrt() / self.weight
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn run(samples: u32, place: impl Fn(f64) -> f64) -> Stretches {
        run_with(samples, place, |_| true)
    }

    fn run_with(samples: u32, place: impl Fn(f64) -> f64, is_sound: impl Fn(u32) -> bool) -> Stretches {
        let mut stretches = Stretches::default();
        (0..samples).for_each(|k| {
            let position = Periods((place(f64::from(k)) * 4_294_967_296.0).round() as i64);
            stretches.add(Placed { position, surprise: None, is_whole: true }, is_sound(k));
        });
        stretches.end();
        stretches
    }

    /// A fourth harmonic of 0.0016 turns on a place.
    fn poor(turns: f64) -> f64 {
        turns + 0.0016 * (4.0 * TAU * turns).sin()
    }

    #[test]
    fn speed_that_changes_over_the_file_is_no_harm() {
        let found = run(40_000, |k| poor(0.0371 * k + 0.8 * (k * 4e-4).sin())).agreed().unwrap();
        assert!(found.stretches > 30 && found.share > 0.99, "{found:?}");
        assert!((found.harmonics.sizes()[3] - 0.0016).abs() < 2e-5, "{found:?}");
        assert!(found.uncertainty < 1e-4 && found.left.unwrap().sizes()[3] < 2e-5, "{found:?}");
    }

    #[test]
    fn a_ripple_of_the_speed_is_said_in_the_uncertainty() {
        let steady = run(40_000, |k| poor(0.0371 * k)).agreed().unwrap();
        let rippled = run(40_000, |k| poor(0.0371 * k + 0.004 * (k * 0.313).sin())).agreed().unwrap();
        assert!(rippled.uncertainty > 3.0 * steady.uncertainty, "{steady:?} {rippled:?}");
        let off = rippled.harmonics.sizes()[3] - 0.0016;
        assert!(off.abs() < 4.0 * rippled.uncertainty, "{rippled:?}");
    }

    /// A tenth of the file with a first harmonic of a hundredth of a turn.
    #[test]
    fn stretches_with_bad_samples_are_left_out_and_counted() {
        let is_sound = |k: u32| !(8000..12_000).contains(&k);
        let place = |k: f64| {
            let turns = 0.0371 * k;
            poor(turns) + if is_sound(k as u32) { 0.0 } else { 0.01 * (TAU * turns).sin() }
        };
        let found = run_with(40_000, place, is_sound).agreed().unwrap();
        assert!((7..11).contains(&found.left_out) && (0.85..0.91).contains(&found.share), "{found:?}");
        assert!(found.harmonics.sizes()[0] < 1e-6, "{found:?}");
        assert!(run(40_000, place).agreed().unwrap().harmonics.sizes()[0] > 5e-4);
        let none = run_with(4000, place, |k| k % 100 != 0).agreed();
        assert!(matches!(none, Err(NoStretch::Spoilt(5..))), "{none:?}");
    }

    #[test]
    fn what_teaches_nothing_says_why() {
        assert!(matches!(
            run(3000, |k| 0.0001 * k).agreed(),
            Err(NoStretch::Refused(SweepError::TooShort { .. }))
        ));
        assert!(matches!(
            run(3000, |k| 0.125 * k).agreed(),
            Err(NoStretch::Refused(SweepError::Gaps { .. }))
        ));
        let shaken = run(20_000, |k| 0.0371 * k + 0.3 * (k * 0.05).sin());
        assert!(
            matches!(shaken.agreed(), Err(NoStretch::Refused(SweepError::NotConstant { .. }))),
            "{:?}",
            shaken.agreed()
        );
        assert!(Stretches::default().agreed().is_err());
    }
}
