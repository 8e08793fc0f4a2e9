//! Every pin and every number of time on this board, with its reason, and the stage. The wiring: `docs/wiring.md`.

use abbe_core::design::{AxisSettings, StageSettings};

/// The stage: that of the preset `microscope-100`, which a test of the program holds to be the default one, but for what
/// this board's front end cannot do.
pub const STAGE: StageSettings<2> = StageSettings {
    axes: [AxisSettings { filter_ns: 0, ..AxisSettings::DEFAULT }; 2],
    ..StageSettings::DEFAULT
};
const _: () = can_be_set_up(&STAGE);

/// What another front end could be set to is refused here, when the image is built.
const fn can_be_set_up(stage: &StageSettings<2>) {
    let [x, y] = &stage.axes;
    assert!(
        x.decode == 4 && y.decode == 4,
        "decode must be 4 on both axes of this board: pio/decoder.pio counts every edge"
    );
    assert!(
        x.filter_ns == 0 && y.filter_ns == 0,
        "filter_ns must be 0 on both axes of this board: pio/decoder.pio has no filter, the RC at its inputs is one"
    );
}

// The processor's clock is what embassy sets up from the 12 MHz crystal, and the front end's clock.
pub use abbe_core::front::CLOCK_HZ;
/// A tick, µs: the preset `microscope-100` runs at 10 kHz.
pub const TICK_US: u32 = 100;
/// Clocks in a tick.
pub const TICK_CLOCKS: u32 = CLOCK_HZ / 1_000_000 * TICK_US;

/// The pulses of a tick begin so many clocks after it, so that the words for them are there whenever the tick's
/// interrupt was late by less: 20 µs, far more than fetching its code anew from the flash takes.
pub const PULSE_LEAD_CLOCKS: u32 = 2500;

/// The serial line, bit/s, 8 data bits, no parity, one stop bit.
pub const BAUD: u32 = 115_200;
/// Samples of the PIO receiver in a bit.
pub const SAMPLES_PER_BIT: u32 = 8;

/// How often the receiver's words are taken and the ticks are looked for, µs: five bytes at most, and it keeps eight.
pub const RECEIVE_US: u32 = 400;
/// How often core 0 looks into its queues, µs: two ticks. Between two looks it sleeps.
pub const POLL_US: u64 = 200;
/// So many looks of [`RECEIVE_US`] without a tick are a stall: 3.2 ms, in which a slide at full speed goes 0.06 mm.
pub const STALLED_LOOKS: u32 = 8;
/// How often core 0 feeds the watchdog, µs.
pub const FEED_US: u64 = 5000;
/// The chip starts anew when it has not been fed for this long, µs: longer than starting the board takes.
pub const WATCHDOG_US: u32 = 200_000;
/// A request is answered by two ticks; when none has answered it after this long, it never will, µs.
pub const ANSWER_US: u64 = 20_000;

/// Pins of one axis.
pub struct AxisPins {
    /// Encoder A; B is the next pin.
    pub a: u8,
    /// Reference mark.
    pub z: u8,
    /// Step pulses.
    pub step: u8,
    /// Direction, high is up.
    pub direction: u8,
    /// Switch at the low end: closed to ground while free, so that a broken wire reads as pressed.
    pub limit_low: u8,
    /// Switch at the high end.
    pub limit_high: u8,
}

/// X and Y.
pub const AXES: [AxisPins; 2] = [
    AxisPins { a: 2, z: 4, step: 8, direction: 9, limit_low: 16, limit_high: 17 },
    AxisPins { a: 5, z: 7, step: 10, direction: 11, limit_low: 18, limit_high: 19 },
];
/// Serial output, the hardware's UART 0.
pub const SERIAL_OUT: u8 = 0;
/// Serial input, read by a PIO program.
pub const SERIAL_IN: u8 = 1;
/// Both power stages: low is on. A resistor pulls it up while the chip starts.
pub const NOT_ENABLE: u8 = 14;
/// Either power stage reports a fault by a high level; a resistor holds it low.
pub const DRIVE_FAULT: u8 = 15;
/// Emergency stop: closed to ground while released.
pub const EMERGENCY_STOP: u8 = 20;
/// The lamp on the board, lit while ticks come.
pub const TICK_LAMP: u8 = 25;
