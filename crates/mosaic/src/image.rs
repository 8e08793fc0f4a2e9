//! A picture of grey or RGB samples, 8 or 16 bit, and reading it from a file.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use serde::Serialize;

/// More decoded bytes than this in one picture are refused: the header is then more likely damaged than true.
const MOST_DECODED_BYTES: u64 = 16 << 30;

/// Bits of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Depth {
    /// 0 to 255.
    Eight,
    /// 0 to 65 535.
    Sixteen,
}

impl Depth {
    /// Largest sample value.
    pub fn full_scale(self) -> f32 {
        match self {
            Self::Eight => 255.0,
            Self::Sixteen => 65535.0,
        }
    }
}

/// Samples of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Channels {
    /// One sample.
    Grey,
    /// Red, green, blue.
    Rgb,
}

impl Channels {
    /// 1 or 3.
    pub fn count(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::Rgb => 3,
        }
    }
}

/// Sample storage, row by row, channels interleaved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Samples {
    /// 8-bit samples.
    Eight(Vec<u8>),
    /// 16-bit samples.
    Sixteen(Vec<u16>),
}

impl Samples {
    fn len(&self) -> usize {
        match self {
            Self::Eight(v) => v.len(),
            Self::Sixteen(v) => v.len(),
        }
    }
}

/// A sample type of an image: `u8` or `u16`.
pub(crate) trait Sample: Copy + Default + Send + Sync + Into<f32> {
    /// Rounds to the nearest value, saturating.
    fn nearest(value: f32) -> Self;
}

impl Sample for u8 {
    fn nearest(value: f32) -> Self {
        (value + 0.5).clamp(0.0, 255.0) as u8
    }
}

impl Sample for u16 {
    fn nearest(value: f32) -> Self {
        (value + 0.5).clamp(0.0, 65535.0) as u16
    }
}

/// A picture. Samples stay in their source depth; they are read as `f32` in grey levels of that depth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: usize,
    height: usize,
    channels: Channels,
    samples: Samples,
}

/// Why a picture could not be made or read.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file could not be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is damaged, truncated or no picture.
    #[error("{}: not a readable TIFF, PNG or JPEG picture: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        reason: String,
    },
    /// The file holds samples other than 8- or 16-bit integers.
    #[error("{}: samples of kind {kind} are not supported, only 8- or 16-bit grey or RGB", path.display())]
    Kind {
        /// The file.
        path: PathBuf,
        /// The decoder's name for the sample kind.
        kind: String,
    },
    /// Width, height and channels do not fit the number of samples.
    #[error("{width} × {height} pixels of {channels} samples do not make {samples} samples")]
    Shape {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Samples a pixel.
        channels: usize,
        /// Samples given.
        samples: usize,
    },
}

impl Image {
    /// Makes a picture of samples row by row, channels interleaved.
    ///
    /// # Errors
    /// [`ImageError::Shape`] if a side is zero or the number of samples is not `width · height · channels`.
    pub fn new(
        width: usize,
        height: usize,
        channels: Channels,
        samples: Samples,
    ) -> Result<Self, ImageError> {
        let expected = width.checked_mul(height).and_then(|n| n.checked_mul(channels.count()));
        if width == 0 || height == 0 || expected != Some(samples.len()) {
            let (channels, samples) = (channels.count(), samples.len());
            return Err(ImageError::Shape { width, height, channels, samples });
        }
        Ok(Self { width, height, channels, samples })
    }

    /// Makes a picture from values in grey levels of `depth`, rounded and saturated.
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn from_f32(
        width: usize,
        height: usize,
        channels: Channels,
        depth: Depth,
        values: &[f32],
    ) -> Result<Self, ImageError> {
        let samples = match depth {
            Depth::Eight => Samples::Eight(values.iter().map(|&v| Sample::nearest(v)).collect()),
            Depth::Sixteen => Samples::Sixteen(values.iter().map(|&v| Sample::nearest(v)).collect()),
        };
        Self::new(width, height, channels, samples)
    }

    /// Reads a TIFF, PNG or JPEG file (kind judged by content). Alpha is dropped.
    ///
    /// # Errors
    /// The file cannot be opened, is damaged, truncated or no picture, or has samples that are not 8- or 16-bit.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let io = |source| ImageError::Io { path: path.to_path_buf(), source };
        let unreadable = |reason: String| ImageError::Unreadable { path: path.to_path_buf(), reason };
        let mut file = File::open(path).map_err(io)?;
        let ends = jpeg_end_is_present(&mut file).map_err(io)?;
        let mut reader = ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(io)?;
        if reader.format() == Some(ImageFormat::Jpeg) && !ends {
            return Err(unreadable("the JPEG data ends too early".into()));
        }
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(MOST_DECODED_BYTES);
        reader.limits(limits);
        let decoded = reader.decode().map_err(|error| unreadable(error.to_string()))?;
        Self::from_decoded(decoded).map_err(|kind| ImageError::Kind { path: path.to_path_buf(), kind })
    }

    fn from_decoded(decoded: DynamicImage) -> Result<Self, String> {
        let (width, height) = (decoded.width() as usize, decoded.height() as usize);
        let (channels, samples) = match decoded {
            DynamicImage::ImageLuma8(i) => (Channels::Grey, Samples::Eight(i.into_raw())),
            DynamicImage::ImageRgb8(i) => (Channels::Rgb, Samples::Eight(i.into_raw())),
            DynamicImage::ImageLuma16(i) => (Channels::Grey, Samples::Sixteen(i.into_raw())),
            DynamicImage::ImageRgb16(i) => (Channels::Rgb, Samples::Sixteen(i.into_raw())),
            DynamicImage::ImageLumaA8(_) => (Channels::Grey, Samples::Eight(decoded.into_luma8().into_raw())),
            DynamicImage::ImageRgba8(_) => (Channels::Rgb, Samples::Eight(decoded.into_rgb8().into_raw())),
            DynamicImage::ImageLumaA16(_) => {
                (Channels::Grey, Samples::Sixteen(decoded.into_luma16().into_raw()))
            }
            DynamicImage::ImageRgba16(_) => {
                (Channels::Rgb, Samples::Sixteen(decoded.into_rgb16().into_raw()))
            }
            other => return Err(format!("{:?}", other.color())),
        };
        Ok(Self { width, height, channels, samples })
    }

    /// Pixels a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Grey or RGB.
    pub fn channels(&self) -> Channels {
        self.channels
    }

    /// Bits of a sample.
    pub fn depth(&self) -> Depth {
        match self.samples {
            Samples::Eight(_) => Depth::Eight,
            Samples::Sixteen(_) => Depth::Sixteen,
        }
    }

    /// The samples, row by row, channels interleaved.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// One sample in grey levels.
    ///
    /// # Panics
    /// If the place is outside the picture.
    pub fn value(&self, x: usize, y: usize, channel: usize) -> f32 {
        let index = (y * self.width + x) * self.channels.count() + channel;
        match &self.samples {
            Samples::Eight(v) => f32::from(v[index]),
            Samples::Sixteen(v) => f32::from(v[index]),
        }
    }

    /// Luminance of a pixel in grey levels: the sample itself, or the Rec. 709 sum of red, green and blue.
    ///
    /// # Panics
    /// If the place is outside the picture.
    pub fn luminance(&self, x: usize, y: usize) -> f32 {
        match self.channels {
            Channels::Grey => self.value(x, y, 0),
            Channels::Rgb => {
                0.2126 * self.value(x, y, 0) + 0.7152 * self.value(x, y, 1) + 0.0722 * self.value(x, y, 2)
            }
        }
    }
}

/// Whether the last 64 KiB hold the JPEG end marker. The decoder fills a truncated picture with grey and says
/// nothing; a tile half grey must not pass for a tile. Leaves the file at its start.
fn jpeg_end_is_present(file: &mut File) -> std::io::Result<bool> {
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(length.saturating_sub(64 << 10)))?;
    let mut tail = Vec::new();
    file.read_to_end(&mut tail)?;
    file.seek(SeekFrom::Start(0))?;
    Ok(tail.windows(2).any(|pair| pair == [0xff, 0xd9]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient() -> image::RgbImage {
        image::RgbImage::from_fn(64, 48, |x, y| image::Rgb([x as u8 * 3, y as u8 * 5, (x + y) as u8]))
    }

    #[test]
    fn png_keeps_samples_and_drops_alpha() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        DynamicImage::ImageRgb8(gradient()).to_rgba8().save(&path).unwrap();
        let read = Image::read(&path).unwrap();
        assert_eq!(
            (read.width(), read.height(), read.channels(), read.depth()),
            (64, 48, Channels::Rgb, Depth::Eight)
        );
        assert_eq!(
            (read.value(10, 20, 0), read.value(10, 20, 1), read.value(10, 20, 2)),
            (30.0, 100.0, 30.0)
        );
    }

    #[test]
    fn truncated_files_are_named_not_half_read() {
        let dir = tempfile::tempdir().unwrap();
        for kind in ["png", "jpg", "tif"] {
            let path = dir.path().join(format!("a.{kind}"));
            gradient().save(&path).unwrap();
            assert!(Image::read(&path).is_ok(), "{kind}");
            let bytes = std::fs::read(&path).unwrap();
            std::fs::write(&path, &bytes[..bytes.len() * 2 / 3]).unwrap();
            let error = Image::read(&path).unwrap_err();
            assert!(matches!(error, ImageError::Unreadable { .. }), "{kind}: {error}");
            assert!(error.to_string().contains(&format!("a.{kind}")), "{error}");
        }
    }

    #[test]
    fn text_and_float_samples_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let text = dir.path().join("a.tif");
        std::fs::write(&text, "not a picture").unwrap();
        assert!(matches!(Image::read(&text), Err(ImageError::Unreadable { .. })));
        let float = dir.path().join("f.tif");
        DynamicImage::ImageRgb8(gradient()).to_rgb32f().save(&float).unwrap();
        assert!(matches!(Image::read(&float), Err(ImageError::Kind { .. })));
        assert!(matches!(Image::read(&dir.path().join("none.png")), Err(ImageError::Io { .. })));
    }

    #[test]
    fn shape_must_fit_samples() {
        let wrong = Image::new(3, 2, Channels::Grey, Samples::Eight(vec![0; 5]));
        assert!(matches!(wrong, Err(ImageError::Shape { samples: 5, .. })));
    }
}
