//! Tiles and the `TileConfiguration.txt` that says where they lie (the form of Fiji's stitching plugins).
//!
//! ```text
//! # a comment
//! dim = 2
//! tile_r000_c000.tif; ; (0.0000, 0.0000)
//! tile_r000_c001.tif; ; (453.0000, 0.0000)
//! ```
//! Places are in pixels: of the tile's first pixel, x right, y down.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use crate::image::{Image, ImageError};
use crate::output::WriteError;
use crate::whole_file::write_whole;

/// Name of the file that lists a folder's tiles.
pub const CONFIGURATION: &str = "TileConfiguration.txt";

/// Name of the file that lists the tiles at their registered places.
pub const REGISTERED_CONFIGURATION: &str = "TileConfiguration.registered.txt";

/// Places beyond this many pixels are refused as damage: `f64` still resolves 10⁻⁷ px there.
pub const FARTHEST_PX: f64 = 1e8;

/// A tile's name and place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Placed {
    /// File name, relative to the folder of the configuration.
    pub file: String,
    /// Place of the first pixel, px.
    pub place_px: [f64; 2],
}

/// What is wrong with a configuration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The line is neither comment, `dim`, nor tile.
    #[error("expected `name; ; (x, y)`, found `{0}`")]
    Form(String),
    /// Not two-dimensional.
    #[error("only `dim = 2` is supported, found `{0}`")]
    Dimension(String),
    /// A coordinate is no number, not finite, or out of range.
    #[error("expected a number of pixels up to ±1e8, found `{0}`")]
    Number(String),
    /// The same file twice.
    #[error("tile `{file}` is already named in line {first_line}")]
    DuplicateFile {
        /// The tile.
        file: String,
        /// Where it was named first.
        first_line: usize,
    },
    /// Two tiles at the same place.
    #[error("tile `{file}` lies exactly where the tile of line {first_line} lies")]
    DuplicatePlace {
        /// The later tile.
        file: String,
        /// Line of the earlier one.
        first_line: usize,
    },
    /// No tile at all.
    #[error("the file names no tile")]
    Empty,
}

/// A fault and its line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {fault}")]
pub struct ConfigurationError {
    /// Line number from 1; for [`Fault::Empty`] the last line.
    pub line: usize,
    /// What is wrong.
    pub fault: Fault,
}

/// Why a folder of tiles could not be read.
#[derive(Debug, thiserror::Error)]
pub enum TilesError {
    /// The configuration cannot be opened.
    #[error("{}: {source}", path.display())]
    Open {
        /// The configuration file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The configuration is faulty.
    #[error("{}, {error}", path.display())]
    Configuration {
        /// The configuration file.
        path: PathBuf,
        /// Line and fault.
        error: ConfigurationError,
    },
    /// A tile is missing, damaged or of an unsupported kind.
    #[error(transparent)]
    Tile(#[from] ImageError),
    /// A tile is not like the first one.
    #[error("{}: {found}, but {first} has {expected}; all tiles of a mosaic must be alike", path.display())]
    Unlike {
        /// The tile.
        path: PathBuf,
        /// Its size and kind.
        found: String,
        /// Name of the first tile.
        first: String,
        /// The first tile's size and kind.
        expected: String,
    },
}

/// Parses a configuration. Never panics, whatever the bytes.
///
/// # Errors
/// [`ConfigurationError`] with the line.
pub fn parse(bytes: &[u8]) -> Result<Vec<Placed>, ConfigurationError> {
    let text = String::from_utf8_lossy(bytes);
    let mut seen = Seen::default();
    let mut tiles = Vec::new();
    let mut last_line = 1;
    for (index, raw) in text.lines().enumerate() {
        last_line = index + 1;
        let line = raw.trim().trim_start_matches('\u{feff}');
        let tile = parse_line(line).and_then(|tile| match tile {
            Some(tile) => seen.check(&tile, last_line).map(|()| Some(tile)),
            None => Ok(None),
        });
        tiles.extend(tile.map_err(|fault| ConfigurationError { line: last_line, fault })?);
    }
    if tiles.is_empty() {
        return Err(ConfigurationError { line: last_line, fault: Fault::Empty });
    }
    Ok(tiles)
}

/// Files and places met so far, with their lines.
#[derive(Default)]
struct Seen {
    files: BTreeMap<String, usize>,
    places: BTreeMap<[u64; 2], usize>,
}

impl Seen {
    fn check(&mut self, tile: &Placed, line: usize) -> Result<(), Fault> {
        let file = tile.file.clone();
        if let Some(&first_line) = self.files.get(&file) {
            return Err(Fault::DuplicateFile { file, first_line });
        }
        // Adding zero turns -0 into 0, so that equal places have equal bits.
        let place = tile.place_px.map(|v| (v + 0.0).to_bits());
        if let Some(&first_line) = self.places.get(&place) {
            return Err(Fault::DuplicatePlace { file, first_line });
        }
        self.files.insert(file, line);
        self.places.insert(place, line);
        Ok(())
    }
}

fn parse_line(line: &str) -> Result<Option<Placed>, Fault> {
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    // A tile line has semicolons; a tile may be called `dim = 2.tif`.
    if !line.contains(';') {
        return parse_setting(line).map(|()| None);
    }
    let form = || Fault::Form(shortened(line));
    let (rest, place) = line.rsplit_once(';').ok_or_else(form)?;
    let (file, _series) = rest.rsplit_once(';').ok_or_else(form)?;
    let inner = place.trim().strip_prefix('(').and_then(|p| p.strip_suffix(')')).ok_or_else(form)?;
    let numbers: Vec<&str> = inner.split(',').collect();
    let &[x, y] = numbers.as_slice() else {
        return Err(Fault::Dimension(shortened(place.trim())));
    };
    if file.trim().is_empty() {
        return Err(form());
    }
    Ok(Some(Placed { file: file.trim().to_owned(), place_px: [parse_number(x)?, parse_number(y)?] }))
}

fn parse_setting(line: &str) -> Result<(), Fault> {
    let (key, value) = line.split_once('=').ok_or_else(|| Fault::Form(shortened(line)))?;
    match (key.trim(), value.trim()) {
        ("dim", "2") => Ok(()),
        ("dim", _) => Err(Fault::Dimension(shortened(line))),
        _ => Err(Fault::Form(shortened(line))),
    }
}

fn parse_number(text: &str) -> Result<f64, Fault> {
    let number = text.trim().parse::<f64>().ok();
    number.filter(|v| v.abs() <= FARTHEST_PX).ok_or_else(|| Fault::Number(shortened(text.trim())))
}

/// The offending text, cut to what fits in one sentence.
fn shortened(text: &str) -> String {
    const MOST: usize = 80;
    if text.chars().count() <= MOST {
        return text.to_owned();
    }
    text.chars().take(MOST).chain(['…']).collect()
}

/// Text of a configuration: places with four decimals, the given lines as comments on top.
pub fn format(tiles: &[Placed], comments: &[&str]) -> String {
    let mut text = String::new();
    for comment in comments {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "# {comment}");
    }
    text.push_str("dim = 2\n\n");
    for Placed { file, place_px: [x, y] } in tiles {
        // Adding zero to a rounded place keeps the sign off a zero.
        let [x, y] = [x, y].map(|v| (v * 1e4).round() / 1e4 + 0.0);
        let _ = writeln!(text, "{file}; ; ({x:.4}, {y:.4})");
    }
    text
}

/// Writes a configuration, whole or not at all.
///
/// # Errors
/// The file cannot be written.
pub fn write_configuration(path: &Path, tiles: &[Placed], comments: &[&str]) -> Result<(), WriteError> {
    write_whole(path, format(tiles, comments).as_bytes()).map_err(|e| WriteError::new(path, &e))
}

/// Reads a configuration file.
///
/// # Errors
/// It cannot be opened or is faulty.
pub fn read_configuration(path: &Path) -> Result<Vec<Placed>, TilesError> {
    let bytes = fs::read(path).map_err(|source| TilesError::Open { path: path.to_path_buf(), source })?;
    parse(&bytes).map_err(|error| TilesError::Configuration { path: path.to_path_buf(), error })
}

/// Tiles of equal size and kind with their nominal places.
#[derive(Debug)]
pub struct TileSet {
    /// Names and nominal places.
    pub placed: Vec<Placed>,
    /// The pictures, in the same order.
    pub images: Vec<Image>,
}

impl TileSet {
    /// Width and height of every tile, px.
    pub fn tile_size(&self) -> [usize; 2] {
        self.images.first().map_or([0, 0], |i| [i.width(), i.height()])
    }

    /// Nominal places, px.
    pub fn places(&self) -> Vec<[f64; 2]> {
        self.placed.iter().map(|p| p.place_px).collect()
    }
}

/// Reads `TileConfiguration.txt` in `dir` and every tile that it names. `done` is told how many tiles of how many
/// are read.
///
/// # Errors
/// See [`TilesError`]; of several faulty tiles the first one is named.
pub fn read_tiles(dir: &Path, done: &(dyn Fn(usize, usize) + Sync)) -> Result<TileSet, TilesError> {
    let placed = read_configuration(&dir.join(CONFIGURATION))?;
    let count = AtomicUsize::new(0);
    let read = |tile: &Placed| {
        let image = Image::read(&dir.join(&tile.file));
        done(count.fetch_add(1, Ordering::Relaxed) + 1, placed.len());
        image
    };
    let results: Vec<_> = placed.par_iter().map(read).collect();
    let images = results.into_iter().collect::<Result<Vec<_>, _>>()?;
    let set = TileSet { placed, images };
    set.check_alike(dir)?;
    Ok(set)
}

impl TileSet {
    fn check_alike(&self, dir: &Path) -> Result<(), TilesError> {
        let kinds = || self.images.iter().map(kind);
        let Some(expected) = kinds().next() else { return Ok(()) };
        let odd = kinds().zip(&self.placed).find(|(found, _)| *found != expected);
        odd.map_or(Ok(()), |(found, tile)| {
            let first = self.placed[0].file.clone();
            Err(TilesError::Unlike { path: dir.join(&tile.file), found, first, expected })
        })
    }
}

fn kind(image: &Image) -> String {
    let bits = match image.depth() {
        crate::image::Depth::Eight => 8,
        crate::image::Depth::Sixteen => 16,
    };
    format!("{} × {} pixels, {bits} bit {:?}", image.width(), image.height(), image.channels())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::{Channels, Depth};
    use crate::output::write_tiff;

    fn fault(text: &str) -> (usize, Fault) {
        let error = parse(text.as_bytes()).unwrap_err();
        (error.line, error.fault)
    }

    #[test]
    fn comments_blank_lines_and_exponents_are_read() {
        let text =
            "# Define the number of dimensions\r\ndim = 2\r\n\r\na b.tif; ; (1e2, -3.5)\n  c.tif;;(0,0)";
        let tiles = parse(text.as_bytes()).unwrap();
        assert_eq!(tiles[0], Placed { file: "a b.tif".into(), place_px: [100.0, -3.5] });
        assert_eq!(tiles[1], Placed { file: "c.tif".into(), place_px: [0.0, 0.0] });
    }

    #[test]
    fn each_fault_names_line_and_text() {
        assert_eq!(fault("dim = 3"), (1, Fault::Dimension("dim = 3".into())));
        assert_eq!(fault("dim = 2\na.tif; ; (1, 2, 3)"), (2, Fault::Dimension("(1, 2, 3)".into())));
        assert_eq!(fault("dim = 2\n\na.tif; ; (1, x7)"), (3, Fault::Number("x7".into())));
        assert_eq!(fault("a.tif; ; (NaN, 2)"), (1, Fault::Number("NaN".into())));
        assert_eq!(fault("a.tif; ; (inf, 2)"), (1, Fault::Number("inf".into())));
        assert_eq!(fault("a.tif; ; (1e30, 2)"), (1, Fault::Number("1e30".into())));
        assert_eq!(fault("a.tif (1, 2)"), (1, Fault::Form("a.tif (1, 2)".into())));
        assert_eq!(fault("a.tif; ; 1, 2"), (1, Fault::Form("a.tif; ; 1, 2".into())));
        assert_eq!(fault("dim = 2\n# nothing"), (2, Fault::Empty));
        let twice = Fault::DuplicateFile { file: "a.tif".into(), first_line: 1 };
        assert_eq!(fault("a.tif; ; (0, 0)\na.tif; ; (1, 0)"), (2, twice));
        let same = Fault::DuplicatePlace { file: "b.tif".into(), first_line: 1 };
        assert_eq!(fault("a.tif; ; (0, 0)\nb.tif; ; (-0.0, 0)"), (2, same));
    }

    fn grey(width: usize, depth: Depth) -> Image {
        Image::from_f32(width, 8, Channels::Grey, depth, &vec![7.0; width * 8]).unwrap()
    }

    fn folder(images: &[Image], text: &str) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for (i, image) in images.iter().enumerate() {
            write_tiff(&dir.path().join(format!("{i}.tif")), image, None).unwrap();
        }
        fs::write(dir.path().join(CONFIGURATION), text).unwrap();
        dir
    }

    fn failure(dir: &tempfile::TempDir) -> String {
        read_tiles(dir.path(), &|_, _| ()).unwrap_err().to_string()
    }

    #[test]
    fn unlike_missing_and_truncated_tiles_are_named() {
        let two = "0.tif; ; (0, 0)\n1.tif; ; (9, 0)";
        let sizes = folder(&[grey(8, Depth::Eight), grey(9, Depth::Eight)], two);
        assert!(failure(&sizes).contains("1.tif: 9 × 8 pixels, 8 bit Grey, but 0.tif has 8 × 8 pixels"));
        let depths = folder(&[grey(8, Depth::Eight), grey(8, Depth::Sixteen)], two);
        assert!(failure(&depths).contains("1.tif: 8 × 8 pixels, 16 bit Grey"));
        let missing = folder(&[grey(8, Depth::Eight)], two);
        assert!(failure(&missing).contains("1.tif: No such file"));
        let truncated = folder(&[grey(8, Depth::Eight), grey(8, Depth::Eight)], two);
        let path = truncated.path().join("1.tif");
        fs::write(&path, &fs::read(&path).unwrap()[..60]).unwrap();
        assert!(failure(&truncated).contains("1.tif: not a readable"));
    }

    #[test]
    fn a_folder_without_configuration_and_a_faulty_one_are_named() {
        let empty = tempfile::tempdir().unwrap();
        assert!(failure(&empty).contains("TileConfiguration.txt: No such file"));
        let bad = folder(&[], "dim = 2\n0.tif; ; (a, 0)");
        assert!(
            failure(&bad)
                .contains("TileConfiguration.txt, line 2: expected a number of pixels up to ±1e8, found `a`")
        );
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = parse(&bytes);
        }

        #[test]
        fn tile_like_lines_are_read_or_refused(text in r"([a-z;#(),.0-9 =\-e]|;|\(|\)|\n){0,120}") {
            let _ = parse(text.as_bytes());
        }

        #[test]
        fn what_is_written_is_read_back(places in prop::collection::vec([-1e6..1e6f64, -1e6..1e6f64], 1..20)) {
            let tiles: Vec<_> =
                places.iter().enumerate().map(|(i, &place_px)| Placed { file: format!("t{i}.tif"), place_px }).collect();
            let read = parse(format(&tiles, &["made by a test"]).as_bytes()).unwrap();
            for (a, b) in tiles.iter().zip(&read) {
                prop_assert_eq!(&a.file, &b.file);
                prop_assert!((0..2).all(|k| (a.place_px[k] - b.place_px[k]).abs() <= 0.5001e-4));
            }
        }
    }
}
