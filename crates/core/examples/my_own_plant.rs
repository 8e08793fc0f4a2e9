//! The controller drives a plant of your own: here a slide with mass, friction, backlash, a quantised encoder, a
//! reference mark and a limit switch, in fifty lines.
//!
//! `cargo run --release -p abbe-core --example my_own_plant`
//!
//! What each field means is told in `abbe_core::edge`. The numbers of the plant are in SI units; its encoder, screw and
//! tick are those of the default settings: counts of 0.1 µm, step pulses of 312.5 nm, 10 kHz.

use abbe_core::design::StageSettings;
use abbe_core::edge::{Actuation, AxisInputs, Inputs, Outputs, StepRate};
use abbe_core::{Command, Controller, Pos, Status, background};

const COUNT_M: f64 = 0.1e-6;
const STEP_M: f64 = 312.5e-9;
/// At power-on the slide stands so far above its reference mark.
const START_M: f64 = 3e-3;

/// The plant: the slide, and the phase of its motor in step pulses with 16 fractional bits.
struct Slide {
    tick: u32,
    phase: i64,
    place_m: f64,
    speed_m_s: f64,
}

impl Slide {
    fn step(&mut self, outputs: &Outputs<1>) -> Inputs<1> {
        let (before_m, output) = (self.place_m, outputs.axes[0]);
        let Actuation::Steps(StepRate(rate)) = output.actuation else { panic!("this slide has a stepper") };
        for slice in 1..=10 {
            let pulses = (self.phase + i64::from(rate) * slice / 10) >> 16;
            let gap_m = START_M + pulses as f64 * STEP_M - self.place_m;
            let spring_n = if output.enable { 20e6 * (gap_m - gap_m.clamp(-1.5e-6, 1.5e-6)) } else { 0.0 };
            let friction_n = 4.0 * (self.speed_m_s / 1e-4).tanh() + 400.0 * self.speed_m_s;
            self.speed_m_s += (spring_n - friction_n) / 5.0 * 1e-5;
            self.place_m += self.speed_m_s * 1e-5;
        }
        (self.phase, self.tick) = (self.phase + i64::from(rate), self.tick.wrapping_add(1));
        let axis = AxisInputs {
            counter: (self.place_m / COUNT_M).floor() as i64 as u32,
            index: ((before_m < 0.0) != (self.place_m < 0.0)).then_some(0),
            pulses: (self.phase >> 16) as i32,
            limit_low: self.place_m < -2e-3,
            ..AxisInputs::default()
        };
        Inputs { axes: [axis], ..Inputs::at_rest(self.tick) }
    }
}

/// Homes and moves to 8 mm; what the controller says at the end, and where the slide truly is, mm.
pub(crate) fn drive() -> (Status<1>, f64) {
    let config = StageSettings::default().build().expect("the default settings are consistent");
    let mut slide = Slide { tick: 0, phase: 0, place_m: START_M, speed_m_s: 0.0 };
    let (mut controller, mut outputs) = (Controller::new(config), Outputs::OFF);
    for command in [Command::Enable, Command::Home, Command::MoveTo([Pos::from_mm(8.0)])] {
        outputs = controller.tick(&slide.step(&outputs));
        controller.command(command).expect("the controller is ready for it");
        while controller.status().state.is_busy() {
            outputs = controller.tick(&slide.step(&outputs));
            background::advance(&mut controller);
        }
        println!("{command:?}: {}, truly at {:.6} mm", controller.status().state, slide.place_m * 1e3);
    }
    (controller.status(), slide.place_m * 1e3)
}

fn main() {
    drive();
}
