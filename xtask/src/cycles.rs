//! `cargo xtask cycles`: what a tick costs a Cortex-M0+, stage by stage, against the budget of
//! `crates/cosim/src/golden/budget.rs`; and what sensing an analogue axis costs ([`sensing`]).

use std::fmt::Write as _;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::stage::{Outcome, Setting};
use crate::{compiler, golden, sensing};

/// Form of the report.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form {
    Table,
    Json,
}

/// What a stage costs over all golden traces of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Costs {
    /// In a few words.
    pub(crate) stage: String,
    pub(crate) rows: Vec<Cost>,
}

/// A row of its budget, cycles.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cost {
    pub(crate) name: String,
    pub(crate) median: u32,
    pub(crate) p99: u32,
    pub(crate) worst: u32,
    pub(crate) budget: Option<u32>,
    /// Where the worst is.
    pub(crate) scenario: String,
    pub(crate) tick: usize,
}

/// The stage of `cargo xtask test`.
pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let Some(costs) = measured(setting)? else { return Ok(golden::without_compiler(setting)) };
    let Some(of_sensing) = sensing::measured(setting)? else { return Ok(golden::without_compiler(setting)) };
    print!("{}\n{}", tables(&costs), sensing::table(of_sensing));
    Ok(Outcome::of_findings([over_budget(&costs), sensing::findings(of_sensing)].concat()))
}

/// The chore; true when nothing is over its budget.
///
/// # Errors
/// There is no compiler, or the traces cannot be replayed.
pub(crate) fn run(setting: &Setting, form: Form) -> Result<bool> {
    let costs = must_measure(setting)?;
    let of_sensing = sensing::must_measure(setting)?;
    let findings = [over_budget(&costs), sensing::findings(of_sensing)].concat();
    let passed = findings.is_empty();
    match form {
        Form::Table => {
            println!("{}\n{}{}", tables(&costs), sensing::table(of_sensing), findings.join("\n"));
        }
        Form::Json => {
            let report =
                json!({ "cycles": costs, "sensing": of_sensing, "findings": findings, "passed": passed });
            println!("{report:#}");
        }
    }
    Ok(passed)
}

/// The cost of every row of every budget.
///
/// # Errors
/// There is no compiler, or the traces cannot be replayed.
pub(crate) fn must_measure(setting: &Setting) -> Result<Vec<Costs>> {
    measured(setting)?.with_context(|| compiler::missing(&golden::targets(setting)))
}

fn measured(setting: &Setting) -> Result<Option<Vec<Costs>>> {
    let Some(report) = golden::replays(setting)? else { return Ok(None) };
    let costs: Vec<Costs> =
        serde_json::from_value(report["cycles"].clone()).context("golden reports no cycles")?;
    ensure!(!costs.is_empty(), "golden counted no cycles");
    for Costs { stage, rows } in &costs {
        ensure!(!rows.is_empty(), "golden counted no cycles of {stage}");
    }
    Ok(Some(costs))
}

fn over_budget(costs: &[Costs]) -> Vec<String> {
    let sentence = |cost: &Cost| {
        let budget = cost.budget.filter(|&budget| cost.worst > budget)?;
        let Cost { name, worst, scenario, tick, .. } = cost;
        Some(format!("{name}: {worst} cycles in tick {tick} of {scenario}, the budget is {budget}"))
    };
    costs.iter().flat_map(|of_stage| &of_stage.rows).filter_map(sentence).collect()
}

/// An empty line between two.
fn tables(costs: &[Costs]) -> String {
    costs.iter().map(table).collect::<Vec<String>>().join("\n")
}

fn table(Costs { stage, rows }: &Costs) -> String {
    let mut table = format!(
        "{stage}\n{:<16} {:>6} {:>6} {:>6} {:>6}  worst in\n",
        "stage", "median", "p99", "worst", "budget"
    );
    for cost in rows {
        let Cost { name, median, p99, worst, scenario, tick, .. } = cost;
        let budget = cost.budget.map_or("–".into(), |budget| budget.to_string());
        _ = writeln!(
            table,
            "{name:<16} {median:>6} {p99:>6} {worst:>6} {budget:>6}  tick {tick} of {scenario}"
        );
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(worst: u32, budget: Option<u32>) -> Cost {
        Cost { name: "plan".into(), median: 1, p99: 2, worst, budget, scenario: "stop".into(), tick: 7 }
    }

    fn costs(stage: &str, rows: &[Cost]) -> Costs {
        Costs { stage: stage.into(), rows: rows.to_vec() }
    }

    #[test]
    fn over_the_budget_is_told_with_scenario_and_tick() {
        let within = costs("one", &[cost(1500, Some(1500)), cost(9999, None)]);
        assert!(over_budget(std::slice::from_ref(&within)).is_empty());
        let told = over_budget(&[within, costs("two", &[cost(1501, Some(1500))])]);
        assert_eq!(told, ["plan: 1501 cycles in tick 7 of stop, the budget is 1500"]);
    }

    #[test]
    fn a_table_shows_its_stage_where_the_worst_is_and_a_dash_without_a_budget() {
        let table = table(&costs("one stage", &[cost(1, None)]));
        assert!(table.starts_with("one stage\n"), "{table}");
        assert!(table.contains("     1      –  tick 7 of stop\n"), "{table}");
    }
}
