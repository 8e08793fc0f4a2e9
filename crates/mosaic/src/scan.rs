//! Visits the fields of a plan and leaves a folder that [`crate::stitch`] can read.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::image::Image;
use crate::output::{WriteError, write_tiff};
use crate::plan::Field;
use crate::tiles::{CONFIGURATION, Placed, write_configuration};
use crate::whole_file::write_whole;

/// Name of the file with the measured positions.
pub const POSITIONS: &str = "positions.csv";

/// A picture and where it was taken.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The picture.
    pub image: Image,
    /// Measured position of the centre of the field at the middle of the exposure: stage frame, mm.
    pub position_mm: [f64; 2],
}

/// Something that moves to a position and takes a picture there.
pub trait Camera {
    /// Why no picture was taken.
    type Error: std::error::Error + Send + Sync + 'static;

    /// Moves the field of view to `position_mm` (stage frame), waits until the stage is there, exposes.
    ///
    /// # Errors
    /// The stage did not get there or the camera gave no picture.
    fn image_at(&mut self, position_mm: [f64; 2]) -> Result<Shot, Self::Error>;

    /// Nominal size of a pixel on the specimen, µm, > 0. What the builder believes; the truth is estimated later.
    fn pixel_um(&self) -> f64;
}

/// How an image axis lies to the stage axis of the same name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Sense {
    /// A field at larger stage position lies at larger pixels.
    #[default]
    Same,
    /// A field at larger stage position lies at smaller pixels.
    Opposite,
}

impl Sense {
    fn sign(self) -> f64 {
        match self {
            Self::Same => 1.0,
            Self::Opposite => -1.0,
        }
    }
}

/// What a scan left behind.
#[derive(Clone, Debug, Serialize)]
pub struct ScanReport {
    /// Pictures taken.
    pub tiles: usize,
    /// The folder.
    pub dir: PathBuf,
    /// The tile configuration in it.
    pub configuration: PathBuf,
    /// The positions file in it.
    pub positions: PathBuf,
}

/// Why a scan ended early. Tiles already written stay; no configuration names them.
#[derive(Debug, thiserror::Error)]
pub enum ScanError<E: std::error::Error + 'static> {
    /// The camera or its stage failed.
    #[error("field at row {row}, column {col}: {source}")]
    Camera {
        /// Row of the field.
        row: usize,
        /// Column of the field.
        col: usize,
        /// What the camera said.
        source: E,
    },
    /// The nominal pixel size is no length.
    #[error("pixel size of {0} µm: it must be a number greater than 0")]
    PixelSize(f64),
    /// The measured position is not finite.
    #[error("field at row {row}, column {col}: measured position ({x_mm}, {y_mm}) mm is not finite")]
    Position {
        /// Row of the field.
        row: usize,
        /// Column of the field.
        col: usize,
        /// Measured, mm.
        x_mm: f64,
        /// Measured, mm.
        y_mm: f64,
    },
    /// The plan is empty.
    #[error("the plan has no field")]
    EmptyPlan,
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Visits every field of `plan` in order, writes `tile_rRRR_cCCC.tif` into `dir` (made if need be), then
/// `positions.csv` and `TileConfiguration.txt`. Places are relative to the first field. `done` is told after each
/// tile how many of how many are written.
///
/// # Errors
/// See [`ScanError`].
pub fn scan<C: Camera>(
    plan: &[Field],
    camera: &mut C,
    senses: [Sense; 2],
    dir: &Path,
    done: &mut dyn FnMut(usize, usize),
) -> Result<ScanReport, ScanError<C::Error>> {
    let pixel_um = camera.pixel_um();
    if !(pixel_um.is_finite() && pixel_um > 0.0) {
        return Err(ScanError::PixelSize(pixel_um));
    }
    if plan.is_empty() {
        return Err(ScanError::EmptyPlan);
    }
    fs::create_dir_all(dir).map_err(|e| WriteError::new(dir, &e))?;
    let mut visited = Vec::with_capacity(plan.len());
    for field in plan {
        visited.push(visit(field, camera, pixel_um, dir)?);
        done(visited.len(), plan.len());
    }
    let positions = dir.join(POSITIONS);
    write_whole(&positions, positions_csv(&visited).as_bytes())
        .map_err(|e| WriteError::new(&positions, &e))?;
    let configuration = dir.join(CONFIGURATION);
    let comment = format!("nominal places from measured stage positions at {pixel_um} um/px");
    write_configuration(&configuration, &places(&visited, senses, pixel_um), &[&comment])?;
    Ok(ScanReport { tiles: visited.len(), dir: dir.to_path_buf(), configuration, positions })
}

/// A field with the tile taken there.
struct Visit {
    field: Field,
    file: String,
    measured_mm: [f64; 2],
}

fn visit<C: Camera>(
    field: &Field,
    camera: &mut C,
    pixel_um: f64,
    dir: &Path,
) -> Result<Visit, ScanError<C::Error>> {
    let Field { row, col, .. } = *field;
    let shot =
        camera.image_at([field.x_mm, field.y_mm]).map_err(|source| ScanError::Camera { row, col, source })?;
    let [x_mm, y_mm] = shot.position_mm;
    if !(x_mm.is_finite() && y_mm.is_finite()) {
        return Err(ScanError::Position { row, col, x_mm, y_mm });
    }
    let file = format!("tile_r{row:03}_c{col:03}.tif");
    write_tiff(&dir.join(&file), &shot.image, Some(pixel_um))?;
    Ok(Visit { field: *field, file, measured_mm: shot.position_mm })
}

fn places(visited: &[Visit], senses: [Sense; 2], pixel_um: f64) -> Vec<Placed> {
    let first = visited.first().map_or([0.0, 0.0], |v| v.measured_mm);
    let place = |v: &Visit, k: usize| senses[k].sign() * (v.measured_mm[k] - first[k]) * 1000.0 / pixel_um;
    visited.iter().map(|v| Placed { file: v.file.clone(), place_px: [place(v, 0), place(v, 1)] }).collect()
}

fn positions_csv(visited: &[Visit]) -> String {
    let mut text = String::from("file,row,col,x_mm,y_mm,target_x_mm,target_y_mm\n");
    for Visit { field, file, measured_mm: [x, y] } in visited {
        let Field { row, col, x_mm, y_mm } = field;
        // Writing to a string cannot fail. Seven decimals are 0.1 nm.
        let _ = writeln!(text, "{file},{row},{col},{x:.7},{y:.7},{x_mm:.7},{y_mm:.7}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Channels, Depth};
    use crate::plan::serpentine;
    use crate::tiles::read_tiles;

    /// Gives flat pictures; misses every target by a fixed amount; may refuse one field.
    struct Flat {
        pixel_um: f64,
        taken: usize,
        refuses: Option<usize>,
    }

    impl Camera for Flat {
        type Error = std::io::Error;

        fn image_at(&mut self, [x, y]: [f64; 2]) -> Result<Shot, Self::Error> {
            if self.refuses == Some(self.taken) {
                return Err(std::io::Error::other("shutter stuck"));
            }
            self.taken += 1;
            let image = Image::from_f32(4, 4, Channels::Grey, Depth::Eight, &[self.taken as f32; 16])
                .map_err(std::io::Error::other)?;
            Ok(Shot { image, position_mm: [x + 0.001 * self.taken as f64, y] })
        }

        fn pixel_um(&self) -> f64 {
            self.pixel_um
        }
    }

    #[test]
    fn places_come_from_measured_positions_and_axis_senses() {
        let dir = tempfile::tempdir().unwrap();
        let plan = serpentine([0.2, 0.2], [1.0, 2.0], [0.12, 0.12], 20.0).unwrap();
        let mut camera = Flat { pixel_um: 0.5, taken: 0, refuses: None };
        let mut seen = 0;
        let report =
            scan(&plan, &mut camera, [Sense::Opposite, Sense::Same], dir.path(), &mut |n, _| seen = n)
                .unwrap();
        assert_eq!((report.tiles, seen), (4, 4));
        let set = read_tiles(dir.path(), &|_, _| ()).unwrap();
        assert_eq!(set.placed[2].file, "tile_r001_c001.tif");
        // 0.08 mm of step and 1 µm of difference between the misses of first and second field.
        let expected = [[0.0, 0.0], [-162.0, 0.0], [-164.0, 160.0], [-6.0, 160.0]];
        for (place, expected) in set.places().iter().zip(expected) {
            assert!((0..2).all(|k| (place[k] - expected[k]).abs() < 1e-3), "{place:?} {expected:?}");
        }
        let csv = fs::read_to_string(&report.positions).unwrap();
        assert!(csv.contains("tile_r000_c000.tif,0,0,1.0610000,2.0600000,1.0600000,2.0600000\n"), "{csv}");
    }

    #[test]
    fn a_failing_camera_is_named_by_its_field_and_no_configuration_appears() {
        let dir = tempfile::tempdir().unwrap();
        let plan = serpentine([0.2, 0.2], [0.0, 0.0], [0.12, 0.12], 20.0).unwrap();
        let mut camera = Flat { pixel_um: 0.5, taken: 0, refuses: Some(2) };
        let error = scan(&plan, &mut camera, [Sense::Same; 2], dir.path(), &mut |_, _| ()).unwrap_err();
        assert_eq!(error.to_string(), "field at row 1, column 1: shutter stuck");
        assert!(!dir.path().join(CONFIGURATION).exists());
        let mut bad = Flat { pixel_um: f64::NAN, taken: 0, refuses: None };
        let error = scan(&plan, &mut bad, [Sense::Same; 2], dir.path(), &mut |_, _| ()).unwrap_err();
        assert!(matches!(error, ScanError::PixelSize(_)));
    }
}
