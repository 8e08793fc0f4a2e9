//! Nothing is decoration: every key of `[plant]` changes what a controller, an instrument or the camera sees.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use abbe_core::{Command, Controller, Outputs, Pos, background};
use abbe_twin::camera::Camera;
use abbe_twin::instruments::Interferometer;
use abbe_twin::specimen::Specimen;
use abbe_twin::trig::sin_turns;
use abbe_twin::{Event, Plant, Twin};
use common::PRESET;
use rayon::prelude::*;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Something to look at.
struct Stripes;

impl Specimen for Stripes {
    fn rgb(&self, x_um: f64, y_um: f64) -> [f32; 3] {
        [sin_turns(x_um / 15.0), sin_turns(y_um / 11.0), sin_turns((x_um + y_um) / 37.0)]
            .map(|wave| 0.5 + 0.4 * wave as f32)
    }
}

/// Everything that can be seen of a twin, in one number.
struct Seen {
    twin: Twin,
    controller: Controller<2>,
    outputs: Outputs<2>,
    hash: DefaultHasher,
}

impl Seen {
    fn new(plant: &Plant, at_mm: f64) -> Self {
        let config = common::config();
        let controller = Controller::new(config);
        let twin = Twin::standing_at(plant, &config, 21, [at_mm; 2]);
        Self { twin, controller, outputs: Outputs::OFF, hash: DefaultHasher::new() }
    }

    fn tick(&mut self) {
        let inputs = self.twin.step(&self.outputs);
        self.outputs = self.controller.tick(&inputs);
        background::advance(&mut self.controller);
        for axis in inputs.axes {
            (axis.counter, axis.illegal, axis.glitches, axis.index).hash(&mut self.hash);
            (axis.pulses, axis.limit_low, axis.limit_high).hash(&mut self.hash);
        }
        inputs.temperatures_mk.hash(&mut self.hash);
    }

    fn ticks(&mut self, n: u32) {
        for _ in 0..n {
            self.tick();
        }
    }

    fn command(&mut self, command: Command<2>) {
        // An altered stage may trip; that shows, too.
        _ = self.controller.command(command);
        self.tick();
        while self.controller.status().state.is_busy() {
            self.tick();
        }
    }

    fn number(&mut self, number: f64) {
        number.to_bits().hash(&mut self.hash);
    }
}

/// Homes, moves, measures and looks; then somebody pushes the slides against the stops at the low end.
fn low_end(plant: &Plant) -> u64 {
    let mut seen = Seen::new(plant, 1.5);
    seen.tick();
    seen.command(Command::Home);
    let mut instruments = [0, 1].map(|axis| Interferometer::set_up(&seen.twin, axis, 1));
    for mm in [6.0, 2.0, 5.0] {
        seen.command(Command::MoveTo([Pos::from_mm(mm); 2]));
        seen.ticks(300);
        for instrument in &mut instruments {
            let read = instrument.read_um(&seen.twin);
            seen.number(read);
        }
    }
    // A picture in motion.
    _ = seen.controller.command(Command::MoveTo([Pos::from_mm(7.0); 2]));
    seen.ticks(1000);
    let camera = Camera::new(plant.camera.clone()).unwrap();
    let mut path = Vec::new();
    for _ in 0..(plant.camera.exposure_s * 1e4) as u32 {
        seen.tick();
        path.push(seen.twin.truth().table_um);
    }
    camera.expose(&Stripes, &path, 3).data.hash(&mut seen.hash);
    camera.true_pixel_of(path[0]).map(f64::to_bits).hash(&mut seen.hash);
    seen.command(Command::Disable);
    push(&mut seen, -400.0);
    seen.hash.finish()
}

/// A stage that is off is pushed over the switches against the stops at the high end.
fn high_end(plant: &Plant) -> u64 {
    let mut seen = Seen::new(plant, 101.5);
    push(&mut seen, 400.0);
    seen.hash.finish()
}

fn push(seen: &mut Seen, newton: f64) {
    for axis in 0..2 {
        seen.twin.happen(Event::Push { axis, newton }).unwrap();
    }
    seen.ticks(3000);
}

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

/// Another value of the same kind. What is drawn rarely grows tenfold, so that a short run meets it.
fn changed(key: &str, value: &toml::Value) -> toml::Value {
    match value {
        toml::Value::Float(v) if key.ends_with("probability") || key == "index_jitter_counts" => {
            toml::Value::Float(v * 10.0)
        }
        toml::Value::Float(v) => toml::Value::Float(if *v == 0.0 { 0.01 } else { v * 0.8 }),
        toml::Value::Integer(v) => toml::Value::Integer(if *v == 1 { -1 } else { v - 1 }),
        toml::Value::Boolean(v) => toml::Value::Boolean(!v),
        other => other.clone(),
    }
}

fn plant_of(preset: &toml::Value) -> Plant {
    Plant::read("decoration", &toml::to_string(preset).unwrap()).unwrap()
}

#[test]
fn every_key_of_the_plant_shows() {
    let mut preset: toml::Value = toml::from_str(PRESET).unwrap();
    // Keys of the load show only under one; a small frame shows as much as a large one.
    preset["plant"]["load"]["kg"] = toml::Value::Float(5.0);
    preset["plant"]["camera"]["width_px"] = toml::Value::Integer(128);
    preset["plant"]["camera"]["height_px"] = toml::Value::Integer(96);
    let mut paths = Vec::new();
    leaves(&preset["plant"], &[], &mut paths);
    assert!(paths.len() > 90, "{}", paths.len());
    let plain = plant_of(&preset);
    let before = (low_end(&plain), high_end(&plain));
    let unseen: Vec<String> = paths
        .par_iter()
        .filter(|path| {
            let mut altered = preset.clone();
            let place = path.iter().fold(&mut altered["plant"], |value, key| &mut value[key.as_str()]);
            *place = changed(path.last().unwrap(), place);
            let plant = plant_of(&altered);
            low_end(&plant) == before.0 && high_end(&plant) == before.1
        })
        .map(|path| path.join("."))
        .collect();
    assert!(unseen.is_empty(), "these keys change nothing: {unseen:#?}");
}
