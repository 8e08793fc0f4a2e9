//! Counts what sensing an analogue axis costs a Cortex-M0+; `cargo xtask cycles` calls it.

use std::path::PathBuf;

use abbe_cosim::sensing;
use anyhow::Result;
use clap::Parser;

/// Runs the image `sensing` of firmware/golden in an emulator; one JSON document on stdout.
#[derive(Parser)]
struct Arguments {
    /// The image, for an RP2040.
    image: PathBuf,
}

fn main() -> Result<()> {
    println!("{}", serde_json::to_string_pretty(&sensing::costs(&Arguments::parse().image)?)?);
    Ok(())
}
