//! The steps of a motion.

use super::{Grid, as_floats};
use abbe_core::plan::chords::{Chords, Swing, WaveError};
use abbe_core::plan::compare::{self, Circle, CircleError, Line, Step, TooFar};
use abbe_core::units::Counts;
use abbe_proto::gcode::{Arc, Move, Path, Sine, Turn};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2, TAU};
use std::fmt;

/// The ends of an arc may be so many steps farther from the centre than each other: the circle runs between them, and each
/// may lie a step beside it.
const MISMATCH: f64 = 2.0;

/// Why a motion has no steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum NoSteps {
    /// Both ends are one point of the grid. The length of the motion, µm.
    Short {
        um: f64,
    },
    /// The radius is less than a step, µm.
    Tight {
        um: f64,
    },
    /// The ends of an arc are not equally far from its centre, by so many steps.
    Unequal {
        steps: f64,
    },
    /// An arc of nearly a turn whose ends cross on the grid.
    Crossed,
    Circle(CircleError),
    Wave(WaveError),
    TooFar(TooFar),
}

impl fmt::Display for NoSteps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short { um } => {
                write!(f, "both ends of this motion of {um:.4} µm are one point of the steps")
            }
            Self::Tight { um } => write!(f, "the radius of {um:.4} µm is less than a step"),
            Self::Unequal { steps } => write!(
                f,
                "the ends of the arc are {steps:.1} steps unequally far from its centre, and its steps can join \
                 {MISMATCH} at most; correct I, J, X or Y, or take larger steps"
            ),
            Self::Crossed => f.write_str("the ends of the arc are too near each other for these steps"),
            Self::Circle(error) => error.fmt(f),
            Self::Wave(error) => error.fmt(f),
            Self::TooFar(error) => error.fmt(f),
        }?;
        if matches!(self, Self::Short { .. } | Self::Tight { .. } | Self::Crossed) {
            f.write_str("; take smaller steps")?;
        }
        Ok(())
    }
}

/// A motion that is gone through step by step.
#[derive(Clone, Debug)]
pub(crate) struct Walk {
    shape: Shape,
    at: [Counts; 2],
    /// Chords of a sine that were begun.
    chord: u64,
}

#[derive(Clone, Debug)]
enum Shape {
    Line(Line),
    Arc(compare::Arc),
    Sine { chords: Chords, line: Option<Line> },
}

/// A motion in steps, before the first one.
#[derive(Clone, Debug)]
pub(crate) struct Begun {
    pub(crate) walk: Walk,
    /// No step is farther beside the true path, in steps.
    pub(crate) bound: f64,
    pub(crate) chords: Option<Chords>,
}

impl Walk {
    /// The steps of a motion between the points of the grid that are nearest to its ends.
    ///
    /// # Errors
    /// There are none.
    pub(crate) fn begin(there: &Move, grid: &Grid, length_um: f64) -> Result<Begun, NoSteps> {
        let ends = [there.from, there.to].map(|end| grid.nearest(end));
        let is_turn = matches!(there.path, Path::Arc(arc) if sweep(there, &arc) > TAU / 2.0);
        if ends[0] == ends[1] && !is_turn {
            return Err(NoSteps::Short { um: length_um });
        }
        let (shape, bound) = match &there.path {
            Path::Line => line(there, grid, ends)?,
            Path::Arc(arc) => about(there, arc, grid, ends)?,
            Path::Sine(sine) => swinging(there, sine, grid, ends)?,
        };
        let chords = if let Shape::Sine { chords, .. } = &shape { Some(*chords) } else { None };
        Ok(Begun { walk: Self { shape, at: ends[0], chord: 0 }, bound, chords })
    }

    /// Where it is.
    pub(crate) fn at(&self) -> [Counts; 2] {
        self.at
    }

    /// The chord that it is on, from 1; of a line or an arc 0.
    pub(crate) fn chord(&self) -> u64 {
        self.chord
    }

    fn next_of_shape(&mut self) -> Option<Step> {
        match &mut self.shape {
            Shape::Line(line) => line.next_step(),
            Shape::Arc(arc) => arc.next_step(),
            Shape::Sine { chords, line } => loop {
                if let Some(step) = line.as_mut().and_then(Line::next_step) {
                    return Some(step);
                }
                *line = Some(chords.next_line()?);
                self.chord += 1;
            },
        }
    }
}

impl Iterator for Walk {
    type Item = Step;

    fn next(&mut self) -> Option<Step> {
        let step = self.next_of_shape()?;
        self.at = step.from(self.at);
        Some(step)
    }
}

/// How far the ends lie beside the points of the grid that stand for them, in steps.
fn rounding(there: &Move, grid: &Grid, ends: [[Counts; 2]; 2]) -> [f64; 2] {
    let off = |place, point| distance(grid.in_steps(place), as_floats(point));
    [off(there.from, ends[0]), off(there.to, ends[1])]
}

fn line(there: &Move, grid: &Grid, ends: [[Counts; 2]; 2]) -> Result<(Shape, f64), NoSteps> {
    let line = Line::new(ends[0], ends[1]).map_err(NoSteps::TooFar)?;
    let [begin, end] = rounding(there, grid, ends);
    Ok((Shape::Line(line), FRAC_1_SQRT_2 + begin.max(end)))
}

/// About the point of the grid that is nearest to the centre, or one beside it that suits the ends better where that must be.
fn about(there: &Move, arc: &Arc, grid: &Grid, ends: [[Counts; 2]; 2]) -> Result<(Shape, f64), NoSteps> {
    let true_centre = grid.in_steps(arc.centre);
    let true_radii = [there.from, there.to].map(|end| distance(grid.in_steps(end), true_centre));
    if true_radii[0].min(true_radii[1]) < 1.0 {
        return Err(NoSteps::Tight { um: true_radii[0].min(true_radii[1]) * grid.step().um() });
    }
    let centre = centre(grid.nearest(arc.centre), ends);
    let radii = ends.map(|end| distance(as_floats(end), as_floats(centre)));
    let mismatch = (radii[0] - radii[1]).abs();
    if mismatch > MISMATCH {
        return Err(NoSteps::Unequal { steps: mismatch });
    }
    let radius = f64::midpoint(radii[0], radii[1]);
    let circle = if mismatch == 0.0 {
        Circle::through(centre, ends[0])
    } else {
        Circle::with_square(centre, (radius * radius).round() as u64)
    };
    let circle = circle.map_err(NoSteps::Circle)?;
    let turn = match arc.turn {
        Turn::Clockwise => compare::Turn::Clockwise,
        Turn::Counterclockwise => compare::Turn::Counterclockwise,
    };
    let stepped = compare::Arc::new(&circle, ends[0], ends[1], turn).map_err(NoSteps::Circle)?;
    // Ends that were rounded past each other turn a short arc into nearly a circle, and the other way round.
    let (sweep, around) = (sweep(there, arc), 8.0 * radius);
    let steps = stepped.remaining() as f64;
    if sweep < TAU / 4.0 && steps > around / 2.0 + 4.0 {
        return Ok((line(there, grid, ends)?.0, MISMATCH));
    }
    if sweep > 0.75 * TAU && steps < around / 2.0 - 4.0 {
        return Err(NoSteps::Crossed);
    }
    let aside = distance(true_centre, as_floats(centre));
    let other = true_radii.map(|true_radius| (true_radius - radius).abs());
    let beside = (mismatch / 2.0).max(FRAC_1_SQRT_2);
    // Points may lie behind an end by what it is rounded.
    let [begin, end] = rounding(there, grid, ends);
    Ok((Shape::Arc(stepped), beside + aside + other[0].max(other[1]) + begin.max(end)))
}

/// The nearest point, unless the ends are too unequally far from it and less so from one of its neighbours.
fn centre(nearest: [Counts; 2], ends: [[Counts; 2]; 2]) -> [Counts; 2] {
    let mismatch = |centre: [Counts; 2]| {
        let [begin, end] = ends.map(|end| distance(as_floats(end), as_floats(centre)));
        (begin - end).abs()
    };
    if mismatch(nearest) <= MISMATCH {
        return nearest;
    }
    let aside = [-1, 0, 1].map(Counts::new);
    let beside = aside.iter().flat_map(|&x| aside.iter().map(move |&y| [nearest[0] + x, nearest[1] + y]));
    beside.min_by(|&one, &other| mismatch(one).total_cmp(&mismatch(other))).unwrap_or(nearest)
}

fn swinging(there: &Move, sine: &Sine, grid: &Grid, ends: [[Counts; 2]; 2]) -> Result<(Shape, f64), NoSteps> {
    let amplitude = sine.amplitude.pm() as f64 / grid.step().pm() as f64;
    // Less than 360 degrees.
    let phase = (sine.phase.billionths() as f64 / 360e9 * 4_294_967_296.0).round() as u64 as u32;
    let swing = Swing { to: ends[1], amplitude, periods: sine.periods, phase };
    let chords = Chords::swinging(&swing, ends[0], grid.tolerance()).map_err(NoSteps::Wave)?;
    let [begin, end] = rounding(there, grid, ends);
    // The line that it swings about is turned by what its ends are rounded, and with it the crests.
    let turned = 2.0 * amplitude * (begin + end) / distance(as_floats(ends[0]), as_floats(ends[1]));
    let phase = amplitude * TAU / 4_294_967_296.0;
    Ok((Shape::Sine { chords, line: None }, chords.farthest() + SQRT_2 + begin.max(end) + turned + phase))
}

/// The angle of an arc, rad: more than 0, at most a turn.
pub(super) fn sweep(there: &Move, arc: &Arc) -> f64 {
    if arc.full {
        return TAU;
    }
    let angle = |place: abbe_proto::gcode::Place| {
        let [x, y] = [0, 1].map(|axis| (place[axis] - arc.centre[axis]).pm() as f64);
        y.atan2(x)
    };
    let turned = angle(there.to) - angle(there.from);
    let turned = if arc.turn == Turn::Clockwise { -turned } else { turned };
    if turned > 0.0 { turned } else { turned + TAU }
}

pub(super) fn distance(one: [f64; 2], other: [f64; 2]) -> f64 {
    (one[0] - other[0]).hypot(one[1] - other[1])
}
