//! Where to measure: evenly spaced targets, and the targets with a random part that ISO 230-2 asks for.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Part of a period inside which a target may lie at random.
const RANDOM_PART: f64 = 0.3;

/// The outer part of that span which is left free, so that no target falls on an end of the range.
const END_MARGIN: f64 = 0.1;

/// Targets are whole tenths of a micrometre: exact in every file, and never finer than a count.
const PLACES_PER_MM: f64 = 1e4;

/// More targets than any run could visit: a mistake of unit.
const MOST_TARGETS: usize = 100_000;

/// Why no targets were made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TargetsError {
    /// The range must have a length.
    #[error("the range {low_mm} to {high_mm} mm is empty, inverted or not finite")]
    Range {
        /// Lower end given.
        low_mm: f64,
        /// Upper end given.
        high_mm: f64,
    },
    /// The step must fit into the range at least once.
    #[error("a step of {step_mm} mm does not fit into a range of {length_mm} mm")]
    Step {
        /// Step given.
        step_mm: f64,
        /// Length of the range.
        length_mm: f64,
    },
    /// Fewer than two, more than 100 000, or so many that two would coincide.
    #[error("{count} targets in {length_mm} mm, expected at least 2 and at most one a micrometre")]
    Count {
        /// Number asked for.
        count: usize,
        /// Length of the range.
        length_mm: f64,
    },
}

/// `low`, `low + step`, … up to and including `high` if a step falls on it. mm, ascending.
///
/// # Errors
/// [`TargetsError`] for a range without length or a step that does not fit into it.
pub fn even(low_mm: f64, high_mm: f64, step_mm: f64) -> Result<Vec<f64>, TargetsError> {
    let length_mm = length(low_mm, high_mm)?;
    if !(step_mm > 0.0 && step_mm <= length_mm) {
        return Err(TargetsError::Step { step_mm, length_mm });
    }
    // A thousandth of a step forgives the rounding of 0.1 + 0.2 + …, never a whole target.
    let steps = (length_mm / step_mm + 1e-3).floor();
    if steps >= MOST_TARGETS as f64 {
        return Err(TargetsError::Step { step_mm, length_mm });
    }
    Ok((0..=steps as usize).map(|i| (low_mm + i as f64 * step_mm).min(high_mm)).collect())
}

/// ISO 230-2 targets `P_i = (i − 1) p + r`: `count` periods `p` over the range, `r` random and drawn anew for each
/// target. mm, ascending, inside the range and never on an end of it.
///
/// Fixed targets alias an error that repeats with the screw or the grating; random ones show it. `r` spans three
/// tenths of a period, so the first and the last target stay near the ends. The same seed gives the same targets.
///
/// # Errors
/// [`TargetsError`] for a range without length, fewer than two targets, or more than one a micrometre.
pub fn iso230(low_mm: f64, high_mm: f64, count: usize, seed: u64) -> Result<Vec<f64>, TargetsError> {
    let length_mm = length(low_mm, high_mm)?;
    if !(2..=MOST_TARGETS).contains(&count) || count as f64 > length_mm * 1e3 {
        return Err(TargetsError::Count { count, length_mm });
    }
    let period_mm = length_mm / (count as f64 - 1.0 + RANDOM_PART);
    let mut random = Pcg64::seed_from_u64(seed);
    let target = |i: usize| {
        let within = END_MARGIN + (1.0 - 2.0 * END_MARGIN) * random.random::<f64>();
        let exact = low_mm + period_mm * (i as f64 + RANDOM_PART * within);
        (exact * PLACES_PER_MM).round() / PLACES_PER_MM
    };
    Ok((0..count).map(target).collect())
}

fn length(low_mm: f64, high_mm: f64) -> Result<f64, TargetsError> {
    let length_mm = high_mm - low_mm;
    if length_mm.is_finite() && length_mm > 0.0 {
        Ok(length_mm)
    } else {
        Err(TargetsError::Range { low_mm, high_mm })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn even_targets_reach_the_end() {
        assert_eq!(even(10.0, 90.0, 10.0).unwrap(), [10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0]);
        assert_eq!(even(0.0, 1.0, 0.4).unwrap(), [0.0, 0.4, 0.8]);
        let tenths = even(0.0, 1.0, 0.1).unwrap();
        assert_eq!((tenths.len(), tenths[10]), (11, 1.0));
    }

    #[test]
    fn refuses_what_gives_no_targets() {
        assert!(matches!(even(1.0, 1.0, 0.1), Err(TargetsError::Range { .. })));
        assert!(matches!(even(0.0, 1.0, 0.0), Err(TargetsError::Step { .. })));
        assert!(matches!(even(0.0, 1.0, f64::NAN), Err(TargetsError::Step { .. })));
        assert!(matches!(even(0.0, 1.0, 2.0), Err(TargetsError::Step { .. })));
        assert!(matches!(even(0.0, 100.0, 1e-9), Err(TargetsError::Step { .. })));
        assert!(matches!(iso230(0.0, 1.0, 1, 0), Err(TargetsError::Count { .. })));
        assert!(matches!(iso230(0.0, 0.001, 5, 0), Err(TargetsError::Count { .. })));
        assert!(matches!(iso230(0.0, f64::INFINITY, 5, 0), Err(TargetsError::Range { .. })));
    }

    #[test]
    fn seeds_differ_and_repeat() {
        let targets = |seed| iso230(0.0, 100.0, 11, seed).unwrap();
        assert_eq!(targets(7), targets(7));
        assert_ne!(targets(7), targets(8));
    }

    proptest! {
        #[test]
        fn random_targets_keep_their_period(low in -500.0..500.0f64, length in 1.0..1000.0f64, count in 2usize..60, seed: u64) {
            let targets = iso230(low, low + length, count, seed).unwrap();
            let period = length / (count as f64 - 0.7);
            prop_assert_eq!(targets.len(), count);
            for (i, target) in targets.iter().enumerate() {
                let r = target - low - i as f64 * period;
                prop_assert!(r > 0.029 * period - 1e-4 && r < 0.271 * period + 1e-4);
                prop_assert!(*target > low && *target < low + length);
            }
            prop_assert!(targets.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }
}
