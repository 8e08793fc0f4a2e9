//! abbe: an open controller for precision X-Y stages.
//!
//! `abbe demo` does everything once on the twin; the other commands do one thing each. See `abbe help`.

mod bench;
mod cli;
mod commands;
mod failure;
mod folder;
mod interrupt;
mod optics;
mod preset;
mod progress;
mod rig;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    if let Err(error) = interrupt::watch() {
        eprintln!("abbe: Ctrl-C cannot be watched for: {error}");
    }
    match commands::run(&cli) {
        Ok(answer) => {
            answer.print(cli.json);
            ExitCode::SUCCESS
        }
        Err(failure) => {
            failure.print(cli.json);
            ExitCode::from(failure.status())
        }
    }
}
