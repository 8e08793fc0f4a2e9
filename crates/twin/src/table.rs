//! The table on its slide: elastic reversal, and a place of its own after each move.

use crate::noise::Noise;
use crate::plant::Plant;

/// Slower than this is rest, mm/s.
const REST_MM_S: f64 = 0.05;
/// Rest of so many ticks ends a move.
const REST_TICKS: u32 = 100;
/// Way over which a new random place is taken, µm.
const RANDOM_WAY_UM: f64 = 1.0;

/// A table; lengths in µm.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    half_reversal_um: f64,
    random_um: f64,
    follows_um: f64,
    offset_um: f64,
    next_um: f64,
    last_um: f64,
    rest_ticks: u32,
    noise: Noise,
}

impl Table {
    pub(crate) fn new(plant: &Plant, place_um: f64, seed: u64, name: &str) -> Self {
        Self {
            half_reversal_um: 0.5 * plant.geometry.reversal_um,
            random_um: plant.geometry.random_um,
            follows_um: place_um,
            offset_um: 0.0,
            next_um: 0.0,
            last_um: place_um,
            rest_ticks: 0,
            noise: Noise::new(seed, &format!("table {name}")),
        }
    }

    pub(crate) fn step(&mut self, place_um: f64, speed_mm_s: f64) {
        let half = self.half_reversal_um;
        self.follows_um = self.follows_um.clamp(place_um - half, place_um + half);
        if speed_mm_s.abs() < REST_MM_S {
            self.rest_ticks = self.rest_ticks.saturating_add(1);
        } else {
            if self.rest_ticks > REST_TICKS {
                self.next_um = self.random_um * self.noise.normal();
            }
            self.rest_ticks = 0;
        }
        let way = ((place_um - self.last_um).abs() / RANDOM_WAY_UM).min(1.0);
        self.offset_um += way * (self.next_um - self.offset_um);
        self.last_um = place_um;
    }

    pub(crate) fn place_um(&self) -> f64 {
        self.follows_um + self.offset_um
    }
}
