//! Specimens, scans and mosaics.

use crate::ended::{abbe, done, everything_in, refused};
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Four tiles of tissue, scanned once.
pub(crate) fn tiles() -> &'static Path {
    static TILES: OnceLock<PathBuf> = OnceLock::new();
    TILES.get_or_init(|| {
        let dir = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let scan = ["scan", "--twin", "--area", "0.5x0.4", "--overlap", "20", "--truth", "truth"];
        let found = done(dir, &[&scan[..], &["--out", "tiles", "--force"]].concat());
        assert_eq!(found["scan"]["tiles"], 4);
        dir.join("tiles")
    })
}

/// A folder with a copy of the tiles in `tiles`.
fn copy() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("tiles")).unwrap();
    for entry in fs::read_dir(tiles()).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), dir.path().join("tiles").join(entry.file_name())).unwrap();
    }
    dir
}

/// Head of a PNG of 8 × 8 grey pixels: signature and IHDR, no pixels.
const CUT_PNG: [u8; 33] = [
    0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 13, b'I', b'H', b'D', b'R', 0, 0, 0, 8, 0, 0, 0,
    8, 8, 0, 0, 0, 0, 0xe1, 0x64, 0xe1, 0x57,
];

#[test]
fn a_specimen_that_is_no_picture_is_named() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("letter.png"), "Dear reader,").unwrap();
    fs::write(dir.path().join("cut.png"), CUT_PNG).unwrap();
    fs::write(dir.path().join("empty.jpg"), "").unwrap();
    for command in ["scan", "demo"] {
        for (file, says) in
            [("letter.png", "Dear"), ("cut.png", "damaged"), ("empty.jpg", "empty"), ("none.tif", "none.tif")]
        {
            let scan: &[&str] = if command == "scan" { &["scan", "--twin"] } else { &["demo"] };
            let arguments = [scan, &["--specimen", file, "--out", "s"]].concat();
            refused(dir.path(), &arguments, 1, &["specimen", file, says]);
        }
    }
    for pixel in ["0", "-1", "nan"] {
        let arguments = ["scan", "--twin", "--specimen-pixel", pixel, "--out", "s"];
        refused(dir.path(), &arguments, 2, &["--specimen-pixel", &format!("`{pixel}`")]);
    }
}

#[test]
fn scans_that_cannot_be_planned_name_the_value() {
    let dir = tempfile::tempdir().unwrap();
    let cases: [(&[&str], &[&str]); 12] = [
        (&["--overlap", "0"], &["overlap", "0 %", "90 %"]),
        (&["--overlap", "100"], &["overlap", "100 %", "90 %"]),
        (&["--overlap", "-5"], &["overlap", "-5 %"]),
        (&["--overlap", "NaN"], &["--overlap", "`NaN`"]),
        (&["--overlap", "much"], &["--overlap", "`much`"]),
        (&["--area", "0x1"], &["area width", "0 mm"]),
        (&["--area", "-1x1"], &["area width", "-1 mm"]),
        (&["--area", "big"], &["--area", "`big`"]),
        (&["--area", "1e9x1e9"], &["fields"]),
        (&["--area", "120x1"], &["x = ", "0 … 100 mm"]),
        (&["--centre", "50,-20"], &["y = -", "0 … 100 mm"]),
        (&["--centre", "50"], &["--centre", "`50`"]),
    ];
    for (arguments, names) in cases {
        refused(dir.path(), &[&["scan", "--twin", "--out", "s"], arguments].concat(), 2, names);
    }
}

#[test]
fn tiles_become_a_mosaic() {
    let dir = tempfile::tempdir().unwrap();
    let found = done(dir.path(), &["stitch", tiles().to_str().unwrap(), "--out", "new/mosaic.tif"]);
    assert_eq!(found["tiles"], 4);
    assert!(found["residual_rms_px"].as_f64().unwrap() < 0.2, "{found}");
    let names: Vec<PathBuf> = everything_in(&dir.path().join("new")).into_keys().collect();
    let expected = ["TileConfiguration.registered.txt", "mosaic.png", "mosaic.tif"];
    assert_eq!(names, expected.map(|name| dir.path().join("new").join(name)));
}

#[test]
fn the_middle_of_a_picture_is_the_middle_of_its_scan() {
    let dir = tempfile::tempdir().unwrap();
    // A black square in the middle of a white one, on a bare stage that is 50 µm and more off.
    let black = |place: u32| (60..140).contains(&place);
    let square =
        image::GrayImage::from_fn(200, 200, |x, y| image::Luma([if black(x) && black(y) { 0 } else { 255 }]));
    square.save(dir.path().join("square.png")).unwrap();
    let scan = ["scan", "--twin", "--specimen", "square.png", "--specimen-pixel", "0.5", "--out", "s"];
    let found = done(dir.path(), &scan);
    assert_eq!((&found["area_mm"], &found["scan"]["tiles"]), (&json!([0.1, 0.1]), &json!(1)));
    let tile = image::open(dir.path().join("s/tile_r000_c000.tif")).unwrap().into_luma8();
    let dark: Vec<(u32, u32)> =
        tile.enumerate_pixels().filter(|(_, _, level)| level[0] < 100).map(|(x, y, _)| (x, y)).collect();
    assert!((6000..6800).contains(&dark.len()), "{} dark pixels", dark.len());
    let middle =
        |place: fn(&(u32, u32)) -> u32| dark.iter().map(place).sum::<u32>() as f64 / dark.len() as f64;
    let (x, y) = (middle(|dark| dark.0), middle(|dark| dark.1));
    assert!((x - 319.5).abs() < 4.0 && (y - 239.5).abs() < 4.0, "the middle is at {x}, {y}");
}

/// Places of a configuration file, px.
fn places(file: &Path) -> Vec<[f64; 2]> {
    let text = fs::read_to_string(file).unwrap();
    let inside = text.lines().filter_map(|line| line.split_once('(')?.1.strip_suffix(')'));
    let number = |text: &str| text.trim().parse().unwrap();
    inside.map(|pair| pair.split_once(',').unwrap()).map(|(x, y)| [number(x), number(y)]).collect()
}

#[test]
fn registered_tiles_lie_where_they_truly_are() {
    let dir = tempfile::tempdir().unwrap();
    done(dir.path(), &["stitch", tiles().to_str().unwrap(), "--out", "mosaic.tif"]);
    let found = places(&dir.path().join("TileConfiguration.registered.txt"));
    let truth = places(&tiles().with_file_name("truth").join("TileConfiguration.true.txt"));
    assert_eq!((found.len(), truth.len()), (4, 4));
    for axis in [0, 1] {
        let apart: Vec<f64> = found.iter().zip(&truth).map(|(a, b)| a[axis] - b[axis]).collect();
        let mean = apart.iter().sum::<f64>() / 4.0;
        assert!(apart.iter().all(|one| (one - mean).abs() < 0.5), "{apart:?}");
    }
}

/// What it is, what the sentence must name, and how it is done to a folder of tiles.
type Damage = (&'static str, &'static [&'static str], fn(&Path));

#[test]
fn a_damaged_set_of_tiles_is_named_and_nothing_is_written() {
    let damage: [Damage; 6] = [
        ("no configuration", &["tiles", "TileConfiguration.txt"], |tiles| {
            fs::remove_file(tiles.join("TileConfiguration.txt")).unwrap();
        }),
        ("no folder", &["tiles", "no such folder"], |tiles| fs::remove_dir_all(tiles).unwrap()),
        ("no tile", &["tile_r001_c000.tif"], |tiles| {
            fs::remove_file(tiles.join("tile_r001_c000.tif")).unwrap();
        }),
        ("half a tile", &["tile_r001_c001.tif", "TIFF"], |tiles| {
            let tile = tiles.join("tile_r001_c001.tif");
            let bytes = fs::read(&tile).unwrap();
            fs::write(&tile, &bytes[..bytes.len() / 2]).unwrap();
        }),
        ("a strange line", &["TileConfiguration.txt", "line 2", "`rubbish`"], |tiles| {
            fs::write(tiles.join("TileConfiguration.txt"), "dim = 2\nrubbish\n").unwrap();
        }),
        ("a strange place", &["TileConfiguration.txt", "line 2", "`NaN`"], |tiles| {
            let text = "dim = 2\ntile_r000_c000.tif; ; (0.0, NaN)\n";
            fs::write(tiles.join("TileConfiguration.txt"), text).unwrap();
        }),
    ];
    for (what, names, damage) in damage {
        let dir = copy();
        damage(&dir.path().join("tiles"));
        refused(dir.path(), &["stitch", "tiles", "--out", "new/mosaic.tif"], 1, names);
        assert!(!dir.path().join("new").exists(), "{what}");
    }
}

#[test]
fn a_mosaic_replaces_nothing_without_force() {
    for taken in ["mosaic.tif", "mosaic.png", "TileConfiguration.registered.txt"] {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join(taken), "mine").unwrap();
        let stitch = ["stitch", tiles().to_str().unwrap(), "--out", "mosaic.tif"];
        refused(dir.path(), &stitch, 2, &[taken, "--force"]);
    }
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("mosaic.tif"), "mine").unwrap();
    fs::create_dir(dir.path().join("folder.tif")).unwrap();
    let stitch = |out: &'static str| ["stitch", tiles().to_str().unwrap(), "--out", out];
    refused(dir.path(), &stitch("mosaic.jpg"), 2, &["mosaic.jpg", ".tif"]);
    refused(dir.path(), &stitch("mosaic"), 2, &["mosaic", ".tif"]);
    refused(dir.path(), &stitch("folder.tif"), 2, &["folder.tif", "a folder"]);
    refused(dir.path(), &stitch("mosaic.tif/new.tif"), 1, &["mosaic.tif", "cannot be written"]);
    done(dir.path(), &[&stitch("mosaic.tif")[..], &["--force"]].concat());
    assert!(fs::metadata(dir.path().join("mosaic.tif")).unwrap().len() > 100_000);
}

#[test]
fn the_same_seed_gives_the_same_tiles_and_another_does_not() {
    let dir = tempfile::tempdir().unwrap();
    for (out, seed) in [("one", "7"), ("same", "7"), ("other", "8")] {
        let arguments = ["scan", "--twin", "--area", "0.5x0.2", "--out", out, "--seed", seed];
        let ended = abbe(dir.path(), &arguments);
        assert_eq!(ended.status, Some(0), "{ended:?}");
        assert!(ended.stdout.starts_with("2 tiles"), "{}", ended.stdout);
    }
    let bytes = |folder: &str| {
        let found = everything_in(&dir.path().join(folder));
        assert_eq!(found.len(), 4);
        found.into_values().collect::<Vec<_>>()
    };
    assert!(bytes("one") == bytes("same"));
    assert!(bytes("one") != bytes("other"));
}
