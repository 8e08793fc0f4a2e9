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

#[cfg(test)]
mod tests {
    use super::*;

    fn switch() -> Switch {
        let plant = SwitchPlant { low_mm: -2.0, high_mm: 102.0, scatter_um: 20.0, bounce_ms: 2.0 };
        Switch::new(&plant, -2.0, -1.0, 7, "x low")
    }

    /// Where it first closes on the way down, µm.
    fn closes_at(switch: &mut Switch) -> f64 {
        let mut place = -1900.0;
        while !switch.contact(place, 1e-4) {
            place -= 0.5;
        }
        for _ in 0..100 {
            switch.contact(-2500.0, 1e-4);
        }
        for _ in 0..100 {
            switch.contact(0.0, 1e-4);
        }
        place
    }

    #[test]
    fn closes_a_little_elsewhere_every_time() {
        let mut switch = switch();
        let places: Vec<f64> = (0..400).map(|_| closes_at(&mut switch)).collect();
        let mean = places.iter().sum::<f64>() / 400.0;
        let scatter = (places.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 400.0).sqrt();
        assert!((mean + 2000.0).abs() < 5.0, "{mean}");
        assert!((16.0..24.0).contains(&scatter), "{scatter}");
    }

    #[test]
    fn bounces_for_its_time_and_then_stays() {
        let mut switch = switch();
        let contacts: Vec<bool> = (0..100).map(|_| switch.contact(-2500.0, 1e-4)).collect();
        let changes = contacts[..20].windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(changes >= 4, "{changes}");
        assert!(contacts[20..].iter().all(|&closed| closed));
    }
}
