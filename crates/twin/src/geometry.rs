//! Guides that are not straight: where the table's centre is when the slides are somewhere.
//!
//! The error model of stacked slides, in ISO 230-1 symbols. Each slide's rotations act over the offset from its own
//! scale. X carries Y, as in paper A's stage:
//!
//! dX = EXY(y) − a·y − ECX(x)(y + py) − ECY(y) py + EBX(x) pz + EBY(y) pz
//! dY = EYX(x) + ECX(x) px + ECY(y) px − EAX(x) pz − EAY(y) pz
//!
//! Y carries X, as in paper B's (row B1):
//!
//! dX = EXY(y) − ECX(x) py − ECY(y) py + EBX(x) pz + EBY(y) pz
//! dY = EYX(x) − a·x + ECY(y)(x + px) + ECX(x) px − EAX(x) pz − EAY(y) pz
//!
//! with x, y from the middle of the travel. EXX and EYY are in the scales.

use crate::noise::Noise;
use crate::plant::GeometryPlant;
use crate::trig::sin_turns;

/// Arc seconds in a radian.
const ARCSEC: f64 = 206_264.806;

/// A smooth error along a travel: a few waves, scaled to a peak-to-peak value.
#[derive(Clone, Debug)]
struct Wavy {
    waves: Vec<(f64, f64, f64)>,
    travel_um: f64,
}

impl Wavy {
    fn new(waves: &[f64], peak_to_peak: f64, travel_mm: f64, noise: &mut Noise) -> Self {
        let waves =
            waves.iter().map(|&n| (n, noise.uniform(0.0, 1.0), noise.uniform(0.5, 1.0))).collect::<Vec<_>>();
        let mut wavy = Self { waves, travel_um: travel_mm * 1e3 };
        let along = (0..=400).map(|i| wavy.at(f64::from(i) / 400.0 * wavy.travel_um));
        let (low, high) =
            along.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
        let scale = if high > low { peak_to_peak / (high - low) } else { 0.0 };
        for wave in &mut wavy.waves {
            wave.2 *= scale;
        }
        wavy
    }

    fn at(&self, place_um: f64) -> f64 {
        let turns = place_um / self.travel_um;
        self.waves.iter().map(|(n, phase, size)| size * sin_turns(n * turns + phase)).sum()
    }
}

/// The six errors of one slide that are not in its scale: three rotations (rad) and the straightness (µm).
#[derive(Clone, Debug)]
struct Slide {
    roll: Wavy,
    pitch: Wavy,
    yaw: Wavy,
    straightness: Wavy,
}

impl Slide {
    fn new(settings: &GeometryPlant, noise: &mut Noise) -> Self {
        let angle = |noise: &mut Noise| {
            Wavy::new(&[2.0, 3.0], settings.angle_arcsec_pp / ARCSEC, settings.travel_mm, noise)
        };
        Self {
            roll: angle(noise),
            pitch: angle(noise),
            yaw: angle(noise),
            straightness: Wavy::new(&[1.0, 2.0], settings.straightness_um_pp, settings.travel_mm, noise),
        }
    }
}

/// Both slides and how they stand to each other.
#[derive(Clone, Debug)]
pub struct Geometry {
    x: Slide,
    y: Slide,
    /// Radians; positive opens the angle between the axes.
    squareness: f64,
    sideways_um: f64,
    down_um: f64,
    centre_um: f64,
    y_carries_x: bool,
}

impl Geometry {
    /// The guides of one stage.
    pub fn new(settings: &GeometryPlant, seed: u64) -> Self {
        let mut noise = Noise::new(seed, "geometry");
        Self {
            x: Slide::new(settings, &mut noise),
            y: Slide::new(settings, &mut noise),
            squareness: settings.squareness_arcsec / ARCSEC,
            sideways_um: settings.scale_sideways_mm * 1e3,
            down_um: settings.scale_down_mm * 1e3,
            centre_um: settings.travel_mm * 500.0,
            y_carries_x: settings.y_carries_x,
        }
    }

    /// How far the table's centre is from where the two slides alone would put it, µm.
    pub fn deviation_um(&self, slides_um: [f64; 2]) -> [f64; 2] {
        let [x, y] = slides_um;
        let (sideways, down) = (self.sideways_um, self.down_um);
        let (xy, yx) = (self.y.straightness.at(y), self.x.straightness.at(x));
        let (ecx, ecy) = (self.x.yaw.at(x), self.y.yaw.at(y));
        let (ebx, eby) = (self.x.pitch.at(x), self.y.roll.at(y));
        let (eax, eay) = (self.x.roll.at(x), self.y.pitch.at(y));
        // The lower slide turns what the upper one has moved on it, and the axes are square to its way.
        if self.y_carries_x {
            let across = x - self.centre_um;
            [
                xy - (ecx + ecy) * sideways + (ebx + eby) * down,
                yx - self.squareness * across + ecy * (across + sideways) + ecx * sideways
                    - (eax + eay) * down,
            ]
        } else {
            let across = y - self.centre_um;
            [
                xy - self.squareness * across - ecx * (across + sideways) - ecy * sideways
                    + (ebx + eby) * down,
                yx + (ecx + ecy) * sideways - (eax + eay) * down,
            ]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wavy_error_has_the_peak_to_peak_value_it_was_given() {
        let mut noise = Noise::new(5, "test");
        let wavy = Wavy::new(&[2.0, 3.0], 4.0, 100.0, &mut noise);
        let along: Vec<f64> = (0..=400).map(|i| wavy.at(f64::from(i) * 250.0)).collect();
        let range =
            along.iter().copied().fold(f64::MIN, f64::max) - along.iter().copied().fold(f64::MAX, f64::min);
        assert!((range - 4.0).abs() < 1e-9);
    }

    fn geometry() -> Geometry {
        let settings = GeometryPlant {
            y_carries_x: false,
            travel_mm: 100.0,
            scale_sideways_mm: 60.0,
            scale_down_mm: 10.0,
            angle_arcsec_pp: 4.0,
            straightness_um_pp: 1.5,
            squareness_arcsec: 20.0,
            reversal_um: 0.5,
            random_um: 0.12,
        };
        Geometry::new(&settings, 9)
    }

    #[test]
    fn an_arc_second_over_ten_millimetres_is_48_nanometres() {
        let mut bent = geometry();
        for slide in [&mut bent.x, &mut bent.y] {
            for wavy in [&mut slide.roll, &mut slide.pitch, &mut slide.yaw, &mut slide.straightness] {
                wavy.waves.clear();
            }
        }
        bent.squareness = 0.0;
        assert_eq!(bent.deviation_um([30_000.0, 70_000.0]), [0.0, 0.0]);
        // A yaw of the X slide of one arc second at every place but a whole number of waves.
        bent.x.yaw.waves.push((0.0, 0.25, 1.0 / ARCSEC));
        let [x, y] = bent.deviation_um([30_000.0, 50_000.0]);
        assert!((x + 6.0 * 0.04848).abs() < 1e-4, "{x}");
        assert!((y - 6.0 * 0.04848).abs() < 1e-4, "{y}");
        // Off the middle the arm of X is longer.
        let [x, _] = bent.deviation_um([30_000.0, 100_000.0]);
        assert!((x + 11.0 * 0.04848).abs() < 1e-4, "{x}");
    }

    #[test]
    fn the_deviation_is_the_error_model_of_stacked_slides() {
        let g = geometry();
        let mut noise = Noise::new(1, "places");
        for _ in 0..100 {
            let [x, y] = [noise.uniform(0.0, 1e5), noise.uniform(0.0, 1e5)];
            let (a, px, py, pz, yc) = (20.0 / ARCSEC, 6e4, 6e4, 1e4, y - 5e4);
            let (ecx, ebx, eax, eyx) =
                (g.x.yaw.at(x), g.x.pitch.at(x), g.x.roll.at(x), g.x.straightness.at(x));
            let (ecy, eay, eby, exy) =
                (g.y.yaw.at(y), g.y.pitch.at(y), g.y.roll.at(y), g.y.straightness.at(y));
            let dx = exy - a * yc - ecx * (yc + py) - ecy * py + ebx * pz + eby * pz;
            let dy = eyx + ecx * px + ecy * px - eax * pz - eay * pz;
            let [found_x, found_y] = g.deviation_um([x, y]);
            assert!((found_x - dx).abs() < 1e-9 && (found_y - dy).abs() < 1e-9);
        }
    }

    #[test]
    fn the_deviation_is_the_model_of_the_other_order_too() {
        let mut g = geometry();
        g.y_carries_x = true;
        let mut noise = Noise::new(2, "places");
        for _ in 0..100 {
            let [x, y] = [noise.uniform(0.0, 1e5), noise.uniform(0.0, 1e5)];
            let (a, px, py, pz, xc) = (20.0 / ARCSEC, 6e4, 6e4, 1e4, x - 5e4);
            let (ecx, ebx, eax, eyx) =
                (g.x.yaw.at(x), g.x.pitch.at(x), g.x.roll.at(x), g.x.straightness.at(x));
            let (ecy, eay, eby, exy) =
                (g.y.yaw.at(y), g.y.pitch.at(y), g.y.roll.at(y), g.y.straightness.at(y));
            let dx = exy - ecx * py - ecy * py + ebx * pz + eby * pz;
            let dy = eyx - a * xc + ecy * (xc + px) + ecx * px - eax * pz - eay * pz;
            let [found_x, found_y] = g.deviation_um([x, y]);
            assert!((found_x - dx).abs() < 1e-9 && (found_y - dy).abs() < 1e-9);
        }
    }

    #[test]
    fn squareness_leans_the_y_axis() {
        let lean = geometry();
        let across = lean.deviation_um([50_000.0, 100_000.0])[0] - lean.deviation_um([50_000.0, 0.0])[0];
        // 20″ over 100 mm are 9.7 µm; yaw, roll and straightness add less than 4.
        assert!((across + 9.7).abs() < 4.0, "{across}");
    }
}
