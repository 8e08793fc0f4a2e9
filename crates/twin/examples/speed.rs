//! How many times faster than real time the twin and the controller run together, on one core, with each preset.
//!
//! `cargo run --release -p abbe-twin --example speed`

#[path = "../tests/preset/mod.rs"]
mod preset;

use abbe_core::machine::State;
use abbe_core::{Command, Controller, Outputs, Pos, background};
use abbe_twin::{Plant, Twin};
use std::time::Instant;

/// How long each measurement is, s of the stage's time.
const SECONDS: f64 = 60.0;

struct Bench {
    twin: Twin,
    controller: Controller<2>,
    outputs: Outputs<2>,
    tick_hz: f64,
}

impl Bench {
    /// A stage that has homed.
    fn new(name: &str, preset: &str) -> Self {
        let plant = Plant::read(name, preset).expect("the built-in preset is valid");
        let settings = preset::settings(preset).expect("the built-in preset is valid");
        let config = settings.build().expect("its settings are valid");
        let controller = Controller::new(config);
        let twin = Twin::new(&plant, &config, 1);
        let mut bench = Self { twin, controller, outputs: Outputs::OFF, tick_hz: settings.tick_hz };
        bench.tick();
        bench.controller.command(Command::Home).expect("a stage that is off can home");
        bench.tick();
        while bench.controller.status().state == State::Homing {
            bench.tick();
        }
        bench
    }

    fn tick(&mut self) {
        let inputs = self.twin.step(&self.outputs);
        self.outputs = self.controller.tick(&inputs);
        background::advance(&mut self.controller);
    }

    /// Times real time, going so far forward and back for as long as it is measured; standing, if not at all.
    fn measure(&mut self, far_mm: f64) -> f64 {
        let (began, mut up) = (Instant::now(), false);
        for _ in 0..(SECONDS * self.tick_hz) as u32 {
            if far_mm > 0.0 && self.controller.status().state == State::Ready {
                up = !up;
                let to = Pos::from_mm(if up { 0.5 + far_mm } else { 0.5 });
                _ = self.controller.command(Command::MoveTo([to; 2]));
            }
            self.tick();
        }
        SECONDS / began.elapsed().as_secs_f64()
    }
}

fn main() {
    for (name, preset, speed_mm_s) in
        [("microscope-100", preset::MICROSCOPE_100, 20), ("litho-120", preset::LITHO_120, 5)]
    {
        let mut bench = Bench::new(name, preset);
        println!("{name}, standing: {:.0} × real time", bench.measure(0.0));
        for far_mm in [99.0, 10.0, 0.3] {
            let times = bench.measure(far_mm);
            println!("{name}, {far_mm} mm moves at up to {speed_mm_s} mm/s: {times:.0} × real time");
        }
        // A stage that has tripped stands still, and standing is fast.
        assert_eq!(bench.controller.status().fault, None, "{name}");
    }
}
