//! The project's own chores: `cargo xtask test`, `firmware`, `golden`, `cycles`, `figures`.

mod arrows;
mod commands;
mod compiler;
mod cosim;
mod cycles;
mod demo;
mod figures;
mod firmware;
mod fuzz;
mod gate;
mod golden;
mod image;
mod licences;
mod links;
mod metadata;
mod sensing;
mod stage;
mod test;
mod witness;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// The project's own chores.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Subcommand)]
enum Chore {
    /// Every check of the project, in order, with a table at the end.
    Test {
        /// Install what a check lacks (a compiler target), as CI=true does.
        #[arg(long)]
        install: bool,
        /// Only the stages with these names.
        #[arg(long, value_name = "STAGE", num_args = 1..)]
        only: Vec<String>,
    },
    /// Builds the images for the boards and judges their machine code: memory, stack, and what a tick must not do.
    Firmware {
        /// Install a compiler where there is none.
        #[arg(long)]
        install: bool,
        /// One JSON document on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Replays the golden traces on this machine and on emulated boards: the hashes of all outputs must be equal.
    Golden {
        /// Plays the scripts on the twin instead, writes the traces anew and says which have changed.
        #[arg(long, conflicts_with = "install")]
        record: bool,
        /// Install what is lacking: a compiler, QEMU.
        #[arg(long)]
        install: bool,
    },
    /// Counts what every stage of a tick costs a Cortex-M0+ over all golden traces, and what sensing an analogue axis
    /// costs, against the budget.
    Cycles {
        /// Install a compiler where there is none.
        #[arg(long)]
        install: bool,
        /// One JSON document on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Measures the figures in docs/benchmarks.md again and writes them there.
    Figures {
        /// Only this topic; all of them without it.
        topic: Option<figures::Topic>,
    },
}

fn main() -> ExitCode {
    let root = root();
    let done = match Arguments::parse().chore {
        Chore::Test { install, only } => test::run(&stage::Setting::new(root, install), &only),
        Chore::Firmware { install, json } => {
            let form = if json { firmware::Form::Json } else { firmware::Form::Table };
            firmware::run(&stage::Setting::new(root, install), form)
        }
        Chore::Golden { record: true, .. } => golden::record(&root),
        Chore::Golden { install, .. } => golden::run(&stage::Setting::new(root, install)),
        Chore::Cycles { install, json } => {
            let form = if json { cycles::Form::Json } else { cycles::Form::Table };
            cycles::run(&stage::Setting::new(root, install), form)
        }
        Chore::Figures { topic } => figures::run(&root, topic).map(|()| true),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The folder that holds the workspace.
fn root() -> PathBuf {
    let mut root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    root.pop();
    root
}
