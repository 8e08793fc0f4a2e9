//! Readings: where the table really was, for every target, approach and run.
//!
//! The file is the contract's `READINGS.csv`: header `approach,target_mm,run1,run2,…`, one row a target and approach,
//! `approach` is `up` or `down`, cells are actual positions in mm. The rows of one approach stand in ascending or in
//! descending order of their targets (the way back is often noted descending); a [`Readings`] always holds them
//! ascending. Anything else is refused with file, line and value: a readings file is evidence, and is never repaired.

use std::fmt;
use std::fs;
use std::io;
use std::path::Path;

use crate::axis::Approach;
use crate::whole_file;

/// Positions and targets beyond ±1 km are taken for a mistake of unit, and keep every later sum finite.
const FARTHEST_MM: f64 = 1.0e6;

/// A deviation beyond this is noted: the cells may be deviations or another unit.
const LARGE_DEVIATION_MM: f64 = 1.0;

/// Runs and targets that ISO 230-2 asks for (axes up to 2 m).
const STANDARD_RUNS: usize = 5;
const STANDARD_TARGETS: usize = 5;

/// A complete bidirectional set of readings: at least two targets and two runs, all finite, targets ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct Readings {
    /// Targets, mm.
    targets: Vec<f64>,
    /// Positions reached from below, mm: `[target][run]`.
    up: Vec<Vec<f64>>,
    /// Positions reached from above, mm: `[target][run]`.
    down: Vec<Vec<f64>>,
}

/// A set of readings that can be evaluated but is smaller or odder than the standard asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Note {
    /// ISO 230-2 asks for five runs in each direction.
    FewRuns {
        /// Runs found, 2…4.
        runs: usize,
    },
    /// ISO 230-2 asks for five targets or more.
    FewTargets {
        /// Targets found, 2…4.
        targets: usize,
    },
    /// A reading lies so far from its target that the unit is in doubt.
    LargeDeviation {
        /// The target.
        target_mm: f64,
        /// Reading minus target, beyond ±1 mm.
        deviation_mm: f64,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FewRuns { runs } => {
                write!(f, "{runs} runs, ISO 230-2 asks for {STANDARD_RUNS} in each direction")
            }
            Self::FewTargets { targets } => {
                write!(f, "{targets} targets, ISO 230-2 asks for at least {STANDARD_TARGETS}")
            }
            Self::LargeDeviation { target_mm, deviation_mm } => write!(
                f,
                "a reading lies {deviation_mm} mm from its target {target_mm} mm: cells must be actual positions in mm"
            ),
        }
    }
}

/// Why readings were refused, and where.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {fault}", file, line.map(|line| format!(", line {line}")).unwrap_or_default())]
pub struct ReadingsError {
    /// The file as the caller named it.
    pub file: String,
    /// Line of the file, from 1, where one line is to blame.
    pub line: Option<usize>,
    /// What is wrong.
    pub fault: ReadingsFault,
}

/// What is wrong with a set of readings.
#[derive(Debug, thiserror::Error)]
pub enum ReadingsFault {
    /// The file system refused to give the file.
    #[error("cannot be read: {0}")]
    Unreadable(io::Error),
    /// The file system refused to take the file.
    #[error("cannot be written: {0}")]
    Unwritable(io::Error),
    /// Bytes that are not text.
    #[error("the file is not UTF-8 text")]
    NotUtf8,
    /// The CSV itself is malformed.
    #[error("the line is not comma-separated text: {0}")]
    NotCsv(csv::Error),
    /// No header.
    #[error("the file is empty; expected the header approach,target_mm,run1,run2,…")]
    Empty,
    /// A column bears another name than the contract's.
    #[error("column {column} of the header is `{found}`, expected `{expected}`")]
    Header {
        /// Column, from 1.
        column: usize,
        /// Name the contract gives it.
        expected: String,
        /// Name found.
        found: String,
    },
    /// The header ends too early.
    #[error("the header has no column `{expected}`")]
    MissingColumn {
        /// First name that is missing.
        expected: String,
    },
    /// A standard deviation needs n − 1 ≥ 1.
    #[error("only one run; ISO 230-2 needs at least 2 runs and asks for {STANDARD_RUNS}")]
    OneRun,
    /// A row is too short, or a cell is empty.
    #[error("the cell of column `{column}` is missing")]
    MissingCell {
        /// Name of the column.
        column: String,
    },
    /// A row is longer than the header.
    #[error("there is an extra cell `{value}`: {found} cells under a header of {expected} columns")]
    ExtraCell {
        /// First cell too many.
        value: String,
        /// Cells in the row.
        found: usize,
        /// Columns of the header.
        expected: usize,
    },
    /// Neither `up` nor `down`.
    #[error("the approach is `{value}`, expected `up` or `down`")]
    UnknownApproach {
        /// The word found.
        value: String,
    },
    /// A cell that is no number.
    #[error("`{value}` in column `{column}` is not a number")]
    NotANumber {
        /// Name of the column.
        column: String,
        /// The cell.
        value: String,
    },
    /// NaN or infinite.
    #[error("`{value}` in column `{column}` is not a finite number")]
    NotFinite {
        /// Name of the column.
        column: String,
        /// The cell.
        value: String,
    },
    /// Farther than any stage.
    #[error("{value} in column `{column}` is beyond ±{FARTHEST_MM} mm")]
    TooFar {
        /// Name of the column.
        column: String,
        /// The cell, mm.
        value: f64,
    },
    /// One target twice in the same approach.
    #[error("target {target_mm} mm appears a second time with approach {approach}")]
    DuplicateTarget {
        /// The target.
        target_mm: f64,
        /// The approach.
        approach: Approach,
    },
    /// Targets of one approach that go back and forth.
    #[error(
        "target {target_mm} mm with approach {approach} is out of order after {previous_mm} mm; \
         the targets of one approach must ascend or descend"
    )]
    UnsortedTarget {
        /// The target out of order.
        target_mm: f64,
        /// The target before it.
        previous_mm: f64,
        /// The approach.
        approach: Approach,
    },
    /// ISO 230-2 bidirectional figures need both.
    #[error("every row has approach {only}; the evaluation needs both up and down")]
    OneDirection {
        /// The approach that is there.
        only: Approach,
    },
    /// A target that the other approach lacks.
    #[error("target {target_mm} mm was approached {approach} only; up and down need the same targets")]
    OneSided {
        /// The target.
        target_mm: f64,
        /// The approach it has.
        approach: Approach,
    },
    /// Fewer than two.
    #[error("{found} target(s); at least 2 are needed and ISO 230-2 asks for {STANDARD_TARGETS}")]
    TooFewTargets {
        /// Targets found.
        found: usize,
    },
}

impl Readings {
    /// Readings from a program: `up_mm[i][j]` is the position at target `i` in run `j`.
    ///
    /// # Errors
    /// The same faults as in a file: every rule of [`Readings::parse`] holds here too.
    pub fn new(targets_mm: &[f64], up_mm: &[Vec<f64>], down_mm: &[Vec<f64>]) -> Result<Self, ReadingsFault> {
        let runs = up_mm.first().map_or(0, Vec::len);
        let columns = columns(runs);
        check_columns(&columns)?;
        let sides = [(Approach::Up, up_mm), (Approach::Down, down_mm)];
        let mut rows = Vec::new();
        for (approach, side) in sides {
            for (i, cells) in side.iter().enumerate() {
                let target_mm = *targets_mm
                    .get(i)
                    .ok_or_else(|| ReadingsFault::MissingCell { column: columns[1].clone() })?;
                check_cells(&columns, target_mm, cells)?;
                rows.push(Row { line: None, approach, target_mm, cells: cells.clone() });
            }
        }
        // Targets beyond the rows of `up` cannot be seen from the rows alone.
        if let Some(&target_mm) = targets_mm.get(up_mm.len()) {
            let approach = Approach::Down;
            return Err(ReadingsFault::OneSided { target_mm, approach });
        }
        Self::from_rows(rows).map_err(|(_, fault)| fault)
    }

    /// Reads a file of the contract's form.
    ///
    /// # Errors
    /// [`ReadingsError`]: one sentence with file, line and value.
    pub fn read(path: &Path) -> Result<Self, ReadingsError> {
        let file = path.display().to_string();
        match fs::read(path) {
            Ok(bytes) => Self::parse(&file, &bytes),
            Err(e) => Err(ReadingsError { file, line: None, fault: ReadingsFault::Unreadable(e) }),
        }
    }

    /// Parses the bytes of a readings file; `file` is only used to name it in an error.
    ///
    /// Never panics, whatever the bytes.
    ///
    /// # Errors
    /// [`ReadingsError`]: one sentence with file, line and value.
    pub fn parse(file: &str, bytes: &[u8]) -> Result<Self, ReadingsError> {
        parse_rows(bytes).and_then(Self::from_rows).map_err(|(line, fault)| ReadingsError {
            file: file.to_owned(),
            line,
            fault,
        })
    }

    fn from_rows(rows: Vec<Row>) -> Result<Self, Located> {
        let (up, down): (Vec<_>, Vec<_>) = rows.into_iter().partition(|row| row.approach == Approach::Up);
        let up = ascending(up)?;
        let down = ascending(down)?;
        match (up.is_empty(), down.is_empty()) {
            (true, true) => return Err((None, ReadingsFault::TooFewTargets { found: 0 })),
            (false, true) => return Err((None, ReadingsFault::OneDirection { only: Approach::Up })),
            (true, false) => return Err((None, ReadingsFault::OneDirection { only: Approach::Down })),
            (false, false) => {}
        }
        check_same_targets(&up, &down)?;
        if up.len() < 2 {
            return Err((None, ReadingsFault::TooFewTargets { found: up.len() }));
        }
        Ok(Self {
            targets: up.iter().map(|row| row.target_mm).collect(),
            up: up.into_iter().map(|row| row.cells).collect(),
            down: down.into_iter().map(|row| row.cells).collect(),
        })
    }

    /// Targets in mm, ascending; at least two.
    pub fn targets_mm(&self) -> &[f64] {
        &self.targets
    }

    /// Runs in each direction; at least two.
    pub fn runs(&self) -> usize {
        self.up.first().map_or(0, Vec::len)
    }

    /// All readings: targets × runs × two directions.
    pub fn count(&self) -> usize {
        2 * self.targets.len() * self.runs()
    }

    /// Actual positions in mm: `[target][run]`.
    pub fn positions_mm(&self, approach: Approach) -> &[Vec<f64>] {
        match approach {
            Approach::Up => &self.up,
            Approach::Down => &self.down,
        }
    }

    /// Deviations in µm, actual minus target: `[target][run]`.
    pub fn deviations_um(&self, approach: Approach) -> Vec<Vec<f64>> {
        let rows = self.targets.iter().zip(self.positions_mm(approach));
        rows.map(|(target, row)| row.iter().map(|actual| (actual - target) * 1e3).collect()).collect()
    }

    /// What a reader of the figures should know about this set.
    pub fn notes(&self) -> Vec<Note> {
        let mut notes = Vec::new();
        if self.runs() < STANDARD_RUNS {
            notes.push(Note::FewRuns { runs: self.runs() });
        }
        if self.targets.len() < STANDARD_TARGETS {
            notes.push(Note::FewTargets { targets: self.targets.len() });
        }
        notes.extend(self.large_deviation());
        notes
    }

    fn large_deviation(&self) -> Option<Note> {
        let all = Approach::BOTH.iter().flat_map(|&approach| {
            let rows = self.targets.iter().zip(self.positions_mm(approach));
            rows.flat_map(|(&target_mm, row)| row.iter().map(move |actual| (target_mm, actual - target_mm)))
        });
        let (target_mm, deviation_mm) = all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        (deviation_mm.abs() > LARGE_DEVIATION_MM).then_some(Note::LargeDeviation { target_mm, deviation_mm })
    }

    /// The file's text: ten decimals of a millimetre (0.1 pm).
    pub fn to_csv(&self) -> String {
        let mut lines = vec![columns(self.runs()).join(",")];
        for approach in Approach::BOTH {
            for (target, row) in self.targets.iter().zip(self.positions_mm(approach)) {
                let cells: Vec<String> = row.iter().map(|cell| format!("{cell:.10}")).collect();
                lines.push(format!("{approach},{target:.10},{}", cells.join(",")));
            }
        }
        lines.join("\n") + "\n"
    }

    /// Writes the file beside its place and renames it: a reader never sees half a file.
    ///
    /// # Errors
    /// [`ReadingsFault::Unwritable`] with the file's name; an older file is then untouched.
    pub fn write(&self, path: &Path) -> Result<(), ReadingsError> {
        whole_file::put(path, self.to_csv().as_bytes()).map_err(|e| ReadingsError {
            file: path.display().to_string(),
            line: None,
            fault: ReadingsFault::Unwritable(e),
        })
    }
}

/// A fault and the line it is on.
type Located = (Option<usize>, ReadingsFault);

/// One row of the file: a target, approached from one side, in all runs.
struct Row {
    line: Option<usize>,
    approach: Approach,
    target_mm: f64,
    cells: Vec<f64>,
}

/// The header for `runs` runs.
fn columns(runs: usize) -> Vec<String> {
    let fixed = ["approach", "target_mm"].map(String::from);
    fixed.into_iter().chain((1..=runs).map(|run| format!("run{run}"))).collect()
}

fn parse_rows(bytes: &[u8]) -> Result<Vec<Row>, Located> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let before = bytes.iter().take(e.valid_up_to());
        (Some(1 + before.filter(|&&byte| byte == b'\n').count()), ReadingsFault::NotUtf8)
    })?;
    // Spreadsheets like to put a byte-order mark in front.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let (at, first) = lines.next().ok_or((None, ReadingsFault::Empty))?;
    let header = cells_of(first).map_err(|fault| (Some(at + 1), fault))?;
    check_columns(&header).map_err(|fault| (Some(at + 1), fault))?;
    lines.map(|(at, line)| parse_row(&header, at + 1, line).map_err(|fault| (Some(at + 1), fault))).collect()
}

/// The cells of one line, quotes and blanks removed. Line by line, so that an error names the line it is on even
/// when a quote was never closed.
fn cells_of(line: &str) -> Result<Vec<String>, ReadingsFault> {
    // Only `\n` ends a record: a stray `\r` inside a line would otherwise hide the cells after it.
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .trim(csv::Trim::All)
        .terminator(csv::Terminator::Any(b'\n'))
        .from_reader(line.as_bytes());
    let mut record = csv::StringRecord::new();
    reader.read_record(&mut record).map_err(ReadingsFault::NotCsv)?;
    Ok(record.iter().map(String::from).collect())
}

fn check_columns(header: &[String]) -> Result<(), ReadingsFault> {
    let runs = header.len().saturating_sub(2).max(1);
    for (i, expected) in columns(runs).into_iter().enumerate() {
        match header.get(i) {
            None => return Err(ReadingsFault::MissingColumn { expected }),
            Some(found) if *found != expected => {
                return Err(ReadingsFault::Header { column: i + 1, expected, found: found.clone() });
            }
            Some(_) => {}
        }
    }
    if runs < 2 { Err(ReadingsFault::OneRun) } else { Ok(()) }
}

fn parse_row(header: &[String], line: usize, text: &str) -> Result<Row, ReadingsFault> {
    let cells = cells_of(text)?;
    if let Some(value) = cells.get(header.len()) {
        return Err(ReadingsFault::ExtraCell {
            value: value.clone(),
            found: cells.len(),
            expected: header.len(),
        });
    }
    let mut named = header.iter().enumerate().map(|(i, column)| match cells.get(i) {
        Some(cell) if !cell.is_empty() => Ok((column, cell.as_str())),
        _ => Err(ReadingsFault::MissingCell { column: column.clone() }),
    });
    let missing = || ReadingsFault::MissingCell { column: String::from("approach") };
    let (_, word) = named.next().ok_or_else(missing)??;
    let approach =
        Approach::from_word(word).ok_or_else(|| ReadingsFault::UnknownApproach { value: word.to_owned() })?;
    let mut numbers = named.map(|cell| cell.and_then(|(column, cell)| parse_number(column, cell)));
    let target_mm = numbers.next().ok_or_else(missing)??;
    Ok(Row { line: Some(line), approach, target_mm, cells: numbers.collect::<Result<_, _>>()? })
}

fn parse_number(column: &str, cell: &str) -> Result<f64, ReadingsFault> {
    let Ok(value) = cell.parse::<f64>() else {
        return Err(ReadingsFault::NotANumber { column: column.to_owned(), value: cell.to_owned() });
    };
    check_number(column, value)?;
    Ok(value)
}

fn check_number(column: &str, value: f64) -> Result<(), ReadingsFault> {
    let column = column.to_owned();
    if !value.is_finite() {
        return Err(ReadingsFault::NotFinite { column, value: value.to_string() });
    }
    if value.abs() > FARTHEST_MM {
        return Err(ReadingsFault::TooFar { column, value });
    }
    Ok(())
}

fn check_cells(columns: &[String], target_mm: f64, cells: &[f64]) -> Result<(), ReadingsFault> {
    let expected = columns.len();
    if let Some(value) = cells.get(expected - 2) {
        return Err(ReadingsFault::ExtraCell { value: value.to_string(), found: cells.len() + 2, expected });
    }
    if let Some(column) = columns.get(cells.len() + 2) {
        return Err(ReadingsFault::MissingCell { column: column.clone() });
    }
    let values = std::iter::once(&target_mm).chain(cells);
    columns[1..].iter().zip(values).try_for_each(|(column, &value)| check_number(column, value))
}

/// The rows of one approach in ascending order, if they were noted in ascending or descending order.
fn ascending(mut rows: Vec<Row>) -> Result<Vec<Row>, Located> {
    let descending = rows.len() > 1 && rows[1].target_mm < rows[0].target_mm;
    for i in 1..rows.len() {
        let (row, previous_mm) = (&rows[i], rows[i - 1].target_mm);
        let (target_mm, approach) = (row.target_mm, row.approach);
        let in_order = if descending { target_mm < previous_mm } else { target_mm > previous_mm };
        if !in_order {
            let again = rows[..i].iter().any(|earlier| earlier.target_mm == target_mm);
            let duplicate = ReadingsFault::DuplicateTarget { target_mm, approach };
            let unsorted = ReadingsFault::UnsortedTarget { target_mm, previous_mm, approach };
            return Err((row.line, if again { duplicate } else { unsorted }));
        }
    }
    if descending {
        rows.reverse();
    }
    Ok(rows)
}

/// Both sides are ascending.
fn check_same_targets(up: &[Row], down: &[Row]) -> Result<(), Located> {
    let alone = |rows: &[Row], others: &[Row]| {
        let has = |target_mm: f64| {
            let place = others.partition_point(|other| other.target_mm < target_mm);
            others.get(place).is_some_and(|other| other.target_mm == target_mm)
        };
        let row = rows.iter().find(|row| !has(row.target_mm))?;
        Some((row.line, ReadingsFault::OneSided { target_mm: row.target_mm, approach: row.approach }))
    };
    match alone(up, down).or_else(|| alone(down, up)) {
        Some(located) => Err(located),
        None => Ok(()),
    }
}
