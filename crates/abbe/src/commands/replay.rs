//! `abbe replay FILE`.

use super::Answer;
use crate::cli::{AxisName, Replay};
use crate::failure::Failure;
use crate::flight::Recording;
use crate::flight::plot;
use crate::flight::replay::{self, Proof};
use crate::flight::samples;
use crate::flight::trace::{Kind, Mark, Row, Trace, Window, Wish};
use crate::folder::{self, Ready};
use crate::preset::Preset;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// How a plot is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Picture {
    Svg,
    Page,
}

pub(crate) fn run(named: Option<&Preset>, asked: &Replay) -> Result<Answer, Failure> {
    check_order(asked)?;
    let picture = asked.plot.as_deref().map(picture).transpose()?;
    let recording = read(&asked.file)?;
    if let Some(preset) = named {
        check_preset(&recording, preset, &asked.file)?;
    }
    let covered = covered(&recording);
    let window = covered.part(asked.from, asked.to)?;
    let _folders = outputs(asked)?;
    let wish = Wish { step: asked.step.map(u64::from), csv: asked.csv.is_some(), lines: picture.is_some() };
    let mut trace = Trace::new(window, recording.tick_hz(), wish);
    let proof = replay::play(&recording, |seen| trace.see(&seen))
        .map_err(|error| Failure::work(format!("{}: {error}", asked.file.display())))?;
    trace.end();
    if let Some(file) = &asked.csv {
        folder::write_whole(file, trace.csv.as_bytes())?;
    }
    if let (Some(file), Some(axis)) = (&asked.samples, asked.axis) {
        folder::write_whole(file, samples(&recording, axis, window, &asked.file)?.as_bytes())?;
    }
    if let (Some(file), Some(picture)) = (&asked.plot, picture) {
        write_plot(file, picture, &trace, &recording, &sentence(&recording, proof))?;
    }
    Ok(Answer {
        text: text(&recording, proof, &trace, asked),
        json: document(&recording, proof, covered, &trace, asked),
    })
}

fn samples(recording: &Recording, axis: AxisName, window: Window, file: &Path) -> Result<String, Failure> {
    let told = |words: &dyn std::fmt::Display| Failure::work(format!("{}: {words}", file.display()));
    let name = if axis == AxisName::X { "x" } else { "y" };
    samples::csv(recording, axis as usize, window).map_err(|error| told(&error))?.ok_or_else(|| {
        told(&format!(
            "no samples of axis {name} in {:.4} … {:.4} s; --samples is for analogue encoders, as the preset litho-120 has them",
            window.from_s, window.to_s
        ))
    })
}

fn check_order(asked: &Replay) -> Result<(), Failure> {
    match (asked.from, asked.to) {
        (Some(from), Some(to)) if from >= to => {
            Err(Failure::usage(format!("--from {from} is not before --to {to}")))
        }
        _ => Ok(()),
    }
}

fn picture(file: &Path) -> Result<Picture, Failure> {
    match file.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => Ok(Picture::Svg),
        Some("html") => Ok(Picture::Page),
        _ => Err(Failure::usage(format!("--plot {}: the file must end in .svg or .html", file.display()))),
    }
}

fn read(file: &Path) -> Result<Recording, Failure> {
    let shown = file.display();
    let bytes = std::fs::read(file)
        .map_err(|error| Failure::work(format!("{shown}: the recording cannot be read: {error}")))?;
    Recording::of_bytes(&bytes).map_err(|error| Failure::work(format!("{shown}: {error}")))
}

/// A recording is of one stage; a replay on another would prove nothing.
fn check_preset(recording: &Recording, preset: &Preset, file: &Path) -> Result<(), Failure> {
    let origin = &recording.origin;
    if origin.settings == preset.controller.settings {
        return Ok(());
    }
    Err(Failure::work(format!(
        "{}: recorded on the preset `{}`, whose [controller] part is not that of `{}`; leave out --preset, or name the right one",
        file.display(),
        origin.preset,
        preset.name
    )))
}

fn covered(recording: &Recording) -> Window {
    let [from_s, to_s] = recording.numbers().map(|number| number as f64 / recording.tick_hz());
    Window { from_s, to_s }
}

fn outputs(asked: &Replay) -> Result<Vec<Ready>, Failure> {
    let files = [("--csv", &asked.csv), ("--samples", &asked.samples), ("--plot", &asked.plot)];
    let wanted = files.into_iter().filter_map(|(option, file)| file.as_deref().map(|file| (option, file)));
    wanted.map(|(option, file)| folder::prepare_file(option, file, asked.force)).collect()
}

fn write_plot(
    file: &Path,
    picture: Picture,
    trace: &Trace,
    recording: &Recording,
    proof: &str,
) -> Result<(), Failure> {
    let Window { from_s, to_s } = trace.window();
    let title = format!("{}, {from_s:.3} … {to_s:.3} s", recording.origin.preset);
    let drawn = match picture {
        Picture::Svg => plot::svg(trace, &title)?,
        Picture::Page => plot::page(trace, &title, proof)?,
    };
    folder::write_whole(file, drawn.as_bytes())
}

fn sentence(recording: &Recording, proof: Proof) -> String {
    format!(
        "{} ticks ({:.1} s of the stage's time) replayed: every output is that of the recorded run, bit for bit",
        proof.ticks,
        proof.ticks as f64 / recording.tick_hz()
    )
}

fn text(recording: &Recording, proof: Proof, trace: &Trace, asked: &Replay) -> String {
    let origin = &recording.origin;
    let mut text =
        format!("{}\npreset {}, seed {}\n", sentence(recording, proof), origin.preset, origin.seed);
    for mark in &trace.marks {
        let what = if mark.kind == Kind::Fault { "fault: " } else { "" };
        _ = writeln!(text, "{:>10.4} s  {what}{}", mark.t_s, mark.text);
    }
    if !trace.rows.is_empty() {
        text.push_str(Row::TABLE);
        trace.rows.iter().for_each(|row| row.table(&mut text));
    }
    for file in [&asked.csv, &asked.samples, &asked.plot].into_iter().flatten() {
        _ = writeln!(text, "→ {}", file.display());
    }
    text
}

fn document(recording: &Recording, proof: Proof, covered: Window, trace: &Trace, asked: &Replay) -> Value {
    json!({
        "file": asked.file,
        "preset": recording.origin.preset,
        "seed": recording.origin.seed,
        "identical": true,
        "ticks": proof.ticks,
        "from_s": covered.from_s,
        "to_s": covered.to_s,
        "hash": format!("{:#018x}", proof.hash),
        "marks": trace.marks.iter().map(Mark::json).collect::<Vec<_>>(),
        "rows": asked.step.map(|_| trace.rows.iter().map(Row::json).collect::<Vec<_>>()),
        "csv": asked.csv,
        "samples": asked.samples,
        "plot": asked.plot,
    })
}
