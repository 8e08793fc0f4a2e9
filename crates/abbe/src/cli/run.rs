//! What `abbe run` can be asked.

use clap::Args;
use std::path::PathBuf;

/// `abbe run FILE.nc`.
#[derive(Args, Debug)]
pub(crate) struct Run {
    /// Program to read; `-` is stdin. docs/gcode.md has its words.
    #[arg(value_name = "FILE.nc")]
    pub(crate) file: PathBuf,
    /// Move nothing: look at the whole program, tell what is wrong with it, or what it is in figures. The stage is taken
    /// to stand at zero.
    #[arg(long)]
    pub(crate) check: bool,
}
