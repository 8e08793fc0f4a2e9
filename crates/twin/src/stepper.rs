//! A two-phase hybrid stepper with microstepping.
//!
//! T = −Tm sin(Nr (θ − θcmd)) + Td sin(4 Nr θ): a spring that lets go. Pulled beyond half a period it falls into the
//! next one, four full steps away: a stall. Driven fast, the current cannot follow and Tm falls.

use crate::plant::StepperPlant;
use crate::trig::sin_turns;

/// A motor with its shaft; angles in turns, torques in N·m.
#[derive(Clone, Debug)]
pub struct Stepper {
    /// Rotor teeth, Nr: a quarter of the full steps of a turn.
    teeth: f64,
    holding: f64,
    detent: f64,
    /// Speed at which the torque has fallen to 1/√2, turns/s.
    corner: f64,
    /// kg·m².
    inertia: f64,
    /// N·m·s/rad.
    damping: f64,
    /// Turns of one step pulse.
    pulse: f64,
    /// Pulses in a full step.
    microsteps: i64,
    /// How far the field is from where it should be at each pulse of an electrical turn, turns of the shaft.
    field_error: Vec<f64>,
    /// Shaft angle, turns.
    pub angle: f64,
    /// Shaft speed, turns/s.
    pub speed: f64,
    /// Emitted pulses when the current was switched on.
    aligned_pulses: i32,
    /// The field at that moment, pulses.
    aligned_field: i64,
    energised: bool,
}

impl Stepper {
    /// A motor at rest; `microstep_phase` in turns.
    pub fn new(plant: &StepperPlant, inertia_kg_m2: f64, microstep_phase: f64) -> Self {
        let teeth = f64::from(plant.full_steps) / 4.0;
        let stiffness = plant.holding_torque_nm * teeth;
        let damping = 2.0 * plant.damping_ratio * (stiffness * inertia_kg_m2).sqrt();
        Self {
            teeth,
            holding: plant.holding_torque_nm,
            detent: plant.detent_torque_nm,
            corner: plant.corner_rev_s,
            inertia: inertia_kg_m2,
            damping,
            pulse: 1.0 / (f64::from(plant.full_steps) * f64::from(plant.microsteps)),
            microsteps: i64::from(plant.microsteps),
            field_error: field_error(plant, microstep_phase),
            angle: 0.0,
            speed: 0.0,
            aligned_pulses: 0,
            aligned_field: 0,
            energised: false,
        }
    }

    /// Switches the current on or off. Switched on, the field starts at the electrical turn nearest to the rotor.
    pub fn energise(&mut self, on: bool, pulses: i32) {
        if on && !self.energised {
            self.aligned_pulses = pulses;
            // The driver's table starts at one electrical angle: the rotor jumps there, up to two full steps away.
            let turn = 4 * self.microsteps;
            self.aligned_field = (self.angle / (self.pulse * turn as f64)).round() as i64 * turn;
        }
        self.energised = on;
    }

    /// One step of `dt` seconds with `load` (N·m, against positive rotation), at `pulses` emitted so far.
    pub fn step(&mut self, pulses: i32, load: f64, dt: f64) {
        let torque = self.torque(pulses) - load - self.damping * self.speed * core::f64::consts::TAU;
        self.speed += torque / self.inertia * dt / core::f64::consts::TAU;
        self.angle += self.speed * dt;
    }

    fn torque(&self, pulses: i32) -> f64 {
        let detent = self.detent * sin_turns(4.0 * self.teeth * self.angle);
        if !self.energised {
            return detent;
        }
        let lag = self.teeth * (self.angle - self.field(pulses));
        let slow = self.speed / self.corner;
        let holding = self.holding / (1.0 + slow * slow).sqrt();
        detent - holding * sin_turns(lag)
    }

    /// Where the field points, turns of the shaft.
    fn field(&self, pulses: i32) -> f64 {
        let pulse = i64::from(pulses.wrapping_sub(self.aligned_pulses)) + self.aligned_field;
        let error = self.field_error[pulse.rem_euclid(self.field_error.len() as i64) as usize];
        pulse as f64 * self.pulse + error
    }
}

/// Most of the microstep error repeats every full step, some every electrical turn of four.
fn field_error(plant: &StepperPlant, phase: f64) -> Vec<f64> {
    let peak = plant.microstep_error / f64::from(plant.full_steps);
    let pulses = 4 * plant.microsteps;
    let at = |pulse: u32| f64::from(pulse) / f64::from(pulses) + phase;
    (0..pulses).map(|pulse| peak * (0.85 * sin_turns(4.0 * at(pulse)) + 0.2 * sin_turns(at(pulse)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 2e-5;
    /// Four full steps, one electrical turn.
    const PERIOD: f64 = 1.0 / 50.0;

    fn motor() -> Stepper {
        let plant = StepperPlant {
            full_steps: 200,
            microsteps: 16,
            holding_torque_nm: 0.07,
            detent_torque_nm: 0.003,
            corner_rev_s: 15.0,
            inertia_kg_mm2: 1.8,
            damping_ratio: 0.05,
            microstep_error: 0.04,
        };
        let mut motor = Stepper::new(&plant, 1.8e-6, 0.0);
        motor.energise(true, 0);
        motor
    }

    fn run(motor: &mut Stepper, pulses: i32, load: f64, seconds: f64) {
        for _ in 0..(seconds / DT) as u32 {
            motor.step(pulses, load, DT);
        }
    }

    #[test]
    fn follows_its_pulses_to_a_part_of_a_step_and_bends_under_load() {
        let mut motor = motor();
        for pulses in 0..=3200 {
            run(&mut motor, pulses, 0.0, 2e-4);
        }
        run(&mut motor, 3200, 0.0, 0.3);
        let error = motor.angle - 1.0;
        // 4 % of a full step, and what the detent adds.
        assert!(error.abs() < 0.08 / 200.0, "{error}");
        run(&mut motor, 3200, 0.035, 0.3);
        let bent = motor.angle - 1.0;
        // Half the holding torque: a twelfth of a period back.
        assert!((bent + PERIOD / 12.0).abs() < PERIOD / 50.0, "{bent}");
    }

    #[test]
    fn lets_go_under_overload_and_is_whole_periods_away_afterwards() {
        let mut motor = motor();
        run(&mut motor, 0, 0.0, 0.2);
        let rest = motor.angle;
        run(&mut motor, 0, 0.1, 0.02);
        run(&mut motor, 0, 0.0, 0.5);
        let periods = (motor.angle - rest) / PERIOD;
        assert!(periods < -0.5, "{periods}");
        assert!((periods - periods.round()).abs() < 0.02, "{periods}");
    }

    #[test]
    fn rings_at_its_resonance_with_little_damping() {
        let mut motor = motor();
        run(&mut motor, 0, 0.0, 0.2);
        let rest = motor.angle;
        motor.speed = 0.05;
        let (mut crossings, mut before, mut first, mut last) = (0, 0.0, 0.0f64, 0.0f64);
        for step in 0..5000 {
            motor.step(0, 0.0, DT);
            let now = motor.angle - rest;
            crossings += u32::from(before <= 0.0 && now > 0.0 && step > 0);
            let peak = if step < 500 { &mut first } else { &mut last };
            if !(500..4500).contains(&step) {
                *peak = peak.max(now.abs());
            }
            before = now;
        }
        // √(Nr Tm / J) / 2π = 222 Hz, a little less with the detent; 0.1 s hold some 20 of its periods.
        assert!((18..=24).contains(&crossings), "{crossings}");
        assert!(last < 0.2 * first && last > 0.0001 * first, "{last} of {first}");
    }

    #[test]
    fn without_current_it_only_cogs() {
        let mut motor = motor();
        motor.energise(false, 0);
        run(&mut motor, 0, 0.01, 0.05);
        assert!(motor.angle < -0.1, "{}", motor.angle);
    }
}
