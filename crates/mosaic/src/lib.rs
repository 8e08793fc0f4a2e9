//! Plan a scan, register the tiles, calibrate the optics from their overlaps and fuse one picture.
//!
//! The parts, in the order in which data passes through them:
//!
//! | module | does |
//! |---|---|
//! | [`plan`] | serpentine grid of field positions over an area |
//! | [`scan`] | visits the positions with a [`scan::Camera`], writes tiles and their positions |
//! | [`tiles`] | reads and writes `TileConfiguration.txt` and the tiles it names |
//! | [`image`] | the picture type; reading TIFF, PNG, JPEG |
//! | `patch`, `register`, `refine` | overlap strips, phase correlation, sub-pixel refinement |
//! | `solve` | robust global least squares: positions, camera angle and scale, lens distortion |
//! | [`shading`], [`distortion`] | the optics, as estimated from the overlaps |
//! | `fuse`, `seam` | one interpolation into a feathered mosaic; how well overlaps agree |
//! | [`output`] | TIFF with true units, PNG preview; whole files only |
//! | [`stitch`] | the pipeline; [`compare`] judges its result against known places |
//!
//! **Frames.** *Tile* pixels count from the centre of a tile's first pixel, x right, y down. A tile's *place* is
//! where that first pixel lies in the *mosaic* frame, whose axes are the camera's. The stage frame (mm) enters
//! only in [`scan`], through the nominal pixel size and explicit axis signs.
//!
//! The same input gives the same output, bit for bit, whatever the number of threads.

mod align;
pub mod compare;
pub mod distortion;
mod fuse;
pub mod image;
pub mod output;
mod patch;
pub mod plan;
mod refine;
mod register;
pub mod scan;
mod seam;
pub mod shading;
mod solve;
pub mod stitch;
pub mod tiles;
mod view;
mod whole_file;
