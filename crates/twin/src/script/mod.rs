//! Scripts: what is done to a stage and what must be seen, line by line, in words.
//!
//! The scenarios of `tests/scenarios` are such scripts, and `abbe record --script` plays them; the words are listed in
//! the README there. [`parse`] reads a script, [`Player`] plays it on any [`Stage`].

mod parse;
mod play;

pub use parse::{ScriptError, parse};
pub use play::{PlayError, Player, Stage};

use crate::Event;
use abbe_core::machine::State;
use abbe_core::plan::Segment;
use abbe_core::sense::health::Grade;
use abbe_core::{Command, Pos};

/// A line that says something.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its number in the script, from 1.
    pub number: usize,
    /// What it says.
    pub step: Step,
}

/// What a line says.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Ask the controller, and wait until it is no longer busy.
    Do(Command<2>),
    /// Ask the controller, and go on.
    Ask(Command<2>),
    /// A segment of a program, as soon as there is room for it, at a feed, mm/s, or as fast as the axes can go.
    Go(Segment, Option<f64>),
    /// Let time pass, s.
    Wait(f64),
    /// Wait until the controller is no longer busy.
    Settle,
    /// Wait until there is a fault.
    WaitUntilFault,
    /// Wait until the slides stand.
    WaitUntilRest,
    /// The same several times.
    Repeat(u32, Box<Step>),
    /// Something happens to the stage.
    Happen(Event),
    /// Something must be seen.
    Expect(Expectation),
}

/// What must be seen.
#[derive(Clone, Debug, PartialEq)]
pub enum Expectation {
    /// The state of the machine.
    State(State),
    /// The fault, in the words of the scripts: one, or one of several with ` or ` between them.
    Fault(String),
    /// No fault.
    NoFault,
    /// The last request was refused, with these words in the answer.
    Refused(String),
    /// The last request was taken.
    Accepted,
    /// The table is at a place, within a tolerance.
    At([Pos; 2], Within),
    /// The slides went no farther since the last event.
    SlidesStopped(Within),
    /// The following error was smaller all the time.
    FollowingErrorBelow(Within),
    /// The set-point stayed on the line since the last request.
    PathWithin(Within),
    /// The targets, exactly.
    Targets([Pos; 2]),
    /// The zero of an axis moved no farther between its last two homings.
    ZeroShift(usize, Within),
    /// The switch of an axis moved so far, µm, between its last two homings.
    SwitchShift(usize, f64, Within),
    /// The signals of an axis have this grade.
    Signals(usize, Grade),
    /// No position is below zero.
    PositionPositive,
}

/// A tolerance, µm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Within(pub f64);
