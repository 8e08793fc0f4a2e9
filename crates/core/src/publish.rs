//! Publish: the snapshot that answers every question in constant time.

use crate::command::axis_name;
use crate::machine::State;
use crate::sense::health::{Report, SignalFault};
use crate::units::{InMm, InUm, Pos};
use core::fmt;

/// One end of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum End {
    /// The low end, where homing looks for the switch.
    Low,
    /// The high end.
    High,
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Low => "low",
            Self::High => "high",
        })
    }
}

/// Why an axis could not find its zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum HomingFailure {
    /// The switch did not close within the search distance.
    SwitchNotFound,
    /// The switch stayed closed while backing off.
    SwitchStuck,
    /// The reference mark was not passed within its distance.
    IndexNotFound,
}

impl fmt::Display for HomingFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SwitchNotFound => "the switch was not found within the search distance",
            Self::SwitchStuck => "the switch stays closed",
            Self::IndexNotFound => "the reference mark was not found behind the switch",
        })
    }
}

/// Why the drives were switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Fault {
    /// The emergency stop is pressed.
    EmergencyStop,
    /// Ticks were missed.
    TickOverrun {
        /// How many.
        missed: u32,
    },
    /// The host fell silent.
    HostGone,
    /// A move waited for its plan and none came.
    PlanMissing,
    /// The power stage of an axis reports a fault.
    DriveFault {
        /// Which axis.
        axis: usize,
    },
    /// A limit switch closed.
    LimitSwitch {
        /// Which axis.
        axis: usize,
        /// Which end.
        end: End,
    },
    /// The table left the travel.
    SoftLimit {
        /// Which axis.
        axis: usize,
        /// Where it is, stage frame.
        position: Pos,
    },
    /// The reading is too far from the set-point.
    FollowingError {
        /// Which axis.
        axis: usize,
        /// Set-point minus reading.
        error: Pos,
    },
    /// The motor was driven and the encoder did not move at all.
    EncoderLost {
        /// Which axis.
        axis: usize,
    },
    /// Too many illegal transitions.
    EncoderIllegal {
        /// Which axis.
        axis: usize,
        /// How many within a block of 256 ticks.
        transitions: u16,
    },
    /// The signals of an analogue encoder do not tell the position any more.
    Signal {
        /// Which axis.
        axis: usize,
        /// What they lack.
        what: SignalFault,
    },
    /// The motor lost steps.
    Stall {
        /// Which axis.
        axis: usize,
    },
    /// An axis did not find its zero.
    Homing {
        /// Which axis.
        axis: usize,
        /// What was missing.
        failure: HomingFailure,
    },
}

impl Fault {
    /// The one that decides how to stop, of two in the same tick: whatever must be cut comes before what may brake.
    #[must_use]
    pub const fn worse(first: Option<Self>, second: Option<Self>) -> Option<Self> {
        match (first, second) {
            (Some(one), Some(other)) if one.allows_braking() && !other.allows_braking() => Some(other),
            (Some(one), _) => Some(one),
            (None, other) => other,
        }
    }

    /// Whether the stage may brake on its path before it is switched off. Everything else is cut in the same tick.
    pub const fn allows_braking(&self) -> bool {
        matches!(self, Self::HostGone | Self::PlanMissing | Self::SoftLimit { .. } | Self::Homing { .. })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::EmergencyStop => write!(f, "emergency stop"),
            Self::TickOverrun { missed } => write!(f, "tick overrun, {missed} missed"),
            Self::HostGone => write!(f, "the host fell silent"),
            Self::PlanMissing => write!(f, "no plan came for the move"),
            Self::DriveFault { axis } => write!(f, "{}: the power stage reports a fault", axis_name(axis)),
            Self::LimitSwitch { axis, end } => write!(f, "{}: {end} limit switch", axis_name(axis)),
            Self::SoftLimit { axis, position } => {
                write!(f, "{}: the table at {} mm is outside the travel", axis_name(axis), InMm(position))
            }
            Self::FollowingError { axis, error } => {
                write!(f, "{}: following error {} µm", axis_name(axis), InUm(error))
            }
            Self::EncoderLost { axis } => {
                write!(f, "{}: the encoder does not move with the motor", axis_name(axis))
            }
            Self::EncoderIllegal { axis, transitions } => {
                write!(f, "{}: {transitions} illegal encoder transitions", axis_name(axis))
            }
            Self::Signal { axis, what } => write!(f, "{}: {what}", axis_name(axis)),
            Self::Stall { axis } => write!(f, "{}: the motor lost steps", axis_name(axis)),
            Self::Homing { axis, failure } => write!(f, "{}: homing: {failure}", axis_name(axis)),
        }
    }
}

/// What the last homing of an axis found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HomeReport {
    /// How many homings since power-on.
    pub count: u32,
    /// How far the zero lies from where the last homing found it: counts lost or gained since.
    pub zero_shift: Option<Pos>,
    /// Position of the switch from the zero.
    pub switch: Pos,
    /// How far the switch lies from where it closed last time.
    pub switch_shift: Option<Pos>,
}

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Outcome {
    /// Inside the window for the dwell time.
    Arrived,
    /// The window was not reached in time.
    NotArrived,
    /// Stopped on request.
    Stopped,
    /// Another target was given before.
    Replaced,
    /// Ended by a fault or by switching off.
    Aborted,
}

/// How the last move went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MoveReport {
    /// Its number.
    pub number: u32,
    /// How it ended.
    pub outcome: Outcome,
    /// Ticks from the request to the end of the path.
    pub path_ticks: u32,
    /// Ticks from the end of the path to the last entry into the window.
    pub settle_ticks: u32,
}

/// What is known of an axis.
#[allow(clippy::struct_excessive_bools, reason = "each is a lamp of its own on the panel")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisStatus {
    /// Where the table is: the reading through the error map.
    pub position: Pos,
    /// Where it is asked to be, this tick.
    pub set_point: Pos,
    /// Where the last move goes.
    pub target: Pos,
    /// The reading, scale frame.
    pub reading: Pos,
    /// Set-point minus reading, scale frame.
    pub following_error: Pos,
    /// Inside the in-position window now.
    pub in_window: bool,
    /// The zero is known.
    pub homed: bool,
    /// An error map is in use.
    pub mapped: bool,
    /// The low switch.
    pub limit_low: bool,
    /// The high switch.
    pub limit_high: bool,
    /// Illegal transitions since power-on.
    pub illegal: u32,
    /// Filtered pulses since power-on.
    pub glitches: u32,
    /// How often the zero of the scale was passed since it is known (row B5), by more than a count, so that a stage that
    /// rests on it does not pass it; wraps. Whoever wants the event of a crossing looks whether this has changed: one tick
    /// later at most. The sign of `reading` tells the direction.
    pub zero_crossings: u32,
    /// How good the signals are, if they are analogue.
    pub signals: Option<Report>,
    /// What the last homing found.
    pub home: HomeReport,
}

/// The snapshot of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Status<const N: usize> {
    /// Number of the tick.
    pub tick: u32,
    /// What the stage is doing.
    pub state: State,
    /// Why it is off, after a fault; kept until the reset.
    pub fault: Option<Fault>,
    /// Number of the last move begun.
    pub move_number: u32,
    /// How the last ended move went.
    pub last_move: Option<MoveReport>,
    /// A program rests until it is resumed.
    pub held: bool,
    /// Of programs, percent of what they ask for.
    pub feed_rate: u16,
    /// Each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub axes: [AxisStatus; N],
}
