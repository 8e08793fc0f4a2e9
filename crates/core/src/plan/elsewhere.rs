//! Another target while the stage moves: from what it will be doing at a tick to rest there, all axes together.

use super::path::Going;
use super::profile::Limits;
use super::ring::Ring;
use super::span::{Span, Until};
use super::steps::{Leg, Steps};
use super::transfer::{Infeasible, State, Transfer};
use crate::units::Pos;

/// Most spans of such a motion: three phases, seven and the end, of three axes.
pub const MOST: usize = 33;
/// Most legs of an axis.
const LEGS: usize = 11;

/// The spans of a motion.
pub type Spans<const N: usize> = Ring<Span<N>, MOST>;

/// From what the stage will be doing at tick `start` to rest at a place: all axes arrive together, as soon as their limits
/// allow, or one of them is there sooner and waits; which way they go there is what comes of it. An axis that is too fast for
/// its limits, by what was rounded or because they are lower now, slows down first.
///
/// No axis leaves its travel, lowest and highest place, if it could stay within at all. To come to rest it may need more way
/// than it had left before it turned back on the path it was on: on a circle that touches the end of the travel it brakes
/// harder there than a stop could. Then it turns back first.
///
/// # Errors
/// A limit is no number above zero, a target beyond what fits ([`Steps::of`]), or an acceleration beyond its limit.
pub fn turn<const N: usize>(
    going: &Going<N>,
    to: &[Pos; N],
    limits: &[Limits; N],
    travel: &[[Pos; 2]; N],
    start: u32,
) -> Result<Spans<N>, Infeasible> {
    let mut axes = [Axis::default(); N];
    let asked = states(going).into_iter().zip(to).zip(limits.iter().zip(travel));
    for (axis, ((from, to), (limits, travel))) in axes.iter_mut().zip(asked) {
        *axis = Axis::within(from, *to, limits, travel.map(|end| end.pm() as f64))?;
    }
    let longest = axes.iter().map(Axis::ticks).fold(0.0, f64::max);
    let mut legs = [[None; LEGS]; N];
    for ((legs, axis), limits) in legs.iter_mut().zip(&axes).zip(limits) {
        *legs = axis.lasting(longest, limits)?.legs().ok_or(Infeasible::NoNumber)?;
    }
    merged(&legs, start).ok_or(Infeasible::NoNumber)
}

/// What a place is rounded by, pm.
const ROUNDED: f64 = 0.5;

/// The motion of an axis.
#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    /// Down to its limits, or back from the end of the travel.
    slow: Transfer,
    /// And to its target.
    rest: Transfer,
}

impl Axis {
    /// The fastest within the travel.
    fn within(from: State, to: Pos, limits: &Limits, travel: [f64; 2]) -> Result<Self, Infeasible> {
        let fastest = Self::fastest(from, to, limits)?;
        let [below, above] = fastest.outside(travel);
        if below.max(above) <= ROUNDED {
            return Ok(fastest);
        }
        // Full acceleration is kept until it stands: no motion has its turn nearer.
        let ramp = limits.acceleration * limits.acceleration / (2.0 * limits.jerk);
        let back = ramp.min(limits.speed).copysign(below - above);
        let slow = Transfer::to_speed(from, back, limits)?;
        let turning = Self { slow, rest: Transfer::fastest(slow.end(), resting(to), limits)? };
        let farthest = |[below, above]: [f64; 2]| below.max(above);
        let is_nearer = farthest(turning.outside(travel)) < farthest([below, above]);
        Ok(if is_nearer { turning } else { fastest })
    }

    /// How far it leaves the travel at either end.
    fn outside(&self, [least, most]: [f64; 2]) -> [f64; 2] {
        let ([a, b], [c, d]) = (self.slow.extent(), self.rest.extent());
        [least - a.min(c), b.max(d) - most]
    }

    fn fastest(from: State, to: Pos, limits: &Limits) -> Result<Self, Infeasible> {
        let to = resting(to);
        if let Ok(rest) = Transfer::fastest(from, to, limits) {
            return Ok(Self { slow: Transfer::standing(from), rest });
        }
        // What it would settle at tells which way it is too fast.
        let slow = Transfer::to_speed(from, limits.speed.copysign(from.settled(limits.jerk).speed), limits)?;
        Ok(Self { slow, rest: Transfer::fastest(slow.end(), to, limits)? })
    }

    fn ticks(&self) -> f64 {
        self.slow.ticks() + self.rest.ticks()
    }

    fn lasting(&self, ticks: f64, limits: &Limits) -> Result<Self, Infeasible> {
        let slower = self.rest.lasting_or_sooner(limits, ticks - self.slow.ticks())?;
        // With less acceleration it might go farther before it turns, out of the travel.
        let ([low, high], [least, most]) = (slower.extent(), self.rest.extent());
        let is_wider = low < least - ROUNDED || high > most + ROUNDED;
        Ok(if is_wider { *self } else { Self { rest: slower, ..*self } })
    }

    /// Laid out, in their order.
    fn legs(&self) -> Option<[Option<Leg>; LEGS]> {
        let slow = Steps::of(&self.slow)?;
        let rest = Steps::beginning(&self.rest, self.slow.ticks())?;
        let mut legs = [None; LEGS];
        for (place, leg) in legs.iter_mut().zip(slow.legs().iter().take(3).chain(rest.legs())) {
            *place = Some(*leg);
        }
        Some(legs)
    }
}

fn resting(at: Pos) -> State {
    State { position: at.pm() as f64, ..State::default() }
}

/// Where each axis will be, and how fast.
fn states<const N: usize>(going: &Going<N>) -> [State; N] {
    match going {
        Going::Rest(at) => at.map(resting),
        Going::Line(plan, ticks) => plan.states(*ticks),
        Going::Walking(walking) => walking.map(|(walker, ticks)| {
            let (state, jerk) = walker.state();
            state.after(f64::from(ticks), jerk)
        }),
    }
}

/// The legs of all axes one behind the other, as they begin.
fn merged<const N: usize>(legs: &[[Option<Leg>; LEGS]; N], start: u32) -> Option<Spans<N>> {
    let mut spans = Spans::default();
    let mut begun = [0usize; N];
    loop {
        let next = legs.iter().zip(&begun).filter_map(|(legs, begun)| legs.get(*begun).copied().flatten());
        let Some(first) = next.map(|leg| leg.first).min() else { break };
        let mut span = Span { first: start.wrapping_add(first), until: Until::Rest, legs: [None; N] };
        for ((place, legs), begun) in span.legs.iter_mut().zip(legs).zip(&mut begun) {
            // Of several that begin in one tick the last lasts.
            while let Some(leg) = legs.get(*begun).copied().flatten().filter(|leg| leg.first <= first) {
                *place = Some(leg);
                *begun = begun.saturating_add(1);
            }
        }
        if let Some(last) = spans.last_mut() {
            last.until = Until::Tick(span.first);
        }
        if !spans.push(span) {
            return None;
        }
    }
    Some(spans)
}
