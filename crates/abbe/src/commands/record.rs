//! `abbe record FILE`.

use super::{Answer, Wanted};
use crate::cli::Record;
use crate::failure::Failure;
use crate::flight::replay;
use crate::flight::trace::{Trace, Window, Wish};
use crate::flight::{Keep, Recording};
use crate::folder;
use crate::interrupt;
use crate::preset::Preset;
use crate::progress;
use crate::rig::Rig;
use abbe_twin::script::{self, Line, Player};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

/// Where a stage goes when nobody says where.
const TOUR_MM: [[f64; 2]; 4] = [[5.0, 0.0], [5.0, 5.0], [0.0, 5.0], [0.0, 0.0]];

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Record) -> Result<Answer, Failure> {
    let script = asked.script.as_deref().map(read_script).transpose()?;
    let wanted = Wanted::new(preset, seed, &asked.source)?;
    let _folder = folder::prepare_file("FILE", &asked.file, asked.force)?;
    let mut rig = Rig::new(preset, seed, Keep::All);
    let ended = match &script {
        Some(lines) => play(&wanted, &mut rig, lines, asked),
        None => tour(&wanted, &mut rig, &asked.moves),
    };
    // A run that ended badly is the one that somebody wants to look into.
    interrupt::check()?;
    let recording = rig.recording()?;
    let answer = answer(&recording, &asked.file)?;
    match ended {
        Ok(()) => Ok(answer),
        Err(failure) => Err(Failure::work(format!(
            "{}; what led to it is in {} (`abbe replay`)",
            failure.sentence(),
            asked.file.display()
        ))),
    }
}

fn read_script(file: &Path) -> Result<Vec<Line>, Failure> {
    let text = std::fs::read_to_string(file)
        .map_err(|error| Failure::work(format!("{}: the script cannot be read: {error}", file.display())))?;
    let lines =
        script::parse(&text).map_err(|error| Failure::work(format!("{}, {error}", file.display())))?;
    if lines.is_empty() {
        return Err(Failure::work(format!("{}: the script says nothing", file.display())));
    }
    Ok(lines)
}

fn tour(wanted: &Wanted<'_>, rig: &mut Rig, moves: &[f64]) -> Result<(), Failure> {
    wanted.home(rig)?;
    let asked: Vec<[f64; 2]> = moves.as_chunks().0.to_vec();
    let targets = if asked.is_empty() { &TOUR_MM[..] } else { &asked };
    for target in targets {
        rig.move_to(*target)?;
    }
    Ok(())
}

fn play(wanted: &Wanted<'_>, rig: &mut Rig, lines: &[Line], asked: &Record) -> Result<(), Failure> {
    if let Some(compensation) = &wanted.compensation {
        rig.compensate(compensation)?;
    }
    progress::note("playing the script …");
    let file = asked.script.as_deref().unwrap_or(Path::new("")).display();
    let mut player = Player::new(rig);
    for line in lines {
        player
            .step(&line.step)
            .map_err(|error| Failure::work(format!("{file}, line {}: {error}", line.number)))?;
    }
    Ok(())
}

/// Proves that the recording replays, and writes it.
fn answer(recording: &Recording, file: &Path) -> Result<Answer, Failure> {
    let window = Window { from_s: 0.0, to_s: f64::INFINITY };
    let mut trace = Trace::new(window, recording.tick_hz(), Wish::default());
    let proof = replay::play(recording, |seen| trace.see(&seen))?;
    let bytes = recording.to_bytes()?;
    folder::write_whole(file, &bytes)?;
    let duration_s = proof.ticks as f64 / recording.tick_hz();
    let mut text = format!(
        "{} ticks, {duration_s:.1} s of the stage's time, in {} kB ({:.2} bytes a tick) → {}\n",
        proof.ticks,
        bytes.len().div_ceil(1000),
        bytes.len() as f64 / proof.ticks as f64,
        file.display()
    );
    for fault in trace.faults() {
        _ = writeln!(text, "fault at {:.4} s: {}", fault.t_s, fault.text);
    }
    let json = json!({
        "file": file,
        "preset": recording.origin.preset,
        "seed": recording.origin.seed,
        "ticks": proof.ticks,
        "duration_s": duration_s,
        "bytes": bytes.len(),
        "faults": trace.faults().map(crate::flight::trace::Mark::json).collect::<Vec<_>>(),
    });
    Ok(Answer { text, json })
}
