//! An image file as a specimen, lying on blank glass.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageError, ImageFormat, ImageReader};

use super::Specimen;

/// An image file as a specimen.
///
/// Its values are taken as transmission in proportion, 0 black to 1 white. Between the pixels the picture is bicubic
/// (Catmull-Rom: smooth, and true at the pixels); around it lies glass in the median colour of the picture's border.
/// Eight bits a channel are kept, in memory: a grey picture of 300 Mpx takes 300 MB, a coloured one 900 MB.
#[derive(Clone, Debug)]
pub struct ImageSpecimen {
    texels: Vec<u8>,
    channels: usize,
    width: usize,
    height: usize,
    um_per_px: f64,
    centre_um: [f64; 2],
    glass: [u8; 3],
}

/// Why a file cannot lie on the table.
#[derive(Debug, thiserror::Error)]
pub enum SpecimenError {
    /// The file cannot be opened or read.
    #[error("cannot read the specimen {}: {source}", file.display())]
    Unreadable {
        /// The file asked for.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file holds something else.
    #[error("the specimen {} is not a TIFF, PNG or JPEG image: it {found}", file.display())]
    NotAnImage {
        /// The file asked for.
        file: PathBuf,
        /// What it is instead, as a verb phrase.
        found: String,
    },
    /// The file starts like an image, but cannot be decoded.
    #[error("the specimen {} is a damaged or unsupported {format} image: {reason}", file.display())]
    Undecodable {
        /// The file asked for.
        file: PathBuf,
        /// What it starts like.
        format: String,
        /// What the decoder said.
        reason: String,
    },
    /// The image has no pixels.
    #[error("the specimen {} has no pixels: {width} × {height}", file.display())]
    Empty {
        /// The file asked for.
        file: PathBuf,
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
    /// The size of a pixel is not a positive number.
    #[error("a specimen pixel of {um_per_px} µm is not possible: it must be more than 0")]
    PixelSize {
        /// The size asked for, µm.
        um_per_px: f64,
    },
}

impl ImageSpecimen {
    /// Reads a TIFF, PNG or JPEG file, grey or colour, 8 or 16 bits, of any size that fits in memory.
    ///
    /// `um_per_px`: the size of its pixels on the table, > 0. The picture's centre lies at the origin of the specimen
    /// frame until [`ImageSpecimen::centred_at`] moves it. Transparent parts show white glass.
    ///
    /// # Errors
    /// Every variant of [`SpecimenError`]; each names the file.
    pub fn open(file: &Path, um_per_px: f64) -> Result<Self, SpecimenError> {
        let decoded = decode(file)?;
        if decoded.width() == 0 || decoded.height() == 0 {
            return Err(SpecimenError::Empty {
                file: file.to_path_buf(),
                width: decoded.width(),
                height: decoded.height(),
            });
        }
        Self::from_image(decoded, um_per_px)
    }

    /// The same from an image in memory, at least one pixel in size.
    ///
    /// # Errors
    /// [`SpecimenError::PixelSize`], and [`SpecimenError::Empty`] without a file name.
    pub fn from_image(image: DynamicImage, um_per_px: f64) -> Result<Self, SpecimenError> {
        if !(um_per_px > 0.0 && um_per_px.is_finite()) {
            return Err(SpecimenError::PixelSize { um_per_px });
        }
        let (width, height) = (image.width(), image.height());
        if width == 0 || height == 0 {
            return Err(SpecimenError::Empty { file: PathBuf::new(), width, height });
        }
        let (texels, channels) = eight_bits(image);
        let mut specimen = Self {
            texels,
            channels,
            width: width as usize,
            height: height as usize,
            um_per_px,
            centre_um: [0.0; 2],
            glass: [0; 3],
        };
        specimen.glass = specimen.border_median();
        Ok(specimen)
    }

    /// Moves the picture's centre to a point of the specimen frame, µm.
    #[must_use]
    pub fn centred_at(mut self, x_um: f64, y_um: f64) -> Self {
        self.centre_um = [x_um, y_um];
        self
    }

    /// Width and height on the table, µm.
    pub fn size_um(&self) -> [f64; 2] {
        [self.width as f64 * self.um_per_px, self.height as f64 * self.um_per_px]
    }

    /// Width and height in pixels of the file.
    pub fn size_px(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    fn border_median(&self) -> [u8; 3] {
        let (right, bottom) = (self.width - 1, self.height - 1);
        let rows = (0..self.width).flat_map(|column| [(column, 0), (column, bottom)]);
        let columns = (0..self.height).flat_map(|row| [(0, row), (right, row)]);
        let mut histograms = [[0_usize; 256]; 3];
        for (column, row) in rows.chain(columns) {
            let texel = self.texel(column, row);
            for channel in 0..3 {
                histograms[channel][texel[channel] as usize] += 1;
            }
        }
        histograms.map(|histogram| median(&histogram))
    }

    /// The value of a pixel that exists.
    fn texel(&self, column: usize, row: usize) -> [u8; 3] {
        let at = (row * self.width + column) * self.channels;
        match self.channels {
            1 => [self.texels[at]; 3],
            _ => [self.texels[at], self.texels[at + 1], self.texels[at + 2]],
        }
    }

    /// The value of a pixel, or glass where there is none.
    fn texel_or_glass(&self, column: i64, row: i64) -> [u8; 3] {
        match (usize::try_from(column), usize::try_from(row)) {
            (Ok(column), Ok(row)) if column < self.width && row < self.height => self.texel(column, row),
            _ => self.glass,
        }
    }
}

impl Specimen for ImageSpecimen {
    fn rgb(&self, x_um: f64, y_um: f64) -> [f32; 3] {
        let (column, fx) = pixel_below((x_um - self.centre_um[0]) / self.um_per_px, self.width);
        let (row, fy) = pixel_below((y_um - self.centre_um[1]) / self.um_per_px, self.height);
        let (across, down) = (catmull_rom(fx), catmull_rom(fy));
        let mut sum = [0.0_f32; 3];
        for (dy, weight_y) in (-1..).zip(down) {
            for (dx, weight_x) in (-1..).zip(across) {
                let texel = self.texel_or_glass(column + dx, row + dy);
                let weight = weight_x * weight_y;
                for channel in 0..3 {
                    sum[channel] += weight * f32::from(texel[channel]);
                }
            }
        }
        sum.map(|value| (value * (1.0 / 255.0)).clamp(0.0, 1.0))
    }
}

/// The pixel centre at or before a place, and the way from it to the next, `0 ..= 1`.
///
/// `from_centre`: pixels from the picture's centre. Far outside, where all is glass, the place is drawn nearer.
fn pixel_below(from_centre: f64, size: usize) -> (i64, f32) {
    let t = (from_centre + 0.5 * size as f64 - 0.5).clamp(-4.0, size as f64 + 4.0);
    let whole = t.floor();
    (whole as i64, (t - whole) as f32)
}

/// Weights of the four pixels around a place `t` between the inner two.
fn catmull_rom(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (2.0 * t2 - t - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ]
}

fn median(histogram: &[usize; 256]) -> u8 {
    let half = histogram.iter().sum::<usize>().div_ceil(2);
    let mut below = 0;
    let found = histogram.iter().position(|count| {
        below += count;
        below >= half
    });
    found.map_or(u8::MAX, |value| value as u8)
}

fn decode(file: &Path) -> Result<DynamicImage, SpecimenError> {
    let unreadable = |source| SpecimenError::Unreadable { file: file.to_path_buf(), source };
    let opened = File::open(file).map_err(unreadable)?;
    if opened.metadata().map_err(unreadable)?.is_dir() {
        return Err(not_an_image(file, "is a folder".into()));
    }
    let mut reader = ImageReader::new(BufReader::new(opened)).with_guessed_format().map_err(unreadable)?;
    let format = match reader.format() {
        Some(format @ (ImageFormat::Tiff | ImageFormat::Png | ImageFormat::Jpeg)) => format,
        Some(other) => return Err(not_an_image(file, format!("is a {other:?} file"))),
        None => return Err(not_an_image(file, describe_start(file).map_err(unreadable)?)),
    };
    reader.no_limits();
    reader.decode().map_err(|error| match error {
        ImageError::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            unreadable(source)
        }
        other => SpecimenError::Undecodable {
            file: file.to_path_buf(),
            format: format!("{format:?}").to_uppercase(),
            reason: other.to_string(),
        },
    })
}

fn not_an_image(file: &Path, found: String) -> SpecimenError {
    SpecimenError::NotAnImage { file: file.to_path_buf(), found }
}

/// What a file that is no image begins with, as a verb phrase.
fn describe_start(file: &Path) -> std::io::Result<String> {
    let mut start = Vec::new();
    File::open(file)?.take(24).read_to_end(&mut start)?;
    if start.is_empty() {
        return Ok("is empty".into());
    }
    let text = String::from_utf8_lossy(&start);
    if text.chars().all(|c| c.is_ascii_graphic() || c.is_ascii_whitespace()) {
        return Ok(format!("begins with the text {text:?}"));
    }
    let bytes: Vec<String> = start.iter().take(8).map(|byte| format!("{byte:02X}")).collect();
    Ok(format!("begins with the bytes {}", bytes.join(" ")))
}

/// The pixels as bytes, and how many of them make a pixel: 1 grey, 3 colour.
fn eight_bits(image: DynamicImage) -> (Vec<u8>, usize) {
    let colour = image.color();
    match (colour.has_alpha(), colour.has_color()) {
        (true, _) => (laid_on_white(image), 3),
        (false, true) => (image.into_rgb8().into_raw(), 3),
        (false, false) => (image.into_luma8().into_raw(), 1),
    }
}

fn laid_on_white(image: DynamicImage) -> Vec<u8> {
    let over = |value: u8, alpha: u32| ((u32::from(value) * alpha + 255 * (255 - alpha) + 127) / 255) as u8;
    let pixels = image.into_rgba8();
    pixels.pixels().flat_map(|p| [0, 1, 2].map(|channel| over(p[channel], u32::from(p[3])))).collect()
}
