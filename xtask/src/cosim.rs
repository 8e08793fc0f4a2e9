//! The co-simulation: the Pico's image in an emulator, wired to the twin.

use anyhow::{Context, Result};

use crate::commands::cargo;
use crate::compiler;
use crate::firmware::{IMAGES, elf_file, find_route};
use crate::stage::{Outcome, Setting};

const IMAGE: &str = "abbe-pico";

pub(crate) fn check(setting: &Setting) -> Result<Outcome> {
    let row = IMAGES.iter().find(|row| row.name == IMAGE).context("there is no image for the Pico")?;
    let Some(route) = find_route(setting) else {
        return Ok(compiler::not_possible(&[row.target]));
    };
    let image = elf_file(setting, route, row)?;
    let mut command = cargo(&setting.root);
    command.args(["test", "--release", "--package", "abbe-cosim", "--features", "images", "--test", "pico"]);
    command.args(["--", "--nocapture"]).env("ABBE_PICO_IMAGE", image);
    let status = command.status().context("cannot start cargo")?;
    let finding = format!("the co-simulation ended with {status}");
    Ok(Outcome::of_findings(if status.success() { Vec::new() } else { vec![finding] }))
}
