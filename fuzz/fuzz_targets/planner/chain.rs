//! Chains of lines with rounded corners.

use super::bytes::Bytes;
use super::curve::distance;
use super::walk;
use abbe_core::plan::chain::{Manner, look_ahead, walk as pieces_of};
use abbe_core::plan::corner::Corner;
use abbe_core::plan::curve::Place;
use abbe_core::plan::pieces::Piece;

/// Most lines of a chain.
const LINES: u8 = 24;

pub(crate) fn walked(bytes: &mut Bytes) {
    let axes = [(); 2].map(|()| bytes.limits(1.0));
    let feed = 2e6 * bytes.decades(-4.0, 1.0);
    let tolerance = if bytes.byte().is_multiple_of(4) { 0.0 } else { bytes.decades(0.0, 9.0) };
    let places = chain(bytes);
    let manner = Manner { axes, feed, tolerance };
    let case = || format!("{places:?} {manner:?}");

    let mut corners = vec![Corner::default(); places.len().saturating_sub(2)];
    let corners = look_ahead(&places, &manner, &mut corners);
    assert_corners(&places, &manner, corners);
    let mut pieces: Vec<Piece> = Vec::new();
    let ticks = match pieces_of(&places, &manner, corners, |piece| pieces.push(piece)) {
        Ok(ticks) => ticks,
        // The only reason that such numbers leave: it takes longer than what fits.
        Err(why) => return assert!(longest(&places, &manner) > 134_217_000.0, "{why}: {}", case()),
    };
    assert!(ticks.is_finite() && ticks >= 0.0, "{}", case());
    walk::assert_in_order(&pieces);
    walk::assert_ends(&pieces, ticks);
    let path = walk::walked(&pieces);
    walk::assert_within(&path, &axes, case);
    if ticks < walk::LONGEST {
        assert_eq!(path.last(), places.last(), "{}", case());
    }
    // All of them would take most of the time there is.
    for place in path.iter().step_by(7) {
        let off = beside(&places, *place);
        assert!(off <= tolerance + 2.0, "{off} pm beside {}", case());
    }
}

/// Places in whole picometres: far ones, near ones, some twice, straight on, and back.
fn chain(bytes: &mut Bytes) -> Vec<Place> {
    let mut at = bytes.place();
    let mut places = vec![at];
    let mut step = [0.0; 2];
    for _ in 0..=bytes.byte() % LINES {
        step = match bytes.byte() % 8 {
            0 => [0.0; 2],
            1 => step.map(|part| -part),
            2 => step,
            3 => [step[1], -step[0]],
            4 => [step[0], step[1] + bytes.length(6.0)],
            _ => [(); 2].map(|()| bytes.length(10.5)),
        };
        at = [0, 1].map(|axis| (at[axis] + step[axis]).round());
        places.push(at);
    }
    places
}

/// Each is as near as it may be, and begins and ends within its lines.
fn assert_corners(places: &[Place], manner: &Manner, corners: &[Corner]) {
    let reach =
        |number: Option<usize>| number.and_then(|number| corners.get(number)).map_or(0.0, Corner::reach);
    for (number, ends) in places.windows(2).enumerate() {
        let length = distance(ends[0], ends[1]);
        let left = length - reach(number.checked_sub(1)) - reach(Some(number));
        assert!(left >= -1e-9 * length, "{left} left of line {number}: {places:?} {manner:?}");
    }
    for corner in corners {
        let is_good = corner.speed >= 0.0 && corner.speed <= manner.feed * 1.000_000_001;
        assert!(is_good && corner.ticks().is_finite(), "{corner:?} {places:?} {manner:?}");
        assert!(corner.off() <= manner.tolerance * 1.000_000_001, "{corner:?} {places:?} {manner:?}");
    }
}

/// What it takes at most, with a stop in each corner.
fn longest(places: &[Place], manner: &Manner) -> f64 {
    let speed = manner.axes.iter().fold(manner.feed, |speed, axis| speed.min(axis.speed));
    let way: f64 = places.windows(2).map(|ends| distance(ends[0], ends[1])).sum();
    let changes: f64 =
        manner.axes.iter().map(|axis| speed / axis.acceleration + axis.acceleration / axis.jerk).sum();
    way / speed + 4.0 * changes * places.len() as f64
}

/// From a place to the nearest of the lines, pm.
fn beside(places: &[Place], [x, y]: Place) -> f64 {
    let of = |ends: &[Place]| {
        let [dx, dy] = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        let squared = dx * dx + dy * dy;
        let part = ((x - ends[0][0]) * dx + (y - ends[0][1]) * dy) / squared.max(1.0);
        let part = part.clamp(0.0, 1.0);
        (x - ends[0][0] - part * dx).hypot(y - ends[0][1] - part * dy)
    };
    places.windows(2).map(of).fold(f64::INFINITY, f64::min)
}
