//! A corner between two lines that is passed without a stop, although both would stop in it: the next line begins before the
//! last has ended.
//!
//! A line that stops in the corner comes to it with one constant jerk, and one that begins there sets out with one. Laid over
//! each other for T ticks they are one cubic of time: with jerk λ along both directions its places are
//! −d₁·λ(T − t)³/6 + d₂·λt³/6 about the corner. Half-way that is (d₂ − d₁)·λT³/48, the farthest that the corner is cut. So a
//! tolerance that is too small for a rounding at speed ([`Corner`](super::corner::Corner)) still saves T.

use super::curve::{Place, direction, distance};
use super::pieces::Piece;
use super::profile::Limits;
use super::steps::{Leg, lay_out};
use super::transfer::{Phase, State};

/// Two lines laid over each other at the corner between them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Overlap {
    at: Place,
    /// Directions of the lines before and behind.
    ways: [Place; 2],
    /// λ, pm a tick³.
    jerk: f64,
    /// T.
    ticks: f64,
}

impl Overlap {
    /// The longest that cuts the corner by the tolerance at most, pm, between two lines of these lengths and limits. None if
    /// there is no way to go or nothing to be cut: straight on or back.
    pub fn longest(
        places: [Place; 3],
        axes: &[Limits; 2],
        lines: [(f64, &Limits); 2],
        tolerance: f64,
    ) -> Option<Self> {
        let [from, at, to] = places;
        let ways = [direction(from, at), direction(at, to)];
        let [before, behind] = ways;
        let both = [before[0] + behind[0], before[1] + behind[1]];
        let shared = both.iter().zip(axes).map(|(both, axis)| axis.jerk / both.abs());
        let jerk = lines.iter().map(|(_, limits)| limits.jerk).chain(shared).fold(f64::INFINITY, f64::min);
        let cut = libm::cbrt(48.0 * tolerance / (jerk * distance(before, behind)));
        // Both lines have a first and a last phase of this jerk that are longer: no acceleration nor speed is beyond a limit,
        // and there is room.
        let ticks = lines.iter().fold(cut, |ticks, (length, limits)| {
            // To rest in twice the way that is gone with the jerk alone: half of the line, not all, or rounding takes the rest.
            let half = libm::cbrt(length / (4.0 * jerk));
            let most = [limits.acceleration / jerk, libm::sqrt(limits.speed / jerk), half];
            most.into_iter().fold(ticks, f64::min)
        });
        let crosses = distance(before, behind) > FLAT && distance(both, [0.0; 2]) > FLAT;
        (crosses && ticks > 0.0 && ticks.is_finite()).then_some(Self { at, ways, jerk, ticks })
    }

    /// How long it takes, ticks; so much sooner is the next line done than after a stop.
    pub fn ticks(&self) -> f64 {
        self.ticks
    }

    /// From where it begins to the corner, as from the corner to where it ends, pm.
    pub fn reach(&self) -> f64 {
        self.jerk * self.ticks * self.ticks * self.ticks / 6.0
    }

    /// From the corner to where it is nearest to it, pm.
    pub fn off(&self) -> f64 {
        let [before, behind] = self.ways;
        distance(before, behind) * self.reach() / 8.0
    }

    /// The state along the line before in which it begins, of a line of a length.
    pub fn before(&self, length: f64) -> State {
        let after = self.behind();
        State { position: length - after.position, speed: after.speed, acceleration: -after.acceleration }
    }

    /// The state along the line behind in which it ends.
    pub fn behind(&self) -> State {
        State::default().after(self.ticks, self.jerk)
    }

    /// Its piece, from a time on, ticks.
    pub fn piece(&self, begins: f64) -> Option<Piece> {
        let [before, behind] = self.ways;
        let State { speed, acceleration, .. } = self.behind();
        let mut piece = [Leg::default(); 2];
        let axes = piece.iter_mut().zip(self.at).zip(before.into_iter().zip(behind));
        for ((leg, at), (before, behind)) in axes {
            let state = State {
                position: at - self.reach() * before,
                speed: speed * before,
                acceleration: -acceleration * before,
            };
            *leg = lay_out(begins, state, &Phase { ticks: self.ticks, jerk: self.jerk * (before + behind) })?;
        }
        Some(piece)
    }
}

/// Directions that differ by less are one.
const FLAT: f64 = 1e-9;
