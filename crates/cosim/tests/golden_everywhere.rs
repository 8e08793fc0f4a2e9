//! The bodies notice: on each of them a trace that was altered is refused, and a run that differs is found where it does.
//!
//! `cargo xtask golden` replays every trace on every body; here one is enough. The images come from there, too:
//! `ABBE_GOLDEN_IMAGES` names the folder in which each target has its own.
#![cfg(feature = "images")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use abbe_core::edge::{Actuation, StepRate};
use abbe_core::{Controller, Inputs, Outputs, design::StageSettings};
use abbe_cosim::golden::qemu::Machine;
use abbe_cosim::golden::rp2040::Board;
use abbe_cosim::golden::{End, Expected, Found, Scenario};
use abbe_proto::record::{Encoder, Event, HASH_TICKS, SliceSink};

/// Every body but this machine; what each finds.
fn on_every_body(trace: &[u8], expected: &Expected) -> Vec<Found> {
    let board = Board::read(&image("thumbv6m-none-eabi")).unwrap();
    let (found, cycles) = board.replay(trace, expected).unwrap();
    assert_eq!(cycles.len(), found.ticks as usize);
    vec![
        found,
        Machine::Lm3s6965evb.replay(&image("thumbv7m-none-eabi"), trace).unwrap(),
        Machine::Mps2An505.replay(&image("thumbv8m.main-none-eabi"), trace).unwrap(),
    ]
}

fn image(target: &str) -> PathBuf {
    let folder =
        std::env::var_os("ABBE_GOLDEN_IMAGES").expect("ABBE_GOLDEN_IMAGES names the folder of the images");
    PathBuf::from(folder).join(target).join("release").join("golden")
}

fn scenarios() -> Vec<Scenario> {
    Scenario::all(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap()
}

fn shortest() -> Scenario {
    scenarios().into_iter().min_by_key(|scenario| scenario.expected().unwrap().ticks).unwrap()
}

#[test]
fn a_trace_is_the_same_everywhere() {
    let scenario = shortest();
    let expected = scenario.expected().unwrap();
    for found in on_every_body(&scenario.trace().unwrap(), &expected) {
        assert_eq!(found.difference(&expected), None);
    }
}

#[test]
fn an_altered_trace_is_refused_everywhere() {
    let scenario = shortest();
    let expected = scenario.expected().unwrap();
    let mut trace = scenario.trace().unwrap();
    trace[10_000] ^= 1;
    for found in on_every_body(&trace, &expected) {
        assert!(matches!(found.end, End::Unreadable(_)), "{found:?}");
        assert!(found.ticks < expected.ticks && found.difference(&expected).is_some());
    }
}

#[test]
fn an_altered_stage_is_refused_everywhere() {
    let scenarios = scenarios();
    let scenario = scenarios.iter().find(|scenario| scenario.preset() == "litho-120").unwrap();
    let expected = scenario.expected().unwrap();
    let mut trace = scenario.trace().unwrap();
    trace[100] ^= 1;
    for found in on_every_body(&trace, &expected) {
        assert!(matches!(found.end, End::Unreadable(_)) && found.ticks == 0, "{found:?}");
    }
}

/// A run of 3500 ticks at rest, recorded by somebody who says that the outputs of tick 1500 were others.
fn untrue_trace() -> (Vec<u8>, Expected) {
    let mut memory = vec![0; 1 << 16];
    let mut encoder = Encoder::<2, _>::new(SliceSink::new(&mut memory));
    let mut controller = Controller::new(StageSettings::<2>::default().build().unwrap());
    for tick in 0..3500 {
        let inputs = Inputs::at_rest(tick);
        encoder.event(&Event::Tick(inputs)).unwrap();
        let mut outputs: Outputs<2> = controller.tick(&inputs);
        if tick == 1500 {
            outputs.axes[1].actuation = Actuation::Steps(StepRate(1));
        }
        encoder.outputs(&outputs).unwrap();
    }
    let expected = Expected { ticks: 3500, hash: encoder.hash().value() };
    (encoder.finish().unwrap().written().to_vec(), expected)
}

#[test]
fn a_difference_is_found_where_it_is_everywhere() {
    let (trace, expected) = untrue_trace();
    for found in on_every_body(&trace, &expected) {
        assert_eq!((&found.end, found.proven), (&End::Differs, HASH_TICKS), "{found:?}");
        let difference = found.difference(&expected).unwrap();
        assert!(difference.contains("within ticks 1000 … 2000"), "{difference}");
    }
}
