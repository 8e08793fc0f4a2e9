//! What `abbe sweep` can be asked.

use super::{AxisName, Source, number, pair};
use clap::Args;
use std::path::PathBuf;

/// Longest time at constant speed before the area, ms: a minute.
const LONGEST_SETTLE_MS: f64 = 60_000.0;

/// `abbe sweep`.
#[derive(Args, Debug)]
pub(crate) struct Sweep {
    #[command(flatten)]
    pub(crate) source: Source,
    /// Width and height of the area, mm.
    #[arg(long, value_name = "WxH", value_parser = pair, allow_hyphen_values = true)]
    pub(crate) area: [f64; 2],
    /// Its low corner, where the first line enters it, mm; without it the area lies in the middle of the travel.
    #[arg(long, value_name = "X,Y", value_parser = pair, allow_hyphen_values = true)]
    pub(crate) at: Option<[f64; 2]>,
    /// So many lines, evenly spaced from edge to edge.
    #[arg(long, value_name = "N", required_unless_present = "pitch", conflicts_with = "pitch", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    pub(crate) lines: Option<u32>,
    /// As many lines as fit with this distance between them, µm.
    #[arg(long, value_name = "UM", value_parser = above_zero, allow_hyphen_values = true)]
    pub(crate) pitch: Option<f64>,
    /// Speed along the lines, mm/s.
    #[arg(long, value_name = "MM_S", value_parser = above_zero, allow_hyphen_values = true)]
    pub(crate) speed: f64,
    /// Axis along which the lines run.
    #[arg(long, value_name = "x|y", default_value = "x")]
    pub(crate) along: AxisName,
    /// All lines in one direction, with a faster way back; without it every second one goes backwards.
    #[arg(long)]
    pub(crate) fly_back: bool,
    /// Time at constant speed before each line enters the area, ms.
    #[arg(long, value_name = "MS", default_value_t = 20.0, value_parser = settle, allow_hyphen_values = true)]
    pub(crate) settle: f64,
    /// Distance of the places at which an event fires, µm, from the low edge of the area on.
    #[arg(long, value_name = "UM", value_parser = above_zero, allow_hyphen_values = true)]
    pub(crate) every: f64,
    /// How far the stage may go back without firing a place again, µm [default: two counts, or 1 if that is more].
    #[arg(long, value_name = "UM", value_parser = not_below_zero, allow_hyphen_values = true)]
    pub(crate) play: Option<f64>,
    /// Write each event: time, line, place, direction, where the stage was measured and where it truly was.
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) events: Option<PathBuf>,
    /// Replace a file that exists.
    #[arg(long)]
    pub(crate) force: bool,
}

fn above_zero(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    (value > 0.0).then_some(value).ok_or_else(|| format!("`{text}` is not more than 0"))
}

fn not_below_zero(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    (value >= 0.0).then_some(value).ok_or_else(|| format!("`{text}` is less than 0"))
}

fn settle(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    let allowed = (0.0..=LONGEST_SETTLE_MS).contains(&value);
    allowed.then_some(value).ok_or_else(|| format!("`{text}` ms is not within 0 … {LONGEST_SETTLE_MS} ms"))
}
