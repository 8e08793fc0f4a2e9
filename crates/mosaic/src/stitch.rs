//! A folder of tiles in, one mosaic out.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::align::{Alignment, align};
use crate::distortion::{Distortion, DistortionSummary};
use crate::fuse::{Canvas, fuse};
use crate::image::{Image, ImageError};
use crate::output::{WriteError, stated_pixel_um, write_preview, write_tiff};
use crate::seam::{self, SeamFigure};
use crate::shading::ShadingSummary;
use crate::tiles::{Placed, REGISTERED_CONFIGURATION, TileSet, TilesError, read_tiles, write_configuration};
use crate::view::Corrections;

/// The mosaic is made in memory; larger ones than this are refused.
const MOST_MOSAIC_BYTES: u64 = 8 << 30;

/// What fills the mosaic where no tile lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Background {
    /// Zero.
    #[default]
    Black,
    /// Full scale.
    White,
}

/// How to stitch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StitchOptions {
    /// How far displacements may be from the nominal ones, px.
    pub search_radius_px: usize,
    /// Estimate and undo lens distortion.
    pub correct_distortion: bool,
    /// Estimate and undo vignetting and exposure differences.
    pub correct_shading: bool,
    /// What fills the gaps.
    pub background: Background,
    /// Nominal pixel size, µm; without it, what the first tile's file states.
    pub pixel_um: Option<f64>,
}

impl Default for StitchOptions {
    fn default() -> Self {
        Self {
            search_radius_px: 40,
            correct_distortion: true,
            correct_shading: true,
            background: Background::Black,
            pixel_um: None,
        }
    }
}

/// A step of the work, for a progress bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Step {
    /// Reading tiles.
    Read,
    /// Measuring overlaps, first coarse, then fine.
    Register,
    /// Fusing rows of the mosaic.
    Fuse,
    /// Writing files.
    Write,
}

/// How far a step has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// The step.
    pub step: Step,
    /// Parts done; threads may report a little out of order.
    pub done: usize,
    /// Parts in all.
    pub total: usize,
}

/// Something the user should know about the result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Note {
    /// There is only one tile: nothing to register.
    SingleTile,
    /// No two tiles overlap enough to be registered: all are where the nominal places say.
    NoOverlap,
    /// Tiles overlap, but no overlap shows structure that two tiles share.
    NothingMatched,
    /// Overlaps that contradict the rest were left out.
    PairsRejected(usize),
    /// Tiles placed by prediction from their nominal places, because no overlap of theirs could be used.
    Predicted(Vec<String>),
    /// So many groups of two or more registered tiles are joined only by prediction.
    Groups(usize),
    /// The lens distortion is not determined or not different from none; nothing was undone.
    NoDistortion,
    /// The light is not determined or even enough; nothing was undone.
    NoShading,
    /// The tiles state no pixel size: the mosaic has none.
    NoPixelSize,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SingleTile => f.write_str("one tile only: nothing to register"),
            Self::NoOverlap => f.write_str("no tiles overlap: all are placed by their nominal places"),
            Self::NothingMatched => {
                f.write_str("no overlap shows common structure: all tiles are placed by their nominal places")
            }
            Self::PairsRejected(n) => write!(f, "{n} overlaps contradict the rest and were left out"),
            Self::Predicted(files) => {
                write!(
                    f,
                    "{} tiles without a usable overlap are placed by prediction: {}",
                    files.len(),
                    files.join(", ")
                )
            }
            Self::Groups(n) => write!(f, "{n} groups of registered tiles are joined only by prediction"),
            Self::NoDistortion => f.write_str("no significant lens distortion: none undone"),
            Self::NoShading => f.write_str("no significant uneven light: none undone"),
            Self::NoPixelSize => f.write_str("the tiles state no pixel size: the mosaic has none"),
        }
    }
}

/// How well two neighbours match.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Overlap {
    /// File of the first tile.
    pub a: String,
    /// File of the second tile.
    pub b: String,
    /// Whether the overlap holds the solution.
    pub used: bool,
    /// Normalised cross-correlation of the structure, up to 1; 0 if no match was found.
    pub correlation: f64,
}

/// The result of registration alone.
#[derive(Clone, Debug, Serialize)]
pub struct Registration {
    /// Tiles at their registered places, px; the first one keeps its nominal place.
    pub placed: Vec<Placed>,
    /// Pairs of tiles that overlap enough to be tried.
    pub pairs: usize,
    /// Pairs that hold the solution.
    pub pairs_used: usize,
    /// Pairs that matched but contradict the rest.
    pub pairs_rejected: usize,
    /// Root mean square of the displacements that are left over, px.
    pub residual_rms_px: f64,
    /// Root mean square of the tiles from the places predicted from their nominal ones, px; never
    /// less than 1, and the search radius allows for it where too few tiles tell.
    pub prediction_rms_px: f64,
    /// Camera pixels per nominal pixel.
    pub scale: f64,
    /// Nominal x axis against the camera's, x towards y, degrees.
    pub angle_deg: f64,
    /// Standard deviation of the scale, and of the angle in radians.
    pub scale_sigma: f64,
    /// Lens distortion, if undone.
    pub distortion: Option<DistortionSummary>,
    /// The light, if undone.
    pub shading: Option<ShadingSummary>,
    /// Agreement of the overlaps at the nominal places, nothing undone.
    pub seam_before: SeamFigure,
    /// Agreement of the overlaps at the registered places, optics undone.
    pub seam_after: SeamFigure,
    /// How each pair fared.
    pub overlaps: Vec<Overlap>,
    /// What the user should know.
    pub notes: Vec<Note>,
}

/// What stitching did.
#[derive(Clone, Debug, Serialize)]
pub struct StitchReport {
    /// Tiles, none of them dropped.
    pub tiles: usize,
    /// Size of the mosaic, px.
    pub mosaic_size_px: [usize; 2],
    /// Pixel size written to the mosaic, µm: the nominal one over the estimated scale.
    pub pixel_um: Option<f64>,
    /// Registration.
    #[serde(flatten)]
    pub registration: Registration,
    /// The mosaic.
    pub mosaic: PathBuf,
    /// Its preview.
    pub preview: PathBuf,
    /// The registered places.
    pub configuration: PathBuf,
}

/// Why no mosaic was made.
#[derive(Debug, thiserror::Error)]
pub enum StitchError {
    /// The tiles cannot be read.
    #[error(transparent)]
    Tiles(#[from] TilesError),
    /// The mosaic would not fit.
    #[error("the mosaic would be {width} × {height} pixels, more than this version makes in memory")]
    TooLarge {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The name of the mosaic is not that of a TIFF file.
    #[error("{}: the mosaic is written as TIFF; its name must end in .tif or .tiff", .0.display())]
    NotTiff(PathBuf),
    /// The pixel size given is no length.
    #[error("pixel size of {0} µm: it must be a number greater than 0")]
    PixelSize(f64),
    /// The mosaic has no pixels.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Registers tiles without fusing them.
pub fn register(
    set: &TileSet,
    options: &StitchOptions,
    progress: &(dyn Fn(Progress) + Sync),
) -> Registration {
    registered(set, options, progress).1
}

/// Reads the tiles in `dir`, registers and fuses them, and writes `mosaic` (a `.tif`), a preview (the same name as
/// `.png`) and `TileConfiguration.registered.txt` beside it. Each file appears whole or not at all.
///
/// # Errors
/// See [`StitchError`]; nothing is written before all tiles are read and fused.
pub fn stitch(
    dir: &Path,
    mosaic: &Path,
    options: &StitchOptions,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<StitchReport, StitchError> {
    let tiff =
        mosaic.extension().is_some_and(|e| e.eq_ignore_ascii_case("tif") || e.eq_ignore_ascii_case("tiff"));
    if !tiff {
        return Err(StitchError::NotTiff(mosaic.to_path_buf()));
    }
    if let Some(um) = options.pixel_um.filter(|um| !(um.is_finite() && *um > 0.0)) {
        return Err(StitchError::PixelSize(um));
    }
    make_folder_of(mosaic)?;
    let set = read_tiles(dir, &|done, total| progress(Progress { step: Step::Read, done, total }))?;
    let (alignment, mut registration) = registered(&set, options, progress);
    let nominal_um = options.pixel_um.or_else(|| stated_pixel_um(&dir.join(&set.placed[0].file)));
    if nominal_um.is_none() {
        registration.notes.push(Note::NoPixelSize);
    }
    let pixel_um = nominal_um.map(|um| um / registration.scale);
    let picture = fused(&set, &alignment, options, progress)?;
    let files = Files::beside(mosaic);
    files.write(&picture, &registration.placed, pixel_um, progress)?;
    Ok(StitchReport {
        tiles: set.images.len(),
        mosaic_size_px: [picture.width(), picture.height()],
        pixel_um,
        registration,
        mosaic: files.mosaic,
        preview: files.preview,
        configuration: files.configuration,
    })
}

/// Makes the folder of the results, if need be: better to fail now than after all the work.
fn make_folder_of(mosaic: &Path) -> Result<(), WriteError> {
    match mosaic.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => {
            std::fs::create_dir_all(folder).map_err(|e| WriteError::new(folder, &e))
        }
        _ => Ok(()),
    }
}

fn registered(
    set: &TileSet,
    options: &StitchOptions,
    progress: &(dyn Fn(Progress) + Sync),
) -> (Alignment, Registration) {
    let alignment =
        align(set, options, &|done, total| progress(Progress { step: Step::Register, done, total }));
    let raw = Corrections { lens: Distortion::none(set.tile_size()), shading: None };
    let undone = Corrections { lens: alignment.lens, shading: alignment.shading.as_ref() };
    let named = |(tile, place): (&Placed, &[f64; 2])| Placed { file: tile.file.clone(), place_px: *place };
    let registration = Registration {
        placed: set.placed.iter().zip(&alignment.places).map(named).collect(),
        pairs: alignment.pairs,
        pairs_used: alignment.pairs_used,
        pairs_rejected: alignment.pairs_rejected,
        residual_rms_px: alignment.residual_rms_px,
        prediction_rms_px: alignment.prior_px,
        scale: alignment.model.scale(),
        angle_deg: alignment.model.angle_rad().to_degrees(),
        scale_sigma: alignment.model.relative_sigma(),
        distortion: alignment.lens_summary,
        shading: alignment.shading.as_ref().map(crate::shading::Shading::summary),
        seam_before: seam::measure(&set.images, &set.places(), raw),
        seam_after: seam::measure(&set.images, &alignment.places, undone),
        overlaps: overlaps(set, &alignment),
        notes: notes(set, options, &alignment),
    };
    (alignment, registration)
}

fn overlaps(set: &TileSet, alignment: &Alignment) -> Vec<Overlap> {
    let file = |tile: usize| set.placed[tile].file.clone();
    let verdicts = alignment.overlaps.iter();
    verdicts
        .map(|v| Overlap { a: file(v.pair.a), b: file(v.pair.b), used: v.used, correlation: v.correlation })
        .collect()
}

fn notes(set: &TileSet, options: &StitchOptions, alignment: &Alignment) -> Vec<Note> {
    if set.images.len() == 1 {
        return vec![Note::SingleTile];
    }
    if alignment.pairs == 0 {
        return vec![Note::NoOverlap];
    }
    let mut notes = Vec::new();
    if alignment.pairs_rejected > 0 {
        notes.push(Note::PairsRejected(alignment.pairs_rejected));
    }
    if alignment.pairs_used == 0 {
        notes.push(Note::NothingMatched);
    } else if !alignment.unreached.is_empty() {
        notes
            .push(Note::Predicted(alignment.unreached.iter().map(|&i| set.placed[i].file.clone()).collect()));
    }
    if alignment.pairs_used > 0 && alignment.groups > 1 {
        notes.push(Note::Groups(alignment.groups));
    }
    if options.correct_distortion && alignment.lens_summary.is_none() {
        notes.push(Note::NoDistortion);
    }
    if options.correct_shading && alignment.shading.is_none() {
        notes.push(Note::NoShading);
    }
    notes
}

fn fused(
    set: &TileSet,
    alignment: &Alignment,
    options: &StitchOptions,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Image, StitchError> {
    let canvas = Canvas::around(&alignment.places, set.tile_size());
    let first = &set.images[0];
    if canvas.bytes(first.channels(), first.depth()) > MOST_MOSAIC_BYTES {
        return Err(StitchError::TooLarge { width: canvas.width, height: canvas.height });
    }
    let corrections = Corrections { lens: alignment.lens, shading: alignment.shading.as_ref() };
    let background = match options.background {
        Background::Black => 0.0,
        Background::White => 1.0,
    };
    let done = |done, total| progress(Progress { step: Step::Fuse, done, total });
    Ok(fuse(&set.images, &alignment.places, corrections, canvas, background, &done)?)
}

/// Where the results go.
struct Files {
    mosaic: PathBuf,
    preview: PathBuf,
    configuration: PathBuf,
}

impl Files {
    fn beside(mosaic: &Path) -> Self {
        Self {
            mosaic: mosaic.to_path_buf(),
            preview: mosaic.with_extension("png"),
            configuration: mosaic.with_file_name(REGISTERED_CONFIGURATION),
        }
    }

    fn write(
        &self,
        picture: &Image,
        placed: &[Placed],
        pixel_um: Option<f64>,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<(), WriteError> {
        let report = |done| progress(Progress { step: Step::Write, done, total: 3 });
        write_tiff(&self.mosaic, picture, pixel_um)?;
        report(1);
        write_preview(&self.preview, picture)?;
        report(2);
        write_configuration(&self.configuration, placed, &["registered places in camera pixels"])?;
        report(3);
        Ok(())
    }
}
