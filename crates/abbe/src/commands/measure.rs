//! `abbe measure`: interferometer runs, and what `demo` and `verify` share with it.

use super::{Answer, Wanted};
use crate::bench::{BenchInterferometer, BenchStage, BenchThermometer, Reading, Shared};
use crate::cli::{AxisChoice, Measure};
use crate::failure::Failure;
use crate::folder;
use crate::interrupt;
use crate::preset::Preset;
use crate::progress;
use abbe_metrology::Axis;
use abbe_metrology::measure::{self, Measurement, Plan};
use abbe_metrology::report::{self, TemperatureLog};
use abbe_metrology::targets;
use serde_json::json;
use std::cell::RefCell;
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::Path;
use std::rc::Rc;

/// Way beyond the outer targets, mm: many times the lost motion.
const OVERRUN_MM: f64 = 0.5;
/// Rest at a target before the first reading, s.
const DWELL_S: f64 = 0.2;
/// Readings averaged at a target, a millisecond apart.
const READINGS: usize = 50;
/// Distance of the outermost target from the end of the travel, mm.
const END_MM: f64 = 1.0;

/// How an axis is to be measured.
pub(super) struct Job {
    pub(super) axis: Axis,
    pub(super) targets_mm: Vec<f64>,
    pub(super) runs: usize,
    /// Number of the instrument's set-up: each has its own misalignment.
    pub(super) set_up: u64,
}

/// What was measured, beside the truth.
pub(super) struct Measured {
    pub(super) measurement: Measurement,
    pub(super) log: Vec<Reading>,
}

/// Targets `step_mm` apart over the travel of an axis.
pub(super) fn even_targets(preset: &Preset, axis: Axis, step_mm: f64) -> Result<Vec<f64>, Failure> {
    let [low, high] = travel(preset, axis);
    targets::even(low + END_MM, high - END_MM, step_mm)
        .map_err(|error| Failure::usage(format!("--step, axis {axis}: {error}")))
}

/// Random targets over the travel of an axis, as ISO 230-2 wants them.
pub(super) fn new_targets(preset: &Preset, axis: Axis, count: usize, seed: u64) -> Result<Vec<f64>, Failure> {
    let [low, high] = travel(preset, axis);
    let seed = seed.wrapping_mul(2).wrapping_add(axis.index() as u64);
    targets::iso230(low + END_MM, high - END_MM, count, seed)
        .map_err(|error| Failure::usage(format!("--targets, axis {axis}: {error}")))
}

fn travel(preset: &Preset, axis: Axis) -> [f64; 2] {
    let settings = &preset.controller.settings.axes[axis.index()];
    [settings.travel_low_mm, settings.travel_high_mm]
}

/// The middle of a travel, mm: the measuring line of the other axis, and the datum of this one. What grows with the
/// way from the datum (air, misalignment, warmth of the scale) then grows half as far.
fn middle([low, high]: [f64; 2]) -> f64 {
    0.5 * (low + high)
}

/// The axes of a choice.
fn axes(choice: AxisChoice) -> &'static [Axis] {
    match choice {
        AxisChoice::X => &[Axis::X],
        AxisChoice::Y => &[Axis::Y],
        AxisChoice::Both => &[Axis::X, Axis::Y],
    }
}

/// Measures one axis along the middle line of the table.
pub(super) fn measure_axis(rig: &Shared, preset: &Preset, job: Job, name: &str) -> Result<Measured, Failure> {
    let other = if job.axis == Axis::X { Axis::Y } else { Axis::X };
    let plan = Plan {
        axis: job.axis,
        datum_mm: middle(travel(preset, job.axis)),
        targets_mm: job.targets_mm,
        runs: job.runs,
        line_mm: middle(travel(preset, other)),
        overrun_mm: OVERRUN_MM,
        dwell_s: DWELL_S,
        readings_per_point: READINGS,
    };
    plan.check([travel(preset, Axis::X), travel(preset, Axis::Y)]).map_err(Failure::usage)?;
    let mut interferometer = BenchInterferometer::set_up(rig, job.axis, job.set_up);
    let bar = progress::bar(name, plan.points());
    let measurement = measure::measure(
        &plan,
        &mut BenchStage(Rc::clone(rig)),
        &mut interferometer,
        &mut BenchThermometer::pair(rig),
        |progress| {
            bar.set_position(progress.done as u64);
            if interrupt::check().is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        },
    );
    bar.finish_and_clear();
    interrupt::check()?;
    Ok(Measured { measurement: measurement?, log: interferometer.log })
}

/// Lets the stage stand, powered, for `minutes` of its own time: motors and structure reach their warmth.
pub(super) fn warm_up(rig: &Shared, minutes: f64) -> Result<(), Failure> {
    if minutes <= 0.0 {
        return Ok(());
    }
    let bar = progress::bar(&format!("warming up for {minutes} min"), minutes.ceil() as usize);
    let mut left = minutes;
    while left > 0.0 {
        rig.borrow_mut().wait(left.min(1.0) * 60.0)?;
        left -= 1.0;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

/// The thermometers during the measurements of both axes, one log each.
pub(super) fn temperatures(measured: &[Measured]) -> Vec<TemperatureLog> {
    let logs = |one: &Measured| {
        let (axis, found) = (one.measurement.axis, &one.measurement);
        let mut logs = report::temperature_logs(&found.thermometers, &found.temperatures);
        for log in &mut logs {
            log.name = format!("{}, during {axis}", log.name);
        }
        logs
    };
    measured.iter().flat_map(logs).collect()
}

/// Writes the readings of an axis where the contract says.
pub(super) fn write_readings(dir: &Path, measurement: &Measurement) -> Result<(), Failure> {
    Ok(measurement.readings.write(&dir.join(format!("readings-{}.csv", measurement.axis)))?)
}

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Measure) -> Result<Answer, Failure> {
    let jobs = axes(asked.axis)
        .iter()
        .map(|&axis| {
            let targets_mm = even_targets(preset, axis, asked.step)?;
            Ok(Job { axis, targets_mm, runs: asked.runs as usize, set_up: 1 })
        })
        .collect::<Result<Vec<Job>, Failure>>()?;
    let wanted = Wanted::new(preset, seed, &asked.source)?;
    let _folder = folder::prepare("--out", &asked.out.out, asked.out.force)?;
    let rig = Rc::new(RefCell::new(wanted.homed(&asked.out.out)?));
    warm_up(&rig, asked.warm_up)?;
    let (mut text, mut files) = (String::new(), Vec::new());
    for job in jobs {
        let axis = job.axis;
        let measured = measure_axis(&rig, preset, job, &format!("measuring {axis}"))?;
        write_readings(&asked.out.out, &measured.measurement)?;
        let file = asked.out.out.join(format!("readings-{axis}.csv"));
        let readings = &measured.measurement.readings;
        _ = writeln!(
            text,
            "{axis}: {} readings at {} targets, {} runs each way → {}",
            readings.count(),
            readings.targets_mm().len(),
            readings.runs(),
            file.display()
        );
        files.push(json!({
            "axis": axis.to_string(),
            "file": file,
            "targets": readings.targets_mm().len(),
            "runs": readings.runs(),
            "temperature_c": measured.measurement.mean_celsius(),
        }));
    }
    Ok(Answer { text, json: json!({ "readings": files, "warm_up_min": asked.warm_up }) })
}
