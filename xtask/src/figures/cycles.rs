//! The cycles of a tick, and what they were before: a row of the history for each time they are measured.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result};

use crate::cycles::{Cost, Costs, must_measure};
use crate::stage::Setting;

/// First words of the history's head, by which it is found again.
const HEAD: &str = "| date | commit |";

/// The table of each stage, and the history of the first with one more row.
pub(super) fn section(root: &Path, page: &str, today: &str, commit: &str) -> Result<String> {
    let costs = must_measure(&Setting::new(root.to_path_buf(), false))?;
    let tables = costs.iter().map(table).collect::<Vec<String>>().join("\n");
    let first = &costs.first().context("no stage was measured")?.rows;
    Ok(format!("{tables}\n{}", history(first, page, today, commit)))
}

fn table(Costs { stage, rows }: &Costs) -> String {
    let mut text = format!(
        "{stage}:\n\n| stage | median | p99 | worst | budget | worst in |\n|---|---:|---:|---:|---:|---|\n"
    );
    for Cost { name, median, p99, worst, budget, scenario, tick } in rows {
        let budget = budget.map_or("–".into(), |budget| budget.to_string());
        // Writing to a String cannot fail.
        _ = writeln!(
            text,
            "| {name} | {median} | {p99} | {worst} | {budget} | tick {tick} of `{scenario}` |"
        );
    }
    text
}

/// The worst of each row that has a budget, whole tick last, below those of `page`. Rows that were measured with other
/// stages or under another head keep their own table.
fn history(costs: &[Cost], page: &str, today: &str, commit: &str) -> String {
    let judged: Vec<&Cost> = costs.iter().filter(|cost| cost.budget.is_some()).collect();
    let names: Vec<&str> = judged.iter().map(|cost| cost.name.as_str()).collect();
    let figures: Vec<String> = judged.iter().map(|cost| cost.worst.to_string()).collect();
    let head = format!("{HEAD} {} |", names.join(" | "));
    let mut text = kept(page);
    if last_head(&text) != Some(&head) {
        let space = if text.is_empty() { "" } else { "\n" };
        _ = writeln!(text, "{space}{head}\n|---|---|{}", "---:|".repeat(names.len()));
    }
    _ = writeln!(text, "| {today} | {commit} | {} |", figures.join(" | "));
    text
}

/// The tables of the history that the page has already.
fn kept(page: &str) -> String {
    let from_head = page.lines().skip_while(|line| !line.starts_with(HEAD));
    let lines: Vec<&str> = from_head.take_while(|line| line.is_empty() || line.starts_with('|')).collect();
    let text = lines.join("\n");
    if text.is_empty() { text } else { format!("{}\n", text.trim_end()) }
}

fn last_head(history: &str) -> Option<&str> {
    history.lines().rfind(|line| line.starts_with(HEAD))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn costs(worst: u32) -> [Cost; 2] {
        let cost = |name: &str, budget| Cost {
            name: name.into(),
            median: 1,
            p99: 2,
            worst,
            budget,
            scenario: "stop".into(),
            tick: 7,
        };
        [cost("guard", None), cost("whole tick", Some(6250))]
    }

    fn of_stage(rows: &[Cost]) -> String {
        table(&Costs { stage: "a stage".into(), rows: rows.to_vec() })
    }

    #[test]
    fn the_history_keeps_its_rows_and_gets_another() {
        let first = history(&costs(5000), "", "2026-01-01", "abc");
        assert_eq!(first, "| date | commit | whole tick |\n|---|---|---:|\n| 2026-01-01 | abc | 5000 |\n");
        let page =
            format!("{}\n{first}<!-- /figures:cycles -->\n| other | table |\n", of_stage(&costs(5000)));
        let second = history(&costs(4000), &page, "2026-01-02", "def");
        assert_eq!(second, format!("{first}| 2026-01-02 | def | 4000 |\n"));
    }

    #[test]
    fn rows_under_another_head_keep_their_table() {
        let first = history(&costs(5000), "", "2026-01-01", "abc");
        let mut others = costs(7);
        others[0].budget = Some(9);
        let both = history(&others, &first, "2026-01-02", "def");
        let head = "| date | commit | guard | whole tick |\n|---|---|---:|---:|\n";
        assert_eq!(both, format!("{first}\n{head}| 2026-01-02 | def | 7 | 7 |\n"));
        assert_eq!(history(&others, &both, "x", "y"), format!("{both}| x | y | 7 | 7 |\n"));
    }

    #[test]
    fn a_row_without_a_budget_has_a_dash() {
        assert!(of_stage(&costs(9)).contains("| guard | 1 | 2 | 9 | – | tick 7 of `stop` |\n"));
    }
}
