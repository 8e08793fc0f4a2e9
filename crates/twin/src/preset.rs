//! The controller's half of a preset, for who runs a controller against the twin without the program `abbe`. That one
//! reads it more strictly, and says in which line a key is wrong.

use abbe_core::design::StageSettings;
use serde::de::Error as _;
use toml::de::Error;
use toml::{Table, Value};

/// What a preset tells the controller.
///
/// # Errors
/// The text is no TOML, or a setting is missing or of another kind.
pub fn settings(preset: &str) -> Result<StageSettings<2>, Error> {
    let mut stage = taken(&mut toml::from_str(preset)?, "controller")?;
    let axes = ["x", "y"].map(|name| taken(&mut stage, name).and_then(axis));
    let [x, y] = axes;
    stage.insert("axes".into(), Value::Array(vec![x?, y?]));
    Value::Table(stage).try_into()
}

fn axis(mut axis: Table) -> Result<Value, Error> {
    for (device, usual) in [("encoder", "Digital"), ("motor", "Stepper")] {
        let stated =
            if axis.contains_key(device) { by_name(taken(&mut axis, device)?) } else { usual.into() };
        axis.insert(device.into(), stated);
    }
    Ok(Value::Table(axis))
}

/// A preset names the kind in the table, the settings name the table after the kind.
fn by_name(mut device: Table) -> Value {
    let kind = device.remove("kind");
    match kind.as_ref().and_then(Value::as_str).unwrap_or_default() {
        "digital" => "Digital".into(),
        "stepper" => "Stepper".into(),
        "analogue" => Value::Table([("Analogue".into(), device.into())].into_iter().collect()),
        "dc" => Value::Table([("Dc".into(), device.into())].into_iter().collect()),
        // Refused by that name.
        other => other.into(),
    }
}

fn taken(from: &mut Table, name: &str) -> Result<Table, Error> {
    match from.remove(name) {
        Some(Value::Table(table)) => Ok(table),
        _ => Err(Error::custom(format!("there is no [{name}]"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use abbe_core::design::{Encoder, Motor};

    const MICROSCOPE_100: &str = include_str!("../../../presets/microscope-100.toml");
    const LITHO_120: &str = include_str!("../../../presets/litho-120.toml");

    #[test]
    fn the_microscope_is_the_default_stage() {
        assert_eq!(settings(MICROSCOPE_100).unwrap(), StageSettings::default());
    }

    #[test]
    fn devices_are_read_by_their_kind() {
        let [x, _] = settings(LITHO_120).unwrap().axes;
        assert!(matches!(x.encoder, Encoder::Analogue(analogue) if analogue.factor == 160), "{x:?}");
        assert_eq!(x.motor, Motor::Dc { full_speed_mm_s: 14.0, friction_mm_s: 1.5 });
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (preset, from, to, word) in [
            (MICROSCOPE_100, "[controller.y]", "[other]", "[y]"),
            (LITHO_120, "kd = 0.5", "", "`kd`"),
            (LITHO_120, "kind = \"analogue\"", "kind = \"magnetic\"", "`magnetic`"),
        ] {
            let preset = preset.replacen(from, to, 1);
            let error = settings(&preset).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
