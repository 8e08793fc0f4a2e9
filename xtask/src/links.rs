//! The documents: every relative link leads somewhere, and nothing names a place on one machine.

use std::fs;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result};

use crate::stage::{Outcome, Setting};

/// Folders that hold no document of ours.
const SKIPPED: &[&str] = &["target", "node_modules"];
/// Beginnings of paths that exist on one machine only.
const HOMES: &[&str] = &["/home/", "/root/", "/Users/", "C:\\Users\\"];

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let mut findings = Vec::new();
    for file in documents(&setting.root)? {
        let text = fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
        let shown = file.strip_prefix(&setting.root).unwrap_or(&file).display().to_string();
        let folder = file.parent().unwrap_or(&setting.root);
        findings.extend(dead_links(&text, folder).iter().map(|finding| format!("{shown}:{finding}")));
        findings
            .extend(machine_paths(&text, &setting.root).iter().map(|finding| format!("{shown}:{finding}")));
    }
    Ok(Outcome::of_findings(findings))
}

/// Every Markdown file of the project.
fn documents(root: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path.is_dir() {
                let ours =
                    !name.starts_with('.') && !name.starts_with("abbe-demo") && !SKIPPED.contains(&&*name);
                folders.extend(ours.then_some(path));
            } else if path.extension().is_some_and(|extension| extension == "md") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// A finding, `line: sentence`, for each relative link to a file that is not there.
fn dead_links(text: &str, folder: &Path) -> Vec<String> {
    let mut findings = Vec::new();
    for (number, line) in prose(text) {
        for target in targets(&line) {
            let path = target.split('#').next().unwrap_or_default().replace("%20", " ");
            if path.is_empty() || path.contains("://") || path.starts_with("mailto:") {
                continue;
            }
            if path.starts_with('/') {
                findings.push(format!("{number}: the link {target} is not relative"));
            } else if !folder.join(&path).exists() {
                findings.push(format!("{number}: the link {target} leads nowhere"));
            }
        }
    }
    findings
}

/// The lines outside fenced code, numbered from 1, without their inline code.
fn prose(text: &str) -> Vec<(usize, String)> {
    let mut fenced = false;
    let mut lines = Vec::new();
    for (index, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced {
            lines.push((index + 1, without_code(line)));
        }
    }
    lines
}

/// A line without what stands between backquotes.
fn without_code(line: &str) -> String {
    let even = |(index, part): (usize, &str)| (index % 2 == 0).then(|| part.to_owned());
    line.split('`').enumerate().filter_map(even).collect::<Vec<_>>().join("`")
}

/// Where the links of a line lead: `](target)`, `[name]: target`, `src="target"`, `href="target"`.
fn targets(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (opening, closing) in [("](", ')'), ("src=\"", '"'), ("href=\"", '"')] {
        let starts = line.match_indices(opening).map(|(at, _)| &line[at + opening.len()..]);
        found.extend(starts.filter_map(|rest| rest.split(closing).next()));
    }
    if let Some((name, target)) = line.split_once("]: ")
        && name.starts_with('[')
        && !name.starts_with("[^")
    {
        found.push(target);
    }
    // A title may follow the target.
    found
        .iter()
        .filter_map(|target| target.split_whitespace().next())
        .map(|t| t.trim_matches(['<', '>']))
        .collect()
}

/// A finding for each mention of a path that exists on one machine only, in code too.
fn machine_paths(text: &str, root: &Path) -> Vec<String> {
    let mut places: Vec<String> = HOMES.iter().map(|home| (*home).to_owned()).collect();
    places.extend(deep_enough(root).then(|| root.display().to_string()));
    let mut findings = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let named = places.iter().filter(|place| begins_a_path(line, place));
        findings.extend(named.map(|place| format!("{}: {place} exists on one machine only", index + 1)));
    }
    findings
}

/// A checkout straight under `/` has a name too common to look for.
fn deep_enough(root: &Path) -> bool {
    root.components().filter(|part| matches!(part, Component::Normal(_))).count() >= 2
}

/// True when `place` occurs and is not the middle of a longer path or address.
fn begins_a_path(line: &str, place: &str) -> bool {
    line.match_indices(place).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        !before.is_some_and(|c| c.is_alphanumeric() || ".-_~/".contains(c))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_that_leads_nowhere_is_found_with_its_line() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let text = "See [this](Cargo.toml#deps) and [that](missing.md \"title\").\n\n[ref]: src/none.rs\n<img src=\"src/main.rs\">\n";
        assert_eq!(
            dead_links(text, here),
            ["1: the link missing.md leads nowhere", "3: the link src/none.rs leads nowhere"]
        );
    }

    #[test]
    fn addresses_anchors_and_code_are_left_alone() {
        let text = "[a](https://example.org/x) [b](#part) `[c](none)`\n```\n[d](none)\n```\n[^1]: a note\n";
        assert_eq!(dead_links(text, Path::new(".")), Vec::<String>::new());
        assert_eq!(dead_links("[a](/etc/x)", Path::new(".")), ["1: the link /etc/x is not relative"]);
    }

    #[test]
    fn a_path_of_one_machine_is_found_even_in_code() {
        let root = Path::new("/srv/builds/abbe");
        let text = "```\ncd /home/ada/abbe\n```\nand /srv/builds/abbe/x, but docs/home/page and example.org/home/x\n";
        assert_eq!(
            machine_paths(text, root),
            ["2: /home/ exists on one machine only", "4: /srv/builds/abbe exists on one machine only"]
        );
    }
}
