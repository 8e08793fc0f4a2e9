//! The no-panic gate: an image of `firmware/gate` links only when nothing in it can panic.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::commands::stdout_of;
use crate::compiler::{self, Route, THUMB_V6M as TARGET};
use crate::stage::{Outcome, Setting};
use crate::witness::panicking_lines;

/// The symbol that exists nowhere.
const SYMBOL: &str = "undefined symbol: abbe_can_panic";

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let Some(route) = compiler::find_route(setting, &[TARGET]) else {
        return Ok(compiler::not_possible(&[TARGET]));
    };
    println!("compiling for {TARGET} with {}", route.name());
    let messages = link(setting, route, &[])?;
    if messages.contains(SYMBOL) {
        return Ok(Outcome::Failed(who_can_panic(setting, route)?));
    }
    if !messages.is_empty() {
        return Ok(Outcome::Failed(vec![messages]));
    }
    // A gate that nothing can close proves nothing.
    let closed = link(setting, route, &["--features", "known-panic"])?.contains(SYMBOL);
    let finding = "the gate links even with a call that can panic: it proves nothing".to_owned();
    Ok(Outcome::of_findings(if closed { Vec::new() } else { vec![finding] }))
}

/// Builds the image once more in readable form, linked or not, and names the lines that can panic.
fn who_can_panic(setting: &Setting, route: Route) -> Result<Vec<String>> {
    let folder = std::env::temp_dir().join(format!("abbe-gate-{}", std::process::id()));
    let mut command = route.cargo(&folder_of(setting));
    command
        .args(["rustc", "--release", "--quiet", "--bin", "gate", "--target", TARGET, "--target-dir"])
        .arg(&folder);
    command.args(["--", "--emit=llvm-ir", "-C", "link-arg=--unresolved-symbols=ignore-all"]);
    command.env("CARGO_PROFILE_RELEASE_DEBUG", "line-tables-only");
    stdout_of(&mut command)?;
    let image = read_image(&folder.join(TARGET).join("release").join("deps"))?;
    fs::remove_dir_all(&folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    let mut findings = vec!["something that firmware/gate calls can panic:".to_owned()];
    findings.extend(panicking_lines(&image).iter().map(|line| format!("  {line}")));
    Ok(findings)
}

/// The compiler's text form of the gate.
fn read_image(folder: &Path) -> Result<String> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "ll") {
            return fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()));
        }
    }
    bail!("the compiler left no readable image in {}", folder.display())
}

fn folder_of(setting: &Setting) -> PathBuf {
    setting.root.join("firmware").join("gate")
}

/// Builds the gate; what the compiler and the linker said, empty when it linked.
fn link(setting: &Setting, route: Route, arguments: &[&str]) -> Result<String> {
    let mut command = route.cargo(&folder_of(setting));
    command.args(["build", "--release", "--bin", "gate", "--target", TARGET]).args(arguments);
    let output = command.output().with_context(|| format!("cannot start {}", route.name()))?;
    if output.status.success() {
        return Ok(String::new());
    }
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    if messages.is_empty() {
        bail!("the build of the gate ended with {} and said nothing", output.status);
    }
    Ok(messages)
}
