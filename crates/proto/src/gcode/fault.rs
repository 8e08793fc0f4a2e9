//! What is wrong with a block, and where.

use super::number::Number;
use super::words::{Group, Name};
use abbe_core::Pos;
use abbe_core::units::InMm;
use core::fmt;

/// A block that is refused. Nothing of it was done and no mode has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error {
    /// Where in the line, bytes from 1.
    pub column: u16,
    /// What.
    pub fault: Fault,
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A line of more than [`LONGEST`](super::LONGEST) bytes.
    TooLong(usize),
    /// A byte that is no printable ASCII, outside comments.
    NotText(u8),
    /// A character that begins nothing.
    Stray(char),
    /// Parameters, expressions and subprograms are not read.
    Computed(char),
    /// A number without a letter before it.
    NoLetter,
    /// A letter without a number behind it.
    NoNumber(char),
    /// A number of more than nine digits before the point.
    TooLarge(char),
    /// A comment that does not end.
    Unclosed,
    /// A bracket inside a comment.
    Nested,
    /// A slash that is not the first character.
    Slash,
    /// A percent sign that is not alone.
    Percent,
    /// A line number that is not first.
    LineNumber,
    /// A checksum that is no number from 0 to 255, or with words behind it.
    ChecksumForm,
    /// A checksum that is wrong.
    Checksum {
        /// What stands there.
        written: u8,
        /// What the line gives.
        found: u8,
    },
    /// An axis that the stage has not.
    NoAxis(char),
    /// A letter that means nothing here.
    NoSuchLetter(char),
    /// A G or M word that is not in the table.
    NoSuchWord(char, Number),
    /// A plane with Z in it.
    Plane(Name),
    /// A letter that was there already.
    Twice(char),
    /// Two words of one group.
    SameGroup {
        /// The one before.
        first: Name,
        /// This one.
        second: Name,
        /// What both choose.
        group: Group,
    },
    /// A number that is not one of a few.
    Choice {
        /// Its letter.
        letter: char,
        /// The number.
        found: Number,
        /// Those that may be.
        allowed: &'static str,
    },
    /// A word without a number that it needs.
    Missing {
        /// The word.
        word: Name,
        /// What it needs.
        needs: &'static str,
    },
    /// A number that has to be more than zero.
    NotPositive {
        /// Its letter.
        letter: char,
        /// The number.
        found: Number,
    },
    /// Motion at a feed, and none was set.
    NoFeed,
    /// Motion in inverse time without a feed of its own.
    NoInverseFeed,
    /// A number that two words of the block want.
    Shared(char),
    /// A number that no word of the block wants.
    Unused(char),
    /// Two words that want X and Y.
    TwoMotions {
        /// The motion.
        motion: Name,
        /// The other one.
        other: Name,
    },
    /// X or Y while no motion is chosen.
    NoMotion,
    /// A curve in the machine's own coordinates.
    MachineCurve(Name),
    /// A length, or a place that it leads to, beyond [`REACH`](super::REACH).
    OutOfReach(char),
    /// A feed of more than 10⁹ mm in a minute.
    TooFast(Number),
    /// An arc without a centre.
    NoCentre(Name),
    /// An arc with a centre and a radius.
    TwoCentres,
    /// An arc whose centre is its beginning, or whose radius is zero.
    NoRadius,
    /// An arc of a radius that ends where it begins.
    TurnByRadius,
    /// An arc whose ends are farther apart than its diameter.
    RadiusTooSmall {
        /// The radius.
        radius: Pos,
        /// Between the ends.
        apart: Pos,
    },
    /// An arc whose ends are not equally far from its centre.
    Mismatch {
        /// Radius at the beginning.
        begins: Pos,
        /// Radius at the end.
        ends: Pos,
        /// What may be between them.
        limit: Pos,
    },
    /// An arc that ends just before its beginning.
    NearlyFull {
        /// What is missing.
        gap: Pos,
    },
    /// A sine that leads nowhere.
    NoWay,
    /// A sine whose way is no whole number of periods.
    PartOfPeriod {
        /// Its way.
        way: Pos,
        /// The period.
        period: Pos,
        /// The nearest whole number of periods.
        periods: u64,
    },
    /// A sine of more than a million periods.
    ManyPeriods(u64),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}: {}", self.column, self.fault)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Choice { letter, found, allowed } => {
                write!(f, "{letter}{found} is not {allowed}; correct the number")
            }
            Self::Missing { word, needs } => {
                write!(f, "{word} needs {needs} in its block; add what is missing")
            }
            Self::NotPositive { letter, found } => {
                write!(f, "{letter}{found} is not more than zero; give a larger number")
            }
            Self::NoFeed => f.write_str("no feed was set for this motion; add F, a length in a minute"),
            Self::NoInverseFeed => f.write_str(
                "in G93 each motion needs a feed of its own; add F, one over its minutes, or write G94",
            ),
            Self::Shared(letter) => {
                write!(f, "two words of this block want {letter}; write them on two lines")
            }
            Self::Unused(letter) => {
                write!(
                    f,
                    "no word of this block wants {letter}; leave it out, or write it on a line of its own"
                )
            }
            Self::TwoMotions { motion, other } => {
                write!(f, "{motion} and {other} both want X and Y; write them on two lines")
            }
            Self::NoMotion => {
                f.write_str("G80 has switched motion off; write G0, G1, G2 or G3 before X and Y")
            }
            Self::MachineCurve(motion) => {
                write!(f, "G53 goes with G0 and G1 only, and {motion} is in force; write one of them")
            }
            Self::OutOfReach(letter) => {
                write!(f, "{letter} leads more than 100 m away; correct the number or the unit")
            }
            Self::TooFast(feed) => write!(f, "F{feed} is more than a million metres in a minute; correct it"),
            _ => self.of_curve(f),
        }
    }
}

impl Fault {
    fn of_curve(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoCentre(word) => write!(f, "{word} has no centre; add I and J, or R"),
            Self::TwoCentres => f.write_str("the arc has a centre and a radius; keep I and J, or R"),
            Self::NoRadius => f.write_str("the radius of the arc is zero; correct I and J, or R"),
            Self::TurnByRadius => f.write_str(
                "the arc ends where it begins, and R does not tell where the centre of a full circle is; use I and J",
            ),
            Self::RadiusTooSmall { radius, apart } => write!(
                f,
                "the ends are {} mm apart, more than twice the radius of {} mm; correct R, X or Y",
                InMm(apart),
                InMm(radius)
            ),
            Self::Mismatch { begins, ends, limit } => write!(
                f,
                "the arc begins {} mm from its centre and ends {} mm from it, {} mm differ and {} mm may; correct I, J, X or Y",
                InMm(begins),
                InMm(ends),
                InMm((begins - ends).abs()),
                InMm(limit)
            ),
            Self::NearlyFull { gap } => write!(
                f,
                "the arc ends {} mm from its beginning, which may mean a full circle or none; \
                 leave X and Y out for a full circle, or use G1",
                InMm(gap)
            ),
            Self::NoWay => f.write_str("the sine ends where it begins; correct X or Y"),
            Self::PartOfPeriod { way, period, periods } => write!(
                f,
                "the way of {} mm is no whole number of periods of {} mm, the nearest is {periods}; correct L, X or Y",
                InMm(way),
                InMm(period)
            ),
            Self::ManyPeriods(periods) => {
                write!(f, "the sine has {periods} periods, a million may be; divide it, or correct L")
            }
            _ => self.of_text(f),
        }
    }

    fn of_text(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooLong(bytes) => {
                write!(f, "the line has {bytes} characters, {} are read; divide it", super::LONGEST)
            }
            Self::NotText(byte) => {
                write!(f, "the byte {byte} is no character of a program; only comments may hold it")
            }
            Self::Stray(found) => write!(f, "{found} begins no word; remove it"),
            Self::Computed(found) => {
                write!(f, "{found} stands for something to be computed, which is not done here; write the number")
            }
            Self::NoLetter => f.write_str("a number without a letter; write a letter before it"),
            Self::NoNumber(letter) => write!(f, "{letter} has no number behind it; write one, like {letter}1.5"),
            Self::TooLarge(letter) => {
                write!(f, "the number of {letter} has more than nine digits before its point; correct it")
            }
            Self::Unclosed => f.write_str("the comment does not end; write a closing bracket"),
            Self::Nested => f.write_str("a bracket opens inside a comment; remove it"),
            Self::Slash => f.write_str("a slash is not the first character of its line; put it there or remove it"),
            Self::Percent => f.write_str("a percent sign is not alone in its line; give it a line of its own"),
            Self::LineNumber => f.write_str(
                "a line number is a whole number before all words; put it there, or leave it out",
            ),
            Self::ChecksumForm => f.write_str(
                "a checksum is a number from 0 to 255 behind all words; correct it, or leave it out with its *",
            ),
            Self::Checksum { written, found } => {
                write!(f, "the checksum is {written} and the line gives {found}; send the line again")
            }
            _ => self.of_words(f),
        }
    }

    fn of_words(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoAxis(axis) => {
                write!(
                    f,
                    "the stage has no {axis}, only X and Y, so there is no helix either; leave {axis} out"
                )
            }
            Self::NoSuchLetter('E') => {
                f.write_str("E is no word, and numbers have no exponent; write 1000 for 1E3")
            }
            Self::NoSuchLetter(letter) => write!(f, "{letter} means nothing to a stage; leave it out"),
            Self::NoSuchWord(letter, number) => {
                write!(f, "{letter}{number} is not in the table of words; leave it out or write another one")
            }
            Self::Plane(name) => {
                write!(f, "{name} chooses a plane with Z in it, and the stage has X and Y only; leave it out")
            }
            Self::Twice(letter) => write!(f, "{letter} stands twice in the block; keep one"),
            Self::SameGroup { first, second, group } if first == second => {
                write!(f, "{first} stands twice in the block and chooses {}; keep one", group.name())
            }
            Self::SameGroup { first, second, group } => {
                write!(f, "{first} and {second} both choose {}; keep one", group.name())
            }
            // All others are written before.
            _ => Ok(()),
        }
    }
}

impl core::error::Error for Error {}
