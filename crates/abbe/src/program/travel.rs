//! The travel of a stage, and motions that leave it.

use super::course::{How, Point, Reach};
use crate::preset::Preset;
use abbe_core::Pos;
use abbe_core::command::axis_name;
use abbe_proto::gcode::{Action, Block, Letter, Number, Path, Place};
use std::fmt;

/// Lowest and highest target of x and y, as a controller takes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Travel(pub(crate) [[Pos; 2]; 2]);

impl Travel {
    pub(crate) fn of(preset: &Preset) -> Self {
        Self(preset.controller.config.axes.each_ref().map(|axis| [axis.low, axis.high]))
    }

    /// Where a stage stands when a program begins: at zero, or at the end of the travel that is nearest to it.
    pub(crate) fn start(&self) -> Place {
        self.0.map(|[low, high]| Pos::ZERO.max(low).min(high))
    }

    /// For x and y, whether a place lies beyond the travel.
    pub(super) fn is_beyond(&self, place: Place) -> [bool; 2] {
        [0, 1].map(|axis| {
            let [low, high] = self.0[axis];
            place[axis] < low || place[axis] > high
        })
    }

    /// The same, with one more place on the axes in `open`: where the stage stands beyond and everybody knows.
    fn stretched(&self, place: Place, open: [bool; 2]) -> Self {
        Self([0, 1].map(|axis| {
            let [low, high] = self.0[axis];
            if open[axis] { [low.min(place[axis]), high.max(place[axis])] } else { [low, high] }
        }))
    }

    /// How a motion leaves the travel. On an axis in `known`, which the motion before has left beyond, only what leads
    /// farther out is told.
    pub(super) fn breaches(
        &self,
        from: Place,
        known: [bool; 2],
        reach: &Reach,
    ) -> impl Iterator<Item = Breach> {
        let allowed = self.stretched(from, known).0;
        let Self(travel) = *self;
        let one = move |axis: usize, point: Point, is_beyond: bool| {
            is_beyond.then_some(Breach { axis, point, travel: travel[axis] })
        };
        let each = reach.0.into_iter().enumerate().flat_map(move |(axis, [low, high])| {
            let [least, most] = allowed[axis];
            [one(axis, low, low.place[axis] < least), one(axis, high, high.place[axis] > most)]
        });
        each.flatten()
    }
}

/// A motion leaves the travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Breach {
    /// 0 for x, 1 for y.
    pub(crate) axis: usize,
    /// Where it is farthest out.
    pub(crate) point: Point,
    /// Of this axis.
    pub(crate) travel: [Pos; 2],
}

impl Breach {
    /// Where it is farthest out, on its axis.
    pub(crate) fn place(&self) -> Pos {
        self.point.place[self.axis]
    }

    /// The end of the travel that it passes.
    pub(crate) fn limit(&self) -> Pos {
        let [low, high] = self.travel;
        if self.place() < low { low } else { high }
    }

    /// The number of the block that leads there, if there is one.
    pub(super) fn column(&self, block: &Block) -> Option<u16> {
        let letters: &[Letter] = match (self.point.how, self.axis) {
            (How::Bulges, 0) => &[Letter::I, Letter::R, Letter::J],
            (How::Bulges, _) => &[Letter::J, Letter::R, Letter::I],
            (How::Swings, _) => &[Letter::P],
            (_, 0) => &[Letter::X],
            _ => &[Letter::Y],
        };
        letters.iter().find_map(|&letter| block.column_of(letter))
    }
}

/// A breach as a sentence, with the action that it belongs to.
pub(super) struct Told<'a>(pub(super) &'a Breach, pub(super) &'a Action);

impl fmt::Display for Told<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(breach, action) = *self;
        let [axis, other] = [breach.axis, 1 - breach.axis].map(axis_name);
        let what = match action {
            Action::Move(there) => match there.path {
                Path::Line => "the line",
                Path::Arc(_) => "the arc",
                Path::Sine(_) => "the sine",
            },
            _ => "the way to the reference",
        };
        let [place, elsewhere] = [breach.axis, 1 - breach.axis].map(|axis| mm(breach.point.place[axis]));
        let verb = match breach.point.how {
            How::Ends => "ends at",
            How::Passes => "leads through",
            How::Bulges => "bulges to",
            How::Swings => "swings to",
        };
        write!(f, "{what} {verb} {axis} = {place} mm of the machine")?;
        if matches!(breach.point.how, How::Bulges | How::Swings) {
            write!(f, ", at {other} = {elsewhere} mm")?;
        }
        let [low, high] = breach.travel.map(mm);
        let excess = mm((breach.place() - breach.limit()).abs());
        write!(f, ", {excess} mm beyond the travel of {low} … {high} mm; correct {}", mend(breach, action))
    }
}

fn mend(breach: &Breach, action: &Action) -> &'static str {
    match (breach.point.how, breach.axis, action) {
        (How::Bulges, ..) => "centre or radius, or the origin",
        (How::Swings, ..) => "P, or the origin",
        (How::Ends, _, Action::Reference { .. }) => "the reference",
        (_, 0, _) => "X, or the origin",
        _ => "Y, or the origin",
    }
}

/// To the picometre, with as many decimals as it takes: a billionth of a millimetre.
fn mm(place: Pos) -> Number {
    Number::from_billionths(place.pm())
}
