//! What sensing an analogue axis costs: emulated cycles of a Cortex-M0+, and nanoseconds of this machine.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;

use crate::sensing::{Cost, must_measure};
use crate::stage::Setting;

/// Both tables.
pub(super) fn section(root: &Path) -> Result<String> {
    let costs = must_measure(&Setting::new(root.to_path_buf(), false))?;
    Ok(format!("{}\n{}", table(costs), super::tables(root, "abbe-core", "sensing_speed", &[])?))
}

fn table(costs: &[Cost]) -> String {
    let mut text = String::from(
        "| work, one axis | median, cycles | p99 | worst | budget | two axes, median |\n|---|---:|---:|---:|---:|---:|\n",
    );
    for cost in costs {
        let Cost { name, median, p99, worst, .. } = cost;
        let budget = cost.allowed();
        // Writing to a String cannot fail.
        _ = writeln!(text, "| {name} | {median} | {p99} | {worst} | {budget} | {} |", 2 * median);
    }
    text
}
