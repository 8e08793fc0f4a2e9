//! A compiler for the boards: where it comes from and how it is called.
//!
//! Two ways lead to one: rustup's targets, or Debian's `rustc-web`, which builds `core` from its source.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::commands::{cargo, output_of, succeeds};
use crate::stage::{Outcome, Setting};

/// The RP2040 of a Pico, a Cortex-M0+.
pub(crate) const THUMB_V6M: &str = "thumbv6m-none-eabi";
/// A Cortex-M3, as QEMU's `lm3s6965evb` has it.
pub(crate) const THUMB_V7M: &str = "thumbv7m-none-eabi";
/// A Cortex-M33 without its floating-point unit, as QEMU's `mps2-an505` and the RP2350 have it.
pub(crate) const THUMB_V8M: &str = "thumbv8m.main-none-eabi";

const TARGETS: [&str; 3] = [THUMB_V6M, THUMB_V7M, THUMB_V8M];
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_LLD: &str = "/usr/bin/ld.lld";
const DEBIAN_PACKAGES: [&str; 4] = ["rustc-web", "cargo-web", "rust-web-src", "lld"];

/// A way to compile for a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Route {
    Rustup,
    Debian,
}

/// The first route that can compile for all `targets`; installs what it lacks where that is allowed.
pub(crate) fn find_route(setting: &Setting, targets: &[&str]) -> Option<Route> {
    if rustup_has(targets) || (setting.may_install && rustup_brings(targets)) {
        return Some(Route::Rustup);
    }
    if debian_is_there() || (setting.may_install && debian_brings_compiler()) {
        return Some(Route::Debian);
    }
    None
}

/// What a stage answers where [`find_route`] found nothing.
pub(crate) fn not_possible(targets: &[&str]) -> Outcome {
    Outcome::NotPossible {
        reason: format!("no compiler for {}", targets.join(", ")),
        install: install_line(targets),
    }
}

/// What a chore says that cannot go on without it.
pub(crate) fn missing(targets: &[&str]) -> String {
    format!("no compiler for {}; to install: {}", targets.join(", "), install_line(targets))
}

/// The command that brings a compiler for `targets`.
pub(crate) fn install_line(targets: &[&str]) -> String {
    let (targets, packages) = (targets.join(" "), DEBIAN_PACKAGES.join(" "));
    format!("rustup target add {targets} (or, on Debian, apt-get update && apt-get install -y {packages})")
}

fn rustup_has(targets: &[&str]) -> bool {
    let answer = output_of(Command::new("rustup").args(["target", "list", "--installed"]));
    answer.is_some_and(|output| {
        let installed = String::from_utf8_lossy(&output.stdout).into_owned();
        targets.iter().all(|target| installed.lines().any(|line| line == *target))
    })
}

fn rustup_brings(targets: &[&str]) -> bool {
    succeeds(Command::new("rustup").args(["target", "add"]).args(targets))
}

fn debian_is_there() -> bool {
    let both = [DEBIAN_RUSTC, DEBIAN_CARGO].iter().all(|file| Path::new(file).exists());
    both && debian_is_new_enough() && debian_has_core_source()
}

/// Debian has an older compiler, too, for whom its security archive is out of reach or not up to date.
fn debian_is_new_enough() -> bool {
    let answer = output_of(Command::new(DEBIAN_RUSTC).arg("--version"));
    let needed = version(env!("CARGO_PKG_RUST_VERSION"));
    answer.is_some_and(|output| {
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        said.split_whitespace().nth(1).and_then(version) >= needed
    })
}

/// Major and minor number of `1.95.0`.
fn version(text: &str) -> Option<(u32, u32)> {
    let mut numbers = text.split('.').map(str::parse);
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
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
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Rustup => "rustup's target",
            Self::Debian => "Debian's rustc-web",
        }
    }

    /// The cargo of this route, in the folder of a package.
    pub(crate) fn cargo(self, folder: &Path) -> Command {
        match self {
            Self::Rustup => cargo(folder),
            Self::Debian => self.debian_cargo(folder),
        }
    }

    fn debian_cargo(self, folder: &Path) -> Command {
        let mut command = Command::new(DEBIAN_CARGO);
        command.current_dir(folder).env("RUSTC_BOOTSTRAP", "1").env("RUSTC", DEBIAN_RUSTC);
        let target_folder = self.target_folder(folder).display().to_string();
        command
            .args(["-Z", "build-std=core", "--config"])
            .arg(format!("build.target-dir = {target_folder:?}"));
        if Path::new(DEBIAN_LLD).exists() {
            for target in TARGETS {
                command.env(linker_variable(target), DEBIAN_LLD);
            }
        }
        command
    }

    /// Where this route puts what it builds in the folder of a package: one compiler's files apart from another's.
    pub(crate) fn target_folder(self, folder: &Path) -> PathBuf {
        let target = folder.join("target");
        match self {
            Self::Rustup => target,
            Self::Debian => target.join("debian"),
        }
    }
}

/// The variable that tells cargo the linker of a target.
fn linker_variable(target: &str) -> String {
    format!("CARGO_TARGET_{}_LINKER", target.to_uppercase().replace(['-', '.'], "_"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_routes_are_called_in_the_folder_and_keep_their_files_apart() {
        let folder = Path::new("/firmware/pico");
        for route in [Route::Rustup, Route::Debian] {
            assert_eq!(route.cargo(folder).get_current_dir(), Some(folder));
        }
        assert_ne!(Route::Rustup.target_folder(folder), Route::Debian.target_folder(folder));
        let debian = Route::Debian.cargo(folder);
        let words: Vec<_> = debian.get_args().map(|word| word.to_string_lossy().into_owned()).collect();
        let target_folder = "build.target-dir = \"/firmware/pico/target/debian\"";
        assert_eq!(words, ["-Z", "build-std=core", "--config", target_folder]);
        assert!(
            debian.get_envs().any(|(name, value)| name == "RUSTC" && value == Some(DEBIAN_RUSTC.as_ref()))
        );
    }

    #[test]
    fn a_target_with_a_point_has_its_linker_variable() {
        assert_eq!(linker_variable(THUMB_V8M), "CARGO_TARGET_THUMBV8M_MAIN_NONE_EABI_LINKER");
    }

    #[test]
    fn versions_are_compared_by_their_numbers() {
        assert!(version("1.100.0") > version("1.95"));
        assert!(version("1.85.0") < version("1.95"));
        assert_eq!(version("nightly"), None);
        assert!(version("nightly") < version("1.95"));
        assert!(version(env!("CARGO_PKG_RUST_VERSION")).is_some());
    }

    #[test]
    fn the_install_line_names_every_target() {
        let line = install_line(&TARGETS);
        assert!(TARGETS.iter().all(|target| line.contains(target)), "{line}");
    }
}
