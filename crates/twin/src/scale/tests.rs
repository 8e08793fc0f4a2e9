//! A scale with either head.

use super::*;
use crate::analogue::HeadEvent;

const PRESET: &str = include_str!("../../../../presets/microscope-100.toml");

/// The clock of the twin's front end at 10 kHz.
const CLOCK_HZ: u32 = 10_000_000;

fn plant() -> AxisPlant {
    crate::Plant::read("microscope-100", PRESET).unwrap().y
}

fn paper_b() -> AxisPlant {
    crate::Plant::read("litho-120", LITHO).unwrap().x
}

/// A scale whose front end is set up as its preset says.
fn scale(preset: &str, axis: &AxisPlant, place_um: f64, seed: u64, name: &str) -> Scale {
    let config = crate::preset::settings(preset).unwrap().build().unwrap();
    Scale::new(axis, config.axes[0].front, CLOCK_HZ, place_um, seed, name)
}

#[test]
fn not_a_count_is_lost_over_forward_and_back_with_disturbances() {
    let mut scale = scale(PRESET, &plant(), 5000.0, 1, "x");
    let start = scale.count;
    for step in 0..40_000i32 {
        let phase = f64::from(step) / 40_000.0;
        scale.move_to(5000.0 + 3000.0 * sin_turns(3.0 * phase), 500);
        if step % 7 == 0 {
            scale.glitch();
            scale.move_to(5000.0 + 3000.0 * sin_turns(3.0 * phase), 500);
        }
        assert_eq!(scale.read().illegal, 0);
    }
    scale.move_to(5000.0, 500);
    scale.move_to(5000.0, 500);
    assert_eq!(i64::from(scale.read().counter.cast_signed()), scale.count - start);
}

#[test]
fn reading_and_error_make_the_place() {
    let mut scale = scale(PRESET, &plant(), 90_000.0, 2, "y");
    for _ in 0..5 {
        scale.move_to(90_000.0, 500);
    }
    let reading = scale.position_um();
    assert!((reading + scale.error_um(reading) - 90_000.0).abs() < 1e-3);
    // Paper A's Y axis at 90 mm: 194.7 µm, and what graduation and cyclic error add.
    assert!((scale.error_um(90_000.0) - 194.7).abs() < 1.5);
}

#[test]
fn graduation_and_cyclic_error_have_their_sizes() {
    let scale = scale(PRESET, &plant(), 0.0, 3, "x");
    let mean_square: f64 =
        (0..1000).map(|i| scale.graduation.at(f64::from(i) * 100.0).powi(2)).sum::<f64>() / 1000.0;
    assert!((0.2..0.4).contains(&mean_square.sqrt()), "{}", mean_square.sqrt());
    // Neighbours within a grating period differ by the cyclic error alone.
    let inside = (0..200).map(|i| {
        let at = 40_000.0 + f64::from(i) * 0.1;
        scale.error_um(at) - 0.6397e-3 * at - 0.0168e-6 * at * at
    });
    let (low, high) = inside.fold((f64::MAX, f64::MIN), |(l, h), e| (l.min(e), h.max(e)));
    assert!((0.28..0.36).contains(&(high - low)), "{}", high - low);
}

#[test]
fn warm_glass_reads_too_little() {
    let mut scale = scale(PRESET, &plant(), 0.0, 4, "x");
    let cold = scale.error_um(100_000.0);
    scale.warm(1.5);
    assert!((scale.error_um(100_000.0) - cold - 1.2).abs() < 1e-9);
}

const LITHO: &str = include_str!("../../../../presets/litho-120.toml");

/// What is lost, and illegal transitions: paper B's scale with all its faults, 2 mm forward and back at 50 mm/s: 250 000 counts a second.
fn sweep(events: &[HeadEvent]) -> (i64, u32) {
    let mut scale = scale(LITHO, &paper_b(), 30_000.0, 5, "x");
    for event in events {
        scale.head_mut().unwrap().happen(*event);
    }
    let (start, mut illegal) = (scale.reading_um, 0);
    // Half a tick is 2.5 µm.
    let way = (0..800).chain((0..800).rev()).chain([0; 4]);
    for step in way {
        scale.move_to(30_001.0 + 2.5 * f64::from(step), 500);
        illegal += u32::from(scale.read().illegal);
    }
    let counts = i64::from(scale.read().counter.cast_signed());
    let moved = (scale.reading_um / 0.2).floor() as i64 - (start / 0.2).floor() as i64;
    (counts - moved, illegal)
}

#[test]
fn the_comparators_lose_nothing_at_250_000_counts_a_second() {
    let (lost, illegal) = sweep(&[]);
    assert!(lost.abs() <= 1 && illegal == 0, "{lost} {illegal}");
}

#[test]
fn chatter_and_darkness_lose_counts() {
    // The filter takes most of it; what passes costs counts, four at a time without an illegal transition.
    let (lost, illegal) = sweep(&[HeadEvent::Chatter { part: 0.5 }]);
    assert!(lost.abs() > 8 && illegal > 5, "{lost} {illegal}");
    let spot = crate::analogue::Dirt { at_mm: 31.0, width_mm: 10.0, loss: [0.99, 0.99] };
    let mut dark = scale(LITHO, &paper_b(), 31_000.0, 5, "x");
    dark.head_mut().unwrap().happen(HeadEvent::Dirt(spot));
    for step in 0..40 {
        dark.move_to(31_000.0 + 2.5 * f64::from(step), 500);
    }
    // Some 500 counts of way.
    assert!(dark.read().counter.cast_signed().abs() < 10);
}

#[test]
fn a_pulled_connector_stops_the_counts_and_levels_the_codes() {
    let mut scale = scale(LITHO, &paper_b(), 30_000.0, 5, "x");
    scale.connect(false);
    for step in 0..100 {
        scale.move_to(30_000.0 + f64::from(step), 500);
        let sample = scale.sample(0.0);
        let far = |code: i16| (f64::from(code) / 32_768.0 - 0.02).abs();
        // 0.3 % of noise, and what the converter errs.
        assert!(sample.is_none_or(|sample| far(sample.sin) < 0.015 && far(sample.cos) < 0.015));
    }
    assert!(scale.read().counter.cast_signed().abs() <= 2);
    scale.connect(true);
    scale.move_to(30_100.0, 500);
    let (a, b) = (scale.lines().a, scale.lines().b);
    let sample = scale.sample(0.0).unwrap();
    assert!((a, b) == (sample.cos < 0, sample.sin < 0) || sample.cos.abs().min(sample.sin.abs()) < 2000);
}
