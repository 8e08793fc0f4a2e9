//! Numbers of a block, each for one word only.

use super::block::{Coded, Given};
use super::fault::{Error, Fault};
use super::interpret::Interpreter;
use super::number::REACH;
use super::words::Letter;
use abbe_core::Pos;

pub(super) fn at(column: u16, fault: Fault) -> Error {
    Error { column, fault }
}

/// A number that is none of those that may be.
pub(super) fn choice(given: Given, letter: Letter, allowed: &'static str) -> Error {
    at(given.column, Fault::Choice { letter: letter.letter(), found: given.number, allowed })
}

/// A coordinate, unless it is beyond [`REACH`].
pub(super) fn within_reach(place: Pos, letter: Letter, given: Given) -> Result<Pos, Error> {
    if place.abs() <= REACH { Ok(place) } else { Err(out_of_reach(letter, given)) }
}

fn out_of_reach(letter: Letter, given: Given) -> Error {
    at(given.column, Fault::OutOfReach(letter.letter()))
}

impl Interpreter<'_> {
    /// Takes a number for a word, if it is there.
    pub(super) fn take(&mut self, letter: Letter) -> Result<Option<Given>, Error> {
        let Some(given) = self.block.number(letter) else { return Ok(None) };
        match self.used.get_mut(letter as usize) {
            Some(used) if !*used => *used = true,
            _ => return Err(at(given.column, Fault::Shared(letter.letter()))),
        }
        Ok(Some(given))
    }

    /// The same, more than zero.
    pub(super) fn take_positive(&mut self, letter: Letter) -> Result<Option<Given>, Error> {
        let given = self.take(letter)?;
        match given {
            Some(Given { number, column }) if number.billionths() <= 0 => {
                Err(at(column, Fault::NotPositive { letter: letter.letter(), found: number }))
            }
            _ => Ok(given),
        }
    }

    /// A number without which its word means nothing.
    pub(super) fn need(&mut self, letter: Letter, code: Coded, needs: &'static str) -> Result<Given, Error> {
        let missing = at(code.column, Fault::Missing { word: code.row.name, needs });
        self.take(letter)?.ok_or(missing)
    }

    pub(super) fn need_an_axis(&self, code: Coded) -> Result<(), Error> {
        if [Letter::X, Letter::Y].into_iter().any(|letter| self.block.number(letter).is_some()) {
            return Ok(());
        }
        Err(at(code.column, Fault::Missing { word: code.row.name, needs: "X or Y" }))
    }

    /// A number as a length in the unit in force.
    pub(super) fn length(&self, letter: Letter, given: Given) -> Result<Pos, Error> {
        given.number.length(self.state.unit()).ok_or(out_of_reach(letter, given))
    }

    /// A length that is zero when it is left out.
    pub(super) fn length_or_zero(&self, letter: Letter, given: Option<Given>) -> Result<Pos, Error> {
        given.map_or(Ok(Pos::ZERO), |given| self.length(letter, given))
    }

    /// Refuses what no word has taken.
    pub(super) fn all_used(&self) -> Result<(), Error> {
        for (letter, used) in Letter::ALL.into_iter().zip(self.used) {
            if let Some(given) = self.block.number(letter).filter(|_| !used) {
                return Err(at(given.column, Fault::Unused(letter.letter())));
            }
        }
        Ok(())
    }
}
