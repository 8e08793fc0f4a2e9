//! Instruments: the only ones that see the truth, each with its own errors.

use crate::noise::Noise;
use crate::plant::{InterferometerPlant, ThermometerPlant};
use crate::twin::Twin;

/// A laser interferometer whose beam runs along one axis to a reflector at the table's centre.
#[derive(Clone, Debug)]
pub struct Interferometer {
    axis: usize,
    settings: InterferometerPlant,
    /// 1 + error of the scale of this set-up.
    scale: f64,
    zero_um: f64,
    zero_c: f64,
    noise: Noise,
}

impl Interferometer {
    /// Sets the instrument up along an axis. Each set-up draws its own misalignment and air.
    pub fn set_up(twin: &Twin, axis: usize, set_up: u64) -> Self {
        let settings = twin.plant().interferometer.clone();
        let mut noise = Noise::new(twin.seed(), &format!("interferometer {axis} {set_up}"));
        let angle = |noise: &mut Noise| settings.misalignment_mrad * 1e-3 * noise.normal();
        let tilt = libm::hypot(angle(&mut noise), angle(&mut noise));
        let air = noise.uniform(-1.0, 1.0) * settings.air_ppm * 1e-6;
        let mut instrument =
            Self { axis, settings, scale: libm::cos(tilt) * (1.0 + air), zero_um: 0.0, zero_c: 0.0, noise };
        instrument.set_zero(twin);
        instrument
    }

    /// The reading is zero here from now on; the zero is a reading itself, with its noise.
    pub fn set_zero(&mut self, twin: &Twin) {
        self.zero_um = twin.truth().table_um[self.axis] + self.settings.noise_um * self.noise.normal();
        self.zero_c = twin.heat().room_c();
    }

    /// Displacement since zero, µm.
    pub fn read_um(&mut self, twin: &Twin) -> f64 {
        let moved = twin.truth().table_um[self.axis] - self.zero_um;
        let dead_path = self.settings.dead_path_um_k * (twin.heat().room_c() - self.zero_c);
        moved * self.scale + dead_path + self.settings.noise_um * self.noise.normal()
    }
}

/// A thermometer with an offset of its own.
#[derive(Clone, Debug)]
pub struct Thermometer {
    offset_k: f64,
    noise_k: f64,
    noise: Noise,
}

impl Thermometer {
    /// A thermometer called `name`.
    pub fn new(settings: &ThermometerPlant, seed: u64, name: &str) -> Self {
        let mut noise = Noise::new(seed, &format!("thermometer {name}"));
        Self { offset_k: settings.offset_k * noise.normal(), noise_k: settings.noise_k, noise }
    }

    /// What it shows at a true temperature, °C.
    pub fn read_c(&mut self, true_c: f64) -> f64 {
        true_c + self.offset_k + self.noise_k * self.noise.normal()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thermometers_have_an_offset_of_their_own_and_noise() {
        let settings = ThermometerPlant { offset_k: 0.1, noise_k: 0.02 };
        let means: Vec<f64> = (0..200)
            .map(|seed| {
                let mut one = Thermometer::new(&settings, seed, "scale");
                (0..100).map(|_| one.read_c(20.0)).sum::<f64>() / 100.0
            })
            .collect();
        let spread = (means.iter().map(|m| (m - 20.0).powi(2)).sum::<f64>() / 200.0).sqrt();
        assert!((0.08..0.12).contains(&spread), "{spread}");
    }
}
