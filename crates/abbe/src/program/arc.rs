//! An arc on its way.
//!
//! Rounded numbers leave its end a little nearer to the centre than its beginning, or farther; between them the radius
//! passes evenly with the angle. Where both are equal, all here is exact to the picometre. Otherwise the path may turn
//! back a little beside the crest of its circle; that is looked for, and found to a ten-thousandth of the mismatch.

use super::course::{Course, How, Point, Reach, beside, in_mm, way};
use abbe_proto::gcode::{Arc, Place, Turn};
use std::f64::consts::TAU;

/// To the right, up, to the left, down: where a circle turns back.
const CRESTS: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];

/// Steps towards the place where a spiral turns back; each gains a factor of the square of its slope, below 0.01 but for
/// arcs that are hardly longer than their mismatch.
const STEPS: usize = 4;

pub(super) fn course(from: Place, to: Place, arc: &Arc) -> Course {
    let spiral = Spiral::of(from, to, arc);
    let mut reach = Reach::to(to);
    let mut shares = shares_at([way(arc.centre, from), way(arc.centre, to)]);
    for crest in CRESTS {
        let angle = spiral.angle_to(crest);
        // Just before the beginning may be a crest, too, and where the path turns back just behind it.
        for angle in [angle, angle - TAU] {
            if let Some(offset) = spiral.turns_back(crest, angle) {
                reach.add(Point { place: beside(arc.centre, offset), how: How::Bulges });
            }
        }
        if angle < spiral.sweep {
            // There the path goes across the crest's direction.
            shares = [shares[0].max(crest[1].abs()), shares[1].max(crest[0].abs())];
        }
    }
    Course { reach, length_mm: in_mm(spiral.length()), shares }
}

/// A path about a centre whose radius passes evenly with the angle.
struct Spiral {
    /// From the centre to the beginning, pm.
    begin: [f64; 2],
    turn: Turn,
    /// The angle from the beginning to the end, more than 0, at most a turn.
    sweep: f64,
    /// The radius at the beginning, pm.
    radius: f64,
    /// What it gains in a radian, pm.
    gain: f64,
}

impl Spiral {
    fn of(from: Place, to: Place, arc: &Arc) -> Self {
        let (begin, end) = (way(arc.centre, from), way(arc.centre, to));
        let [radius, last] = [begin, end].map(|[x, y]| x.hypot(y));
        let mut spiral = Self { begin, turn: arc.turn, sweep: TAU, radius, gain: 0.0 };
        if !arc.full {
            spiral.sweep = spiral.angle_to(end);
            spiral.gain = (last - radius) / spiral.sweep;
        }
        spiral
    }

    /// The angle from the beginning to a direction in the sense of the arc, more than 0, at most a turn.
    fn angle_to(&self, [x, y]: [f64; 2]) -> f64 {
        let [x0, y0] = self.begin;
        let (left, along) = (x0 * y - y0 * x, x0 * x + y0 * y);
        let left = if self.turn == Turn::Clockwise { -left } else { left };
        let angle = left.atan2(along);
        if angle > 0.0 { angle } else { angle + TAU }
    }

    /// Where the path turns back at a crest that comes at an angle: its offset from the centre, if it is on the way.
    ///
    /// At the angle φ behind the crest it lies r·cos φ towards it; that is largest where tan φ = r′ / r.
    fn turns_back(&self, crest: [f64; 2], angle: f64) -> Option<[f64; 2]> {
        let radius = |behind: f64| self.radius + self.gain * (angle + behind);
        let behind = (0..STEPS).fold(0.0, |behind, _| self.gain.atan2(radius(behind)));
        if !(angle + behind > 0.0 && angle + behind < self.sweep) {
            return None;
        }
        let (sin, cos) = behind.sin_cos();
        let across = match self.turn {
            Turn::Counterclockwise => [-crest[1], crest[0]],
            Turn::Clockwise => [crest[1], -crest[0]],
        };
        Some([0, 1].map(|axis| radius(behind) * (cos * crest[axis] + sin * across[axis])))
    }

    /// Exact for a circle.
    fn length(&self) -> f64 {
        self.sweep * (self.radius + 0.5 * self.gain * self.sweep).hypot(self.gain)
    }
}

/// What x and y take of the speed at one of two places, by their offsets from the centre: the path goes across them.
fn shares_at(places: [[f64; 2]; 2]) -> [f64; 2] {
    let [begin, end] = places.map(|[x, y]| [y.abs() / x.hypot(y), x.abs() / x.hypot(y)]);
    [begin[0].max(end[0]), begin[1].max(end[1])]
}
