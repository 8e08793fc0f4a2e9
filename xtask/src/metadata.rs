//! What cargo knows about the workspace.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::commands::{cargo, stdout_of};

/// The answer of `cargo metadata` with these additional arguments.
pub(crate) fn read(root: &Path, arguments: &[&str]) -> Result<Value> {
    let mut command = cargo(root);
    command.args(["metadata", "--format-version", "1"]).args(arguments);
    serde_json::from_str(&stdout_of(&mut command)?).context("cargo metadata did not print JSON")
}

/// Its packages.
pub(crate) fn packages(metadata: &Value) -> &[Value] {
    metadata["packages"].as_array().map_or(&[], Vec::as_slice)
}

/// A text field of a package or dependency; empty where there is none.
pub(crate) fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_default()
}
