//! The demo, as a user runs it: it ends well and leaves what it promises.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::commands::cargo_stage;
use crate::stage::{Outcome, Setting};

/// Files and folders that the demo promises; a folder must hold something.
const PROMISED: &[&str] = &[
    "report.html",
    "mosaic.tif",
    "mosaic.png",
    "TileConfiguration.registered.txt",
    "compensation.toml",
    "summary.json",
    "measure/readings-x.csv",
    "measure/readings-y.csv",
    "verify/readings-x.csv",
    "verify/readings-y.csv",
    "tiles/TileConfiguration.txt",
    "tiles/positions.csv",
    "truth/trace.csv",
    "truth/TileConfiguration.true.txt",
    "truth/interferometer-verify-y.csv",
];

/// The figures that each axis must hold, by the names in `checks` of the summary.
const AXIS_FIGURES: [&str; 4] = [
    "mean error per point and direction",
    "worst single error",
    "spread of the runs at a point",
    "ISO 230-2 accuracy A",
];

/// The figure that a mosaic must hold.
const MOSAIC_FIGURE: &str = "tiles from their true places, rms";

/// Error of the bare stage at 90 mm by paper A's polynomials, µm, and how far a twin of the same class may be from it.
const BARE_AT_90_UM: [(&str, f64); 2] = [("x", 82.0), ("y", 195.0)];
const SAME_CLASS_UM: f64 = 10.0;

/// One whole demo, and the accuracy part of these seeds besides.
const WHOLE_SEED: u32 = 1;
const ACCURACY_SEEDS: [u32; 2] = [2, 3];

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let mut findings = Vec::new();
    let seeds = std::iter::once((WHOLE_SEED, true)).chain(ACCURACY_SEEDS.map(|seed| (seed, false)));
    for (seed, whole) in seeds {
        let folder = std::env::temp_dir().join(format!("abbe-xtask-demo-{}-{seed}", std::process::id()));
        let ran = run(setting, &folder, seed, whole)?;
        if ran != Outcome::Passed {
            return Ok(ran);
        }
        findings.extend(judge(&folder, whole)?.into_iter().map(|finding| format!("seed {seed}: {finding}")));
        fs::remove_dir_all(&folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    Ok(Outcome::of_findings(findings))
}

fn run(setting: &Setting, folder: &Path, seed: u32, whole: bool) -> Result<Outcome> {
    let (out, seed) = (folder.display().to_string(), seed.to_string());
    let mut arguments = vec!["run", "--quiet", "--release", "--", "demo", "--seed", &seed, "--out", &out];
    if !whole {
        arguments.push("--no-scan");
    }
    cargo_stage(setting, &arguments)
}

fn judge(folder: &Path, whole: bool) -> Result<Vec<String>> {
    let mut findings = if whole { missing(folder) } else { Vec::new() };
    findings.extend(check_summary(&read_summary(folder)?, whole));
    Ok(findings)
}

/// A sentence for each promised thing that is not there.
fn missing(folder: &Path) -> Vec<String> {
    PROMISED
        .iter()
        .filter(|name| !holds_something(&folder.join(name)))
        .map(|name| format!("the demo left no {name}"))
        .collect()
}

fn holds_something(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|file| file.is_file() && file.len() > 0)
}

/// The demo's own account of what it reached.
pub(crate) fn read_summary(folder: &Path) -> Result<Value> {
    let file = folder.join("summary.json");
    let text = fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not JSON", file.display()))
}

/// A sentence for each figure that is missing or outside its limit.
fn check_summary(summary: &Value, whole: bool) -> Vec<String> {
    let mut findings = Vec::new();
    for axis in ["x", "y"] {
        findings.extend(AXIS_FIGURES.iter().filter_map(|figure| check_figure(summary, figure, Some(axis))));
    }
    if whole {
        findings.extend(check_figure(summary, MOSAIC_FIGURE, None));
    }
    findings.extend(BARE_AT_90_UM.iter().filter_map(|&(axis, expected)| check_bare(summary, axis, expected)));
    findings
}

fn check_figure(summary: &Value, figure: &str, axis: Option<&str>) -> Option<String> {
    let of_axis = |check: &&Value| check["figure"] == figure && check["axis"].as_str() == axis;
    let name = axis.map_or_else(|| figure.to_owned(), |axis| format!("{axis}: {figure}"));
    let Some(check) = summary["checks"].as_array().into_iter().flatten().find(of_axis) else {
        return Some(format!("{name} is missing"));
    };
    match (check["value"].as_f64(), check["limit"].as_f64()) {
        (Some(value), Some(limit)) if value <= limit => None,
        (Some(value), Some(limit)) => Some(format!("{name} is {value}, at most {limit}")),
        _ => Some(format!("{name} has no value or no limit")),
    }
}

/// A twin kinder than paper A's stage proves nothing.
fn check_bare(summary: &Value, axis: &str, expected_um: f64) -> Option<String> {
    let found = summary[axis]["before"]["at_90_um"].as_f64();
    let fits = found.is_some_and(|um| (um - expected_um).abs() <= SAME_CLASS_UM);
    (!fits).then(|| {
        format!("{axis}: error of the bare stage at 90 mm is {found:?}, about {expected_um} expected")
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn good() -> Value {
        let mut checks = vec![json!({ "figure": MOSAIC_FIGURE, "value": 0.1, "limit": 0.5 })];
        for axis in ["x", "y"] {
            checks.extend(
                AXIS_FIGURES
                    .map(|figure| json!({ "figure": figure, "axis": axis, "value": 1.0, "limit": 2.0 })),
            );
        }
        json!({
            "checks": checks,
            "x": { "before": { "at_90_um": 80.0 } },
            "y": { "before": { "at_90_um": 199.0 } },
        })
    }

    #[test]
    fn an_empty_folder_lacks_everything() {
        let findings = missing(Path::new("no/such/folder"));
        assert_eq!(findings.len(), PROMISED.len());
        assert!(findings[0].contains("report.html"));
    }

    #[test]
    fn every_figure_is_needed_and_held_to_its_limit() {
        assert_eq!(check_summary(&good(), true), Vec::<String>::new());
        assert_eq!(check_summary(&json!({}), true).len(), 11);
        for number in 0..9 {
            let mut bad = good();
            bad["checks"][number]["value"] = json!(2.5);
            assert_eq!(check_summary(&bad, true).len(), 1, "{number}");
        }
    }

    #[test]
    fn a_kind_twin_is_found_out() {
        let mut kind = good();
        kind["y"]["before"]["at_90_um"] = json!(20.0);
        assert_eq!(check_summary(&kind, false).len(), 1);
    }
}
