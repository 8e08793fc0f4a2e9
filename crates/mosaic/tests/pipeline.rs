//! From a plan to the files of a mosaic.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use std::convert::Infallible;
use std::fs;
use std::path::Path;

use abbe_mosaic::compare::compare;
use abbe_mosaic::image::{Channels, Depth, Image};
use abbe_mosaic::output::PREVIEW_LONG_SIDE;
use abbe_mosaic::plan::serpentine;
use abbe_mosaic::scan::{Camera, Sense, Shot, scan};
use abbe_mosaic::stitch::{StitchError, StitchOptions, StitchReport, stitch};
use abbe_mosaic::tiles::{Placed, read_configuration};
use common::{Sequence, Truth, tissue};

const PIXEL_UM: f64 = 0.5;

/// A stage good to 1 µm with a camera that is turned, off in scale, distorting, vignetting and noisy.
struct Microscope {
    truth: Truth,
    sequence: Sequence,
    true_places: Vec<[f64; 2]>,
}

impl Camera for Microscope {
    type Error = Infallible;

    fn image_at(&mut self, position_mm: [f64; 2]) -> Result<Shot, Infallible> {
        let truth = self.truth;
        let mut sequence = Sequence(self.sequence.unit().to_bits());
        let actual = position_mm.map(|v| v + 0.001 * sequence.normal());
        let [x, y] = actual.map(|v| v * 1000.0 / PIXEL_UM);
        let (s, c) = truth.angle_deg.to_radians().sin_cos();
        let place = [truth.scale * (c * x - s * y), truth.scale * (s * x + c * y)];
        self.true_places.push(place);
        Ok(Shot { image: truth.image(place, &tissue, &mut sequence), position_mm })
    }

    fn pixel_um(&self) -> f64 {
        PIXEL_UM
    }
}

/// Scans 4 × 3 fields into `dir`; returns the true places by file.
fn scanned(dir: &Path) -> Vec<Placed> {
    let truth = Truth { channels: Channels::Rgb, size: [256, 200], ..Truth::default() };
    let field = truth.size.map(|n| n as f64 * PIXEL_UM / 1000.0);
    let plan = serpentine([field[0] * 3.6, field[1] * 2.7], [3.0, 4.0], field, 12.0).unwrap();
    let mut camera = Microscope { truth, sequence: Sequence(3), true_places: Vec::new() };
    scan(&plan, &mut camera, [Sense::Same; 2], dir, &mut |_, _| ()).unwrap();
    let name = |(field, place): (&abbe_mosaic::plan::Field, &[f64; 2])| Placed {
        file: format!("tile_r{:03}_c{:03}.tif", field.row, field.col),
        place_px: *place,
    };
    plan.iter().zip(&camera.true_places).map(name).collect()
}

fn stitched(tiles: &Path, out: &Path, threads: usize) -> StitchReport {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| stitch(tiles, &out.join("mosaic.tif"), &StitchOptions::default(), &|_| ()).unwrap())
}

#[test]
fn a_scan_becomes_one_picture_the_same_with_any_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let truth = scanned(&dir.path().join("tiles"));
    let one = stitched(&dir.path().join("tiles"), &dir.path().join("one"), 1);
    let three = stitched(&dir.path().join("tiles"), &dir.path().join("three"), 3);
    for file in ["mosaic.tif", "mosaic.png", "TileConfiguration.registered.txt"] {
        let read = |folder: &str| fs::read(dir.path().join(folder).join(file)).unwrap();
        assert!(read("one") == read("three"), "{file}");
    }
    assert_eq!(one.registration.placed, three.registration.placed);

    let placed = read_configuration(&one.configuration).unwrap();
    let comparison = compare(&placed, &truth).unwrap();
    assert!(comparison.rms_px < 0.15, "{comparison:?}");
    let mosaic = Image::read(&one.mosaic).unwrap();
    assert_eq!((mosaic.channels(), mosaic.depth()), (Channels::Rgb, Depth::Eight));
    assert_eq!([mosaic.width(), mosaic.height()], one.mosaic_size_px);
    let preview = Image::read(&one.preview).unwrap();
    assert!(preview.width().max(preview.height()) <= PREVIEW_LONG_SIDE);
    // A pixel that is 0.2 % smaller than its maker says.
    assert!((one.pixel_um.unwrap() / PIXEL_UM - 1.0 / 1.002).abs() < 0.0025, "{:?}", one.pixel_um);
    serde_json::to_string(&one).unwrap();
    let left = fs::read_dir(dir.path().join("one")).unwrap().count();
    assert_eq!(left, 3, "no temporary file is left");
}

#[test]
fn the_mosaic_is_the_specimen_without_a_seam() {
    let dir = tempfile::tempdir().unwrap();
    let truth = scanned(&dir.path().join("tiles"));
    let report = stitched(&dir.path().join("tiles"), dir.path(), 2);
    let mosaic = Image::read(&report.mosaic).unwrap();
    let placed = &report.registration.placed;
    let least = |k: usize| placed.iter().map(|p| p.place_px[k]).fold(f64::INFINITY, f64::min).round();
    let n = placed.len() as f64;
    let offset = [0, 1].map(|k| {
        least(k) + placed.iter().zip(&truth).map(|(p, t)| t.place_px[k] - p.place_px[k]).sum::<f64>() / n
    });
    // Ratio of mosaic to specimen in blocks: a seam or left-over shading would make it jump.
    let block = |left: usize, top: usize| {
        let pixels = (0..24).flat_map(|j| (0..24).map(move |i| (left + i, top + j)));
        let (seen, true_sum) = pixels.fold((0.0, 0.0), |(a, b), (x, y)| {
            let specimen = tissue(x as f64 + offset[0], y as f64 + offset[1], 1);
            (a + f64::from(mosaic.value(x, y, 1)), b + specimen * 255.0)
        });
        seen / true_sum
    };
    let spots = (1..mosaic.height() / 24 - 1)
        .flat_map(|j| (1..mosaic.width() / 24 - 1).map(move |i| (24 * i, 24 * j)));
    let ratios: Vec<f64> = spots.map(|(x, y)| block(x, y)).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let worst = ratios.iter().map(|r| (r / mean - 1.0).abs()).fold(0.0, f64::max);
    println!("mean {mean:.4}, worst {worst:.4}");
    assert!(worst < 0.03, "{worst}");
}

#[test]
fn what_cannot_be_done_is_said_before_the_work() {
    let dir = tempfile::tempdir().unwrap();
    let try_to =
        |mosaic: &Path, options: StitchOptions| stitch(dir.path(), mosaic, &options, &|_| ()).unwrap_err();
    let error = try_to(&dir.path().join("mosaic.xyz"), StitchOptions::default());
    assert!(matches!(error, StitchError::NotTiff(_)) && error.to_string().contains("mosaic.xyz"));
    let zero = StitchOptions { pixel_um: Some(0.0), ..StitchOptions::default() };
    assert!(matches!(try_to(&dir.path().join("m.tif"), zero), StitchError::PixelSize(_)));
    fs::write(dir.path().join("file"), "").unwrap();
    let error = try_to(&dir.path().join("file/m.tif"), StitchOptions::default());
    assert!(matches!(error, StitchError::Write(_)), "{error}");
    assert!(matches!(try_to(&dir.path().join("m.tif"), StitchOptions::default()), StitchError::Tiles(_)));
}

#[test]
fn tiles_too_far_apart_for_memory_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let image = Image::from_f32(8, 8, Channels::Grey, Depth::Eight, &[9.0; 64]).unwrap();
    for name in ["a.tif", "b.tif"] {
        abbe_mosaic::output::write_tiff(&dir.path().join(name), &image, None).unwrap();
    }
    let text = "dim = 2\na.tif; ; (0, 0)\nb.tif; ; (90000000, 90000000)\n";
    fs::write(dir.path().join("TileConfiguration.txt"), text).unwrap();
    let error =
        stitch(dir.path(), &dir.path().join("m.tif"), &StitchOptions::default(), &|_| ()).unwrap_err();
    assert!(error.to_string().contains("90000008 × 90000008"), "{error}");
}
