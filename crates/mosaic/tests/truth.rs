//! Registration against tiles whose true places are known.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use abbe_mosaic::compare::{Comparison, compare};
use abbe_mosaic::image::{Channels, Depth};
use abbe_mosaic::stitch::{Note, Registration, StitchOptions, register};
use common::{Truth, tissue};

fn registered(
    truth: Truth,
    options: StitchOptions,
    specimen: impl Fn(f64, f64, u64) -> f64,
) -> (Registration, Comparison) {
    let (set, places) = truth.tiles(specimen);
    let registration = register(&set, &options, &|_| ());
    let comparison = compare(&registration.placed, &places).unwrap();
    println!(
        "rms {:.4} px, worst {:.4}, residual {:.4}, pairs {}/{}, scale {:.5}, angle {:.4}, lens {:?}, shading {:?}, seam {:?} -> {:?}, notes {:?}",
        comparison.rms_px,
        comparison.worst_px,
        registration.residual_rms_px,
        registration.pairs_used,
        registration.pairs,
        registration.scale,
        registration.angle_deg,
        registration.distortion,
        registration.shading,
        registration.seam_before,
        registration.seam_after,
        registration.notes,
    );
    (registration, comparison)
}

#[test]
fn grey_tiles_come_within_a_tenth_of_a_pixel() {
    for seed in 1..=3 {
        let (registration, comparison) =
            registered(Truth { seed, ..Truth::default() }, StitchOptions::default(), tissue);
        assert!(comparison.rms_px <= 0.1, "{comparison:?}");
        assert_eq!(registration.pairs_used, 17);
        let lens = registration.distortion.unwrap();
        assert!((lens.radial_corner_px + 1.0).abs() < 0.1 && !lens.beyond_radial, "{lens:?}");
    }
}

#[test]
fn without_the_lens_the_same_tiles_drift() {
    let blind = StitchOptions { correct_distortion: false, ..StitchOptions::default() };
    let (registration, comparison) = registered(Truth::default(), blind, tissue);
    assert!(comparison.rms_px > 0.4, "{comparison:?}");
    assert_eq!(registration.distortion, None);
}

#[test]
fn colour_in_sixteen_bits_comes_as_near() {
    let truth = Truth { channels: Channels::Rgb, depth: Depth::Sixteen, seed: 5, ..Truth::default() };
    let (_, comparison) = registered(truth, StitchOptions::default(), tissue);
    assert!(comparison.rms_px <= 0.1, "{comparison:?}");
}

#[test]
fn a_perfect_lens_is_left_alone() {
    let truth = Truth { corner_px: 0.0, seed: 4, ..Truth::default() };
    let (registration, comparison) = registered(truth, StitchOptions::default(), tissue);
    assert!(comparison.rms_px <= 0.1, "{comparison:?}");
    assert_eq!(registration.distortion, None);
    assert!(registration.notes.contains(&Note::NoDistortion));
}

#[test]
fn vignetting_is_found_and_undone() {
    let truth = Truth { seed: 6, ..Truth::default() };
    let (registration, _) = registered(truth, StitchOptions::default(), tissue);
    let darkest = registration.shading.unwrap().darkest;
    assert!((darkest - 0.75).abs() < 0.04, "{darkest}");
    let (before, after) = (registration.seam_before, registration.seam_after);
    assert!(before.level_rms > 5.0 && after.level_rms < 0.6, "{before:?} {after:?}");
    let dark = StitchOptions { correct_shading: false, ..StitchOptions::default() };
    let (uneven, comparison) = registered(truth, dark, tissue);
    assert!(uneven.seam_after.level_rms > 3.0, "{:?}", uneven.seam_after);
    assert!(comparison.rms_px <= 0.15, "places do not lean on the light: {comparison:?}");
}

#[test]
fn even_light_is_left_alone() {
    let truth = Truth { vignetting: 0.0, seed: 8, ..Truth::default() };
    let (registration, _) = registered(truth, StitchOptions::default(), tissue);
    assert_eq!(registration.shading, None);
    assert!(registration.notes.contains(&Note::NoShading));
}

#[test]
fn little_light_costs_little() {
    let truth = Truth { full_well: 300.0, seed: 9, ..Truth::default() };
    let (_, comparison) = registered(truth, StitchOptions::default(), tissue);
    assert!(comparison.rms_px <= 0.5, "{comparison:?}");
}

/// Tissue on the left, bare glass on the right.
fn half_bare(x: f64, y: f64, channel: u64) -> f64 {
    let share = ((520.0 - x) / 40.0).clamp(0.0, 1.0);
    0.8 * (1.0 - share) + tissue(x, y, channel) * share
}

#[test]
fn tiles_over_bare_glass_follow_the_estimated_frame() {
    let truth = Truth { grid: [5, 4], seed: 11, ..Truth::default() };
    let (registration, comparison) = registered(truth, StitchOptions::default(), half_bare);
    assert_eq!(registration.placed.len(), 20);
    assert!(registration.pairs_used >= 10 && registration.pairs_used < 25, "{}", registration.pairs_used);
    assert!(registration.notes.iter().any(|n| matches!(n, Note::Predicted(_))), "{:?}", registration.notes);
    // A uniform error of ±5 px is 4.1 px rms over both axes: nothing can place a blank tile better.
    assert!(comparison.rms_px < 5.0, "{comparison:?}");
}

#[test]
fn large_errors_of_the_nominal_places_are_searched_for() {
    let truth = Truth { jitter_px: 18.0, overlap: 0.25, seed: 13, ..Truth::default() };
    let (_, comparison) = registered(truth, StitchOptions::default(), tissue);
    assert!(comparison.rms_px <= 0.1, "{comparison:?}");
}

#[test]
fn two_tiles_and_one() {
    let two = Truth { grid: [2, 1], seed: 14, ..Truth::default() };
    let (registration, comparison) = registered(two, StitchOptions::default(), tissue);
    assert!(comparison.rms_px <= 0.5, "{comparison:?}");
    assert_eq!(registration.pairs_used, 1);
    let one = Truth { grid: [1, 1], ..two };
    let (registration, comparison) = registered(one, StitchOptions::default(), tissue);
    assert!(comparison.rms_px < 1e-9);
    assert_eq!(registration.notes, [Note::SingleTile]);
}

#[test]
fn a_set_without_overlap_is_placed_as_told() {
    let apart = Truth { overlap: -0.2, seed: 15, ..Truth::default() };
    let (set, _) = apart.tiles(tissue);
    let registration = register(&set, &StitchOptions::default(), &|_| ());
    assert_eq!(registration.notes, [Note::NoOverlap]);
    for (registered, nominal) in registration.placed.iter().zip(&set.placed) {
        assert!((0..2).all(|k| (registered.place_px[k] - nominal.place_px[k]).abs() < 1e-6));
    }
}

#[test]
fn blank_tiles_are_placed_as_told() {
    let (set, _) = Truth { seed: 16, ..Truth::default() }.tiles(|_, _, _| 0.7);
    let registration = register(&set, &StitchOptions::default(), &|_| ());
    assert_eq!(registration.pairs_used, 0, "noise is no structure");
    assert!(registration.notes.contains(&Note::NothingMatched));
}
