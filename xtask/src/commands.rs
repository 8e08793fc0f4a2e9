//! Running other programs.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use anyhow::{Context, Result};

use crate::stage::{Outcome, Setting};

/// The cargo that started this program.
pub(crate) fn cargo(root: &Path) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root);
    command
}

/// Runs cargo with its output on the terminal; any exit status but 0 is a failure.
pub(crate) fn cargo_stage<S: AsRef<OsStr>>(setting: &Setting, arguments: &[S]) -> Result<Outcome> {
    let mut command = cargo(&setting.root);
    command.args(arguments);
    let status = command.status().with_context(|| format!("cannot start {}", shown(&command)))?;
    if status.success() {
        return Ok(Outcome::Passed);
    }
    Ok(Outcome::Failed(vec![format!("{} ended with {status}", shown(&command))]))
}

/// Runs a program to its end and keeps what it printed on stdout; stderr goes to the terminal.
///
/// # Errors
/// The program cannot be started, or ends with another status than 0; what it printed until then is in the error.
pub(crate) fn stdout_of(command: &mut Command) -> Result<String> {
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .with_context(|| format!("cannot start {}", shown(command)))?;
    if !output.status.success() {
        let printed = String::from_utf8_lossy(&output.stdout);
        anyhow::bail!("{} ended with {}, after\n{}", shown(command), output.status, printed.trim_end());
    }
    String::from_utf8(output.stdout).with_context(|| format!("{} did not print text", shown(command)))
}

/// Runs a program to its end and keeps all it printed. `None`: there is no such program.
pub(crate) fn output_of(command: &mut Command) -> Option<Output> {
    command.stdin(Stdio::null()).output().ok()
}

/// True when the program ran and ended with status 0; its output goes to the terminal.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    command.status().is_ok_and(|status| status.success())
}

/// A command as one would type it, without the path of the program.
fn shown(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or_default();
    let words = std::iter::once(program).chain(command.get_args());
    words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}
