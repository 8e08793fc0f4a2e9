//! A brushed DC motor behind an H-bridge (row B1).
//!
//! L di/dt = U − R i − k ω, J ω̇ = k i − b ω − load. The bridge's dead time takes a little of every voltage, towards zero.
//! Off is open: no current, no torque.

use crate::plant::DcMotorPlant;
use core::f64::consts::TAU;

/// A motor with its shaft; angles in turns, torques in N·m.
#[derive(Clone, Debug)]
pub struct DcMotor {
    settings: DcMotorPlant,
    /// kg·m².
    inertia: f64,
    /// A.
    current: f64,
    on: bool,
    /// Shaft angle, turns.
    pub angle: f64,
    /// Shaft speed, turns/s.
    pub speed: f64,
}

impl DcMotor {
    /// A motor at rest.
    pub fn new(settings: &DcMotorPlant) -> Self {
        let inertia = settings.inertia_kg_mm2 * 1e-6;
        Self { settings: settings.clone(), inertia, current: 0.0, on: false, angle: 0.0, speed: 0.0 }
    }

    /// Switches the bridge on or off.
    pub fn energise(&mut self, on: bool) {
        self.on = on;
        if !on {
            self.current = 0.0;
        }
    }

    /// One step of `dt` seconds at a duty of −1 … 1 with `load` (N·m, against positive rotation).
    pub fn step(&mut self, duty: f64, load: f64, dt: f64) {
        let s = &self.settings;
        if self.on {
            let wanted = duty * s.supply_v;
            let volts = wanted - wanted.clamp(-s.dead_time_v, s.dead_time_v);
            let back = s.constant_nm_a * self.speed * TAU;
            // Implicit: the winding is quicker than a step is long.
            let inductance = s.inductance_mh * 1e-3 / dt;
            self.current = (inductance * self.current + volts - back) / (inductance + s.resistance_ohm);
            self.current = self.current.clamp(-s.current_limit_a, s.current_limit_a);
        }
        let torque = s.constant_nm_a * self.current - load - s.viscous_nm_s * self.speed * TAU;
        self.speed += torque / self.inertia * dt / TAU;
        self.angle += self.speed * dt;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 5e-5;

    fn plant() -> DcMotorPlant {
        DcMotorPlant {
            supply_v: 12.0,
            resistance_ohm: 4.0,
            inductance_mh: 0.6,
            constant_nm_a: 0.02,
            inertia_kg_mm2: 2.0,
            viscous_nm_s: 1e-6,
            dead_time_v: 0.2,
            current_limit_a: 2.5,
        }
    }

    fn run(duty: f64, load: f64, seconds: f64) -> DcMotor {
        let mut motor = DcMotor::new(&plant());
        motor.energise(true);
        for _ in 0..(seconds / DT) as u32 {
            motor.step(duty, load, DT);
        }
        motor
    }

    #[test]
    fn the_speed_follows_the_voltage_less_the_dead_time() {
        for duty in [0.25, -0.5, 1.0] {
            let volts = duty * 12.0 - 0.2 * f64::signum(duty);
            let expected = volts / 0.02 / TAU;
            let motor = run(duty, 0.0, 2.0);
            assert!((motor.speed / expected - 1.0).abs() < 0.02, "{duty}: {} {expected}", motor.speed);
        }
        assert_eq!(run(0.01, 0.0, 0.5).speed, 0.0, "inside the dead time nothing moves");
    }

    #[test]
    fn a_load_costs_speed_and_the_bridge_limits_the_current() {
        let slope = 4.0 / (0.02 * 0.02) / TAU;
        let motor = run(0.5, 0.01, 2.0);
        assert!((run(0.5, 0.0, 2.0).speed - motor.speed - 0.01 * slope).abs() < 0.5, "{}", motor.speed);
        assert!((motor.current - 0.5).abs() < 0.01, "{}", motor.current);
        // Held back by more than it can: the current stands at the limit, not at 12 V / 4 Ω.
        assert!((run(1.0, 1.0, 0.01).current - 2.5).abs() < 1e-9);
    }

    #[test]
    fn off_has_no_torque() {
        let mut motor = run(1.0, 0.0, 1.0);
        motor.energise(false);
        let before = motor.speed;
        motor.step(1.0, 0.0, DT);
        assert!(motor.speed <= before && motor.speed > 0.99 * before);
    }
}
