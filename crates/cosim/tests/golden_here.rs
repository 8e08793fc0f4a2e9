//! The golden traces on this machine, and proof that they would notice.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use abbe_core::design::StageSettings;
use abbe_cosim::golden::{End, Scenario, here};

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
            "compensated-move",
            "encoder-lost",
            "fault-and-reset",
            "home",
            "limit-hit",
            "point-moves",
            "reversal",
            "stop"
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
