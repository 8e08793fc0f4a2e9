//! ISO 230-2:2014 of a table small enough to work out by hand.

use crate::ended::done;
use std::f64::consts::SQRT_2;
use std::fs;

/// Deviations in µm: at 0 mm 1, 3 up and 5, 7 down; at 10 mm −1, −1 up and 0, 4 down.
const TABLE: &str = "approach,target_mm,run1,run2
up,0,0.001,0.003
up,10,9.999,9.999
down,0,0.005,0.007
down,10,10.000,10.004
";

#[test]
fn the_figures_are_those_worked_out_by_hand() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("hand.csv"), TABLE).unwrap();
    let found = done(dir.path(), &["iso230", "hand.csv"]);
    // Means 2 and −1 up, 6 and 2 down; standard deviations √2 and 0 up, √2 and 2√2 down.
    let expected = [
        ("B", 4.0),
        ("B_mean", -3.5),
        ("M", 3.5),
        ("E_up", 3.0),
        ("E_down", 4.0),
        ("E", 7.0),
        ("R_up", 4.0 * SQRT_2),
        ("R_down", 8.0 * SQRT_2),
        ("R", 8.0 * SQRT_2),
        ("A_up", 3.0 + 2.0 * SQRT_2),
        ("A_down", 4.0 + 6.0 * SQRT_2),
        ("A", 4.0 + 6.0 * SQRT_2),
    ];
    for (key, value) in expected {
        let found = found[key].as_f64().unwrap_or_else(|| panic!("no {key} in {found}"));
        assert!((found - value).abs() < 1e-9, "{key}: {found}, by hand {value}");
    }
}
