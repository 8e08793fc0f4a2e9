//! A two-phase hybrid stepper with microstepping.
//!
//! T = −Tm sin(Nr (θ − θcmd)) + Td sin(4 Nr θ): a spring that lets go. Pulled beyond half a period it falls into the
//! next one, four full steps away: a stall. Driven fast, the current cannot follow and Tm falls.

use crate::plant::MotorPlant;
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
    /// Peak of the microstep error, turns; most of it repeats every full step, some every four.
    microstep: f64,
    microstep_phase: f64,
    /// Shaft angle, turns.
    pub angle: f64,
    /// Shaft speed, turns/s.
    pub speed: f64,
    /// Pulses when the shaft was aligned.
    aligned_pulses: i32,
    /// Commanded angle at that moment, turns.
    aligned_angle: f64,
    energised: bool,
}

impl Stepper {
    /// A motor at rest; `microstep_phase` in turns.
    pub fn new(plant: &MotorPlant, inertia_kg_m2: f64, microstep_phase: f64) -> Self {
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
            microstep: plant.microstep_error / f64::from(plant.full_steps),
            microstep_phase,
            angle: 0.0,
            speed: 0.0,
            aligned_pulses: 0,
            aligned_angle: 0.0,
            energised: false,
        }
    }

    /// Switches the current on or off. Switched on, the field starts at the tooth that is nearest to the rotor.
    pub fn energise(&mut self, on: bool, pulses: i32) {
        if on && !self.energised {
            self.aligned_pulses = pulses;
            // The driver's table starts at a full step: the rotor jumps there, up to two full steps away.
            let full_step = 1.0 / (4.0 * self.teeth);
            self.aligned_angle = (self.angle / full_step).round() * full_step;
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
        let commanded = f64::from(pulses.wrapping_sub(self.aligned_pulses)) * self.pulse + self.aligned_angle;
        let phase = self.teeth * commanded + self.microstep_phase;
        commanded + self.microstep * (0.85 * sin_turns(4.0 * phase) + 0.2 * sin_turns(phase))
    }
}
