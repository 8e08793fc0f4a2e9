//! abbe: an open controller for precision X-Y stages.
//!
//! `abbe demo` does everything once on the twin; the other commands do one thing each. See `abbe help`.

mod bench;
mod cli;
mod commands;
mod drawing;
mod encoder;
mod failure;
mod fault;
mod flight;
mod folder;
mod interrupt;
mod optics;
mod output;
mod palette;
mod preset;
mod program;
mod progress;
mod rig;
mod sweep;
mod usage;

use commands::Answer;
use failure::Failure;
use std::ffi::OsString;
use std::process::ExitCode;
use usage::Typed;

fn main() -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().collect();
    let json = usage::wants_json(&arguments);
    match fault::watched(|| answer(&arguments, json)).and_then(|answer| answer.print(json)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print(json);
            ExitCode::from(failure.status())
        }
    }
}

fn answer(arguments: &[OsString], json: bool) -> Result<Answer, Failure> {
    match usage::read(arguments)? {
        Typed::Help(text) => Ok(Answer { json: serde_json::json!({ "help": text }), text }),
        Typed::Wish(cli) => {
            if let Err(error) = interrupt::watch(json) {
                progress::note(&format!("note: Ctrl-C cannot be watched for: {error}"));
            }
            commands::run(&cli)
        }
    }
}
