//! Harmonics of the phase error, from the stretches of the file that went smoothly.
//!
//! A servo never keeps its speed to a nanometre, but its wander is slow against the fringes: beside a cubic of some 128
//! samples the phase shows its own error ([`Stretch`]). The stretches are summed up in [`GROUPS`]; by how much the mean moves
//! when one group is left out says how well it is known (the jackknife). What no file can tell from an error of the
//! signals is a motion that repeats with the grating, and a servo makes one while it can follow its own encoder: a floor for
//! the speed keeps such stretches out. A stretch in which a sample was cut off, weak or missing is left out: its harmonics
//! are those of the fault.

use super::way::Placed;
use abbe_core::sense::harmonics::{HARMONICS, Harmonics, Lesson, Stretch, SweepError};
use std::fmt;

/// Stretches are dealt out to so many groups; those with even and with odd numbers are the two halves.
const GROUPS: usize = 16;
/// So many groups tell by their differences how well their mean is known; fewer by what lies beside the motion.
const FEW: usize = 4;
/// The speeds at which a servo does not follow, times its bandwidth, periods a second: below it, what a servo of first
/// order adds to an error is more than a tenth of it.
pub(crate) const BEYOND_SERVO: f64 = 10.0;

/// Stretches of a file, learned one after another.
#[derive(Debug)]
pub(crate) struct Stretches {
    stretch: Stretch,
    groups: Vec<Lesson>,
    /// Slowest motion that is learned from, periods a sample.
    floor: f64,
    /// A sample of this stretch is not to be learned from.
    is_spoilt: bool,
    spoilt: u32,
    /// Stretches that went too slowly for the floor, and the speed of the last, periods a sample.
    slow: Option<f64>,
    good: u32,
    good_samples: u64,
    refused_samples: u64,
    /// Of the longest that taught nothing.
    refused: Option<(u32, SweepError)>,
}

/// Why no stretch has told anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum NoStretch {
    /// The longest that did not go smoothly, or saw too little.
    Refused(SweepError),
    /// Each had samples that were cut off, weak or missing.
    Spoilt(u32),
    /// All went so slowly that the servo follows its encoder: the speed of the last and the floor, periods a sample.
    Followed { speed: f64, floor: f64 },
}

impl fmt::Display for NoStretch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(error) => error.fmt(f),
            Self::Spoilt(1) => f.write_str("the only stretch has samples that are cut off, weak or missing"),
            Self::Spoilt(stretches) => {
                write!(f, "all {stretches} stretches have samples that are cut off, weak or missing")
            }
            Self::Followed { speed, floor } => write!(
                f,
                "at {speed:.4} periods a sample the servo follows the error of its own encoder; at least {floor:.4} are needed ({BEYOND_SERVO:.0} times --servo-hz)"
            ),
        }
    }
}

impl NoStretch {
    /// What to do.
    pub(crate) fn instead(&self) -> &'static str {
        match self {
            Self::Refused(SweepError::TooSlow { .. }) | Self::Followed { .. } => "take a faster sweep",
            Self::Refused(SweepError::TooShort { .. }) => "take a longer sweep",
            Self::Refused(SweepError::Gaps { .. }) => "take a sweep at another speed",
            Self::Refused(_) => "take a sweep at constant speed",
            Self::Spoilt(_) => "mend the signals first",
        }
    }
}

/// What the stretches agree on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Agreed {
    /// What fits them best, turns.
    pub(crate) harmonics: Harmonics,
    /// How well it is known: standard deviation of its curve, turns rms.
    pub(crate) uncertainty: f64,
    /// How many there were.
    pub(crate) stretches: u32,
    /// How many were left out, with samples that were cut off, weak or missing.
    pub(crate) left_out: u32,
    /// The part of the samples that they cover.
    pub(crate) share: f64,
    /// Their mean speed, periods a sample.
    pub(crate) speed: f64,
    /// Half of the difference of the two halves of the stretches: what is left when the mean is taken off, seen in
    /// samples of which each has taught half of it.
    pub(crate) left: Option<Harmonics>,
}

impl Stretches {
    /// Learns from stretches of at least `floor` periods a sample.
    pub(crate) fn faster_than(floor: f64) -> Self {
        Self {
            stretch: Stretch::default(),
            groups: vec![Lesson::default(); GROUPS],
            floor,
            is_spoilt: false,
            spoilt: 0,
            slow: None,
            good: 0,
            good_samples: 0,
            refused_samples: 0,
            refused: None,
        }
    }

    /// The position of the next sample; `is_sound` if it was neither cut off nor weak.
    pub(crate) fn add(&mut self, placed: Placed, is_sound: bool) {
        self.is_spoilt |= !(is_sound && placed.is_whole);
        self.stretch.add(placed.position);
        if self.stretch.has_ended() {
            self.take();
        }
    }

    /// The rest of the file is no stretch, and tells only why there is none.
    pub(crate) fn end(&mut self) {
        if self.good == 0 && self.why_not().is_none() && self.stretch.samples() > 0 {
            self.take();
        }
    }

    fn take(&mut self) {
        let stretch = std::mem::take(&mut self.stretch);
        let samples = stretch.samples();
        let is_spoilt = std::mem::take(&mut self.is_spoilt);
        if is_spoilt {
            self.spoilt += 1;
        } else if stretch.speed() < self.floor {
            self.slow = Some(stretch.speed());
        } else {
            match self.groups[self.good as usize % GROUPS].take(&stretch) {
                Ok(()) => {
                    self.good += 1;
                    self.good_samples += u64::from(samples);
                    return;
                }
                Err(error) if self.refused.is_none_or(|(longest, _)| samples > longest) => {
                    self.refused = Some((samples, error));
                }
                Err(_) => {}
            }
        }
        self.refused_samples += u64::from(samples);
    }

    /// What the stretches agree on, or why there is nothing.
    pub(crate) fn agreed(&self) -> Result<Agreed, NoStretch> {
        if self.good == 0 {
            return Err(self.why_none());
        }
        let all = self.sum(|_| true);
        let (harmonics, beside) = all.learn().map_err(NoStretch::Refused)?;
        let half = |odd: usize| self.sum(|group| group % 2 == odd).learn().ok();
        let left = half(0).zip(half(1)).map(|((even, _), (odd, _))| half_of_difference(&even, &odd));
        let scatter = self.scatter(&harmonics);
        Ok(Agreed {
            harmonics,
            uncertainty: scatter.unwrap_or_else(|| by_noise(beside, all.samples())),
            stretches: self.good,
            left_out: self.spoilt,
            share: self.good_samples as f64 / (self.good_samples + self.refused_samples) as f64,
            speed: all.periods() / f64::from(all.samples()),
            left,
        })
    }

    fn sum(&self, counts: impl Fn(usize) -> bool) -> Lesson {
        let groups = self.groups.iter().enumerate().filter(|(group, _)| counts(*group));
        groups.fold(Lesson::default(), |sum, (_, group)| sum.with(group))
    }

    /// Standard deviation of the curve, turns rms: √((n − 1)/n Σ (x without one group − x)²) for each coefficient.
    fn scatter(&self, Harmonics(all): &Harmonics) -> Option<f64> {
        let groups = self.groups.iter().filter(|group| group.stretches() > 0).count();
        if groups < FEW {
            return None;
        }
        let mut squares = 0.0;
        for left_out in 0..groups {
            let (Harmonics(without), _) = self.sum(|group| group != left_out).learn().ok()?;
            let pairs = all.as_flattened().iter().zip(without.as_flattened());
            squares += pairs.map(|(all, without)| (all - without).powi(2)).sum::<f64>();
        }
        // A cosine and a sine of equal size have half of their squares as the mean square of the curve.
        Some((squares / 2.0 * (groups - 1) as f64 / groups as f64).sqrt())
    }

    fn why_none(&self) -> NoStretch {
        self.why_not().unwrap_or(NoStretch::Refused(SweepError::TooShort { periods: 0.0 }))
    }

    /// Why stretches taught nothing, if some did not: the longest that was refused, before those that were too slow or
    /// spoilt.
    pub(crate) fn why_not(&self) -> Option<NoStretch> {
        let refused = self.refused.map(|(_, error)| NoStretch::Refused(error));
        let slow = self.slow.map(|speed| NoStretch::Followed { speed, floor: self.floor });
        refused.or(slow).or((self.spoilt > 0).then_some(NoStretch::Spoilt(self.spoilt)))
    }
}

/// Standard deviation of the curve if what lies beside the motion is white: each coefficient has a variance of 2σ²/n, and
/// half of the sum of all is the curve's.
fn by_noise(beside: f64, samples: u32) -> f64 {
    beside * (HARMONICS as f64 * 2.0 / f64::from(samples)).sqrt()
}

fn half_of_difference(Harmonics(even): &Harmonics, Harmonics(odd): &Harmonics) -> Harmonics {
    let mut half = *even;
    half.as_flattened_mut().iter_mut().zip(odd.as_flattened()).for_each(|(a, b)| *a = (*a - b) / 2.0);
    Harmonics(half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use abbe_core::sense::periods::Periods;
    use std::f64::consts::TAU;

    fn run(samples: u32, place: impl Fn(f64) -> f64) -> Stretches {
        run_with(samples, place, |_| true)
    }

    fn run_with(samples: u32, place: impl Fn(f64) -> f64, is_sound: impl Fn(u32) -> bool) -> Stretches {
        run_faster_than(0.0, samples, place, is_sound)
    }

    fn run_faster_than(
        floor: f64,
        samples: u32,
        place: impl Fn(f64) -> f64,
        is_sound: impl Fn(u32) -> bool,
    ) -> Stretches {
        let mut stretches = Stretches::faster_than(floor);
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
        assert!((31..34).contains(&found.left_out) && (0.85..0.91).contains(&found.share), "{found:?}");
        assert!(found.harmonics.sizes()[0] < 1e-6, "{found:?}");
        assert!(run(40_000, place).agreed().unwrap().harmonics.sizes()[0] > 5e-4);
        let none = run_with(4000, place, |k| k % 100 != 0).agreed();
        assert!(matches!(none, Err(NoStretch::Spoilt(5..))), "{none:?}");
    }

    #[test]
    fn what_teaches_nothing_says_why() {
        assert!(matches!(
            run(3000, |k| 0.0001 * k).agreed(),
            Err(NoStretch::Refused(SweepError::TooSlow { .. }))
        ));
        assert!(matches!(
            run(3000, |k| 0.125 * k).agreed(),
            Err(NoStretch::Refused(SweepError::Gaps { .. }))
        ));
        let shaken = run(20_000, |k| 0.0371 * k + 0.12 * (k * 0.4).sin());
        assert!(
            matches!(shaken.agreed(), Err(NoStretch::Refused(SweepError::NotSmooth { .. }))),
            "{:?}",
            shaken.agreed()
        );
        let short = run(140, |k| 0.0371 * k).agreed();
        assert!(matches!(short, Err(NoStretch::Refused(SweepError::TooShort { .. }))), "{short:?}");
        assert!(Stretches::faster_than(0.0).agreed().is_err());
    }

    /// A servo with a third of the periods' rate as its bandwidth would follow; one with a twentieth does not.
    #[test]
    fn what_a_servo_follows_is_not_learned_from() {
        let learned = |servo: f64| {
            run_faster_than(BEYOND_SERVO * servo, 20_000, |k| poor(0.0371 * k), |_| true).agreed()
        };
        assert!(learned(0.0371 / 20.0).unwrap().share > 0.99);
        let followed = learned(0.0371 / 3.0);
        assert!(matches!(followed, Err(NoStretch::Followed { .. })), "{followed:?}");
    }
}
