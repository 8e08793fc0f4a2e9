//! The floor: it moves a reading head against its grating, and what stands on the slide with it.

use crate::noise::Noise;
use crate::trig::sin_turns;

/// The band in which a floor on its own moves, Hz.
const BAND_HZ: [f64; 2] = [5.0, 50.0];
/// Waves, each somewhere in its own equal part of the band: flat, and never the same pattern twice.
const WAVES: usize = 6;

/// A sum of sine waves of equal size and random phase.
#[derive(Clone, Debug)]
pub(crate) struct Vibration {
    size_um: f64,
    /// Frequency in Hz and phase in turns.
    waves: [[f64; 2]; WAVES],
}

impl Vibration {
    /// Of `rms_nm` along an axis called `name`.
    pub(crate) fn new(rms_nm: f64, seed: u64, name: &str) -> Self {
        let mut noise = Noise::new(seed, &format!("vibration {name}"));
        let [low, high] = BAND_HZ;
        let part = (high - low) / WAVES as f64;
        let wave = |number: usize| {
            let from = low + number as f64 * part;
            [noise.uniform(from, from + part), noise.uniform(0.0, 1.0)]
        };
        Self {
            size_um: rms_nm * 1e-3 * (2.0 / WAVES as f64).sqrt(),
            waves: core::array::from_fn::<usize, WAVES, _>(|number| number).map(wave),
        }
    }

    /// So many seconds later.
    pub(crate) fn step(&mut self, dt: f64) {
        for [hz, phase] in &mut self.waves {
            *phase = (*phase + *hz * dt).fract();
        }
    }

    /// How far it has moved the slide, µm.
    pub(crate) fn um(&self) -> f64 {
        if self.size_um == 0.0 {
            return 0.0;
        }
        self.size_um * self.waves.iter().map(|[_, phase]| sin_turns(*phase)).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_its_rms_and_lies_in_its_band() {
        for seed in 0..20 {
            let mut vibration = Vibration::new(5.0, seed, "x");
            let seen: Vec<f64> = (0..100_000)
                .map(|_| {
                    vibration.step(1e-4);
                    vibration.um()
                })
                .collect();
            let rms = (seen.iter().map(|um| um * um).sum::<f64>() / 1e5).sqrt();
            assert!((rms - 0.005).abs() < 3e-4, "seed {seed}: {rms}");
            // Rising crossings of zero in 10 s: the mean frequency of such a band is within it.
            let rises = seen.windows(2).filter(|pair| pair[0] < 0.0 && pair[1] >= 0.0).count();
            assert!((100..500).contains(&rises), "seed {seed}: {rises}");
        }
    }
}
