//! What may happen to a stage.

use crate::analogue::HeadEvent;

/// Something that happens to a stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Somebody pulls or plugs the encoder of an axis.
    Encoder {
        /// Which axis.
        axis: usize,
        /// Plugged in.
        connected: bool,
    },
    /// Something happens to an analogue head; a digital one refuses.
    Head {
        /// Which axis.
        axis: usize,
        /// What.
        event: HeadEvent,
    },
    /// Something blocks the slide, or lets it go.
    Jam {
        /// Which axis.
        axis: usize,
        /// Blocked.
        jammed: bool,
    },
    /// A steady force on a slide, N.
    Push {
        /// Which axis.
        axis: usize,
        /// Newton.
        newton: f64,
    },
    /// The low switch slips on its mount, µm.
    MoveSwitch {
        /// Which axis.
        axis: usize,
        /// Micrometres, positive towards the middle.
        um: f64,
    },
    /// The low switch breaks off: it never closes again.
    LoseSwitch {
        /// Which axis.
        axis: usize,
    },
    /// The emergency stop is pressed or pulled out.
    EmergencyStop {
        /// Pressed.
        pressed: bool,
    },
    /// The power stage of an axis reports a fault, or no longer.
    DriveFault {
        /// Which axis.
        axis: usize,
        /// Faulty.
        faulty: bool,
    },
    /// The controller misses ticks.
    SkipTicks {
        /// How many.
        ticks: u32,
    },
    /// The host falls silent or speaks again.
    HostSilent {
        /// Silent.
        silent: bool,
    },
}

/// Something was to happen to the signals of a head that has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the head of axis {} is digital: it has no sine and cosine that could fail", ["x", "y"].get(*.axis).unwrap_or(&"?"))]
pub struct DigitalHead {
    /// Which axis.
    pub axis: usize,
}
