//! `abbe run FILE.nc`.

use super::Answer;
use super::run_report::Report;
use crate::cli::Run;
use crate::failure::Failure;
use crate::preset::Preset;
use crate::program::check::{Checked, check};
use crate::program::lines::{Lines, LinesError};
use crate::progress;
use abbe_core::Pos;
use std::fs::File;
use std::io::{BufRead, BufReader};

/// Bytes that are read at once.
const BUFFER: usize = 1 << 16;

pub(crate) fn run(preset: &Preset, asked: &Run) -> Result<Answer, Failure> {
    if !asked.check {
        return Err(Failure::usage(
            "`abbe run` cannot move a stage in this version yet; add --check to have the program checked",
        ));
    }
    let (name, checked) = if asked.file.as_os_str() == "-" {
        ("stdin".to_owned(), from_stdin(preset))
    } else {
        (asked.file.display().to_string(), from_file(preset, asked))
    };
    let report = Report { name: &name, preset, checked: &checked.map_err(|error| told(&name, error))? };
    report.answer()
}

fn told(name: &str, error: LinesError) -> Failure {
    match error {
        LinesError::Unreadable(_) => Failure::Work(anyhow::Error::new(error).context(name.to_owned())),
        LinesError::Interrupted(interrupted) => interrupted.into(),
    }
}

fn from_stdin(preset: &Preset) -> Result<Checked, LinesError> {
    let bar = progress::stream("checking the program");
    let checked = go_through(preset, std::io::stdin().lock(), &|bytes| bar.inc(bytes));
    bar.finish_and_clear();
    checked
}

fn from_file(preset: &Preset, asked: &Run) -> Result<Checked, LinesError> {
    let file = File::open(&asked.file)?;
    let bar = progress::bytes("checking the program", file.metadata()?.len());
    let input = BufReader::with_capacity(BUFFER, file);
    let checked = go_through(preset, input, &|bytes| bar.inc(bytes));
    bar.finish_and_clear();
    checked
}

fn go_through(preset: &Preset, input: impl BufRead, advanced: &dyn Fn(u64)) -> Result<Checked, LinesError> {
    check(Lines::new(input, advanced), preset, [Pos::ZERO; 2])
}
