//! The last tick in words, at one place in memory that does not move: for a debugger, and for the emulator that
//! compares the board with the twin tick by tick.

use abbe_core::edge::{Actuation, StepRate};
use abbe_core::{Outputs, Status};
use core::sync::atomic::{AtomicU32, Ordering};

/// Words of [`ABBE_TELEMETRY`].
const WORDS: usize = 18;

/// | word | holds |
/// |---|---|
/// | 0 | number of the tick; written last |
/// | 1 | commands taken so far |
/// | 2 | state, 0 … 6 as in `abbe_core::machine::STATES`; fault, bit 8; drives on, bit 9 |
/// | 3 | moves begun |
/// | 4, 5 | x: set-point, stage frame, picometres, low and high |
/// | 6, 7 | y: the same |
/// | 8, 9 | x: reading, scale frame, picometres, low and high |
/// | 10, 11 | y: the same |
/// | 12, 13 | x, y: step rate, pulses a tick with 16 fractional bits |
/// | 14 | longest tick so far, µs |
/// | 15 | ticks missed so far |
/// | 16 | time at which the tick was due, µs |
/// | 17 | ticks from asking for a plan to its coming, the most so far |
#[unsafe(no_mangle)]
static ABBE_TELEMETRY: [AtomicU32; WORDS] = [const { AtomicU32::new(0) }; WORDS];

/// What the board counts beside the controller.
#[derive(Clone, Copy, Default)]
pub struct Counts {
    /// Commands taken.
    pub commands: u32,
    /// Longest tick, µs.
    pub longest_us: u32,
    /// Ticks missed.
    pub missed: u32,
    /// Ticks that the slowest plan took to come.
    pub planning: u32,
}

/// A tick that is over.
#[derive(Clone, Copy)]
pub struct Over<'a> {
    /// What the controller says.
    pub status: &'a Status<2>,
    /// What it put out.
    pub outputs: &'a Outputs<2>,
    /// What the board counts.
    pub counts: Counts,
    /// When it was due, µs.
    pub due_us: u32,
}

/// Writes a tick down.
pub fn write(tick: &Over<'_>) {
    let Over { status, outputs, counts, due_us } = *tick;
    let [x, y] = &status.axes;
    let rate = |axis: usize| match outputs.axes[axis].actuation {
        Actuation::Steps(StepRate(rate)) => rate.cast_unsigned(),
        Actuation::Pwm(duty) => u32::from(duty.cast_unsigned()),
    };
    let words = [
        counts.commands,
        status.state as u32 | u32::from(status.fault.is_some()) << 8 | u32::from(outputs.axes[0].enable) << 9,
        status.move_number,
        low(x.set_point.pm()),
        high(x.set_point.pm()),
        low(y.set_point.pm()),
        high(y.set_point.pm()),
        low(x.reading.pm()),
        high(x.reading.pm()),
        low(y.reading.pm()),
        high(y.reading.pm()),
        rate(0),
        rate(1),
        counts.longest_us,
        counts.missed,
        due_us,
        counts.planning,
    ];
    for (place, word) in ABBE_TELEMETRY.iter().skip(1).zip(words) {
        place.store(word, Ordering::Relaxed);
    }
    ABBE_TELEMETRY[0].store(status.tick, Ordering::Release);
}

fn low(pm: i64) -> u32 {
    pm as u32
}

fn high(pm: i64) -> u32 {
    (pm >> 32) as u32
}
