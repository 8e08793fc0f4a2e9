//! A limit switch: it closes a little elsewhere every time, and bounces.

use crate::noise::Noise;
use crate::plant::SwitchPlant;

/// A switch that is pressed on one side of its place.
#[derive(Clone, Debug)]
pub struct Switch {
    place_um: f64,
    /// +1: pressed above its place; −1: below.
    side: f64,
    scatter_um: f64,
    bounce_s: f64,
    drawn_um: f64,
    pressed: bool,
    bouncing_s: f64,
    noise: Noise,
}

impl Switch {
    /// A switch at `place_mm` that is pressed above (`side` +1) or below (−1) it.
    pub fn new(settings: &SwitchPlant, place_mm: f64, side: f64, seed: u64, name: &str) -> Self {
        let mut noise = Noise::new(seed, &format!("switch {name}"));
        let drawn_um = settings.scatter_um * noise.normal();
        Self {
            place_um: place_mm * 1e3,
            side,
            scatter_um: settings.scatter_um,
            bounce_s: settings.bounce_ms * 1e-3,
            drawn_um,
            pressed: false,
            bouncing_s: 0.0,
            noise,
        }
    }

    /// Moves the switch on its mount.
    pub fn shift(&mut self, um: f64) {
        self.place_um += um;
    }

    /// What the contact shows with the slide at `place_um`, `dt` seconds later.
    pub fn contact(&mut self, place_um: f64, dt: f64) -> bool {
        let beyond = (place_um - self.place_um - self.drawn_um) * self.side > 0.0;
        if beyond != self.pressed {
            self.pressed = beyond;
            self.bouncing_s = self.bounce_s;
            if !beyond {
                self.drawn_um = self.scatter_um * self.noise.normal();
            }
        }
        self.bouncing_s -= dt;
        if self.bouncing_s > 0.0 { self.noise.chance(0.5) } else { self.pressed }
    }
}
