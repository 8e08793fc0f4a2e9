//! `abbe demo`: the whole job, once.

use super::demo_report::{self, Mosaic};
use super::measure::{self, Job, Measured};
use super::{Answer, compensate, scan, stitch, today, verify};
use crate::bench::Shared;
use crate::cli::Demo;
use crate::failure::Failure;
use crate::flight::Keep;
use crate::folder;
use crate::optics::Sight;
use crate::preset::Preset;
use crate::progress;
use crate::rig::Rig;
use abbe_core::publish::HomeReport;
use abbe_metrology::Axis;
use abbe_metrology::compensation::{AxisCompensation, Circumstances, Compensation};
use abbe_metrology::fit::{DEFAULT_MAX_DEGREE, Fit};
use abbe_metrology::report::SettledStep;
use abbe_mosaic::compare;
use abbe_mosaic::stitch::StitchOptions;
use abbe_mosaic::tiles;
use std::cell::RefCell;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Instant;

/// Time powered before the first run, min: three time constants of the motors' warmth and more of it than that.
pub(super) const WARM_UP_MIN: f64 = 30.0;
/// Distance of the targets that are measured, mm, and runs in each direction.
const STEP_MM: f64 = 2.0;
const RUNS: usize = 5;
/// Targets and runs of the verification; paper A made seven runs.
const VERIFY: (usize, usize) = (11, 7);
/// Overlap of neighbouring tiles, %.
const OVERLAP_PERCENT: f64 = 15.0;
/// Middle of the scan, mm.
const CENTRE_MM: [f64; 2] = [50.0, 50.0];
/// The truth is written down so often, s.
const TRACE_S: f64 = 0.05;

/// Everything the job found.
pub(super) struct Found {
    pub(super) home: [HomeReport; 2],
    pub(super) before: [Measured; 2],
    pub(super) fits: [Fit; 2],
    pub(super) after: [Measured; 2],
    pub(super) step: SettledStep,
    pub(super) mosaic: Option<Mosaic>,
    pub(super) simulated_s: f64,
}

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Demo) -> Result<Answer, Failure> {
    let began = Instant::now();
    let sight = scan::sight(&asked.specimen, seed, CENTRE_MM)?;
    let folder = match &asked.out {
        Some(dir) => folder::prepare("--out", dir, asked.force)?,
        None => folder::next_demo()?,
    };
    let dir = &folder.dir;
    let found = work(preset, seed, (!asked.no_scan).then_some(sight), dir)?;
    let summary = demo_report::summary(preset, seed, dir, &found, began.elapsed().as_secs_f64());
    demo_report::page(preset, seed, &found).write(&dir.join("report.html"))?;
    folder::write_whole(&dir.join("summary.json"), format!("{summary:#}\n").as_bytes())?;
    Ok(Answer { text: demo_report::text(dir, &found, began.elapsed().as_secs_f64()), json: summary })
}

fn work(preset: &Preset, seed: u64, sight: Option<Sight>, dir: &Path) -> Result<Found, Failure> {
    for sub in ["measure", "verify", "truth"] {
        std::fs::create_dir_all(dir.join(sub))?;
    }
    let mut rig = Rig::new(preset, seed, Keep::LastMinutes);
    rig.dump_into(dir);
    rig.keep_trace(TRACE_S);
    progress::note("homing …");
    rig.home()?;
    let home = rig.status().axes.map(|axis| axis.home);
    let rig: Shared = Rc::new(RefCell::new(rig));
    measure::warm_up(&rig, WARM_UP_MIN)?;

    let before = [before(&rig, preset, Axis::X, dir)?, before(&rig, preset, Axis::Y, dir)?];
    let fits = [fit(&before[0])?, fit(&before[1])?];
    let compensation = compensation(preset, &before, &fits)?;
    compensation.write(&dir.join("compensation.toml"))?;
    rig.borrow_mut().compensate(&compensation)?;

    let after = verify::measure_both(&rig, preset, VERIFY, seed, &dir.join("verify"))?;
    let step = settled_step(&rig, preset)?;
    let mosaic = sight.map(|sight| mosaic(&rig, preset, sight, seed, dir)).transpose()?;
    write_truth(&rig, &before, &after, &dir.join("truth"))?;
    let simulated_s = rig.borrow().time_s();
    Ok(Found { home, before, fits, after, step, mosaic, simulated_s })
}

fn before(rig: &Shared, preset: &Preset, axis: Axis, dir: &Path) -> Result<Measured, Failure> {
    let targets_mm = measure::even_targets(preset, axis, STEP_MM)?;
    let job = Job { axis, targets_mm, runs: RUNS, set_up: 1 };
    let measured = measure::measure_axis(rig, preset, job, &format!("measuring {axis}"))?;
    measure::write_readings(&dir.join("measure"), &measured.measurement)?;
    Ok(measured)
}

fn fit(measured: &Measured) -> Result<Fit, Failure> {
    compensate::fit(&measured.measurement.readings, DEFAULT_MAX_DEGREE)
}

fn compensation(preset: &Preset, before: &[Measured; 2], fits: &[Fit; 2]) -> Result<Compensation, Failure> {
    let of_axis = |measured: &Measured, fit: &Fit| {
        let readings = &measured.measurement.readings;
        let circumstances = Circumstances {
            runs: readings.runs(),
            readings: readings.count(),
            temperature_c: measured.measurement.mean_celsius(),
            warm_up_s: Some(WARM_UP_MIN * 60.0),
        };
        AxisCompensation::from_fit(fit, circumstances)
    };
    Ok(Compensation {
        date: today(),
        preset: preset.name.clone(),
        x: Some(of_axis(&before[0], &fits[0])?),
        y: Some(of_axis(&before[1], &fits[1])?),
    })
}

/// One move of 1 mm, at every tick.
fn settled_step(rig: &Shared, preset: &Preset) -> Result<SettledStep, Failure> {
    let mut rig = rig.borrow_mut();
    rig.move_to(CENTRE_MM)?;
    rig.wait(0.2)?;
    let (seen, _) = rig.move_to_and_watch([CENTRE_MM[0] + 1.0, CENTRE_MM[1]], 0)?;
    let settings = &preset.controller.settings;
    let column = |index: usize| seen.iter().map(|row| row[index]).collect::<Vec<f64>>();
    Ok(SettledStep {
        axis: Axis::X,
        t_s: column(0),
        set_mm: column(1),
        actual_mm: column(2),
        window_um: settings.axes[0].in_position_um,
        dwell_s: settings.dwell_ms * 1e-3,
        done_s: seen.last().map_or(0.0, |row| row[0]),
    })
}

fn mosaic(rig: &Shared, preset: &Preset, sight: Sight, seed: u64, dir: &Path) -> Result<Mosaic, Failure> {
    let area = sight.size_mm().unwrap_or(scan::AREA_MM);
    let fields = scan::fields(preset, area, CENTRE_MM, OVERLAP_PERCENT)?;
    let began_s = rig.borrow().time_s();
    let scanned = scan::take(rig, preset, &fields, sight, seed, &dir.join("tiles"))?;
    let scan_s = rig.borrow().time_s() - began_s;
    scan::write_truth(&dir.join("truth"), &scanned.truth)?;
    let report = stitch::join(&dir.join("tiles"), &dir.join("mosaic.tif"), &StitchOptions::default())?;
    let registered = tiles::read_configuration(&report.configuration)?;
    let against_truth = compare::compare(&registered, &scanned.truth)?;
    Ok(Mosaic { area_mm: area, scan_s, report, against_truth })
}

/// What a doubter needs: where the table truly was, all the time and at every reading of the interferometer.
fn write_truth(
    rig: &Shared,
    before: &[Measured; 2],
    after: &[Measured; 2],
    dir: &Path,
) -> Result<(), Failure> {
    let mut trace =
        String::from("t_s,table_x_um,table_y_um,slide_x_um,slide_y_um,believed_x_mm,believed_y_mm\n");
    for sample in &rig.borrow().trace {
        let (truth, [x, y]) = (sample.truth, sample.reading_mm);
        let ([tx, ty], [sx, sy]) = (truth.table_um, truth.slides_um);
        _ = writeln!(trace, "{:.4},{tx:.4},{ty:.4},{sx:.4},{sy:.4},{x:.7},{y:.7}", truth.time_s);
    }
    folder::write_whole(&dir.join("trace.csv"), trace.as_bytes())?;
    for (phase, both) in [("measure", before), ("verify", after)] {
        for one in both {
            let mut text = String::from("t_s,interferometer_um,table_x_um,table_y_um\n");
            for reading in &one.log {
                let [x, y] = reading.table_um;
                _ = writeln!(text, "{:.4},{:.4},{x:.4},{y:.4}", reading.time_s, reading.read_um);
            }
            let file: PathBuf = dir.join(format!("interferometer-{phase}-{}.csv", one.measurement.axis));
            folder::write_whole(&file, text.as_bytes())?;
        }
    }
    Ok(())
}
