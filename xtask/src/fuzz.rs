//! The stage "fuzz": each target of `fuzz/` for a bounded time, from its corpus on.
//!
//! The targets are built by the stable compiler ([`fuzz/.cargo/config.toml`](../../fuzz/.cargo/config.toml)). What a run
//! finds on its way stays in a copy of the corpus, so that the repository stays clean and every run begins alike.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use anyhow::{Context, Result};

use crate::commands::{cargo, output_of, stdout_of, succeeds};
use crate::stage::{Outcome, Setting};

/// A target, and how far a run goes: whichever bound comes first.
struct Target {
    name: &'static str,
    runs: u32,
    seconds: u32,
    /// Features (libFuzzer's `ft`) that even a short run covers. Without instrumentation there are none.
    least_features: u64,
}

const TARGETS: [Target; 2] = [
    Target { name: "gcode", runs: 200_000, seconds: 40, least_features: 1500 },
    Target { name: "planner", runs: 100_000, seconds: 40, least_features: 1500 },
];

/// libFuzzer is written in C++, and built with the target.
const COMPILERS: [&str; 3] = ["c++", "g++", "clang++"];
const INSTALL: &str = "apt-get update && apt-get install -y g++";

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let can_build = has_compiler() || (setting.may_install && brings_compiler());
    if !can_build {
        return Ok(Outcome::NotPossible {
            reason: "no C++ compiler for libFuzzer".into(),
            install: INSTALL.into(),
        });
    }
    build(&setting.root)?;
    let mut findings = Vec::new();
    for target in &TARGETS {
        findings.extend(run(&setting.root, target)?);
    }
    Ok(Outcome::of_findings(findings))
}

fn has_compiler() -> bool {
    COMPILERS.iter().any(|name| {
        output_of(Command::new(name).arg("--version")).is_some_and(|output| output.status.success())
    })
}

fn brings_compiler() -> bool {
    succeeds(Command::new("apt-get").arg("update"))
        && succeeds(Command::new("apt-get").args(["install", "-y", "g++"]))
        && has_compiler()
}

fn build(root: &Path) -> Result<()> {
    let mut command = cargo(&root.join("fuzz"));
    stdout_of(command.args(["build", "--release", "--locked", "--bins"]))
        .context("the fuzz targets do not build")?;
    Ok(())
}

/// What is wrong with a target: a sentence, if it found something.
fn run(root: &Path, target: &Target) -> Result<Option<String>> {
    let folder = root.join("target/fuzz").join(target.name);
    let corpus = copy_of_corpus(root, target, &folder)?;
    let mut command = fuzzer(root, target);
    command.arg("-seed=1").arg(format!("-runs={}", target.runs));
    command.arg(format!("-max_total_time={}", target.seconds));
    command.arg(format!("-artifact_prefix={}/", folder.display()));
    if target.dictionary(root).exists() {
        command.arg(format!("-dict={}", target.dictionary(root).display()));
    }
    let output = command
        .arg(corpus)
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("cannot start the fuzz target {}", target.name))?;
    Ok(judge(target, &folder, &output))
}

/// A target as cargo runs it: what comes behind are words for libFuzzer.
fn fuzzer(root: &Path, target: &Target) -> Command {
    let mut command = cargo(&root.join("fuzz"));
    command.args(["run", "--quiet", "--release", "--locked", "--bin", target.name, "--"]);
    command
}

impl Target {
    fn dictionary(&self, root: &Path) -> PathBuf {
        root.join("fuzz").join(format!("{}.dict", self.name))
    }
}

/// An empty folder but for the files of the corpus, in a folder that has nothing of a run before.
fn copy_of_corpus(root: &Path, target: &Target, folder: &Path) -> Result<PathBuf> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("cannot empty {}", folder.display()))?;
    }
    let (from, to) = (root.join("fuzz/corpus").join(target.name), folder.join("corpus"));
    fs::create_dir_all(&to).with_context(|| format!("cannot make {}", to.display()))?;
    let files = fs::read_dir(&from).with_context(|| format!("cannot read {}", from.display()))?;
    for file in files {
        let file = file.with_context(|| format!("cannot read {}", from.display()))?;
        let copy = to.join(file.file_name());
        fs::copy(file.path(), &copy).with_context(|| format!("cannot write {}", copy.display()))?;
    }
    Ok(to)
}

fn judge(target: &Target, folder: &Path, output: &Output) -> Option<String> {
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Some(finding(target, &said, folder));
    }
    let (runs, features) = (runs(&said), features(&said));
    let [runs_shown, features_shown] = [runs, features].map(|number| number.unwrap_or(0).to_string());
    println!("{}: {runs_shown} runs, {features_shown} features, no finding", target.name);
    let covered = features.is_some_and(|features| features >= target.least_features);
    (!covered).then(|| {
        let least = target.least_features;
        format!(
            "{}: {features_shown} features are covered, at least {least} should be: is it instrumented?",
            target.name
        )
    })
}

/// What a target that ended badly has to say: its first words, the input, and how to see it again.
fn finding(target: &Target, said: &str, folder: &Path) -> String {
    let name = target.name;
    let Some(input) = said.lines().find_map(|line| line.split("Test unit written to ").nth(1)) else {
        let last: Vec<&str> = said.lines().rev().take(5).collect();
        return format!("{name}: ended without an input in {}: {last:?}", folder.display());
    };
    let words =
        said.lines().skip_while(|line| !line.contains("panicked at")).take(2).collect::<Vec<_>>().join(" ");
    format!(
        "{name}: {words}\n  input: {input}\n  again: (cd fuzz && cargo run --release --bin {name} -- {input})"
    )
}

/// Of `Done 200000 runs in 12 second(s)`.
fn runs(said: &str) -> Option<u64> {
    let rest = said.lines().find_map(|line| line.strip_prefix("Done "))?;
    rest.split(' ').next()?.parse().ok()
}

/// Of the last `… ft: 3058 …`.
fn features(said: &str) -> Option<u64> {
    let rest = said.rsplit_once(" ft: ")?.1;
    rest.split(' ').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use std::os::unix::process::ExitStatusExt;
    use std::process::ExitStatus;

    use super::*;

    fn ended(status: i32, said: &str) -> Option<String> {
        let output =
            Output { status: ExitStatus::from_raw(status << 8), stdout: vec![], stderr: said.into() };
        judge(&TARGETS[0], Path::new("target/fuzz/gcode"), &output)
    }

    #[test]
    fn a_target_that_ends_badly_names_its_input_and_the_way_to_see_it_again() {
        let said = "INFO: Seed: 1\n\nthread 'main' panicked at gcode.rs:3:1:\nno column\nstack backtrace:\n\
                    artifact_prefix='t/'; Test unit written to t/crash-0a\n";
        assert_eq!(
            ended(77, said).as_deref(),
            Some(
                "gcode: thread 'main' panicked at gcode.rs:3:1: no column\n  input: t/crash-0a\n  \
                 again: (cd fuzz && cargo run --release --bin gcode -- t/crash-0a)"
            )
        );
        assert!(ended(1, "error: no such option").is_some_and(|finding| finding.contains("no such option")));
    }

    #[test]
    fn a_good_end_counts_only_if_something_was_covered() {
        let good = "#7\tINITED cov: 9 ft: 12 corp: 3/7b\n#200000\tDONE   cov: 783 ft: 3058 corp: 5/9b lim: 4\nDone 200000 runs in 12 second(s)\n";
        assert_eq!((runs(good), features(good)), (Some(200_000), Some(3058)));
        assert_eq!(ended(0, good), None);
        assert!(ended(0, "Done 200000 runs in 12 second(s)\n").is_some_and(|f| f.contains("instrumented")));
        assert!(ended(0, &good.replace("3058", "20")).is_some_and(|f| f.contains("20 features")));
    }

    #[test]
    fn every_target_is_in_the_fuzz_workspace_and_has_a_corpus() {
        let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz");
        let manifest = fs::read_to_string(fuzz.join("Cargo.toml")).unwrap();
        assert_eq!(manifest.matches("[[bin]]").count(), TARGETS.len());
        for target in &TARGETS {
            assert!(manifest.contains(&format!("name = \"{}\"", target.name)));
            let files = fs::read_dir(fuzz.join("corpus").join(target.name)).unwrap();
            assert!((5..100).contains(&files.count()), "{}", target.name);
        }
    }
}
