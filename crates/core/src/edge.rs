//! The edge of the world: everything one tick may see, and everything it may do.
//!
//! These types are public, versioned and small, so that anyone can drive [`crate::Controller::tick`] with a plant
//! of his own. Units are those of the hardware: counts, pulses, converter codes.
//!
//! # Which way is up
//!
//! Each axis has one positive direction: away from the switch at the low end. A positive [`StepRate`] moves the table
//! that way, `pulses` count up with it, and `counter` counts up as the table goes there. With one of the three turned
//! round, the first motion ends in a following error, a stall, or at the wrong end. From low to high an axis has: the end
//! stop, the low switch (pressed from its point down to the stop), the reference mark, the travel, the high switch
//! (pressed from its point up). The mark lies where the low switch is free again, because the stage stands there after
//! homing, and at most `home_index_search_mm` above the switch.
//!
//! # What a plant does in a tick
//!
//! 1. It takes the [`Outputs`] of the last tick ([`Outputs::OFF`] before the first) and lives through one period of
//!    `tick_hz`: with `enable` it emits pulses at the given rate, evenly spaced, and keeps the part of a pulse that is
//!    left over for the next period; without `enable` there are no pulses and no torque.
//! 2. At the end of the period it reads all its sensors at one instant, as far as it can, and numbers the tick.
//! 3. [`tick`](crate::Controller::tick) turns these [`Inputs`] into new outputs, in force from now until the next ones.
//!
//! Between two ticks commands are given and plans are made ([`crate::background::advance`]). Nothing here reads a
//! clock: a plant may run faster or slower than life.
//!
//! # The least a plant must fill in
//!
//! Of [`Inputs`]: `tick`. Of [`AxisInputs`]: `counter`, `pulses`, `limit_low`, and in homing `index`. Everything else may
//! stay as [`Inputs::at_rest`] has it: no switch pressed, no fault, an undisturbed encoder. An axis that was designed with an
//! analogue encoder wants `sin_cos` in every tick. `joystick`, `key_columns`, `trigger` and `temperatures_mk` are not read by
//! this version, and of the outputs it only sets `actuation` ([`Actuation::Steps`], or [`Actuation::Pwm`] for an axis that was
//! designed with a DC motor) and `enable`.
//!
//! ```
//! use abbe_core::design::StageSettings;
//! use abbe_core::edge::{Actuation, AxisInputs, Inputs, Outputs, StepRate};
//! use abbe_core::{Command, Controller, Pos, background};
//!
//! /// A table that follows its pulses exactly: 312.5 nm each, counts of 0.1 µm, 3 mm above its mark at first.
//! struct Table {
//!     tick: u32,
//!     /// Pulses with 16 fractional bits.
//!     phase: i64,
//!     counter: i64,
//! }
//!
//! impl Table {
//!     fn step(&mut self, outputs: &Outputs<1>) -> Inputs<1> {
//!         if let Actuation::Steps(StepRate(rate)) = outputs.axes[0].actuation {
//!             self.phase += i64::from(rate);
//!         }
//!         let (before, pulses) = (self.counter, self.phase >> 16);
//!         self.counter = 30_000 + pulses * 3125 / 1000;
//!         self.tick = self.tick.wrapping_add(1);
//!         let axis = AxisInputs {
//!             counter: self.counter as u32,
//!             // The mark lies at count 0.
//!             index: ((before < 0) != (self.counter < 0)).then_some(0),
//!             pulses: pulses as i32,
//!             limit_low: self.counter < -20_000,
//!             ..AxisInputs::default()
//!         };
//!         Inputs { axes: [axis], ..Inputs::at_rest(self.tick) }
//!     }
//! }
//!
//! let mut table = Table { tick: 0, phase: 0, counter: 30_000 };
//! let mut controller = Controller::new(StageSettings::default().build()?);
//! let mut outputs = controller.tick(&table.step(&Outputs::OFF));
//! for command in [Command::Home, Command::MoveTo([Pos::from_mm(5.0)])] {
//!     controller.command(command)?;
//!     while controller.status().state.is_busy() {
//!         outputs = controller.tick(&table.step(&outputs));
//!         background::advance(&mut controller);
//!     }
//! }
//! assert_eq!(controller.status().fault, None);
//! assert!((table.counter - 50_000).abs() <= 5, "{}", table.counter);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A plant with mass, friction and backlash is in `examples/my_own_plant.rs`.

/// Version of the two types below; it changes whenever a recorded run of one could not be read as the other.
pub const EDGE_VERSION: u16 = 1;

/// The two samples of an analogue encoder, taken at one instant. A converter of fewer bits gives the upper ones.
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
    /// The hardware counter after decoding, counts of `count_um`, as it stands now; it wraps.
    ///
    /// It may begin anywhere: the first reading is where power-on is. Between two ticks it may move less than 2³¹ counts.
    /// It counts up in the positive direction (A rises while B is low).
    pub counter: u32,
    /// Illegal transitions (both channels at once) since the last tick. More than `illegal_transitions` in a block of 256
    /// ticks are a fault, and the zero is lost; with the drives off a single one costs the zero.
    pub illegal: u16,
    /// Pulses shorter than the digital filter passes, since the last tick. Only counted, for the status.
    pub glitches: u16,
    /// The counter's value latched at the reference mark, when it was passed since the last tick; else `None`.
    ///
    /// Each passage is told in one tick only, in whichever direction. Homing uses the one on its slow way up from the low
    /// switch and ignores the others, so it is there that the mark must repeat to the count. The value is that of
    /// `counter` at the mark itself, not at the tick.
    pub index: Option<u32>,
    /// Sine and cosine, sampled at the instant of `counter`, if the axis has an analogue encoder; `None` is a sample that was
    /// missed, eight in a row at most. `counter` counts the quarters of its period, unless it was designed without a counter:
    /// A is low while the cosine is positive, B while the sine is. Not read of an axis with square signals.
    pub sin_cos: Option<SinCos>,
    /// Step pulses emitted so far, signed: those up minus those down, since power-on; it wraps.
    ///
    /// Every pulse that left the emitter counts, also one that the motor did not follow: the difference to the counter
    /// is how a stall and a lost encoder are found. It should be of the same instant as `counter`. An age of k ticks looks
    /// like a slip of k ticks of travel (2 µm a tick at 20 mm/s and 10 kHz), which must stay far below `stall_um`.
    pub pulses: i32,
    /// The switch at the low end is pressed. The bare contact: bouncing is filtered inside (`switch_press_ms`,
    /// `switch_release_ms`). It stays pressed from its point to the end stop. Homing looks for it; at any other time it is
    /// a fault with the drives on. Wire it so that a broken wire reads as pressed.
    pub limit_low: bool,
    /// The switch at the high end is pressed; like `limit_low`. Homing may begin on it, but not come to it.
    pub limit_high: bool,
    /// The power stage reports a fault: cut in the same tick, also with the drives off.
    pub drive_fault: bool,
}

/// What a tick sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Inputs<const N: usize> {
    /// Number of this tick. The first may have any; each is one more than the last, and wraps. A gap or a repetition is a
    /// tick overrun: a fault that cuts. Plans name the tick at which they begin by this number.
    pub tick: u32,
    /// Each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub axes: [AxisInputs; N],
    /// The emergency stop is pressed: cut in the same tick. The stop itself must cut the drives in hardware.
    pub emergency_stop: bool,
    /// Joystick deflection x, y; full scale ±2¹⁵. Not read by this version.
    pub joystick: [i16; 2],
    /// Key matrix columns read for the row that [`Outputs::key_row`] selected, one bit each. Not read by this version.
    pub key_columns: u8,
    /// The trigger input. Not read by this version.
    pub trigger: bool,
    /// Temperatures, millikelvin above 0 °C: scale, structure. Not read by this version.
    pub temperatures_mk: [i32; 2],
    /// Ticks since the host last spoke. Read only with a `host_timeout_ms`; leave 0 without a host.
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

/// A rate of step pulses: pulses per tick, 16 fractional bits, signed; positive moves the table up.
///
/// 65 536 is one pulse a tick. The emitter adds the rate of every tick to a phase and emits a pulse whenever that passes a
/// whole number; what is left over stays in the phase, or the table would fall behind ([`crate::front::StepEmitter`] does
/// this). A rate changes from tick to tick by at most three times the acceleration of the settings, and is at most 1.2
/// times their speed.
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
    /// The motor, in force until the outputs of the next tick: what the axis was designed with.
    pub actuation: Actuation,
    /// Code of the piezo's converter; 0 on an axis without one.
    pub piezo: u16,
    /// The power stage is on. When false there is no torque and there are no pulses, at once: not at the end of a ramp.
    pub enable: bool,
}

impl AxisOutputs {
    /// No torque, no pulses.
    pub const OFF: Self = Self { actuation: Actuation::Steps(StepRate(0)), piezo: 0, enable: false };
}

/// What a tick does: in force from now until the outputs of the next tick.
///
/// A board writes its pins a tick later and reads its sensors a tick before; the default gains hold for that, and so for
/// a plant that is quicker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Outputs<const N: usize> {
    /// Each axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub axes: [AxisOutputs; N],
    /// Counter value of axis 0 at which the front end fires the camera, if armed. Never armed by this version.
    pub compare: Option<u32>,
    /// The trigger output: a place of position compare was passed.
    pub trigger: bool,
    /// Key matrix row to select, one bit each. Always 0 in this version.
    pub key_row: u8,
    /// Bytes for the character display, sent one nibble pair a tick; 0 sends nothing.
    pub display: u8,
    /// The lamp. Never on in this version.
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
