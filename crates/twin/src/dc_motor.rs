//! A brushed motor on an H-bridge.
//!
//! L di/dt = v − R i − K ω and T = K i, with one constant K for torque and back EMF, so that what the supply gives is heat
//! in the winding and work at the shaft. The bridge is the mean over a period of its PWM, whose ripple the winding's
//! inductance and the rotor's inertia smooth; its dead time takes a fixed voltage from every output, and all of a small
//! one. Brushes, bearings and a preloaded nut drag the rotor with dry friction, so it stands by itself.

use crate::plant::DcPlant;
use crate::trig::sin_turns;
use core::f64::consts::TAU;

/// Duty of the whole supply.
const FULL_DUTY: f64 = 32_768.0;

/// A motor with its shaft; angles in turns, torques in N·m.
#[derive(Clone, Debug)]
pub struct DcMotor {
    supply: f64,
    resistance: f64,
    /// H.
    inductance: f64,
    /// N·m/A, V·s/rad.
    constant: f64,
    /// kg·m².
    inertia: f64,
    drag: f64,
    ripple: f64,
    bars: f64,
    dead_zone: f64,
    /// Shaft angle, turns.
    pub angle: f64,
    /// Shaft speed, turns/s.
    pub speed: f64,
    /// A.
    current: f64,
    /// Voltage of the bridge; none when it is off.
    voltage: Option<f64>,
}

impl DcMotor {
    /// A motor at rest, its bridge off.
    pub fn new(plant: &DcPlant) -> Self {
        Self {
            supply: plant.supply_v,
            resistance: plant.resistance_ohm,
            inductance: plant.inductance_mh * 1e-3,
            constant: plant.constant_nm_a,
            inertia: plant.inertia_kg_mm2 * 1e-6,
            drag: plant.drag_nm,
            ripple: plant.ripple,
            bars: f64::from(plant.bars),
            dead_zone: plant.dead_zone_v,
            angle: 0.0,
            speed: 0.0,
            current: 0.0,
            voltage: None,
        }
    }

    /// Duty of the bridge, full scale ±2¹⁵. A bridge that is off is open, not a short circuit: it does not brake.
    pub fn energise(&mut self, on: bool, duty: i16) {
        self.voltage = on.then(|| {
            let wanted = self.supply * f64::from(duty) / FULL_DUTY;
            wanted - wanted.clamp(-self.dead_zone, self.dead_zone)
        });
    }

    /// One step of `dt` seconds with `load` (N·m, against positive rotation).
    pub fn step(&mut self, load: f64, dt: f64) {
        let constant = self.constant * (1.0 + self.ripple * sin_turns(self.bars * self.angle));
        self.step_current(constant, dt);
        let driven = self.speed + (constant * self.current - load) / self.inertia * dt / TAU;
        // Dry friction takes away speed, at most all of it.
        let most = self.drag / self.inertia * dt / TAU;
        self.speed = driven - driven.clamp(-most, most);
        self.angle += self.speed * dt;
    }

    /// The winding's time constant is of the size of a step: its current is solved in closed form.
    fn step_current(&mut self, constant: f64, dt: f64) {
        // The current of an open bridge flows back into the supply, and is gone before a step ends.
        self.current = self.voltage.map_or(0.0, |voltage| {
            let settled = (voltage - constant * self.speed * TAU) / self.resistance;
            settled + (self.current - settled) * libm::exp(-self.resistance / self.inductance * dt)
        });
    }

    /// Current of the winding, A.
    pub fn current(&self) -> f64 {
        self.current
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 5e-5;

    fn plant() -> DcPlant {
        DcPlant {
            supply_v: 12.0,
            resistance_ohm: 8.0,
            inductance_mh: 4.0,
            constant_nm_a: 0.1,
            inertia_kg_mm2: 12.0,
            drag_nm: 0.01,
            ripple: 0.0,
            bars: 14,
            dead_zone_v: 0.25,
        }
    }

    fn run(motor: &mut DcMotor, load: f64, seconds: f64) {
        for _ in 0..(seconds / DT) as u32 {
            motor.step(load, DT);
        }
    }

    #[test]
    fn its_steady_speed_is_what_the_voltage_leaves_after_drag_and_dead_zone() {
        for (duty, load) in [(16_384, 0.0), (16_384, 0.02), (-16_384, 0.0), (32_767, 0.05)] {
            let mut motor = DcMotor::new(&plant());
            motor.energise(true, duty);
            run(&mut motor, load, 2.0);
            let sign = f64::from(duty).signum();
            let volts = 12.0 * f64::from(duty) / FULL_DUTY - 0.25 * sign;
            // ω = (v − R T/K)/K with T = load + drag.
            let expected = (volts - 8.0 * (load + 0.01 * sign) / 0.1) / 0.1 / TAU;
            assert!((motor.speed - expected).abs() < 1e-6, "{} {expected}", motor.speed);
        }
    }

    #[test]
    fn held_fast_it_draws_the_supply_over_the_resistance_and_gives_that_torque() {
        let mut motor = DcMotor::new(&plant());
        motor.energise(true, i16::MAX);
        let (amperes, torque) = ((12.0 * 32_767.0 / FULL_DUTY - 0.25) / 8.0, 0.1 * 11.75 / 8.0);
        // Five of its time constants of 0.5 ms while something holds the rotor.
        for step in 0..200 {
            motor.step(0.0, DT);
            motor.speed = 0.0;
            let risen = amperes * (1.0 - libm::exp(-f64::from(step + 1) * DT / 5e-4));
            assert!((motor.current() - risen).abs() < 1e-9, "{step}");
        }
        // A load of just that torque and the drag holds it; a little less does not.
        run(&mut motor, torque, 0.1);
        assert!(motor.speed.abs() < 1e-6, "{}", motor.speed);
        run(&mut motor, torque - 0.02, 0.1);
        assert!(motor.speed > 0.1, "{}", motor.speed);
    }

    #[test]
    fn what_the_supply_gives_is_heat_and_work_and_motion() {
        let mut motor = DcMotor::new(&DcPlant { ripple: 0.05, ..plant() });
        motor.energise(true, 20_000);
        let voltage = 12.0 * 20_000.0 / FULL_DUTY - 0.25;
        let (mut given, mut heat, mut work) = (0.0, 0.0, 0.0);
        let dt = 1e-6;
        for _ in 0..200_000 {
            motor.step(0.03, dt);
            given += voltage * motor.current * dt;
            heat += 8.0 * motor.current * motor.current * dt;
            work += (0.03 + 0.01) * motor.speed * TAU * dt;
        }
        let moving = 0.5 * 12e-6 * (motor.speed * TAU).powi(2) + 0.5 * 4e-3 * motor.current.powi(2);
        let sum = heat + work + moving;
        assert!((given / sum - 1.0).abs() < 1e-3, "{given} {sum}");
        assert!(work > 0.2 * given, "{work} of {given}");
    }

    #[test]
    fn it_sticks_below_the_dead_zone_and_the_drag_and_lets_go_above() {
        // 0.25 V are lost in the bridge, and 0.8 V more make the current of 0.01 N·m.
        for (volts, goes) in [(0.2, false), (1.0, false), (1.1, true)] {
            let mut motor = DcMotor::new(&plant());
            motor.energise(true, (volts / 12.0 * FULL_DUTY) as i16);
            run(&mut motor, 0.0, 0.2);
            assert_eq!(motor.angle > 0.0, goes, "{volts}");
        }
    }

    #[test]
    fn an_open_bridge_lets_it_run_out() {
        let mut motor = DcMotor::new(&plant());
        motor.energise(true, i16::MAX);
        run(&mut motor, 0.0, 1.0);
        let (speed, angle) = (motor.speed, motor.angle);
        motor.energise(false, i16::MAX);
        run(&mut motor, 0.0, 1.0);
        assert_eq!((motor.current(), motor.speed), (0.0, 0.0));
        // Only the drag brakes: ½ J ω² = T · angle.
        let way = 0.5 * 12e-6 * (speed * TAU).powi(2) / 0.01 / TAU;
        assert!(((motor.angle - angle) / way - 1.0).abs() < 0.01, "{} {way}", motor.angle - angle);
    }
}
