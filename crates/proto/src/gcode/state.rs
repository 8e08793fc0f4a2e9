//! What one block leaves to the next: modes, place, offsets, feed.

use super::action::{Corner, Place};
use super::number::{Number, Unit};
use super::words::{GROUPS, Group, Word, name_of};
use abbe_core::Pos;
use core::fmt;

/// Coordinate systems, G54 … G59.
pub const SYSTEMS: usize = 6;

/// References, G28 and G30.
pub const REFERENCES: usize = 2;

/// The state of an interpreter.
///
/// It begins as Grbl does: G0 G54 G17 G21 G90 G94, no feed, all offsets zero; and with exact stops, because nobody has
/// said yet how far a corner may be missed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    pub(super) in_force: [Option<Word>; GROUPS],
    pub(super) position: Place,
    pub(super) origins: [Place; SYSTEMS],
    pub(super) references: [Place; REFERENCES],
    pub(super) shift: Place,
    pub(super) feed: Option<Pos>,
    pub(super) tolerance: Option<Pos>,
    pub(super) skips_deleted: bool,
}

/// Every modal group with what is in force when nothing was said, in the order of a report.
const MODES: [(Group, Word); 12] = [
    (Group::Motion, Word::Rapid),
    (Group::System, Word::System(0)),
    (Group::Plane, Word::PlaneXy),
    (Group::Units, Word::Millimetres),
    (Group::Distance, Word::Absolute),
    (Group::FeedMode, Word::PerMinute),
    (Group::Centre, Word::CentreFromStart),
    (Group::Radius, Word::NoRadius),
    (Group::Length, Word::NoLength),
    (Group::Corner, Word::ExactStop),
    (Group::Spindle, Word::SpindleOff),
    (Group::Coolant, Word::CoolantOff),
];

/// What the end of a program puts in force (NISTIR 6556, 3.6.1, and Grbl, which keeps units, offsets and feed).
const AFTER_END: [(Group, Word); 6] = [
    (Group::Motion, Word::Line),
    (Group::Plane, Word::PlaneXy),
    (Group::Distance, Word::Absolute),
    (Group::Centre, Word::CentreFromStart),
    (Group::FeedMode, Word::PerMinute),
    (Group::System, Word::System(0)),
];

impl State {
    /// Of a stage that stands at `position`, in the stage frame.
    pub fn new(position: Place) -> Self {
        let mut state = Self {
            in_force: [None; GROUPS],
            position,
            origins: [[Pos::ZERO; 2]; SYSTEMS],
            references: [[Pos::ZERO; 2]; REFERENCES],
            shift: [Pos::ZERO; 2],
            feed: None,
            tolerance: None,
            skips_deleted: true,
        };
        for (group, word) in MODES {
            state.set(group, word);
        }
        state
    }

    /// Where the last block ends, in the stage frame.
    pub fn position(&self) -> Place {
        self.position
    }

    /// Says where the stage stands, when something else than a block has moved it.
    pub fn set_position(&mut self, position: Place) {
        self.position = position;
    }

    /// The place of X0 Y0, in the stage frame: the origin of the system in force and the shift of G92.
    pub fn origin(&self) -> Place {
        let [x, y] = self.origin_of(self.system());
        [x + self.shift[0], y + self.shift[1]]
    }

    /// The origin of a coordinate system, from 0 for G54; zero for one that there is not.
    pub fn origin_of(&self, system: u8) -> Place {
        self.origins.get(usize::from(system)).copied().unwrap_or_default()
    }

    /// Sets an origin, as it was kept from the last time. A system that there is not is left alone.
    pub fn set_origin(&mut self, system: u8, origin: Place) {
        if let Some(place) = self.origins.get_mut(usize::from(system)) {
            *place = origin;
        }
    }

    /// A reference, 0 for G28 and 1 for G30; zero for one that there is not.
    pub fn reference(&self, number: u8) -> Place {
        self.references.get(usize::from(number)).copied().unwrap_or_default()
    }

    /// Sets a reference, as it was kept from the last time. One that there is not is left alone.
    pub fn set_reference(&mut self, number: u8, place: Place) {
        if let Some(reference) = self.references.get_mut(usize::from(number)) {
            *reference = place;
        }
    }

    /// The shift of G92.
    pub fn shift(&self) -> Place {
        self.shift
    }

    /// The feed of G94, a length in a minute.
    pub fn feed(&self) -> Option<Pos> {
        self.feed
    }

    /// Whether blocks that begin with a slash are left out, as they are when nothing was said: NIST's block delete switch.
    pub fn skip_deleted(&mut self, skip: bool) {
        self.skips_deleted = skip;
    }

    /// The word in force of a modal group.
    pub fn in_force(&self, group: Group) -> Option<Word> {
        self.in_force.get(group as usize).copied().flatten()
    }

    /// The coordinate system in force, from 0.
    pub fn system(&self) -> u8 {
        match self.in_force(Group::System) {
            Some(Word::System(system)) => system,
            _ => 0,
        }
    }

    /// What lengths are written in.
    pub fn unit(&self) -> Unit {
        if self.in_force(Group::Units) == Some(Word::Inches) { Unit::Inch } else { Unit::Millimetre }
    }

    /// How corners are passed.
    pub fn corner(&self) -> Corner {
        if self.in_force(Group::Corner) == Some(Word::Blend) {
            Corner::Blend(self.tolerance)
        } else {
            Corner::ExactStop
        }
    }

    pub(super) fn set(&mut self, group: Group, word: Word) {
        if let Some(place) = self.in_force.get_mut(group as usize) {
            *place = Some(word);
        }
    }

    /// What M2 and M30 do.
    pub(super) fn end(&mut self) {
        for (group, word) in AFTER_END {
            self.set(group, word);
        }
    }
}

/// The modes of a state as words: `G0 G54 G17 G21 G90 G94 G91.1 G40 G49 G61 M5 M9 F0`, what Grbl answers to `$G`. The feed
/// is in the unit in force; F0 means that none was set.
#[derive(Clone, Copy, Debug)]
pub struct Modes<'a>(pub &'a State);

impl fmt::Display for Modes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (group, _) in MODES {
            if let Some(word) = self.0.in_force(group) {
                write!(f, "{} ", name_of(word))?;
            }
        }
        let feed = self.0.feed.unwrap_or_default();
        write!(f, "F{}", Number::of_length(feed, self.0.unit()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_modal_group_has_a_mode() {
        let state = State::new([Pos::ZERO; 2]);
        for group in Group::ALL {
            assert_eq!(state.in_force(group).is_some(), group.is_modal(), "{group:?}");
        }
    }

    #[test]
    fn the_modes_are_written_as_words() {
        let mut state = State::new([Pos::ZERO; 2]);
        assert_eq!(Modes(&state).to_string(), "G0 G54 G17 G21 G90 G94 G91.1 G40 G49 G61 M5 M9 F0");
        state.set(Group::Units, Word::Inches);
        state.set(Group::System, Word::System(5));
        state.feed = Some(Pos::from_pm(127_000_000_000));
        assert_eq!(Modes(&state).to_string(), "G0 G59 G17 G20 G90 G94 G91.1 G40 G49 G61 M5 M9 F5");
    }
}
