//! `cargo xtask test`: every check, in order, and a table at the end.

use std::time::{Duration, Instant};

use anyhow::Result;

use crate::commands::cargo_stage;
use crate::stage::{Outcome, Setting, Stage};
use crate::{arrows, cosim, cycles, demo, firmware, fuzz, gate, golden, licences, links};

/// Cheap checks first; none stops the ones after it, because one run should show everything that is wrong.
const STAGES: &[Stage] = &[
    Stage { name: "format", run: |setting| cargo_stage(setting, &["fmt", "--all", "--check"]) },
    Stage { name: "lints", run: lints },
    Stage { name: "arrows", run: arrows::check },
    Stage { name: "tests", run: |setting| cargo_stage(setting, &["test", "--workspace", "--release"]) },
    Stage { name: "documents", run: links::check },
    Stage { name: "demo", run: demo::check },
    Stage { name: "fuzz", run: fuzz::check },
    Stage { name: "link gate", run: gate::check },
    Stage { name: "firmware", run: firmware::check },
    Stage { name: "golden traces", run: golden::check },
    Stage { name: "cycles", run: cycles::check },
    Stage { name: "co-simulation", run: cosim::check },
    Stage { name: "licences", run: licences::check },
];

/// One row of the closing table.
struct Row {
    name: &'static str,
    outcome: Outcome,
    took: Duration,
}

/// Runs the stages; true when all is well. `only` names a few of them; none means all.
pub(crate) fn run(setting: &Setting, only: &[String]) -> Result<bool> {
    for name in only {
        anyhow::ensure!(
            STAGES.iter().any(|stage| stage.name == name),
            "there is no stage {name:?}: {}",
            names()
        );
    }
    let chosen = STAGES.iter().filter(|stage| only.is_empty() || only.iter().any(|name| name == stage.name));
    let rows: Vec<Row> = chosen.map(|stage| run_stage(stage, setting)).collect();
    Ok(conclude(&rows, setting.ci))
}

fn names() -> String {
    STAGES.iter().map(|stage| stage.name).collect::<Vec<_>>().join(", ")
}

fn lints(setting: &Setting) -> Result<Outcome> {
    cargo_stage(setting, &["clippy", "--workspace", "--all-targets", "--release", "--", "-D", "warnings"])
}

fn run_stage(stage: &Stage, setting: &Setting) -> Row {
    println!("\n── {} ──", stage.name);
    let start = Instant::now();
    let outcome = (stage.run)(setting).unwrap_or_else(|error| Outcome::Failed(vec![format!("{error:#}")]));
    let took = start.elapsed();
    if let Outcome::Failed(findings) = &outcome {
        println!("{}", findings.join("\n"));
    }
    println!("── {}: {} after {} min", stage.name, word(&outcome), minutes(took));
    Row { name: stage.name, outcome, took }
}

/// Prints the table and the count; true when all is well.
fn conclude(rows: &[Row], ci: bool) -> bool {
    println!("\n{:<13} {:>7}  result", "stage", "minutes");
    for row in rows {
        println!("{:<13} {:>7}  {}", row.name, minutes(row.took), sentence(&row.outcome));
    }
    let failed = rows.iter().filter(|row| is_failure(&row.outcome, ci)).count();
    let passed = rows.iter().filter(|row| row.outcome == Outcome::Passed).count();
    println!("\n{passed} passed, {failed} failed");
    failed == 0
}

/// Where a check has to be possible, not possible is a failure.
fn is_failure(outcome: &Outcome, ci: bool) -> bool {
    match outcome {
        Outcome::Passed => false,
        Outcome::Failed(_) => true,
        Outcome::NotPossible { .. } => ci,
    }
}

fn word(outcome: &Outcome) -> &'static str {
    match outcome {
        Outcome::Passed => "passed",
        Outcome::Failed(_) => "failed",
        Outcome::NotPossible { .. } => "not possible here",
    }
}

fn sentence(outcome: &Outcome) -> String {
    match outcome {
        Outcome::NotPossible { reason, install } => {
            format!("not possible here: {reason}; to install: {install}")
        }
        other => word(other).into(),
    }
}

fn minutes(took: Duration) -> String {
    format!("{:.2}", took.as_secs_f64() / 60.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(outcome: Outcome) -> Row {
        Row { name: "x", outcome, took: Duration::ZERO }
    }

    #[test]
    fn what_is_not_possible_fails_only_where_it_must_be() {
        let not_possible = || Outcome::NotPossible { reason: "no linker".into(), install: "get one".into() };
        assert!(conclude(&[row(Outcome::Passed), row(not_possible())], false));
        assert!(!conclude(&[row(Outcome::Passed), row(not_possible())], true));
        assert!(!conclude(&[row(Outcome::Failed(vec![])), row(Outcome::Passed)], false));
        assert_eq!(sentence(&not_possible()), "not possible here: no linker; to install: get one");
    }

    #[test]
    fn an_unknown_stage_is_refused_with_the_names() {
        let setting = Setting { root: ".".into(), may_install: false, ci: false };
        let error = run(&setting, &["fromat".into()]).unwrap_err().to_string();
        assert!(error.contains("fromat") && error.contains("format, lints"), "{error}");
    }
}
