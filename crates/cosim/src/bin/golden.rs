//! Replays or records the golden traces; `cargo xtask golden` and `cargo xtask cycles` call it.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use abbe_cosim::golden::budget::{self, Run};
use abbe_cosim::golden::qemu::Machine;
use abbe_cosim::golden::rp2040::{Board, TickCycles};
use abbe_cosim::golden::{Found, Scenario, here, record};
use anyhow::{Context, Result, anyhow};
use clap::{Parser, Subcommand};
use serde_json::{Value, json};

/// Replays or records the golden traces of the project in the current folder.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    work: Work,
}

#[derive(Subcommand)]
enum Work {
    /// Plays the scripts on the twin and writes the traces anew.
    Record,
    /// Replays the traces on this machine and on each body whose image is given; one JSON document on stdout.
    Replay {
        /// Image of firmware/golden for the RP2040, to be emulated.
        #[arg(long, value_name = "ELF")]
        rp2040: Option<PathBuf>,
        /// Its image for a Cortex-M3, for QEMU.
        #[arg(long, value_name = "ELF")]
        m3: Option<PathBuf>,
        /// Its image for a Cortex-M33, for QEMU.
        #[arg(long, value_name = "ELF")]
        m33: Option<PathBuf>,
    },
}

/// What replays a trace.
enum Body {
    Here,
    Rp2040(Box<Board>),
    Qemu(Machine, PathBuf),
}

impl Body {
    fn name(&self) -> String {
        match self {
            Self::Here => format!("this machine ({})", std::env::consts::ARCH),
            Self::Rp2040(_) => "Cortex-M0+ (rp2040-emu)".into(),
            Self::Qemu(Machine::Lm3s6965evb, _) => "Cortex-M3 (QEMU)".into(),
            Self::Qemu(Machine::Mps2An505, _) => "Cortex-M33 (QEMU)".into(),
        }
    }

    fn replay(&self, scenario: &Scenario) -> Result<Replayed> {
        let (trace, expected) = (scenario.trace()?, scenario.expected()?);
        let (found, cycles) = match self {
            Self::Here => (here::replay(&trace)?, Vec::new()),
            Self::Rp2040(board) => board.replay(&trace, &expected)?,
            Self::Qemu(machine, image) => (machine.replay(image, &trace)?, Vec::new()),
        };
        let difference = found.difference(&expected);
        Ok(Replayed { found, difference, cycles })
    }
}

/// A trace on a body.
struct Replayed {
    found: Found,
    difference: Option<String>,
    cycles: Vec<TickCycles>,
}

fn main() -> ExitCode {
    let done = match Arguments::parse().work {
        Work::Record => record_all(Path::new(".")),
        Work::Replay { rp2040, m3, m33 } => replay_all(Path::new("."), rp2040, m3, m33),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn record_all(root: &Path) -> Result<()> {
    for scenario in Scenario::all(root)? {
        let before = scenario.expected().ok();
        let now = record::record(root, &scenario)?;
        let change = match before {
            None => "new",
            Some(before) if before == now => "as before",
            Some(_) => "changed",
        };
        println!("{:<20} {:>7} ticks  {:016x}  {change}", scenario.name, now.ticks, now.hash);
    }
    Ok(())
}

fn replay_all(root: &Path, rp2040: Option<PathBuf>, m3: Option<PathBuf>, m33: Option<PathBuf>) -> Result<()> {
    let scenarios = Scenario::all(root)?;
    let mut bodies = vec![Body::Here];
    if let Some(image) = rp2040 {
        bodies.push(Body::Rp2040(Box::new(Board::read(&image)?)));
    }
    bodies.extend(m3.map(|image| Body::Qemu(Machine::Lm3s6965evb, image)));
    bodies.extend(m33.map(|image| Body::Qemu(Machine::Mps2An505, image)));
    let replayed = on_all_bodies(&scenarios, &bodies)?;
    println!("{:#}", report(&scenarios, &bodies, &replayed));
    Ok(())
}

/// Every scenario on every body, as many at once as there are processors; by body, then by scenario.
fn on_all_bodies(scenarios: &[Scenario], bodies: &[Body]) -> Result<Vec<Replayed>> {
    let jobs: Vec<(&Body, &Scenario)> =
        bodies.iter().flat_map(|body| scenarios.iter().map(move |scenario| (body, scenario))).collect();
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some((body, scenario)) = jobs.get(number) else { return };
            let replayed =
                body.replay(scenario).with_context(|| format!("{} on {}", scenario.name, body.name()));
            if let Ok(mut done) = done.lock() {
                done.push((number, replayed));
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let mut done = done.into_inner().map_err(|_| anyhow!("a replay ended in a panic"))?;
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, replayed)| replayed).collect()
}

fn report(scenarios: &[Scenario], bodies: &[Body], replayed: &[Replayed]) -> Value {
    let mut rows = Vec::new();
    for (body, of_body) in bodies.iter().zip(replayed.chunks(scenarios.len())) {
        for (scenario, replayed) in scenarios.iter().zip(of_body) {
            rows.push(json!({
                "scenario": scenario.name,
                "body": body.name(),
                "ticks": replayed.found.ticks,
                "hash": format!("{:016x}", replayed.found.hash),
                "difference": replayed.difference,
            }));
        }
    }
    let names = scenarios.iter().cycle();
    let counted = names.zip(replayed).filter(|(_, replayed)| !replayed.cycles.is_empty());
    let runs: Vec<Run<'_>> = counted
        .map(|(scenario, replayed)| Run {
            preset: scenario.preset(),
            scenario: &scenario.name,
            ticks: &replayed.cycles,
        })
        .collect();
    json!({ "replays": rows, "cycles": budget::costs(&runs) })
}
