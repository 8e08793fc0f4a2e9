//! The no-panic gate: an image of `firmware/gate` links only when nothing in it can panic.
//!
//! Two ways lead to a compiler for the board: rustup's target, or Debian's `rustc-web`, which builds `core` from its
//! source.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::commands::{cargo, output_of, stdout_of, succeeds};
use crate::stage::{Outcome, Setting};
use crate::witness::panicking_lines;

const TARGET: &str = "thumbv6m-none-eabi";
/// The symbol that exists nowhere.
const SYMBOL: &str = "undefined symbol: abbe_can_panic";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_LLD: &str = "/usr/bin/ld.lld";
const DEBIAN_PACKAGES: [&str; 4] = ["rustc-web", "cargo-web", "rust-web-src", "lld"];

/// A way to compile for the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Route {
    Rustup,
    Debian,
}

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let Some(route) = find_route(setting) else {
        return Ok(Outcome::NotPossible {
            reason: format!("no compiler for {TARGET}"),
            install: format!(
                "rustup target add {TARGET} (or, on Debian, apt-get install -y {})",
                DEBIAN_PACKAGES.join(" ")
            ),
        });
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
    let mut command = route.cargo(setting);
    command.args(["rustc", "--release", "--quiet", "--target", TARGET, "--target-dir"]).arg(&folder);
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

/// Builds the gate; what the compiler and the linker said, empty when it linked.
fn link(setting: &Setting, route: Route, arguments: &[&str]) -> Result<String> {
    let mut command = route.cargo(setting);
    command.args(["build", "--release", "--target", TARGET]).args(arguments);
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

fn find_route(setting: &Setting) -> Option<Route> {
    if rustup_has_target() || (setting.may_install && rustup_brings_target()) {
        return Some(Route::Rustup);
    }
    if debian_is_there() || (setting.may_install && debian_brings_compiler()) {
        return Some(Route::Debian);
    }
    None
}

fn rustup_has_target() -> bool {
    let answer = output_of(Command::new("rustup").args(["target", "list", "--installed"]));
    answer.is_some_and(|output| String::from_utf8_lossy(&output.stdout).lines().any(|line| line == TARGET))
}

fn rustup_brings_target() -> bool {
    succeeds(Command::new("rustup").args(["target", "add", TARGET]))
}

fn debian_is_there() -> bool {
    [DEBIAN_RUSTC, DEBIAN_CARGO].iter().all(|file| Path::new(file).exists()) && debian_has_core_source()
}

/// Building `core` needs its source beside the compiler.
fn debian_has_core_source() -> bool {
    let answer = output_of(Command::new(DEBIAN_RUSTC).args(["--print", "sysroot"]));
    answer.is_some_and(|output| {
        let sysroot = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
        sysroot.join("lib/rustlib/src/rust/library/core").exists()
    })
}

fn debian_brings_compiler() -> bool {
    let updated = succeeds(Command::new("apt-get").arg("update"));
    updated
        && succeeds(Command::new("apt-get").args(["install", "-y"]).args(DEBIAN_PACKAGES))
        && debian_is_there()
}

impl Route {
    fn name(self) -> &'static str {
        match self {
            Self::Rustup => "rustup's target",
            Self::Debian => "Debian's rustc-web",
        }
    }

    /// The cargo of this route, in the folder of the gate.
    fn cargo(self, setting: &Setting) -> Command {
        let folder = setting.root.join("firmware").join("gate");
        match self {
            Self::Rustup => cargo(&folder),
            Self::Debian => {
                let mut command = Command::new(DEBIAN_CARGO);
                command.current_dir(&folder).env("RUSTC_BOOTSTRAP", "1").env("RUSTC", DEBIAN_RUSTC);
                command.args(["-Z", "build-std=core", "--config"]).arg(target_folder(&folder));
                if Path::new(DEBIAN_LLD).exists() {
                    command.env("CARGO_TARGET_THUMBV6M_NONE_EABI_LINKER", DEBIAN_LLD);
                }
                command
            }
        }
    }
}

/// Keeps one compiler's files apart from another's.
fn target_folder(folder: &Path) -> String {
    format!("build.target-dir = {:?}", folder.join("target").join("debian").display().to_string())
}
