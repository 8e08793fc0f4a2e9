//! What a camera is like, key by key.

use serde::{Deserialize, Serialize};

/// Everything that makes one camera. Missing keys take the value named here; unknown ones are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CameraSettings {
    /// Pixels across, 1 to 20 000; 640.
    pub width_px: u32,
    /// Pixels down, 1 to 20 000; 480.
    pub height_px: u32,
    /// Specimen micrometres in a pixel as the maker states it, more than 0; 0.5.
    pub pixel_um: f64,
    /// True size of a pixel over the stated one, less one, −0.5 to 0.5; 0.002 (0.2 %).
    pub pixel_scale_error: f64,
    /// Turn of the camera against the table, degrees, from image right towards image down, −180 to 180; 0.3.
    pub angle_deg: f64,
    /// How far the optics draw the corner towards the centre (barrel; negative: pincushion), pixels, at most a tenth
    /// of the way to the corner; 1.0.
    pub distortion_corner_px: f64,
    /// Share of the light lost at the corner, 0 to 1; 0.25.
    pub vignetting: f64,
    /// Electrons that fill a pixel, 100 to 10⁷; 12 000.
    pub full_well_e: f64,
    /// Noise of reading a pixel, electrons rms, 0 to a tenth of the full well; 8.
    pub read_noise_e: f64,
    /// Share of the full well that a perfectly clear specimen fills at the centre, 0 to 1; 0.95.
    pub white_level: f64,
    /// Counts that no light gives, 0 to half of the largest count; 4.
    pub black_level: f64,
    /// Bits a channel, 1 to 8; 8. The largest count is 2^bits − 1.
    pub bits: u8,
    /// True: red, green, blue. False: grey.
    pub colour: bool,
    /// Time the shutter is open, seconds, 0 to 100; 0.005. What moves in it, smears.
    pub exposure_s: f64,
    /// +1: a table place of larger x gives a tile further to the right. −1: further to the left.
    pub axis_sign_x: i8,
    /// +1: a table place of larger y gives a tile further down. −1: further up.
    pub axis_sign_y: i8,
}

/// A value that no camera can have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("camera: {key} = {value} is out of range, {allowed}")]
pub struct CameraError {
    /// The key of [`CameraSettings`].
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// What would be right.
    pub allowed: String,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            width_px: 640,
            height_px: 480,
            pixel_um: 0.5,
            pixel_scale_error: 0.002,
            angle_deg: 0.3,
            distortion_corner_px: 1.0,
            vignetting: 0.25,
            full_well_e: 12_000.0,
            read_noise_e: 8.0,
            white_level: 0.95,
            black_level: 4.0,
            bits: 8,
            colour: true,
            exposure_s: 0.005,
            axis_sign_x: 1,
            axis_sign_y: 1,
        }
    }
}

impl CameraSettings {
    /// Looks at every key.
    ///
    /// # Errors
    /// The first key that is out of range.
    pub fn check(&self) -> Result<(), CameraError> {
        let corner_px = 0.5 * f64::from(self.width_px).hypot(f64::from(self.height_px));
        within("width_px", f64::from(self.width_px), 1.0, 20_000.0)?;
        within("height_px", f64::from(self.height_px), 1.0, 20_000.0)?;
        within("pixel_um", self.pixel_um, 1e-6, 1e6)?;
        within("pixel_scale_error", self.pixel_scale_error, -0.5, 0.5)?;
        within("angle_deg", self.angle_deg, -180.0, 180.0)?;
        within("distortion_corner_px", self.distortion_corner_px, -0.1 * corner_px, 0.1 * corner_px)?;
        within("vignetting", self.vignetting, 0.0, 1.0)?;
        within("full_well_e", self.full_well_e, 100.0, 1e7)?;
        within("read_noise_e", self.read_noise_e, 0.0, 0.1 * self.full_well_e)?;
        within("white_level", self.white_level, 0.0, 1.0)?;
        within("bits", f64::from(self.bits), 1.0, 8.0)?;
        within("black_level", self.black_level, 0.0, 0.5 * self.largest_count())?;
        within("exposure_s", self.exposure_s, 0.0, 100.0)?;
        plus_or_minus_one("axis_sign_x", self.axis_sign_x)?;
        plus_or_minus_one("axis_sign_y", self.axis_sign_y)
    }

    /// 2^bits − 1.
    pub(super) fn largest_count(&self) -> f64 {
        f64::from((1_u32 << u32::from(self.bits.min(8))) - 1)
    }
}

fn within(key: &'static str, value: f64, low: f64, high: f64) -> Result<(), CameraError> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(CameraError { key, value, allowed: format!("{low} to {high}") })
}

fn plus_or_minus_one(key: &'static str, sign: i8) -> Result<(), CameraError> {
    if sign == 1 || sign == -1 {
        return Ok(());
    }
    Err(CameraError { key, value: f64::from(sign), allowed: "1 or -1".into() })
}
