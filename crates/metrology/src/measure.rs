//! Drives a stage to targets and reads where it really is.
//!
//! The crate knows no stage: a program lends it three things, each behind one of the traits below. Times are the
//! stage's own, so a simulated stage measures as fast as it can be computed.
//!
//! A run goes below the first target by the overrun, reaches every target from below (`up`), goes beyond the last by
//! the overrun and comes back reaching every target from above (`down`). Every target is thus approached over the full
//! lost motion, as ISO 230-2 asks.

use std::cmp::Ordering;
use std::convert::Infallible;
use std::error::Error;
use std::ops::ControlFlow;

use serde::Serialize;

use crate::axis::{Approach, Axis};
use crate::readings::{Readings, ReadingsFault};

/// A stage that can be told where to go.
pub trait Stage {
    /// Why a move or a pause failed.
    type Error: Error;

    /// Moves the table to `[x, y]` in mm, stage frame, and returns when it has *arrived*: inside the in-position
    /// window for the dwell time, by measurement. The end of the trajectory is not arrival.
    ///
    /// # Errors
    /// Any reason why the table is not there: refused, tripped, timed out. The stage may then be anywhere.
    fn move_to(&mut self, position_mm: [f64; 2]) -> Result<Arrival, Self::Error>;

    /// Holds the position for `seconds` ≥ 0 of the stage's own time.
    ///
    /// # Errors
    /// Any reason why the position was not held.
    fn dwell(&mut self, seconds: f64) -> Result<(), Self::Error>;
}

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Arrival {
    /// From the command to the end of the trajectory, s.
    pub moved_s: f64,
    /// From the end of the trajectory until the table had been in position for the dwell time, s.
    pub settle_s: f64,
    /// What the stage's own scales read on arrival, stage frame, mm.
    pub position_mm: [f64; 2],
}

/// An instrument that follows the table along the measured axis: a laser interferometer.
pub trait Instrument {
    /// Why no reading came.
    type Error: Error;

    /// Makes the present place the zero of all later readings.
    ///
    /// # Errors
    /// Any reason why the zero was not set.
    fn set_zero(&mut self) -> Result<(), Self::Error>;

    /// Displacement since the zero in µm, positive towards larger positions of the axis.
    ///
    /// # Errors
    /// Any reason why there is no reading, such as a broken beam.
    fn read_um(&mut self) -> Result<f64, Self::Error>;
}

/// A thermometer on the stage or in the room.
pub trait Thermometer {
    /// Why no reading came.
    type Error: Error;

    /// What it measures: `scale`, `structure`, `air`.
    fn name(&self) -> &str;

    /// Temperature in °C.
    ///
    /// # Errors
    /// Any reason why there is no reading.
    fn read_c(&mut self) -> Result<f64, Self::Error>;
}

/// The thermometer of a stage that has none: `&mut [] as &mut [NoThermometer]`.
#[derive(Clone, Copy, Debug)]
pub enum NoThermometer {}

impl Thermometer for NoThermometer {
    type Error = Infallible;

    fn name(&self) -> &str {
        match *self {}
    }

    fn read_c(&mut self) -> Result<f64, Infallible> {
        match *self {}
    }
}

/// What to measure on one axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// The axis that moves.
    pub axis: Axis,
    /// Targets in mm, strictly ascending, at least two.
    pub targets_mm: Vec<f64>,
    /// Runs in each direction, at least two; ISO 230-2 asks for five.
    pub runs: usize,
    /// Where the other axis stands, mm: the measuring line.
    pub line_mm: f64,
    /// Where the instrument is set to zero, approached from below, mm.
    pub datum_mm: f64,
    /// How far beyond the outer targets each direction begins, mm, more than the lost motion.
    pub overrun_mm: f64,
    /// Rest at each target before the first reading, s.
    pub dwell_s: f64,
    /// Instrument readings averaged at each target, at least one.
    pub readings_per_point: usize,
}

/// What makes a plan impossible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanFault {
    /// Fewer than two.
    #[error("{found} target(s), at least 2 are needed")]
    TooFewTargets {
        /// Targets given.
        found: usize,
    },
    /// Not strictly ascending.
    #[error("target {target_mm} mm does not ascend from {previous_mm} mm before it")]
    Unsorted {
        /// The target out of order.
        target_mm: f64,
        /// The target before it.
        previous_mm: f64,
    },
    /// Fewer than two: no standard deviation.
    #[error("{found} run(s), at least 2 are needed")]
    TooFewRuns {
        /// Runs given.
        found: usize,
    },
    /// A place the stage cannot reach.
    #[error("{what} at {position_mm} mm is outside the travel of {axis}, {low_mm} to {high_mm} mm")]
    OutOfTravel {
        /// What lies there.
        what: &'static str,
        /// The axis concerned.
        axis: Axis,
        /// The place.
        position_mm: f64,
        /// Lower end of the travel.
        low_mm: f64,
        /// Upper end of the travel.
        high_mm: f64,
    },
    /// A length, time or count that must be positive (a dwell may be zero).
    #[error("{what} is {value}, which is not allowed")]
    NotAllowed {
        /// Name of the quantity, with its unit.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

impl Plan {
    /// Checks the plan against the travel `[[x low, x high], [y low, y high]]` in mm, overruns included. NaN is refused wherever it stands.
    ///
    /// # Errors
    /// The first [`PlanFault`].
    pub fn check(&self, travel_mm: [[f64; 2]; 2]) -> Result<(), PlanFault> {
        self.check_numbers()?;
        let along = travel_mm[self.axis.index()];
        let (first, last) = (self.targets_mm[0], self.targets_mm[self.targets_mm.len() - 1]);
        let other = if self.axis == Axis::X { Axis::Y } else { Axis::X };
        inside(self.axis, along, "the start of the way up", first - self.overrun_mm)?;
        inside(self.axis, along, "the start of the way down", last + self.overrun_mm)?;
        inside(self.axis, along, "the approach to the datum", self.datum_mm - self.overrun_mm)?;
        inside(self.axis, along, "the datum", self.datum_mm)?;
        inside(other, travel_mm[other.index()], "the measuring line", self.line_mm)
    }

    /// Everything that needs no knowledge of the stage.
    fn check_numbers(&self) -> Result<(), PlanFault> {
        if self.targets_mm.len() < 2 {
            return Err(PlanFault::TooFewTargets { found: self.targets_mm.len() });
        }
        let unsorted =
            self.targets_mm.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]) != Some(Ordering::Less));
        if let Some(&[previous_mm, target_mm]) = unsorted {
            return Err(PlanFault::Unsorted { target_mm, previous_mm });
        }
        if self.runs < 2 {
            return Err(PlanFault::TooFewRuns { found: self.runs });
        }
        if self.readings_per_point == 0 {
            return Err(PlanFault::NotAllowed { what: "the number of readings per point", value: 0.0 });
        }
        if self.overrun_mm.is_nan() || self.overrun_mm <= 0.0 {
            return Err(PlanFault::NotAllowed { what: "the overrun in mm", value: self.overrun_mm });
        }
        if !(self.dwell_s >= 0.0 && self.dwell_s.is_finite()) {
            return Err(PlanFault::NotAllowed { what: "the dwell in s", value: self.dwell_s });
        }
        Ok(())
    }

    /// Points that a complete measurement visits.
    pub fn points(&self) -> usize {
        2 * self.runs * self.targets_mm.len()
    }
}

fn inside(
    axis: Axis,
    [low_mm, high_mm]: [f64; 2],
    what: &'static str,
    position_mm: f64,
) -> Result<(), PlanFault> {
    if (low_mm..=high_mm).contains(&position_mm) {
        Ok(())
    } else {
        Err(PlanFault::OutOfTravel { what, axis, position_mm, low_mm, high_mm })
    }
}

/// How far a measurement has come: given to the caller after each point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Points read so far.
    pub done: usize,
    /// Points in all.
    pub total: usize,
    /// The point just read.
    pub point: PointRecord,
}

/// One point as it was read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PointRecord {
    /// Run, from 1.
    pub run: usize,
    /// Side it was approached from.
    pub approach: Approach,
    /// The target, mm.
    pub target_mm: f64,
    /// Mean of the instrument's readings, as a position, mm.
    pub actual_mm: f64,
    /// How the move ended.
    pub arrival: Arrival,
}

/// The thermometers at one moment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TemperatureRecord {
    /// Time since the measurement began, of the stage's own clock, s.
    pub elapsed_s: f64,
    /// Each thermometer in the order given, °C.
    pub celsius: Vec<f64>,
}

/// Everything a measurement found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measurement {
    /// The axis that moved.
    pub axis: Axis,
    /// Every point in the order of time.
    pub points: Vec<PointRecord>,
    /// Names of the thermometers.
    pub thermometers: Vec<String>,
    /// Temperatures before the first run and after each run.
    pub temperatures: Vec<TemperatureRecord>,
    /// Time of moves, settling and dwells, s.
    pub elapsed_s: f64,
    /// The readings as the file holds them.
    #[serde(skip)]
    pub readings: Readings,
}

impl Measurement {
    /// Mean over all thermometers and times, °C; none without a thermometer.
    pub fn mean_celsius(&self) -> Option<f64> {
        let all: Vec<f64> = self.temperatures.iter().flat_map(|t| t.celsius.iter().copied()).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    }
}

/// Why a measurement ended early. `S`, `I` and `T` are the errors of stage, instrument and thermometer.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError<S: Error, I: Error, T: Error> {
    /// The plan is impossible whatever the stage.
    #[error("the plan is impossible: {0}")]
    Plan(PlanFault),
    /// The stage failed.
    #[error("the stage failed on its way to {axis} = {position_mm} mm: {source}")]
    Stage {
        /// The axis that moved.
        axis: Axis,
        /// Where it was sent.
        position_mm: f64,
        /// The stage's own reason.
        source: S,
    },
    /// The instrument failed.
    #[error("the instrument failed at {axis} = {position_mm} mm: {source}")]
    Instrument {
        /// The measured axis.
        axis: Axis,
        /// Where the stage stood.
        position_mm: f64,
        /// The instrument's own reason.
        source: I,
    },
    /// A thermometer failed.
    #[error("the thermometer `{name}` failed: {source}")]
    Thermometer {
        /// Its name.
        name: String,
        /// Its own reason.
        source: T,
    },
    /// The readings make no sense: a value that is not finite.
    #[error("the readings cannot be used: {0}")]
    Readings(ReadingsFault),
    /// The caller's progress function asked to stop.
    #[error("the measurement was stopped after {done} of {total} points")]
    Stopped {
        /// Points read.
        done: usize,
        /// Points planned.
        total: usize,
    },
}

type Failure<S, I, T> =
    MeasureError<<S as Stage>::Error, <I as Instrument>::Error, <T as Thermometer>::Error>;

/// Measures one axis as `plan` says; `progress` hears of every point and may stop the work.
///
/// The plan is checked except for the travel, which only the stage knows: call [`Plan::check`] first to refuse early.
///
/// # Errors
/// [`MeasureError`], with the reason of whoever failed. What was read until then is lost.
pub fn measure<S: Stage, I: Instrument, T: Thermometer>(
    plan: &Plan,
    stage: &mut S,
    instrument: &mut I,
    thermometers: &mut [T],
    mut progress: impl FnMut(Progress) -> ControlFlow<()>,
) -> Result<Measurement, Failure<S, I, T>> {
    plan.check_numbers().map_err(MeasureError::Plan)?;
    let mut bench = Bench { plan, stage, instrument, thermometers, elapsed_s: 0.0 };
    let total = plan.points();
    let mut points = Vec::with_capacity(total);
    bench.zero_at_datum()?;
    let mut temperatures = vec![bench.temperatures()?];
    for run in 1..=plan.runs {
        for approach in Approach::BOTH {
            bench.go(beyond(plan, approach))?;
            for target_mm in in_order(plan, approach) {
                let point = bench.point(run, approach, target_mm)?;
                points.push(point);
                let done = points.len();
                if progress(Progress { done, total, point }).is_break() {
                    return Err(MeasureError::Stopped { done, total });
                }
            }
        }
        temperatures.push(bench.temperatures()?);
    }
    Ok(Measurement {
        axis: plan.axis,
        readings: readings(plan, &points).map_err(MeasureError::Readings)?,
        thermometers: bench.thermometers.iter().map(|t| t.name().to_owned()).collect(),
        temperatures,
        elapsed_s: bench.elapsed_s,
        points,
    })
}

/// Where an approach begins: outside the targets by the overrun.
fn beyond(plan: &Plan, approach: Approach) -> f64 {
    match approach {
        Approach::Up => plan.targets_mm[0] - plan.overrun_mm,
        Approach::Down => plan.targets_mm[plan.targets_mm.len() - 1] + plan.overrun_mm,
    }
}

fn in_order(plan: &Plan, approach: Approach) -> Vec<f64> {
    let mut targets = plan.targets_mm.clone();
    if approach == Approach::Down {
        targets.reverse();
    }
    targets
}

/// Points in the order of time, sorted into targets and runs.
fn readings(plan: &Plan, points: &[PointRecord]) -> Result<Readings, ReadingsFault> {
    let rows = |approach| -> Vec<Vec<f64>> {
        let at =
            |target_mm| points.iter().filter(move |p| p.approach == approach && p.target_mm == target_mm);
        plan.targets_mm.iter().map(|&target_mm| at(target_mm).map(|p| p.actual_mm).collect()).collect()
    };
    Readings::new(&plan.targets_mm, &rows(Approach::Up), &rows(Approach::Down))
}

/// Stage and instruments during one measurement.
struct Bench<'a, S, I, T> {
    plan: &'a Plan,
    stage: &'a mut S,
    instrument: &'a mut I,
    thermometers: &'a mut [T],
    elapsed_s: f64,
}

impl<S: Stage, I: Instrument, T: Thermometer> Bench<'_, S, I, T> {
    /// One datum for all runs: readings are positions, and drift between runs stays in them.
    fn zero_at_datum(&mut self) -> Result<(), Failure<S, I, T>> {
        let datum_mm = self.plan.datum_mm;
        self.go(datum_mm - self.plan.overrun_mm)?;
        self.go(datum_mm)?;
        self.rest(datum_mm)?;
        self.instrument.set_zero().map_err(|source| self.instrument_failed(datum_mm, source))
    }

    fn point(
        &mut self,
        run: usize,
        approach: Approach,
        target_mm: f64,
    ) -> Result<PointRecord, Failure<S, I, T>> {
        let arrival = self.go(target_mm)?;
        self.rest(target_mm)?;
        let displacement_um = self.read_mean_um(target_mm)?;
        let actual_mm = self.plan.datum_mm + displacement_um / 1e3;
        Ok(PointRecord { run, approach, target_mm, actual_mm, arrival })
    }

    fn go(&mut self, position_mm: f64) -> Result<Arrival, Failure<S, I, T>> {
        let axis = self.plan.axis;
        let place = axis.position(position_mm, self.plan.line_mm);
        let moved = self.stage.move_to(place);
        let arrival = moved.map_err(|source| MeasureError::Stage { axis, position_mm, source })?;
        self.elapsed_s += arrival.moved_s + arrival.settle_s;
        Ok(arrival)
    }

    fn rest(&mut self, position_mm: f64) -> Result<(), Failure<S, I, T>> {
        let axis = self.plan.axis;
        let rested = self.stage.dwell(self.plan.dwell_s);
        rested.map_err(|source| MeasureError::Stage { axis, position_mm, source })?;
        self.elapsed_s += self.plan.dwell_s;
        Ok(())
    }

    fn read_mean_um(&mut self, position_mm: f64) -> Result<f64, Failure<S, I, T>> {
        let mut sum = 0.0;
        for _ in 0..self.plan.readings_per_point {
            let read = self.instrument.read_um();
            sum += read.map_err(|source| self.instrument_failed(position_mm, source))?;
        }
        Ok(sum / self.plan.readings_per_point as f64)
    }

    fn temperatures(&mut self) -> Result<TemperatureRecord, Failure<S, I, T>> {
        let mut celsius = Vec::with_capacity(self.thermometers.len());
        for thermometer in &mut *self.thermometers {
            let read = thermometer.read_c();
            let name = || thermometer.name().to_owned();
            celsius.push(read.map_err(|source| MeasureError::Thermometer { name: name(), source })?);
        }
        Ok(TemperatureRecord { elapsed_s: self.elapsed_s, celsius })
    }

    fn instrument_failed(&self, position_mm: f64, source: I::Error) -> Failure<S, I, T> {
        MeasureError::Instrument { axis: self.plan.axis, position_mm, source }
    }
}
