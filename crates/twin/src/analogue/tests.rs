//! Each fault of a head has the size that its key says.

use super::*;
use core::f64::consts::TAU;

const PRESET: &str = include_str!("../../../../presets/litho-120.toml");
const PERIOD_NM: f64 = 800.0;

/// The preset's axis with a head that does nothing wrong.
fn perfect() -> AxisPlant {
    let mut axis = crate::Plant::read("litho-120", PRESET).unwrap().x;
    axis.head = Some(HeadPlant {
        amplitude: 0.9,
        offset_cos: 0.0,
        offset_sin: 0.0,
        gain: 1.0,
        phase_deg: 0.0,
        third_harmonic: 0.0,
        fifth_harmonic: 0.0,
        noise: 0.0,
        skew_ns: 0.0,
        wander_offset: 0.0,
        wander_gain: 0.0,
        wander_amplitude: 0.0,
        wander_length_mm: 10.0,
        offset_per_k: 0.0,
        gain_per_k: 0.0,
        amplitude_per_k: 0.0,
        line_nm: 0.0,
        bits: 16,
        bow_lsb: 0.0,
        codes_lsb: 0.0,
        lost_probability: 0.0,
        hysteresis: 0.03,
        comparator_noise: 0.0,
        unplugged: 0.02,
    });
    axis
}

fn head(change: impl FnOnce(&mut HeadPlant)) -> Head {
    let mut axis = perfect();
    change(axis.head.as_mut().unwrap());
    Head::new(&axis, 0.0, 7, "test").unwrap()
}

/// Errors of the arctangent inside the period that begins at `from_um`, nm.
fn errors_nm(from_um: f64, mut signals: impl FnMut(f64) -> [f64; 2]) -> Vec<f64> {
    let error = |i: i32| {
        let turns = f64::from(i) / 4000.0;
        let [cos, sin] = signals(from_um + turns * PERIOD_NM * 1e-3);
        let error = libm::atan2(sin, cos) / TAU - turns;
        (error - (error + 0.5).floor()) * PERIOD_NM
    };
    (0..4000).map(error).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn rms(values: &[f64]) -> f64 {
    mean(&values.iter().map(|value| value * value).collect::<Vec<_>>()).sqrt()
}

/// Largest distance from `middle`.
fn peak(values: &[f64], middle: f64) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max((value - middle).abs()))
}

/// What the arctangent errs without any correction, period 10.
fn uncorrected_nm(head: &Head) -> Vec<f64> {
    errors_nm(8.0, |at| head.signals(at, &head.levels(at)))
}

#[test]
fn a_perfect_head_errs_by_nothing() {
    let errors = uncorrected_nm(&head(|_| {}));
    assert!(peak(&errors, 0.0) < 1e-5, "{}", peak(&errors, 0.0));
}

#[test]
fn each_fault_of_the_signals_errs_as_its_formula_says() {
    // First order: P e/2π, P d/4π, P α/4π; the third and fifth harmonic both show as the fourth, P e/2π.
    type Change = fn(&mut HeadPlant);
    let faults: [(&str, f64, Change); 6] = [
        ("cosine 1 % off", 1.273, |head| head.offset_cos = 0.01),
        ("sine 1 % off", 1.273, |head| head.offset_sin = 0.01),
        ("gain 1 % off", 0.637, |head| head.gain = 1.01),
        ("1° ahead", 1.111, |head| head.phase_deg = 1.0),
        ("third harmonic", 1.273, |head| head.third_harmonic = 0.01),
        ("fifth harmonic", 1.273, |head| head.fifth_harmonic = 0.01),
    ];
    for (name, expected, change) in faults {
        let errors = uncorrected_nm(&head(change));
        let found = peak(&errors, mean(&errors));
        assert!((found / expected - 1.0).abs() < 0.02, "{name}: {found} nm, {expected}");
    }
}

#[test]
fn the_faults_of_paper_b_s_signals_together_err_by_13_nanometres() {
    let errors = uncorrected_nm(&head(|head| {
        (head.offset_cos, head.offset_sin) = (0.05, -0.03);
        (head.gain, head.phase_deg) = (1.08, 4.0);
    }));
    // Half of the 4° moves the whole period, which is no error inside it.
    let middle = mean(&errors);
    let (peak, rms) = (peak(&errors, middle), rms(&errors.iter().map(|e| e - middle).collect::<Vec<_>>()));
    assert!((peak - 12.90).abs() < 0.01 && (rms - 6.98).abs() < 0.01, "{peak} {rms}");
}

#[test]
fn the_converter_errs_by_its_width() {
    // Amplitude 0.9 of full scale.
    for (bits, expected) in [(8, 0.756), (10, 0.167), (12, 0.048), (14, 0.010)] {
        let mut head = head(|head| head.bits = bits);
        let errors = errors_nm(8.0, |at| codes(head.sample(at, 0.0, true)));
        let found = peak(&errors, 0.0);
        assert!((0.7..1.3).contains(&(found / expected)), "{bits} bits: {found} nm, {expected}");
    }
    // A bow of 2 LSB in 1843 of amplitude: each channel is off by at most 0.11 %, 0.14 nm.
    let mut bowed = head(|head| (head.bits, head.bow_lsb) = (12, 2.0));
    let errors = errors_nm(8.0, |at| codes(bowed.sample(at, 0.0, true)));
    assert!((0.1..0.3).contains(&peak(&errors, 0.0)), "{}", peak(&errors, 0.0));
}

/// Cosine and sine in parts of full scale.
fn codes(sample: Option<SinCos>) -> [f64; 2] {
    let sample = sample.unwrap();
    [sample.cos, sample.sin].map(|code| f64::from(code) / 32_768.0)
}

/// 400 places along the travel, µm, each the beginning of a period.
fn places() -> impl Iterator<Item = f64> {
    (0..400).map(|i| f64::from(i) * 300.0)
}

#[test]
fn offsets_gain_and_amplitude_wander_by_what_they_are_told() {
    let wandering = head(|head| {
        (head.wander_offset, head.wander_gain, head.wander_amplitude) = (0.02, 0.01, 0.03);
    });
    let levels: Vec<[Level; 2]> = places().map(|at| wandering.levels(at)).collect();
    let offsets: Vec<f64> = levels.iter().map(|[cos, _]| cos.offset / 0.9).collect();
    let gains: Vec<f64> = levels.iter().map(|[cos, sin]| sin.amplitude / cos.amplitude - 1.0).collect();
    let amplitudes: Vec<f64> = levels.iter().map(|[cos, _]| cos.amplitude / 0.9 - 1.0).collect();
    for (found, expected) in [(offsets, 0.02), (gains, 0.01), (amplitudes, 0.03)] {
        assert!((0.6..1.4).contains(&(rms(&found) / expected)), "{} {expected}", rms(&found));
    }
    // A millimetre changes little: a tenth of the correlation length.
    let near = (levels[0][0].offset - wandering.levels(1000.0)[0].offset).abs();
    assert!(near < 0.01, "{near}");
}

#[test]
fn warmth_changes_offsets_gain_and_amplitude() {
    let mut head = head(|head| {
        (head.offset_per_k, head.gain_per_k, head.amplitude_per_k) = (0.001, 0.0005, -0.003);
    });
    head.warm(2.0);
    let [cos, sin] = head.levels(0.0);
    assert!((cos.offset / 0.9 - 0.002).abs() < 1e-12 && (sin.offset / 0.9 - 0.002).abs() < 1e-12);
    assert!((cos.amplitude / 0.9 - 0.994).abs() < 1e-12, "{}", cos.amplitude);
    assert!((sin.amplitude / cos.amplitude - 1.001).abs() < 1e-12, "{}", sin.amplitude);
}

#[test]
fn each_line_of_the_grating_is_off_its_own_place_every_time() {
    let head = head(|head| head.line_nm = 1.0);
    let errors = |from: f64| -> Vec<f64> {
        (0..5000).map(|line| head.line_error_um(from + f64::from(line) * 0.8) * 1e3).collect()
    };
    let lines = errors(0.4e-6);
    assert!(
        (rms(&lines) - 1.0).abs() < 0.05 && mean(&lines).abs() < 0.05,
        "{} {}",
        rms(&lines),
        mean(&lines)
    );
    assert_eq!(lines, errors(0.4e-6));
    // Neighbours do not know of each other, and between them there is no jump.
    let neighbours: Vec<f64> = lines.windows(2).map(|pair| pair[0] * pair[1]).collect();
    assert!(mean(&neighbours).abs() < 0.05, "{}", mean(&neighbours));
    let step = head.line_error_um(79.9999) - head.line_error_um(80.0001);
    assert!(step.abs() < 3e-6, "{step}");
}

#[test]
fn a_late_sine_leans_the_signals_at_speed() {
    // 50 mm/s for 50 ns are 2.5 nm, 1.125°, which is 1.25 nm of ripple; at rest there is none.
    let mut head = head(|head| head.skew_ns = 50.0);
    for (speed, expected) in [(50.0, 1.25), (-50.0, 1.25), (5.0, 0.125), (0.0, 0.0)] {
        let errors = errors_nm(8.0, |at| codes(head.sample(at, speed, true)));
        let found = peak(&errors, mean(&errors));
        assert!((found - expected).abs() < 0.03, "{speed} mm/s: {found}");
    }
}

#[test]
fn noise_is_that_of_the_amplitude() {
    let mut head = head(|head| head.noise = 0.003);
    let seen: Vec<f64> = (0..20_000).map(|_| codes(head.sample(8.1, 0.0, true))[0] / 0.9).collect();
    let middle = mean(&seen);
    let spread = rms(&seen.iter().map(|v| v - middle).collect::<Vec<_>>());
    assert!((spread - 0.003).abs() < 0.0001, "{spread}");
}

#[test]
fn dirt_takes_its_part_in_its_middle_and_nothing_outside() {
    let mut head = head(|_| {});
    head.happen(HeadEvent::Dirt(Dirt { at_mm: 40.0, width_mm: 2.0, loss: [0.7, 0.5] }));
    let kept = |head: &Head, mm: f64| head.levels(mm * 1e3).map(|level| level.amplitude / 0.9);
    for (mm, expected) in [(40.0, [0.3, 0.5]), (39.5, [0.65, 0.75]), (41.0, [1.0, 1.0]), (38.9, [1.0, 1.0])] {
        let found = kept(&head, mm);
        assert!((found[0] - expected[0]).abs() < 1e-9 && (found[1] - expected[1]).abs() < 1e-9, "{mm}");
    }
    head.happen(HeadEvent::Clean);
    assert_eq!(kept(&head, 40.0), [1.0; 2]);
}

#[test]
fn lamp_amplifier_and_converter_fail_each_in_its_way() {
    let mut head = head(|head| head.offset_cos = 0.05);
    // The lamp takes the wave and leaves the offset.
    head.happen(HeadEvent::Light { part: 0.5 });
    assert!((codes(head.sample(8.0, 0.0, true))[0] - 0.9 * 0.55).abs() < 1e-4);
    head.happen(HeadEvent::Light { part: 1.0 });
    // Too much gain ends at the rails.
    head.happen(HeadEvent::Amplify { factor: 1.6 });
    assert_eq!(head.sample(8.0, 0.0, true).unwrap().cos, i16::MAX);
    assert_eq!(head.sample(8.4, 0.0, true).unwrap().cos, i16::MIN);
    head.happen(HeadEvent::Amplify { factor: 1.0 });
    head.happen(HeadEvent::Stick { channel: Channel::Sine });
    let stuck = [8.1, 8.2, 8.7].map(|at| codes(head.sample(at, 0.0, true)));
    // At 8.4 µm, where it stuck, the sine was zero.
    assert!(stuck.iter().all(|[_, sin]| sin.abs() < 1e-3) && stuck[0][0] != stuck[1][0], "{stuck:?}");
    head.happen(HeadEvent::Unstick);
    assert!(codes(head.sample(8.2, 0.0, true))[1] > 0.89);
    head.happen(HeadEvent::LoseSamples { ticks: 3 });
    let delivered = [0; 5].map(|_: u8| head.sample(8.0, 0.0, true).is_some());
    assert_eq!(delivered, [false, false, false, true, true]);
    // No plug: both channels at one level, wherever the head stands.
    assert_eq!([8.0, 8.5].map(|at| head.sample(at, 0.0, false)), [Some(SinCos { sin: 655, cos: 655 }); 2]);
}

#[test]
fn hysteresis_moves_the_edges_apart_and_too_little_light_ends_them() {
    let mut head = head(|head| head.hysteresis = 0.5);
    let edges = |head: &mut Head, way: [f64; 2]| {
        let mut clocks = Vec::new();
        head.go(way, 80_000, i64::MIN, |clock, _| clocks.push(clock));
        clocks
    };
    // Half the amplitude is a twelfth of a period: the edges of a period come so much later in each direction.
    let up = edges(&mut head, [0.0, 0.8]);
    let expected = [26_667.0, 46_667.0, 66_667.0];
    assert!(up.iter().zip(expected).all(|(at, e)| (*at as f64 - e).abs() < 600.0) && up.len() == 3, "{up:?}");
    head.happen(HeadEvent::Light { part: 0.45 });
    assert_eq!(edges(&mut head, [0.8, 8.8]).len(), 0);
    // The line of B comes down at last when the light is back.
    head.happen(HeadEvent::Light { part: 1.0 });
    assert_eq!(edges(&mut head, [8.8, 9.6]).len(), 4);
}
