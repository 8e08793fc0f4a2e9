//! The front end: two decoders with counter and index latch, two step emitters, and the switches.
//!
//! | block | machine | program | does |
//! |---|---|---|---|
//! | 0 | 0, 2 | decoder | counts x, y |
//! | 0 | 1, 3 | decoder | latches the counter of x, y at the reference mark |
//! | 1 | 0, 1 | emitter | step pulses of x, y |
//! | 1 | 2 | `serial_rx` | the serial port, see `serial.rs` |

use crate::design::{
    AXES, AxisPins, DRIVE_FAULT, EMERGENCY_STOP, PULSE_LEAD_CLOCKS, SERIAL_IN, TICK_CLOCKS, TICK_LAMP,
};
use crate::pins;
use crate::pio::{self, Fifo, Setup};
use crate::safety::enable_drives;
use abbe_core::edge::{Actuation, AxisOutputs, Inputs, Outputs, StepRate};
use abbe_core::front::decoder_words::{FRESH, LATCHED};
use abbe_core::front::pulse_words::Words;
use abbe_core::front::{DecoderWords, Reading, Runs, StepEmitter};
use embassy_rp::pac;

/// Machines of block 1 that emit step pulses.
const EMITTERS: u8 = 0b0011;
/// Machine of block 1 that receives the serial port.
pub const SERIAL_MACHINE: usize = 2;
/// A decoder pushes a word every 11 clocks; one that has not within so many looks has stopped.
const LOOKS: usize = 64;

/// One axis of the front end.
struct Axis {
    pins: &'static AxisPins,
    decoder: DecoderWords,
    emitter: StepEmitter,
    runs: Runs,
    /// The pulses of the next tick.
    words: Words,
}

/// The front end, as the tick uses it.
pub struct Front {
    axes: [Axis; 2],
    /// The power stages as the pulses see them, and as they shall be from the next tick on.
    on: bool,
    wanted_on: bool,
}

impl Front {
    /// Loads the programs and starts the decoders and the serial receiver. No pulses.
    pub fn set_up() -> Self {
        load_decoders();
        load_emitters_and_receiver();
        Self { axes: [Axis::new(0), Axis::new(1)], on: false, wanted_on: false }
    }

    /// The beginning of a tick: what the last one decided takes effect.
    pub fn release(&mut self) {
        if self.wanted_on {
            for (machine, axis) in self.axes.iter().enumerate() {
                if !self.on {
                    // A run without pulses: the line of time begins a little after the tick.
                    pio::give(pac::PIO1, machine, PULSE_LEAD_CLOCKS << 12);
                }
                for &word in axis.words.as_slice() {
                    pio::give(pac::PIO1, machine, word);
                }
            }
            if !self.on {
                enable_drives(true);
                pio::start(pac::PIO1, EMITTERS);
            }
        }
        self.on = self.wanted_on;
    }

    /// What the sensors show now.
    pub fn read(&mut self, inputs: &mut Inputs<2>) {
        for (number, (axis, inputs)) in self.axes.iter_mut().zip(&mut inputs.axes).enumerate() {
            let reading = axis.read(number);
            inputs.counter = reading.counter;
            inputs.illegal = reading.illegal;
            inputs.glitches = reading.glitches;
            inputs.index = reading.index;
            // Those of the running tick begin a little later.
            inputs.pulses = axis.emitter.pulses_at(0);
        }
        let levels = pins::levels();
        let high = |pin: u8| levels & (1 << pin) != 0;
        for (axis, inputs) in self.axes.iter().zip(&mut inputs.axes) {
            inputs.limit_low = high(axis.pins.limit_low);
            inputs.limit_high = high(axis.pins.limit_high);
            inputs.drive_fault = high(DRIVE_FAULT);
        }
        inputs.emergency_stop = high(EMERGENCY_STOP);
    }

    /// Makes the pulses of the next tick ready. Off is off at once.
    pub fn prepare(&mut self, outputs: &Outputs<2>) {
        self.wanted_on = outputs.axes.iter().any(|axis| axis.enable);
        if !self.wanted_on {
            enable_drives(false);
            if self.on {
                stop_pulses();
                self.on = false;
            }
        }
        for (axis, output) in self.axes.iter_mut().zip(&outputs.axes) {
            axis.prepare(output, self.on);
        }
        pac::SIO.gpio_out(0).value_xor().write_value(1 << TICK_LAMP);
    }

    /// Ticks were missed: nobody knows what the stage did meanwhile. The controller will judge; the drives do not wait.
    pub fn abandon(&mut self) {
        enable_drives(false);
        stop_pulses();
        self.on = false;
        self.wanted_on = false;
    }
}

impl Axis {
    fn new(number: usize) -> Self {
        Self {
            pins: &AXES[number],
            decoder: DecoderWords::new(fresh(2 * number).unwrap_or(u32::MAX)),
            emitter: StepEmitter::new(TICK_CLOCKS),
            runs: Runs::new(TICK_CLOCKS),
            words: Words::default(),
        }
    }

    fn read(&mut self, number: usize) -> Reading {
        let (counting, latching) = (2 * number, 2 * number + 1);
        let mut latched = [0; LATCHED];
        let before = drain(latching, &mut latched);
        // A decoder that has stopped shows an encoder that stands still, which the guard finds out.
        let word = fresh(counting).unwrap_or(self.decoder.word());
        let z = 1 << self.pins.z;
        let high = pins::levels() & z;
        let after = drain(latching, latched.get_mut(before..).unwrap_or_default());
        let high = high | (pins::levels() & z);
        let seen = latched.get(..before + after).unwrap_or_default();
        self.decoder.read(word, seen, high != 0)
    }

    fn prepare(&mut self, output: &AxisOutputs, running: bool) {
        let rate = match output.actuation {
            Actuation::Steps(rate) if output.enable => rate,
            _ => StepRate(0),
        };
        let train = self.emitter.begin_tick(rate);
        if !running {
            self.runs = Runs::new(TICK_CLOCKS);
        }
        self.words = self.runs.words(&train);
    }
}

/// The newest word of a counting machine: what waits in its FIFO is old.
fn fresh(machine: usize) -> Option<u32> {
    let mut word = None;
    for _ in 0..FRESH {
        word = (0..LOOKS).find_map(|_| pio::take(pac::PIO0, machine));
    }
    word
}

/// Takes what a latching machine has pushed; how many words.
fn drain(machine: usize, place: &mut [u32]) -> usize {
    let mut taken = 0;
    // Bounded: while the mark is under the head the machine goes on pushing.
    for place in place {
        let Some(word) = pio::take(pac::PIO0, machine) else { break };
        *place = word;
        taken += 1;
    }
    taken
}

/// Halts the emitters where they are; from either core. Core 1, when it comes back, finds that it is late and does the
/// rest.
pub fn halt_emitters() {
    pio::stop(pac::PIO1, EMITTERS);
}

/// Stops the emitters, with STEP low, and forgets the pulses that wait.
fn stop_pulses() {
    halt_emitters();
    for machine in 0..2 {
        pio::side_low(pac::PIO1, machine);
        pio::forget_words(pac::PIO1, machine);
        pio::begin_anew(pac::PIO1, machine, 0);
    }
}

fn load_decoders() {
    let decoder = ::pio::pio_file!("pio/decoder.pio");
    let program = pio::load(pac::PIO0, &decoder.program, 0);
    let (end, look) = (decoder.public_defines.end as u8, decoder.public_defines.look as u8);
    for (axis, pins) in AXES.iter().enumerate() {
        let counting = Setup { in_base: pins.a, ..Setup::PLAIN };
        let latching = Setup {
            jmp_pin: pins.z,
            wrap: Some(::pio::Wrap { source: end, target: look }),
            fifo: Fifo::Receive,
            ..counting
        };
        pio::set_up(pac::PIO0, 2 * axis, program, &counting);
        pio::set_up(pac::PIO0, 2 * axis + 1, program, &latching);
    }
    pio::start(pac::PIO0, 0b1111);
}

fn load_emitters_and_receiver() {
    let emitter = ::pio::pio_file!("pio/emitter.pio");
    let program = pio::load(pac::PIO1, &emitter.program, 0);
    for (machine, pins) in AXES.iter().enumerate() {
        let setup = Setup {
            out_pin: Some(pins.direction),
            side_pin: Some(pins.step),
            fifo: Fifo::Send,
            ..Setup::PLAIN
        };
        pio::set_up(pac::PIO1, machine, program, &setup);
    }
    let receiver = ::pio::pio_file!("pio/serial_rx.pio");
    let behind = emitter.program.code.len() as u8;
    let program = pio::load(pac::PIO1, &receiver.program, behind);
    let setup = Setup {
        in_base: SERIAL_IN,
        jmp_pin: SERIAL_IN,
        in_right: true,
        fifo: Fifo::Receive,
        divider: crate::serial::divider(),
        ..Setup::PLAIN
    };
    pio::set_up(pac::PIO1, SERIAL_MACHINE, program, &setup);
    pio::start(pac::PIO1, 1 << SERIAL_MACHINE);
}
