//! Which crate may depend on which, and who may read a preset's truth.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::Value;

use crate::metadata::{self, packages, text};
use crate::stage::{Outcome, Setting};

/// A crate of ours, and those of ours it may depend on, in its tests too.
const ARROWS: &[(&str, &[&str])] = &[
    ("abbe-core", &[]),
    ("abbe-proto", &["abbe-core"]),
    ("abbe-twin", &["abbe-core"]),
    ("abbe-metrology", &["abbe-core"]),
    ("abbe-mosaic", &["abbe-core"]),
    ("abbe-cosim", &["abbe-core", "abbe-proto", "abbe-twin"]),
    ("abbe", &["abbe-core", "abbe-proto", "abbe-twin", "abbe-metrology", "abbe-mosaic"]),
    ("xtask", &[]),
];

/// Spellings by which a program reads the `[plant]` part of a preset.
const TRUTH: &[&str] = &["[plant", "\"plant"];

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let metadata = metadata::read(&setting.root, &["--no-deps"])?;
    let mut findings = wrong_arrows(&metadata);
    findings.extend(readers_of_truth(&setting.root)?);
    Ok(Outcome::of_findings(findings))
}

/// A sentence for each dependency that points the wrong way.
fn wrong_arrows(metadata: &Value) -> Vec<String> {
    let is_ours = |name: &str| packages(metadata).iter().any(|package| text(package, "name") == name);
    let mut findings = Vec::new();
    for package in packages(metadata) {
        let name = text(package, "name");
        let Some((_, allowed)) = ARROWS.iter().find(|(from, _)| *from == name) else {
            findings.push(format!("the crate {name} has no row in xtask/src/arrows.rs"));
            continue;
        };
        let targets = package["dependencies"].as_array().map_or(&[][..], Vec::as_slice);
        let wrong = targets.iter().map(|target| text(target, "name"));
        let wrong = wrong.filter(|target| is_ours(target) && !allowed.contains(target));
        findings.extend(wrong.map(|target| format!("{name} must not depend on {target}")));
    }
    findings
}

/// A sentence for each line outside the twin that reads the truth.
fn readers_of_truth(root: &Path) -> Result<Vec<String>> {
    let mut findings = Vec::new();
    for file in rust_sources(root)? {
        let shown = file.strip_prefix(root).unwrap_or(&file).display().to_string();
        for (number, line) in truth_read_in(&fs::read_to_string(&file)?) {
            findings.push(format!("{shown}:{number}: only crates/twin reads [plant]: {line}"));
        }
    }
    Ok(findings)
}

/// The lines of a source that read the truth, numbered from 1. Comments may name it, tests may alter it, and a parser
/// of the whole preset may step over it (`IgnoredAny`).
fn truth_read_in(source: &str) -> Vec<(usize, String)> {
    let program: Vec<&str> = source.lines().take_while(|line| line.trim() != "#[cfg(test)]").collect();
    let steps_over =
        |index: usize| program.iter().skip(index).take(2).any(|line| line.contains("IgnoredAny"));
    let lines = program.iter().enumerate().filter(|(index, line)| reads_truth(line) && !steps_over(*index));
    lines.map(|(index, line)| (index + 1, line.trim().to_owned())).collect()
}

fn reads_truth(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    TRUTH.iter().any(|spelling| code.contains(spelling))
}

/// Every source file under `crates/*/src` but the twin's.
fn rust_sources(root: &Path) -> Result<Vec<PathBuf>> {
    let mut folders = Vec::new();
    for entry in fs::read_dir(root.join("crates"))? {
        let folder = entry?.path();
        if folder.file_name().is_some_and(|name| name != "twin") {
            folders.push(folder.join("src"));
        }
    }
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs")
                && !path.ends_with("tests.rs")
            {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn package(name: &str, targets: &[&str]) -> Value {
        let targets: Vec<Value> = targets.iter().map(|target| json!({ "name": target })).collect();
        json!({ "name": name, "dependencies": targets })
    }

    #[test]
    fn an_arrow_against_the_rule_is_found_and_an_outside_one_is_not() {
        let metadata = json!({ "packages": [
            package("abbe-core", &["libm"]),
            package("abbe-twin", &["abbe-core", "image"]),
            package("abbe-mosaic", &["abbe-twin"]),
            package("abbe-extra", &[]),
        ]});
        let findings = wrong_arrows(&metadata);
        assert_eq!(findings.len(), 2, "{findings:?}");
        assert_eq!(findings[0], "abbe-mosaic must not depend on abbe-twin");
        assert!(findings[1].contains("abbe-extra has no row"));
    }

    #[test]
    fn code_that_reads_the_truth_is_told_from_a_comment_that_names_it() {
        let found =
            |source: &str| truth_read_in(source).iter().map(|(number, _)| *number).collect::<Vec<_>>();
        assert_eq!(found("\nlet truth = table.get(\"plant\");\nlet text = \"[plant.x]\";"), [2, 3]);
        assert!(found("/// Nothing but the twin reads `[plant]`.\nlet plantation = 1;").is_empty());
        assert!(found("#[serde(rename = \"plant\")]\n_plant: IgnoredAny,").is_empty());
        assert_eq!(found("#[serde(rename = \"plant\")]\nplant: toml::Table,"), [1]);
        assert!(found("#[cfg(test)]\nmod tests { fn f() { \"plant\"; } }").is_empty());
    }
}
