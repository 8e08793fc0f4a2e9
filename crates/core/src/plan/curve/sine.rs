//! Sines about a straight line, by their length.
//!
//! With θ the angle of the sine, its length is ∫ √(D² + W² cos²θ) dθ: an elliptic integral, which a sum over a quarter of a
//! period gives, and whose inverse a search.

use super::super::root::{Point, root};
use super::{Bend, Place, Spot, direction, distance};
use core::f64::consts::{FRAC_PI_2, TAU};

/// A sine about the line between two places: at the way x along the line, of a length D, it lies
/// A · (sin(2πn·x/D + φ) − sin φ) to its left. The places must be two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sine {
    from: Place,
    /// Along the line.
    ahead: Place,
    /// A, pm.
    amplitude: f64,
    /// φ, rad.
    phase: f64,
    /// From beginning to end, rad.
    turns: f64,
    /// Of the line for a radian, pm.
    pitch: f64,
    /// Length of a quarter of a period, pm.
    quarter: f64,
}

impl Sine {
    /// A sine of so many whole periods and a phase, rad. None without an amplitude above zero, a period, or a way.
    pub fn new(from: Place, to: Place, amplitude: f64, periods: u32, phase: f64) -> Option<Self> {
        if !(amplitude > 0.0 && periods > 0 && distance(from, to) > 0.0 && phase.is_finite()) {
            return None;
        }
        let turns = f64::from(periods) * TAU;
        let (ahead, pitch) = (direction(from, to), distance(from, to) / turns);
        let mut sine = Self { from, ahead, amplitude, phase, turns, pitch, quarter: 0.0 };
        sine.quarter = sine.within(FRAC_PI_2);
        Some(sine)
    }

    pub(super) fn length(&self) -> f64 {
        // Whole periods, wherever they begin.
        self.turns / FRAC_PI_2 * self.quarter
    }

    pub(super) fn bend(&self) -> Bend {
        // With k = 1/pitch and g = kA: the curvature is Ak² at the peaks; its derivatives are at most Ak³ (1 + 0.78 g),
        // between zero and peak, and Ak⁴ (1 + 3 g²), at the peaks.
        let (k, steep) = (1.0 / self.pitch, self.amplitude / self.pitch);
        let curvature = steep * k;
        Bend {
            curvature,
            change: curvature * k * (1.0 + 0.78 * steep),
            second: curvature * k * k * (1.0 + 3.0 * steep * steep),
        }
    }

    pub(super) fn spot(&self, way: f64) -> Spot {
        let angle = self.angle_at(self.length_to(self.phase) + way);
        let (at, [ahead, left]) = self.at_angle(angle);
        let speed = libm::hypot(ahead, left);
        Spot { at, tangent: self.place([0.0; 2], ahead / speed, left / speed) }
    }

    pub(super) fn turning(&self, way: f64) -> Place {
        let angle = self.angle_at(self.length_to(self.phase) + way);
        let (sin, cos) = libm::sincos(angle);
        let (ahead, left) = (self.pitch, self.amplitude * cos);
        let speed = libm::hypot(ahead, left);
        // To the left of where it goes.
        let curvature = -ahead * self.amplitude * sin / (speed * speed * speed);
        self.place([0.0; 2], -curvature * left / speed, curvature * ahead / speed)
    }

    /// With each period a turn moves on evenly, so that the first and the last of its kind are the outermost.
    ///
    /// The speed of an axis is zero where cos θ = −ahead / (left · steepness).
    pub(super) fn turning_points(&self, see: &mut dyn FnMut(Place)) {
        let [x, y] = self.ahead;
        let steep = self.amplitude / self.pitch;
        for (ahead, left) in [(x, -y), (y, x)] {
            let cos = -ahead / (left * steep);
            // Else it never turns back; along the axis this is infinite.
            if cos.abs() > 1.0 || cos.is_nan() {
                continue;
            }
            for angle in [libm::acos(cos), -libm::acos(cos)] {
                let first = libm::floor((self.phase - angle) / TAU) + 1.0;
                let last = libm::ceil((self.phase - angle + self.turns) / TAU) - 1.0;
                if first <= last {
                    see(self.at_angle(angle + first * TAU).0);
                    see(self.at_angle(angle + last * TAU).0);
                }
            }
        }
    }

    /// The place at an angle, and the change of the way along its line and to its left for a radian there.
    fn at_angle(&self, angle: f64) -> (Place, Place) {
        let along = (angle - self.phase) * self.pitch;
        let (sin, cos) = libm::sincos(angle);
        let aside = self.amplitude * (sin - libm::sin(self.phase));
        (self.place(self.from, along, aside), [self.pitch, self.amplitude * cos])
    }

    /// So far along the line from a place, and to its left.
    fn place(&self, from: Place, along: f64, left: f64) -> Place {
        let [x, y] = self.ahead;
        [from[0] + along * x - left * y, from[1] + along * y + left * x]
    }

    /// Length from angle 0 to an angle.
    fn length_to(&self, angle: f64) -> f64 {
        let quarters = libm::floor(angle / FRAC_PI_2);
        let rest = (angle - quarters * FRAC_PI_2).clamp(0.0, FRAC_PI_2);
        let even = libm::fmod(quarters, 2.0) == 0.0;
        let part = if even { self.within(rest) } else { self.quarter - self.within(FRAC_PI_2 - rest) };
        quarters * self.quarter + part
    }

    /// The inverse of [`Sine::length_to`].
    fn angle_at(&self, length: f64) -> f64 {
        let quarters = libm::floor(length / self.quarter);
        let rest = (length - quarters * self.quarter).max(0.0).min(self.quarter);
        let even = libm::fmod(quarters, 2.0) == 0.0;
        let part = if even { self.angle_of(rest) } else { FRAC_PI_2 - self.angle_of(self.quarter - rest) };
        quarters * FRAC_PI_2 + part
    }

    fn angle_of(&self, length: f64) -> f64 {
        let beyond = |angle: f64| self.within(angle) - length;
        root(Point { x: 0.0, f: -length }, Point { x: FRAC_PI_2, f: self.quarter - length }, beyond)
    }

    /// Length from angle 0 to one up to a quarter of a period.
    ///
    /// Seen from the peak the integrand is √(D² + W² sin²), of which the bend is as narrow as D/W: parts double their width
    /// from there on, and ten points are exact to 10⁻¹² in each.
    fn within(&self, angle: f64) -> f64 {
        let from_peak = FRAC_PI_2 - angle;
        let narrow = (self.pitch / self.amplitude).min(FRAC_PI_2);
        let (mut low, mut high, mut sum) = (from_peak, from_peak.max(narrow), 0.0);
        for _ in 0..PARTS {
            high = if high > low { high } else { 2.0 * low.max(narrow) };
            let end = high.min(FRAC_PI_2);
            sum += self.gauss(low, end);
            low = end;
            if low >= FRAC_PI_2 {
                break;
            }
        }
        sum
    }

    /// Over angles from the peak.
    fn gauss(&self, low: f64, high: f64) -> f64 {
        let (middle, half) = (f64::midpoint(low, high), (high - low) / 2.0);
        let speed = |from_peak: f64| libm::hypot(self.pitch, self.amplitude * libm::sin(from_peak));
        half * GAUSS
            .iter()
            .map(|(x, weight)| weight * (speed(middle - half * x) + speed(middle + half * x)))
            .sum::<f64>()
    }
}

/// Most parts of a quarter: a sine of 2⁶⁰ times its pitch.
const PARTS: usize = 64;

/// Nodes and weights of Gauss and Legendre's rule of ten points (Abramowitz and Stegun, table 25.4).
const GAUSS: [(f64, f64); 5] = [
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];
