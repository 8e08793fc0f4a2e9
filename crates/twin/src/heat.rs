//! Heat: a room that breathes, motors that warm up, glass and aluminium that follow.

use crate::noise::Noise;
use crate::plant::HeatPlant;
use crate::trig::sin_turns;

/// Temperatures of the twin; °C and seconds.
#[derive(Clone, Debug)]
pub struct Heat {
    settings: HeatPlant,
    phase: f64,
    time_s: f64,
    /// Share of the motors' final warmth, 0 … 1.
    motors: f64,
    scale_c: f64,
    structure_c: f64,
    /// Directions in which the motors' warmth pushes the table.
    drift: [f64; 2],
}

impl Heat {
    /// A stage that has stood in the room, switched off, for a day.
    pub fn new(settings: &HeatPlant, seed: u64) -> Self {
        let mut noise = Noise::new(seed, "heat");
        let phase = noise.uniform(0.0, 1.0);
        let sign = |noise: &mut Noise| if noise.chance(0.5) { 1.0 } else { -1.0 };
        let drift = [sign(&mut noise), sign(&mut noise)];
        let mut heat = Self {
            settings: settings.clone(),
            phase,
            time_s: 0.0,
            motors: 0.0,
            scale_c: 0.0,
            structure_c: 0.0,
            drift,
        };
        let room = heat.room_c();
        heat.scale_c = room;
        heat.structure_c = room;
        heat
    }

    /// `dt` seconds later, with the drives on or off.
    pub fn step(&mut self, dt: f64, drives_on: bool) {
        self.time_s += dt;
        let s = &self.settings;
        let (final_warmth, room) = (f64::from(u8::from(drives_on)), self.room_c());
        self.motors += (final_warmth - self.motors) * dt / s.motor_time_s;
        self.scale_c += (room - self.scale_c) * dt / s.scale_time_s;
        self.structure_c += (room - self.structure_c) * dt / s.structure_time_s;
    }

    /// Air.
    pub fn room_c(&self) -> f64 {
        let s = &self.settings;
        s.room_c + s.room_swing_k * sin_turns(self.time_s / s.room_period_s + self.phase)
    }

    /// The glass of the scales.
    pub fn scale_c(&self) -> f64 {
        self.scale_c
    }

    /// The aluminium of the stage.
    pub fn structure_c(&self) -> f64 {
        self.structure_c
    }

    /// How far heat has moved the table against its scales, µm.
    pub fn drift_um(&self) -> [f64; 2] {
        let s = &self.settings;
        let structure = s.structure_um_m_k * s.structure_length_mm * 1e-3 * (self.structure_c - 20.0);
        self.drift.map(|sign| sign * (s.motor_drift_um * self.motors + structure))
    }
}
