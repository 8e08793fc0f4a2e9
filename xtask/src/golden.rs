//! `cargo xtask golden`: the golden traces on every body, and their hashes side by side.
//!
//! The program `golden` of `crates/cosim` does the work. Its run is slow and has two uses, the hashes and the cycles, so
//! it happens once.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::commands::{cargo, output_of, stdout_of, succeeds};
use crate::compiler::{self, Route, THUMB_V6M, THUMB_V7M, THUMB_V8M};
use crate::firmware::{Build, built};
use crate::stage::{Outcome, Setting};

const QEMU: &str = "qemu-system-arm";

/// A processor that is emulated: the option of `golden` that takes its image, and how the image is built.
struct Body {
    option: &'static str,
    build: Build,
}

const fn body(option: &'static str, target: &'static str, features: &'static [&'static str]) -> Body {
    Body { option, build: Build { folder: "golden", name: "golden", target, features } }
}

/// In an emulator that is a crate.
const RP2040: Body = body("--rp2040", THUMB_V6M, &["rp2040"]);
/// In QEMU.
const IN_QEMU: [Body; 2] = [body("--m3", THUMB_V7M, &[]), body("--m33", THUMB_V8M, &[])];

/// The stage of `cargo xtask test`.
pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let Some(report) = replays(setting)? else { return Ok(without_compiler(setting)) };
    print!("{}", table(report));
    let findings = differences(report);
    if !findings.is_empty() {
        return Ok(Outcome::Failed(findings));
    }
    if !has_qemu(setting) {
        return Ok(without_qemu());
    }
    let mut bodies_notice = cargo(&setting.root);
    bodies_notice.env("ABBE_GOLDEN_IMAGES", images(setting)?);
    bodies_notice.args(["test", "--release", "-p", "abbe-cosim", "--features", "images"]);
    let noticed = succeeds(bodies_notice.args(["--test", "golden_everywhere"]));
    let finding = "a body does not notice that a trace was altered or that outputs differ".to_owned();
    Ok(Outcome::of_findings(if noticed { Vec::new() } else { vec![finding] }))
}

/// The chore: replays everywhere; true when all hashes are equal.
///
/// # Errors
/// An image does not build, or a body does not answer.
pub(crate) fn run(setting: &Setting) -> Result<bool> {
    match check(setting)? {
        Outcome::Passed => Ok(true),
        Outcome::Failed(findings) => {
            println!("{}", findings.join("\n"));
            Ok(false)
        }
        Outcome::NotPossible { reason, install } => {
            println!("not possible here: {reason}; to install: {install}");
            Ok(false)
        }
    }
}

/// The chore with `--record`: plays the scripts on the twin, writes the traces and says which have changed.
///
/// # Errors
/// A script does not go as it says.
pub(crate) fn record(root: &Path) -> Result<bool> {
    print!("{}", stdout_of(golden(root).arg("record"))?);
    Ok(true)
}

/// All traces on every body that there is here, once; none without a compiler for the images.
///
/// # Errors
/// An image does not build, or a body does not answer.
pub(crate) fn replays(setting: &Setting) -> Result<Option<&'static Value>> {
    static REPORT: OnceLock<Value> = OnceLock::new();
    if REPORT.get().is_none() {
        let Some(route) = route(setting) else { return Ok(None) };
        _ = REPORT.set(replay_all(setting, route)?);
    }
    Ok(REPORT.get())
}

fn replay_all(setting: &Setting, route: Route) -> Result<Value> {
    eprintln!("compiling with {}", route.name());
    let mut command = golden(&setting.root);
    command.arg("replay");
    for body in bodies(setting) {
        command.arg(body.option).arg(built(setting, route, &body.build)?);
    }
    let report: Value =
        serde_json::from_str(&stdout_of(&mut command)?).context("golden did not print JSON")?;
    ensure!(!rows(&report).is_empty(), "golden replayed nothing");
    Ok(report)
}

fn bodies(setting: &Setting) -> Vec<Body> {
    std::iter::once(RP2040).chain(IN_QEMU.into_iter().filter(|_| has_qemu(setting))).collect()
}

/// What the images are built for.
pub(crate) fn targets(setting: &Setting) -> Vec<&'static str> {
    bodies(setting).iter().map(|body| body.build.target).collect()
}

fn route(setting: &Setting) -> Option<Route> {
    compiler::find_route(setting, &targets(setting))
}

/// The folder in which each target has its image.
fn images(setting: &Setting) -> Result<PathBuf> {
    let route = route(setting).context("there is no compiler any more")?;
    Ok(route.target_folder(&setting.root.join("firmware").join(RP2040.build.folder)))
}

fn golden(root: &Path) -> Command {
    let mut command = cargo(root);
    command.args(["run", "--quiet", "--release", "-p", "abbe-cosim", "--bin", "golden", "--"]);
    command
}

/// Whether QEMU is there; brings it where that is allowed.
fn has_qemu(setting: &Setting) -> bool {
    static THERE: OnceLock<bool> = OnceLock::new();
    *THERE.get_or_init(|| qemu_starts() || (setting.may_install && qemu_comes()))
}

fn qemu_starts() -> bool {
    output_of(Command::new(QEMU).arg("--version")).is_some_and(|output| output.status.success())
}

fn qemu_comes() -> bool {
    succeeds(Command::new("apt-get").arg("update"))
        && succeeds(Command::new("apt-get").args(["install", "-y", QEMU]))
        && qemu_starts()
}

fn without_qemu() -> Outcome {
    Outcome::NotPossible {
        reason: format!("no {QEMU}: nothing was replayed on a Cortex-M3 and M33"),
        install: format!("apt-get install -y {QEMU}"),
    }
}

/// What a stage answers where [`replays`] has nothing.
pub(crate) fn without_compiler(setting: &Setting) -> Outcome {
    compiler::not_possible(&targets(setting))
}

fn rows(report: &Value) -> &[Value] {
    report["replays"].as_array().map_or(&[], Vec::as_slice)
}

fn text<'a>(row: &'a Value, key: &str) -> &'a str {
    row[key].as_str().unwrap_or_default()
}

/// A sentence for each body that ends in something else.
fn differences(report: &Value) -> Vec<String> {
    let sentence = |row: &Value| {
        row["difference"]
            .as_str()
            .map(|what| format!("{} on {}: {what}", text(row, "scenario"), text(row, "body")))
    };
    rows(report).iter().filter_map(sentence).collect()
}

/// Scenario by body, with the ticks and the hash that this machine found.
fn table(report: &Value) -> String {
    let mut bodies: Vec<&str> = rows(report).iter().map(|row| text(row, "body")).collect();
    bodies.dedup();
    let of_body = |body: &str, scenario: &str| {
        rows(report).iter().find(|row| text(row, "body") == body && text(row, "scenario") == scenario)
    };
    let mut table = format!("{:<18} {:>6}  {:<16}", "scenario", "ticks", "hash");
    for body in &bodies {
        _ = write!(table, "  {body:<5}");
    }
    table.truncate(table.trim_end().len());
    table.push('\n');
    for here in rows(report).iter().filter(|row| Some(&text(row, "body")) == bodies.first()) {
        let scenario = text(here, "scenario");
        _ = write!(
            table,
            "{scenario:<18} {:>6}  {:<16}",
            here["ticks"].as_u64().unwrap_or(0),
            text(here, "hash")
        );
        for body in &bodies {
            let word = match of_body(body, scenario) {
                Some(row) if row["difference"].is_null() => "equal",
                Some(_) => "DIFFERS",
                None => "–",
            };
            _ = write!(table, "  {word:<width$}", width = body.chars().count().max(5));
        }
        table.truncate(table.trim_end().len());
        table.push('\n');
    }
    table
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn report() -> Value {
        let row = |scenario: &str, body: &str, difference: Option<&str>| {
            json!({ "scenario": scenario, "body": body, "ticks": 300, "hash": "0123456789abcdef",
                    "difference": difference })
        };
        json!({ "replays": [
            row("home", "here", None),
            row("stop", "here", None),
            row("home", "M3", None),
            row("stop", "M3", Some("the outputs differ within ticks 1000 … 2000")),
        ] })
    }

    #[test]
    fn the_table_has_a_row_a_scenario_and_a_column_a_body() {
        let table = table(&report());
        assert_eq!(
            table,
            "scenario            ticks  hash              here   M3\n\
             home                  300  0123456789abcdef  equal  equal\n\
             stop                  300  0123456789abcdef  equal  DIFFERS\n"
        );
    }

    #[test]
    fn a_difference_is_told_with_scenario_body_and_ticks() {
        assert_eq!(differences(&report()), ["stop on M3: the outputs differ within ticks 1000 … 2000"]);
    }
}
