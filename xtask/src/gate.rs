//! The no-panic gate: an image of `firmware/gate` links only when nothing in it can panic.
//!
//! Two ways lead to a compiler for the board: rustup's target, or Debian's `rustc-web`, which builds `core` from its
//! source.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::commands::{cargo, output_of, succeeds};
use crate::stage::{Outcome, Setting};

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
            install: format!("rustup target add {TARGET}"),
        });
    };
    println!("compiling for {TARGET} with {}", route.name());
    if let Some(finding) = shut_without_reason(&link(setting, route, &[])?) {
        return Ok(Outcome::Failed(vec![finding]));
    }
    // A gate that nothing can close proves nothing.
    let closed = link(setting, route, &["--features", "known-panic"])?.contains(SYMBOL);
    let finding = "the gate links even with a call that can panic: it proves nothing".to_owned();
    Ok(Outcome::of_findings(if closed { Vec::new() } else { vec![finding] }))
}

/// What to say when the gate's image does not link. `messages`: all the linker said; empty when it linked.
fn shut_without_reason(messages: &str) -> Option<String> {
    if messages.is_empty() {
        return None;
    }
    if messages.contains(SYMBOL) {
        return Some(
            "something that firmware/gate calls can panic; cargo rustc --release -- --emit=llvm-ir \
             -C link-arg=--unresolved-symbols=ignore-all in that folder shows who calls core::panicking"
                .into(),
        );
    }
    Some(messages.to_owned())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_path_is_told_from_another_failure() {
        assert_eq!(shut_without_reason(""), None);
        let panic = shut_without_reason("rust-lld: error: undefined symbol: abbe_can_panic").unwrap();
        assert!(panic.contains("can panic"), "{panic}");
        let other = shut_without_reason("error[E0463]: can't find crate for `core`").unwrap();
        assert!(other.contains("E0463"), "{other}");
    }
}
