//! What a block means in a state: at most one action, and where the program goes.
//!
//! All modes of a block hold for the whole block, wherever they stand in it. Then comes what moves or waits, and last
//! what stops (NISTIR 6556, table 8).

use super::action::{Action, Arc, Effect, Flow, Move, Path, Place, Rate, Sine, Stored, Turn};
use super::arc::{by_centre, by_radius, length, slack, way};
use super::block::{Block, Coded};
use super::fault::{Error, Fault};
use super::number::Number;
use super::state::{SYSTEMS, State};
use super::take::{at, choice, within_reach};
use super::words::{Group, LETTERS, Letter, Word, name_of};
use abbe_core::Pos;

/// Highest feed, pm in a minute.
const FASTEST: i64 = 1_000_000_000_000_000_000;

/// Most periods of a sine.
const MOST_PERIODS: u64 = 1_000_000;

/// A whole turn in billionths of a degree.
const TURN: i64 = 360_000_000_000;

/// Does what a block says to `state`, and gives what the stage has to do. A block that begins with a slash does nothing
/// while such blocks are left out.
///
/// # Errors
/// Says what is wrong and in which column; then the state is as it was.
pub fn interpret(state: &mut State, block: &Block) -> Result<Effect, Error> {
    if block.is_deleted() && state.skips_deleted {
        return Ok(Effect::default());
    }
    let mut next = *state;
    let effect = Interpreter { state: &mut next, block, used: [false; LETTERS], inverse: None }.run()?;
    *state = next;
    Ok(effect)
}

/// One block on its way through a state.
pub(super) struct Interpreter<'a> {
    pub(super) state: &'a mut State,
    pub(super) block: &'a Block,
    /// Which numbers a word has taken.
    pub(super) used: [bool; LETTERS],
    /// The feed of this block, in G93.
    inverse: Option<Number>,
}

impl Interpreter<'_> {
    fn run(mut self) -> Result<Effect, Error> {
        self.set_modes();
        self.set_feed()?;
        self.set_tolerance()?;
        let action = self.act()?;
        self.all_used()?;
        Ok(Effect { action, flow: self.stop() })
    }

    fn set_modes(&mut self) {
        let feed_mode = self.state.in_force(Group::FeedMode);
        for group in Group::ALL.into_iter().filter(|group| group.is_modal()) {
            if let Some(code) = self.block.code(group) {
                self.state.set(group, code.row.word);
            }
        }
        if self.state.in_force(Group::FeedMode) != feed_mode {
            self.state.feed = None;
        }
    }

    fn set_feed(&mut self) -> Result<(), Error> {
        let Some(feed) = self.take_positive(Letter::F)? else { return Ok(()) };
        if self.state.in_force(Group::FeedMode) == Some(Word::InverseTime) {
            self.inverse = Some(feed.number);
            return Ok(());
        }
        let pm = feed.number.scaled(self.state.unit()).filter(|&pm| pm <= FASTEST);
        let pm = pm.ok_or(at(feed.column, Fault::TooFast(feed.number)))?;
        // The ninth decimal of an inch may round to nothing.
        self.state.feed = Some(Pos::from_pm(pm.max(1)));
        Ok(())
    }

    fn set_tolerance(&mut self) -> Result<(), Error> {
        if self.block.code(Group::Corner).is_some_and(|code| code.row.word == Word::Blend) {
            let given = self.take_positive(Letter::P)?;
            self.state.tolerance = given.map(|given| self.length(Letter::P, given)).transpose()?;
        }
        Ok(())
    }

    fn act(&mut self) -> Result<Option<Action>, Error> {
        let Some(code) = self.block.code(Group::Once) else { return self.motion(None) };
        if code.row.word == Word::Machine {
            return self.motion(Some(code));
        }
        self.refuse_a_motion_beside(code)?;
        self.once(code).map(Some)
    }

    fn once(&mut self, code: Coded) -> Result<Action, Error> {
        match code.row.word {
            Word::Dwell => self.dwell(code),
            Word::SetOrigin => self.set_origin(code),
            Word::Reference(number) => self.go_to_reference(number),
            Word::StoreReference(number) => {
                let place = self.state.position;
                self.state.set_reference(number, place);
                Ok(Action::Stored(Stored::Reference { number, place }))
            }
            Word::Shift => self.shift(code),
            // All other words of this group are done elsewhere: this is G92.1.
            _ => {
                self.state.shift = [Pos::ZERO; 2];
                Ok(Action::Stored(Stored::Shift(self.state.shift)))
            }
        }
    }

    /// G10, G28, G30 and G92 want the axis words that a motion would want, too.
    fn refuse_a_motion_beside(&self, code: Coded) -> Result<(), Error> {
        let Some(motion) = self.block.code(Group::Motion) else { return Ok(()) };
        if motion.row.word == Word::NoMotion {
            return Ok(());
        }
        let fault = Fault::TwoMotions { motion: motion.row.name, other: code.row.name };
        Err(at(motion.column.max(code.column), fault))
    }

    fn dwell(&mut self, code: Coded) -> Result<Action, Error> {
        let seconds = self.need(Letter::P, code, "P, the seconds")?;
        let nanoseconds = u64::try_from(seconds.number.billionths());
        let nanoseconds = nanoseconds.map_err(|_| choice(seconds, Letter::P, "a time of zero or more"))?;
        Ok(Action::Dwell { nanoseconds })
    }

    fn set_origin(&mut self, code: Coded) -> Result<Action, Error> {
        let kind = self.need(Letter::L, code, "L2 or L20")?;
        let index = self.need(Letter::P, code, "P, the number of a coordinate system")?;
        let system = match index.number.whole() {
            Some(0) => self.state.system(),
            Some(number) if number as usize <= SYSTEMS => number.saturating_sub(1) as u8,
            _ => return Err(choice(index, Letter::P, "a coordinate system, 0 to 6")),
        };
        let base = match kind.number.whole() {
            Some(2) => None,
            Some(20) => Some(less(self.state.position, self.state.shift)),
            _ => return Err(choice(kind, Letter::L, "2 or 20")),
        };
        let mut origin = self.state.origin_of(system);
        self.each_axis(code, |axis, value| {
            let Some(coordinate) = origin.get_mut(axis) else { return Pos::ZERO };
            *coordinate = base.and_then(|base| base.get(axis).copied()).map_or(value, |base| base - value);
            *coordinate
        })?;
        self.state.set_origin(system, origin);
        Ok(Action::Stored(Stored::Origin { system, origin }))
    }

    fn shift(&mut self, code: Coded) -> Result<Action, Error> {
        let base = less(self.state.position, self.state.origin_of(self.state.system()));
        let mut shift = self.state.shift;
        self.each_axis(code, |axis, value| {
            let (Some(coordinate), Some(base)) = (shift.get_mut(axis), base.get(axis)) else {
                return Pos::ZERO;
            };
            *coordinate = *base - value;
            *coordinate
        })?;
        self.state.shift = shift;
        Ok(Action::Stored(Stored::Shift(shift)))
    }

    /// Hands the value of each axis word to `set`, which gives the place that comes of it.
    fn each_axis(&mut self, code: Coded, mut set: impl FnMut(usize, Pos) -> Pos) -> Result<(), Error> {
        self.need_an_axis(code)?;
        for (axis, letter) in [Letter::X, Letter::Y].into_iter().enumerate() {
            let Some(given) = self.take(letter)? else { continue };
            let value = self.length(letter, given)?;
            within_reach(set(axis, value), letter, given)?;
        }
        Ok(())
    }

    fn go_to_reference(&mut self, number: u8) -> Result<Action, Error> {
        let named = [Letter::X, Letter::Y].map(|letter| self.block.number(letter).is_some());
        let from = self.state.position;
        let via = self.target(false)?;
        let reference = self.state.reference(number);
        let to = match named {
            [true, false] => [reference[0], via[1]],
            [false, true] => [via[0], reference[1]],
            _ => reference,
        };
        self.state.position = to;
        Ok(Action::Reference { from, via, to })
    }

    fn motion(&mut self, machine: Option<Coded>) -> Result<Option<Action>, Error> {
        let motion = self.state.in_force(Group::Motion).unwrap_or(Word::NoMotion);
        if let Some(code) = machine {
            if !matches!(motion, Word::Rapid | Word::Line) {
                return Err(at(code.column, Fault::MachineCurve(name_of(motion))));
            }
            self.need_an_axis(code)?;
        }
        let Some(column) = self.motion_column(motion) else { return Ok(None) };
        if motion == Word::NoMotion {
            return Err(at(column, Fault::NoMotion));
        }
        let from = self.state.position;
        let to = self.target(machine.is_some())?;
        let path = self.path(motion, from, to, column)?;
        let rate = self.rate(motion, column)?;
        self.state.position = to;
        Ok(Some(Action::Move(Move { from, to, path, rate, corner: self.state.corner() })))
    }

    /// Where a block asks for motion: at its motion word, or at the first number that is a place. Nothing if it only
    /// chooses a way of moving.
    fn motion_column(&self, motion: Word) -> Option<u16> {
        let letters: &[Letter] = match motion {
            Word::Clockwise | Word::Counterclockwise => {
                &[Letter::X, Letter::Y, Letter::I, Letter::J, Letter::R]
            }
            _ => &[Letter::X, Letter::Y],
        };
        let first =
            letters.iter().filter_map(|&letter| self.block.number(letter)).map(|given| given.column).min()?;
        let word = self.block.code(Group::Motion).filter(|code| code.row.word != Word::NoMotion);
        Some(word.map_or(first, |code| code.column))
    }

    /// Where X and Y lead. An axis that is not named stays.
    fn target(&mut self, machine: bool) -> Result<Place, Error> {
        let origin = if machine {
            [Pos::ZERO; 2]
        } else if self.state.in_force(Group::Distance) == Some(Word::Incremental) {
            self.state.position
        } else {
            self.state.origin()
        };
        let [x, y] = self.state.position;
        Ok([self.coordinate(Letter::X, origin[0], x)?, self.coordinate(Letter::Y, origin[1], y)?])
    }

    fn coordinate(&mut self, letter: Letter, origin: Pos, stays: Pos) -> Result<Pos, Error> {
        let Some(given) = self.take(letter)? else { return Ok(stays) };
        let value = self.length(letter, given)?;
        within_reach(origin + value, letter, given)
    }

    fn path(&mut self, motion: Word, from: Place, to: Place, column: u16) -> Result<Path, Error> {
        match motion {
            Word::Clockwise => Ok(Path::Arc(self.arc(Turn::Clockwise, from, to, column)?)),
            Word::Counterclockwise => Ok(Path::Arc(self.arc(Turn::Counterclockwise, from, to, column)?)),
            Word::Sine => Ok(Path::Sine(self.sine(from, to, column)?)),
            _ => Ok(Path::Line),
        }
    }

    fn arc(&mut self, turn: Turn, from: Place, to: Place, column: u16) -> Result<Arc, Error> {
        let (i, j, r) = (self.take(Letter::I)?, self.take(Letter::J)?, self.take(Letter::R)?);
        let unit = self.state.unit();
        match (i.or(j), r) {
            (Some(_), Some(r)) => Err(at(r.column, Fault::TwoCentres)),
            (None, Some(r)) => {
                let radius = self.length(Letter::R, r)?;
                by_radius(from, to, radius, turn, unit).map_err(|fault| at(r.column, fault))
            }
            (Some(centre), None) => {
                let offset = [self.length_or_zero(Letter::I, i)?, self.length_or_zero(Letter::J, j)?];
                by_centre(from, to, offset, turn, unit).map_err(|fault| at(centre.column, fault))
            }
            (None, None) => {
                let word = if turn == Turn::Clockwise { Word::Clockwise } else { Word::Counterclockwise };
                Err(at(column, Fault::NoCentre(name_of(word))))
            }
        }
    }

    fn sine(&mut self, from: Place, to: Place, column: u16) -> Result<Sine, Error> {
        let word = name_of(Word::Sine);
        let missing = |needs| at(column, Fault::Missing { word, needs });
        let amplitude = self.take_positive(Letter::P)?.ok_or(missing("P, the amplitude"))?;
        let period = self.take_positive(Letter::L)?.ok_or(missing("L, the period"))?;
        let (amplitude, period_column) = (self.length(Letter::P, amplitude)?, period.column);
        let period = self.length(Letter::L, period)?;
        let phase = match self.take(Letter::Q)? {
            Some(phase) if (0..TURN).contains(&phase.number.billionths()) => phase.number,
            Some(phase) => return Err(choice(phase, Letter::Q, "a phase from 0 to less than 360 degrees")),
            None => Number::default(),
        };
        if from == to {
            return Err(at(column, Fault::NoWay));
        }
        let periods =
            self.periods(length(way(from, to)), period).map_err(|fault| at(period_column, fault))?;
        Ok(Sine { amplitude, periods, phase })
    }

    /// How many periods lie in a way; they are stretched by what the way is too long for a whole number.
    fn periods(&self, way: Pos, period: Pos) -> Result<u32, Fault> {
        let (length, one) = (way.pm().unsigned_abs(), period.pm().unsigned_abs().max(1));
        let periods = length.saturating_add(one / 2).checked_div(one).unwrap_or(0);
        let error = periods.saturating_mul(one).abs_diff(length);
        let allowed = slack(period, self.state.unit()).pm().unsigned_abs();
        if error > allowed || periods == 0 {
            return Err(Fault::PartOfPeriod { way, period, periods });
        }
        if periods > MOST_PERIODS {
            return Err(Fault::ManyPeriods(periods));
        }
        Ok(periods as u32)
    }

    fn rate(&self, motion: Word, column: u16) -> Result<Rate, Error> {
        if motion == Word::Rapid {
            return Ok(Rate::Rapid);
        }
        if self.state.in_force(Group::FeedMode) == Some(Word::InverseTime) {
            return self.inverse.map(Rate::Inverse).ok_or(at(column, Fault::NoInverseFeed));
        }
        self.state.feed.map(Rate::PerMinute).ok_or(at(column, Fault::NoFeed))
    }

    fn stop(&mut self) -> Option<Flow> {
        if self.block.code(Group::Stop)?.row.word == Word::Pause {
            return Some(Flow::Pause);
        }
        self.state.end();
        Some(Flow::End)
    }
}

fn less(place: Place, other: Place) -> Place {
    [place[0] - other[0], place[1] - other[1]]
}
