//! All tiles in one picture, seams feathered.
//!
//! Every pixel is the mean of the tiles that see it, weighted by how far it lies from their edges across and down.
//! In an overlap of two tiles the weight thus passes linearly from one to the other.

use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::image::{Channels, Depth, Image, ImageError, Sample, Samples};
use crate::view::{Corrections, View};

/// Where the mosaic lies in the frame of the places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Canvas {
    /// Place of the mosaic's first pixel, whole pixels.
    pub(crate) origin: [i64; 2],
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Canvas {
    /// The least rectangle of whole pixels around all tiles.
    pub(crate) fn around(places: &[[f64; 2]], tile_size: [usize; 2]) -> Self {
        let least = |k: usize| places.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min).round() as i64;
        let most = |k: usize| places.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max).round() as i64;
        let size = |k: usize| (most(k) - least(k)) as usize + tile_size[k];
        Self { origin: [least(0), least(1)], width: size(0), height: size(1) }
    }

    /// Bytes of a mosaic of this size.
    pub(crate) fn bytes(&self, channels: Channels, depth: Depth) -> u64 {
        let sample = match depth {
            Depth::Eight => 1,
            Depth::Sixteen => 2,
        };
        (self.width as u64)
            .saturating_mul(self.height as u64)
            .saturating_mul(sample * channels.count() as u64)
    }
}

/// Fuses tiles at their places. `background` fills what no tile sees (share of full scale, 0 to 1). `done` is told
/// how many rows of how many are fused.
pub(crate) fn fuse(
    tiles: &[Image],
    places: &[[f64; 2]],
    corrections: Corrections<'_>,
    canvas: Canvas,
    background: f32,
    done: &(dyn Fn(usize, usize) + Sync),
) -> Result<Image, ImageError> {
    let Some(first) = tiles.first() else {
        return Image::new(0, 0, Channels::Grey, Samples::Eight(Vec::new()));
    };
    let channels = first.channels();
    let views: Vec<(View<'_>, [f64; 2])> = tiles
        .iter()
        .enumerate()
        .zip(places)
        .map(|((tile, image), place)| {
            let from_origin = [0, 1].map(|k| place[k] - canvas.origin[k] as f64);
            (View { image, tile, corrections }, from_origin)
        })
        .collect();
    let job = Job { views, channels: channels.count(), canvas, background, done };
    let samples = match first.depth() {
        Depth::Eight => Samples::Eight(job.fused(255.0)),
        Depth::Sixteen => Samples::Sixteen(job.fused(65535.0)),
    };
    Image::new(canvas.width, canvas.height, channels, samples)
}

struct Job<'a> {
    /// Tiles with their places from the canvas origin.
    views: Vec<(View<'a>, [f64; 2])>,
    channels: usize,
    canvas: Canvas,
    background: f32,
    done: &'a (dyn Fn(usize, usize) + Sync),
}

impl Job<'_> {
    fn fused<S: Sample>(&self, full_scale: f32) -> Vec<S> {
        let row_length = self.canvas.width * self.channels;
        let mut out = vec![S::default(); row_length * self.canvas.height];
        let count = AtomicUsize::new(0);
        let rows = out.par_chunks_exact_mut(row_length).enumerate();
        rows.for_each_init(
            || Row::new(self.canvas.width, self.channels),
            |row, (y, out)| {
                row.clear();
                for (view, place) in &self.views {
                    row.add(view, *place, y);
                }
                row.write(out, self.background * full_scale);
                (self.done)(count.fetch_add(1, Ordering::Relaxed) + 1, self.canvas.height);
            },
        );
        out
    }
}

/// Weighted sums of one row of the mosaic.
struct Row {
    sums: Vec<f32>,
    weights: Vec<f32>,
    channels: usize,
}

impl Row {
    fn new(width: usize, channels: usize) -> Self {
        Self { sums: vec![0.0; width * channels], weights: vec![0.0; width], channels }
    }

    fn clear(&mut self) {
        self.sums.fill(0.0);
        self.weights.fill(0.0);
    }

    fn add(&mut self, view: &View<'_>, place: [f64; 2], y: usize) {
        let (width, height) = (view.image.width(), view.image.height());
        let v = y as f64 - place[1];
        let start = (place[0] - 0.5).ceil().max(0.0) as usize;
        let end = ((place[0] + width as f64 - 0.5).ceil().max(0.0) as usize).min(self.weights.len());
        if !view.holds([0.0, v]) {
            return;
        }
        let down = feather(v, height);
        for x in start..end {
            let u = x as f64 - place[0];
            let weight = down * feather(u, width);
            let values = view.evened([u, v]);
            self.weights[x] += weight;
            let sums = &mut self.sums[x * self.channels..][..self.channels];
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
    }

    fn write<S: Sample>(&self, out: &mut [S], background: f32) {
        for (x, pixel) in out.chunks_exact_mut(self.channels).enumerate() {
            for (c, sample) in pixel.iter_mut().enumerate() {
                let weight = self.weights[x];
                let value = if weight > 0.0 { self.sums[x * self.channels + c] / weight } else { background };
                *sample = S::nearest(value);
            }
        }
    }
}

/// Distance from the nearer edge of the tile, never quite zero on the tile.
fn feather(v: f64, size: usize) -> f32 {
    (v + 0.5).min(size as f64 - 0.5 - v).max(0.01) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distortion::Distortion;

    fn flat(value: u8) -> Image {
        Image::new(20, 10, Channels::Grey, Samples::Eight(vec![value; 200])).unwrap()
    }

    #[test]
    fn weight_passes_linearly_over_the_overlap_and_gaps_get_the_background() {
        let tiles = [flat(100), flat(200)];
        let places = [[0.0, 0.0], [10.0, 3.0]];
        let canvas = Canvas::around(&places, [20, 10]);
        assert_eq!(canvas, Canvas { origin: [0, 0], width: 30, height: 13 });
        let corrections = Corrections { lens: Distortion::none([20, 10]), shading: None };
        let mosaic = fuse(&tiles, &places, corrections, canvas, 1.0, &|_, _| ()).unwrap();
        assert_eq!((mosaic.value(2, 6, 0), mosaic.value(25, 6, 0)), (100.0, 200.0));
        assert_eq!((mosaic.value(0, 12, 0), mosaic.value(29, 0, 0)), (255.0, 255.0));
        let row: Vec<f32> = (10..20).map(|x| mosaic.value(x, 6, 0)).collect();
        assert!(row.windows(2).all(|p| p[1] > p[0] && p[1] - p[0] < 15.0), "{row:?}");
    }
}
