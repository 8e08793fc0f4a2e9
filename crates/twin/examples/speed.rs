//! How many times faster than real time the twin and the controller run together, on one core.
//!
//! `cargo run --release -p abbe-twin --example speed`

use abbe_core::design::StageSettings;
use abbe_core::machine::State;
use abbe_core::{Command, Controller, Outputs, Pos, background};
use abbe_twin::{Plant, Twin};
use std::time::Instant;

struct Bench {
    twin: Twin,
    controller: Controller<2>,
    outputs: Outputs<2>,
}

impl Bench {
    fn run(&mut self, ticks: u32, mut keep_going: impl FnMut(&mut Controller<2>) -> bool) -> u32 {
        for tick in 0..ticks {
            let inputs = self.twin.step(&self.outputs);
            self.outputs = self.controller.tick(&inputs);
            background::advance(&mut self.controller);
            if !keep_going(&mut self.controller) {
                return tick;
            }
        }
        ticks
    }
}

fn main() {
    let text = include_str!("../../../presets/microscope-100.toml");
    let plant = Plant::read("microscope-100", text).expect("the built-in preset is valid");
    let settings = StageSettings::<2>::default();
    let controller = Controller::new(settings.build().expect("the default stage is valid"));
    let twin = Twin::new(&plant, settings.tick_hz, 1);
    let mut bench = Bench { twin, controller, outputs: Outputs::OFF };
    bench.run(1, |_| true);
    bench.controller.command(Command::Home).expect("a stage that is off can home");
    bench.run(400_000, |controller| controller.status().state == State::Homing);

    let measure = |name: &str, bench: &mut Bench, step: &mut dyn FnMut(&mut Controller<2>)| {
        let (began, seconds) = (Instant::now(), 60.0);
        bench.run((seconds * settings.tick_hz) as u32, |controller| {
            step(controller);
            true
        });
        println!("{name}: {:.0} × real time", seconds / began.elapsed().as_secs_f64());
    };
    measure("standing", &mut bench, &mut |_| {});
    for (name, far_mm) in [("99 mm moves at 20 mm/s", 99.0), ("10 mm moves", 10.0), ("0.3 mm moves", 0.3)] {
        let mut up = false;
        measure(name, &mut bench, &mut |controller| {
            if controller.status().state == State::Ready {
                up = !up;
                let to = Pos::from_mm(if up { 0.5 + far_mm } else { 0.5 });
                _ = controller.command(Command::MoveTo([to; 2]));
            }
        });
    }
    // A stage that has tripped stands still, and standing is fast.
    assert_eq!(bench.controller.status().fault, None);
}
