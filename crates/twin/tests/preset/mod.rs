//! The presets, and their `[controller]` half as settings.

#![allow(dead_code, reason = "each test uses its own part")]

use abbe_core::design::{AxisSettings, StageSettings};
use toml::{Table, Value};

pub(crate) const MICROSCOPE_100: &str = include_str!("../../../../presets/microscope-100.toml");
pub(crate) const LITHO_120: &str = include_str!("../../../../presets/litho-120.toml");

/// What a preset tells the controller.
pub(crate) fn settings(preset: &str) -> StageSettings<2> {
    let preset: Table = toml::from_str(preset).unwrap();
    let controller = &preset["controller"];
    let number = |key: &str| controller[key].as_float().unwrap();
    StageSettings {
        tick_hz: number("tick_hz"),
        dwell_ms: number("dwell_ms"),
        settle_timeout_ms: number("settle_timeout_ms"),
        host_timeout_ms: number("host_timeout_ms"),
        axes: ["x", "y"].map(|name| axis(controller[name].as_table().unwrap().clone())),
    }
}

fn axis(mut axis: Table) -> AxisSettings {
    for (device, usual) in [("encoder", "Digital"), ("motor", "Stepper")] {
        let stated = axis.remove(device).map_or_else(|| usual.into(), |table| by_name(table, usual));
        axis.insert(device.into(), stated);
    }
    Value::Table(axis).try_into().unwrap()
}

/// A preset names the kind in the table, the settings name the table after the kind.
fn by_name(table: Value, usual: &str) -> Value {
    let Value::Table(mut table) = table else { panic!("a table") };
    match table.remove("kind").unwrap().as_str().unwrap() {
        "analogue" => Value::Table([("Analogue".into(), table.into())].into_iter().collect()),
        "dc" => Value::Table([("Dc".into(), table.into())].into_iter().collect()),
        _ => usual.into(),
    }
}
