//! The mechanics of one axis: motor, screw, slide, end stops.

use crate::dc_motor::DcMotor;
use crate::friction::LuGre;
use crate::noise::Noise;
use crate::plant::{AxisPlant, LoadPlant, MotorPlant};
use crate::stepper::Stepper;
use crate::trig::sin_turns;

/// What turns the screw.
#[derive(Clone, Debug)]
enum Motor {
    Stepper(Stepper),
    Dc(DcMotor),
}

impl Motor {
    /// Shaft angle, turns.
    fn angle(&self) -> f64 {
        match self {
            Self::Stepper(motor) => motor.angle,
            Self::Dc(motor) => motor.angle,
        }
    }

    /// Shaft speed, turns/s.
    fn speed(&self) -> f64 {
        match self {
            Self::Stepper(motor) => motor.speed,
            Self::Dc(motor) => motor.speed,
        }
    }

    fn turn_to(&mut self, angle: f64) {
        match self {
            Self::Stepper(motor) => motor.angle = angle,
            Self::Dc(motor) => motor.angle = angle,
        }
    }

    fn step(&mut self, pulses: i32, load: f64, dt: f64) {
        match self {
            Self::Stepper(motor) => motor.step(pulses, load, dt),
            Self::Dc(motor) => motor.step(load, dt),
        }
    }
}

/// The moving parts of an axis; the slide's place is in metres from the reference mark, by the true measure.
#[derive(Clone, Debug)]
pub struct Mechanics {
    motor: Motor,
    friction: LuGre,
    /// Metres a turn.
    lead: f64,
    /// N/m and N·s/m of screw, nut and bearings.
    stiffness: f64,
    damping: f64,
    /// Metres.
    backlash: f64,
    /// Metres, once a turn.
    wobble: f64,
    wobble_phase: f64,
    mass: f64,
    stops: [f64; 2],
    /// N, from outside: somebody's hand, a cable, a crash.
    pub push: f64,
    /// The slide cannot move.
    pub jammed: bool,
    place: f64,
    speed: f64,
    bristles: f64,
}

/// Stiffness (N/m) and damping (N·s/m) of the rubber end stops.
const STOP_STIFFNESS: f64 = 2e6;
const STOP_DAMPING: f64 = 2e3;

impl Mechanics {
    /// An axis at rest at `place_mm`, carrying `load`.
    pub fn new(plant: &AxisPlant, load: &LoadPlant, place_mm: f64, seed: u64, name: &str) -> Self {
        let mut noise = Noise::new(seed, &format!("mechanics {name}"));
        let extra = load.friction_n_kg * load.kg;
        let mass = plant.mass_kg + load.kg;
        let stiffness = plant.screw.stiffness_n_um * 1e6;
        let microstep_phase = noise.uniform(0.0, 1.0);
        let motor = match &plant.motor {
            MotorPlant::Stepper(motor) => {
                Motor::Stepper(Stepper::new(motor, motor.inertia_kg_mm2 * 1e-6, microstep_phase))
            }
            MotorPlant::Dc(motor) => Motor::Dc(DcMotor::new(motor)),
        };
        let lead = plant.screw.lead_mm * 1e-3;
        let mut mechanics = Self {
            motor,
            friction: LuGre {
                stiffness: plant.friction.presliding_n_um * 1e6,
                damping: plant.friction.bristle_damping_n_s_mm * 1e3,
                viscous: plant.friction.viscous_n_s_mm * 1e3,
                coulomb: plant.friction.coulomb_n + extra,
                breakaway: plant.friction.breakaway_n + extra,
                stribeck: plant.friction.stribeck_mm_s * 1e-3,
            },
            lead,
            stiffness,
            damping: 2.0 * plant.screw.damping_ratio * (stiffness * mass).sqrt(),
            backlash: plant.screw.backlash_um * 1e-6,
            wobble: plant.screw.once_per_turn_um * 1e-6,
            wobble_phase: noise.uniform(0.0, 1.0),
            mass,
            stops: [plant.stops.low_mm * 1e-3, plant.stops.high_mm * 1e-3],
            push: 0.0,
            jammed: false,
            place: place_mm * 1e-3,
            speed: 0.0,
            bristles: 0.0,
        };
        let nut = mechanics.place + noise.uniform(-0.5, 0.5) * mechanics.backlash;
        mechanics.turn_nut_to(nut);
        mechanics
    }

    /// Turns the motor to where the nut is at a place, m. A nut beyond the backlash would push the slide at power-on.
    fn turn_nut_to(&mut self, place: f64) {
        self.motor.turn_to(place / self.lead);
        // The screw's error of a turn is a thousandth of it: each time what is left of it becomes a hundredth.
        for _ in 0..4 {
            let left = (place - self.nut()) / self.lead;
            self.motor.turn_to(self.motor.angle() + left);
        }
    }

    /// Switches the power stage: a stepper starts at `pulses` emitted so far, a bridge has `duty`, full scale ±2¹⁵.
    pub fn energise(&mut self, on: bool, pulses: i32, duty: i16) {
        match &mut self.motor {
            Motor::Stepper(motor) => motor.energise(on, pulses),
            Motor::Dc(motor) => motor.energise(on, duty),
        }
    }

    /// One step of `dt` seconds.
    pub fn step(&mut self, pulses: i32, dt: f64) {
        let force = self.screw_force();
        self.motor.step(pulses, force * self.lead / core::f64::consts::TAU, dt);
        let friction = self.friction.force(&mut self.bristles, self.speed, dt);
        if self.jammed {
            self.speed = 0.0;
            return;
        }
        self.speed += (force + self.push - friction - self.stop_force()) / self.mass * dt;
        self.place += self.speed * dt;
    }

    /// Where the nut would put the slide without backlash, m.
    fn nut(&self) -> f64 {
        self.motor.angle() * self.lead + self.wobble * sin_turns(self.motor.angle() + self.wobble_phase)
    }

    /// Force of the nut on the slide, N: nothing inside the backlash.
    fn screw_force(&self) -> f64 {
        let ahead = self.nut() - self.place;
        let bent = ahead - ahead.clamp(-0.5 * self.backlash, 0.5 * self.backlash);
        if bent == 0.0 {
            return 0.0;
        }
        let force = self.stiffness * bent + self.damping * (self.motor.speed() * self.lead - self.speed);
        // Balls push, they do not pull.
        if bent > 0.0 { force.max(0.0) } else { force.min(0.0) }
    }

    fn stop_force(&self) -> f64 {
        let [low, high] = self.stops;
        let beyond = self.place - self.place.clamp(low, high);
        if beyond == 0.0 { 0.0 } else { STOP_STIFFNESS * beyond + STOP_DAMPING * self.speed }
    }

    /// The slide's place, µm.
    pub fn place_um(&self) -> f64 {
        self.place * 1e6
    }

    /// The slide's speed, mm/s.
    pub fn speed_mm_s(&self) -> f64 {
        self.speed * 1e3
    }
}
