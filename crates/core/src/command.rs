//! What can be asked of the controller, and how it answers.

use crate::front::compare::{Places, PlacesError};
use crate::machine::State;
use crate::plan::Segment;
use crate::plan::scan::ScanError;
use crate::publish::Fault;
use crate::units::{InMm, InUm, Pos};
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
    /// Goes to a position: from rest along a line; while it moves, from there as soon as the limits allow, if its
    /// [planner](crate::Controller::with_planner) can.
    MoveTo(#[cfg_attr(feature = "serde", serde(with = "crate::arrays"))] [Pos; N]),
    /// Goes a distance from the last target (never from the reading: readings carry noise, adding them up is drift).
    MoveBy(#[cfg_attr(feature = "serde", serde(with = "crate::arrays"))] [Pos; N]),
    /// Goes on to a place in a shape of its own, x and y, as part of a program: queued behind the segments before, and
    /// gone through without a stop where the corner between two lines has a tolerance. The first begins a move, which
    /// ends when the last one has been gone through.
    Go(Segment),
    /// Rests on the path of a program, until [`Command::Resume`]: at its end, too, which is no end while it is held.
    Hold,
    /// Goes on with a program that rests.
    Resume,
    /// Goes through programs at so many percent of their feeds, 1 … 200, within the limits; rapids up to 100.
    FeedRate(u16),
    /// Compares the measured position of an axis, stage frame, with these places, pm, from now on, or no longer:
    /// whenever one is passed, the trigger output is on for a tick, and
    /// [`fired`](crate::Controller::fired) tells when within it. Homing and another error map end it.
    Compare(Option<Compare>),
    /// Brakes on the path and holds.
    Stop,
    /// Leaves a fault; the drives stay off.
    Reset,
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Compare {
    /// Which axis.
    pub axis: usize,
    /// With which places, pm.
    pub places: Places,
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
    /// As many segments wait as there is room for; ask again in a tick.
    QueueFull,
    /// The same of a program that is held: room comes only when it goes on.
    QueueHeld,
    /// A segment has no such shape: an arc without radius or with two, a sine without amplitude, period or way.
    NoCurve,
    /// A corner cut by less than nothing.
    Tolerance(Pos),
    /// A segment that would take longer than any motion may: more than 2²⁶ ticks.
    TooLong,
    /// A scan that cannot be.
    NoScan(ScanError),
    /// A scan begins elsewhere, there.
    ScanStart([Pos; 2]),
    /// Places that cannot be compared with.
    NoPlaces(PlacesError),
    /// A feed of nothing.
    NoFeed,
    /// Whoever plans for this controller plans no programs.
    NoPlanner,
    /// No program runs that could hold or go on.
    NoProgram,
    /// A feed rate beyond 1 … 200 %.
    FeedRate(u16),
    /// The target, or a place on the way there, lies outside the travel.
    OutOfTravel {
        /// Which axis.
        axis: usize,
        /// Where it would come to.
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
            Self::QueueFull => write!(f, "as many segments wait as there is room for; ask again in a tick"),
            Self::QueueHeld => write!(
                f,
                "the program is held, and as many segments wait as there is room for; resume or stop it first"
            ),
            Self::NoCurve => write!(
                f,
                "there is no such curve; an arc needs its centre equally far from both ends, a sine amplitude, periods and a way"
            ),
            Self::Tolerance(tolerance) => {
                write!(
                    f,
                    "a tolerance of {} µm is below zero; give zero to stop in the corner",
                    InUm(*tolerance)
                )
            }
            Self::TooLong => {
                write!(f, "the segment takes more than 67108864 ticks; give a higher feed, or parts of it")
            }
            Self::NoScan(why) => write!(f, "{why}"),
            Self::ScanStart([x, y]) => {
                write!(f, "the scan begins at {}, {} mm; go there first", InMm(*x), InMm(*y))
            }
            Self::NoPlaces(why) => write!(f, "{why}"),
            Self::NoFeed => write!(f, "the feed is zero; give one above"),
            Self::NoPlanner => write!(f, "nobody plans programs for this stage; send single moves"),
            Self::NoProgram => write!(f, "no program runs that could be held or resumed"),
            Self::FeedRate(percent) => write!(f, "a feed rate of {percent} % is not in 1 … 200 %"),
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
