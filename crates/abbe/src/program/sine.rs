//! A sine on its way: `s` along the line of length D, and A·(sin ψ − sin q) to its left, where ψ = q + w·s and
//! w = 2π · periods / D.

use super::course::{Course, How, Point, Reach, beside, in_mm, way};
use abbe_proto::gcode::{Place, Sine};
use std::f64::consts::{PI, TAU};

/// A number is in billionths.
const ONE: f64 = 1e9;

pub(super) fn course(from: Place, to: Place, sine: &Sine) -> Course {
    let wave = Wave::of(from, to, sine);
    let mut reach = Reach::to(to);
    for axis in [0, 1] {
        wave.turns_back(axis, |offset| {
            reach.add(Point { place: beside(from, offset), how: How::Swings });
        });
    }
    Course { reach, length_mm: in_mm(wave.length()), shares: wave.shares() }
}

struct Wave {
    /// The line that it follows, pm.
    way: f64,
    /// The direction of the line.
    along: [f64; 2],
    /// The direction to its left.
    left: [f64; 2],
    /// A, pm.
    amplitude: f64,
    periods: f64,
    /// q, radians.
    phase: f64,
}

impl Wave {
    fn of(from: Place, to: Place, sine: &Sine) -> Self {
        let [x, y] = way(from, to);
        let length = x.hypot(y);
        let along = [x / length, y / length];
        Self {
            way: length,
            along,
            left: [-along[1], along[0]],
            amplitude: sine.amplitude.pm() as f64,
            periods: f64::from(sine.periods),
            phase: (sine.phase.billionths() as f64 / ONE).to_radians(),
        }
    }

    /// How steep it is against its line where it is steepest: A·w.
    fn slope(&self) -> f64 {
        self.amplitude * TAU * self.periods / self.way
    }

    /// Shows the offsets from the beginning between which lie all the others at which x or y turns back.
    ///
    /// The speed of an axis, along + left · A·w · cos ψ, is zero at two phases of each period. From period to period
    /// such a place moves on evenly, so that the first and the last of its kind are the outermost.
    fn turns_back(&self, axis: usize, mut show: impl FnMut([f64; 2])) {
        let cos = -self.along[axis] / (self.left[axis] * self.slope());
        // Else it never turns back; for a line along the axis this is infinite.
        if cos.abs() > 1.0 || cos.is_nan() {
            return;
        }
        for psi in [cos.acos(), -cos.acos()] {
            let first = ((self.phase - psi) / TAU).floor() + 1.0;
            let last = ((self.phase - psi) / TAU + self.periods).ceil() - 1.0;
            if first <= last {
                show(self.at(psi, first));
                show(self.at(psi, last));
            }
        }
    }

    /// The offset at a phase and so many whole turns.
    fn at(&self, psi: f64, turns: f64) -> [f64; 2] {
        let periods = (psi - self.phase) / TAU + turns;
        let s = (periods / self.periods).clamp(0.0, 1.0) * self.way;
        let swing = self.amplitude * (psi.sin() - self.phase.sin());
        [0, 1].map(|axis| self.along[axis] * s + self.left[axis] * swing)
    }

    /// The path turns to both sides of its line by as much as its slope tells; where it crosses the direction of an axis,
    /// that axis goes as fast as the path.
    fn shares(&self) -> [f64; 2] {
        let most = self.slope().atan();
        self.along.map(|along| {
            // Between the line, without its sense, and the axis.
            let angle = along.abs().min(1.0).acos();
            (angle - most).max(0.0).cos()
        })
    }

    /// A period is as long as the ellipse with the semi-axes L / 2π and L / 2π · √(1 + slope²), and the perimeter of that
    /// comes from Gauss's arithmetic-geometric mean.
    fn length(&self) -> f64 {
        self.way * perimeter(1.0, self.slope().hypot(1.0)) / TAU
    }
}

/// The perimeter of an ellipse by its semi-axes: 2π / M · (½(a² + b²) − Σ 2ⁿ⁻¹ cₙ²), where M is the mean of a and b, and cₙ
/// half the difference of the means before.
fn perimeter(mut a: f64, mut b: f64) -> f64 {
    let (mut sum, mut weight) = (0.5 * (a * a + b * b), 1.0);
    // Each step doubles the digits; the first ones only halve the ratio's logarithm.
    while (a - b).abs() > 1e-9 * a {
        let half = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        sum -= weight * half * half;
        weight *= 2.0;
    }
    2.0 * PI * sum / a
}

#[cfg(test)]
mod tests {
    use super::perimeter;
    use std::f64::consts::TAU;

    #[test]
    fn perimeters_are_those_of_a_sum_over_many_points() {
        for b in [1.0, 1.1, 2.0, 10.0, 300.0, 1e4, 1e8, 1e12] {
            let points = 200_000;
            // Evenly in the parameter: exact for a smooth closed curve once there are enough points.
            let speed = |k: u32| {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(points)).sin_cos();
                sin.hypot(b * cos)
            };
            let sum = (0..points).map(speed).sum::<f64>() * TAU / f64::from(points);
            let found = perimeter(1.0, b);
            assert!((found / sum - 1.0).abs() < 2e-10, "{b}: {found} {sum}");
        }
        assert_eq!(perimeter(1.0, 1.0), TAU);
    }
}
