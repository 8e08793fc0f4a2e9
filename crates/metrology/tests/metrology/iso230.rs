use abbe_metrology::Approach;
use abbe_metrology::iso230::{Figures, evaluate};
use abbe_metrology::readings::Readings;
use proptest::prelude::*;

/// The table in `data/hand_computed.csv` was made so that every figure can be had with a pencil: at each target the
/// five runs are mean + k·(−1, −1, 0, 1, 1), whose standard deviation is exactly k.
///
/// | target | x̄↑ | s↑ | x̄↓ | s↓ | B | R (which term) |
/// |---|---|---|---|---|---|---|
/// | 10 | 1.0 | 0.1 | 0.5 | 0.2 | 0.5 | 1.1 (2s↑ + 2s↓ + B) |
/// | 20 | 2.0 | 0.3 | 1.8 | 0.1 | 0.2 | 1.2 (R↑) |
/// | 30 | −0.5 | 0.2 | 0.1 | 0.2 | −0.6 | 1.4 |
/// | 40 | 3.0 | 0.1 | 2.0 | 0.4 | 1.0 | 2.0 |
/// | 50 | 0.0 | 0.5 | −1.0 | 0.1 | 1.0 | 2.2 |
const BY_HAND: Figures = Figures {
    a: 4.4,      // 3.2 (40↑) − (−1.2) (50↓)
    a_up: 4.2,   // 3.2 (40) − (−1.0) (50)
    a_down: 4.0, // 2.8 (40) − (−1.2) (50)
    r: 2.2,      // at 50, larger than R↑ and R↓ everywhere
    r_up: 2.0,
    r_down: 1.6,
    e: 4.0, // 3.0 (40↑) − (−1.0) (50↓): no single direction has both
    e_up: 3.5,
    e_down: 3.0,
    m: 3.0, // 2.5 − (−0.5)
    b: 1.0,
    b_mean: 0.42,
};

fn hand_computed() -> Readings {
    Readings::parse("hand_computed.csv", include_bytes!("../data/hand_computed.csv")).unwrap()
}

fn assert_close(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() <= 1e-9 * expected.abs().max(1.0),
        "{what}: {found}, expected {expected}"
    );
}

#[test]
fn figures_by_hand() {
    let figures = evaluate(&hand_computed()).figures;
    for ((name, found), (_, expected)) in figures.named().into_iter().zip(BY_HAND.named()) {
        assert_close(found, expected, name);
    }
}

#[test]
fn points_by_hand() {
    let points = evaluate(&hand_computed()).points;
    let r: Vec<f64> = points.iter().map(|p| p.r_um).collect();
    let b: Vec<f64> = points.iter().map(|p| p.b_um).collect();
    for i in 0..5 {
        assert_close(r[i], [1.1, 1.2, 1.4, 2.0, 2.2][i], "R_i");
        assert_close(b[i], [0.5, 0.2, -0.6, 1.0, 1.0][i], "B_i");
        assert_close(points[i].s_up_um, [0.1, 0.3, 0.2, 0.1, 0.5][i], "s↑");
    }
}

/// Each run lies at −1, −1, 0, 1, 1 times the mean of all k, which is 0.22 µm.
#[test]
fn drift_by_hand() {
    let drift = evaluate(&hand_computed()).drift;
    for (found, expected) in drift.shift_um.iter().zip([0.0, 0.0, 0.22, 0.44, 0.44]) {
        assert_close(*found, expected, "shift");
    }
    assert_close(drift.span_um, 0.44, "span");
}

#[test]
fn figures_serialise_under_the_standards_letters() {
    let text = toml::to_string(&evaluate(&hand_computed()).figures).unwrap();
    let keys: Vec<&str> = text.lines().filter_map(|line| line.split(" = ").next()).collect();
    let letters = ["A", "A_up", "A_down", "R", "R_up", "R_down", "E", "E_up", "E_down", "M", "B", "B_mean"];
    assert_eq!(keys, letters);
    assert_eq!(evaluate(&hand_computed()).figures.named().map(|(name, _)| name), letters);
}

/// Deviations in µm at targets 10 mm apart.
fn readings(up: &[Vec<f64>], down: &[Vec<f64>]) -> Readings {
    let targets: Vec<f64> = (0..up.len()).map(|i| 10.0 * i as f64).collect();
    let positions = |side: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let rows = side.iter().zip(&targets);
        rows.map(|(row, target)| row.iter().map(|um| target + um / 1e3).collect()).collect()
    };
    Readings::new(&targets, &positions(up), &positions(down)).unwrap()
}

type Deviations = (Vec<Vec<f64>>, Vec<Vec<f64>>);

fn any_deviations() -> impl Strategy<Value = Deviations> {
    (2usize..12, 2usize..8).prop_flat_map(|(targets, runs)| {
        let side = move || prop::collection::vec(prop::collection::vec(-100.0..100.0f64, runs), targets);
        (side(), side())
    })
}

fn assert_same(found: Figures, expected: Figures) -> Result<(), TestCaseError> {
    for ((name, a), (_, b)) in found.named().into_iter().zip(expected.named()) {
        prop_assert!((a - b).abs() < 1e-8, "{}: {} against {}", name, a, b);
    }
    Ok(())
}

proptest! {
    #[test]
    fn the_standards_inequalities((up, down) in any_deviations()) {
        let found = evaluate(&readings(&up, &down));
        let f = found.figures;
        let slack = 1e-9;
        prop_assert!(f.a + slack >= f.e && f.e + slack >= f.m);
        prop_assert!(f.a + slack >= f.a_up && f.a + slack >= f.a_down);
        prop_assert!(f.e + slack >= f.e_up && f.e + slack >= f.e_down);
        prop_assert!(f.a + slack >= f.r && f.r >= f.r_up && f.r >= f.r_down);
        prop_assert!(found.points.iter().all(|p| f.r + slack >= p.b_um.abs()));
        prop_assert!(f.b + slack >= f.b_mean.abs());
    }

    #[test]
    fn an_offset_changes_nothing((up, down) in any_deviations(), offset in -500.0..500.0f64) {
        let moved = |side: &[Vec<f64>]| -> Vec<Vec<f64>> {
            side.iter().map(|row| row.iter().map(|um| um + offset).collect()).collect()
        };
        let shifted = evaluate(&readings(&moved(&up), &moved(&down))).figures;
        assert_same(shifted, evaluate(&readings(&up, &down)).figures)?;
    }

    #[test]
    fn the_order_of_runs_changes_nothing((up, down) in any_deviations(), turn in 0usize..8) {
        let turned = |side: &[Vec<f64>]| -> Vec<Vec<f64>> {
            side.iter().map(|row| { let mut row = row.clone(); let n = row.len(); row.rotate_left(turn % n); row }).collect()
        };
        let other = evaluate(&readings(&turned(&up), &turned(&down))).figures;
        assert_same(other, evaluate(&readings(&up, &down)).figures)?;
    }

    #[test]
    fn swapping_directions_swaps_labels_and_the_sign_of_the_reversal((up, down) in any_deviations()) {
        let f = evaluate(&readings(&up, &down)).figures;
        let expected = Figures {
            a_up: f.a_down, a_down: f.a_up, r_up: f.r_down, r_down: f.r_up, e_up: f.e_down, e_down: f.e_up,
            b_mean: -f.b_mean, ..f
        };
        assert_same(evaluate(&readings(&down, &up)).figures, expected)?;
    }
}

/// Both directions of the hand-computed table have the size the file says, so a swapped parser would be seen.
#[test]
fn directions_are_not_swapped() {
    let readings = hand_computed();
    assert_close(readings.deviations_um(Approach::Up)[4][0], -0.5, "50↑ run 1");
    assert_close(readings.deviations_um(Approach::Down)[4][0], -1.1, "50↓ run 1");
}
