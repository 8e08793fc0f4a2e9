//! A stage that is switched on stands where it was left.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod preset;

use abbe_core::Outputs;
use abbe_twin::{Plant, Twin};

/// A nut that was put beyond its backlash pushed the slide by up to half a period of the grating in the first ticks. (The
/// rotor of a stepper without current still falls into its notch and takes the slide along by up to a µm.)
#[test]
fn nothing_moves_a_stage_of_dc_motors_that_is_switched_on() {
    let plant = Plant::read("litho-120", preset::LITHO_120).unwrap();
    let config = preset::settings(preset::LITHO_120).unwrap().build().unwrap();
    for seed in 0..30 {
        let mut twin = Twin::new(&plant, &config, seed);
        let left_at = twin.truth().slides_um;
        (0..200).for_each(|_| _ = twin.step(&Outputs::OFF));
        for (at, left_at) in twin.truth().slides_um.iter().zip(left_at) {
            // The floor moves the head against the grating by some 5 nm.
            assert!((at - left_at).abs() < 0.03, "seed {seed}: {left_at} to {at} µm");
        }
    }
}
