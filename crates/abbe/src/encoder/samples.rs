//! A CSV file of samples, row by row: never more of it in memory than a line.
//!
//! A header names the columns; `a` (cosine) and `b` (sine) are needed, `t_s` may be there, others are passed over. Rows
//! end with a line: a quote may hold a comma, but no line end.

use crate::failure::Failure;
use crate::interrupt;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longer lines are no samples; they would have to be held whole.
const LONGEST_LINE: u64 = 65_536;
/// Beyond this a number is no signal, and its fourth power leaves a float.
const LARGEST: f64 = 1e30;
/// Lines between two looks at Ctrl-C and the progress bar.
const LINES: u64 = 8192;
/// Columns and characters that a message shows.
const SHOWN_COLUMNS: usize = 8;
const SHOWN_CHARACTERS: usize = 32;

/// Why samples were refused, and where.
#[derive(Debug, thiserror::Error)]
#[error("{file}{}: {fault}", line.map(|line| format!(", line {line}")).unwrap_or_default())]
pub(crate) struct SamplesError {
    /// The file as the caller named it.
    pub(crate) file: String,
    /// Line of the file, from 1, where one line is to blame.
    pub(crate) line: Option<u64>,
    /// What is wrong.
    pub(crate) fault: Fault,
}

/// What is wrong with a file of samples.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Fault {
    #[error("the samples cannot be read: {0}")]
    Unreadable(std::io::Error),
    #[error("this is no file that can be read more than once")]
    NoFile,
    #[error("the line is longer than {LONGEST_LINE} bytes")]
    LongLine,
    #[error("the line is not UTF-8 text")]
    NotUtf8,
    #[error("the line is not comma-separated text: {0}")]
    NotCsv(csv::Error),
    #[error("the file is empty; expected a header with the columns a and b, and t_s where there are times")]
    Empty,
    #[error("the header has no column `{missing}`; there {found}")]
    NoColumn { missing: &'static str, found: String },
    #[error("the header has the column `{0}` twice")]
    TwiceColumn(&'static str),
    #[error("the cell of column `{0}` is missing")]
    MissingCell(String),
    #[error("{found} cells under a header of {expected} columns")]
    ExtraCells { found: usize, expected: usize },
    #[error("`{value}` in column `{column}` is not a number")]
    NotANumber { column: &'static str, value: String },
    #[error("`{value}` in column `{column}` is not a finite number")]
    NotFinite { column: &'static str, value: String },
    #[error("`{value}` in column `{column}` is beyond ±{LARGEST:e}")]
    TooLarge { column: &'static str, value: String },
    #[error("the time {t_s} s does not come after {before_s} s")]
    NotAscending { t_s: f64, before_s: f64 },
    #[error(
        "{value} in column `{column}` is no code of a {bits}-bit converter: {range}; leave out --bits for other units"
    )]
    NoCode { column: &'static str, value: f64, bits: u32, range: String },
    #[error("there is a header and no sample")]
    NoSamples,
    #[error("{samples} samples are too few for the five constants of an ellipse")]
    TooFew { samples: u64 },
    #[error("the signal of column `{column}` stands still at {value}")]
    Constant { column: &'static str, value: f64 },
    #[error("the file changed while it was read")]
    Changed,
    #[error("{0}")]
    NoFit(String),
}

/// Names of the channels: cosine, sine.
pub(crate) const CHANNELS: [&str; 2] = ["a", "b"];
const TIME: &str = "t_s";

/// A row of the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample<'l> {
    /// Its line, from 1.
    pub(crate) line: u64,
    /// Cosine and sine, in the unit of the file.
    pub(crate) channels: [f64; 2],
    /// Seconds, and how the file writes them.
    pub(crate) time: Option<(f64, &'l str)>,
}

/// A file of samples.
#[derive(Debug)]
pub(crate) struct Samples<'f> {
    path: &'f Path,
    /// Its length, bytes.
    pub(crate) bytes: u64,
}

impl<'f> Samples<'f> {
    /// A file that is there and can be read more than once.
    ///
    /// # Errors
    /// It is not there, or it is a folder or a pipe.
    pub(crate) fn of(path: &'f Path) -> Result<Self, SamplesError> {
        let samples = Self { path, bytes: 0 };
        let about = std::fs::metadata(path).map_err(|error| samples.error(None, Fault::Unreadable(error)))?;
        if !about.is_file() {
            return Err(samples.error(None, Fault::NoFile));
        }
        Ok(Self { path, bytes: about.len() })
    }

    /// A fault with the place it has.
    pub(crate) fn error(&self, line: Option<u64>, fault: Fault) -> SamplesError {
        SamplesError { file: self.path.display().to_string(), line, fault }
    }

    /// Shows every row to `look`, from the first on; `advanced` hears of the bytes read.
    ///
    /// # Errors
    /// What is wrong with the file, what `look` says, or Ctrl-C.
    pub(crate) fn each(
        &self,
        advanced: &dyn Fn(u64),
        mut look: impl FnMut(Sample<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let unreadable = |error| self.error(None, Fault::Unreadable(error));
        let mut file = BufReader::with_capacity(1 << 17, File::open(self.path).map_err(unreadable)?);
        let (mut line, mut number, mut read) = (Vec::new(), 0, 0);
        let mut header = None;
        loop {
            line.clear();
            let length = (&mut file).take(LONGEST_LINE).read_until(b'\n', &mut line).map_err(unreadable)?;
            if length == 0 {
                break;
            }
            number += 1;
            read += length as u64;
            if number % LINES == 0 {
                interrupt::check()?;
                advanced(std::mem::take(&mut read));
            }
            let here = |fault| self.error(Some(number), fault);
            let text = text(&line, number).map_err(here)?;
            if text.is_empty() {
                continue;
            }
            match &header {
                None => header = Some(Header::of(text).map_err(here)?),
                Some(header) => {
                    let record = Record::of(text).map_err(here)?;
                    look(header.sample(&record, number).map_err(here)?)?;
                }
            }
        }
        advanced(read);
        if header.is_none() {
            return Err(self.error(None, Fault::Empty).into());
        }
        Ok(())
    }
}

fn text(line: &[u8], number: u64) -> Result<&str, Fault> {
    if line.len() as u64 >= LONGEST_LINE {
        return Err(Fault::LongLine);
    }
    let text = std::str::from_utf8(line).map_err(|_| Fault::NotUtf8)?;
    // Spreadsheets like to put a byte-order mark in front.
    let text = if number == 1 { text.strip_prefix('\u{feff}').unwrap_or(text) } else { text };
    Ok(text.trim())
}

/// The cells of a line: cut at commas, or read with its quotes.
enum Record<'l> {
    Plain(&'l str),
    Quoted(csv::StringRecord),
}

impl<'l> Record<'l> {
    fn of(text: &'l str) -> Result<Self, Fault> {
        if !text.contains('"') {
            return Ok(Self::Plain(text));
        }
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .terminator(csv::Terminator::Any(b'\n'))
            .from_reader(text.as_bytes());
        let mut record = csv::StringRecord::new();
        reader.read_record(&mut record).map_err(Fault::NotCsv)?;
        Ok(Self::Quoted(record))
    }

    /// Shows each cell with its place; how many there are.
    fn each<'r>(&'r self, mut look: impl FnMut(usize, &'r str)) -> usize {
        let mut cells = 0;
        let mut next = |cell: &'r str| {
            look(cells, cell.trim());
            cells += 1;
        };
        match self {
            Self::Plain(text) => text.split(',').for_each(&mut next),
            Self::Quoted(record) => record.iter().for_each(&mut next),
        }
        cells
    }
}

/// Where the columns are that matter.
struct Header {
    names: Vec<String>,
    channels: [usize; 2],
    time: Option<usize>,
}

impl Header {
    fn of(text: &str) -> Result<Self, Fault> {
        let mut names = Vec::new();
        Record::of(text)?.each(|_, cell| names.push(cell.to_owned()));
        let [a, b] = CHANNELS.map(|name| {
            place(&names, name)?.ok_or_else(|| Fault::NoColumn { missing: name, found: named(&names) })
        });
        Ok(Self { channels: [a?, b?], time: place(&names, TIME)?, names })
    }

    fn sample<'r>(&self, record: &'r Record<'_>, line: u64) -> Result<Sample<'r>, Fault> {
        let [mut a, mut b, mut t] = [""; 3];
        let found = record.each(|place, cell| {
            if place == self.channels[0] {
                a = cell;
            } else if place == self.channels[1] {
                b = cell;
            } else if Some(place) == self.time {
                t = cell;
            }
        });
        let expected = self.names.len();
        if found > expected {
            return Err(Fault::ExtraCells { found, expected });
        }
        if let Some(missing) = self.names.get(found) {
            return Err(Fault::MissingCell(shortened(missing)));
        }
        let time = self.time.map(|_| number(TIME, t).map(|t_s| (t_s, t))).transpose()?;
        Ok(Sample { line, channels: [number(CHANNELS[0], a)?, number(CHANNELS[1], b)?], time })
    }
}

/// Where the only column of this name is.
fn place(names: &[String], name: &'static str) -> Result<Option<usize>, Fault> {
    let mut places = (0..).zip(names).filter(|(_, found)| *found == name).map(|(place, _)| place);
    match (places.next(), places.next()) {
        (_, Some(_)) => Err(Fault::TwiceColumn(name)),
        (first, None) => Ok(first),
    }
}

fn named(names: &[String]) -> String {
    let shown: Vec<String> =
        names.iter().take(SHOWN_COLUMNS).map(|name| format!("`{}`", shortened(name))).collect();
    let more = names.len().saturating_sub(SHOWN_COLUMNS);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let verb = if names.len() == 1 { "is only" } else { "are" };
    format!("{verb} {}{more}", shown.join(", "))
}

fn number(column: &'static str, cell: &str) -> Result<f64, Fault> {
    if cell.is_empty() {
        return Err(Fault::MissingCell(column.into()));
    }
    let value: f64 = cell.parse().map_err(|_| Fault::NotANumber { column, value: shortened(cell) })?;
    if !value.is_finite() {
        return Err(Fault::NotFinite { column, value: shortened(cell) });
    }
    if value.abs() > LARGEST {
        return Err(Fault::TooLarge { column, value: shortened(cell) });
    }
    Ok(value)
}

/// As much of a cell as a sentence holds, without what would disturb a terminal.
fn shortened(cell: &str) -> String {
    let clean = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    let mut shown: String = cell.chars().take(SHOWN_CHARACTERS).map(clean).collect();
    if cell.chars().nth(SHOWN_CHARACTERS).is_some() {
        shown.push('…');
    }
    shown
}

/// Whether a path names stdin, which cannot be read twice.
pub(crate) fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}
