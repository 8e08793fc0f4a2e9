//! Writing pictures: TIFF with true units, PNG preview. Every file appears whole or not at all.

use std::fs::File;
use std::io::{BufReader, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use tiff::decoder::Decoder;
use tiff::encoder::colortype::{ColorType, Gray8, Gray16, RGB8, RGB16};
use tiff::encoder::{Rational, TiffEncoder, TiffKind, TiffValue};
use tiff::tags::{ResolutionUnit, Tag};

use crate::image::{Channels, Image, Sample, Samples};
use crate::whole_file::WholeFile;

/// Long side of a preview in pixels, at most.
pub const PREVIEW_LONG_SIDE: usize = 2000;

/// From this many bytes of samples on, a TIFF is written in the big form of TIFF: classic offsets end at 4 GiB.
const CLASSIC_TIFF_BYTES: u64 = 4_200_000_000;

/// A file that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be written: {reason}", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// What the system or the encoder said.
    pub reason: String,
}

impl WriteError {
    pub(crate) fn new(path: &Path, reason: &impl ToString) -> Self {
        Self { path: path.to_path_buf(), reason: reason.to_string() }
    }
}

/// Writes an uncompressed TIFF. With `pixel_um` (µm per pixel, > 0) the resolution is stored in pixels per
/// centimetre; without it the file says that it has no unit.
///
/// # Errors
/// The file cannot be written; nothing is left behind then.
pub fn write_tiff(path: &Path, image: &Image, pixel_um: Option<f64>) -> Result<(), WriteError> {
    let failed = |reason: String| WriteError { path: path.to_path_buf(), reason };
    let mut file = WholeFile::create(path).map_err(|e| failed(e.to_string()))?;
    let writer = file.writer().map_err(|e| failed(e.to_string()))?;
    encode_tiff(writer, image, pixel_um).map_err(|e| failed(e.to_string()))?;
    file.finish().map_err(|e| failed(e.to_string()))
}

fn encode_tiff(writer: &mut BufWriter<File>, image: &Image, pixel_um: Option<f64>) -> tiff::TiffResult<()> {
    let sample_bytes = match image.samples() {
        Samples::Eight(v) => v.len() as u64,
        Samples::Sixteen(v) => 2 * v.len() as u64,
    };
    if sample_bytes < CLASSIC_TIFF_BYTES {
        encode_samples(TiffEncoder::new(writer)?, image, pixel_um)
    } else {
        encode_samples(TiffEncoder::new_big(writer)?, image, pixel_um)
    }
}

fn encode_samples<W: Write + Seek, K: TiffKind>(
    encoder: TiffEncoder<W, K>,
    image: &Image,
    pixel_um: Option<f64>,
) -> tiff::TiffResult<()> {
    match (image.samples(), image.channels()) {
        (Samples::Eight(v), Channels::Grey) => encode_page::<Gray8, _, _>(encoder, image, v, pixel_um),
        (Samples::Eight(v), Channels::Rgb) => encode_page::<RGB8, _, _>(encoder, image, v, pixel_um),
        (Samples::Sixteen(v), Channels::Grey) => encode_page::<Gray16, _, _>(encoder, image, v, pixel_um),
        (Samples::Sixteen(v), Channels::Rgb) => encode_page::<RGB16, _, _>(encoder, image, v, pixel_um),
    }
}

fn encode_page<C: ColorType, W: Write + Seek, K: TiffKind>(
    mut encoder: TiffEncoder<W, K>,
    image: &Image,
    samples: &[C::Inner],
    pixel_um: Option<f64>,
) -> tiff::TiffResult<()>
where
    [C::Inner]: TiffValue,
{
    let mut page = encoder.new_image::<C>(image.width() as u32, image.height() as u32)?;
    if let Some(um) = pixel_um {
        page.resolution(ResolutionUnit::Centimeter, rational(10_000.0 / um));
    } else {
        page.resolution(ResolutionUnit::None, Rational { n: 1, d: 1 });
    }
    page.write_data(samples)
}

/// The nearest fraction with a power of ten below it that fits 32 bits; relative error below 3·10⁻⁹ for values
/// from 1 to 4·10⁹.
fn rational(value: f64) -> Rational {
    let mut d = 1;
    while d < 100_000_000 && value * f64::from(d) * 10.0 < f64::from(u32::MAX) {
        d *= 10;
    }
    Rational { n: (value * f64::from(d)).round() as u32, d }
}

/// Pixel size in µm that a TIFF states, if it states one in true units.
pub(crate) fn stated_pixel_um(path: &Path) -> Option<f64> {
    let mut decoder = Decoder::new(BufReader::new(File::open(path).ok()?)).ok()?;
    let unit_um = match decoder.get_tag_u32(Tag::ResolutionUnit).ok()? {
        2 => 25_400.0,
        3 => 10_000.0,
        _ => return None,
    };
    let pixels_a_unit = match decoder.get_tag(Tag::XResolution).ok()? {
        tiff::decoder::ifd::Value::Rational(n, d) => f64::from(n) / f64::from(d),
        _ => return None,
    };
    let um = unit_um / pixels_a_unit;
    // 72 and 96 dots per inch are what programs write when they know nothing.
    let is_default = (unit_um - 25_400.0).abs() < 1.0 && pixels_a_unit <= 300.0;
    (um.is_finite() && um > 0.0 && !is_default).then_some(um)
}

/// Writes an 8-bit PNG whose long side is at most [`PREVIEW_LONG_SIDE`] pixels, each the mean of a whole square of
/// pixels.
///
/// # Errors
/// The file cannot be written; nothing is left behind then.
pub fn write_preview(path: &Path, image: &Image) -> Result<(), WriteError> {
    let factor = image.width().max(image.height()).div_ceil(PREVIEW_LONG_SIDE);
    let to_eight_bits = 255.0 / image.depth().full_scale();
    let (width, height, bytes) = match image.samples() {
        Samples::Eight(v) => scaled_down(image, v, factor, to_eight_bits),
        Samples::Sixteen(v) => scaled_down(image, v, factor, to_eight_bits),
    };
    let colour = match image.channels() {
        Channels::Grey => image::ExtendedColorType::L8,
        Channels::Rgb => image::ExtendedColorType::Rgb8,
    };
    let failed = |reason: String| WriteError { path: path.to_path_buf(), reason };
    let mut file = WholeFile::create(path).map_err(|e| failed(e.to_string()))?;
    let writer = file.writer().map_err(|e| failed(e.to_string()))?;
    PngEncoder::new(writer)
        .write_image(&bytes, width as u32, height as u32, colour)
        .map_err(|e| failed(e.to_string()))?;
    file.finish().map_err(|e| failed(e.to_string()))
}

/// Means over squares of `factor` pixels (fewer at the right and lower rim), as 8-bit samples.
fn scaled_down<S: Sample>(image: &Image, samples: &[S], factor: usize, gain: f32) -> (usize, usize, Vec<u8>) {
    let channels = image.channels().count();
    let (width, height) = (image.width().div_ceil(factor), image.height().div_ceil(factor));
    let mut out = Vec::with_capacity(width * height * channels);
    for top in (0..image.height()).step_by(factor) {
        for left in (0..image.width()).step_by(factor) {
            let rows = top..(top + factor).min(image.height());
            let columns = left..(left + factor).min(image.width());
            let pixels = (rows.len() * columns.len()) as f32;
            for channel in 0..channels {
                let sum: f32 = rows
                    .clone()
                    .flat_map(|y| columns.clone().map(move |x| (y, x)))
                    .map(|(y, x)| samples[(y * image.width() + x) * channels + channel].into())
                    .sum();
                out.push(u8::nearest(sum / pixels * gain));
            }
        }
    }
    (width, height, out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiff_round_trip_keeps_samples_and_pixel_size() {
        let dir = tempfile::tempdir().unwrap();
        for channels in [Channels::Grey, Channels::Rgb] {
            let n = 31 * 17 * channels.count();
            let eight = Samples::Eight((0..n).map(|i| (i * 7) as u8).collect());
            let sixteen = Samples::Sixteen((0..n).map(|i| (i * 977) as u16).collect());
            for samples in [eight, sixteen] {
                let image = Image::new(31, 17, channels, samples).unwrap();
                let path = dir.path().join("t.tif");
                write_tiff(&path, &image, Some(0.501)).unwrap();
                assert_eq!(Image::read(&path).unwrap(), image);
                let um = stated_pixel_um(&path).unwrap();
                assert!((um / 0.501 - 1.0).abs() < 1e-8, "{um}");
                write_tiff(&path, &image, None).unwrap();
                assert_eq!(stated_pixel_um(&path), None);
            }
        }
    }

    #[test]
    fn preview_fits_and_keeps_the_mean() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("p.png");
        let image = Image::new(4100, 30, Channels::Grey, Samples::Sixteen(vec![0x8000; 4100 * 30])).unwrap();
        write_preview(&path, &image).unwrap();
        let preview = Image::read(&path).unwrap();
        assert_eq!((preview.width(), preview.height()), (1367, 10));
        assert_eq!(preview.value(700, 5, 0), 128.0);
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let image = Image::new(1, 1, Channels::Grey, Samples::Eight(vec![0])).unwrap();
        let error = write_tiff(Path::new("/nonexistent-folder/a.tif"), &image, None).unwrap_err();
        assert!(error.to_string().contains("/nonexistent-folder/a.tif"));
    }
}
