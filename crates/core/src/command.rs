//! What can be asked of the controller, and how it answers.

use crate::machine::State;
use crate::publish::Fault;
use crate::units::{InMm, Pos};
use core::fmt;

/// A request from any protocol. Positions are in the stage frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Command<const N: usize> {
    /// Switches the drives on and holds where the stage stands.
    Enable,
    /// Switches the drives off.
    Disable,
    /// Finds the zero of every axis.
    Home,
    /// Goes to a position.
    MoveTo(#[cfg_attr(feature = "serde", serde(with = "crate::arrays"))] [Pos; N]),
    /// Goes a distance from the last target (never from the reading: readings carry noise, adding them up is drift).
    MoveBy(#[cfg_attr(feature = "serde", serde(with = "crate::arrays"))] [Pos; N]),
    /// Brakes on the path and holds.
    Stop,
    /// Leaves a fault; the drives stay off.
    Reset,
}

/// A request was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Accepted {
    /// Number of the move that this request began, or of the last one.
    pub move_number: u32,
}

/// A request was not taken; nothing changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The machine is doing something else.
    Busy(State),
    /// The drives are off.
    DrivesOff,
    /// The zero is not known.
    NotHomed,
    /// A fault wants a reset first.
    InFault(Fault),
    /// The stage has no such axis.
    NoSuchAxis(usize),
    /// The target lies outside the travel.
    OutOfTravel {
        /// Which axis.
        axis: usize,
        /// Where it was asked to go.
        asked: Pos,
        /// Lowest position.
        low: Pos,
        /// Highest position.
        high: Pos,
    },
}

/// The customary letter of an axis.
pub fn axis_name(axis: usize) -> char {
    ['x', 'y', 'z'].get(axis).copied().unwrap_or('?')
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Busy(state) => write!(f, "the stage is busy ({state}); wait or stop it first"),
            Self::DrivesOff => write!(f, "the drives are off; home or enable first"),
            Self::NotHomed => write!(f, "the zero is not known; home first"),
            Self::InFault(fault) => write!(f, "the stage is in a fault ({fault}); reset first"),
            Self::NoSuchAxis(axis) => write!(f, "the stage has no axis number {axis}"),
            Self::OutOfTravel { axis, asked, low, high } => write!(
                f,
                "{} = {} mm is outside the travel {} … {} mm",
                axis_name(*axis),
                InMm(*asked),
                InMm(*low),
                InMm(*high)
            ),
        }
    }
}

impl core::error::Error for Refusal {}
