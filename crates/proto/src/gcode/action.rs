//! What a block asks of a stage. Places are in the stage frame, all offsets done.

use super::number::Number;
use abbe_core::Pos;

/// A place, x and y.
pub type Place = [Pos; 2];

/// What a block gives: something to do first, and where the program goes then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effect {
    /// To be done.
    pub action: Option<Action>,
    /// Behind it.
    pub flow: Option<Flow>,
}

/// Something to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Waits at rest.
    Dwell {
        /// How long, ns.
        nanoseconds: u64,
    },
    /// Goes along a path.
    Move(Move),
    /// Goes to a reference as fast as the limits allow.
    Reference {
        /// Where it stands.
        from: Place,
        /// First here, along a line.
        via: Place,
        /// Then here, along a line.
        to: Place,
    },
    /// Something was set that a controller may want to keep; nothing moves.
    Stored(Stored),
}

/// A motion from where the last one ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Move {
    /// Where it begins.
    pub from: Place,
    /// Where it ends.
    pub to: Place,
    /// What lies between.
    pub path: Path,
    /// How fast.
    pub rate: Rate,
    /// How the corner at its end is passed.
    pub corner: Corner,
}

/// The shape of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// Straight.
    Line,
    /// An arc, at most one turn.
    Arc(Arc),
    /// A sine about the straight line between the ends.
    Sine(Sine),
}

/// An arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arc {
    /// Its centre. From I and J exactly; from R within a picometre in x and y.
    pub centre: Place,
    /// Its sense.
    pub turn: Turn,
    /// A whole turn: it ends where it begins. Otherwise it is less than one.
    pub full: bool,
    /// Distance of the end from the centre less that of the beginning: what rounded numbers leave, within
    /// [`slack`](super::slack).
    pub mismatch: Pos,
}

/// The sense of an arc, seen with x to the right and y up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// G2.
    Clockwise,
    /// G3.
    Counterclockwise,
}

/// A sine about a line of length D: at the way s along it, the path lies
/// `amplitude · (sin(2π · periods · s / D + phase) − sin(phase))` to its left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sine {
    /// More than 0.
    pub amplitude: Pos,
    /// How often it repeats, 1 …; as it is whole, the path ends on the line.
    pub periods: u32,
    /// Degrees, 0 ≤ phase < 360.
    pub phase: Number,
}

/// How fast to go. A limit of the stage that is lower is the planner's business.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// As fast as the limits allow.
    Rapid,
    /// Length along the path in a minute, more than 0, mm/min when written with [`InMm`](abbe_core::units::InMm).
    PerMinute(Pos),
    /// 1/min, more than 0: the whole motion takes its inverse.
    Inverse(Number),
}

/// How a corner is passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corner {
    /// The stage stops in it.
    ExactStop,
    /// Rounded, at most so far off it (more than 0); nothing means as the stage is set.
    Blend(Option<Pos>),
}

/// What was set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stored {
    /// The origin of a coordinate system, from 0 for G54.
    Origin {
        /// Which.
        system: u8,
        /// Where it lies.
        origin: Place,
    },
    /// A reference, 0 for G28 and 1 for G30.
    Reference {
        /// Which.
        number: u8,
        /// Where it lies.
        place: Place,
    },
    /// The shift of G92; customarily forgotten at power-off.
    Shift(Place),
}

/// Where a program goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Waits for the user.
    Pause,
    /// Is at its end.
    End,
}
