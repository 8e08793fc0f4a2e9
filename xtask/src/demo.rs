//! The demo, as a user runs it: it ends well and leaves what it promises.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;

use crate::commands::cargo_stage;
use crate::stage::{Outcome, Setting};

/// Files and folders that the demo promises; a folder must hold something.
const PROMISED: &[&str] = &[
    "report.html",
    "mosaic.png",
    "summary.json",
    "measure/readings-x.csv",
    "measure/readings-y.csv",
    "verify/readings-x.csv",
    "verify/readings-y.csv",
    "tiles",
    "truth",
];

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let folder = std::env::temp_dir().join(format!("abbe-xtask-demo-{}", std::process::id()));
    let ran = run(setting, &folder)?;
    if ran != Outcome::Passed {
        return Ok(ran);
    }
    let mut findings = missing(&folder);
    if findings.is_empty() {
        findings = check_summary(&read_summary(&folder)?);
    }
    if findings.is_empty() {
        fs::remove_dir_all(&folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    } else {
        findings.push(format!("the demo's folder is kept: {}", folder.display()));
    }
    Ok(Outcome::of_findings(findings))
}

fn run(setting: &Setting, folder: &Path) -> Result<Outcome> {
    let out = folder.display().to_string();
    cargo_stage(setting, &["run", "--quiet", "--release", "--", "demo", "--out", &out])
}

/// A sentence for each promised thing that is not there.
fn missing(folder: &Path) -> Vec<String> {
    let mut findings: Vec<String> = PROMISED
        .iter()
        .filter(|name| !holds_something(&folder.join(name)))
        .map(|name| format!("the demo left no {name}"))
        .collect();
    let is_mosaic = |path: &PathBuf| path.extension().is_some_and(|e| e == "tif" || e == "tiff");
    if !contents(folder).iter().any(is_mosaic) {
        findings.push("the demo left no mosaic in full size".into());
    }
    findings
}

fn holds_something(path: &Path) -> bool {
    if path.is_dir() {
        !contents(path).is_empty()
    } else {
        fs::metadata(path).is_ok_and(|file| file.len() > 0)
    }
}

fn contents(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    entries.filter_map(Result::ok).map(|entry| entry.path()).collect()
}

/// The demo's own account of what it reached.
pub(crate) fn read_summary(folder: &Path) -> Result<Value> {
    let file = folder.join("summary.json");
    let text = fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not JSON", file.display()))
}

/// A sentence for each figure that is missing or outside its limit.
fn check_summary(summary: &Value) -> Vec<String> {
    match summary.as_object() {
        Some(figures) if !figures.is_empty() => Vec::new(),
        _ => vec!["summary.json holds no figures".into()],
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn an_empty_folder_lacks_everything() {
        let findings = missing(Path::new("no/such/folder"));
        assert_eq!(findings.len(), PROMISED.len() + 1);
        assert!(findings[0].contains("report.html"));
    }

    #[test]
    fn a_summary_without_figures_is_refused() {
        assert!(check_summary(&json!({ "a": 1 })).is_empty());
        assert!(!check_summary(&json!({})).is_empty());
        assert!(!check_summary(&json!([1])).is_empty());
    }
}
