//! The microscope: the twin's camera over the twin's table, as `mosaic` wants to see it.

use crate::bench::Shared;
use crate::failure::Failure;
use crate::preset::CameraSetup;
use crate::rig::{Rig, RigError};
use abbe_mosaic::image::{Channels, Image, ImageError, Samples};
use abbe_mosaic::scan::{Camera, Shot};
use abbe_mosaic::tiles::Placed;
use abbe_twin::camera::Camera as TwinCamera;
use abbe_twin::specimen::{ImageSpecimen, Specimen, Tissue};
use std::path::Path;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpticsError {
    /// The stage did not get there.
    #[error(transparent)]
    Stage(#[from] RigError),
    /// The frame is not a picture.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Something to look at.
pub(crate) struct Sight {
    subject: Subject,
    /// Where the stage is to stand when the middle of a picture is under the lens, mm.
    centre_mm: [f64; 2],
}

enum Subject {
    /// Without end.
    Tissue(Box<Tissue>),
    /// With edges.
    Picture(ImageSpecimen),
}

impl Sight {
    /// A tissue without end.
    pub(crate) fn tissue(seed: u64, centre_mm: [f64; 2]) -> Self {
        Self { subject: Subject::Tissue(Box::new(Tissue::new(seed))), centre_mm }
    }

    /// A picture with its middle at `centre_mm`.
    pub(crate) fn picture(file: &Path, pixel_um: f64, centre_mm: [f64; 2]) -> Result<Self, Failure> {
        Ok(Self { subject: Subject::Picture(ImageSpecimen::open(file, pixel_um)?), centre_mm })
    }

    /// Size of a specimen that ends, mm.
    pub(crate) fn size_mm(&self) -> Option<[f64; 2]> {
        match &self.subject {
            Subject::Tissue(_) => None,
            Subject::Picture(picture) => Some(picture.size_um().map(|um| um * 1e-3)),
        }
    }

    /// Lays the specimen on the table.
    ///
    /// A picture is laid as a person would: the stage goes to the centre, and the picture's middle is put under the
    /// lens. Where the table then truly is does not matter; a bare stage may be a tenth of a millimetre off.
    fn laid(self, rig: &mut Rig) -> Result<Box<dyn Specimen>, RigError> {
        match self.subject {
            Subject::Tissue(tissue) => Ok(tissue),
            Subject::Picture(picture) => {
                rig.move_to(self.centre_mm)?;
                let [x_um, y_um] = rig.twin.truth().table_um;
                Ok(Box::new(picture.centred_at(x_um, y_um)))
            }
        }
    }
}

/// Stage, specimen and camera together.
pub(crate) struct Microscope {
    rig: Shared,
    setup: CameraSetup,
    camera: TwinCamera,
    specimen: Box<dyn Specimen>,
    seed: u64,
    /// True places of the tiles taken, px.
    true_places: Vec<[f64; 2]>,
}

impl Microscope {
    /// Lays the specimen on the table and sets the camera up above it.
    pub(crate) fn new(rig: &Shared, setup: &CameraSetup, sight: Sight, seed: u64) -> Result<Self, Failure> {
        let camera = TwinCamera::new(rig.borrow().twin.plant().camera.clone())?;
        let specimen = sight.laid(&mut rig.borrow_mut())?;
        let rig = Shared::clone(rig);
        Ok(Self { rig, setup: setup.clone(), camera, specimen, seed, true_places: Vec::new() })
    }

    /// The tiles of a finished scan at their true places, px, the first at the origin.
    pub(crate) fn truth(&self, tiles: &[Placed]) -> Vec<Placed> {
        let origin = self.true_places.first().copied().unwrap_or_default();
        let place = |place: &[f64; 2]| [place[0] - origin[0], place[1] - origin[1]];
        tiles
            .iter()
            .zip(&self.true_places)
            .map(|(tile, true_place)| Placed { file: tile.file.clone(), place_px: place(true_place) })
            .collect()
    }

    /// Opens the shutter: the places of the table while it is open, and the stage's own reading half-way, mm.
    fn expose(&mut self) -> (Vec<[f64; 2]>, [f64; 2]) {
        let mut rig = self.rig.borrow_mut();
        let until = rig.time_s() + self.camera.settings().exposure_s;
        let (mut path, mut readings) = (Vec::new(), Vec::new());
        loop {
            rig.tick();
            path.push(rig.twin.truth().table_um);
            readings.push(rig.position_mm());
            if rig.time_s() >= until {
                break;
            }
        }
        (path, readings[readings.len() / 2])
    }
}

impl Camera for Microscope {
    type Error = OpticsError;

    fn image_at(&mut self, position_mm: [f64; 2]) -> Result<Shot, OpticsError> {
        {
            let mut rig = self.rig.borrow_mut();
            rig.move_to(position_mm)?;
            rig.wait(self.setup.settle_s)?;
        }
        let (path, position_mm) = self.expose();
        let number = self.true_places.len() as u64;
        let frame = self.camera.expose(&*self.specimen, &path, self.seed.wrapping_mul(1 << 20) + number);
        let count = path.len() as f64;
        let mean = [0, 1].map(|axis| path.iter().map(|place| place[axis]).sum::<f64>() / count);
        self.true_places.push(self.camera.true_pixel_of(mean));
        let channels = if frame.channels == 3 { Channels::Rgb } else { Channels::Grey };
        let image =
            Image::new(frame.width as usize, frame.height as usize, channels, Samples::Eight(frame.data))?;
        Ok(Shot { image, position_mm })
    }

    fn pixel_um(&self) -> f64 {
        self.setup.pixel_um
    }
}
