//! How well overlapping tiles agree.

use rayon::prelude::*;
use serde::Serialize;

use crate::image::Image;
use crate::patch::common;
use crate::register::overlapping;
use crate::view::{Corrections, View};

/// Side of the blocks whose mean differences are what an eye would see as a seam, px.
const BLOCK: usize = 16;

/// Differences of luminance where tiles overlap, root mean square in grey levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SeamFigure {
    /// Pixel by pixel: misplacement, light and noise.
    pub pixel_rms: f64,
    /// Of means over 16 × 16 px: light alone, as noise and fine structure average out.
    pub level_rms: f64,
}

/// Sums over one overlap.
#[derive(Clone, Copy, Default)]
struct Sums {
    squares: f64,
    pixels: f64,
    level_squares: f64,
    blocks: f64,
}

/// Measures all overlaps of tiles at their places under their corrections. Every second pixel each way is looked
/// at, and no more than about a thousand blocks of an overlap.
pub(crate) fn measure(tiles: &[Image], places: &[[f64; 2]], corrections: Corrections<'_>) -> SeamFigure {
    let Some(first) = tiles.first() else { return SeamFigure::default() };
    let pairs: Vec<_> = overlapping(places, [first.width(), first.height()]).map(|(pair, _)| pair).collect();
    let sums: Vec<Sums> = pairs
        .par_iter()
        .map(|pair| {
            let view = |tile: usize| View { image: &tiles[tile], tile, corrections };
            let delta = [0, 1].map(|k| places[pair.b][k] - places[pair.a][k]);
            overlap(&view(pair.a), &view(pair.b), delta)
        })
        .collect();
    let total = sums.iter().fold(Sums::default(), |t, s| Sums {
        squares: t.squares + s.squares,
        pixels: t.pixels + s.pixels,
        level_squares: t.level_squares + s.level_squares,
        blocks: t.blocks + s.blocks,
    });
    SeamFigure {
        pixel_rms: (total.squares / total.pixels.max(1.0)).sqrt(),
        level_rms: (total.level_squares / total.blocks.max(1.0)).sqrt(),
    }
}

fn overlap(a: &View<'_>, b: &View<'_>, delta: [f64; 2]) -> Sums {
    let whole = delta.map(|v| v.round() as i64);
    let mut sums = Sums::default();
    let Some((rect, _)) = common([a.image.width(), a.image.height()], whole) else { return sums };
    let (columns, rows) = (rect.width / BLOCK, rect.height / BLOCK);
    let stride = (columns * rows).div_ceil(1000).max(1);
    for block in rect.blocks(columns, rows).step_by(stride) {
        let (mut sum, mut count) = (0.0, 0.0);
        for y in (block.y..block.y + block.height).step_by(2) {
            for x in (block.x..block.x + block.width).step_by(2) {
                let in_a = [x as f64, y as f64];
                let in_b = [0, 1].map(|k| in_a[k] - delta[k]);
                if !b.holds(in_b) {
                    continue;
                }
                let difference = f64::from(a.luminance(in_a) - b.luminance(in_b));
                sums.squares += difference * difference;
                sum += difference;
                count += 1.0;
            }
        }
        if count > 0.0 {
            sums.pixels += count;
            sums.level_squares += (sum / count) * (sum / count);
            sums.blocks += 1.0;
        }
    }
    sums
}
