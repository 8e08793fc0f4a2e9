//! One file a command.

mod compensate;
mod demo;
mod demo_report;
mod encoder;
mod encoder_report;
mod home;
mod iso230;
mod measure;
mod movement;
mod ran_report;
mod record;
mod replay;
mod run;
mod run_report;
mod scan;
mod signals;
mod stepwise;
mod stepwise_report;
mod stitch;
mod sweep;
mod sweep_report;
mod verify;

#[cfg(test)]
pub(crate) use encoder::answer as encoder_answer;

use crate::cli::{Cli, Command, Source};
use crate::failure::Failure;
use crate::flight::Keep;
use crate::output;
use crate::preset::{self, Preset};
use crate::progress;
use crate::rig::Rig;
use abbe_metrology::compensation::Compensation;
use serde_json::Value;
use std::path::Path;

/// What a command found: words for people, a document for programs.
pub(crate) struct Answer {
    pub(crate) text: String,
    pub(crate) json: Value,
}

impl Answer {
    pub(crate) fn print(&self, json: bool) -> Result<(), Failure> {
        let printed =
            if json { output::print(&format!("{:#}", self.json)) } else { output::print(&self.text) };
        printed.map_err(|error| Failure::work(format!("the answer cannot be printed: {error}")))
    }
}

/// Runs the command that was asked for.
pub(crate) fn run(cli: &Cli) -> Result<Answer, Failure> {
    // Read even where no stage is needed: a wrong --preset is never passed over.
    let preset = preset::load(cli.preset.as_deref().unwrap_or(preset::USUAL))?;
    match &cli.command {
        Command::Demo(asked) => demo::run(&preset, cli.seed, asked),
        Command::Home(asked) => home::run(&preset, cli.seed, asked),
        Command::Move(asked) => movement::run(&preset, cli.seed, asked),
        Command::Measure(asked) => measure::run(&preset, cli.seed, asked),
        Command::Compensate(asked) => compensate::run(&preset, asked),
        Command::Verify(asked) => verify::run(&preset, cli.seed, asked),
        Command::Iso230(asked) => iso230::run(asked),
        Command::Encoder(asked) => encoder::run(asked),
        Command::Run(asked) => run::run(&preset, cli.seed, asked),
        Command::Scan(asked) => scan::run(&preset, cli.seed, asked),
        Command::Sweep(asked) => sweep::run(&preset, cli.seed, asked),
        Command::Stitch(asked) => stitch::run(asked),
        Command::Record(asked) => record::run(&preset, cli.seed, asked),
        // A recording brings its stage with it; only one that was named is compared.
        Command::Replay(asked) => replay::run(cli.preset.is_some().then_some(&preset), asked),
    }
}

/// Where flight recordings of commands without a folder of their own go.
const HERE: &str = ".";

/// A stage that somebody asked for, before it is powered on.
struct Wanted<'a> {
    preset: &'a Preset,
    seed: u64,
    compensation: Option<Compensation>,
}

impl<'a> Wanted<'a> {
    /// Looks at all that `source` says, so that what is wrong with it is told before anything moves or is written.
    fn new(preset: &'a Preset, seed: u64, source: &Source) -> Result<Self, Failure> {
        if !source.twin {
            return Err(Failure::work(
                "there is no stage: no daemon is running (`abbe serve`) and --twin was not given; \
                 add --twin for a simulated stage",
            ));
        }
        let compensation =
            source.compensation.as_deref().map(|file| compensation(file, preset)).transpose()?;
        Ok(Self { preset, seed, compensation })
    }

    /// A twin of its own: powered on, homed, compensated. What leads to a fault is written into `flights`.
    fn homed(&self, flights: &Path) -> Result<Rig, Failure> {
        let mut rig = Rig::new(self.preset, self.seed, Keep::LastMinutes);
        rig.dump_into(flights);
        self.home(&mut rig)?;
        Ok(rig)
    }

    fn home(&self, rig: &mut Rig) -> Result<(), Failure> {
        progress::note("homing …");
        rig.home()?;
        if let Some(compensation) = &self.compensation {
            rig.compensate(compensation)?;
        }
        Ok(())
    }
}

/// Reads a compensation; that of another stage is refused, it would make things worse without a word.
fn compensation(file: &Path, preset: &Preset) -> Result<Compensation, Failure> {
    let compensation = Compensation::read(file)?;
    if compensation.preset != preset.name {
        return Err(Failure::work(format!(
            "{}: measured on the preset `{}`, but this stage is `{}`; measure this one or name the other with --preset",
            file.display(),
            compensation.preset,
            preset.name
        )));
    }
    Ok(compensation)
}

/// Today, as a certificate states it (UTC).
fn today() -> String {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let (year, month, day) = civil((since.as_secs() / 86_400) as i64);
    format!("{year:04}-{month:02}-{day:02}")
}

/// Year, month and day of a day counted from 1970-01-01, in the proleptic Gregorian calendar.
fn civil(days: i64) -> (i64, i64, i64) {
    // Years that begin in March put the leap day last; eras of 400 years repeat exactly.
    let shifted = days + 719_468;
    let (era, in_era) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let year = (in_era - in_era / 1460 + in_era / 36_524 - in_era / 146_096) / 365;
    let in_year = in_era - (365 * year + year / 4 - year / 100);
    let march_month = (5 * in_year + 2) / 153;
    let day = in_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    (year + 400 * era + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::civil;

    #[test]
    fn days_have_their_dates() {
        for (days, date) in
            [(0, (1970, 1, 1)), (11_016, (2000, 2, 29)), (11_017, (2000, 3, 1)), (20_780, (2026, 11, 23))]
        {
            assert_eq!(civil(days), date);
        }
    }
}
