//! A program looked at as a whole, once, before anything moves.
//!
//! All errors are found that are certain. A motion that leaves the travel is understood all the same: the check goes on
//! from its end, and on that axis tells again only what leads farther out. Behind a block that is refused nobody knows
//! where the stage would stand and what would be in force; from there on only the words of each line are looked at,
//! which depend on nothing before.

use super::course::Course;
use super::feed::Feeds;
use super::lines::{Line, Lines, LinesError};
use super::summary::Summary;
use super::travel::{Breach, Told, Travel};
use crate::preset::Preset;
use abbe_proto::gcode::{self, Action, Block, Effect, Flow, Place, State, interpret};
use std::fmt;
use std::io::BufRead;

/// So many errors are told one by one.
pub(crate) const MOST: usize = 20;

/// An error of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Found {
    /// From 1.
    pub(crate) line: u64,
    /// Bytes of the line from 1, where one word is to blame.
    pub(crate) column: Option<u16>,
    pub(crate) what: What,
}

/// What is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum What {
    /// A block is refused.
    Refused(gcode::Fault),
    /// A motion leaves the travel.
    OutOfTravel { breach: Breach, action: Action },
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(fault) => fault.fmt(f),
            Self::OutOfTravel { breach, action } => Told(breach, action).fmt(f),
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

/// Goes through a program for a stage that stands at `stands`.
///
/// # Errors
/// The program cannot be read to its end, or Ctrl-C.
pub(crate) fn check<R: BufRead>(
    mut lines: Lines<'_, R>,
    preset: &Preset,
    stands: Place,
) -> Result<Checked, LinesError> {
    let mut check = Check::new(preset, stands);
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
    state: State,
    /// For x and y: the last motion has ended beyond the travel, and that was told.
    known: [bool; 2],
    pub(super) checked: Checked,
}

impl Check {
    pub(super) fn new(preset: &Preset, stands: Place) -> Self {
        let feeds = Feeds::new(preset.controller.settings.axes.each_ref().map(|axis| axis.speed_mm_s));
        let summary = Summary::default();
        Self {
            travel: Travel::of(preset),
            state: State::new(stands),
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
            Action::Move(there) => (there.from, there.to, Course::of(there)),
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

    fn refuse(&mut self, line: u64, error: gcode::Error) {
        self.checked.refused.get_or_insert(line);
        self.find(Found { line, column: Some(error.column), what: What::Refused(error.fault) });
    }

    fn find(&mut self, found: Found) {
        self.checked.count += 1;
        if self.checked.errors.len() < MOST {
            self.checked.errors.push(found);
        }
    }
}
