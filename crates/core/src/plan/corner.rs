//! A corner between two lines, rounded within a tolerance.
//!
//! The speed keeps its size at both ends and changes its direction: by a constant vector, with full jerk, a pause at full
//! acceleration, and full jerk back. Each axis goes through a cubic of time, so nothing is approximated, and no axis is
//! beyond a limit. Half-way the stage is where it is farthest from the corner: by what the change of speed covers until
//! then, |Δv|·T/12 if it never comes to full acceleration.

use super::curve::{Place, direction, distance, straight};
use super::pieces::Piece;
use super::profile::Limits;
use super::root::highest;
use super::steps::{Leg, lay_out};
use super::transfer::{Phase, State};

/// A corner at a speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// Where it is.
    at: Place,
    /// Directions of the lines before and behind.
    ways: [Place; 2],
    /// Speed at both ends of the rounding, pm a tick.
    pub speed: f64,
    /// Of the change of the speed.
    limits: Limits,
}

impl Corner {
    /// The fastest through a corner that cuts it by the tolerance at most, pm, and begins and ends within `room` pm of it.
    /// Straight on is the feed; back again, or without a tolerance, a stop.
    pub fn fastest(places: [Place; 3], axes: &[Limits; 2], feed: f64, tolerance: f64, room: f64) -> Self {
        let [from, at, to] = places;
        let ways = [direction(from, at), direction(at, to)];
        let along = ways.map(|way| straight(way, axes, feed).speed);
        let top = along[0].min(along[1]);
        let turn = direction(ways[0], ways[1]);
        let corner = Self { at, ways, speed: 0.0, limits: straight(turn, axes, f64::MAX) };
        corner.slowed(top, |corner| (tolerance - corner.off()).min(room - corner.reach()))
    }

    /// The same at the highest speed, up to a top, at which nothing is left over that must not be below zero.
    #[must_use]
    pub fn slowed(self, top: f64, left: impl Fn(&Self) -> f64) -> Self {
        // Back, or no room: it stops.
        self.at_speed(highest(top, |speed| left(&self.at_speed(speed))))
    }

    pub(super) fn at_speed(self, speed: f64) -> Self {
        Self { speed, ..self }
    }

    /// By how much the speed changes, pm a tick.
    fn change(&self) -> f64 {
        self.speed * distance(self.ways[0], self.ways[1])
    }

    /// Ticks of full jerk, and at full acceleration.
    fn phases(&self) -> (f64, f64) {
        if self.speed == 0.0 {
            return (0.0, 0.0);
        }
        let Limits { acceleration, jerk, .. } = self.limits;
        changing(self.change(), acceleration, jerk)
    }

    /// Ticks of the rounding.
    pub fn ticks(&self) -> f64 {
        let (rise, pause) = self.phases();
        2.0 * rise + pause
    }

    /// From where it begins to the corner, as from the corner to where it ends, pm.
    pub fn reach(&self) -> f64 {
        self.speed * self.ticks() / 2.0
    }

    /// From the corner to where it is nearest to it, pm.
    pub fn off(&self) -> f64 {
        let (rise, pause) = self.phases();
        let change = State::default().after(rise, self.limits.jerk).after(pause / 2.0, 0.0);
        change.position
    }

    /// When its pieces begin, from a time on, ticks.
    pub fn times(&self, begins: f64) -> [f64; 3] {
        let (rise, pause) = self.phases();
        [begins, begins + rise, begins + rise + pause]
    }

    /// Its pieces, from a time on, ticks.
    pub fn pieces(&self, begins: f64) -> [Option<Piece>; 3] {
        let (rise, pause) = self.phases();
        let turn = direction(self.ways[0], self.ways[1]);
        let before = self.reach();
        let mut states = [0, 1].map(|axis| {
            let part = |pair: &Place| pair.get(axis).copied().unwrap_or(0.0);
            let [way, _] = &self.ways;
            State {
                position: part(&self.at) - before * part(way),
                speed: self.speed * part(way),
                acceleration: 0.0,
            }
        });
        let mut at = begins;
        [(rise, 1.0), (pause, 0.0), (rise, -1.0)].map(|(ticks, sign)| {
            let mut piece = [Leg::default(); 2];
            for ((leg, state), part) in piece.iter_mut().zip(&mut states).zip(turn) {
                let jerk = sign * self.limits.jerk * part;
                *leg = lay_out(at, *state, &Phase { ticks, jerk })?;
                *state = state.after(ticks, jerk);
            }
            at += ticks;
            Some(piece)
        })
    }
}

/// How long a speed takes to change from rest to rest of the acceleration: with full jerk twice, and between.
pub(super) fn changing(change: f64, acceleration: f64, jerk: f64) -> (f64, f64) {
    let full = acceleration / jerk;
    if change >= acceleration * full {
        (full, change / acceleration - full)
    } else {
        (libm::sqrt(change / jerk), 0.0)
    }
}
