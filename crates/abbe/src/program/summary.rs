//! What a program is in figures.

use super::course::Course;
use abbe_core::Pos;
use abbe_proto::gcode::{Action, Effect, Flow, Path, Rate};

/// What a motion is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2, G3.
    Arc,
    /// G5.5.
    Sine,
    /// G28, G30.
    Reference,
}

impl Kind {
    pub(crate) const ALL: [Self; 5] = [Self::Rapid, Self::Line, Self::Arc, Self::Sine, Self::Reference];

    /// In a document.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Rapid => "rapid",
            Self::Line => "line",
            Self::Arc => "arc",
            Self::Sine => "sine",
            Self::Reference => "reference",
        }
    }

    pub(super) fn of(action: &Action) -> Option<Self> {
        match action {
            Action::Reference { .. } => Some(Self::Reference),
            Action::Move(there) => Some(match (there.path, there.rate) {
                (Path::Line, Rate::Rapid) => Self::Rapid,
                (Path::Line, _) => Self::Line,
                (Path::Arc(_), _) => Self::Arc,
                (Path::Sine(_), _) => Self::Sine,
            }),
            Action::Dwell { .. } | Action::Stored(_) => None,
        }
    }
}

/// Motions of a kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motions {
    pub(crate) count: u64,
    /// Along their paths.
    pub(crate) length_mm: f64,
}

/// A program in figures.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Summary {
    /// Lines read; those behind its end do not count.
    pub(crate) lines: u64,
    motions: [Motions; Kind::ALL.len()],
    /// Lowest and highest place of x and y to which a motion comes; none if nothing moves.
    pub(crate) extents: Option<[[Pos; 2]; 2]>,
    /// How often it waits for a time.
    pub(crate) dwells: u64,
    dwell_ns: u128,
    /// How often it waits for the user.
    pub(crate) pauses: u64,
    /// It ends with M2 or M30.
    pub(crate) ends: bool,
}

impl Summary {
    pub(crate) fn motions(&self, kind: Kind) -> Motions {
        self.motions[kind as usize]
    }

    /// All motions.
    pub(crate) fn all(&self) -> Motions {
        self.motions.iter().fold(Motions::default(), |all, each| Motions {
            count: all.count + each.count,
            length_mm: all.length_mm + each.length_mm,
        })
    }

    /// How long it waits, s.
    pub(crate) fn dwell_s(&self) -> f64 {
        self.dwell_ns as f64 / 1e9
    }

    /// Adds a block.
    pub(super) fn add(&mut self, effect: &Effect, course: Option<&Course>) {
        if let Some(Action::Dwell { nanoseconds }) = effect.action {
            self.dwells += 1;
            self.dwell_ns += u128::from(nanoseconds);
        }
        self.pauses += u64::from(effect.flow == Some(Flow::Pause));
        self.ends |= effect.flow == Some(Flow::End);
        if let Some((kind, course)) = effect.action.as_ref().and_then(Kind::of).zip(course) {
            let motions = &mut self.motions[kind as usize];
            motions.count += 1;
            motions.length_mm += course.length_mm;
            self.stretch(course);
        }
    }

    fn stretch(&mut self, course: &Course) {
        let new = [0, 1].map(|axis| course.reach.0[axis].map(|point| point.place[axis]));
        let old = self.extents.unwrap_or(new);
        self.extents =
            Some([0, 1].map(|axis| [old[axis][0].min(new[axis][0]), old[axis][1].max(new[axis][1])]));
    }
}
