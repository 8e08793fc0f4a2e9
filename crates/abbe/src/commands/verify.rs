//! `abbe verify`: new targets, a fresh set-up of the instrument, a report.

use super::measure::{self, Job, Measured};
use super::{Answer, Wanted, today};
use crate::bench::Shared;
use crate::cli::Verify;
use crate::failure::Failure;
use crate::folder;
use crate::preset::Preset;
use crate::progress;
use abbe_metrology::Axis;
use abbe_metrology::compensation::Compensation;
use abbe_metrology::report::{self, AxisReport, Conditions, RawFile, Report};
use abbe_metrology::verify::{Check, Limits, Verification};
use serde_json::{Value, json};
use std::cell::RefCell;
use std::fmt::Write as _;
use std::path::Path;
use std::rc::Rc;

/// Number of the instrument's set-up: not the one that measured.
const SET_UP: u64 = 2;

/// Measures both axes again at targets of their own and writes the readings.
pub(super) fn measure_both(
    rig: &Shared,
    preset: &Preset,
    (targets, runs): (usize, usize),
    seed: u64,
    dir: &Path,
) -> Result<[Measured; 2], Failure> {
    let one = |axis: Axis| {
        let targets_mm = measure::new_targets(preset, axis, targets, seed)?;
        let job = Job { axis, targets_mm, runs, set_up: SET_UP };
        let measured = measure::measure_axis(rig, preset, job, &format!("verifying {axis}"))?;
        measure::write_readings(dir, &measured.measurement)?;
        Ok::<_, Failure>(measured)
    };
    Ok([one(Axis::X)?, one(Axis::Y)?])
}

/// The figures of an axis for programs.
pub(super) fn document(found: &Verification) -> Value {
    json!({
        "mean_min_um": found.mean_min.value_um,
        "mean_max_um": found.mean_max.value_um,
        "worst_single_um": found.worst_single.value_um,
        "spread_um": found.spread.value_um,
        "iso230": found.iso230.figures,
        "drift": found.iso230.drift,
    })
}

/// Every figure of both axes against its bound.
pub(super) fn checks(found: &[(Axis, Verification)]) -> Vec<(Axis, Check)> {
    let limits = Limits::default();
    found.iter().flat_map(|(axis, figures)| figures.checks(&limits).map(|check| (*axis, check))).collect()
}

/// The checks as a table.
pub(super) fn table(checks: &[(Axis, Check)]) -> String {
    let mut text = String::new();
    for (axis, check) in checks {
        let verdict = if check.pass { "within" } else { "BEYOND" };
        _ = writeln!(
            text,
            "  {axis}  {:<40}{:>7.2} µm   {verdict} {:.1} µm",
            check.figure, check.value_um, check.limit_um
        );
    }
    text
}

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Verify) -> Result<Answer, Failure> {
    let missing = || Failure::usage("--compensation FILE is missing: it names what is to be verified");
    asked.source.compensation.as_ref().ok_or_else(missing)?;
    let wanted = Wanted::new(preset, seed, &asked.source)?;
    let compensation = wanted.compensation.as_ref().ok_or_else(missing)?;
    let _folder = folder::prepare("--out", &asked.out.out, asked.out.force)?;
    let notes = notes(compensation);
    for note in &notes {
        progress::note(&format!("note: {note}"));
    }
    let rig = Rc::new(RefCell::new(wanted.homed(&asked.out.out)?));
    measure::warm_up(&rig, asked.warm_up)?;
    let dir = &asked.out.out;
    let plan = (asked.targets as usize, asked.runs as usize);
    let measured = measure_both(&rig, preset, plan, seed, dir)?;
    let found =
        measured.each_ref().map(|one| (one.measurement.axis, Verification::of(&one.measurement.readings)));
    let checks = checks(&found);
    let report = dir.join("report.html");
    page(preset, seed, asked, compensation, &measured).write(&report)?;
    let json = json!({
        "x": document(&found[0].1),
        "y": document(&found[1].1),
        "checks": checks.iter().map(|(axis, check)| json!({ "axis": axis.to_string(), "check": check })).collect::<Vec<_>>(),
        "notes": notes,
        "report": report,
    });
    folder::write_whole(&dir.join("summary.json"), format!("{json:#}\n").as_bytes())?;
    let text = format!("{}report  {}\n", table(&checks), report.display());
    Ok(Answer { text, json })
}

/// Axes that are verified as they are.
fn notes(compensation: &Compensation) -> Vec<String> {
    let bare = [Axis::X, Axis::Y].into_iter().filter(|axis| compensation.axis(*axis).is_none());
    bare.map(|axis| format!("the compensation file has no {axis} axis: {axis} is verified uncompensated"))
        .collect()
}

fn page(
    preset: &Preset,
    seed: u64,
    asked: &Verify,
    compensation: &Compensation,
    measured: &[Measured; 2],
) -> Report {
    let raw = measured.each_ref().map(|one| RawFile {
        path: format!("readings-{}.csv", one.measurement.axis),
        what: format!("readings of the {} axis with the compensation in use", one.measurement.axis),
    });
    let axes: Vec<AxisReport> = measured
        .iter()
        .map(|one| AxisReport {
            axis: one.measurement.axis,
            before: None,
            after: one.measurement.readings.clone(),
        })
        .collect();
    Report {
        title: "Verification of a compensated stage".into(),
        conditions: Conditions {
            preset: preset.name.clone(),
            seed: Some(seed),
            software: concat!("abbe ", env!("CARGO_PKG_VERSION")).into(),
            date: today(),
            warm_up_s: Some(asked.warm_up * 60.0),
            more: vec![("compensation measured on".into(), compensation.date.clone())],
        },
        headline: report::headline(&axes, &Limits::default()),
        axes,
        temperatures: measure::temperatures(measured),
        raw_files: raw.into(),
        ..Report::default()
    }
}
