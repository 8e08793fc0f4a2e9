//! `cargo xtask figures`: the figures in `docs/benchmarks.md`, measured again.
//!
//! Each topic owns what stands between `<!-- figures:TOPIC -->` and `<!-- /figures:TOPIC -->`; the words around it
//! are left alone.

mod cycles;
mod inline;
mod readme;
mod sensing;

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
    /// What the demo reaches, for six seeds; writes the figures of the READMEs and of docs/papers.md, too.
    Demo,
    /// How well the zero repeats.
    Homing,
    /// Disturbed edges through the counter, and how many it loses; minutes.
    Edges,
    /// Plans from state to state beside those of another planner: failures, durations, costs; a minute or two.
    Planner,
    /// Set-points of circles, corners and scans, tick by tick, beside their paths.
    Paths,
    /// Poor signals through comparators, counter and head, and how many periods are lost; many minutes.
    Periods,
    /// How fast the simulated stage runs.
    Twin,
    /// What is left of an encoder's error inside a period, by method, samples and noise.
    Encoder,
    /// What can happen to an analogue encoder, how soon it is noticed, and how wrong the position was until then.
    Faults,
    /// What a tick costs a Cortex-M0+, stage by stage; adds a row to the history.
    Cycles,
    /// What sensing an analogue axis costs a Cortex-M0+ and this machine, beside other ways to an angle.
    Sensing,
    /// Hashes of all outputs of the golden traces, on every processor.
    Golden,
    /// How fast the board's PIO programs are exact.
    Pio,
    /// What the images for boards use.
    Firmware,
    /// The Pico's image wired to the twin, over the preset's whole way to the reference mark.
    Cosim,
}

const SEEDS: std::ops::RangeInclusive<u32> = 1..=6;
const HOMING_SEEDS: std::ops::RangeInclusive<u32> = 1..=2;
const HOMINGS: u32 = 200;
const FAULT_SEEDS: &str = "1000";
/// Plans in each row.
const PLANS: &str = "1000000";
/// Edges at each speed.
const EDGES: u64 = 10_000_000_000;
/// Edges in each of eight rows: ten thousand million in all.
const EDGES_OF_A_HEAD: u64 = 1_250_000_000;

/// A row of a table: its name, where its numbers stand in a summary, and their decimals.
struct Row {
    name: &'static str,
    paths: &'static [&'static str],
    decimals: usize,
}

const fn row(name: &'static str, paths: &'static [&'static str], decimals: usize) -> Row {
    Row { name, paths, decimals }
}

impl Row {
    fn cell(&self, summary: &Value) -> String {
        let shown = |path: &&str| {
            summary
                .pointer(path)
                .and_then(Value::as_f64)
                .map_or("–".into(), |v| format!("{v:.*}", self.decimals))
        };
        // Two numbers are the ends of a range, more are a list.
        let between = if self.paths.len() == 2 { " … " } else { ", " };
        self.paths.iter().map(shown).collect::<Vec<String>>().join(between)
    }
}

const DEMO_ROWS: [Row; 20] = [
    row("x: error before compensation at 90 mm, µm", &["/x/before/at_90_um"], 1),
    row("y: error before compensation at 90 mm, µm", &["/y/before/at_90_um"], 1),
    row("x: error before compensation at 100 mm, µm", &["/x/before/at_100_um"], 1),
    row("y: error before compensation at 100 mm, µm", &["/y/before/at_100_um"], 1),
    row("x: degree of the polynomial", &["/x/fit/degree"], 0),
    row("y: degree of the polynomial", &["/y/fit/degree"], 0),
    row("x: mean error per point and direction, µm", &["/x/after/mean_min_um", "/x/after/mean_max_um"], 2),
    row("y: mean error per point and direction, µm", &["/y/after/mean_min_um", "/y/after/mean_max_um"], 2),
    row("x: worst single error, µm", &["/x/after/worst_single_um"], 2),
    row("y: worst single error, µm", &["/y/after/worst_single_um"], 2),
    row("x: spread of 7 runs, µm", &["/x/after/spread_um"], 2),
    row("y: spread of 7 runs, µm", &["/y/after/spread_um"], 2),
    row("x: ISO 230-2 A, R, E, M, B, µm", &ISO_X, 2),
    row("y: ISO 230-2 A, R, E, M, B, µm", &ISO_Y, 2),
    row("tiles from their true places, px rms", &["/mosaic/against_truth/rms_px"], 3),
    row("worst tile, px", &["/mosaic/against_truth/worst_px"], 3),
    row("overlaps, grey levels rms, before … after", &SEAMS, 2),
    row("stage's own time, s", &["/simulated_s"], 0),
    row("time taken, s", &["/wall_s"], 1),
    row("largest memory, MiB", &["/peak_memory_mib"], 0),
];
const ISO_X: [&str; 5] =
    ["/x/after/iso230/A", "/x/after/iso230/R", "/x/after/iso230/E", "/x/after/iso230/M", "/x/after/iso230/B"];
const ISO_Y: [&str; 5] =
    ["/y/after/iso230/A", "/y/after/iso230/R", "/y/after/iso230/E", "/y/after/iso230/M", "/y/after/iso230/B"];
const SEAMS: [&str; 2] = ["/mosaic/stitch/seam_before/level_rms", "/mosaic/stitch/seam_after/level_rms"];
const HOMING_ROWS: [Row; 2] = [
    row("x: largest move of the zero, µm", &["/x/largest_zero_shift_um"], 2),
    row("y: largest move of the zero, µm", &["/y/largest_zero_shift_um"], 2),
];
const EMPTY_PAGE: &str = "# Benchmarks\n\nEvery figure here comes from the command above it.\n";

/// Measures one topic, or all, and writes the page.
pub(crate) fn run(root: &Path, topic: Option<Topic>) -> Result<()> {
    let topics = topic.map_or_else(|| Topic::value_variants().to_vec(), |topic| vec![topic]);
    let file = root.join("docs").join("benchmarks.md");
    for topic in topics {
        let origin = origin(root, topic)?;
        let measured = format!("{origin}\n\n{}", topic.measure(root, &page_of(&file)?)?.trim_end());
        // That may have taken minutes: what somebody wrote meanwhile stays.
        let page = with_section(&page_of(&file)?, topic.name(), &measured)?;
        fs::write(&file, page).with_context(|| format!("cannot write {}", file.display()))?;
        println!("{}: {} is up to date", file.display(), topic.name());
    }
    Ok(())
}

fn page_of(file: &Path) -> Result<String> {
    if !file.exists() {
        return Ok(EMPTY_PAGE.into());
    }
    fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))
}

impl Topic {
    fn name(self) -> &'static str {
        match self {
            Self::Demo => "demo",
            Self::Homing => "homing",
            Self::Edges => "edges",
            Self::Periods => "periods",
            Self::Planner => "planner",
            Self::Paths => "paths",
            Self::Twin => "twin",
            Self::Encoder => "encoder",
            Self::Faults => "faults",
            Self::Cycles => "cycles",
            Self::Sensing => "sensing",
            Self::Golden => "golden",
            Self::Pio => "pio",
            Self::Firmware => "firmware",
            Self::Cosim => "cosim",
        }
    }

    /// What stands in the section from now on; `page` is the page before.
    fn measure(self, root: &Path, page: &str) -> Result<String> {
        match self {
            Self::Demo => demo(root),
            Self::Homing => homing(root),
            // Both examples fail if anything is lost, the planner's if a plan does or takes longer than it may.
            Self::Edges => tables(root, "abbe-core", "edges", &[&EDGES.to_string()]),
            Self::Periods => tables(root, "abbe-core", "periods", &[&EDGES_OF_A_HEAD.to_string()]),
            Self::Planner => tables(root, "abbe-core", "transfer_trials", &[PLANS]),
            Self::Paths => tables(root, "abbe-core", "paths", &[]),
            Self::Twin => twin(root),
            Self::Encoder => tables(root, "abbe-core", "ellipse_trials", &[]),
            Self::Faults => tables(root, "abbe-twin", "encoder_faults", &[FAULT_SEEDS]),
            Self::Cycles => cycles::section(root, page, &today()?, &commit(root)?),
            Self::Sensing => sensing::section(root),
            Self::Golden => golden(root),
            Self::Pio => tables(root, "abbe-cosim", "pio_rates", &[]),
            Self::Firmware => images(root),
            Self::Cosim => cosim(root),
        }
    }
}

/// Which command, when, and of which state of the project.
fn origin(root: &Path, topic: Topic) -> Result<String> {
    Ok(format!("`cargo xtask figures {}`, {}, commit {}", topic.name(), today()?, commit(root)?))
}

fn commit(root: &Path) -> Result<String> {
    let mut git = Command::new("git");
    let commit = stdout_of(git.current_dir(root).args(["describe", "--always", "--dirty"]))?;
    Ok(commit.trim().to_owned())
}

fn today() -> Result<String> {
    Ok(date(SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs() / 86_400))
}

/// The demo's own figures, one column for each seed.
fn demo(root: &Path) -> Result<String> {
    let mut summaries = Vec::new();
    for seed in SEEDS {
        let folder = std::env::temp_dir().join(format!("abbe-figures-{}-{seed}", std::process::id()));
        let (seed, out) = (seed.to_string(), folder.display().to_string());
        let mut command = cargo(root);
        command.args(["run", "--quiet", "--release", "--", "demo", "--json", "--seed", &seed, "--out", &out]);
        stdout_of(&mut command)?;
        summaries.push((format!("seed {seed}"), read_summary(&folder)?));
        fs::remove_dir_all(&folder).with_context(|| format!("cannot remove {out}"))?;
    }
    for words in &readme::LANGUAGES {
        let file = root.join(words.file);
        let page =
            with_section(&fs::read_to_string(&file)?, "readme", &readme::section(words, &summaries[0].1))?;
        fs::write(&file, page).with_context(|| format!("cannot write {}", file.display()))?;
    }
    let papers = root.join("docs").join("papers.md");
    let page = inline::filled(&fs::read_to_string(&papers)?, &summaries[0].1)?;
    fs::write(&papers, page).with_context(|| format!("cannot write {}", papers.display()))?;
    Ok(table(&DEMO_ROWS, &summaries))
}

/// One homing after another, each from a random place.
fn homing(root: &Path) -> Result<String> {
    let mut summaries = Vec::new();
    for seed in HOMING_SEEDS {
        let mut command = cargo(root);
        let (seed, times) = (seed.to_string(), HOMINGS.to_string());
        command.args(["run", "--quiet", "--release", "--"]);
        command.args(["home", "--twin", "--json", "--seed", &seed, "--times", &times]);
        summaries.push((format!("seed {seed}"), serde_json::from_str(&stdout_of(&mut command)?)?));
    }
    Ok(format!(
        "{HOMINGS} homings a seed, each from a random place; a count is 0.1 µm.\n\n{}",
        table(&HOMING_ROWS, &summaries)
    ))
}

/// The lines that the speed example prints.
fn twin(root: &Path) -> Result<String> {
    let mut command = cargo(root);
    command.args(["run", "--quiet", "--release", "-p", "abbe-twin", "--example", "speed"]);
    let lines = stdout_of(&mut command)?;
    ensure!(!lines.trim().is_empty(), "the speed example printed nothing");
    Ok(format!("```text\n{}\n```", lines.trim_end()))
}

/// What `cargo xtask golden` prints.
fn golden(root: &Path) -> Result<String> {
    let mut command = cargo(root);
    command.args(["run", "--quiet", "--release", "-p", "xtask", "--", "golden"]);
    as_printed(&stdout_of(&mut command)?, |line| {
        line.starts_with("scenario") || line.contains("equal") || line.contains("DIFFERS")
    })
}

/// The tables that an example of a crate prints.
fn tables(root: &Path, package: &str, example: &str, arguments: &[&str]) -> Result<String> {
    let mut command = cargo(root);
    command.args(["run", "--quiet", "--release", "-p", package, "--example", example]);
    command.arg("--").args(arguments);
    let tables = stdout_of(&mut command)?;
    ensure!(tables.contains('|'), "the example {example} printed no table");
    Ok(tables)
}

/// What `cargo xtask firmware` prints, without the routines that cost much.
fn images(root: &Path) -> Result<String> {
    let mut command = cargo(root);
    command.args(["run", "--quiet", "--release", "-p", "xtask", "--", "firmware"]);
    as_printed(&stdout_of(&mut command)?, |line| !line.contains("costly") && !line.starts_with("compiling"))
}

/// What the comparison with the twin alone prints.
fn cosim(root: &Path) -> Result<String> {
    let mut command = cargo(root);
    command.args([
        "test",
        "--quiet",
        "--release",
        "-p",
        "abbe-cosim",
        "--features",
        "images",
        "--test",
        "pico",
    ]);
    command.args(["--", "--nocapture", "homing"]).env("ABBE_COSIM", "long");
    as_printed(&stdout_of(&mut command)?, |line| {
        ["ticks compared", "longest tick", "interrupt of core 1", "slowest plan"]
            .iter()
            .any(|said| line.contains(said))
    })
}

/// The lines of a program that are wanted, as it printed them.
fn as_printed(text: &str, wanted: impl Fn(&str) -> bool) -> Result<String> {
    let lines: Vec<&str> = text.lines().filter(|line| wanted(line)).collect();
    ensure!(lines.iter().any(|line| !line.trim().is_empty()), "nothing was printed");
    Ok(format!("```text\n{}\n```", lines.join("\n").trim()))
}

/// A Markdown table: a row for each figure, a column for each summary.
fn table(rows: &[Row], summaries: &[(String, Value)]) -> String {
    let heads: Vec<&str> = summaries.iter().map(|(head, _)| head.as_str()).collect();
    let mut text = format!("| figure | {} |\n|---|{}\n", heads.join(" | "), "---:|".repeat(heads.len()));
    for row in rows {
        let cells: Vec<String> = summaries.iter().map(|(_, summary)| row.cell(summary)).collect();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "| {} | {} |", row.name, cells.join(" | "));
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
    fn every_summary_becomes_a_column_and_a_missing_number_a_dash() {
        let rows = [row("worst, µm", &["/x/worst"], 2), row("range", &["/low", "/high"], 0)];
        let one = json!({ "x": { "worst": 1.256 }, "low": -3, "high": 4 });
        let text = table(&rows, &[("seed 1".into(), one), ("seed 2".into(), json!({}))]);
        assert_eq!(
            text,
            "| figure | seed 1 | seed 2 |\n|---|---:|---:|\n| worst, µm | 1.26 | – |\n| range | -3 … 4 | – … – |\n"
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
