//! The edge of the world: everything one tick may see, and everything it may do.
//!
//! These types are public, versioned and small, so that anyone can drive [`crate::Controller::tick`] with a plant
//! of his own. Units are those of the hardware: counts, pulses, converter codes.

/// Version of the two types below; it changes whenever a recorded run of one could not be read as the other.
pub const EDGE_VERSION: u16 = 1;

/// The two samples of an analogue encoder, taken at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SinCos {
    /// Sine channel, converter code, full scale ±2¹⁵.
    pub sin: i16,
    /// Cosine channel, converter code, full scale ±2¹⁵.
    pub cos: i16,
}

/// What a tick sees of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisInputs {
    /// The hardware counter after 4× decoding; it wraps.
    pub counter: u32,
    /// Illegal transitions (both channels at once) since the last tick.
    pub illegal: u16,
    /// Pulses shorter than the digital filter passes, since the last tick.
    pub glitches: u16,
    /// The counter's value latched at the reference mark, when it was passed since the last tick.
    pub index: Option<u32>,
    /// Sine and cosine, if the axis has an analogue encoder.
    pub sin_cos: Option<SinCos>,
    /// Step pulses emitted so far, signed; it wraps.
    pub pulses: i32,
    /// The switch at the low end is pressed.
    pub limit_low: bool,
    /// The switch at the high end is pressed.
    pub limit_high: bool,
    /// The power stage reports a fault.
    pub drive_fault: bool,
}

/// What a tick sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Inputs<const N: usize> {
    /// Number of this tick; consecutive ticks count up by one and wrap.
    pub tick: u32,
    /// Each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub axes: [AxisInputs; N],
    /// The emergency stop is pressed.
    pub emergency_stop: bool,
    /// Joystick deflection x, y; full scale ±2¹⁵.
    pub joystick: [i16; 2],
    /// Key matrix columns read for the row that [`Outputs::key_row`] selected, one bit each.
    pub key_columns: u8,
    /// The trigger input.
    pub trigger: bool,
    /// Temperatures, millikelvin above 0 °C: scale, structure.
    pub temperatures_mk: [i32; 2],
    /// Ticks since the host last spoke.
    pub heartbeat_age: u32,
}

impl<const N: usize> Inputs<N> {
    /// A stage at rest at counter zero with nothing pressed.
    pub fn at_rest(tick: u32) -> Self {
        Self {
            tick,
            axes: [AxisInputs::default(); N],
            emergency_stop: false,
            joystick: [0; 2],
            key_columns: 0,
            trigger: false,
            temperatures_mk: [20_000; 2],
            heartbeat_age: 0,
        }
    }
}

/// A rate of step pulses: pulses per tick, 16 fractional bits, signed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepRate(pub i32);

/// What the power stage of an axis is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Actuation {
    /// Step pulses for a stepper.
    Steps(StepRate),
    /// Duty of an H-bridge, full scale ±2¹⁵.
    Pwm(i16),
}

/// What a tick does to one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisOutputs {
    /// The motor.
    pub actuation: Actuation,
    /// Code of the piezo's converter; 0 on an axis without one.
    pub piezo: u16,
    /// The power stage is on. When false there is no torque and there are no pulses.
    pub enable: bool,
}

impl AxisOutputs {
    /// No torque, no pulses.
    pub const OFF: Self = Self { actuation: Actuation::Steps(StepRate(0)), piezo: 0, enable: false };
}

/// What a tick does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Outputs<const N: usize> {
    /// Each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub axes: [AxisOutputs; N],
    /// Counter value of axis 0 at which the front end fires the camera, if armed.
    pub compare: Option<u32>,
    /// The trigger output.
    pub trigger: bool,
    /// Key matrix row to select, one bit each.
    pub key_row: u8,
    /// Bytes for the character display, sent one nibble pair a tick; 0 sends nothing.
    pub display: u8,
    /// The lamp.
    pub lamp: bool,
}

impl<const N: usize> Outputs<N> {
    /// Everything off.
    pub const OFF: Self = Self {
        axes: [AxisOutputs::OFF; N],
        compare: None,
        trigger: false,
        key_row: 0,
        display: 0,
        lamp: false,
    };
}
