//! A line as words: letters with numbers, comments left out, checksum proven.

use super::LONGEST;
use super::fault::{Error, Fault};
use super::number::{Number, Unreadable};
use super::words::{GROUPS, Group, LETTERS, Letter, Name, Row, Word, find};

/// A number with its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Given {
    pub(super) number: Number,
    pub(super) column: u16,
}

/// A G or M word with its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coded {
    pub(super) row: &'static Row,
    pub(super) column: u16,
}

/// A line that was read. It holds no word that is unknown, none twice, and no two of one group.
#[derive(Clone, Copy, Debug, Default)]
pub struct Block {
    line_number: Option<u32>,
    deleted: bool,
    percent: bool,
    numbers: [Option<Given>; LETTERS],
    codes: [Option<Coded>; GROUPS],
}

impl Block {
    /// The number behind N.
    pub fn line_number(&self) -> Option<u32> {
        self.line_number
    }

    /// True if the line begins with a slash.
    pub fn is_deleted(&self) -> bool {
        self.deleted
    }

    /// True for a line of a percent sign, which customarily stands before and behind a program.
    pub fn is_percent(&self) -> bool {
        self.percent
    }

    /// True if there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.numbers.iter().all(Option::is_none) && self.codes.iter().all(Option::is_none)
    }

    /// True if it ends the program, M2 or M30.
    pub fn is_end(&self) -> bool {
        self.code(Group::Stop).is_some_and(|code| code.row.word == Word::End)
    }

    /// Where the number of a letter stands, bytes of the line from 1.
    pub fn column_of(&self, letter: Letter) -> Option<u16> {
        self.number(letter).map(|given| given.column)
    }

    pub(super) fn number(&self, letter: Letter) -> Option<Given> {
        self.numbers.get(letter as usize).copied().flatten()
    }

    pub(super) fn code(&self, group: Group) -> Option<Coded> {
        self.codes.get(group as usize).copied().flatten()
    }

    fn has_words(&self) -> bool {
        !self.is_empty() || self.line_number.is_some()
    }

    fn add(&mut self, letter: char, given: Given) -> Result<(), Fault> {
        match letter {
            'N' => self.add_line_number(given.number),
            'G' | 'M' => self.add_code(letter, given),
            _ => self.add_number(letter, given),
        }
    }

    fn add_line_number(&mut self, number: Number) -> Result<(), Fault> {
        if self.has_words() {
            return Err(Fault::LineNumber);
        }
        self.line_number = Some(number.whole().ok_or(Fault::LineNumber)?);
        Ok(())
    }

    fn add_code(&mut self, letter: char, given: Given) -> Result<(), Fault> {
        let unknown = Fault::NoSuchWord(letter, given.number);
        let tenths = given.number.tenths().ok_or(unknown)?;
        if letter == 'G' && matches!(tenths, 180 | 190) {
            return Err(Fault::Plane(Name { letter, tenths: tenths as u16 }));
        }
        let row = find(letter, tenths).ok_or(unknown)?;
        let Some(place) = self.codes.get_mut(row.group as usize) else { return Err(unknown) };
        if let Some(before) = place {
            let (first, second) = (before.row.name, row.name);
            return Err(Fault::SameGroup { first, second, group: row.group });
        }
        *place = Some(Coded { row, column: given.column });
        Ok(())
    }

    fn add_number(&mut self, letter: char, given: Given) -> Result<(), Fault> {
        if matches!(letter, 'A' | 'B' | 'C' | 'K' | 'U' | 'V' | 'W' | 'Z') {
            return Err(Fault::NoAxis(letter));
        }
        let known = Letter::of(letter).ok_or(Fault::NoSuchLetter(letter))?;
        let Some(place) = self.numbers.get_mut(known as usize) else {
            return Err(Fault::NoSuchLetter(letter));
        };
        if place.is_some() {
            return Err(Fault::Twice(letter));
        }
        *place = Some(given);
        Ok(())
    }
}

/// Reads a line, with or without its end.
///
/// # Errors
/// Says what is wrong with it and in which column.
pub fn parse(line: &[u8]) -> Result<Block, Error> {
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    let line = line.strip_suffix(b"\r").unwrap_or(line);
    if line.len() > LONGEST {
        return Err(Error { column: column(LONGEST), fault: Fault::TooLong(line.len()) });
    }
    let mut scanner = Scanner { line, at: 0, block: Block::default() };
    while let Some(byte) = scanner.next_character() {
        let column = scanner.column();
        scanner.piece(byte).map_err(|fault| Error { column: scanner.fault_column(fault, column), fault })?;
    }
    Ok(scanner.block)
}

/// The column of a byte.
fn column(at: usize) -> u16 {
    u16::try_from(at.saturating_add(1)).unwrap_or(u16::MAX)
}

/// Walks through a line.
struct Scanner<'a> {
    line: &'a [u8],
    at: usize,
    block: Block,
}

impl<'a> Scanner<'a> {
    fn peek(&self) -> Option<u8> {
        self.line.get(self.at).copied()
    }

    fn advance(&mut self, bytes: usize) {
        self.at = self.at.saturating_add(bytes);
    }

    fn rest(&self) -> &'a [u8] {
        self.line.get(self.at..).unwrap_or_default()
    }

    fn column(&self) -> u16 {
        column(self.at)
    }

    /// A bracket inside a comment is shown itself; all else is shown where its piece begins.
    fn fault_column(&self, fault: Fault, begins: u16) -> u16 {
        if fault == Fault::Nested { self.column() } else { begins }
    }

    /// Leaves blanks behind.
    fn next_character(&mut self) -> Option<u8> {
        while matches!(self.peek(), Some(b' ' | b'\t')) {
            self.advance(1);
        }
        self.peek()
    }

    /// Takes what begins with `byte`.
    fn piece(&mut self, byte: u8) -> Result<(), Fault> {
        match byte {
            b'(' => self.comment(),
            b';' => {
                self.at = self.line.len();
                Ok(())
            }
            b'/' => self.slash(),
            b'%' => self.percent(),
            b'*' => self.checksum(),
            b'a'..=b'z' | b'A'..=b'Z' => self.word(char::from(byte.to_ascii_uppercase())),
            b'0'..=b'9' | b'.' | b'+' | b'-' => Err(Fault::NoLetter),
            b'#' | b'[' | b'<' | b'=' => Err(Fault::Computed(char::from(byte))),
            b'!'..=b'~' => Err(Fault::Stray(char::from(byte))),
            _ => Err(Fault::NotText(byte)),
        }
    }

    /// `( … )`, in which any byte may stand but another bracket.
    fn comment(&mut self) -> Result<(), Fault> {
        self.advance(1);
        let end = self.rest().iter().position(|byte| matches!(byte, b'(' | b')'));
        let length = end.ok_or(Fault::Unclosed)?;
        self.advance(length);
        if self.peek() == Some(b'(') {
            return Err(Fault::Nested);
        }
        self.advance(1);
        Ok(())
    }

    fn slash(&mut self) -> Result<(), Fault> {
        if self.block.has_words() || self.block.deleted || self.block.percent {
            return Err(Fault::Slash);
        }
        self.block.deleted = true;
        self.advance(1);
        Ok(())
    }

    fn percent(&mut self) -> Result<(), Fault> {
        self.advance(1);
        let alone = !self.block.has_words() && !self.block.deleted && self.only_comments_follow();
        self.block.percent = true;
        if alone { Ok(()) } else { Err(Fault::Percent) }
    }

    /// `*NN`: the bytes of the line up to it, all of them combined by exclusive or. Only comments may follow.
    fn checksum(&mut self) -> Result<(), Fault> {
        let before = self.line.get(..self.at).unwrap_or_default();
        let found = before.iter().fold(0, |sum, byte| sum ^ byte);
        self.advance(1);
        let digits = self.rest().iter().take_while(|byte| byte.is_ascii_digit()).count();
        let text = self.rest().get(..digits).unwrap_or_default();
        let number = core::str::from_utf8(text).ok().and_then(|text| text.parse::<u8>().ok());
        let written = number.ok_or(Fault::ChecksumForm)?;
        self.advance(digits);
        if !self.only_comments_follow() {
            return Err(Fault::ChecksumForm);
        }
        if written == found { Ok(()) } else { Err(Fault::Checksum { written, found }) }
    }

    fn only_comments_follow(&mut self) -> bool {
        matches!(self.next_character(), None | Some(b'(' | b';'))
    }

    /// A letter and its number, perhaps with blanks between them.
    fn word(&mut self, letter: char) -> Result<(), Fault> {
        let column = self.column();
        self.advance(1);
        self.next_character();
        let (number, length) =
            Number::read(self.rest()).map_err(|unreadable| self.no_number(letter, unreadable))?;
        self.advance(length);
        self.block.add(letter, Given { number, column })
    }

    fn no_number(&self, letter: char, unreadable: Unreadable) -> Fault {
        match (unreadable, self.peek()) {
            // O words and expressions have something else behind the letter.
            (_, Some(sign @ (b'#' | b'[' | b'<'))) => Fault::Computed(char::from(sign)),
            (Unreadable::NoDigit, _) if letter == 'O' => Fault::NoSuchLetter(letter),
            (Unreadable::NoDigit, _) => Fault::NoNumber(letter),
            (Unreadable::TooLarge, _) => Fault::TooLarge(letter),
        }
    }
}
