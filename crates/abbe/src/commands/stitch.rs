//! `abbe stitch DIR --out MOSAIC`.

use super::Answer;
use crate::cli::Stitch;
use crate::failure::Failure;
use crate::folder::{self, Ready};
use crate::interrupt;
use crate::progress;
use abbe_mosaic::stitch::{self, Progress, Step, StitchOptions, StitchReport};
use abbe_mosaic::tiles;
use indicatif::ProgressBar;
use serde_json::json;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

pub(crate) fn run(asked: &Stitch) -> Result<Answer, Failure> {
    let _folder = ready(asked)?;
    let options = StitchOptions {
        search_radius_px: asked.search as usize,
        correct_distortion: !asked.keep_distortion,
        correct_shading: !asked.keep_shading,
        ..StitchOptions::default()
    };
    let report = join(&asked.tiles, &asked.out, &options)?;
    Ok(Answer { text: text(&report), json: json!(report) })
}

/// Everything that can be wrong before the work: it may take long.
fn ready(asked: &Stitch) -> Result<Ready, Failure> {
    let is_tiff = |ending: &OsStr| ending.eq_ignore_ascii_case("tif") || ending.eq_ignore_ascii_case("tiff");
    if !asked.out.extension().is_some_and(is_tiff) {
        return Err(Failure::usage(format!(
            "--out {}: the mosaic is written as TIFF; let its name end in .tif or .tiff",
            asked.out.display()
        )));
    }
    if !asked.tiles.is_dir() {
        return Err(Failure::work(format!("{}: there is no such folder", asked.tiles.display())));
    }
    if !asked.tiles.join(tiles::CONFIGURATION).is_file() {
        return Err(Failure::work(format!(
            "{}: there is no {} in it; name a folder that holds it and the tiles",
            asked.tiles.display(),
            tiles::CONFIGURATION
        )));
    }
    for beside in [asked.out.with_extension("png"), asked.out.with_file_name(tiles::REGISTERED_CONFIGURATION)]
    {
        folder::keep_file("--out", &beside, asked.force)?;
    }
    folder::prepare_file("--out", &asked.out, asked.force)
}

/// Stitches with a bar for each step. Ctrl-C ends it between two parts of a step.
pub(super) fn join(tiles: &Path, mosaic: &Path, options: &StitchOptions) -> Result<StitchReport, Failure> {
    let bar: Mutex<Option<(Step, ProgressBar)>> = Mutex::new(None);
    let told = |progress: Progress| {
        interrupt::leave_if_asked();
        let Ok(mut shown) = bar.lock() else { return };
        if shown.as_ref().is_none_or(|(step, _)| *step != progress.step) {
            if let Some((_, old)) = shown.take() {
                old.finish_and_clear();
            }
            *shown = Some((progress.step, progress::bar(name(progress.step), progress.total)));
        }
        if let Some((_, bar)) = shown.as_ref() {
            bar.set_position(progress.done as u64);
        }
    };
    let report = interrupt::leaving(|| stitch::stitch(tiles, mosaic, options, &told));
    if let Ok(Some((_, last))) = bar.into_inner() {
        last.finish_and_clear();
    }
    Ok(report??)
}

fn name(step: Step) -> &'static str {
    match step {
        Step::Read => "reading tiles",
        Step::Register => "registering",
        Step::Fuse => "fusing",
        Step::Write => "writing the mosaic",
    }
}

/// What a person wants to know of a mosaic.
pub(super) fn text(report: &StitchReport) -> String {
    let [width, height] = report.mosaic_size_px;
    let found = &report.registration;
    let mut text = format!(
        "{} tiles → {width} × {height} px; {} of {} overlaps used, {:.3} px rms left over\n",
        report.tiles, found.pairs_used, found.pairs, found.residual_rms_px
    );
    if let Some(lens) = &found.distortion {
        _ = writeln!(text, "lens distortion undone: {:+.2} px at the corner", lens.radial_corner_px);
    }
    for note in &found.notes {
        _ = writeln!(text, "note: {note}");
    }
    _ = writeln!(text, "mosaic  {}", report.mosaic.display());
    _ = writeln!(text, "preview {}", report.preview.display());
    _ = writeln!(text, "places  {}", report.configuration.display());
    text
}
