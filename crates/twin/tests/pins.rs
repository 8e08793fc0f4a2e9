//! The twin by its wires is the twin that a controller steps.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use abbe_core::edge::{Actuation, AxisInputs as Seen, AxisOutputs, Outputs, StepRate};
use abbe_core::front::{QuadratureCounter, StepEmitter, emitter};
use abbe_twin::pins::Drive;
use abbe_twin::scale::Lines;
use abbe_twin::{Event, Plant, Twin};

const TICK_HZ: f64 = 10_000.0;
/// Clocks of 125 MHz in a tick.
const TICK: u32 = 12_500;
/// The filter of the preset's front end as the twin holds it, 4 of its 1000 clocks a tick, in clocks of 125 MHz.
const FILTER: u8 = 50;
const TICKS: u32 = 30_000;

/// Back and forth at up to 20 mm/s, and off for a while in the middle; y over its reference mark, its low switch and
/// into its stop.
fn outputs(tick: u32) -> Outputs<2> {
    let mut outputs = Outputs::OFF;
    for (axis, output) in outputs.axes.iter_mut().enumerate() {
        let phase = f64::from(tick) / (2500.0 + 700.0 * axis as f64);
        let fastest = [6.4, -6.4][axis];
        let rate = (fastest * 65_536.0 * phase.sin()) as i32;
        let enable = !(10_000..12_000).contains(&tick);
        *output = AxisOutputs { actuation: Actuation::Steps(StepRate(rate)), enable, piezo: 0 };
    }
    outputs
}

/// A board without delays: emitters in front of the wires, decoders behind them.
struct Board {
    twin: Twin,
    emitters: [StepEmitter; 2],
    decoders: Vec<QuadratureCounter>,
    tick: u64,
    edges: u64,
    indices: u32,
    pressed: u32,
    glitches: u32,
}

impl Board {
    fn new(twin: Twin) -> Self {
        let decoder = |lines: Lines| QuadratureCounter::new(FILTER, lines.a, lines.b);
        Self {
            decoders: twin.lines().map(decoder).into(),
            twin,
            emitters: [StepEmitter::new(emitter::clocks_per_tick(TICK_HZ)); 2],
            tick: 0,
            edges: 0,
            indices: 0,
            pressed: 0,
            glitches: 0,
        }
    }

    fn step(&mut self, outputs: &Outputs<2>) -> abbe_twin::pins::Wires {
        let mut drives = [Drive::OFF; 2];
        for ((drive, emitter), output) in drives.iter_mut().zip(&mut self.emitters).zip(&outputs.axes) {
            let Actuation::Steps(rate) = output.actuation else { unreachable!() };
            emitter.begin_tick(if output.enable { rate } else { StepRate(0) });
            *drive = Drive {
                enable: output.enable,
                pulses: [TICK / 2, TICK].map(|at| emitter.pulses_at(at)),
                duty: 0,
            };
        }
        let wires = self.twin.step_pins(&drives);
        let start = self.tick * u64::from(TICK);
        self.tick += 1;
        for (decoder, axis) in self.decoders.iter_mut().zip(&wires.axes) {
            self.edges += axis.edges.len() as u64;
            for edge in &axis.edges {
                assert!(edge.clock <= TICK, "an edge at clock {} of a tick", edge.clock);
                decoder.edge(start + u64::from(edge.clock), edge.lines.a, edge.lines.b, edge.lines.z);
            }
        }
        wires
    }
}

/// Runs both for as long as a test; `happen` may do something to both before a tick.
fn compare(plant: &Plant, happen: impl Fn(u32, &mut Twin)) -> Board {
    let mut stepped = Twin::standing_at(plant, &common::config(), 5, [10.0, 3.0]);
    let mut board = Board::new(stepped.clone());
    let mut pulses = [0; 2];
    // `step` acts a tick late, and shows a tick late.
    let mut acting = Outputs::OFF;
    let mut shown = None;
    for tick in 0..TICKS {
        happen(tick, &mut stepped);
        happen(tick, &mut board.twin);
        let delayed = stepped.step(&outputs(tick));
        if tick > 0 {
            let seen = delayed.axes.map(|axis| Seen { pulses: 0, sin_cos: None, ..axis });
            assert_eq!(Some(seen), shown, "tick {tick}");
            for (axis, pulses) in delayed.axes.iter().zip(pulses) {
                assert!(axis.pulses == pulses || axis.drive_fault, "tick {tick}");
            }
        }
        let wires = board.step(&acting);
        acting = outputs(tick);
        assert_eq!(stepped.truth(), board.twin.truth(), "tick {tick}");
        pulses = board.emitters.map(|emitter| emitter.pulses_at(TICK));
        let now = board.tick * u64::from(TICK);
        let mut seen = [Seen::default(); 2];
        for ((seen, decoder), axis) in seen.iter_mut().zip(&mut board.decoders).zip(&wires.axes) {
            let reading = decoder.read(now);
            *seen = Seen {
                counter: reading.counter,
                illegal: reading.illegal,
                glitches: reading.glitches,
                index: reading.index,
                limit_low: axis.limit_low,
                limit_high: axis.limit_high,
                drive_fault: axis.drive_fault,
                ..Seen::default()
            };
            board.indices += u32::from(seen.index.is_some());
            board.pressed += u32::from(seen.limit_low);
            board.glitches += u32::from(seen.glitches);
        }
        shown = Some(seen);
    }
    board
}

#[test]
fn by_wires_or_by_ticks_it_is_the_same_stage() {
    let mut plant = common::plant();
    // `step` alone plays a board that misses a sample now and then.
    plant.timing.missed_sample_probability = 0.0;
    plant.x.scale.glitch_probability = 0.05;
    let board = compare(&plant, |_, _| {});
    assert!(board.edges > 100_000, "{}", board.edges);
    assert!(board.indices > 0 && board.pressed > 1000 && board.glitches > 100);
}

#[test]
fn what_happens_to_the_stage_is_seen_on_the_wires() {
    let mut plant = common::plant();
    plant.timing.missed_sample_probability = 0.0;
    let board = compare(&plant, |tick, twin| match tick {
        3000 => twin.happen(Event::DriveFault { axis: 1, faulty: true }).unwrap(),
        6000 => twin.happen(Event::Encoder { axis: 0, connected: false }).unwrap(),
        20_000 => twin.happen(Event::EmergencyStop { pressed: true }).unwrap(),
        _ => {}
    });
    let mut twin = board.twin;
    assert_eq!(twin.lines()[0], Lines { a: true, b: true, z: false });
    let wires = twin.step_pins(&[Drive::OFF; 2]);
    assert!(wires.emergency_stop && wires.axes[1].drive_fault && wires.axes[0].edges.is_empty());
}
