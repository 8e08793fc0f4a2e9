//! `abbe encoder SAMPLES.csv`.

use super::Answer;
use super::encoder_report::{Report, document, text};
use crate::cli::Encoder;
use crate::encoder::error::{Inside, Table};
use crate::encoder::follow::{Counts, Follow, Trail, shown};
use crate::encoder::health;
use crate::encoder::method::Learned;
use crate::encoder::plot::Picture;
use crate::encoder::samples::{Fault, Samples, is_stdin};
use crate::encoder::signals::Signals;
use crate::encoder::stretches::{Agreed, BEYOND_SERVO};
use crate::encoder::survey::Survey;
use crate::failure::Failure;
use crate::folder::{self, Growing, Ready};
use crate::progress;
use abbe_core::sense::correct::Residual;
use abbe_core::sense::subdivide::Subdivider;
use std::path::Path;

/// A table is learned only where so much of the file goes at a constant speed.
const STEADY_SHARE: f64 = 0.5;
/// And where it is known so well, periods rms of its curve: 0.4 nm of 0.8 µm.
const KNOWN: f64 = 5e-4;

pub(crate) fn run(asked: &Encoder) -> Result<Answer, Failure> {
    check(asked)?;
    let _folders = outputs(asked)?;
    let samples = Samples::of(&asked.samples)?;
    let passes = if asked.harmonics { 4 } else { 3 };
    let bar = progress::bytes("reading samples", passes * samples.bytes);
    let answer = answer(asked, samples, &|bytes| bar.inc(bytes));
    bar.finish_and_clear();
    answer
}

fn check(asked: &Encoder) -> Result<(), Failure> {
    if is_stdin(&asked.samples) {
        return Err(Failure::usage(
            "`-`: samples are read more than once and cannot come from stdin; name a file",
        ));
    }
    if let Some(plot) =
        asked.plot.as_deref().filter(|plot| plot.extension().is_none_or(|ending| ending != "svg"))
    {
        return Err(Failure::usage(format!("--plot {}: the file must end in .svg", plot.display())));
    }
    let same =
        |a: &Path, b: &Path| a == b || a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
    let wanted = [("--positions", &asked.positions), ("--plot", &asked.plot)];
    for (option, file) in
        wanted.iter().filter_map(|(option, file)| file.as_deref().map(|file| (option, file)))
    {
        if same(file, &asked.samples) {
            return Err(Failure::usage(format!(
                "{option} {}: these are the samples; name another file",
                file.display()
            )));
        }
    }
    match (&asked.positions, &asked.plot) {
        (Some(positions), Some(plot)) if same(positions, plot) => {
            Err(Failure::usage(format!("--positions and --plot both name {}", plot.display())))
        }
        _ => Ok(()),
    }
}

fn outputs(asked: &Encoder) -> Result<Vec<Ready>, Failure> {
    let files = [("--positions", &asked.positions), ("--plot", &asked.plot)];
    let wanted = files.into_iter().filter_map(|(option, file)| file.as_deref().map(|file| (option, file)));
    wanted.map(|(option, file)| folder::prepare_file(option, file, asked.force)).collect()
}

/// Reads, learns, follows, judges and writes; nothing is written before all of the file was read and fitted.
pub(crate) fn answer(
    asked: &Encoder,
    samples: Samples<'_>,
    advanced: &dyn Fn(u64),
) -> Result<Answer, Failure> {
    let survey = Survey::of(&samples, asked.bits, advanced)?;
    let even = survey.is_even();
    let signals = Signals::new(samples, survey, asked.limit_samples);
    let learned = Learned::of(&signals, asked.method, advanced)?;
    let mut positions = asked.positions.as_deref().map(|file| Positions::new(file, asked)).transpose()?;
    let floor = floor(asked, &signals)?;
    let (trail, agreed) = if asked.harmonics {
        let taught = follow(&signals, &learned, None, floor, None, advanced)?;
        let agreed = steady(&signals, &taught, asked.period_um)?;
        let table = agreed.harmonics.residual();
        let mut trail = follow(&signals, &learned, Some(&table), floor, positions.as_mut(), advanced)?;
        // What the stretches show is that of the pass before the table; all else is that of the pass with it.
        trail.stretches = taught.stretches;
        (trail, Some(agreed))
    } else {
        (follow(&signals, &learned, None, floor, positions.as_mut(), advanced)?, None)
    };
    let table = if agreed.is_some() { Table::Learned } else { Table::None };
    let inside = Inside::of(&learned, signals.scale.zero, &trail, even, table);
    let findings = health::findings(&signals, &learned, &trail);
    let report =
        Report { asked, signals: &signals, learned: &learned, trail: &trail, agreed, inside, findings };
    // Drawn before either file takes its place, so that neither is there without the other.
    let drawn =
        asked.plot.as_deref().map(|file| picture(&report).svg().map(|svg| (file, svg))).transpose()?;
    if let Some(positions) = positions {
        positions.growing.done()?;
    }
    if let Some((file, svg)) = drawn {
        folder::write_whole(file, svg.as_bytes())?;
    }
    Ok(Answer { text: text(&report), json: document(&report) })
}

/// One pass over the samples, with positions written where they are wanted.
fn follow(
    signals: &Signals<'_>,
    learned: &Learned,
    table: Option<&Residual>,
    floor: f64,
    mut positions: Option<&mut Positions>,
    advanced: &dyn Fn(u64),
) -> Result<Trail, Failure> {
    let mut follow = Follow::new(learned, table, floor);
    signals.each(advanced, |seen| {
        let position = follow.sample(&seen);
        match &mut positions {
            Some(positions) => {
                let turns = shown(position, positions.counts.as_mut());
                positions.write(seen.time, turns)
            }
            None => Ok(()),
        }
    })?;
    Ok(follow.end())
}

/// The slowest motion that teaches harmonics, periods a sample.
fn floor(asked: &Encoder, signals: &Signals<'_>) -> Result<f64, Failure> {
    let Some(servo_hz) = asked.servo_hz else { return Ok(0.0) };
    let rate_hz = signals.survey.rate_hz().ok_or_else(|| {
        let reason = "--servo-hz: without a column `t_s` nobody knows how fast the periods pass";
        signals.samples.error(None, Fault::NoFit(reason.into()))
    })?;
    Ok(BEYOND_SERVO * servo_hz / rate_hz)
}

/// What a sweep at constant speed teaches; any other file is refused.
fn steady(signals: &Signals<'_>, taught: &Trail, period_um: f64) -> Result<Agreed, Failure> {
    let refused = |reason: String, instead: &str| {
        let words = format!("--harmonics: {reason}; {instead}, or leave it out");
        Failure::from(signals.samples.error(None, Fault::NoFit(words)))
    };
    let sweep = "take a sweep at constant speed";
    if !signals.survey.is_even() {
        return Err(refused("the samples are not at even distances of time".into(), sweep));
    }
    let agreed = taught.stretches.agreed().map_err(|why| refused(why.to_string(), why.instead()))?;
    if agreed.share < STEADY_SHARE {
        let why = taught.stretches.why_not();
        let reason = why.map_or_else(String::new, |why| format!(" ({why})"));
        let share = 100.0 * agreed.share;
        let reason = format!("only {share:.0} % of the samples are of a constant speed{reason}");
        return Err(refused(reason, sweep));
    }
    if agreed.uncertainty > KNOWN {
        let nm = 1e3 * period_um;
        let reason = format!(
            "what it tells is known to ± {:.3} nm only, and ± {:.3} are needed",
            nm * agreed.uncertainty,
            nm * KNOWN
        );
        return Err(refused(reason, "take a longer or a smoother sweep, or one at another speed"));
    }
    Ok(agreed)
}

/// The file of positions as it grows.
struct Positions {
    growing: Growing,
    counts: Option<Counts>,
    period_um: f64,
    begun: bool,
}

impl Positions {
    fn new(file: &Path, asked: &Encoder) -> Result<Self, Failure> {
        let table = asked.factor.map(Subdivider::new).transpose()?;
        let counts = table.map(|table| Counts::new(table, asked.limit_counts));
        Ok(Self { growing: Growing::new(file)?, counts, period_um: asked.period_um, begun: false })
    }

    fn write(&mut self, time: Option<&str>, turns: f64) -> Result<(), Failure> {
        if !self.begun {
            self.begun = true;
            self.growing.write(if time.is_some() { b"t_s,pos_um\n" } else { b"pos_um\n" })?;
        }
        let um = turns * self.period_um;
        let row = match time {
            Some(t_s) => format!("{t_s},{um:.6}\n"),
            None => format!("{um:.6}\n"),
        };
        self.growing.write(row.as_bytes())
    }
}

fn picture<'r>(report: &'r Report<'r>) -> Picture<'r> {
    let inside = &report.inside;
    Picture {
        title: format!("{}, period {} µm", report.asked.samples.display(), report.asked.period_um),
        signals: report.signals,
        ellipse: &report.learned.signals,
        points: &report.trail.points.taken,
        before: inside.before.as_ref().map(|(curve, _)| curve),
        after: inside.after.as_ref().ok().and_then(|(curve, _)| curve.as_ref()),
        period_um: report.asked.period_um,
    }
}
