//! Presets: `[controller]` is read here, `[plant]` only by the twin.

use crate::failure::{Failure, one_line};
use abbe_core::design::{Analogue, AxisSettings, Config, Encoder, Motor, StageSettings};
use abbe_mosaic::scan::Sense;
use abbe_twin::Plant;
use abbe_twin::plant::PresetError;
use serde::Deserialize;
use std::path::Path;

/// The presets that come with the program.
const BUILT_IN: [(&str, &str); 2] = [
    ("microscope-100", include_str!("../../../presets/microscope-100.toml")),
    ("litho-120", include_str!("../../../presets/litho-120.toml")),
];

/// The preset that is meant when none is named.
pub(crate) const USUAL: &str = "microscope-100";

/// A stage.
#[derive(Clone, Debug)]
pub(crate) struct Preset {
    /// Name, or the file's name without its ending.
    pub(crate) name: String,
    /// What a builder knows.
    pub(crate) controller: Controller,
    /// The truth, for the twin.
    pub(crate) plant: Plant,
}

/// The `[controller]` half.
#[derive(Clone, Debug)]
pub(crate) struct Controller {
    /// The stage.
    pub(crate) settings: StageSettings<2>,
    /// The same, as the tick uses it.
    pub(crate) config: Config<2>,
    /// The camera as its maker describes it.
    pub(crate) camera: CameraSetup,
}

/// What a builder knows of the camera.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CameraSetup {
    pub(crate) pixel_um: f64,
    pub(crate) width_px: u32,
    pub(crate) height_px: u32,
    x_sign: i8,
    y_sign: i8,
    pub(crate) settle_s: f64,
}

impl CameraSetup {
    /// How the image axes lie to the stage axes.
    pub(crate) fn senses(&self) -> [Sense; 2] {
        [self.x_sign, self.y_sign].map(|sign| if sign < 0 { Sense::Opposite } else { Sense::Same })
    }

    /// Field of view, mm.
    pub(crate) fn field_mm(&self) -> [f64; 2] {
        [self.width_px, self.height_px].map(|px| f64::from(px) * self.pixel_um * 1e-3)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    controller: ControllerFile,
    #[serde(rename = "plant")]
    _plant: serde::de::IgnoredAny,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ControllerFile {
    tick_hz: f64,
    dwell_ms: f64,
    settle_timeout_ms: f64,
    host_timeout_ms: f64,
    x: AxisFile,
    y: AxisFile,
    camera: CameraSetup,
}

/// `[controller.x.encoder]`: an axis without one is counted from square signals.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum EncoderFile {
    Digital,
    Analogue(Analogue),
}

impl EncoderFile {
    fn settings(&self) -> Encoder {
        match *self {
            Self::Digital => Encoder::Digital,
            Self::Analogue(analogue) => Encoder::Analogue(analogue),
        }
    }
}

/// `[controller.x.motor]`: an axis without one has a stepper.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum MotorFile {
    Stepper,
    Dc { full_speed_mm_s: f64, friction_mm_s: f64 },
}

impl MotorFile {
    fn settings(&self) -> Motor {
        match *self {
            Self::Stepper => Motor::Stepper,
            Self::Dc { full_speed_mm_s, friction_mm_s } => Motor::Dc { full_speed_mm_s, friction_mm_s },
        }
    }
}

/// The keys of [`AxisSettings`] as they stand in a file.
macro_rules! axis_file {
    ($($key:ident),* $(,)?) => {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct AxisFile {
            $($key: f64,)*
            decode: u8,
            filter_ns: u32,
            illegal_transitions: u16,
            encoder: Option<EncoderFile>,
            motor: Option<MotorFile>,
        }

        impl AxisFile {
            fn settings(&self) -> AxisSettings {
                AxisSettings {
                    $($key: self.$key,)*
                    decode: self.decode,
                    filter_ns: self.filter_ns,
                    illegal_transitions: self.illegal_transitions,
                    encoder: self.encoder.as_ref().map_or(Encoder::Digital, EncoderFile::settings),
                    motor: self.motor.as_ref().map_or(Motor::Stepper, MotorFile::settings),
                }
            }
        }
    };
}

axis_file!(
    count_um,
    step_um,
    travel_low_mm,
    travel_high_mm,
    travel_margin_mm,
    speed_mm_s,
    acceleration_mm_s2,
    jerk_mm_s3,
    kp_per_s,
    ki_per_s2,
    kd,
    feed_forward,
    dead_band_um,
    in_position_um,
    following_error_um,
    encoder_lost_um,
    stall_um,
    home_fast_mm_s,
    home_slow_mm_s,
    home_search_mm,
    home_back_off_mm,
    home_index_search_mm,
    home_index_mm,
    switch_press_ms,
    switch_release_ms,
);

/// Loads a built-in preset or a file.
pub(crate) fn load(name_or_file: &str) -> Result<Preset, Failure> {
    if let Some((name, text)) = BUILT_IN.iter().find(|(name, _)| *name == name_or_file) {
        return read(name, name, text).map_err(|error| told(&error));
    }
    let path = Path::new(name_or_file);
    if !path.exists() {
        return Err(unknown(name_or_file));
    }
    let text = std::fs::read_to_string(path)
        .map_err(|error| anyhow::anyhow!("{name_or_file}: the preset cannot be read: {error}"))?;
    let name = path.file_stem().map_or_else(|| name_or_file.into(), |stem| stem.to_string_lossy());
    read(&name, name_or_file, &text).map_err(|error| told(&error))
}

/// A fault in the same form as that of any other file: file, line, what is wrong.
fn told(error: &PresetError) -> Failure {
    let line = error.line.map(|line| format!(", line {line}")).unwrap_or_default();
    Failure::work(format!("{}{line}: {}", error.file, one_line(&error.message)))
}

fn unknown(name: &str) -> Failure {
    let nearest = BUILT_IN
        .iter()
        .map(|(known, _)| *known)
        .max_by(|a, b| strsim::jaro_winkler(name, a).total_cmp(&strsim::jaro_winkler(name, b)))
        .unwrap_or_default();
    Failure::usage(format!(
        "--preset {name}: there is no such preset and no such file; the nearest preset is `{nearest}`"
    ))
}

/// Reads both halves of a preset.
fn read(name: &str, file: &str, text: &str) -> Result<Preset, PresetError> {
    let both = || {
        let controller = read_controller(file, text)?;
        Ok(Preset { name: name.to_owned(), controller, plant: Plant::read(file, text)? })
    };
    let preset = both().map_err(|error| in_plain_words(error, text))?;
    match toml::from_str(text).ok().and_then(|whole| not_finite(&whole, "")) {
        Some((table, key)) => {
            let line = abbe_twin::plant::line_of(text, &format!("[{table}]"), &key);
            let message = format!("`{key}` in [{table}] is not a finite number");
            Err(PresetError { file: file.to_owned(), line, message })
        }
        None => Ok(preset),
    }
}

/// What the parser expects, and the same for people.
const KINDS: [(&str, &str); 7] = [
    ("expected f64", "expected a number"),
    ("expected u64", "expected a whole number from 0 up"),
    ("expected u32", "expected a whole number from 0 up"),
    ("expected u16", "expected a whole number from 0 to 65535"),
    ("expected u8", "expected a whole number from 0 to 255"),
    ("expected i8", "expected a whole number from -128 to 127"),
    ("expected a boolean", "expected true or false"),
];

/// The parser speaks of fields where the file has keys, and does not name the key whose value it cannot take.
fn in_plain_words(mut error: PresetError, text: &str) -> PresetError {
    error.message = error.message.replace("missing field `", "missing key `");
    if error.message.starts_with("invalid ") {
        let line = error.line.and_then(|line| text.lines().nth(line - 1));
        if let Some((key, _)) = line.and_then(|line| line.split_once('=')) {
            let message =
                KINDS.iter().fold(error.message, |message, (kind, words)| message.replace(kind, words));
            error.message = format!("`{}`: {message}", key.trim());
        }
    }
    error
}

/// Table and key of the first number that is NaN or infinite.
fn not_finite(table: &toml::Table, name: &str) -> Option<(String, String)> {
    table.iter().find_map(|(key, value)| match value {
        toml::Value::Float(number) if !number.is_finite() => Some((name.to_owned(), key.clone())),
        toml::Value::Table(below) if name.is_empty() => not_finite(below, key),
        toml::Value::Table(below) => not_finite(below, &format!("{name}.{key}")),
        _ => None,
    })
}

fn read_controller(file: &str, text: &str) -> Result<Controller, PresetError> {
    let read: File = toml::from_str(text).map_err(|error| PresetError::from_toml(file, text, &error))?;
    let ControllerFile { tick_hz, dwell_ms, settle_timeout_ms, host_timeout_ms, x, y, camera } =
        read.controller;
    let settings = StageSettings {
        tick_hz,
        dwell_ms,
        settle_timeout_ms,
        host_timeout_ms,
        axes: [x.settings(), y.settings()],
    };
    let config = settings.build().map_err(|error| {
        let header =
            error.axis.map_or("[controller]".to_owned(), |axis| format!("[controller.{}]", ["x", "y"][axis]));
        let line = abbe_twin::plant::line_of(text, &header, error.key);
        PresetError { file: file.to_owned(), line, message: format!("{error}, not {}", error.value) }
    })?;
    check_camera(&camera).map_err(|(key, message)| PresetError {
        file: file.to_owned(),
        line: abbe_twin::plant::line_of(text, "[controller.camera]", key),
        message,
    })?;
    Ok(Controller { settings, config, camera })
}

fn check_camera(camera: &CameraSetup) -> Result<(), (&'static str, String)> {
    let wrong = |key, value: f64, accepted| {
        Err((key, format!("{key} = {value} is not accepted: it must be {accepted}")))
    };
    if !(camera.pixel_um > 0.0 && camera.pixel_um <= 1000.0) {
        return wrong("pixel_um", camera.pixel_um, "more than 0, at most 1000 µm");
    }
    for (key, value) in [("width_px", camera.width_px), ("height_px", camera.height_px)] {
        if !(16..=20_000).contains(&value) {
            return wrong(key, f64::from(value), "16 … 20000");
        }
    }
    for (key, sign) in [("x_sign", camera.x_sign), ("y_sign", camera.y_sign)] {
        if sign.abs() != 1 {
            return wrong(key, f64::from(sign), "1 or -1");
        }
    }
    if !(0.0..=60.0).contains(&camera.settle_s) {
        return wrong("settle_s", camera.settle_s, "0 … 60 s");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text() -> String {
        BUILT_IN[0].1.to_owned()
    }

    /// Every leaf of a table, as a path of keys.
    fn leaves(value: &toml::Value, path: &[String], found: &mut Vec<Vec<String>>) {
        match value {
            toml::Value::Table(table) => {
                for (key, value) in table {
                    leaves(value, &[path, std::slice::from_ref(key)].concat(), found);
                }
            }
            _ => found.push(path.to_vec()),
        }
    }

    fn changed(value: &toml::Value) -> toml::Value {
        match value {
            // No camera sees more than all light.
            toml::Value::Float(v) if *v > 0.9 && *v < 1.0 => toml::Value::Float(v - 0.01),
            toml::Value::Float(v) => toml::Value::Float(v * 1.25 + 0.01),
            toml::Value::Integer(v) => toml::Value::Integer(if *v == 1 { -1 } else { v - 1 }),
            toml::Value::Boolean(v) => toml::Value::Boolean(!v),
            other => other.clone(),
        }
    }

    fn at<'a>(value: &'a mut toml::Value, path: &[String]) -> &'a mut toml::Value {
        path.iter().fold(value, |value, key| &mut value[key.as_str()])
    }

    /// Keys that cannot change alone: what a motor is, and the count that comparators make of a period.
    const TIED: [&str; 3] = ["kind", "grating_um", "count_um"];

    #[test]
    fn every_plant_key_leaves_the_controller_unchanged_and_changes_the_twin() {
        for (name, text) in BUILT_IN {
            let original: toml::Value = toml::from_str(text).unwrap();
            let mut paths = Vec::new();
            leaves(&original["plant"], &["plant".to_owned()], &mut paths);
            if name == "litho-120" {
                paths.retain(|path| !TIED.contains(&path.last().unwrap().as_str()));
            }
            assert!(paths.len() > 90, "{}", paths.len());
            let before = read("m", "m", text).unwrap();
            for path in paths {
                let mut altered = original.clone();
                let place = at(&mut altered, &path);
                *place = changed(place);
                let altered = toml::to_string(&altered).unwrap();
                let after = read("m", "m", &altered).unwrap_or_else(|error| panic!("{path:?}: {error}"));
                assert_eq!(after.controller.settings, before.controller.settings, "{path:?}");
                assert_eq!(after.controller.config, before.controller.config, "{path:?}");
                assert_eq!(after.controller.camera, before.controller.camera, "{path:?}");
                assert_ne!(
                    format!("{:?}", after.plant),
                    format!("{:?}", before.plant),
                    "{path:?} is not read"
                );
            }
        }
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_its_nearest_neighbour() {
        for (from, to, nearest) in [
            ("speed_mm_s = 20.0", "sped_mm_s = 20.0", "speed_mm_s"),
            ("backlash_um = 3.0", "backlsh_um = 3.0", "backlash_um"),
        ] {
            let bad = text().replacen(from, to, 1);
            let line = 1 + bad[..bad.find(to).unwrap()].matches('\n').count();
            let error = read("m", "m.toml", &bad).unwrap_err();
            assert_eq!(error.line, Some(line), "{error}");
            assert!(error.message.contains(nearest), "{error}");
        }
    }

    #[test]
    fn a_value_that_no_stage_can_have_is_named_with_its_line() {
        let bad = text().replacen("jerk_mm_s3 = 20000.0", "jerk_mm_s3 = -1.0", 1);
        let error = read("m", "m.toml", &bad).unwrap_err();
        assert!(error.line.is_some() && error.to_string().contains("jerk_mm_s3"), "{error}");
        assert!(error.to_string().ends_with("a positive number, not -1"), "{error}");
        let bad = text().replacen("mass_kg = 3.2", "mass_kg = nan", 1);
        let error = read("m", "m.toml", &bad).unwrap_err();
        assert!(error.line.is_some() && error.to_string().contains("mass_kg"), "{error}");
    }

    #[test]
    fn the_built_in_preset_is_the_stage_that_the_scenarios_drive() {
        let preset = read("m", "m", &text()).unwrap();
        assert_eq!(preset.controller.settings, StageSettings::default());
    }

    #[test]
    fn an_unknown_preset_names_the_nearest() {
        let failure = load("microscop-100").unwrap_err();
        assert_eq!(failure.status(), 2);
        assert!(format!("{failure:?}").contains("microscope-100"));
    }
}
