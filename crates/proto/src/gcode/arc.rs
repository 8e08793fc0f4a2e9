//! Arcs from what stands in a block, in integers: products of lengths below [`REACH`](super::REACH) fit 100 bits.
//!
//! A program with three decimals rounds beginning, end and centre of an arc to 1 µm, so that the two radii differ by up
//! to 4 · √½ µm = 2.83 µm though the arc was good: the beginning's rounding, the end's, and that of I and J twice. That
//! is the limit here, rounded up; NIST allows 2 µm (NISTIR 6556, 3.5.3.2), Grbl and LinuxCNC 5 µm and up to 500 µm when
//! that is less than a thousandth of the radius. Four decimals of an inch ask for 2.54 times as much.

use super::action::{Arc, Place, Turn};
use super::fault::Fault;
use super::number::Unit;
use abbe_core::Pos;

/// A gap that looks like a full circle that was missed.
const NEARLY: i64 = 1_000_000;

/// How far two lengths may differ that ought to be one, of which the nominal one is `size`: what rounding leaves in a
/// program of three decimals of mm or four of an inch, 3 µm or 7.5 µm, and at most a tenth of `size`.
pub fn slack(size: Pos, unit: Unit) -> Pos {
    let most = match unit {
        Unit::Millimetre => 3_000_000,
        Unit::Inch => 7_500_000,
    };
    Pos::from_pm((size.pm() / 10).min(most))
}

/// The way from one place to another, pm.
pub(super) fn way(from: Place, to: Place) -> [i128; 2] {
    let [(x0, y0), (x1, y1)] = [from, to].map(|[x, y]| (i128::from(x.pm()), i128::from(y.pm())));
    [x1.saturating_sub(x0), y1.saturating_sub(y0)]
}

fn square([x, y]: [i128; 2]) -> u128 {
    x.saturating_mul(x).saturating_add(y.saturating_mul(y)).unsigned_abs()
}

/// The length of a way, cut to whole pm.
pub(super) fn length(way: [i128; 2]) -> Pos {
    Pos::from_pm(square(way).isqrt() as i64)
}

/// An arc about the place that lies `offset` from its beginning.
pub(super) fn by_centre(from: Place, to: Place, offset: Place, turn: Turn, unit: Unit) -> Result<Arc, Fault> {
    let centre = [from[0] + offset[0], from[1] + offset[1]];
    let (begins, ends) = (length(way(centre, from)), length(way(centre, to)));
    if begins == Pos::ZERO {
        return Err(Fault::NoRadius);
    }
    let (mismatch, limit) = (ends - begins, slack(begins, unit));
    if mismatch.abs() > limit {
        return Err(Fault::Mismatch { begins, ends, limit });
    }
    let full = from == to;
    if !full && is_long(from, to, centre, turn) {
        let gap = length(way(from, to));
        if gap.pm() <= NEARLY.min(begins.pm() / 10) {
            return Err(Fault::NearlyFull { gap });
        }
    }
    Ok(Arc { centre, turn, full, mismatch })
}

/// Whether the arc is more than half a turn, or its ends lie in one direction from its centre.
fn is_long(from: Place, to: Place, centre: Place, turn: Turn) -> bool {
    let ([x0, y0], [x1, y1]) = (way(centre, from), way(centre, to));
    let left = x0.saturating_mul(y1).saturating_sub(y0.saturating_mul(x1));
    match turn {
        Turn::Counterclockwise => left <= 0,
        Turn::Clockwise => left >= 0,
    }
}

/// An arc of a radius; a negative one takes the long way round.
///
/// Two circles of a radius lead through two places. The arc of at most half a turn belongs to one and the rest of the
/// turn to the other, so sense and sign choose one arc. With the ends just farther apart than the diameter, within the
/// slack, it is half a turn.
pub(super) fn by_radius(from: Place, to: Place, radius: Pos, turn: Turn, unit: Unit) -> Result<Arc, Fault> {
    if radius == Pos::ZERO {
        return Err(Fault::NoRadius);
    }
    if from == to {
        return Err(Fault::TurnByRadius);
    }
    let chord = way(from, to);
    let (size, apart) = (radius.abs(), length(chord));
    let diameter = size + size;
    if apart - diameter > slack(size, unit) + slack(size, unit) {
        return Err(Fault::RadiusTooSmall { radius: size, apart });
    }
    let (chord_squared, diameter_squared) = (square(chord), square([i128::from(diameter.pm()), 0]));
    // Twice the distance of the centre from the chord, squared.
    let height = diameter_squared.saturating_sub(chord_squared);
    // Seen along the chord, a short arc to the left has its centre on the left, a long one on the right.
    let on_left = (turn == Turn::Counterclockwise) == (radius > Pos::ZERO);
    let [along, across] = chord.map(|side| scaled_by_root(side, height, chord_squared));
    let [x, y] = if on_left { [across.saturating_neg(), along] } else { [across, along.saturating_neg()] };
    let centre = [halfway(from[0], to[0], x), halfway(from[1], to[1], y)];
    let (begins, ends) = (length(way(centre, from)), length(way(centre, to)));
    if begins.min(ends) == Pos::ZERO {
        // A radius of a picometre or two, of which rounding the centre left nothing.
        return Err(Fault::NoRadius);
    }
    let mismatch = ends - begins;
    Ok(Arc { centre, turn, full: false, mismatch })
}

/// The middle of two coordinates, moved by half of `twice`; pm, halves down.
fn halfway(one: Pos, other: Pos, twice: i128) -> Pos {
    let sum = i128::from(one.pm()).saturating_add(i128::from(other.pm())).saturating_add(twice);
    Pos::from_pm((sum >> 1) as i64)
}

/// `side · √(over / under)`, cut to whole pm, for |side| ≤ √under. Both roots are taken of 126 bits, so that a short
/// chord of a large circle loses nothing: relative error below 2⁻⁶⁰.
fn scaled_by_root(side: i128, over: u128, under: u128) -> i128 {
    if over == 0 || under == 0 {
        return 0;
    }
    let (over_shift, under_shift) = (room(over), room(under));
    let over_root = (over << over_shift << over_shift).isqrt();
    let under_root = (under << under_shift << under_shift).isqrt();
    let size = side.unsigned_abs() << under_shift;
    let quotient = size.saturating_mul(over_root).checked_div(under_root).unwrap_or(0);
    let whole = (quotient >> over_shift).cast_signed();
    if side < 0 { whole.saturating_neg() } else { whole }
}

/// By how many pairs of bits a number can go up and stay below 2¹²⁶.
fn room(number: u128) -> u32 {
    number.leading_zeros().saturating_sub(2) / 2
}
