//! What `abbe demo` tells: a table for the terminal, `summary.json` for programs, `report.html` for people.

use super::demo::{Found, WARM_UP_MIN};
use super::{compensate, measure, today, verify};
use crate::preset::Preset;
use abbe_metrology::Axis;
use abbe_metrology::report::{
    self, AxisReport, Before, Conditions, HeadlineRow, Picture, RawFile, Report, Verdict,
};
use abbe_metrology::verify::{Limits, PAPER_A, Verification};
use abbe_mosaic::compare::Comparison;
use abbe_mosaic::stitch::StitchReport;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// A tile may be so far from its true place, px rms.
const LARGEST_TILE_ERROR_PX: f64 = 0.5;

/// The picture and how right it is.
pub(super) struct Mosaic {
    pub(super) area_mm: [f64; 2],
    pub(super) scan_s: f64,
    pub(super) report: StitchReport,
    pub(super) against_truth: Comparison,
}

fn verifications(found: &Found) -> [(Axis, Verification); 2] {
    found.after.each_ref().map(|one| (one.measurement.axis, Verification::of(&one.measurement.readings)))
}

/// The table beside paper A's figures.
pub(super) fn text(dir: &Path, found: &Found, wall_s: f64) -> String {
    let both = verifications(found);
    let mut text = format!("{:<46}{:>16}{:>18}{:>18}\n", "", "paper A", "abbe x", "abbe y");
    let mut row = |figure: &str, paper: &str, x: String, y: String| {
        _ = writeln!(text, "{figure:<46}{paper:>16}{x:>18}{y:>18}");
    };
    for (at, paper) in [(90.0, "+82, +195 µm"), (100.0, "+90, +233 µm")] {
        let [x, y] = found.fits.each_ref().map(|fit| format!("{:+.0} µm", raw_error_um(fit, at)));
        row(&format!("error before compensation at {at:.0} mm"), paper, x, y);
    }
    let [x, y] =
        both.each_ref().map(|(_, v)| format!("{:+.2}…{:+.2} µm", v.mean_min.value_um, v.mean_max.value_um));
    row("mean error per point and direction, 7 runs", "-3.6…+3.8 µm", x, y);
    let [x, y] = both.each_ref().map(|(_, v)| format!("{:+.2} µm", v.worst_single.value_um));
    row("worst single error", &format!("{} µm", PAPER_A.worst_single_um), x, y);
    let [x, y] = both.each_ref().map(|(_, v)| format!("{:.2} µm", v.spread.value_um));
    row("spread of 7 runs", &format!("{:.2} µm", PAPER_A.spread_um), x, y);
    for (index, name) in ["A", "R", "E", "M", "B"].into_iter().enumerate() {
        let paper = if index == 0 { "±5 µm stated" } else { "" };
        let [x, y] = both.each_ref().map(|(_, v)| format!("{:.2} µm", figure(v, name)));
        row(&format!("ISO 230-2 {name}"), paper, x, y);
    }
    if let Some(mosaic) = &found.mosaic {
        let truth = &mosaic.against_truth;
        _ = writeln!(
            text,
            "\nmosaic: {} tiles, {:.3} px rms from their true places (worst {:.3} px)",
            truth.tiles, truth.rms_px, truth.worst_px
        );
    }
    _ = writeln!(text, "\n{}", verify::table(&verify::checks(&both)).trim_end());
    _ = writeln!(
        text,
        "\n{:.0} s of the stage's time in {wall_s:.0} s; warm-up {WARM_UP_MIN} min\n\nreport  {}",
        found.simulated_s,
        dir.join("report.html").display()
    );
    if let Some(mosaic) = &found.mosaic {
        _ = writeln!(text, "mosaic  {}", mosaic.report.mosaic.display());
        _ = writeln!(text, "preview {}", mosaic.report.preview.display());
    }
    text
}

/// The fitted error of the bare stage at a place, µm, from the zero of the travel.
fn raw_error_um(fit: &abbe_metrology::fit::Fit, at_mm: f64) -> f64 {
    fit.polynomial.value_um(at_mm) - fit.polynomial.value_um(0.0)
}

fn figure(found: &Verification, name: &str) -> f64 {
    let named = found.iso230.figures.named();
    named.iter().find(|(known, _)| *known == name).map_or(f64::NAN, |(_, value)| *value)
}

/// Everything for programs.
pub(super) fn summary(preset: &Preset, seed: u64, dir: &Path, found: &Found, wall_s: f64) -> Value {
    let both = verifications(found);
    let mut checks: Vec<Value> = verify::checks(&both)
        .into_iter()
        .map(|(axis, check)| {
            json!({
                "figure": check.figure, "axis": axis.to_string(), "value": check.value_um,
                "limit": check.limit_um, "unit": "um", "pass": check.pass,
            })
        })
        .collect();
    if let Some(mosaic) = &found.mosaic {
        let value = mosaic.against_truth.rms_px;
        checks.push(json!({
            "figure": "tiles from their true places, rms", "value": value,
            "limit": LARGEST_TILE_ERROR_PX, "unit": "px", "pass": value <= LARGEST_TILE_ERROR_PX,
        }));
    }
    json!({
        "software": concat!("abbe ", env!("CARGO_PKG_VERSION")),
        "preset": preset.name,
        "seed": seed,
        "date": today(),
        "warm_up_min": WARM_UP_MIN,
        "folder": dir,
        "home": found.home.each_ref().map(|home| json!({ "switch_mm": home.switch.mm() })),
        "x": axis(found, &both[0].1, 0),
        "y": axis(found, &both[1].1, 1),
        "step": {
            "axis": found.step.axis.to_string(),
            "done_s": found.step.done_s,
            "window_um": found.step.window_um,
        },
        "mosaic": found.mosaic.as_ref().map(mosaic),
        "checks": checks,
        "simulated_s": found.simulated_s,
        "wall_s": wall_s,
        "peak_memory_mib": peak_memory_mib(),
    })
}

/// The most memory this process has held, where the system tells (Linux).
fn peak_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}

fn axis(found: &Found, after: &Verification, index: usize) -> Value {
    let fit = &found.fits[index];
    json!({
        "before": { "at_90_um": raw_error_um(fit, 90.0), "at_100_um": raw_error_um(fit, 100.0) },
        "fit": compensate::document(fit),
        "after": verify::document(after),
        "temperature_c": found.after[index].measurement.mean_celsius(),
    })
}

fn mosaic(mosaic: &Mosaic) -> Value {
    json!({
        "area_mm": mosaic.area_mm,
        "scan_s": mosaic.scan_s,
        "against_truth": mosaic.against_truth,
        "stitch": mosaic.report,
    })
}

/// The page for people.
pub(super) fn page(preset: &Preset, seed: u64, found: &Found) -> Report {
    let axes: Vec<AxisReport> = (0..2)
        .map(|index| AxisReport {
            axis: found.after[index].measurement.axis,
            before: Some(Before {
                readings: found.before[index].measurement.readings.clone(),
                fit: found.fits[index].clone(),
            }),
            after: found.after[index].measurement.readings.clone(),
        })
        .collect();
    let limits = Limits::default();
    let mut headline = report::headline(&axes, &limits);
    headline.extend(found.mosaic.iter().map(mosaic_row));
    Report {
        title: "From a bare stage to a stitched image".into(),
        conditions: Conditions {
            preset: preset.name.clone(),
            seed: Some(seed),
            software: concat!("abbe ", env!("CARGO_PKG_VERSION")).into(),
            date: today(),
            warm_up_s: Some(WARM_UP_MIN * 60.0),
            more: vec![
                ("Measuring line".into(), "the middle of the table along each axis".into()),
                (
                    "Instrument".into(),
                    "simulated laser interferometer, set up anew for the verification".into(),
                ),
            ],
        },
        headline,
        axes,
        limits,
        step: Some(found.step.clone()),
        temperatures: measure::temperatures(&found.before),
        images: found.mosaic.iter().filter_map(picture).collect(),
        raw_files: raw_files(found.mosaic.is_some()),
    }
}

fn mosaic_row(mosaic: &Mosaic) -> HeadlineRow {
    let truth = &mosaic.against_truth;
    let verdict = if truth.rms_px <= LARGEST_TILE_ERROR_PX {
        Verdict::Met(format!("✓ within {LARGEST_TILE_ERROR_PX} px"))
    } else {
        Verdict::Missed(format!("✗ beyond {LARGEST_TILE_ERROR_PX} px"))
    };
    HeadlineRow {
        figure: "Tiles of the mosaic from their true places, rms".into(),
        paper: "—".into(),
        found: format!("{:.3} px, {} tiles", truth.rms_px, truth.tiles),
        verdict,
    }
}

fn picture(mosaic: &Mosaic) -> Option<Picture> {
    let png = std::fs::read(&mosaic.report.preview).ok()?;
    let [width, height] = mosaic.area_mm;
    let caption = format!(
        "{width} × {height} mm of the specimen from {} tiles; the full picture is mosaic.tif.",
        mosaic.report.tiles
    );
    Some(Picture { png, caption })
}

fn raw_files(with_mosaic: bool) -> Vec<RawFile> {
    let mut files = vec![
        ("measure/readings-x.csv", "interferometer readings of x before compensation"),
        ("measure/readings-y.csv", "interferometer readings of y before compensation"),
        ("compensation.toml", "the fitted polynomials"),
        ("verify/readings-x.csv", "readings of x with the compensation in use, at new targets"),
        ("verify/readings-y.csv", "readings of y with the compensation in use, at new targets"),
        ("truth/trace.csv", "where the table truly was, every 50 ms; no instrument saw this"),
        ("truth/interferometer-measure-x.csv", "every reading of the interferometer beside the truth"),
        ("truth/interferometer-measure-y.csv", "the same for y"),
        ("truth/interferometer-verify-x.csv", "the same for the verification of x"),
        ("truth/interferometer-verify-y.csv", "the same for the verification of y"),
        ("summary.json", "every figure of this page for programs"),
    ];
    if with_mosaic {
        files.extend([
            ("mosaic.tif", "the mosaic"),
            ("tiles/TileConfiguration.txt", "the tiles at the places where the stage believed to be"),
            ("TileConfiguration.registered.txt", "the tiles at their registered places"),
            ("truth/TileConfiguration.true.txt", "the tiles at their true places"),
        ]);
    }
    files.into_iter().map(|(path, what)| RawFile { path: path.into(), what: what.into() }).collect()
}
