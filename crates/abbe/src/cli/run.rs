//! What `abbe run` can be asked.

use super::Source;
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
    /// Write where the stage is asked to be and where it is, at every tick of the servo.
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) trace: Option<PathBuf>,
    /// Draw the path and the following error.
    #[arg(long, value_name = "OUT.svg")]
    pub(crate) plot: Option<PathBuf>,
    /// Replace files that exist.
    #[arg(long)]
    pub(crate) force: bool,
}
