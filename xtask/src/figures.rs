//! `cargo xtask figures`: the figures in `docs/benchmarks.md`, measured again.
//!
//! Each topic owns what stands between `<!-- figures:TOPIC -->` and `<!-- /figures:TOPIC -->`; the words around it
//! are left alone.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use serde_json::Value;

use crate::commands::{cargo, stdout_of};
use crate::demo::read_summary;

/// What can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Topic {
    /// What the demo reaches, for six seeds.
    Demo,
    /// How fast the simulated stage runs.
    Twin,
}

const SEEDS: std::ops::RangeInclusive<u32> = 1..=6;
const EMPTY_PAGE: &str = "# Benchmarks\n\nEvery figure here comes from the command above it.\n";

/// Measures one topic, or all, and writes the page.
pub(crate) fn run(root: &Path, topic: Option<Topic>) -> Result<()> {
    let topics = topic.map_or_else(|| Topic::value_variants().to_vec(), |topic| vec![topic]);
    let file = root.join("docs").join("benchmarks.md");
    for topic in topics {
        let measured = format!("{}\n\n{}", origin(root, topic)?, topic.measure(root)?.trim_end());
        let page = if file.exists() { fs::read_to_string(&file)? } else { EMPTY_PAGE.into() };
        let page = with_section(&page, topic.name(), &measured)?;
        fs::write(&file, page).with_context(|| format!("cannot write {}", file.display()))?;
        println!("{}: {} is up to date", file.display(), topic.name());
    }
    Ok(())
}

impl Topic {
    fn name(self) -> &'static str {
        match self {
            Self::Demo => "demo",
            Self::Twin => "twin",
        }
    }

    fn measure(self, root: &Path) -> Result<String> {
        match self {
            Self::Demo => demo(root),
            Self::Twin => twin(root),
        }
    }
}

/// Which command, when, and of which state of the project.
fn origin(root: &Path, topic: Topic) -> Result<String> {
    let mut git = Command::new("git");
    let commit = stdout_of(git.current_dir(root).args(["describe", "--always", "--dirty"]))?;
    let today = date(SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs() / 86_400);
    Ok(format!("`cargo xtask figures {}`, {today}, commit {}", topic.name(), commit.trim()))
}

/// The demo's own figures, one column for each seed.
fn demo(root: &Path) -> Result<String> {
    let mut columns = Vec::new();
    for seed in SEEDS {
        let folder = std::env::temp_dir().join(format!("abbe-figures-{}-{seed}", std::process::id()));
        let (seed, out) = (seed.to_string(), folder.display().to_string());
        let mut command = cargo(root);
        command.args(["run", "--quiet", "--release", "--", "demo", "--json", "--seed", &seed, "--out", &out]);
        stdout_of(&mut command)?;
        columns.push((format!("seed {seed}"), figures_of(&read_summary(&folder)?)));
        fs::remove_dir_all(&folder).with_context(|| format!("cannot remove {out}"))?;
    }
    Ok(table(&columns))
}

/// The lines that the speed example prints.
fn twin(root: &Path) -> Result<String> {
    let mut command = cargo(root);
    command.args(["run", "--quiet", "--release", "-p", "abbe-twin", "--example", "speed"]);
    let lines = stdout_of(&mut command)?;
    ensure!(!lines.trim().is_empty(), "the speed example printed nothing");
    Ok(format!("```text\n{}\n```", lines.trim_end()))
}

/// Every number of a summary under its path, `x.worst_um`.
fn figures_of(summary: &Value) -> BTreeMap<String, String> {
    let mut figures = BTreeMap::new();
    collect(summary, "", &mut figures);
    figures
}

fn collect(value: &Value, path: &str, figures: &mut BTreeMap<String, String>) {
    if let Some(number) = value.as_f64() {
        figures.insert(path.to_owned(), shown(number));
    }
    for (key, value) in value.as_object().into_iter().flatten() {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        collect(value, &path, figures);
    }
}

/// Whole numbers as they are, others with three decimals.
fn shown(number: f64) -> String {
    if number.fract() == 0.0 { format!("{number}") } else { format!("{number:.3}") }
}

/// A Markdown table: a row for each figure that any column has.
fn table(columns: &[(String, BTreeMap<String, String>)]) -> String {
    let heads: Vec<&str> = columns.iter().map(|(head, _)| head.as_str()).collect();
    let mut text = format!("| figure | {} |\n|---|{}\n", heads.join(" | "), "---:|".repeat(heads.len()));
    let names: std::collections::BTreeSet<&String> = columns.iter().flat_map(|(_, f)| f.keys()).collect();
    for name in names {
        let cells: Vec<&str> = columns.iter().map(|(_, f)| f.get(name).map_or("–", String::as_str)).collect();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
    }
    text
}

/// The page with a topic's section replaced, or added at the end.
fn with_section(page: &str, topic: &str, measured: &str) -> Result<String> {
    let (opening, closing) = (format!("<!-- figures:{topic} -->"), format!("<!-- /figures:{topic} -->"));
    let section = format!("{opening}\n{measured}\n{closing}");
    let Some(start) = page.find(&opening) else {
        return Ok(format!("{}\n\n{section}\n", page.trim_end()));
    };
    let length = page[start..].find(&closing).with_context(|| format!("{opening} is never closed"))?;
    Ok(format!("{}{section}{}", &page[..start], &page[start + length + closing.len()..]))
}

/// A day counted from 1970-01-01, as year-month-day.
fn date(mut day: u64) -> String {
    let leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let mut year = 1970;
    while day >= 365 + u64::from(leap(year)) {
        day -= 365 + u64::from(leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 1;
    for length in lengths {
        if day < length {
            break;
        }
        day -= length;
        month += 1;
    }
    format!("{year}-{month:02}-{:02}", day + 1)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn only_the_section_of_the_topic_changes() {
        let page = "# A\n<!-- figures:demo -->\nold\n<!-- /figures:demo -->\nafter\n";
        let new = with_section(page, "demo", "new").unwrap();
        assert_eq!(new, "# A\n<!-- figures:demo -->\nnew\n<!-- /figures:demo -->\nafter\n");
        let both = with_section(&new, "twin", "fast").unwrap();
        assert!(both.starts_with(new.trim_end()) && both.ends_with("fast\n<!-- /figures:twin -->\n"));
        assert!(with_section("<!-- figures:demo -->", "demo", "x").is_err());
    }

    #[test]
    fn every_number_becomes_a_row_and_a_missing_one_a_dash() {
        let one = figures_of(&json!({ "x": { "worst_um": 1.25, "name": "a" }, "tiles": 12 }));
        let other = figures_of(&json!({ "tiles": 9 }));
        let text = table(&[("seed 1".into(), one), ("seed 2".into(), other)]);
        assert_eq!(
            text,
            "| figure | seed 1 | seed 2 |\n|---|---:|---:|\n| tiles | 12 | 9 |\n| x.worst_um | 1.250 | – |\n"
        );
    }

    #[test]
    fn days_become_dates() {
        let cases = [
            (0, "1970-01-01"),
            (58, "1970-02-28"),
            (59, "1970-03-01"),
            (789, "1972-02-29"),
            (19_723, "2024-01-01"),
            (20_088, "2024-12-31"),
        ];
        for (day, expected) in cases {
            assert_eq!(date(day), expected);
        }
    }
}
