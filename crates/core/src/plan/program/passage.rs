//! How a block goes over into the next at a speed; at speed zero it stops there.

use super::super::corner::Corner;
use super::super::curve::Curve;
use super::super::joint::Joint;
use super::super::pieces::Piece;
use super::super::profile::Limits;
use super::super::transfer::State;

/// Where two blocks meet, and how fast that is passed.
#[allow(clippy::large_enum_variant, reason = "there is no other place for it")]
#[derive(Clone, Copy, Debug)]
pub(super) enum Passage {
    /// Of two lines.
    Corner(Corner),
    /// Of curves of which one is bent at least.
    Joint(Joint),
}

impl Default for Passage {
    fn default() -> Self {
        Self::Corner(Corner::default())
    }
}

impl Passage {
    /// The fastest up to a top that is no farther from the curves than the tolerance, pm, and begins and ends within `room`
    /// pm of where they meet.
    pub(super) fn fastest(
        curves: [Curve; 2],
        axes: &[Limits; 2],
        top: f64,
        tolerance: f64,
        room: f64,
    ) -> Self {
        match curves {
            [Curve::Line { from, to: at }, Curve::Line { to, .. }] => {
                Self::Corner(Corner::fastest([from, at, to], axes, top, tolerance, room))
            }
            _ => Self::Joint(Joint::fastest(curves, axes, top, tolerance, room)),
        }
    }

    pub(super) fn at_speed(self, speed: f64) -> Self {
        match self {
            Self::Corner(corner) => Self::Corner(corner.at_speed(speed)),
            Self::Joint(joint) => Self::Joint(joint.at_speed(speed)),
        }
    }

    /// At both ends, pm a tick.
    pub(super) fn speed(&self) -> f64 {
        match self {
            Self::Corner(corner) => corner.speed,
            Self::Joint(joint) => joint.speed,
        }
    }

    /// How long it takes, ticks.
    pub(super) fn ticks(&self) -> f64 {
        match self {
            Self::Corner(corner) => corner.ticks(),
            Self::Joint(joint) => joint.ticks(),
        }
    }

    /// What it takes of each of both blocks, pm.
    pub(super) fn reach(&self) -> f64 {
        match self {
            Self::Corner(corner) => corner.reach(),
            Self::Joint(joint) => joint.reach(),
        }
    }

    /// The state along the block behind in which it ends.
    pub(super) fn behind(&self) -> State {
        State { position: self.reach(), speed: self.speed(), acceleration: 0.0 }
    }

    /// A piece by its number, if it could be laid out, and when it is over, of one that lasts from a time to another.
    pub(super) fn piece(&self, number: usize, begins: f64, ends: f64) -> Option<(Option<Piece>, f64)> {
        let (piece, next) = match self {
            Self::Corner(corner) => {
                let piece = corner.pieces(begins).get(number).copied()?;
                (piece, corner.times(begins).get(number.saturating_add(1)).copied())
            }
            Self::Joint(joint) => joint.piece(number, begins)?,
        };
        Some((piece, next.unwrap_or(ends)))
    }
}
