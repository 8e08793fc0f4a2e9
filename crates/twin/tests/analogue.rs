//! Paper B's stage by its inputs and outputs: bridges in, codes and counts out. No controller; the truth judges.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use abbe_core::design::Config;
use abbe_core::edge::{Actuation, AxisInputs, AxisOutputs, SinCos};
use abbe_core::{Inputs, Outputs};
use abbe_twin::analogue::{Channel, HeadEvent};
use abbe_twin::{Event, Plant, Twin, preset};
use rayon::prelude::*;
use std::hash::{DefaultHasher, Hash, Hasher};

const PRESET: &str = include_str!("../../../presets/litho-120.toml");

fn config() -> Config<2> {
    preset::settings(PRESET).unwrap().build().unwrap()
}

fn plant() -> Plant {
    Plant::read("litho-120", PRESET).unwrap()
}

/// Both bridges at a duty, part of the supply.
fn duty(part: f64) -> Outputs<2> {
    let actuation = Actuation::Pwm((part * 32_767.0) as i16);
    Outputs { axes: [AxisOutputs { actuation, piezo: 0, enable: true }; 2], ..Outputs::OFF }
}

/// So many ticks, each seen.
fn run(twin: &mut Twin, outputs: &Outputs<2>, ticks: u32, mut seen: impl FnMut(&Twin, &Inputs<2>)) {
    for _ in 0..ticks {
        let inputs = twin.step(outputs);
        seen(twin, &inputs);
    }
}

/// Least imperfections of each axis, as keys of the preset. The offsets are those of [`LEAST_OF_A_CHANNEL`].
const LEAST_OF_AN_AXIS: [(&str, f64); 22] = [
    ("head.phase_deg", 3.0),
    ("head.third_harmonic", 0.005),
    ("head.fifth_harmonic", 0.005),
    ("head.noise", 0.005),
    ("head.skew_ns", 50.0),
    ("head.wander_offset", 0.01),
    ("head.wander_amplitude", 0.03),
    ("head.line_nm", 1.0),
    ("head.bow_lsb", 2.0),
    ("head.codes_lsb", 0.5),
    ("scale.graduation_rms_um", 0.1),
    ("scale.vibration_nm", 5.0),
    ("scale.expansion_um_m_k", 8.0),
    ("scale.index_jitter_counts", 0.1),
    ("motor.ripple", 0.05),
    ("motor.dead_zone_v", 0.25),
    ("screw.once_per_turn_um", 2.0),
    ("screw.backlash_um", 5.0),
    ("friction.coulomb_n", 10.0),
    ("friction.breakaway_n", 14.0),
    ("switches.scatter_um", 5.0),
    ("switches.bounce_ms", 2.0),
];
/// The same of the whole stage.
const LEAST: [(&str, f64); 19] = [
    ("geometry.scale_sideways_mm", 40.0),
    ("geometry.scale_down_mm", 5.0),
    ("geometry.angle_arcsec_pp", 0.5),
    ("geometry.straightness_um_pp", 0.3),
    ("geometry.squareness_arcsec", 5.0),
    ("geometry.reversal_um", 0.05),
    ("geometry.random_um", 0.002),
    ("heat.room_swing_k", 0.05),
    ("heat.motor_drift_um", 0.1),
    ("thermometers.offset_k", 0.1),
    ("thermometers.noise_k", 0.02),
    ("interferometer.noise_um", 0.002),
    ("interferometer.dead_path_um_k", 0.05),
    ("interferometer.misalignment_mrad", 0.5),
    ("interferometer.air_ppm", 0.3),
    ("loop.jitter", 0.01),
    ("camera.angle_deg", 0.3),
    ("camera.pixel_scale_error", 0.002),
    ("camera.distortion_corner_px", 1.0),
];
/// Offset of one channel at least, gain away from 1 at least.
const LEAST_OF_A_CHANNEL: f64 = 0.04;
const LEAST_GAIN: f64 = 0.06;
/// What the controller must be able to go: speed, acceleration, jerk.
const LIMITS: [(&str, f64); 3] = [("speed_mm_s", 5.0), ("acceleration_mm_s2", 100.0), ("jerk_mm_s3", 5000.0)];

/// The number at a path of keys.
fn number(table: &toml::Value, path: &str) -> f64 {
    path.split('.').fold(table, |value, key| &value[key]).as_float().unwrap()
}

fn at_least(table: &toml::Value, least: &[(&str, f64)]) {
    for (path, least) in least {
        let value = number(table, path);
        assert!(value.abs() >= *least, "{path} = {value}, at least {least}");
    }
}

/// Lead (1 mm, not 5) and the structure's own mode near 80 Hz are not promised yet: the preset has neither.
#[test]
fn the_preset_is_at_least_as_unkind_as_promised() {
    let preset: toml::Value = toml::from_str(PRESET).unwrap();
    let plant = &preset["plant"];
    at_least(plant, &LEAST);
    for name in ["x", "y"] {
        let axis = &plant[name];
        at_least(axis, &LEAST_OF_AN_AXIS);
        at_least(&preset["controller"][name], &LIMITS);
        let offset = number(axis, "head.offset_cos").abs().max(number(axis, "head.offset_sin").abs());
        assert!(offset >= LEAST_OF_A_CHANNEL, "{name}: {offset}");
        let gain = number(axis, "head.gain");
        assert!((gain - 1.0).abs() >= LEAST_GAIN, "{name}: {gain}");
        let stiffness = number(axis, "screw.stiffness_n_um");
        assert!(stiffness <= 50.0, "{name}: {stiffness} N/µm, at most 50");
        assert!(axis["head"]["bits"].as_integer().unwrap() <= 12);
    }
    assert!(number(plant, "camera.vignetting") >= 0.25 && number(plant, "camera.read_noise_e") > 0.0);
}

/// The floor moves a stage that stands, and scale and instruments see the same of it.
#[test]
fn the_floor_moves_what_stands() {
    let still = |vibration_nm: f64| {
        let mut plant = plant();
        plant.x.scale.vibration_nm = vibration_nm;
        let mut twin = Twin::standing_at(&plant, &config(), 6, [40.0, 60.0]);
        let (mut slides, mut tables) = (Vec::new(), Vec::new());
        run(&mut twin, &Outputs::OFF, 20_000, |twin, _| {
            slides.push(twin.truth().slides_um[0]);
            tables.push(twin.truth().table_um[0]);
        });
        [slides, tables].map(|places| {
            let mean = places.iter().sum::<f64>() / places.len() as f64;
            (places.iter().map(|um| (um - mean).powi(2)).sum::<f64>() / places.len() as f64).sqrt()
        })
    };
    assert!(still(0.0).iter().all(|rms| *rms < 0.001), "{:?}", still(0.0));
    assert!(still(5.0).iter().all(|rms| (0.0045..0.0055).contains(rms)), "{:?}", still(5.0));
}

#[test]
fn the_supply_moves_the_stage_at_more_than_5_mm_s_and_an_open_bridge_stops_it() {
    let mut twin = Twin::standing_at(&plant(), &config(), 3, [40.0, 60.0]);
    run(&mut twin, &duty(0.5), 5000, |_, _| {});
    let speed = twin.truth().speed_mm_s;
    assert!(speed.iter().all(|v| (5.0..12.0).contains(v)), "{speed:?}");
    run(&mut twin, &Outputs::OFF, 3000, |_, _| {});
    assert!(twin.truth().speed_mm_s.iter().all(|v| v.abs() < 0.01));
    // Step pulses are nothing to a bridge.
    let before = twin.truth().slides_um;
    let steps = Actuation::Steps(abbe_core::edge::StepRate(5 << 16));
    let pulses =
        Outputs { axes: [AxisOutputs { actuation: steps, piezo: 0, enable: true }; 2], ..Outputs::OFF };
    run(&mut twin, &pulses, 3000, |_, _| {});
    assert!((twin.truth().slides_um[0] - before[0]).abs() < 0.1);
}

/// Phase of the codes, fringes.
fn phase(axis: &AxisInputs) -> f64 {
    let SinCos { sin, cos } = axis.sin_cos.unwrap();
    f64::from(sin).atan2(f64::from(cos)) / std::f64::consts::TAU
}

/// The counter, fringes: it began with zero wherever the grating was.
fn coarse(axis: &AxisInputs) -> f64 {
    f64::from(axis.counter.cast_signed()) / 4.0
}

/// Reading from counter and codes, fringes: the codes' phase in the fringe that the counter says. `from` is the phase
/// where the counter was zero.
fn fringes(axis: &AxisInputs, from: f64) -> f64 {
    let coarse = coarse(axis) + from;
    coarse + (phase(axis) - coarse + 0.5).rem_euclid(1.0) - 0.5
}

#[test]
fn counts_and_codes_tell_the_same_way_and_it_is_the_true_one() {
    let mut twin = Twin::standing_at(&plant(), &config(), 4, [40.0, 60.0]);
    // The glass takes its temperature in the first tick.
    run(&mut twin, &Outputs::OFF, 10, |_, _| {});
    let start = twin.truth().slides_um;
    let (mut from, mut phase_offset) = ([None; 2], [None; 2]);
    let (mut worst_um, mut apart) = (0.0f64, [[f64::MAX, f64::MIN]; 2]);
    for part in [0.4, 0.0, -0.4, 0.0] {
        // What is seen is a tick old.
        let mut last = twin.truth().slides_um;
        run(&mut twin, &duty(part), 5000, |twin, inputs| {
            for (axis, input) in inputs.axes.iter().enumerate() {
                assert_eq!(input.illegal, 0);
                if input.sin_cos.is_none() {
                    continue;
                }
                let from = *from[axis].get_or_insert(phase(input) - coarse(input));
                let (turns, true_turns) = (fringes(input, from), (last[axis] - start[axis]) / 0.8);
                let offset = *phase_offset[axis].get_or_insert(turns - true_turns);
                worst_um = worst_um.max((turns - offset - true_turns).abs() * 0.8);
                let sub = turns * 4.0 - f64::from(input.counter.cast_signed());
                apart[axis] = [apart[axis][0].min(sub), apart[axis][1].max(sub)];
            }
            last = twin.truth().slides_um;
        });
    }
    // 13 nm of the signals either way, seen from a place that errs itself; 0.007 µm/mm of the scale over 4 mm, and its
    // graduation, which changes by 0.018 µm/mm rms.
    assert!((0.02..0.15).contains(&worst_um), "{worst_um}");
    // The phase stays within its count, but for hysteresis and offsets that move the edges by a tenth.
    assert!(apart.iter().all(|[low, high]| (0.9..1.3).contains(&(high - low))), "{apart:?}");
}

#[test]
fn what_happens_to_a_head_is_seen_by_the_controller() {
    let mut twin = Twin::standing_at(&plant(), &config(), 5, [40.0, 60.0]);
    let happen = |twin: &mut Twin, event| twin.happen(Event::Head { axis: 0, event }).unwrap();
    let none = |twin: &mut Twin| {
        let mut none = [0u32; 2];
        run(twin, &Outputs::OFF, 1000, |_, inputs| {
            for (none, axis) in none.iter_mut().zip(&inputs.axes) {
                *none += u32::from(axis.sin_cos.is_none());
            }
        });
        none
    };
    assert!(none(&mut twin)[0] <= 3);
    happen(&mut twin, HeadEvent::LoseSamples { ticks: 200 });
    let lost = none(&mut twin);
    assert!((195..=210).contains(&lost[0]) && lost[1] <= 3, "{lost:?}");
    happen(&mut twin, HeadEvent::Stick { channel: Channel::Cosine });
    run(&mut twin, &duty(0.4), 2, |_, _| {});
    let (mut cosines, mut sines) = (Vec::new(), Vec::new());
    run(&mut twin, &duty(0.4), 1000, |_, inputs| {
        cosines.extend(inputs.axes[0].sin_cos.map(|codes| codes.cos));
        sines.extend(inputs.axes[0].sin_cos.map(|codes| codes.sin));
    });
    assert!(cosines.iter().all(|cos| *cos == cosines[0]) && sines.iter().any(|sin| *sin != sines[0]));
    twin.happen(Event::Encoder { axis: 1, connected: false }).unwrap();
    run(&mut twin, &duty(0.4), 2, |_, _| {});
    let mut counters = Vec::new();
    run(&mut twin, &duty(0.4), 1000, |_, inputs| {
        counters.push(inputs.axes[1].counter);
        let near = |code: i16| (f64::from(code) / 32_768.0 - 0.02).abs() < 0.02;
        assert!(inputs.axes[1].sin_cos.is_none_or(|codes| near(codes.sin) && near(codes.cos)));
    });
    assert!(counters.iter().all(|counter| *counter == counters[0]));
}

#[test]
fn the_same_seed_repeats_and_another_does_not() {
    let hash = |seed| seen(&plant(), seed);
    assert_eq!(hash(5), hash(5));
    assert_ne!(hash(5), hash(6));
}

/// Everything that can be seen of the axes on a way up, back and over the reference mark, pulled and plugged at its
/// end.
fn seen(plant: &Plant, seed: u64) -> u64 {
    let mut twin = Twin::standing_at(plant, &config(), seed, [-0.6, -0.4]);
    let mut hash = DefaultHasher::new();
    let mut watch = |twin: &Twin, inputs: &Inputs<2>| {
        for axis in inputs.axes {
            (axis.counter, axis.illegal, axis.glitches, axis.index).hash(&mut hash);
            (axis.limit_low, axis.limit_high).hash(&mut hash);
            axis.sin_cos.map(|codes| (codes.sin, codes.cos)).hash(&mut hash);
        }
        twin.truth().table_um.map(f64::to_bits).hash(&mut hash);
    };
    for part in [0.5, 0.0, -0.3] {
        run(&mut twin, &duty(part), 2000, &mut watch);
    }
    for axis in 0..2 {
        twin.happen(Event::Encoder { axis, connected: false }).unwrap();
    }
    run(&mut twin, &duty(0.2), 100, &mut watch);
    hash.finish()
}

#[test]
fn every_key_of_motor_and_head_shows() {
    let preset: toml::Value = toml::from_str(PRESET).unwrap();
    let mut paths = vec![vec!["geometry", "y_carries_x"]];
    for axis in ["x", "y"] {
        for table in ["motor", "head"] {
            let keys = preset["plant"][axis][table].as_table().unwrap().keys();
            // The kind of a motor decides which keys it has.
            paths.extend(keys.filter(|key| *key != "kind").map(|key| vec![axis, table, key.as_str()]));
        }
    }
    assert_eq!(paths.len(), 1 + 2 * (9 + 24));
    let before = seen(&plant(), 5);
    let unseen: Vec<String> = paths
        .par_iter()
        .filter(|path| {
            let mut altered = preset.clone();
            let place = path.iter().fold(&mut altered["plant"], |value, key| &mut value[*key]);
            *place = match &*place {
                // What is drawn rarely comes a hundred times as often, so that a short run meets it.
                toml::Value::Float(v) if path.ends_with(&["lost_probability"]) => {
                    toml::Value::Float(v * 100.0)
                }
                // Few of the edges of a short run lie where a little noise decides.
                toml::Value::Float(v) if path.ends_with(&["comparator_noise"]) => toml::Value::Float(v * 4.0),
                toml::Value::Float(v) => toml::Value::Float(v * 0.8),
                toml::Value::Integer(v) => toml::Value::Integer(v - 1),
                other => toml::Value::Boolean(!other.as_bool().unwrap()),
            };
            seen(&Plant::read("altered", &toml::to_string(&altered).unwrap()).unwrap(), 5) == before
        })
        .map(|path| path.join("."))
        .collect();
    assert!(unseen.is_empty(), "these keys change nothing: {unseen:#?}");
}

#[test]
fn a_wrong_key_of_motor_or_head_is_named_with_its_line() {
    for (good, bad, words) in [
        ("third_harmonic = 0.01 ", "third_harmonic = 0.5 ", "must be 0 … 0.2"),
        ("bits = 12", "bits = 20", "must be 8 … 16"),
        ("skew_ns = 50.0", "scew_ns = 50.0", "the nearest valid one is `skew_ns`"),
        ("supply_v = 12.0", "supply_v = 0.0", "must be 1 … 400"),
        ("inductance_mh = 4.0", "inductanc_mh = 4.0", "the nearest valid one is `inductance_mh`"),
        ("count_um = 0.2               # from", "count_um = 0.1               # from", "must be 0.2"),
    ] {
        let text = PRESET.replacen(good, bad, 1);
        assert_ne!(text, PRESET, "{good}");
        let line = 1 + text[..text.find(bad).unwrap()].matches('\n').count();
        let error = Plant::read("l.toml", &text).unwrap_err();
        assert_eq!(error.line, Some(line), "{error}");
        assert!(error.message.contains(words), "{error}");
    }
}

#[test]
fn a_motor_has_all_keys_of_its_kind_and_no_others() {
    let header = 1 + PRESET[..PRESET.find("[plant.x.motor]").unwrap()].matches('\n').count();
    for (good, bad, words) in [
        (
            "[plant.x.motor]\nkind = \"dc\"",
            "[plant.x.motor]\nkind = \"stepper\"",
            "`supply_v` is no key of a motor of kind \"stepper\"",
        ),
        ("supply_v = 12.0", "microsteps = 16", "`microsteps` is no key of a motor of kind \"dc\""),
        ("supply_v = 12.0", "", "missing key `supply_v`"),
    ] {
        let error = Plant::read("l.toml", &PRESET.replacen(good, bad, 1)).unwrap_err();
        assert_eq!(error.line, Some(header), "{error}");
        assert!(error.message.contains(words), "{error}");
    }
}
