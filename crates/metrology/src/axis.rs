//! Which axis is measured, and from which side a target is approached.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A linear axis of the stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// First coordinate.
    X,
    /// Second coordinate.
    Y,
}

impl Axis {
    /// Both axes, in the order of a position `[x, y]`.
    pub const BOTH: [Self; 2] = [Self::X, Self::Y];

    /// Place of this axis in a position `[x, y]`.
    pub const fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
        }
    }

    /// A position with `along` on this axis and `line` on the other, same unit as given.
    pub const fn position(self, along: f64, line: f64) -> [f64; 2] {
        match self {
            Self::X => [along, line],
            Self::Y => [line, along],
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
        })
    }
}

/// The side a target is reached from: ISO 230-2 writes ↑ and ↓.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Approach {
    /// Towards larger positions.
    Up,
    /// Towards smaller positions.
    Down,
}

impl Approach {
    /// Both approaches, in the order in which a run makes them.
    pub const BOTH: [Self; 2] = [Self::Up, Self::Down];

    /// The approach a readings file calls `word`, if it knows the word.
    pub fn from_word(word: &str) -> Option<Self> {
        match word {
            "up" => Some(Self::Up),
            "down" => Some(Self::Down),
            _ => None,
        }
    }
}

impl fmt::Display for Approach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Up => "up",
            Self::Down => "down",
        })
    }
}
