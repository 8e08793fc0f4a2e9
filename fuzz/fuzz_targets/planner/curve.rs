//! Motions along lines, arcs and sines.

use super::bytes::Bytes;
use super::walk::{LONGEST, assert_ends, assert_in_order, assert_within, walked};
use abbe_core::plan::Limits;
use abbe_core::plan::curve::{Arc, Curve, Place, Sine};
use abbe_core::plan::pieces::{Along, Piece};
use std::f64::consts::TAU;

/// A piece may be off its curve by so much, pm: as core's `tests/pieces.rs` asks.
const OFF: f64 = 15.0;

/// Most pieces that are looked at: a sharp sine has millions, and none is different.
const PIECES: usize = 150;

pub(crate) fn along(bytes: &mut Bytes) {
    match bytes.byte() % 3 {
        0 => line(bytes),
        1 => arc(bytes),
        _ => sine(bytes),
    }
}

fn line(bytes: &mut Bytes) {
    let from = bytes.place();
    let to = from.map(|at| (at + bytes.length(10.5)).round());
    let curve = Curve::Line { from, to };
    judge(bytes, curve, to, |place| off_line(from, to, place));
}

/// With ends as far apart from the centre as an arc's may be, it is on none of both circles, but between.
fn arc(bytes: &mut Bytes) {
    let (centre, radius, widens) = (bytes.place(), bytes.decades(0.5, 10.0), 1.0 + 0.09 * bytes.signed());
    let on = |angle: f64, radius: f64| [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()];
    let (begins, sweep) = (TAU * bytes.part(), TAU * bytes.part());
    let from = on(begins, radius);
    let to = if sweep == 0.0 { from } else { on(begins + sweep, radius * widens) };
    let Some(arc) = Arc::new(from, to, centre, bytes.byte().is_multiple_of(2)) else {
        // Below a micrometre what is rounded of the places matters.
        assert!(radius < 1e6, "no arc: {from:?} {to:?} {centre:?}");
        return;
    };
    let ends = [from, to].map(|end| distance(centre, end));
    let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    judge(bytes, Curve::Arc(arc), to, |place| {
        let radius = distance(centre, place);
        (least - radius).max(radius - most).max(0.0)
    });
}

fn sine(bytes: &mut Bytes) {
    let (from, angle) = (bytes.place(), TAU * bytes.part());
    let (length, amplitude) = (bytes.decades(6.0, 10.5), bytes.decades(4.0, 9.5));
    let (periods, phase) = (bytes.decades(0.0, 2.0) as u32, TAU * bytes.part());
    let to = [from[0] + length * angle.cos(), from[1] + length * angle.sin()];
    let sine = Sine::new(from, to, amplitude, periods, phase).expect("a sine");
    let turn = TAU * f64::from(periods) / length;
    judge(bytes, Curve::Sine(sine), to, |place| {
        let at = turn * along_line(from, to, place) + phase;
        let slope = amplitude * turn * at.cos();
        (off_line(from, to, place) - amplitude * (at.sin() - phase.sin())) / slope.hypot(1.0)
    });
}

fn judge(bytes: &mut Bytes, curve: Curve, to: Place, off: impl Fn(Place) -> f64) {
    let axes: [Limits; 2] = [(); 2].map(|()| bytes.limits(1.0));
    let feed = 2e6 * bytes.decades(-4.0, 1.0);
    let case = || format!("{curve:?} {axes:?} {feed}");
    let along = Along::fastest(curve, &axes, feed).unwrap_or_else(|why| panic!("{why}: {}", case()));
    assert!(along.ticks().is_finite() && along.ticks() >= 0.0, "{}", case());
    let Some(pieces) = along.pieces().take(PIECES).collect::<Option<Vec<Piece>>>() else {
        assert!(along.ticks() > 134_217_000.0, "does not fit: {}", case());
        return;
    };
    assert_in_order(&pieces);
    let places = walked(&pieces);
    assert_within(&places, &axes, case);
    for place in &places {
        assert!(off(*place).abs() < OFF, "{} pm off {}", off(*place), case());
    }
    let fastest = places.windows(2).map(|pair| distance(pair[0], pair[1])).fold(0.0, f64::max);
    assert!(fastest <= feed * (1.0 + 1e-6) + 2.0, "{fastest} {}", case());
    if pieces.len() < PIECES {
        assert_ends(&pieces, along.ticks());
    }
    if pieces.len() < PIECES && along.ticks() < LONGEST {
        let end = places[places.len() - 1];
        assert!((end[0] - to[0]).abs() <= 1.0 && (end[1] - to[1]).abs() <= 1.0, "{end:?} {}", case());
    }
}

pub(crate) fn distance(from: Place, to: Place) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

/// How far along a line a place is, pm.
fn along_line(from: Place, to: Place, [x, y]: Place) -> f64 {
    ((x - from[0]) * (to[0] - from[0]) + (y - from[1]) * (to[1] - from[1])) / distance(from, to).max(1.0)
}

/// How far from a line a place is, pm, to its left.
fn off_line(from: Place, to: Place, [x, y]: Place) -> f64 {
    ((y - from[1]) * (to[0] - from[0]) - (x - from[0]) * (to[1] - from[1])) / distance(from, to).max(1.0)
}
