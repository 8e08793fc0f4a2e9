//! The golden traces on this machine, and proof that they would notice.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use abbe_core::design::StageSettings;
use abbe_core::publish::Fault;
use abbe_core::{Command, Controller};
use abbe_cosim::golden::{End, Scenario, here};
use abbe_proto::record::{Decoder, Entry, Event, Played, Replay, stage};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn every_trace_ends_in_its_hash() {
    let scenarios = Scenario::all(&root()).unwrap();
    let names: Vec<&str> = scenarios.iter().map(|scenario| scenario.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "analogue",
            "compensated-move",
            "encoder-lost",
            "fault-and-reset",
            "home",
            "limit-hit",
            "point-moves",
            "program",
            "reversal",
            "stop",
            "turn"
        ]
    );
    for scenario in &scenarios {
        let found = here::replay(&scenario.trace().unwrap()).unwrap();
        assert_eq!(found.difference(&scenario.expected().unwrap()), None, "{}", scenario.name);
    }
}

#[test]
fn an_altered_trace_is_refused() {
    for scenario in Scenario::all(&root()).unwrap() {
        let mut trace = scenario.trace().unwrap();
        let middle = trace.len() / 2;
        trace[middle] ^= 4;
        let found = here::replay(&trace).unwrap();
        assert!(matches!(&found.end, End::Unreadable(reason) if reason.contains("altered")), "{found:?}");
        assert!(found.difference(&scenario.expected().unwrap()).is_some());
        trace.truncate(middle);
        assert!(matches!(here::replay(&trace).unwrap().end, End::Unreadable(_)), "{}", scenario.name);
    }
}

#[test]
fn another_gain_is_another_hash() {
    for scenario in Scenario::all(&root()).unwrap() {
        let higher = |stage: &mut StageSettings<2>| stage.axes[1].kp_per_s *= 1.001;
        let found = here::replay_with(&scenario.trace().unwrap(), higher).unwrap();
        assert_eq!(found.end, End::Differs, "{}", scenario.name);
        let difference = found.difference(&scenario.expected().unwrap()).unwrap();
        assert!(difference.contains("differ within ticks"), "{difference}");
    }
}

/// How often the samples of an axis went into its correction.
fn refinings(blocks: &[u8], of: usize) -> u32 {
    let (mut decoder, mut refinings) = (Decoder::<2>::new(blocks), 0);
    while let Some(entry) = decoder.next_entry().unwrap() {
        refinings += u32::from(matches!(entry, Entry::Event(Event::Refine { axis }) if axis == of));
    }
    refinings
}

/// What the trace of the analogue stage is there for: that both heads learn a new ellipse while they work, and that a
/// signal is lost and found again.
#[test]
fn in_the_analogue_trace_both_heads_learn_and_one_is_lost() {
    let scenarios = Scenario::all(&root()).unwrap();
    let scenario = scenarios.iter().find(|scenario| scenario.name == "analogue").unwrap();
    assert_eq!(scenario.preset(), "litho-120");
    let trace = scenario.trace().unwrap();
    let (settings, blocks) = stage::split::<2>(&trace).unwrap();
    let mut controller = Controller::with_planner(settings.unwrap().build().unwrap());
    let ellipses = |controller: &Controller<2>| [0, 1].map(|axis| *controller.head(axis).unwrap().ellipse());
    let before = ellipses(&controller);
    let (mut replay, mut homings, mut faults) = (Replay::new(blocks), 0, Vec::new());
    while let Some(played) = replay.step(&mut controller).unwrap() {
        homings += u32::from(matches!(played, Played::Command(Command::Home, Ok(_))));
        faults.extend(controller.status().fault);
        faults.dedup();
    }
    let after = ellipses(&controller);
    for axis in [0, 1] {
        assert_ne!(before[axis], after[axis], "axis {axis} has learned nothing");
    }
    assert!(matches!(faults[..], [Fault::Signal { axis: 1, .. }]), "{faults:?}");
    assert_eq!(homings, 2);
    for axis in [0, 1] {
        assert!(refinings(blocks, axis) > 20);
    }
}
