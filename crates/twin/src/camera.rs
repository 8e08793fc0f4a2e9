//! The camera above the table: what a frame would show, taken through the *true* place of the table.
//!
//! ```text
//! path of the table → exposure points → pixel → (distortion, angle, scale, signs) → specimen → light
//!                                                       light → vignetting → electrons, noise → counts
//! ```
//!
//! The exact linear part of this chain is [`Camera::true_pixel_of`]; everything a mosaic program has to find out by
//! itself (distortion, vignetting, noise, smear) comes on top.

mod exposure;
mod sensor;
mod settings;

#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::specimen::Specimen;
use exposure::ExposurePoint;
use sensor::Sensor;

pub use settings::{CameraError, CameraSettings};

/// A microscope camera.
#[derive(Clone, Debug)]
pub struct Camera {
    settings: CameraSettings,
    sensor: Sensor,
    /// Specimen micrometres in one pixel to the right and one pixel down, before distortion.
    um_of_column: [f64; 2],
    um_of_row: [f64; 2],
    /// Share by which a place at the corner is drawn towards the centre.
    barrel: f64,
    /// One over the squared distance from centre to corner, 1/px².
    per_corner2: f64,
}

/// One picture as it leaves the camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Bytes a pixel: 1 grey, 3 red, green, blue.
    pub channels: u8,
    /// Row by row from the top left, `width × height × channels` bytes.
    pub data: Vec<u8>,
}

/// Where one row of pixels works, kept from row to row.
#[derive(Default)]
struct RowDesk {
    offsets_um: Vec<[f64; 2]>,
    places_um: Vec<[f64; 2]>,
    colours: Vec<[f32; 3]>,
    light: Vec<[f32; 3]>,
}

impl Camera {
    /// A camera with these settings.
    ///
    /// # Errors
    /// [`CameraError`] names the first key whose value is out of range.
    pub fn new(settings: CameraSettings) -> Result<Self, CameraError> {
        settings.check()?;
        let um = settings.pixel_um * (1.0 + settings.pixel_scale_error);
        let angle = settings.angle_deg.to_radians();
        let (cos, sin) = (libm::cos(angle), libm::sin(angle));
        let half = [0.5 * f64::from(settings.width_px), 0.5 * f64::from(settings.height_px)];
        let corner2 = half[0] * half[0] + half[1] * half[1];
        Ok(Self {
            sensor: Sensor::new(&settings),
            um_of_column: [um * cos, um * sin],
            um_of_row: [-um * sin, um * cos],
            barrel: settings.distortion_corner_px / corner2.sqrt(),
            per_corner2: 1.0 / corner2,
            settings,
        })
    }

    /// The settings it was made with.
    pub fn settings(&self) -> &CameraSettings {
        &self.settings
    }

    /// Takes one picture.
    ///
    /// * `path_um`: true places of the table during the exposure, evenly spaced in time. Motion of less than a
    ///   twentieth of a pixel counts as none; more smears the picture in proportion to the time spent at each place
    ///   and costs about one still picture for each pixel of way. No place at all is a closed shutter.
    /// * `seed`: the same seed gives the same noise, on any machine and any number of threads.
    pub fn expose<S>(&self, specimen: &S, path_um: &[[f64; 2]], seed: u64) -> Frame
    where
        S: Specimen + ?Sized,
    {
        let points = exposure::points(path_um, self.settings.pixel_um);
        let channels = if self.settings.colour { 3 } else { 1 };
        let (width, height) = (self.settings.width_px, self.settings.height_px);
        let row_bytes = width as usize * channels;
        let mut data = vec![0; row_bytes * height as usize];
        data.par_chunks_mut(row_bytes).enumerate().for_each_init(RowDesk::default, |desk, (row, bytes)| {
            self.gather_row(specimen, &points, row, desk);
            self.sensor.read_row(&desk.light, seed, row, bytes);
        });
        Frame { width, height, channels: channels as u8, data }
    }

    /// Where a table place puts the centre of its tile in the mosaic, pixels: right and down from the tile taken at
    /// the table's origin.
    ///
    /// The linear camera alone: signs, angle and true scale; no distortion.
    pub fn true_pixel_of(&self, position_um: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.specimen_centre_um(position_um);
        let (column, row) = (self.um_of_column, self.um_of_row);
        let per_um2 = 1.0 / (column[0] * column[0] + column[1] * column[1]);
        [(x * column[0] + y * column[1]) * per_um2, (x * row[0] + y * row[1]) * per_um2]
    }

    /// The point of the specimen under the middle of the picture, µm, for a true place of the table.
    pub fn specimen_centre_um(&self, position_um: [f64; 2]) -> [f64; 2] {
        [
            f64::from(self.settings.axis_sign_x) * position_um[0],
            f64::from(self.settings.axis_sign_y) * position_um[1],
        ]
    }

    /// From the middle of the picture to what a point of the picture shows, specimen µm.
    ///
    /// `column`, `row`: pixels from the top left corner of the picture; the centre of the first pixel is (0.5, 0.5).
    pub fn specimen_offset_um(&self, column: f64, row: f64) -> [f64; 2] {
        let (right, down, share2) = self.off_centre(column, row);
        let stretch = 1.0 + self.barrel * share2;
        let (right, down) = (right * stretch, down * stretch);
        [
            right * self.um_of_column[0] + down * self.um_of_row[0],
            right * self.um_of_column[1] + down * self.um_of_row[1],
        ]
    }

    /// Pixels right and down of the middle, and the squared distance as a share of the corner's.
    fn off_centre(&self, column: f64, row: f64) -> (f64, f64, f64) {
        let right = column - 0.5 * f64::from(self.settings.width_px);
        let down = row - 0.5 * f64::from(self.settings.height_px);
        (right, down, (right * right + down * down) * self.per_corner2)
    }

    /// Collects the light of one row: the mean over the exposure, darkened towards the corners.
    fn gather_row<S>(&self, specimen: &S, points: &[ExposurePoint], row: usize, desk: &mut RowDesk)
    where
        S: Specimen + ?Sized,
    {
        let width = self.settings.width_px as usize;
        let middle_of = |index: usize| index as f64 + 0.5;
        desk.offsets_um.clear();
        desk.offsets_um.extend((0..width).map(|c| self.specimen_offset_um(middle_of(c), middle_of(row))));
        desk.colours.resize(width, [0.0; 3]);
        desk.light.clear();
        desk.light.resize(width, [0.0; 3]);
        for point in points {
            let [x, y] = self.specimen_centre_um(point.position_um);
            desk.places_um.clear();
            desk.places_um.extend(desk.offsets_um.iter().map(|offset| [x + offset[0], y + offset[1]]));
            specimen.rgb_of_each(&desk.places_um, &mut desk.colours);
            add_light(&mut desk.light, &desk.colours, point.share);
        }
        for (column, light) in desk.light.iter_mut().enumerate() {
            let (_, _, share2) = self.off_centre(middle_of(column), middle_of(row));
            let gain = (1.0 - self.settings.vignetting * share2) as f32;
            *light = light.map(|value| value * gain);
        }
    }
}

fn add_light(light: &mut [[f32; 3]], colours: &[[f32; 3]], share: f32) {
    for (sum, colour) in light.iter_mut().zip(colours) {
        for (sum, value) in sum.iter_mut().zip(colour) {
            *sum += share * value;
        }
    }
}
