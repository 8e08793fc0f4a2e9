//! The second table of `cargo xtask cycles`: what sensing an analogue axis costs a Cortex-M0+, sample by sample.
//!
//! The program `sensing` of `crates/cosim` does the work, with an image of its own. The budget stands with the work, in
//! `crates/core/examples/sensing_speed/work.rs`.

use std::fmt::Write as _;
use std::sync::OnceLock;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

use crate::commands::{cargo, stdout_of};
use crate::compiler::{self, THUMB_V6M};
use crate::firmware::{Build, built};
use crate::stage::Setting;

/// In the folder and with the features of the golden image: what both depend on is built once.
const IMAGE: Build = Build { folder: "golden", name: "sensing", target: THUMB_V6M, features: &["rp2040"] };

/// A row, cycles of one axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cost {
    pub(crate) name: String,
    samples: usize,
    pub(crate) median: u32,
    pub(crate) p99: u32,
    pub(crate) worst: u32,
    pub(crate) budget: Option<u32>,
    worst_at: usize,
    /// What the results hash to there and here, where they are not the same.
    differs: Option<String>,
}

/// The cost of every row, once; none without a compiler for the image.
///
/// # Errors
/// The image does not build, or does not run to its end.
pub(crate) fn measured(setting: &Setting) -> Result<Option<&'static [Cost]>> {
    static COSTS: OnceLock<Vec<Cost>> = OnceLock::new();
    if COSTS.get().is_none() {
        let Some(route) = compiler::find_route(setting, &[THUMB_V6M]) else { return Ok(None) };
        let mut command = cargo(&setting.root);
        command.args(["run", "--quiet", "--release", "-p", "abbe-cosim", "--bin", "sensing", "--"]);
        command.arg(built(setting, route, &IMAGE)?);
        let costs: Vec<Cost> =
            serde_json::from_str(&stdout_of(&mut command)?).context("sensing did not print JSON")?;
        ensure!(costs.iter().any(|cost| cost.budget.is_some()), "sensing has measured no head");
        _ = COSTS.set(costs);
    }
    Ok(COSTS.get().map(Vec::as_slice))
}

/// The same, for who cannot go on without.
///
/// # Errors
/// As before, or there is no compiler.
pub(crate) fn must_measure(setting: &Setting) -> Result<&'static [Cost]> {
    measured(setting)?.with_context(|| compiler::missing(&[THUMB_V6M]))
}

/// A sentence for each row that is over its budget or found something else than this machine.
pub(crate) fn findings(costs: &[Cost]) -> Vec<String> {
    let over = |cost: &Cost| {
        let budget = cost.budget.filter(|&budget| cost.worst > budget)?;
        let Cost { name, worst, worst_at, .. } = cost;
        Some(format!("{name}: {worst} cycles for sample {worst_at}, the budget is {budget}"))
    };
    let differs = |cost: &Cost| {
        let hashes = cost.differs.as_ref()?;
        Some(format!("{}: the results on the Cortex-M0+ are not those of this machine: {hashes}", cost.name))
    };
    costs.iter().flat_map(|cost| [over(cost), differs(cost)]).flatten().collect()
}

pub(crate) fn table(costs: &[Cost]) -> String {
    let mut table =
        format!("{:<50} {:>7} {:>7} {:>7} {:>6}\n", "sensing, one axis", "median", "p99", "worst", "budget");
    for cost in costs {
        let Cost { name, median, p99, worst, .. } = cost;
        _ = writeln!(table, "{name:<50} {median:>7} {p99:>7} {worst:>7} {:>6}", cost.allowed());
    }
    table
}

impl Cost {
    /// The budget, or a dash.
    pub(crate) fn allowed(&self) -> String {
        self.budget.map_or("–".into(), |budget| budget.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(worst: u32, budget: Option<u32>, differs: Option<&str>) -> Cost {
        let differs = differs.map(str::to_owned);
        Cost { name: "head".into(), samples: 9, median: 1, p99: 2, worst, budget, worst_at: 7, differs }
    }

    #[test]
    fn over_the_budget_and_another_result_are_told() {
        assert!(findings(&[cost(1000, Some(1000), None), cost(9999, None, None)]).is_empty());
        let told = findings(&[cost(1001, Some(1000), None)]);
        assert_eq!(told, ["head: 1001 cycles for sample 7, the budget is 1000"]);
        let told = findings(&[cost(1, None, Some("00000001 there, 00000002 here"))]);
        assert!(told[0].starts_with("head: the results") && told[0].ends_with("00000002 here"), "{told:?}");
    }

    #[test]
    fn a_row_without_a_budget_has_a_dash() {
        assert!(table(&[cost(9, None, None)]).ends_with("       1       2       9      –\n"));
    }
}
