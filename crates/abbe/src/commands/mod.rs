//! One file a command.

mod compensate;
mod demo;
mod demo_report;
mod home;
mod iso230;
mod measure;
mod movement;
mod scan;
mod stitch;
mod verify;

use crate::cli::{Cli, Command, Source};
use crate::failure::Failure;
use crate::preset::{self, Preset};
use crate::progress;
use crate::rig::Rig;
use abbe_metrology::compensation::Compensation;
use serde_json::Value;

/// What a command found: words for people, a document for programs.
pub(crate) struct Answer {
    pub(crate) text: String,
    pub(crate) json: Value,
}

impl Answer {
    pub(crate) fn print(&self, json: bool) {
        if json {
            println!("{:#}", self.json);
        } else {
            println!("{}", self.text.trim_end());
        }
    }
}

/// Runs the command that was asked for.
pub(crate) fn run(cli: &Cli) -> Result<Answer, Failure> {
    match &cli.command {
        Command::Demo(asked) => demo::run(&preset(cli)?, cli.seed, asked),
        Command::Home(asked) => home::run(&preset(cli)?, cli.seed, asked),
        Command::Move(asked) => movement::run(&preset(cli)?, cli.seed, asked),
        Command::Measure(asked) => measure::run(&preset(cli)?, cli.seed, asked),
        Command::Compensate(asked) => compensate::run(&preset(cli)?, asked),
        Command::Verify(asked) => verify::run(&preset(cli)?, cli.seed, asked),
        Command::Iso230(asked) => iso230::run(asked),
        Command::Scan(asked) => scan::run(&preset(cli)?, cli.seed, asked),
        Command::Stitch(asked) => stitch::run(asked),
    }
}

fn preset(cli: &Cli) -> Result<Preset, Failure> {
    preset::load(&cli.preset)
}

/// The compensation that `source` names, read before anything moves.
fn compensation(source: &Source) -> Result<Option<Compensation>, Failure> {
    source.compensation.as_deref().map(|file| Compensation::read(file).map_err(Failure::from)).transpose()
}

/// A twin of its own: powered on, homed, compensated.
fn one_shot(preset: &Preset, seed: u64, source: &Source) -> Result<Rig, Failure> {
    need_stage(source)?;
    let compensation = compensation(source)?;
    let mut rig = Rig::new(preset, seed);
    progress::note("homing …");
    rig.home()?;
    if let Some(compensation) = &compensation {
        rig.compensate(compensation)?;
    }
    Ok(rig)
}

/// There is no stage unless somebody names one.
fn need_stage(source: &Source) -> Result<(), Failure> {
    if source.twin {
        return Ok(());
    }
    Err(Failure::Work(anyhow::anyhow!(
        "no stage: no daemon (`abbe serve`) is running, and --twin was not given for a twin of its own"
    )))
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
