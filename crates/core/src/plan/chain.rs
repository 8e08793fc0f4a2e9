//! Lines one behind the other, looked at ahead: how fast each corner may be passed, so that none comes too soon.
//!
//! Each corner first gets the speed that its tolerance and the halves of its lines allow ([`Corner`]), if it is worth it: a
//! sharp one is sooner passed by a stop, which need not bring the acceleration to zero before the corner. Then, from the end
//! back, none may be faster than the line behind it can slow down from, and from the start on none faster than the line
//! before it can speed up to. Between two corners a line is the fastest motion from speed to speed ([`Transfer`]).

use super::corner::{Corner, changing};
use super::curve::{Place, direction, distance, straight};
use super::pieces::{Piece, rest};
use super::profile::Limits;
use super::steps::{Leg, lay_out};
use super::transfer::{Infeasible, Phase, State, Transfer};

/// How a chain of lines is to be gone along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manner {
    /// Limits of the axes.
    pub axes: [Limits; 2],
    /// Highest speed along the lines, pm a tick.
    pub feed: f64,
    /// Corners are cut by so much at most, pm; 0 stops in each.
    pub tolerance: f64,
}

impl Manner {
    fn is_one(&self) -> bool {
        self.axes.iter().all(Limits::are_numbers) && self.feed > 0.0 && self.tolerance >= 0.0
    }
}

/// Looks ahead over all places of a chain, two at least, from rest to rest: the corners between the lines, as fast as they
/// can be passed. `corners` must have room for one less than there are lines; places that are the same twice are a stop.
/// What is no [`Manner`] stops in each; [`walk`] says so.
pub fn look_ahead<'c>(places: &[Place], manner: &Manner, corners: &'c mut [Corner]) -> &'c mut [Corner] {
    let number = places.len().saturating_sub(2).min(corners.len());
    let corners = corners.get_mut(..number).unwrap_or_default();
    // Nothing of a chain before.
    corners.fill(Corner::default());
    for (corner, three) in corners.iter_mut().zip(places.windows(3)) {
        if let ([from, at, to], true) = (three, manner.is_one()) {
            let lines = [Line::of(Some(&[*from, *at]), manner), Line::of(Some(&[*at, *to]), manner)];
            let room = lines[0].length.min(lines[1].length) / 2.0;
            let rounded =
                Corner::fastest([*from, *at, *to], &manner.axes, manner.feed, manner.tolerance, room);
            *corner = worth_it(rounded, &lines, 0.0);
        }
    }
    slow_down(places, manner, corners);
    corners
}

/// Both passes.
fn slow_down(places: &[Place], manner: &Manner, corners: &mut [Corner]) {
    let line = |number: usize| Line::of(places.get(number..), manner);
    let mut behind = Corner::default();
    for (number, corner) in corners.iter_mut().enumerate().rev() {
        *corner = line(number.saturating_add(1)).slowed(*corner, &behind);
        behind = *corner;
    }
    let mut before = Corner::default();
    for (number, corner) in corners.iter_mut().enumerate() {
        *corner = line(number).slowed(*corner, &before);
        before = *corner;
    }
}

/// A corner between two lines, if a stop is not sooner, of which so many ticks are saved.
pub(super) fn worth_it(rounded: Corner, lines: &[Line; 2], saved: f64) -> Corner {
    let stop = rounded.at_speed(0.0);
    if delay(&rounded, lines) < delay(&stop, lines) - saved { rounded } else { stop }
}

/// How much later than at full speed a corner is passed, ticks, between two lines that come to it.
fn delay(corner: &Corner, lines: &[Line; 2]) -> f64 {
    let of = |line: &Line| {
        let top = line.limits.speed.min(libm::sqrt(line.limits.acceleration * line.length));
        let (rise, pause) = line.changing(top, corner.speed);
        2.0 * rise + pause - (line.change(top, corner.speed) + corner.reach()) / top
    };
    corner.ticks() + of(&lines[0]) + of(&lines[1])
}

/// Part of a speed that is left, so that no way is too short by what was rounded.
const ROUNDED: f64 = 1e-9;

/// A line between two corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) length: f64,
    pub(super) limits: Limits,
}

impl Line {
    /// Between the first two of some places.
    fn of(places: Option<&[Place]>, manner: &Manner) -> Self {
        let Some([from, to, ..]) = places else {
            return Self { length: 0.0, limits: straight([0.0; 2], &manner.axes, manner.feed) };
        };
        Self {
            length: distance(*from, *to),
            limits: straight(direction(*from, *to), &manner.axes, manner.feed),
        }
    }

    /// A corner at one end, slow enough for the speed to change to that of the other within the line.
    pub(super) fn slowed(&self, corner: Corner, other: &Corner) -> Corner {
        self.slowed_for(corner, other.reach(), other.speed)
    }

    /// The same, if from the other end on some of the line is gone and the speed there is given.
    pub(super) fn slowed_for(&self, corner: Corner, gone: f64, speed: f64) -> Corner {
        let left = |corner: &Corner| self.length - corner.reach() - gone - self.change(corner.speed, speed);
        if corner.speed <= speed || left(&corner) >= 0.0 {
            return corner;
        }
        // A little less, or rounding may say that there is no way.
        let slowed = corner.slowed(corner.speed, left);
        let slowed = slowed.at_speed(slowed.speed * (1.0 - ROUNDED));
        // It need not be slower than the other.
        if slowed.speed < speed { slowed.at_speed(speed) } else { slowed }
    }

    /// Ticks of full jerk, and at full acceleration, in which a speed changes to another.
    fn changing(&self, from: f64, to: f64) -> (f64, f64) {
        changing((to - from).abs(), self.limits.acceleration, self.limits.jerk)
    }

    /// The way on which a speed changes to another.
    pub(super) fn change(&self, from: f64, to: f64) -> f64 {
        let (rise, pause) = self.changing(from, to);
        f64::midpoint(from, to) * (2.0 * rise + pause)
    }
}

/// The pieces of a whole chain that was looked at, to `take`, in their order; ticks it takes.
///
/// # Errors
/// A limit, the feed or a place is no number; or a piece does not fit a tick's integers: then [`Infeasible::NoNumber`].
pub fn walk(
    places: &[Place],
    manner: &Manner,
    corners: &[Corner],
    mut take: impl FnMut(Piece),
) -> Result<f64, Infeasible> {
    if !manner.is_one() {
        return Err(Infeasible::NoNumber);
    }
    let mut time = 0.0;
    let mut before = Corner::default();
    for (number, ends) in places.windows(2).enumerate() {
        let [from, to] = ends else { continue };
        let behind = corners.get(number).copied().unwrap_or_default();
        let line = Line::of(Some(ends), manner);
        let way = direction(*from, *to);
        let begins = State { position: before.reach(), speed: before.speed, ..State::default() };
        let ends = State { position: line.length - behind.reach(), speed: behind.speed, ..State::default() };
        let motion = Transfer::fastest(begins, ends, &line.limits)?;
        for phase in straight_pieces(&motion, *from, way, time) {
            take(phase.ok_or(Infeasible::NoNumber)?);
        }
        time += motion.ticks();
        if behind.speed > 0.0 {
            for piece in behind.pieces(time) {
                take(piece.ok_or(Infeasible::NoNumber)?);
            }
            time += behind.ticks();
        }
        before = behind;
    }
    if let Some(last) = places.last() {
        take(rest(time, *last).ok_or(Infeasible::NoNumber)?);
    }
    Ok(time)
}

/// A motion along a line, from a place in a direction.
fn straight_pieces(motion: &Transfer, from: Place, way: Place, begins: f64) -> [Option<Piece>; 7] {
    let (mut state, mut time) = (motion.start(), begins);
    motion.phases().map(|phase| {
        let mut piece = [Leg::default(); 2];
        for ((leg, from), part) in piece.iter_mut().zip(from).zip(way) {
            let State { position, speed, acceleration } = state;
            let on_axis = State {
                position: from + part * position,
                speed: part * speed,
                acceleration: part * acceleration,
            };
            *leg = lay_out(time, on_axis, &Phase { jerk: part * phase.jerk, ..phase })?;
        }
        state = state.after(phase.ticks, phase.jerk);
        time += phase.ticks;
        Some(piece)
    })
}
