//! `abbe run FILE.nc`.

use super::ran_report::RanReport;
use super::run_report::Report;
use super::{Answer, HERE, Wanted};
use super::{stepwise, stepwise_report::StepwiseReport};
use crate::cli::Run;
use crate::failure::Failure;
use crate::folder::{self, Ready};
use crate::interrupt;
use crate::preset::Preset;
use crate::program::ahead::Ahead;
use crate::program::check::{Checked, check};
use crate::program::lines::{Lines, LinesError};
use crate::program::runner::{Ran, Runner, start_mm};
use crate::program::stepwise::stage::Division;
use crate::program::watch::Watch;
use crate::progress;
use crate::rig::Rig;
use abbe_core::Command;
use indicatif::ProgressBar;
use std::fs::File;
use std::io::{self, BufReader, Seek as _};
use std::path::Path;
use std::time::Duration;

/// Bytes that are read at once.
pub(super) const BUFFER: usize = 1 << 16;

/// An input that sends nothing for so long pauses: the stage comes to rest. Until then its time stands still, so that
/// what a busy machine sends a little late is gone through as if it had been there.
const PATIENCE: Duration = Duration::from_millis(200);

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Run) -> Result<Answer, Failure> {
    let (name, input) = open(asked)?;
    let percent = asked.feed_rate.unwrap_or(100);
    if asked.check {
        let checked = look_at(preset, percent, &name, &input)?;
        return Report { name: &name, preset, checked: &checked }.answer();
    }
    let grid = stepwise::grid(preset, asked);
    if let Some(grid) = grid.filter(|_| !asked.source.twin) {
        return stepwise::on_paper(preset, asked, grid, &name, &input);
    }
    let wanted = Wanted::new(preset, seed, &asked.source)?;
    let _folders = outputs(asked)?;
    if !asked.stream {
        let checked = look_at(preset, percent, &name, &input)?;
        Report { name: &name, preset, checked: &checked }.errors_only()?;
    }
    let survey = grid.map(|grid| stepwise::survey(preset, percent, grid, &name, &input)).transpose()?;
    let mut rig = wanted.homed(Path::new(HERE))?;
    rig.move_to(start_mm(preset))?;
    rig.ask(Command::FeedRate(percent))?;
    let mut watch = Watch::new(rig.tick_hz(), asked.trace.as_deref(), asked.plot.is_some())?;
    let division = grid.map(|grid| Division::new(preset, percent, grid));
    let ran = go_through(preset, &name, input, &mut rig, &mut watch, division);
    // A run that ended badly is the one that somebody wants to look into, but not one that was called off.
    interrupt::check()?;
    let is_whole = ran.as_ref().is_ok_and(|ran| ran.checked.count == 0);
    if is_whole || watch.has_begun() {
        write(asked, &name, preset, &mut watch)?;
    }
    let survey = survey.as_ref().map(|survey| StepwiseReport { survey });
    RanReport { name: &name, preset, ran: &ran?, watch: &watch, rig: &rig, survey }.answer()
}

/// Where a program comes from.
pub(super) enum Input {
    Stdin,
    File(File),
}

/// The program and its name.
fn open(asked: &Run) -> Result<(String, Input), Failure> {
    let is_read_once = asked.check || asked.stream;
    if asked.file.as_os_str() == "-" {
        if is_read_once {
            return Ok(("stdin".to_owned(), Input::Stdin));
        }
        return Err(read_once("stdin"));
    }
    let name = asked.file.display().to_string();
    let unreadable = |error: io::Error| LinesError::Unreadable(error).of(&name);
    let about = asked.file.metadata().map_err(unreadable)?;
    if !is_read_once && !about.is_file() && !about.is_dir() {
        return Err(read_once(&name));
    }
    let file = File::open(&asked.file).map_err(unreadable)?;
    Ok((name, Input::File(file)))
}

fn read_once(name: &str) -> Failure {
    Failure::usage(format!(
        "{name}: a program that comes only once cannot be checked before it is run; add --stream to have each line \
         checked just before it is done, or --check to have it checked alone"
    ))
}

/// What goes on in a bar.
pub(super) fn bar(what: &str, input: &Input) -> io::Result<ProgressBar> {
    Ok(match input {
        Input::Stdin => progress::stream(what),
        Input::File(file) => progress::bytes(what, file.metadata()?.len()),
    })
}

/// Goes through the whole program before anything moves.
pub(super) fn look_at(preset: &Preset, percent: u16, name: &str, input: &Input) -> Result<Checked, Failure> {
    let looked = || -> Result<Checked, LinesError> {
        let bar = bar("checking the program", input)?;
        let advanced = |bytes| bar.inc(bytes);
        let checked = match input {
            Input::Stdin => check(Lines::new(io::stdin().lock(), &advanced), preset, percent),
            Input::File(file) => {
                let input = BufReader::with_capacity(BUFFER, file);
                check(Lines::new(input, &advanced), preset, percent)
            }
        };
        bar.finish_and_clear();
        checked
    };
    looked().map_err(|error| error.of(name))
}

/// Runs the program on a stage that stands where it begins.
fn go_through(
    preset: &Preset,
    name: &str,
    input: Input,
    rig: &mut Rig,
    watch: &mut Watch,
    division: Option<Division>,
) -> Result<Ran, Failure> {
    let unreadable = |error: io::Error| LinesError::Unreadable(error).of(name);
    let bar = bar("running the program", &input).map_err(unreadable)?;
    let told = bar.clone();
    let advanced = move |bytes| told.inc(bytes);
    let asks_user = matches!(input, Input::File(_));
    let ahead = match input {
        Input::Stdin => Ahead::new(io::stdin(), Some(PATIENCE), advanced),
        Input::File(mut file) => {
            let is_regular = file.metadata().map_err(unreadable)?.is_file();
            if is_regular {
                file.rewind().map_err(unreadable)?;
            }
            Ahead::new(file, (!is_regular).then_some(PATIENCE), advanced)
        }
    };
    let ran = Runner::new(name, preset, rig, watch, asks_user).divided(division).run(&ahead);
    bar.finish_and_clear();
    ran
}

/// Places for the files that are asked for.
pub(super) fn outputs(asked: &Run) -> Result<Vec<Ready>, Failure> {
    if let Some(plot) = asked.plot.as_deref().filter(|plot| plot.extension().is_none_or(|end| end != "svg")) {
        return Err(Failure::usage(format!("--plot {}: the file must end in .svg", plot.display())));
    }
    if asked.trace.is_some() && asked.trace == asked.plot {
        return Err(Failure::usage("--trace and --plot are one file; name another for one of them"));
    }
    let files = [("--trace", &asked.trace), ("--plot", &asked.plot)];
    let place = |file: &Path| file.canonicalize().ok();
    for (option, file) in files {
        if file.as_deref().and_then(place).is_some_and(|there| Some(there) == place(&asked.file)) {
            return Err(Failure::usage(format!("{option} is the program itself; name another file")));
        }
    }
    let wanted = files.into_iter().filter_map(|(option, file)| Some((option, file.as_deref()?)));
    wanted.map(|(option, file)| folder::prepare_file(option, file, asked.force)).collect()
}

fn write(asked: &Run, name: &str, preset: &Preset, watch: &mut Watch) -> Result<(), Failure> {
    watch.done()?;
    let drawn = watch.svg(&format!("{name} on {}", preset.name))?;
    match (&asked.plot, drawn) {
        (Some(file), Some(svg)) => folder::write_whole(file, svg.as_bytes()),
        _ => Ok(()),
    }
}
