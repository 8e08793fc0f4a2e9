//! What an action of a program asks of the controller: segments in its ticks.

use super::course::curve;
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
    // What is no curve is refused before.
    let length = curve(there)?.length();
    Some(Segment {
        shape: shape(&there.path),
        to: there.to,
        feed: feed(there.rate, length, tick_hz),
        tolerance: tolerance(there.corner),
    })
}

/// How a path leads to its end.
pub(super) fn shape(path: &Path) -> Shape {
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

/// Of a motion of a length, pm.
pub(super) fn feed(rate: Rate, length: f64, tick_hz: f64) -> Feed {
    let ticks = 60.0 * tick_hz;
    let feed = match rate {
        Rate::Rapid => Feed::RAPID,
        Rate::PerMinute(feed) => Feed::from_pm(feed.pm() as f64 / ticks),
        Rate::Inverse(per_minute) => Feed::from_pm(length * (per_minute.billionths() as f64 / 1e9) / ticks),
    };
    // 2⁻¹⁶ pm a tick; slower than that nothing goes.
    feed.max(Feed(1))
}
