//! What `abbe encoder` can be asked.

use super::number;
use abbe_core::sense::subdivide::Subdivider;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// `abbe encoder SAMPLES.csv`.
#[derive(Args, Debug)]
pub(crate) struct Encoder {
    /// Samples file: a header with `a` (cosine) and `b` (sine), `t_s` if there are times; any unit. In the positive
    /// direction a leads b.
    #[arg(value_name = "SAMPLES.csv")]
    pub(crate) samples: PathBuf,
    /// Period of the signals, µm.
    #[arg(long, value_name = "UM", value_parser = period, allow_hyphen_values = true)]
    pub(crate) period_um: f64,
    /// The numbers are codes of a converter of N bits: 0 … 2^N − 1, or around 0.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=16), allow_negative_numbers = true)]
    pub(crate) bits: Option<u32>,
    /// What is taken off the signals.
    #[arg(long, default_value = "heydemann")]
    pub(crate) method: Method,
    /// Learn the harmonics of the phase error, too, and take them off; the file must be a sweep at nearly constant speed,
    /// 1/250 … 1/8 of a period a sample.
    #[arg(long)]
    pub(crate) harmonics: bool,
    /// Bandwidth of the servo that drove the sweep, Hz: below ten times as many periods a second it follows the errors of
    /// its own encoder and hides them, and nothing is learned. Needs `t_s`.
    #[arg(long, value_name = "HZ", value_parser = step, requires = "harmonics", allow_hyphen_values = true)]
    pub(crate) servo_hz: Option<f64>,
    /// Count steps of 1/N of a period by paper B's table, a multiple of 4.
    #[arg(long, value_name = "N", value_parser = factor, allow_negative_numbers = true)]
    pub(crate) factor: Option<u16>,
    /// Paper B's limit filter on samples: keep the one before where a step is larger, in the unit of the file.
    #[arg(long, value_name = "STEP", value_parser = step, allow_hyphen_values = true)]
    pub(crate) limit_samples: Option<f64>,
    /// Paper B's limit filter on counts: a difference of one keeps the count before, of more gives the mean.
    #[arg(long, requires = "factor")]
    pub(crate) limit_counts: bool,
    /// Write the position of every sample.
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) positions: Option<PathBuf>,
    /// Draw the signals, and the error over the phase.
    #[arg(long, value_name = "OUT.svg")]
    pub(crate) plot: Option<PathBuf>,
    /// Replace files that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// How the ellipse is found that is taken off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Method {
    /// Least squares over all samples.
    Heydemann,
    /// Means, variances and covariance; right for whole periods only.
    Moments,
    /// Offsets alone, from the last maximum and minimum, as in paper B.
    Peaks,
    /// Kept up to date along the file, as the controller does.
    Recursive,
    /// Nothing.
    None,
}

/// The longest period of a grating, µm: a metre.
const LONGEST_PERIOD_UM: f64 = 1e6;

/// A period, µm.
fn period(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    let allowed = value > 0.0 && value <= LONGEST_PERIOD_UM;
    allowed
        .then_some(value)
        .ok_or_else(|| format!("`{text}` µm is not more than 0 and up to {LONGEST_PERIOD_UM} µm"))
}

/// Into how many steps a period is divided.
fn factor(text: &str) -> Result<u16, String> {
    let value: u16 =
        text.trim().parse().map_err(|_| format!("`{text}` is not a whole number of 4 … 4096"))?;
    Subdivider::new(value).map(|table| table.factor()).map_err(|error| error.to_string())
}

/// A step of a signal, or a bandwidth.
fn step(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    (value > 0.0).then_some(value).ok_or_else(|| format!("`{text}` is not more than 0"))
}
