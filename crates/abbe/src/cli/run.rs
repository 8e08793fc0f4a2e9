//! What `abbe run` can be asked.

use super::Source;
use abbe_core::Pos;
use clap::Args;
use std::path::PathBuf;

/// `abbe run FILE.nc`.
#[derive(Args, Debug)]
pub(crate) struct Run {
    /// Program to read; `-` is stdin, with --stream or --check. docs/gcode.md has its words.
    #[arg(value_name = "FILE.nc")]
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) source: Source,
    /// Move nothing: look at the whole program, tell what is wrong with it, or what it is in figures. The stage is taken
    /// to stand at zero.
    #[arg(long, conflicts_with_all = ["stream", "trace", "plot", "feed_rate", "compensation", "force"])]
    pub(crate) check: bool,
    /// Check each line just before it is done, not the whole program before anything moves. For programs without end.
    #[arg(long)]
    pub(crate) stream: bool,
    /// Go at so many percent of the feeds, 1 … 200, within the limits of the stage [default: 100].
    #[arg(long, value_name = "PERCENT", value_parser = clap::value_parser!(u16).range(1..=200), allow_negative_numbers = true)]
    pub(crate) feed_rate: Option<u16>,
    /// Go along G1, G2, G3 and G5.5 step by step, one axis a step: by point-by-point comparison, sines as chords. On paper,
    /// or with --twin on the stage. A step is so many µm, or a `count` of the scale.
    #[arg(
        long,
        value_name = "STEP_UM",
        num_args = 0..=1,
        default_missing_value = "count",
        require_equals = true,
        value_parser = step,
        conflicts_with_all = ["stream", "check"]
    )]
    pub(crate) stepwise: Option<StepSize>,
    /// How far a chord may be beside its sine, µm [default: a step].
    #[arg(long, value_name = "UM", value_parser = tolerance, requires = "stepwise", allow_negative_numbers = true)]
    pub(crate) chord_tolerance: Option<Pos>,
    /// Write where the stage is asked to be and where it is, at every tick of the servo; on paper, every step.
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) trace: Option<PathBuf>,
    /// Draw the path and the following error; on paper, the path and its single steps.
    #[arg(long, value_name = "OUT.svg")]
    pub(crate) plot: Option<PathBuf>,
    /// Replace files that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// The smallest and the largest step, µm: a coordinate of 1.07 m is the farthest that the comparison takes, and a
/// millimetre is no step any more.
const STEPS_UM: [f64; 2] = [0.001, 1000.0];

/// How long a step is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StepSize {
    /// A count of the scale.
    Count,
    Of(Pos),
}

fn step(text: &str) -> Result<StepSize, String> {
    let [least, most] = STEPS_UM;
    match text.parse::<f64>() {
        _ if text == "count" => Ok(StepSize::Count),
        Ok(um) if (least..=most).contains(&um) => Ok(StepSize::Of(Pos::from_um(um))),
        _ => Err(format!("a step is {least} to {most} µm, or `count`")),
    }
}

fn tolerance(text: &str) -> Result<Pos, String> {
    match text.parse::<f64>() {
        Ok(um) if (STEPS_UM[0]..=1e5).contains(&um) => Ok(Pos::from_um(um)),
        _ => Err("a tolerance of chords is 0.001 to 100000 µm".into()),
    }
}
