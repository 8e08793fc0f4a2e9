//! What an action of a program asks of the controller: segments in its ticks.

use abbe_core::Pos;
use abbe_core::plan::segment::{Feed, Segment, Shape};
use abbe_proto::gcode::{Action, Corner, Move, Path, Place, Rate, Turn};

/// How far a corner may be missed in G64 without P: twice the in-position window of `microscope-100`.
pub(crate) const USUAL_TOLERANCE: Pos = Pos::from_pm(1_000_000);

/// The segments of an action, if it moves. What leads from a place to the same place is none.
pub(super) fn segments(action: &Action, tick_hz: f64) -> impl Iterator<Item = Segment> + use<> {
    let both = match action {
        Action::Move(there) => [segment(there, tick_hz), None],
        Action::Reference { from, via, to } => [rapid(*from, *via), rapid(*via, *to)],
        Action::Dwell { .. } | Action::Stored(_) => [None, None],
    };
    both.into_iter().flatten()
}

fn rapid(from: Place, to: Place) -> Option<Segment> {
    (from != to).then(|| Segment { to, feed: Feed::RAPID, ..Segment::default() })
}

fn segment(there: &Move, tick_hz: f64) -> Option<Segment> {
    if there.path == Path::Line && there.from == there.to {
        return None;
    }
    let shape = shape(&there.path);
    let segment = Segment { shape, to: there.to, feed: Feed::RAPID, tolerance: tolerance(there.corner) };
    Some(Segment { feed: feed(there, &segment, tick_hz), ..segment })
}

fn shape(path: &Path) -> Shape {
    match path {
        Path::Line => Shape::Line,
        Path::Arc(arc) => {
            Shape::Arc { centre: arc.centre, counterclockwise: arc.turn == Turn::Counterclockwise }
        }
        Path::Sine(sine) => {
            Shape::Sine { amplitude: sine.amplitude, periods: sine.periods, phase: sine.phase.billionths() }
        }
    }
}

fn tolerance(corner: Corner) -> Pos {
    match corner {
        Corner::ExactStop => Pos::ZERO,
        Corner::Blend(tolerance) => tolerance.unwrap_or(USUAL_TOLERANCE),
    }
}

fn feed(there: &Move, segment: &Segment, tick_hz: f64) -> Feed {
    let ticks = 60.0 * tick_hz;
    match there.rate {
        Rate::Rapid => Feed::RAPID,
        Rate::PerMinute(feed) => Feed::from_pm(feed.pm() as f64 / ticks),
        Rate::Inverse(per_minute) => {
            // One that is no curve is refused anyway.
            let length = segment.curve(there.from).map_or(1.0, |curve| curve.length());
            Feed::from_pm(length * (per_minute.billionths() as f64 / 1e9) / ticks)
        }
    }
}
