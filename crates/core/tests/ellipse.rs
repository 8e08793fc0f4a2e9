//! What the correction of the signals leaves, over thousands of made-up encoders.

// The lint spares test functions but not the functions they share.
#![allow(clippy::unwrap_used)]

#[path = "../examples/ellipse_trials/trials.rs"]
mod trials;

use abbe_core::sense::correct::{Correction, Residual};
use trials::{Method, Motion, mean, p95};

const TRIALS: u64 = 2000;

fn motion(samples: u32, noise: f64) -> Motion {
    Motion { samples, noise, third: 0.0 }
}

#[test]
fn a_thousand_samples_with_one_percent_of_noise_leave_a_quarter_of_a_nanometre() {
    let left = motion(1000, 0.01).trials(Method::Heydemann, TRIALS).unwrap();
    assert!(p95(&left) <= 0.25, "p95 {} nm", p95(&left));
    // An exact fit cannot do better than the noise lets it.
    assert!(mean(&left) > 0.10 && p95(&left) > 0.18, "mean {} nm", mean(&left));
}

#[test]
fn more_samples_and_less_noise_leave_less() {
    for (samples, noise, bound) in [(200, 0.001, 0.07), (1000, 0.003, 0.08), (5000, 0.01, 0.12)] {
        let left = motion(samples, noise).trials(Method::Heydemann, 500).unwrap();
        assert!(p95(&left) <= bound, "{samples} samples, noise {noise}: {} nm", p95(&left));
    }
}

#[test]
fn uncorrected_it_is_13_nm_and_every_method_leaves_what_it_cannot_know() {
    let none = motion(1000, 0.0).left_nm(&Correction::NONE, &Residual::NONE);
    assert!((none - 12.90).abs() < 0.02, "{none}");
    // Moments take a part of a period for a whole one. Extremes leave gain and quadrature, 0.637 · 8 and 1.111 · 4 nm at
    // the second harmonic. The recursion follows only what is no chance.
    let bounds = [(0.0, 0.05), (0.1, 0.5), (6.0, 10.0), (0.0, 0.15)];
    for (method, (least, most)) in Method::ALL.into_iter().zip(bounds) {
        let left = p95(&motion(5000, 0.003).trials(method, 200).unwrap());
        assert!((least..=most).contains(&left), "{method:?}: {left}");
    }
}

#[test]
fn a_third_harmonic_stays_with_the_ellipse_and_goes_with_the_table() {
    let sweep = Motion { samples: 20_000, noise: 0.003, third: 0.01 };
    let (alone, table) = (sweep.sweeps(false, 50).unwrap(), sweep.sweeps(true, 50).unwrap());
    assert!(mean(&alone) > 1.2, "{}", mean(&alone));
    assert!(p95(&table) <= 0.1, "{}", p95(&table));
}
