//! Something that changes slowly and at random along the travel, and is the same each time one comes by.

use crate::noise::Noise;
use crate::trig::sin_turns;

/// First node, µm, and the distance of the nodes.
const LOW_UM: f64 = -10_000.0;
const STEP_UM: f64 = 250.0;
/// Least nodes: up to 120 mm. A longer stage has more.
const NODES: usize = 521;
/// Random waves that make the change.
const WAVES: usize = 96;

/// A stationary random function of the place, a table of straight lines.
#[derive(Clone, Debug)]
pub(crate) struct Wander(Vec<f64>);

impl Wander {
    /// Of the given rms and correlation exp(−(d/length)²), with mean zero, up to `high_mm`.
    pub(crate) fn new(rms: f64, length_mm: f64, high_mm: f64, noise: &mut Noise) -> Self {
        let spread = core::f64::consts::SQRT_2 / (length_mm * 1e3) / core::f64::consts::TAU;
        let waves: Vec<(f64, f64)> =
            (0..WAVES).map(|_| (spread * noise.normal(), noise.uniform(0.0, 1.0))).collect();
        let nodes = NODES.max(2 + ((high_mm * 1e3 - LOW_UM) / STEP_UM) as usize);
        let raw: Vec<f64> = (0..nodes)
            .map(|node| {
                let at = LOW_UM + node as f64 * STEP_UM;
                waves.iter().map(|(frequency, phase)| sin_turns(frequency * at + phase)).sum()
            })
            .collect();
        Self(normalised(raw, rms))
    }

    /// Its value at a place; beyond the ends the last lines go on.
    pub(crate) fn at(&self, place_um: f64) -> f64 {
        let along = ((place_um - LOW_UM) / STEP_UM).clamp(0.0, (self.0.len() - 2) as f64);
        let node = along as usize;
        let fraction = along - node as f64;
        let (left, right) = (self.0[node], self.0[node + 1]);
        left + fraction * (right - left)
    }
}

/// Values shifted to mean zero and scaled to `rms`.
fn normalised(mut values: Vec<f64>, rms: f64) -> Vec<f64> {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let now = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
    let scale = if now > 0.0 { rms / now } else { 0.0 };
    for value in &mut values {
        *value = (*value - mean) * scale;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_its_rms_over_the_travel_and_its_length() {
        let wander = Wander::new(0.3, 5.0, 126.0, &mut Noise::new(3, "wander"));
        let along: Vec<f64> = (0..1200).map(|i| wander.at(f64::from(i) * 100.0)).collect();
        let mean_square = along.iter().map(|v| v * v).sum::<f64>() / 1200.0;
        assert!((0.2..0.4).contains(&mean_square.sqrt()), "{}", mean_square.sqrt());
        // exp(−(d/length)²) at a fifth of the length and at two lengths.
        let correlation = |apart: usize| {
            along.iter().zip(&along[apart..]).map(|(a, b)| a * b).sum::<f64>() / (1200 - apart) as f64
        };
        assert!((correlation(10) / mean_square - 0.96).abs() < 0.03, "{}", correlation(10) / mean_square);
        assert!((correlation(100) / mean_square).abs() < 0.35, "{}", correlation(100) / mean_square);
        // It still changes at the far end of a travel of 120 mm.
        assert_ne!(wander.at(123_000.0), wander.at(124_000.0));
    }
}
