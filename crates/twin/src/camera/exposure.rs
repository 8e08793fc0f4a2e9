//! A moving table in front of an open shutter: which places count, and for how much.

/// Motion below this counts as none, pixels.
const STILL_PX: f64 = 0.05;
/// Places closer than this are taken as one, pixels.
const SAME_PX: f64 = 0.25;
/// Places are at most this far apart, pixels: finer than anything the camera can show.
const STEP_PX: f64 = 1.0;

/// A place of the table and the share of the exposure spent there; the shares of one exposure sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ExposurePoint {
    pub(super) position_um: [f64; 2],
    pub(super) share: f32,
}

/// Places to look from, for a path of places evenly spaced in time; the table moves straight between them.
pub(super) fn points(path_um: &[[f64; 2]], pixel_um: f64) -> Vec<ExposurePoint> {
    let Some(first) = path_um.first() else {
        return Vec::new();
    };
    if path_um.iter().all(|place| distance(first, place) < STILL_PX * pixel_um) {
        return vec![ExposurePoint { position_um: mean(path_um), share: 1.0 }];
    }
    merged(&pieces(path_um, pixel_um), pixel_um)
}

/// The path in straight pieces no longer than a step: the middle of each, and its share of the time.
fn pieces(path_um: &[[f64; 2]], pixel_um: f64) -> Vec<([f64; 2], f64)> {
    let leg_time = 1.0 / (path_um.len() - 1) as f64;
    let mut pieces = Vec::new();
    for leg in path_um.windows(2) {
        let steps = (distance(&leg[0], &leg[1]) / (STEP_PX * pixel_um)).ceil().max(1.0);
        for step in 0..steps as usize {
            let t = (step as f64 + 0.5) / steps;
            let along = |axis: usize| leg[0][axis] + t * (leg[1][axis] - leg[0][axis]);
            pieces.push(([along(0), along(1)], leg_time / steps));
        }
    }
    pieces
}

/// Joins neighbours that the camera cannot tell apart.
fn merged(pieces: &[([f64; 2], f64)], pixel_um: f64) -> Vec<ExposurePoint> {
    let same = |a: &([f64; 2], f64), b: &([f64; 2], f64)| distance(&a.0, &b.0) < SAME_PX * pixel_um;
    let mut points = Vec::new();
    let mut rest = pieces;
    while let Some(first) = rest.first() {
        let count = rest.iter().take_while(|piece| same(first, piece)).count().max(1);
        let (group, after) = rest.split_at(count);
        points.push(centre_of(group));
        rest = after;
    }
    points
}

fn centre_of(group: &[([f64; 2], f64)]) -> ExposurePoint {
    let share: f64 = group.iter().map(|(_, time)| time).sum();
    let axis = |axis: usize| group.iter().map(|(place, time)| place[axis] * time).sum::<f64>() / share;
    ExposurePoint { position_um: [axis(0), axis(1)], share: share as f32 }
}

fn mean(path_um: &[[f64; 2]]) -> [f64; 2] {
    let count = path_um.len() as f64;
    [0, 1].map(|axis| path_um.iter().map(|place| place[axis]).sum::<f64>() / count)
}

fn distance(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    (dx * dx + dy * dy).sqrt()
}
