//! A whole program step by step on paper: how many steps, how far beside the path, how long.

use super::pace::{Pace, ticks_of};
use super::picture::Picture;
use super::trace::Trace;
use super::truth::Truth;
use super::walk::{Begun, NoSteps, Walk, distance};
use super::{Grid, as_floats};
use crate::failure::Failure;
use crate::interrupt;
use crate::preset::Preset;
use crate::program::check::{Check, Checked, Found, What};
use crate::program::course::curve;
use crate::program::lines::Lines;
use crate::program::summary::Kind;
use crate::program::travel::Travel;
use abbe_core::Pos;
use abbe_core::command::axis_name;
use abbe_core::plan::compare::Axis;
use abbe_core::plan::{Limits, LinePlan};
use abbe_core::units::{Counts, PM_PER_MM};
use abbe_proto::gcode::{Action, Move, Place, Rate};
use std::fmt;
use std::io::BufRead;

/// So many motions are told one by one.
pub(crate) const MOST: usize = 40;
/// Steps between two looks for Ctrl-C.
const LOOK_STEPS: u64 = 1 << 20;

/// Why a motion cannot be gone through step by step; a step in µm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    NoSteps {
        why: NoSteps,
        step_um: f64,
    },
    /// A point of the steps lies beyond the travel.
    OutOfTravel {
        axis: usize,
        at: Pos,
        step_um: f64,
    },
    /// Steps would begin before the last has ended.
    Fast {
        feed_mm_s: f64,
        most_mm_s: f64,
        step_um: f64,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSteps { why, step_um } => write!(f, "in steps of {step_um} µm: {why}"),
            Self::OutOfTravel { axis, at, step_um } => write!(
                f,
                "steps of {step_um} µm lead to {} = {:.6} mm of the machine, beyond the travel; correct the path or take \
                 other steps",
                axis_name(*axis),
                at.mm()
            ),
            Self::Fast { feed_mm_s, most_mm_s, step_um } => write!(
                f,
                "the feed of {feed_mm_s:.6} mm/s is more than {most_mm_s:.6} mm/s, at which steps of {step_um} µm start \
                 and stop within the limits of the stage; lower F to {:.4} mm/min, or take larger steps",
                // Never above it.
                (most_mm_s * 60e4).floor() / 1e4
            ),
        }
    }
}

/// A motion in steps.
#[derive(Clone, Debug)]
pub(crate) struct Stepped {
    pub(crate) line: u64,
    pub(crate) kind: Kind,
    /// Of x and y.
    pub(crate) steps: [u64; 2],
    /// The largest distance of a point from the true path, in steps, and what it is at most.
    pub(crate) beside: f64,
    pub(crate) bound: f64,
    /// It ends in the point of the steps that is nearest to its end.
    pub(crate) is_exact: bool,
    pub(crate) end: Place,
    pub(crate) chords: Option<Divided>,
    /// Along the true path, mm and mm/s.
    pub(crate) length_mm: f64,
    pub(crate) feed_mm_s: f64,
    /// At most, with steps that start and stop.
    pub(crate) start_stop_mm_s: f64,
    pub(crate) time_s: f64,
}

/// A sine in chords.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Divided {
    pub(crate) count: u64,
    pub(crate) per_period: u32,
    /// How far a chord is from its sine at most, in steps.
    pub(crate) farthest: f64,
}

/// A program in steps.
#[derive(Debug)]
pub(crate) struct Survey {
    pub(crate) checked: Checked,
    pub(crate) grid: Grid,
    /// The first [`MOST`] motions.
    pub(crate) told: Vec<Stepped>,
    pub(crate) others: u64,
    pub(crate) steps: [u64; 2],
    pub(crate) beside: f64,
    /// The largest of all.
    pub(crate) bound: f64,
    pub(crate) chords: u64,
    /// Every motion ends as [`Stepped::is_exact`] says.
    pub(crate) is_exact: bool,
    /// With rapids and waits.
    pub(crate) time_s: f64,
    /// Motions that are faster than their steps can start and stop, and the first of them.
    pub(crate) fast: u64,
    pub(crate) first_fast: Option<(u64, Fault)>,
}

/// Goes through a program step by step.
pub(crate) struct Surveyor<'a> {
    check: Check,
    survey: Survey,
    limits: [Limits; 2],
    tick_hz: f64,
    rate: f64,
    pace: Pace,
    /// Lowest and highest point of x and y.
    travel: [[i64; 2]; 2],
    /// A stage will go: steps that it cannot go are errors.
    moves: bool,
    trace: Option<&'a mut Trace>,
    picture: Option<&'a mut Picture>,
    time_s: f64,
}

impl<'a> Surveyor<'a> {
    /// For a program at so many percent of its feeds.
    pub(crate) fn new(preset: &Preset, percent: u16, grid: Grid, moves: bool) -> Self {
        let check = Check::new(preset, percent);
        let controller = &preset.controller;
        let limits = controller.config.axes.map(|axis| axis.limits);
        let step = grid.step().pm();
        let travel = Travel::of(preset).0;
        let survey = Survey {
            checked: Check::new(preset, percent).checked,
            grid,
            told: Vec::new(),
            others: 0,
            steps: [0; 2],
            beside: 0.0,
            bound: 0.0,
            chords: 0,
            is_exact: true,
            time_s: 0.0,
            fast: 0,
            first_fast: None,
        };
        Self {
            check,
            survey,
            limits,
            tick_hz: controller.settings.tick_hz,
            rate: f64::from(percent) / 100.0,
            pace: Pace::new(&grid, limits),
            travel: travel.map(|[low, high]| [-(-low.pm()).div_euclid(step), high.pm().div_euclid(step)]),
            moves,
            trace: None,
            picture: None,
            time_s: 0.0,
        }
    }

    /// Shows the steps to a file and to a picture, too.
    pub(crate) fn showing(mut self, trace: Option<&'a mut Trace>, picture: Option<&'a mut Picture>) -> Self {
        (self.trace, self.picture) = (trace, picture);
        self
    }

    /// # Errors
    /// The program cannot be read to its end, the trace not be written, or Ctrl-C.
    pub(crate) fn run<R: BufRead>(
        mut self,
        start: Place,
        mut lines: Lines<'_, R>,
        name: &str,
    ) -> Result<Survey, Failure> {
        self.come_to(self.survey.grid.nearest(start))?;
        while let Some(line) = lines.next().map_err(|error| error.of(name))? {
            let looked = self.check.line(&line);
            if let Some(action) = looked.effect.and_then(|effect| effect.action) {
                self.act(line.number, &action)?;
            }
            if looked.is_last {
                break;
            }
        }
        let Self { check, mut survey, time_s, .. } = self;
        (survey.checked, survey.time_s) = (check.checked, time_s);
        Ok(survey)
    }

    fn act(&mut self, line: u64, action: &Action) -> Result<(), Failure> {
        match action {
            Action::Move(there) if there.rate == Rate::Rapid => self.rapid(line, there.from, there.to),
            Action::Move(there) if there.from == there.to && !is_bent(there) => Ok(()),
            Action::Move(there) => self.motion(line, there, action),
            Action::Reference { from, via, to } => {
                self.rapid(line, *from, *via)?;
                self.rapid(line, *via, *to)
            }
            Action::Dwell { nanoseconds } => {
                self.time_s += *nanoseconds as f64 / 1e9;
                Ok(())
            }
            Action::Stored(_) => Ok(()),
        }
    }

    /// As fast as the limits allow, to a point of the steps.
    fn rapid(&mut self, line: u64, from: Place, to: Place) -> Result<(), Failure> {
        let grid = self.survey.grid;
        let [begin, end] = [from, to].map(|place| grid.nearest(place));
        if let Some(fault) = self.beyond(end) {
            self.find(line, fault);
            return Ok(());
        }
        let ticks = LinePlan::new(grid.place(begin), grid.place(end), &self.limits).ticks();
        self.time_s += f64::from(ticks) / self.tick_hz;
        self.come_to(end)
    }

    /// Where no steps lead.
    fn come_to(&mut self, point: [Counts; 2]) -> Result<(), Failure> {
        if let Some(picture) = &mut self.picture {
            picture.come_to(as_floats(point));
        }
        let place = self.survey.grid.place(point);
        self.trace.as_mut().map_or(Ok(()), |trace| trace.come_to(self.time_s, place))
    }

    fn motion(&mut self, line: u64, there: &Move, action: &Action) -> Result<(), Failure> {
        let (Some(curve), Some(kind)) = (curve(there), Kind::of(action)) else { return Ok(()) };
        let grid = self.survey.grid;
        let length_um = curve.length() * 1e-6;
        let begun = match Walk::begin(there, &grid, length_um) {
            Ok(begun) => begun,
            Err(why) => {
                self.find(line, Fault::NoSteps { why, step_um: grid.step().um() });
                return Ok(());
            }
        };
        let time_s = ticks_of(there, &curve, &self.limits, self.tick_hz, self.rate) / self.tick_hz;
        let (steps, beside, last) = self.walk(line, there, &begun, time_s)?;
        let least_s = self.pace.least(steps) * (steps[0] + steps[1]) as f64 / self.tick_hz;
        let length_mm = curve.length() / PM_PER_MM;
        let chords = begun.chords.map(|chords| Divided {
            count: chords.remaining(),
            per_period: chords.per_period(),
            farthest: chords.farthest(),
        });
        let stepped = Stepped {
            line,
            kind,
            steps,
            beside,
            bound: begun.bound,
            is_exact: last == grid.nearest(there.to),
            end: grid.place(last),
            chords,
            length_mm,
            feed_mm_s: length_mm / time_s,
            start_stop_mm_s: length_mm / least_s,
            time_s,
        };
        self.add(stepped);
        Ok(())
    }

    /// Steps of the axes, the largest distance from the true path, and the last point.
    fn walk(
        &mut self,
        line: u64,
        there: &Move,
        begun: &Begun,
        time_s: f64,
    ) -> Result<([u64; 2], f64, [Counts; 2]), Failure> {
        let grid = self.survey.grid;
        let truth = Truth::of(there, &grid, begun.chords.as_ref());
        let each_s = time_s / begun.walk.clone().count().max(1) as f64;
        if let Some(picture) = &mut self.picture {
            picture.begin(truth.ends()[0], is_bent(there));
        }
        let (mut walk, mut steps, mut beside, mut is_out) = (begun.walk.clone(), [0_u64; 2], 0.0_f64, false);
        while let Some(step) = walk.next() {
            steps[step.axis.index()] += 1;
            let done = steps[0] + steps[1];
            let point = as_floats(walk.at());
            let nearest = truth.nearest(point, walk.chord());
            beside = beside.max(distance(point, nearest));
            if !is_out && let Some(fault) = self.beyond(walk.at()) {
                is_out = true;
                self.find(line, fault);
            }
            if let Some(trace) = &mut self.trace {
                trace.step(self.time_s + each_s * done as f64, grid.place(walk.at()))?;
            }
            if let Some(picture) = &mut self.picture {
                picture.step(point, nearest, step);
            }
            if done.is_multiple_of(LOOK_STEPS) {
                interrupt::check()?;
            }
        }
        self.time_s += time_s;
        Ok((steps, beside, walk.at()))
    }

    /// A point outside the travel.
    fn beyond(&self, point: [Counts; 2]) -> Option<Fault> {
        let axis = (0..2).find(|&axis| {
            let [low, high] = self.travel[axis];
            !(low..=high).contains(&point[axis].get())
        })?;
        let grid = self.survey.grid;
        Some(Fault::OutOfTravel { axis, at: grid.place(point)[axis], step_um: grid.step().um() })
    }

    fn add(&mut self, stepped: Stepped) {
        if stepped.feed_mm_s > stepped.start_stop_mm_s * (1.0 + 1e-9) {
            let fault = Fault::Fast {
                feed_mm_s: stepped.feed_mm_s,
                most_mm_s: stepped.start_stop_mm_s,
                step_um: self.survey.grid.step().um(),
            };
            if self.moves {
                self.find(stepped.line, fault);
            }
            self.survey.fast += 1;
            self.survey.first_fast.get_or_insert((stepped.line, fault));
        }
        let survey = &mut self.survey;
        for axis in [Axis::X, Axis::Y] {
            survey.steps[axis.index()] += stepped.steps[axis.index()];
        }
        survey.beside = survey.beside.max(stepped.beside);
        survey.bound = survey.bound.max(stepped.bound);
        survey.chords += stepped.chords.map_or(0, |chords| chords.count);
        survey.is_exact &= stepped.is_exact;
        if survey.told.len() < MOST { survey.told.push(stepped) } else { survey.others += 1 }
    }

    fn find(&mut self, line: u64, fault: Fault) {
        self.check.find(Found { line, column: None, what: What::Stepwise(fault) });
    }
}

fn is_bent(there: &Move) -> bool {
    !matches!(there.path, abbe_proto::gcode::Path::Line)
}
