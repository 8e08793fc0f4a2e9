//! Licences and sources of all we build on.
//!
//! `cargo deny` does it where it is installed. Building it takes minutes, so elsewhere this program asks cargo the
//! same two questions itself; it does so in any case, because two answers are better than one.

use std::fs;
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::commands::{cargo, cargo_stage, output_of};
use crate::metadata::{self, packages, text};
use crate::stage::{Outcome, Setting};

const CRATES_IO: &str = "registry+https://github.com/rust-lang/crates.io-index";

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let file = setting.root.join("deny.toml");
    let rules = fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
    let allowed = allowed_licences(&rules).context("deny.toml has no list `allow` under [licenses]")?;
    let metadata = metadata::read(&setting.root, &["--locked"])?;
    let findings: Vec<String> = packages(&metadata).iter().filter_map(|p| finding(p, &allowed)).collect();
    println!("{} packages, {} findings", packages(&metadata).len(), findings.len());
    if findings.is_empty() && deny_is_installed(setting) {
        return cargo_stage(setting, &["deny", "check", "bans", "licenses", "sources"]);
    }
    Ok(Outcome::of_findings(findings))
}

fn deny_is_installed(setting: &Setting) -> bool {
    let mut command: Command = cargo(&setting.root);
    output_of(command.args(["deny", "--version"])).is_some_and(|output| output.status.success())
}

/// The quoted words of `allow = [ … ]` under `[licenses]`.
fn allowed_licences(rules: &str) -> Option<Vec<String>> {
    let section = rules.split("\n[licenses]").nth(1)?.split("\n[").next()?;
    let list = section.split("allow = [").nth(1)?.split(']').next()?;
    let quoted = list.split('"').enumerate().filter(|(index, _)| index % 2 == 1);
    Some(quoted.map(|(_, licence)| licence.to_owned()).collect())
}

/// What is wrong with a package.
fn finding(package: &Value, allowed: &[String]) -> Option<String> {
    let name = format!("{} {}", text(package, "name"), text(package, "version"));
    // A package without a source is a folder of this workspace.
    let source = package["source"].as_str().unwrap_or(CRATES_IO);
    if source != CRATES_IO {
        return Some(format!("{name} comes from {source}, not from crates.io"));
    }
    let licence = text(package, "license");
    if licence.is_empty() {
        return Some(format!("{name} states no licence"));
    }
    (!permitted(licence, allowed))
        .then(|| format!("{name} has the licence {licence}, which deny.toml does not allow"))
}

/// True when an SPDX expression can be met with the allowed licences. `/` is an old spelling of OR.
fn permitted(expression: &str, allowed: &[String]) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = words.as_slice();
    any_of(&mut rest, allowed) && rest.is_empty()
}

/// `all OR all OR …`
fn any_of(words: &mut &[&str], allowed: &[String]) -> bool {
    let mut met = all_of(words, allowed);
    while took(words, "OR") {
        met |= all_of(words, allowed);
    }
    met
}

/// `one AND one AND …`
fn all_of(words: &mut &[&str], allowed: &[String]) -> bool {
    let mut met = one(words, allowed);
    while took(words, "AND") {
        met &= one(words, allowed);
    }
    met
}

/// A licence, perhaps WITH an exception, or an expression in parentheses.
fn one(words: &mut &[&str], allowed: &[String]) -> bool {
    if took(words, "(") {
        let met = any_of(words, allowed);
        return took(words, ")") && met;
    }
    let Some((first, rest)) = words.split_first() else {
        return false;
    };
    *words = rest;
    let mut licence = (*first).to_owned();
    if took(words, "WITH")
        && let Some((exception, rest)) = words.split_first()
    {
        licence = format!("{licence} WITH {exception}");
        *words = rest;
    }
    allowed.contains(&licence)
}

/// Takes the next word if it is this one.
fn took(words: &mut &[&str], word: &str) -> bool {
    match words.split_first() {
        Some((first, rest)) if *first == word => {
            *words = rest;
            true
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn allowed() -> Vec<String> {
        ["MIT", "Apache-2.0", "Unicode-3.0", "Apache-2.0 WITH LLVM-exception"].map(str::to_owned).to_vec()
    }

    #[test]
    fn expressions_are_understood() {
        let cases = [
            ("MIT", true),
            ("MIT/Apache-2.0", true),
            ("GPL-3.0-only", false),
            ("MIT OR GPL-3.0-only", true),
            ("MIT AND GPL-3.0-only", false),
            ("(MIT OR GPL-3.0-only) AND Unicode-3.0", true),
            ("MIT OR (GPL-3.0-only AND Unicode-3.0)", true),
            ("GPL-2.0-only OR GPL-3.0-only AND MIT", false),
            ("Apache-2.0 WITH LLVM-exception", true),
            ("MIT WITH LLVM-exception", false),
            ("(MIT", false),
            ("MIT MIT", false),
            ("", false),
        ];
        for (expression, expected) in cases {
            assert_eq!(permitted(expression, &allowed()), expected, "{expression}");
        }
    }

    #[test]
    fn another_source_and_a_missing_licence_are_found() {
        let package = |source: Value, licence: Value| json!({ "name": "a", "version": "1.0.0", "source": source, "license": licence });
        let say = |package: Value| finding(&package, &allowed()).unwrap_or_default();
        assert_eq!(say(package(json!(CRATES_IO), json!("MIT"))), "");
        assert_eq!(say(package(Value::Null, json!("MIT"))), "");
        assert!(say(package(json!("git+https://example.org/a"), json!("MIT"))).contains("example.org"));
        assert!(say(package(json!(CRATES_IO), Value::Null)).contains("states no licence"));
        assert!(
            say(package(json!(CRATES_IO), json!("GPL-3.0-only"))).contains("a 1.0.0 has the licence GPL")
        );
    }

    #[test]
    fn the_list_is_read_from_the_rules() {
        let rules = "[graph]\nx = 1\n\n[licenses]\n# why\nallow = [\n  \"MIT\",\n  \"Zlib\",\n]\n[bans]\nallow = [\"no\"]\n";
        assert_eq!(allowed_licences(rules).unwrap(), ["MIT", "Zlib"]);
        assert_eq!(allowed_licences("[bans]\n"), None);
    }
}
