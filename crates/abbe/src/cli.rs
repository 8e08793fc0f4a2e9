//! The command line: a stable contract.

mod encoder;
mod run;
mod sweep;

pub(crate) use encoder::{Encoder, Method};
pub(crate) use run::{Run, StepSize};
pub(crate) use sweep::Sweep;

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Below the help.
const STATUS: &str = "Exit status: 0 done, 1 the work failed, 2 wrong usage. \
    Answers go to stdout, progress and errors to stderr.";

/// An open controller for precision X-Y stages.
///
/// Lengths are mm, speeds mm/s, overlaps %. There is no hardware behind it yet: everything runs on the twin, an honest
/// simulation of a stage. Begin with `abbe demo`.
#[derive(Debug, Parser)]
#[command(name = "abbe", version, arg_required_else_help = true, max_term_width = 100, after_help = STATUS)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print one JSON document to stdout and nothing else there.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Stage: a built-in preset or a TOML file [default: microscope-100].
    #[arg(long, global = true, value_name = "NAME|FILE")]
    pub(crate) preset: Option<String>,
    /// Seed of everything random in the twin. The same seed gives the same run.
    #[arg(long, global = true, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    pub(crate) seed: u64,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The whole job on the twin: home, measure, compensate, verify, scan, stitch.
    Demo(Demo),
    /// Find the zero of both axes.
    Home(Home),
    /// Go to a position and wait for measured arrival.
    Move(Move),
    /// Run a G-code program, or check it as a whole (--check).
    Run(Run),
    /// Measure the positioning error with the interferometer.
    Measure(Measure),
    /// Fit a polynomial to measured errors and write a compensation file.
    Compensate(Compensate),
    /// Measure again at new targets with a --compensation in use, and certify (ISO 230-2).
    Verify(Verify),
    /// Evaluate any readings file by ISO 230-2:2014.
    Iso230(Iso230),
    /// Judge recorded encoder signals and turn them into positions.
    Encoder(Encoder),
    /// Take overlapping pictures of an area.
    Scan(Scan),
    /// Go over an area line by line without a stop; events fire at evenly spaced places.
    Sweep(Sweep),
    /// Join tiles into one picture.
    Stitch(Stitch),
    /// Record a run: power on, home, move, and everything the controller saw on the way.
    Record(Record),
    /// Replay a recording, prove it bit for bit, and look into it.
    Replay(Replay),
}

/// Where the stage comes from.
#[derive(Args, Clone, Debug)]
pub(crate) struct Source {
    /// Use a twin of its own: power on, home, do the one thing, forget.
    #[arg(long)]
    pub(crate) twin: bool,
    /// Compensation file to put in use after homing.
    #[arg(long, value_name = "FILE")]
    pub(crate) compensation: Option<PathBuf>,
}

/// Where results go.
#[derive(Args, Clone, Debug)]
pub(crate) struct Out {
    /// Folder for the results; it must be new or empty.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Write into a folder that is not empty.
    #[arg(long)]
    pub(crate) force: bool,
}

/// `abbe demo`.
#[derive(Args, Debug)]
pub(crate) struct Demo {
    /// Folder for the results; without it a new folder abbe-demo-N.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    pub(crate) force: bool,
    /// Accuracy only: neither scan nor stitch.
    #[arg(long)]
    pub(crate) no_scan: bool,
    #[command(flatten)]
    pub(crate) specimen: Specimen,
}

/// What lies under the microscope.
#[derive(Args, Clone, Debug)]
pub(crate) struct Specimen {
    /// Picture to use as the specimen (TIFF, PNG, JPEG); without it a procedural tissue without end.
    #[arg(long, value_name = "FILE")]
    pub(crate) specimen: Option<PathBuf>,
    /// Size of that picture's pixels on the table, µm.
    #[arg(long, value_name = "UM", default_value_t = 1.0, value_parser = pixel, allow_hyphen_values = true)]
    pub(crate) specimen_pixel: f64,
}

/// `abbe home`.
#[derive(Args, Debug)]
pub(crate) struct Home {
    #[command(flatten)]
    pub(crate) source: Source,
    /// Home so many times, each from a random place, and report every shift of the zero.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000), allow_negative_numbers = true)]
    pub(crate) times: u32,
}

/// `abbe move X Y`.
#[derive(Args, Debug)]
pub(crate) struct Move {
    /// Target on the x axis, mm.
    #[arg(value_name = "X", value_parser = place, allow_hyphen_values = true)]
    pub(crate) x: f64,
    /// Target on the y axis, mm.
    #[arg(value_name = "Y", value_parser = place, allow_hyphen_values = true)]
    pub(crate) y: f64,
    #[command(flatten)]
    pub(crate) source: Source,
    /// Move x first, and y when x is there; without it both go together along a line.
    #[arg(long)]
    pub(crate) sequential: bool,
}

/// Which axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum AxisChoice {
    X,
    Y,
    Both,
}

/// `abbe measure`.
#[derive(Args, Debug)]
pub(crate) struct Measure {
    /// Axis to measure; both: one after the other.
    #[arg(long, default_value = "both")]
    pub(crate) axis: AxisChoice,
    #[command(flatten)]
    pub(crate) out: Out,
    #[command(flatten)]
    pub(crate) source: Source,
    /// Runs in each direction; ISO 230-2 asks for five.
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1000), allow_negative_numbers = true)]
    pub(crate) runs: u32,
    /// Distance of the targets, mm.
    #[arg(long, default_value_t = 2.0, value_parser = number, value_name = "MM", allow_hyphen_values = true)]
    pub(crate) step: f64,
    /// Time powered before the first run, min.
    #[arg(long, default_value_t = 30.0, value_parser = minutes, value_name = "MIN", allow_hyphen_values = true)]
    pub(crate) warm_up: f64,
}

/// `abbe compensate READINGS…`.
#[derive(Args, Debug)]
pub(crate) struct Compensate {
    /// Readings files; the axis is taken from a name that ends in -x or -y, or given as x=FILE.
    #[arg(required = true, value_name = "READINGS")]
    pub(crate) readings: Vec<String>,
    /// Compensation file to write.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Highest degree to try.
    #[arg(long, default_value_t = 16, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=20), allow_negative_numbers = true)]
    pub(crate) max_degree: u32,
    /// Replace a file that exists.
    #[arg(long)]
    pub(crate) force: bool,
}

/// `abbe verify`.
#[derive(Args, Debug)]
pub(crate) struct Verify {
    #[command(flatten)]
    pub(crate) source: Source,
    #[command(flatten)]
    pub(crate) out: Out,
    /// Runs in each direction; paper A made seven.
    #[arg(long, default_value_t = 7, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1000), allow_negative_numbers = true)]
    pub(crate) runs: u32,
    /// Number of random targets on each axis.
    #[arg(long, default_value_t = 11, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1000), allow_negative_numbers = true)]
    pub(crate) targets: u32,
    /// Time powered before the first run, min.
    #[arg(long, default_value_t = 30.0, value_parser = minutes, value_name = "MIN", allow_hyphen_values = true)]
    pub(crate) warm_up: f64,
}

/// `abbe iso230 READINGS.csv`.
#[derive(Args, Debug)]
pub(crate) struct Iso230 {
    /// Readings file: the header is `approach,target_mm,run1,run2,…`, cells are positions in mm.
    #[arg(value_name = "READINGS.csv")]
    pub(crate) readings: PathBuf,
}

/// `abbe scan`.
#[derive(Args, Debug)]
pub(crate) struct Scan {
    #[command(flatten)]
    pub(crate) source: Source,
    #[command(flatten)]
    pub(crate) out: Out,
    /// Width and height of the area, mm; without it 1.6x1.2, or the size of the specimen's picture.
    #[arg(long, value_name = "WxH", value_parser = pair, allow_hyphen_values = true)]
    pub(crate) area: Option<[f64; 2]>,
    /// Middle of the area, mm.
    #[arg(long, value_name = "X,Y", default_value = "50,50", value_parser = pair, allow_hyphen_values = true)]
    pub(crate) centre: [f64; 2],
    /// Overlap of neighbouring tiles, %.
    #[arg(long, default_value_t = 15.0, value_parser = number, value_name = "P", allow_hyphen_values = true)]
    pub(crate) overlap: f64,
    #[command(flatten)]
    pub(crate) specimen: Specimen,
    /// Folder for the true places of the tiles, for doubters.
    #[arg(long, value_name = "DIR")]
    pub(crate) truth: Option<PathBuf>,
}

/// `abbe stitch DIR`.
#[derive(Args, Debug)]
pub(crate) struct Stitch {
    /// Folder with tiles and TileConfiguration.txt.
    #[arg(value_name = "DIR")]
    pub(crate) tiles: PathBuf,
    /// Mosaic to write (.tif); beside it a preview (.png) and TileConfiguration.registered.txt.
    #[arg(long, value_name = "MOSAIC")]
    pub(crate) out: PathBuf,
    /// Replace files that exist.
    #[arg(long)]
    pub(crate) force: bool,
    /// How far a tile may be from its nominal place, px.
    #[arg(long, default_value_t = 40, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=2000), allow_negative_numbers = true)]
    pub(crate) search: u32,
    /// Leave lens distortion as it is.
    #[arg(long)]
    pub(crate) keep_distortion: bool,
    /// Leave vignetting and exposure as they are.
    #[arg(long)]
    pub(crate) keep_shading: bool,
}

/// `abbe record FILE`.
#[derive(Args, Debug)]
pub(crate) struct Record {
    /// Recording to write (.abr).
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) source: Source,
    /// Target to go to after homing, mm; once for each move. Without it a square of 5 mm.
    #[arg(long = "move", num_args = 2, value_names = ["X", "Y"], value_parser = place, allow_hyphen_values = true)]
    pub(crate) moves: Vec<f64>,
    /// Play a script instead, in the words of tests/scenarios; it homes itself.
    #[arg(long, value_name = "SCRIPT", conflicts_with = "moves")]
    pub(crate) script: Option<PathBuf>,
    /// Replace a file that exists.
    #[arg(long)]
    pub(crate) force: bool,
}

/// `abbe replay FILE`.
#[derive(Args, Debug)]
pub(crate) struct Replay {
    /// Recording to replay (.abr): of `abbe record`, or written when a stage stopped with a fault.
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    /// Show from here on, s from power-on. All is replayed and proven anyway.
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub(crate) from: Option<f64>,
    /// Show up to here, s from power-on.
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub(crate) to: Option<f64>,
    /// Print a row every N ticks.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    pub(crate) step: Option<u32>,
    /// Draw place, following error, step rate and state: OUT.svg, or OUT.html for a page.
    #[arg(long, value_name = "OUT")]
    pub(crate) plot: Option<PathBuf>,
    /// Write the rows to a file: every tick, or every N with --step.
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) csv: Option<PathBuf>,
    /// Write the samples of the analogue encoder of --axis to a file that `abbe encoder` reads, in codes of 16 bits.
    #[arg(long, value_name = "OUT.csv", requires = "axis")]
    pub(crate) samples: Option<PathBuf>,
    /// The axis of --samples.
    #[arg(long, value_name = "x|y", requires = "samples")]
    pub(crate) axis: Option<AxisName>,
    /// Replace files that exist.
    #[arg(long)]
    pub(crate) force: bool,
}

/// An axis by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum AxisName {
    /// The first.
    X,
    /// The second.
    Y,
}

/// The most a stage could be asked to travel, mm: beyond, a unit was mistaken.
const FARTHEST_MM: f64 = 1e6;
/// Longest time to warm up, min: a week.
const LONGEST_WARM_UP_MIN: f64 = 10_080.0;

/// A place on an axis, mm.
fn place(text: &str) -> Result<f64, String> {
    if text.starts_with("--") {
        return Err(format!("`{text}` is neither a number nor an option of this command"));
    }
    let value = number(text)?;
    let allowed = value.abs() <= FARTHEST_MM;
    allowed.then_some(value).ok_or_else(|| format!("`{text}` mm is beyond ±{FARTHEST_MM} mm"))
}

/// A time to warm up, min.
fn minutes(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    let allowed = (0.0..=LONGEST_WARM_UP_MIN).contains(&value);
    allowed
        .then_some(value)
        .ok_or_else(|| format!("`{text}` min is not within 0 … {LONGEST_WARM_UP_MIN} min"))
}

/// The size of a pixel, µm.
fn pixel(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    (value > 0.0).then_some(value).ok_or_else(|| format!("`{text}` µm is not more than 0"))
}

/// A finite number.
fn number(text: &str) -> Result<f64, String> {
    let value: f64 = text.trim().parse().map_err(|_| format!("`{text}` is not a number"))?;
    if value.is_finite() { Ok(value) } else { Err(format!("`{text}` is not a finite number")) }
}

/// Two numbers with an x or a comma between.
fn pair(text: &str) -> Result<[f64; 2], String> {
    let (first, second) = text
        .split_once(['x', ',', '×'])
        .ok_or_else(|| format!("`{text}` is not a pair of numbers such as 10x8 or 50,50"))?;
    Ok([number(first)?, number(second)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn negative_targets_are_numbers_and_not_options() {
        let cli = Cli::try_parse_from(["abbe", "move", "-1.5", "-2e-3", "--twin"]).unwrap();
        let Command::Move(to) = cli.command else { panic!("{cli:?}") };
        assert_eq!((to.x, to.y), (-1.5, -0.002));
    }

    #[test]
    fn pairs_are_read_and_nonsense_is_named() {
        assert_eq!(pair("10x8"), Ok([10.0, 8.0]));
        assert_eq!(pair("50,-3.5"), Ok([50.0, -3.5]));
        assert!(pair("10").unwrap_err().contains("`10`"));
        assert!(pair("1xNaN").unwrap_err().contains("NaN"));
    }
}
