//! What lies on the table: the light that each point of a specimen lets through.
//!
//! A specimen is a continuous function of the plane, in its own frame, in micrometres: the camera asks it for the
//! colour at the true place of each pixel. [`Tissue`] is drawn from a seed and has no edge; [`ImageSpecimen`] is any image
//! file laid on blank glass.

mod ground;
mod lattice;
mod picture;
mod tissue;

#[cfg(test)]
mod tests;

pub use picture::{ImageSpecimen, SpecimenError};
pub use tissue::Tissue;

/// A thing that can be looked at through a microscope, from many threads at once.
pub trait Specimen: Send + Sync {
    /// Transmission of red, green and blue light at a point of the specimen, each in `0 ..= 1`.
    ///
    /// `x_um`, `y_um`: the specimen frame, micrometres; every finite value is allowed. The answer is continuous in
    /// both and depends on nothing else.
    fn rgb(&self, x_um: f64, y_um: f64) -> [f32; 3];

    /// [`Specimen::rgb`] of many points, in order; the same values, sooner where neighbours follow each other.
    ///
    /// Fills as many as both slices hold.
    fn rgb_of_each(&self, points_um: &[[f64; 2]], colours: &mut [[f32; 3]]) {
        for (colour, point) in colours.iter_mut().zip(points_um) {
            *colour = self.rgb(point[0], point[1]);
        }
    }
}
