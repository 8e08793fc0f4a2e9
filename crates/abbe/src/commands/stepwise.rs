//! `abbe run FILE.nc --stepwise`: on paper, and what a stage needs of it.

use super::Answer;
use super::run::{BUFFER, Input, bar, look_at, outputs};
use super::run_report::Report;
use super::stepwise_report::StepwiseReport;
use crate::cli::{Run, StepSize};
use crate::failure::Failure;
use crate::folder;
use crate::preset::Preset;
use crate::program::lines::{Lines, LinesError};
use crate::program::stepwise::Grid;
use crate::program::stepwise::picture::Picture;
use crate::program::stepwise::survey::{Survey, Surveyor};
use crate::program::stepwise::trace::Trace;
use crate::program::travel::Travel;
use abbe_core::Pos;
use std::io::{self, BufReader, Seek as _};

/// The grid that is asked for.
pub(super) fn grid(preset: &Preset, asked: &Run) -> Option<Grid> {
    let step = match asked.stepwise? {
        StepSize::Count => Grid::count_of(preset),
        StepSize::Of(step) => step,
    };
    Some(Grid::new(step, asked.chord_tolerance))
}

/// A whole program without a stage.
pub(super) fn on_paper(
    preset: &Preset,
    asked: &Run,
    grid: Grid,
    name: &str,
    input: &Input,
) -> Result<Answer, Failure> {
    if asked.source.compensation.is_some() {
        return Err(Failure::usage(
            "--compensation is for a stage: on paper nothing is corrected; add --twin, or leave it out",
        ));
    }
    let _folders = outputs(asked)?;
    let percent = asked.feed_rate.unwrap_or(100);
    let checked = look_at(preset, percent, name, input)?;
    Report { name, preset, checked: &checked }.errors_only()?;
    let mut trace = asked.trace.as_deref().map(Trace::new).transpose()?;
    let mut picture = asked.plot.is_some().then(Picture::default);
    let surveyor = Surveyor::new(preset, percent, grid, false).showing(trace.as_mut(), picture.as_mut());
    let survey = go_through(surveyor, preset, name, input)?;
    if let Some(trace) = trace {
        trace.done()?;
    }
    if let Some((file, picture)) = asked.plot.as_ref().zip(picture) {
        let title = format!("{name} in steps of {} µm", grid.step().um());
        folder::write_whole(file, picture.svg(&title, grid.step().mm())?.as_bytes())?;
    }
    StepwiseReport { survey: &survey }.on_paper(name, preset)
}

/// A whole program before a stage goes through it.
pub(super) fn survey(
    preset: &Preset,
    percent: u16,
    grid: Grid,
    name: &str,
    input: &Input,
) -> Result<Survey, Failure> {
    let start = Travel::of(preset).start();
    if grid.place(grid.nearest(start)) != start {
        let [x, y] = start.map(Pos::mm);
        return Err(Failure::work(format!(
            "--stepwise: the stage begins at x = {x:.6} mm, y = {y:.6} mm, which is no point of steps of {} µm; take a step that leads there",
            grid.step().um()
        )));
    }
    go_through(Surveyor::new(preset, percent, grid, true), preset, name, input)
}

/// Errors of the steps are told like those of the program.
fn go_through(surveyor: Surveyor<'_>, preset: &Preset, name: &str, input: &Input) -> Result<Survey, Failure> {
    let unreadable = |error: io::Error| LinesError::Unreadable(error).of(name);
    // What comes only once was refused.
    let Input::File(file) = input else { return Err(Failure::work(format!("{name}: comes only once"))) };
    let mut again: &std::fs::File = file;
    again.rewind().map_err(unreadable)?;
    let bar = bar("counting its steps", input).map_err(unreadable)?;
    let advanced = |bytes| bar.inc(bytes);
    let lines = Lines::new(BufReader::with_capacity(BUFFER, again), &advanced);
    let survey = surveyor.run(Travel::of(preset).start(), lines, name)?;
    bar.finish_and_clear();
    Report { name, preset, checked: &survey.checked }.errors_only()?;
    Ok(survey)
}
