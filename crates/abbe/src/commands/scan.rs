//! `abbe scan`.

use super::{Answer, Wanted};
use crate::bench::Shared;
use crate::cli::{Scan, Specimen};
use crate::failure::Failure;
use crate::folder;
use crate::interrupt;
use crate::optics::{Microscope, Sight};
use crate::preset::Preset;
use crate::progress;
use abbe_mosaic::plan::{self, Field};
use abbe_mosaic::scan::{self, ScanReport};
use abbe_mosaic::tiles::{self, Placed};
use serde_json::json;
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

/// Area of a tissue without end, mm.
pub(super) const AREA_MM: [f64; 2] = [1.6, 1.2];

/// Name of the file with the true places of the tiles.
pub(super) const TRUE_PLACES: &str = "TileConfiguration.true.txt";

/// What to look at.
pub(super) fn sight(asked: &Specimen, seed: u64, centre_mm: [f64; 2]) -> Result<Sight, Failure> {
    match &asked.specimen {
        Some(file) => Sight::picture(file, asked.specimen_pixel, centre_mm),
        None => Ok(Sight::tissue(seed, centre_mm)),
    }
}

/// The fields that cover an area around `centre_mm`, refused when they leave the travel.
pub(super) fn fields(
    preset: &Preset,
    area_mm: [f64; 2],
    centre_mm: [f64; 2],
    overlap_percent: f64,
) -> Result<Vec<Field>, Failure> {
    let origin = [0, 1].map(|k| centre_mm[k] - 0.5 * area_mm[k]);
    let field = preset.controller.camera.field_mm();
    let fields = plan::serpentine(area_mm, origin, field, overlap_percent).map_err(Failure::usage)?;
    for field in &fields {
        for (axis, (place, settings)) in
            [field.x_mm, field.y_mm].into_iter().zip(&preset.controller.settings.axes).enumerate()
        {
            let (low, high) = (settings.travel_low_mm, settings.travel_high_mm);
            if !(low..=high).contains(&place) {
                return Err(Failure::usage(format!(
                    "the area reaches {} = {place:.3} mm, outside the travel {low} … {high} mm; \
                     choose another --area or --centre",
                    ["x", "y"][axis]
                )));
            }
        }
    }
    Ok(fields)
}

/// A finished scan and where its tiles truly are.
pub(super) struct Scanned {
    pub(super) report: ScanReport,
    pub(super) truth: Vec<Placed>,
}

/// Visits the fields and writes the tiles.
pub(super) fn take(
    rig: &Shared,
    preset: &Preset,
    fields: &[Field],
    sight: Sight,
    seed: u64,
    dir: &Path,
) -> Result<Scanned, Failure> {
    let camera = &preset.controller.camera;
    let mut microscope = Microscope::new(rig, camera, sight, seed)?;
    let bar = progress::bar("scanning", fields.len());
    let report = scan::scan(fields, &mut microscope, camera.senses(), dir, &mut |done, _| {
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    interrupt::check()?;
    let report = report?;
    let placed = tiles::read_configuration(&report.configuration)?;
    Ok(Scanned { truth: microscope.truth(&placed), report })
}

/// Writes the true places of the tiles into a folder of their own.
pub(super) fn write_truth(dir: &Path, truth: &[Placed]) -> Result<(), Failure> {
    let comment = "true places of the tiles, px, the first at the origin";
    Ok(tiles::write_configuration(&dir.join(TRUE_PLACES), truth, &[comment])?)
}

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Scan) -> Result<Answer, Failure> {
    let sight = sight(&asked.specimen, seed, asked.centre)?;
    let area = asked.area.or(sight.size_mm()).unwrap_or(AREA_MM);
    let fields = fields(preset, area, asked.centre, asked.overlap)?;
    let wanted = Wanted::new(preset, seed, &asked.source)?;
    let _folder = folder::prepare("--out", &asked.out.out, asked.out.force)?;
    let _truth =
        asked.truth.as_ref().map(|dir| folder::prepare("--truth", dir, asked.out.force)).transpose()?;
    let rig = Rc::new(RefCell::new(wanted.homed(&asked.out.out)?));
    let began_s = rig.borrow().time_s();
    let scanned = take(&rig, preset, &fields, sight, seed, &asked.out.out)?;
    if let Some(dir) = &asked.truth {
        write_truth(dir, &scanned.truth)?;
    }
    let took_s = rig.borrow().time_s() - began_s;
    let text = format!(
        "{} tiles in {took_s:.1} s of the stage's time → {}\n",
        scanned.report.tiles,
        scanned.report.dir.display()
    );
    let json = json!({ "scan": scanned.report, "area_mm": area, "stage_time_s": took_s });
    Ok(Answer { text, json })
}
