//! The path that a program means, and the place on it that is nearest to a point of the steps. All in steps.

use super::Grid;
use super::walk::{distance, sweep};
use abbe_core::plan::chords::Chords;
use abbe_proto::gcode::{Move, Path, Turn};
use std::f64::consts::TAU;

/// A true path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Truth {
    from: [f64; 2],
    to: [f64; 2],
    shape: Shape,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Line,
    /// Its radius passes evenly from one to the other.
    Arc {
        centre: [f64; 2],
        radii: [f64; 2],
        sweep: f64,
        counterclockwise: bool,
    },
    /// Chords over the whole of it.
    Sine {
        amplitude: f64,
        phase: f64,
        turns: f64,
        chords: f64,
    },
}

impl Truth {
    pub(super) fn of(there: &Move, grid: &Grid, chords: Option<&Chords>) -> Self {
        let [from, to] = [there.from, there.to].map(|end| grid.in_steps(end));
        let shape = match &there.path {
            Path::Line => Shape::Line,
            Path::Arc(arc) => {
                let centre = grid.in_steps(arc.centre);
                let radii = [distance(from, centre), distance(to, centre)];
                let counterclockwise = arc.turn == Turn::Counterclockwise;
                Shape::Arc { centre, radii, sweep: sweep(there, arc), counterclockwise }
            }
            Path::Sine(sine) => Shape::Sine {
                amplitude: sine.amplitude.pm() as f64 / grid.step().pm() as f64,
                phase: (sine.phase.billionths() as f64 / 1e9).to_radians(),
                turns: f64::from(sine.periods) * TAU,
                chords: chords.map_or(1.0, |chords| chords.remaining() as f64),
            },
        };
        Self { from, to, shape }
    }

    /// Its ends.
    pub(super) fn ends(&self) -> [[f64; 2]; 2] {
        [self.from, self.to]
    }

    /// The place nearest to a point, which belongs to a chord if there are chords.
    pub(super) fn nearest(&self, point: [f64; 2], chord: u64) -> [f64; 2] {
        match self.shape {
            Shape::Line => {
                let way = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
                let gone = [point[0] - self.from[0], point[1] - self.from[1]];
                let part = (way[0] * gone[0] + way[1] * gone[1]) / (way[0] * way[0] + way[1] * way[1]);
                let part = part.clamp(0.0, 1.0);
                [self.from[0] + part * way[0], self.from[1] + part * way[1]]
            }
            Shape::Arc { centre, radii, .. } => {
                let [x, y] = [point[0] - centre[0], point[1] - centre[1]];
                let away = x.hypot(y).max(f64::MIN_POSITIVE);
                let part = self.part_of_sweep([x, y]);
                if part <= 0.0 {
                    return self.from;
                }
                if part >= 1.0 {
                    return self.to;
                }
                let radius = radii[0] + (radii[1] - radii[0]) * part;
                [centre[0] + radius * x / away, centre[1] + radius * y / away]
            }
            Shape::Sine { chords, .. } => self.nearest_of_sine(point, chord as f64 - 0.5, chords),
        }
    }

    /// How far an arc has turned at a place seen from its centre, 0 … 1; outside it is at the end that is nearer.
    fn part_of_sweep(&self, [x, y]: [f64; 2]) -> f64 {
        let Shape::Arc { centre, sweep, counterclockwise, .. } = self.shape else { return 0.0 };
        let begins = (self.from[1] - centre[1]).atan2(self.from[0] - centre[0]);
        let turned = if counterclockwise { y.atan2(x) - begins } else { begins - y.atan2(x) };
        let turned = turned.rem_euclid(TAU);
        if turned > f64::midpoint(sweep, TAU) { 0.0 } else { (turned / sweep).min(1.0) }
    }

    /// Looked for within a chord and one more either side: first a place that is near, then the nearest about it.
    fn nearest_of_sine(&self, point: [f64; 2], chord: f64, chords: f64) -> [f64; 2] {
        const TRIED: i32 = 12;
        const NARROWED: usize = 40;
        // Where it ends the search does: beyond, all places would be alike.
        let within = |chord: f64| chord.clamp(0.0, chords);
        let off = |chord: f64| distance(point, self.of_sine(chord / chords));
        let width = 1.5 / f64::from(TRIED);
        let tried = (-TRIED..=TRIED).map(|n| within(chord + width * f64::from(n)));
        let near = tried.min_by(|&one, &other| off(one).total_cmp(&off(other))).unwrap_or(chord);
        let (mut low, mut high) = (within(near - width), within(near + width));
        for _ in 0..NARROWED {
            let third = (high - low) / 3.0;
            if off(low + third) <= off(high - third) { high -= third } else { low += third }
        }
        self.of_sine(f64::midpoint(low, high) / chords)
    }

    /// After a part of the way along the line.
    fn of_sine(&self, part: f64) -> [f64; 2] {
        let Shape::Sine { amplitude, phase, turns, .. } = self.shape else { return self.from };
        let way = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let left = amplitude * ((phase + part * turns).sin() - phase.sin()) / way[0].hypot(way[1]);
        [self.from[0] + part * way[0] - left * way[1], self.from[1] + part * way[1] + left * way[0]]
    }
}
