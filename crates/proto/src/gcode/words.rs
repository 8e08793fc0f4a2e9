//! The table of words: what each is called, which others it excludes, which numbers it takes, what it does.
//!
//! Reader, report of modes and `docs/gcode.md` take it from here and from nowhere else. The groups are those of NIST
//! RS274/NGC version 3 (NISTIR 6556, table 4).

use core::fmt;

/// A set of words of which a block may hold one. A modal group has a word in force at all times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Done once, in their block only.
    Once,
    /// How the axes move.
    Motion,
    /// The plane of arcs.
    Plane,
    /// What the numbers of axes count from.
    Distance,
    /// What the numbers of centres count from.
    Centre,
    /// What F means.
    FeedMode,
    /// What lengths are written in.
    Units,
    /// The radius of a tool.
    Radius,
    /// The length of a tool.
    Length,
    /// The coordinate system.
    System,
    /// What happens at corners.
    Corner,
    /// Stops of the program.
    Stop,
    /// A spindle.
    Spindle,
    /// A coolant.
    Coolant,
}

/// How many groups there are.
pub(super) const GROUPS: usize = 14;

impl Group {
    /// In the order of the table.
    pub(super) const ALL: [Self; GROUPS] = [
        Self::Once,
        Self::Motion,
        Self::Plane,
        Self::Distance,
        Self::Centre,
        Self::FeedMode,
        Self::Units,
        Self::Radius,
        Self::Length,
        Self::System,
        Self::Corner,
        Self::Stop,
        Self::Spindle,
        Self::Coolant,
    ];

    /// True if its words stay in force for the blocks that follow.
    pub const fn is_modal(self) -> bool {
        !matches!(self, Self::Once | Self::Stop)
    }

    /// What its words choose.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Once => "what is done once",
            Self::Motion => "the motion",
            Self::Plane => "the plane",
            Self::Distance => "what X and Y count from",
            Self::Centre => "what I and J count from",
            Self::FeedMode => "what F means",
            Self::Units => "the unit of lengths",
            Self::Radius => "the radius of a tool",
            Self::Length => "the length of a tool",
            Self::System => "the coordinate system",
            Self::Corner => "what happens at corners",
            Self::Stop => "where the program goes",
            Self::Spindle => "what a spindle does",
            Self::Coolant => "what a coolant does",
        }
    }
}

/// What a G or M word means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Word {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2.
    Clockwise,
    /// G3.
    Counterclockwise,
    /// G5.5.
    Sine,
    /// G80.
    NoMotion,
    /// G4.
    Dwell,
    /// G10.
    SetOrigin,
    /// G28, G30: which of the two.
    Reference(u8),
    /// G28.1, G30.1: which of the two.
    StoreReference(u8),
    /// G53.
    Machine,
    /// G92.
    Shift,
    /// G92.1.
    NoShift,
    /// G17.
    PlaneXy,
    /// G20.
    Inches,
    /// G21.
    Millimetres,
    /// G40.
    NoRadius,
    /// G49.
    NoLength,
    /// G54 … G59: which of the six, from 0.
    System(u8),
    /// G61, G61.1.
    ExactStop,
    /// G64.
    Blend,
    /// G90.
    Absolute,
    /// G91.
    Incremental,
    /// G91.1.
    CentreFromStart,
    /// G93.
    InverseTime,
    /// G94.
    PerMinute,
    /// M0.
    Pause,
    /// M2, M30.
    End,
    /// M5.
    SpindleOff,
    /// M9.
    CoolantOff,
}

/// The name of a G or M word: `G28.1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    /// G or M.
    pub letter: char,
    /// Ten times the number.
    pub tenths: u16,
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Write::write_char(f, self.letter)?;
        fmt::Display::fmt(&self.tenths.checked_div(10).unwrap_or(0), f)?;
        match self.tenths.checked_rem(10) {
            Some(tenth @ 1..) => write!(f, ".{tenth}"),
            _ => Ok(()),
        }
    }
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// What it is called.
    pub name: Name,
    /// Which other words it excludes.
    pub group: Group,
    /// What it means to the interpreter.
    pub word: Word,
    /// The numbers it takes; those in brackets may be left out.
    pub takes: &'static str,
    /// What it does, for people.
    pub does: &'static str,
}

const fn g(tenths: u16, group: Group, word: Word, takes: &'static str, does: &'static str) -> Row {
    Row { name: Name { letter: 'G', tenths }, group, word, takes, does }
}

const fn m(number: u16, group: Group, word: Word, does: &'static str) -> Row {
    Row { name: Name { letter: 'M', tenths: number.saturating_mul(10) }, group, word, takes: "", does }
}

/// Every word that is accepted. Where two have one meaning, the first is the one that is written.
#[rustfmt::skip]
pub static TABLE: &[Row] = &[
    g(0, Group::Motion, Word::Rapid, "X Y", "a straight line as fast as the limits allow"),
    g(10, Group::Motion, Word::Line, "X Y", "a straight line at the feed"),
    g(20, Group::Motion, Word::Clockwise, "[X Y] I J, or X Y R", "an arc clockwise"),
    g(30, Group::Motion, Word::Counterclockwise, "[X Y] I J, or X Y R", "an arc counterclockwise"),
    g(55, Group::Motion, Word::Sine, "X Y P L [Q]", "a sine about the straight line to X Y: amplitude P, period L, phase Q in degrees"),
    g(800, Group::Motion, Word::NoMotion, "", "no motion: axis words are refused until the next motion word"),
    g(40, Group::Once, Word::Dwell, "P", "waits P seconds"),
    g(100, Group::Once, Word::SetOrigin, "L P, X Y", "sets the origin of coordinate system P (1 for G54 … 6 for G59, 0 for the one in force): L2 to X Y of the machine, L20 so that the stage stands at X Y"),
    g(280, Group::Once, Word::Reference(0), "[X Y]", "goes to the first reference, as fast as the limits allow; with X or Y through that place, and only these axes go on"),
    g(281, Group::Once, Word::StoreReference(0), "", "stores the present place as the first reference"),
    g(300, Group::Once, Word::Reference(1), "[X Y]", "goes to the second reference, like G28"),
    g(301, Group::Once, Word::StoreReference(1), "", "stores the present place as the second reference"),
    g(530, Group::Once, Word::Machine, "X Y", "X and Y of this block are the machine's own, in G90 and G91; with G0 or G1"),
    g(920, Group::Once, Word::Shift, "X Y", "shifts all coordinate systems so that the stage stands at X Y"),
    g(921, Group::Once, Word::NoShift, "", "takes the shift of G92 back"),
    g(170, Group::Plane, Word::PlaneXy, "", "arcs lie in the X-Y plane; there is no other"),
    g(900, Group::Distance, Word::Absolute, "", "X and Y count from the origin"),
    g(910, Group::Distance, Word::Incremental, "", "X and Y count from where the last block ended"),
    g(911, Group::Centre, Word::CentreFromStart, "", "I and J count from the beginning of the arc; there is no other way"),
    g(930, Group::FeedMode, Word::InverseTime, "F", "F is 1/min: a block of motion takes 1/F minutes, and each needs its F"),
    g(940, Group::FeedMode, Word::PerMinute, "[F]", "F is a length in a minute"),
    g(200, Group::Units, Word::Inches, "", "lengths are inches of 25.4 mm, in this block already"),
    g(210, Group::Units, Word::Millimetres, "", "lengths are millimetres, in this block already"),
    g(400, Group::Radius, Word::NoRadius, "", "no tool radius; there is no tool"),
    g(490, Group::Length, Word::NoLength, "", "no tool length; there is no tool"),
    g(540, Group::System, Word::System(0), "", "coordinate system 1"),
    g(550, Group::System, Word::System(1), "", "coordinate system 2"),
    g(560, Group::System, Word::System(2), "", "coordinate system 3"),
    g(570, Group::System, Word::System(3), "", "coordinate system 4"),
    g(580, Group::System, Word::System(4), "", "coordinate system 5"),
    g(590, Group::System, Word::System(5), "", "coordinate system 6"),
    g(610, Group::Corner, Word::ExactStop, "", "stops at every corner"),
    g(611, Group::Corner, Word::ExactStop, "", "the same"),
    g(640, Group::Corner, Word::Blend, "[P]", "rounds corners, P off them at most; without P as the stage is set"),
    m(0, Group::Stop, Word::Pause, "waits until the user goes on"),
    m(2, Group::Stop, Word::End, "ends the program; G1, G17, G54, G90, G91.1, G94 are in force again, offsets and feed stay"),
    m(30, Group::Stop, Word::End, "the same"),
    m(5, Group::Spindle, Word::SpindleOff, "nothing; there is no spindle"),
    m(9, Group::Coolant, Word::CoolantOff, "nothing; there is no coolant"),
];

/// The row of a word that somebody wrote.
pub(super) fn find(letter: char, tenths: u32) -> Option<&'static Row> {
    TABLE.iter().find(|row| row.name.letter == letter && u32::from(row.name.tenths) == tenths)
}

/// The name of a word, the first one if it has two.
pub fn name_of(word: Word) -> Name {
    // Every word has a row (`every_word_has_a_row`); G80 stands in for what cannot be.
    TABLE.iter().find(|row| row.word == word).map_or(Name { letter: 'G', tenths: 800 }, |row| row.name)
}

/// A letter in front of a number that some word takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Letter {
    /// Place.
    X,
    /// Place.
    Y,
    /// Centre.
    I,
    /// Centre.
    J,
    /// Radius.
    R,
    /// Time, number, tolerance or amplitude.
    P,
    /// What G10 does, or a period.
    L,
    /// Phase.
    Q,
    /// Feed.
    F,
}

/// How many letters there are.
pub(super) const LETTERS: usize = 9;

impl Letter {
    /// All, in the order of their numbers.
    pub(super) const ALL: [Self; LETTERS] =
        [Self::X, Self::Y, Self::I, Self::J, Self::R, Self::P, Self::L, Self::Q, Self::F];

    /// As it is written.
    pub const fn letter(self) -> char {
        match self {
            Self::X => 'X',
            Self::Y => 'Y',
            Self::I => 'I',
            Self::J => 'J',
            Self::R => 'R',
            Self::P => 'P',
            Self::L => 'L',
            Self::Q => 'Q',
            Self::F => 'F',
        }
    }

    /// From a capital.
    pub(super) fn of(letter: char) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.letter() == letter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_different_and_found() {
        for (at, row) in TABLE.iter().enumerate() {
            let found = find(row.name.letter, row.name.tenths.into()).unwrap();
            assert!(core::ptr::eq(found, row), "{} stands twice in the table", row.name);
            assert_eq!(
                TABLE.iter().position(|other| other.word == row.word).map(|first| first <= at),
                Some(true)
            );
        }
        assert!(find('G', 23).is_none());
    }

    #[test]
    fn arrays_are_in_the_order_of_their_numbers() {
        assert!(Group::ALL.iter().enumerate().all(|(at, group)| *group as usize == at));
        assert!(Letter::ALL.iter().enumerate().all(|(at, letter)| *letter as usize == at));
    }
}
