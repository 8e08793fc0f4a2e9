//! One self-contained HTML file: what was measured, what was corrected, what is left.
//!
//! No scripts, nothing fetched: the file can be mailed, printed and kept. Plots are inline SVG, pictures are inside.

mod chart;
mod html;
mod sections;

use std::io;
use std::path::Path;

use crate::axis::Axis;
use crate::fit::Fit;
use crate::measure::TemperatureRecord;
use crate::readings::Readings;
use crate::verify::{Limits, PAPER_A, Verification};
use crate::whole_file;
use html::signed;

/// Everything a report shows. Empty lists leave their section out.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Heading of the page.
    pub title: String,
    /// Under which conditions it was measured.
    pub conditions: Conditions,
    /// The figures to read first; [`headline`] makes those that compare with paper A.
    pub headline: Vec<HeadlineRow>,
    /// Both axes, or the one that was measured.
    pub axes: Vec<AxisReport>,
    /// The bounds drawn in the plots of what is left.
    pub limits: Limits,
    /// One move in time.
    pub step: Option<SettledStep>,
    /// Temperatures during the measurements.
    pub temperatures: Vec<TemperatureLog>,
    /// Pictures, such as a preview of the mosaic.
    pub images: Vec<Picture>,
    /// Files with the raw data, so that a doubter can recompute everything.
    pub raw_files: Vec<RawFile>,
}

/// Under which conditions it was measured; empty texts are left out.
#[derive(Clone, Debug, Default)]
pub struct Conditions {
    /// Preset of the stage.
    pub preset: String,
    /// Seed of the simulation, if it was one.
    pub seed: Option<u64>,
    /// Program and version.
    pub software: String,
    /// Day of the measurement.
    pub date: String,
    /// Time powered before the first run, s.
    pub warm_up_s: Option<f64>,
    /// Whatever else belongs here: (name, value).
    pub more: Vec<(String, String)>,
}

/// One line of the headline table.
#[derive(Clone, Debug, PartialEq)]
pub struct HeadlineRow {
    /// Name of the figure.
    pub figure: String,
    /// What paper A reports, or a dash.
    pub paper: String,
    /// What was found here.
    pub found: String,
    /// What to think of it.
    pub verdict: Verdict,
}

/// What to think of a figure; the text says against which bound.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Within its bound.
    Met(String),
    /// Beyond its bound.
    Missed(String),
    /// Stated without a bound.
    Stated(String),
}

/// The measurements of one axis.
#[derive(Clone, Debug)]
pub struct AxisReport {
    /// Which axis.
    pub axis: Axis,
    /// What was measured before compensation; without it the sections that need it are left out for this axis.
    pub before: Option<Before>,
    /// Readings with the compensation on, at new targets.
    pub after: Readings,
}

/// An axis as it was before compensation.
#[derive(Clone, Debug)]
pub struct Before {
    /// The readings.
    pub readings: Readings,
    /// The polynomial fitted to them.
    pub fit: Fit,
}

/// One move from command to "in position".
#[derive(Clone, Debug)]
pub struct SettledStep {
    /// The axis that moved.
    pub axis: Axis,
    /// Time, s.
    pub t_s: Vec<f64>,
    /// Set-point at these times, mm.
    pub set_mm: Vec<f64>,
    /// Position at these times, mm.
    pub actual_mm: Vec<f64>,
    /// Half the width of the in-position window, µm.
    pub window_um: f64,
    /// Time the position must stay inside the window, s.
    pub dwell_s: f64,
    /// When the move was declared done, s.
    pub done_s: f64,
}

/// One thermometer's readings.
#[derive(Clone, Debug, PartialEq)]
pub struct TemperatureLog {
    /// Where it was.
    pub name: String,
    /// (time in s, temperature in °C).
    pub readings: Vec<(f64, f64)>,
}

/// A picture inside the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// A PNG file's bytes.
    pub png: Vec<u8>,
    /// What it shows.
    pub caption: String,
}

/// A file beside the report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawFile {
    /// Path from the report.
    pub path: String,
    /// What is in it.
    pub what: String,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The plotting library refused.
    #[error("the plot `{title}` could not be drawn: {reason}")]
    Plot {
        /// Title of the plot.
        title: String,
        /// Its reason.
        reason: String,
    },
    /// The file system refused to take the file.
    #[error("{file}: cannot be written: {source}")]
    Unwritable {
        /// The file.
        file: String,
        /// The reason.
        source: io::Error,
    },
}

impl Report {
    /// The page as text.
    ///
    /// # Errors
    /// [`ReportError::Plot`] if a plot cannot be drawn.
    pub fn html(&self) -> Result<String, ReportError> {
        sections::page(self)
    }

    /// Writes the page beside its place and renames it.
    ///
    /// # Errors
    /// [`ReportError`]; an older file is then untouched.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let page = self.html()?;
        whole_file::put(path, page.as_bytes())
            .map_err(|source| ReportError::Unwritable { file: path.display().to_string(), source })
    }
}

/// Splits the records of a measurement into one log a thermometer.
pub fn temperature_logs(names: &[String], records: &[TemperatureRecord]) -> Vec<TemperatureLog> {
    let log = |(i, name): (usize, &String)| TemperatureLog {
        name: name.clone(),
        readings: records.iter().filter_map(|r| Some((r.elapsed_s, *r.celsius.get(i)?))).collect(),
    };
    names.iter().enumerate().map(log).collect()
}

/// The rows that compare with paper A: error before (if any axis has it), mean error, worst single error, spread, and
/// ISO 230-2.
pub fn headline(axes: &[AxisReport], limits: &Limits) -> Vec<HeadlineRow> {
    let found: Vec<(Axis, Verification)> =
        axes.iter().map(|a| (a.axis, Verification::of(&a.after))).collect();
    let each = |text: &dyn Fn(&Verification) -> String| {
        let texts: Vec<String> =
            found.iter().map(|(axis, v)| format!("{} {}", capital(*axis), text(v))).collect();
        texts.join("\n")
    };
    let largest = |size: fn(&Verification) -> f64| found.iter().map(|(_, v)| size(v)).fold(0.0, f64::max);
    let after = [
        row(
            "Mean error per point and direction",
            format!("{} … {} µm", signed(PAPER_A.mean_um[0], 1), signed(PAPER_A.mean_um[1], 1)),
            each(&|v| format!("{} … {} µm", signed(v.mean_min.value_um, 2), signed(v.mean_max.value_um, 2))),
            verdict(largest(Verification::mean_size_um), limits.mean_um, "±"),
        ),
        row(
            "Worst single error",
            format!("{:.1} µm", PAPER_A.worst_single_um),
            each(&|v| format!("{} µm", signed(v.worst_single.value_um, 2))),
            verdict(largest(|v| v.worst_single.value_um.abs()), limits.worst_single_um, "±"),
        ),
        row(
            "Spread of the runs at a point (max − min)",
            format!("≤ {:.2} µm", PAPER_A.spread_um),
            each(&|v| format!("{:.2} µm", v.spread.value_um)),
            verdict(largest(|v| v.spread.value_um), limits.spread_um, ""),
        ),
        row(
            "ISO 230-2 accuracy A, bidirectional",
            format!("±{:.0} µm stated\n(no A can be formed)", PAPER_A.stated_um),
            each(&|v| format!("{:.2} µm", v.iso230.figures.a)),
            verdict(largest(|v| v.iso230.figures.a), limits.a_um, ""),
        ),
    ];
    before_row(axes).into_iter().chain(after).collect()
}

fn row(figure: &str, paper: String, found: String, verdict: Verdict) -> HeadlineRow {
    HeadlineRow { figure: figure.to_owned(), paper, found, verdict }
}

/// The errors of the raw stage, of the axes where they are known.
fn before_row(axes: &[AxisReport]) -> Option<HeadlineRow> {
    let largest = |a: &AxisReport| {
        let points = &a.before.as_ref()?.fit.points;
        let p = points.iter().max_by(|p, q| p.error_um.abs().total_cmp(&q.error_um.abs()))?;
        Some(format!("{} {} µm at {:.0} mm", capital(a.axis), signed(p.error_um, 0), p.x_mm))
    };
    let found: Vec<String> = axes.iter().filter_map(largest).collect();
    let paper = "X +90 µm, Y +233 µm at 100 mm\n(its polynomials)".to_owned();
    let verdict = Verdict::Stated("raw stage".into());
    (!found.is_empty()).then(|| row("Largest error before compensation", paper, found.join("\n"), verdict))
}

fn verdict(size_um: f64, limit_um: f64, sign: &str) -> Verdict {
    if size_um <= limit_um {
        Verdict::Met(format!("✓ within {sign}{limit_um} µm"))
    } else {
        Verdict::Missed(format!("✗ beyond {sign}{limit_um} µm"))
    }
}

/// The axis as a heading writes it.
fn capital(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "X",
        Axis::Y => "Y",
    }
}
