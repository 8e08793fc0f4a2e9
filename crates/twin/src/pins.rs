//! The twin by its wires: what a board's pins do, and what they see.
//!
//! [`Twin::step`] plays the front end of a board too: it counts the edges, and adds the delays of a board.
//! [`Twin::step_pins`] is the same stage without that: a real front end, or an emulated one, is at the other end of
//! the wires.

use crate::scale::Edge;
use crate::twin::Twin;

/// What a board does to the power stage of an axis in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    /// The power stage is on.
    pub enable: bool,
    /// Step pulses so far at the middle and at the end of the tick, signed by their direction; they wrap and begin at
    /// zero.
    pub pulses: [i32; 2],
    /// Duty of the bridge of a DC motor in this tick, full scale ±2¹⁵.
    pub duty: i16,
}

impl Drive {
    /// Off, and never a pulse yet.
    pub const OFF: Self = Self { enable: false, pulses: [0; 2], duty: 0 };
}

/// What a board sees of an axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AxisWires {
    /// Edges of the encoder lines in this tick, in the order of time. Several may share a clock when the stage is
    /// faster than a decoder could follow.
    pub edges: Vec<Edge>,
    /// The contact of the low switch, at the end of the tick.
    pub limit_low: bool,
    /// The contact of the high switch, at the end of the tick.
    pub limit_high: bool,
    /// The power stage reports a fault.
    pub drive_fault: bool,
}

/// What a board sees.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wires {
    /// Each axis.
    pub axes: [AxisWires; 2],
    /// The emergency stop is pressed.
    pub emergency_stop: bool,
}

impl Twin {
    /// One tick at the level of pins: what is driven acts at once, and what comes back is as old as its clock says.
    ///
    /// [`Twin::lines`] gives the levels before the first tick. Use either this or [`Twin::step`] on a stage, not both.
    pub fn step_pins(&mut self, drives: &[Drive; 2]) -> Wires {
        self.remember_edges();
        self.go_on(drives);
        Wires { axes: self.wires(), emergency_stop: self.emergency_stop() }
    }
}
