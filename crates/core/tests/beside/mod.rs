//! How far places are from curves.

#![allow(dead_code, reason = "not every test uses all of it")]

use abbe_core::plan::curve::{Curve, Place};

/// From a place to the nearest one of a curve, by dense sampling and a search about each sample that is nearer than its
/// neighbours, pm.
pub(crate) fn beside(curve: &Curve, [x, y]: Place) -> f64 {
    let off = |way: f64| {
        let [px, py] = curve.spot(way).at;
        (px - x).hypot(py - y)
    };
    let length = curve.length();
    let parts = if curve.bend().is_none() { 1 } else { 48 };
    let part = length / f64::from(parts);
    let samples: Vec<f64> = (0..=parts).map(|k| off(f64::from(k) * part)).collect();
    let sample = |k: usize| samples.get(k).copied().unwrap_or(f64::INFINITY);
    let nearest = (0..samples.len())
        .filter(|k| sample(*k) <= sample(k.wrapping_sub(1)) && sample(*k) <= sample(k + 1))
        .map(|k| {
            let at = k as f64 * part;
            let (mut low, mut high) = ((at - part).max(0.0), (at + part).min(length));
            for _ in 0..60 {
                let third = (high - low) / 3.0;
                if off(low + third) < off(high - third) { high -= third } else { low += third }
            }
            off(f64::midpoint(low, high))
        });
    nearest.fold(f64::INFINITY, f64::min)
}

/// None of some places, in the order of the path, is farther from it than a tolerance and a little. Sparsely, so many of
/// them: the search is slow.
pub(crate) fn assert_on_path(places: &[Place], curves: &[Curve], tolerance: f64, number: usize) {
    // Along the path, the nearest curve is near the last one.
    let mut near = 0;
    for place in places.iter().step_by(1 + places.len() / number) {
        let found = (near..curves.len())
            .map(|number| (number, beside(&curves[number], *place)))
            .find(|(_, off)| *off <= tolerance + 12.0);
        let Some((number, _)) = found else {
            let least = curves.iter().map(|curve| beside(curve, *place)).fold(f64::INFINITY, f64::min);
            panic!("{least} pm off the path, {tolerance} allowed, near curve {near} of {}", curves.len());
        };
        near = number.saturating_sub(1);
    }
}
