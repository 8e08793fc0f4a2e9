//! A program looked at as a whole, once, before anything moves.
//!
//! All errors are found that are certain. A motion that leaves the travel is understood all the same: the check goes on
//! from its end, and on that axis tells again only what leads farther out. Behind a block that is refused nobody knows
//! where the stage would stand and what would be in force; from there on only the words of each line are looked at,
//! which depend on nothing before.

use super::course::{Course, curve};
use super::feed::Feeds;
use super::lines::{Line, Lines, LinesError};
use super::steps::feed;
use super::stepwise::survey::Fault;
use super::summary::Summary;
use super::travel::{Breach, Told, Travel};
use crate::preset::{Controller, Preset};
use abbe_core::command::Refusal;
use abbe_core::plan::Limits;
use abbe_proto::gcode::{self, Action, Block, Effect, Flow, Move, State, interpret};
use std::fmt;
use std::io::BufRead;

/// So many errors are told one by one.
pub(crate) const MOST: usize = 20;

/// An error of a program.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Found {
    /// From 1.
    pub(crate) line: u64,
    /// Bytes of the line from 1, where one word is to blame.
    pub(crate) column: Option<u16>,
    pub(crate) what: What,
}

/// What is wrong.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum What {
    /// A block is refused.
    Refused(gcode::Fault),
    /// A motion leaves the travel.
    OutOfTravel { breach: Breach, action: Action },
    /// A motion in a shape that the controller does not take.
    NoCurve,
    /// A motion that takes longer than one may, s.
    Slow { takes_s: f64, most_s: f64 },
    /// A motion that cannot be gone through step by step.
    Stepwise(Fault),
}

/// A motion may take so many ticks: its times are numbers that have to fit.
const LONGEST_TICKS: f64 = 67_108_864.0;

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(fault) => fault.fmt(f),
            Self::OutOfTravel { breach, action } => Told(breach, action).fmt(f),
            Self::NoCurve => Refusal::NoCurve.fmt(f),
            Self::Stepwise(fault) => fault.fmt(f),
            Self::Slow { takes_s, most_s } => write!(
                f,
                "the motion takes {takes_s:.0} s, at its feed or where it bends most, and one may take {most_s:.0} s; \
                 give a larger F, or divide it"
            ),
        }
    }
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let column = self.column.map(|column| format!(", column {column}")).unwrap_or_default();
        write!(f, "line {}{column}: {}", self.line, self.what)
    }
}

/// What was found in a program.
#[derive(Debug)]
pub(crate) struct Checked {
    pub(crate) summary: Summary,
    /// The first [`MOST`] errors, in the order of their lines.
    pub(crate) errors: Vec<Found>,
    /// How many there are.
    pub(crate) count: u64,
    /// The block that was refused first: behind it only words were looked at.
    pub(crate) refused: Option<u64>,
    pub(crate) feeds: Feeds,
}

/// Goes through a program, to be run at so many percent of its feeds by a stage that stands where programs begin.
///
/// # Errors
/// The program cannot be read to its end, or Ctrl-C.
pub(crate) fn check<R: BufRead>(
    mut lines: Lines<'_, R>,
    preset: &Preset,
    percent: u16,
) -> Result<Checked, LinesError> {
    let mut check = Check::new(preset, percent);
    while let Some(line) = lines.next()? {
        if check.line(&line).is_last {
            break;
        }
    }
    Ok(check.checked)
}

/// A line that was looked at.
pub(super) struct Looked {
    /// What it does, if it was understood.
    pub(super) effect: Option<Effect>,
    /// The program ends with it.
    pub(super) is_last: bool,
}

/// On its way through a program.
pub(super) struct Check {
    travel: Travel,
    limits: [Limits; 2],
    tick_hz: f64,
    /// Part of the feeds.
    rate: f64,
    state: State,
    /// For x and y: the last motion has ended beyond the travel, and that was told.
    known: [bool; 2],
    pub(super) checked: Checked,
}

impl Check {
    pub(super) fn new(preset: &Preset, percent: u16) -> Self {
        let Controller { settings, config, .. } = &preset.controller;
        let feeds = Feeds::new(settings.axes.each_ref().map(|axis| axis.speed_mm_s));
        let summary = Summary::default();
        let travel = Travel::of(preset);
        Self {
            travel,
            limits: config.axes.map(|axis| axis.limits),
            tick_hz: settings.tick_hz,
            rate: f64::from(percent) / 100.0,
            state: State::new(travel.start()),
            known: [false; 2],
            checked: Checked { summary, errors: Vec::new(), count: 0, refused: None, feeds },
        }
    }

    /// Looks at a line.
    pub(super) fn line(&mut self, line: &Line<'_>) -> Looked {
        self.checked.summary.lines = line.number;
        let block = match line.block() {
            Ok(block) => block,
            Err(error) => {
                self.refuse(line.number, error);
                return Looked { effect: None, is_last: false };
            }
        };
        if self.checked.refused.is_some() {
            return Looked { effect: None, is_last: block.is_end() && !block.is_deleted() };
        }
        self.block(line.number, &block)
    }

    fn block(&mut self, line: u64, block: &Block) -> Looked {
        let effect = match interpret(&mut self.state, block) {
            Ok(effect) => effect,
            Err(error) => {
                self.refuse(line, error);
                return Looked { effect: None, is_last: block.is_end() };
            }
        };
        let course = effect.action.as_ref().and_then(|action| self.motion(line, block, action));
        self.checked.summary.add(&effect, course.as_ref());
        Looked { effect: Some(effect), is_last: effect.flow == Some(Flow::End) }
    }

    /// Looks at the way of an action that moves.
    fn motion(&mut self, line: u64, block: &Block, action: &Action) -> Option<Course> {
        let (from, to, course) = match action {
            Action::Move(there) => (there.from, there.to, self.course(line, there)?),
            Action::Reference { from, via, to } => (*from, *to, Course::over(*from, *via, *to)),
            Action::Dwell { .. } | Action::Stored(_) => return None,
        };
        let travel = self.travel;
        for breach in travel.breaches(from, self.known, &course.reach) {
            let what = What::OutOfTravel { breach, action: *action };
            self.find(Found { line, column: breach.column(block), what });
        }
        self.known = self.travel.is_beyond(to);
        if let Action::Move(there) = action {
            self.checked.feeds.look(line, there.rate, &course);
        }
        Some(course)
    }

    /// The course of a motion along its curve, if it has one.
    fn course(&mut self, line: u64, there: &Move) -> Option<Course> {
        let Some(curve) = curve(there) else {
            self.find(Found { line, column: None, what: What::NoCurve });
            return None;
        };
        let feed = feed(there.rate, curve.length(), self.tick_hz).pm() * self.rate;
        let ticks = curve.length() / curve.limits(&self.limits, feed).speed;
        if ticks > LONGEST_TICKS {
            let [takes_s, most_s] = [ticks, LONGEST_TICKS].map(|ticks| ticks / self.tick_hz);
            self.find(Found { line, column: None, what: What::Slow { takes_s, most_s } });
        }
        Some(Course::of(there, &curve))
    }

    fn refuse(&mut self, line: u64, error: gcode::Error) {
        self.checked.refused.get_or_insert(line);
        self.find(Found { line, column: Some(error.column), what: What::Refused(error.fault) });
    }

    pub(super) fn find(&mut self, found: Found) {
        self.checked.count += 1;
        if self.checked.errors.len() < MOST {
            self.checked.errors.push(found);
        }
    }
}
