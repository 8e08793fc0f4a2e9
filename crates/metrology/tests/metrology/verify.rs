use abbe_metrology::Approach;
use abbe_metrology::readings::Readings;
use abbe_metrology::verify::{Limits, PAPER_A, Verification};

fn hand_computed() -> Readings {
    Readings::parse("hand_computed.csv", include_bytes!("../data/hand_computed.csv")).unwrap()
}

/// From the same pencil as the ISO figures: means −1.0 (50↓) to 3.0 (40↑); single errors mean ± k, the largest
/// 3.1 (40↑, run 4 is the first of two); spreads 2k, the largest 1.0 (50↑).
#[test]
fn figures_by_hand() {
    let found = Verification::of(&hand_computed());
    let at = |at: abbe_metrology::verify::At| ((at.value_um * 1e6).round() / 1e6, at.target_mm, at.approach);
    assert_eq!(at(found.mean_min), (-1.0, 50.0, Approach::Down));
    assert_eq!(at(found.mean_max), (3.0, 40.0, Approach::Up));
    assert_eq!(at(found.spread), (1.0, 50.0, Approach::Up));
    assert_eq!(at(found.worst_single), (3.1, 40.0, Approach::Up));
    assert!(found.worst_run >= 4);
    assert!((found.mean_size_um() - 3.0).abs() < 1e-9);
}

#[test]
fn checks_compare_sizes_with_limits() {
    let checks = Verification::of(&hand_computed()).checks(&Limits::default());
    assert_eq!(checks.map(|check| check.pass), [false, false, true, true]);
    let generous = Limits { mean_um: 3.1, worst_single_um: 3.2, spread_um: 1.1, a_um: 4.5 };
    assert!(Verification::of(&hand_computed()).checks(&generous).iter().all(|check| check.pass));
}

#[test]
fn our_limits_are_tighter_than_what_the_paper_reports() {
    let ours = Limits::default();
    assert!(PAPER_A.mean_um.iter().all(|paper| ours.mean_um < paper.abs()));
    assert!(ours.worst_single_um < PAPER_A.worst_single_um && ours.spread_um < PAPER_A.spread_um);
}
