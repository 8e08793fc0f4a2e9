//! A motion along a curve as pieces that a tick can walk: cubics of time, both axes together.
//!
//! A curve knows no time, a [`Transfer`] along its length no shape. Within a phase of the transfer both are smooth, and a
//! cubic with the places and speeds of both its ends (Hermite) is off by 1/384 of the fourth derivative times the fourth
//! power of its time: pieces are as long as [`MOST_OFF`] allows. The next piece begins with the place and the speed of
//! the last, and with its acceleration but for a third order, so that differences see no seam.

use super::curve::{Curve, Place, Spot};
use super::profile::Limits;
use super::steps::{Leg, lay_out};
use super::transfer::{Infeasible, Phase, State, Transfer};

/// A piece may be off the curve by so much, pm: who leaves it in the middle begins that far beside it, which is no more than
/// a position is rounded by.
pub(super) const MOST_OFF: f64 = 1.0;

/// A piece may be shorter than this, ticks, where a phase hardly lasts: its slopes would be those of rounded numbers. Of one
/// tick at most it has the place and the speed.
pub(super) const SHORT: f64 = 0.01;

/// A piece: for each axis what a tick adds up, from its first tick on.
pub type Piece = [Leg; 2];

/// A motion along a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Along {
    curve: Curve,
    motion: Transfer,
}

impl Along {
    /// The fastest motion along a curve from rest to rest within the limits of its axes and a feed, pm a tick.
    ///
    /// # Errors
    /// A limit or the feed is not a number above zero, or a place is none.
    pub fn fastest(curve: Curve, axes: &[Limits; 2], feed: f64) -> Result<Self, Infeasible> {
        if !(axes.iter().all(Limits::are_numbers) && feed > 0.0) {
            return Err(Infeasible::NoNumber);
        }
        let limits = curve.limits(axes, feed);
        let at = |position: f64| State { position, ..State::default() };
        let motion = Transfer::fastest(at(0.0), at(curve.length()), &limits)?;
        Ok(Self { curve, motion })
    }

    /// A motion that was found along a curve.
    pub const fn of(curve: Curve, motion: Transfer) -> Self {
        Self { curve, motion }
    }

    /// Along the curve.
    pub const fn motion(&self) -> &Transfer {
        &self.motion
    }

    /// How long it takes, ticks.
    pub fn ticks(&self) -> f64 {
        self.motion.ticks()
    }

    /// All pieces; the last is the end, where it stays. None in the place of one that does not fit ([`Steps`](super::steps::Steps)).
    pub fn pieces(&self) -> Pieces {
        self.pieces_from(0.0)
    }

    /// The same of a motion that begins at a time, ticks.
    pub fn pieces_from(&self, begins: f64) -> Pieces {
        Pieces { along: *self, phase: 0, begins, gone: 0.0, state: self.motion.start() }
    }
}

/// The pieces of a motion, in their order.
#[derive(Clone, Debug, Default)]
pub struct Pieces {
    along: Along,
    /// Of the motion; 7 is its end, 8 is beyond.
    phase: usize,
    /// When the phase began, ticks.
    begins: f64,
    /// What of the phase is gone, ticks.
    gone: f64,
    /// Along the curve, where the next piece begins.
    state: State,
}

impl Pieces {
    /// When the next one begins, ticks.
    pub fn time(&self) -> f64 {
        self.begins + self.gone
    }

    /// A part of the present phase: the rest of it, in equal parts no longer than the longest.
    fn part(&mut self, ticks: f64, jerk: f64) -> Option<Piece> {
        let left = ticks - self.gone;
        let parts = libm::ceil(left / self.longest(self.state.after(left, jerk), jerk)).max(1.0);
        let length = left / parts;
        let (from, to) = (self.state, self.state.after(length, jerk));
        let begins = self.begins + self.gone;
        (self.state, self.gone) = (to, self.gone + length);
        if parts <= 1.0 {
            self.phase = self.phase.saturating_add(1);
            (self.begins, self.gone) = (self.begins + ticks, 0.0);
        }
        self.cubics(begins, length, [from, to], jerk)
    }

    /// Ticks of the longest piece from here to another state of the phase.
    fn longest(&self, to: State, jerk: f64) -> f64 {
        let Some(bend) = self.along.curve.bend() else { return f64::INFINITY };
        let speed = self.state.speed.abs().max(to.speed.abs());
        let acceleration = self.state.acceleration.abs().max(to.acceleration.abs());
        let fourth = bend.fourth_derivative(speed, acceleration, jerk.abs());
        libm::sqrt(libm::sqrt(384.0 * MOST_OFF / fourth))
    }

    fn cubics(&self, begins: f64, length: f64, ends: [State; 2], jerk: f64) -> Option<Piece> {
        let spots = ends.map(|state| self.along.curve.spot(state.position));
        let mut piece = [Leg::default(); 2];
        for (axis, leg) in piece.iter_mut().enumerate() {
            let [from, to] = [0, 1].map(|end| on_axis(spots.get(end), ends.get(end), axis));
            let cubic = if self.along.curve.bend().is_none() {
                let share = spots[0].tangent.get(axis).copied().unwrap_or(0.0);
                (State { acceleration: share * ends[0].acceleration, ..from }, share * jerk)
            } else if length < SHORT {
                (from, 0.0)
            } else {
                hermite(from, to, length)
            };
            *leg = lay_out(begins, cubic.0, &Phase { ticks: length, jerk: cubic.1 })?;
        }
        Some(piece)
    }

    fn end(&mut self) -> Option<Piece> {
        self.phase = self.phase.saturating_add(1);
        rest(self.begins, self.along.curve.spot(self.along.motion.end().position).at)
    }

    /// The next piece, but for the end.
    #[allow(clippy::option_option, reason = "an item of this iterator")]
    pub(super) fn next_of_motion(&mut self) -> Option<Option<Piece>> {
        while let Some(phase) = self.along.motion.phases().get(self.phase) {
            if phase.ticks > 0.0 {
                return Some(self.part(phase.ticks, phase.jerk));
            }
            self.phase = self.phase.saturating_add(1);
        }
        None
    }

    /// Whether only the end is left.
    pub(super) fn is_over(&self) -> bool {
        self.along.motion.phases().iter().skip(self.phase).all(|phase| phase.ticks <= 0.0)
    }
}

/// Rest at a place, to the nearest picometre, from a time on.
pub(super) fn rest(begins: f64, at: Place) -> Option<Piece> {
    let of = |position: f64| {
        lay_out(begins, State { position: libm::round(position), ..State::default() }, &Phase::default())
    };
    let [x, y] = at;
    Some([of(x)?, of(y)?])
}

/// Place and speed of an axis.
fn on_axis(spot: Option<&Spot>, along: Option<&State>, axis: usize) -> State {
    let (Some(spot), Some(along)) = (spot, along) else { return State::default() };
    let of = |pair: &[f64; 2]| pair.get(axis).copied().unwrap_or(0.0);
    State { position: of(&spot.at), speed: of(&spot.tangent) * along.speed, acceleration: 0.0 }
}

/// The cubic with places and speeds of both ends: its beginning and its jerk.
pub(super) fn hermite(from: State, to: State, length: f64) -> (State, f64) {
    let mean = (to.position - from.position) / length;
    let acceleration = (6.0 * mean - 4.0 * from.speed - 2.0 * to.speed) / length;
    let jerk = (6.0 * (from.speed + to.speed) - 12.0 * mean) / (length * length);
    (State { acceleration, ..from }, jerk)
}

impl Iterator for Pieces {
    type Item = Option<Piece>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_of_motion().or_else(|| (self.phase == 7).then(|| self.end()))
    }
}
