//! The path of all axes together: hold, wait for a plan, follow a straight line, brake on it, or walk the spans of any
//! motion.

use super::line::LinePlan;
use super::profile::Walk;
use super::ramp::{Ramp, RampLimits};
use super::ring::Ring;
use super::span::{Span, Until, has_come};
use super::steps::{SetPoint, Walker};
use crate::design::GLIDE_BITS;
use crate::units::Pos;

/// Spans that can wait.
pub const SPANS: usize = 40;

/// What the set-point is doing.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Motion<const N: usize> {
    Hold,
    Waiting {
        plan: LinePlan<N>,
        start: u32,
    },
    Line {
        plan: LinePlan<N>,
        walk: Walk,
    },
    Braking {
        plan: LinePlan<N>,
        way: i64,
        ramp: Ramp,
    },
    /// On a span that holds up to a tick.
    Walking {
        until: u32,
    },
    /// Each axis for itself to rest; speeds and parts of a picometre have [`GLIDE_BITS`] fractional bits.
    Slowing {
        #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
        ramps: [Ramp; N],
        #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
        rests: [i64; N],
    },
}

/// The set-point of all axes, stage frame.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Path<const N: usize> {
    motion: Motion<N>,
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    set_point: [Pos; N],
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    walkers: [Walker; N],
    spans: Ring<Span<N>, SPANS>,
    /// A span was over and no other there.
    starved: bool,
    /// Of an axis that comes to rest without a plan.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    brakes: [RampLimits; N],
}

/// What a path will be doing at a tick to come: from there a motion can go elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Going<const N: usize> {
    /// It stands.
    Rest([Pos; N]),
    /// It will be so many ticks on a line.
    Line(LinePlan<N>, u32),
    /// Each axis will be so many ticks on from a state.
    Walking([(Walker, u32); N]),
}

impl<const N: usize> Path<N> {
    /// Holding at a place; the limits are those of axes that must stop without a plan, with [`GLIDE_BITS`].
    pub fn holding(at: [Pos; N], brakes: [RampLimits; N]) -> Self {
        Self {
            motion: Motion::Hold,
            set_point: at,
            walkers: [Walker::default(); N],
            spans: Ring::default(),
            starved: false,
            brakes,
        }
    }

    /// Holds at a place from now on.
    pub fn hold(&mut self, at: [Pos; N]) {
        self.set_point = at;
        self.forget();
    }

    /// The same for one axis, whose frame has moved.
    pub fn hold_axis(&mut self, axis: usize, at: Pos) {
        self.forget();
        if let Some(set_point) = self.set_point.get_mut(axis) {
            *set_point = at;
        }
    }

    fn forget(&mut self) {
        self.motion = Motion::Hold;
        self.starved = false;
        self.spans.clear();
    }

    /// The last set-point.
    pub fn set_point(&self) -> [Pos; N] {
        self.set_point
    }

    /// The same, to look at.
    pub(crate) fn places(&self) -> &[Pos; N] {
        &self.set_point
    }

    /// All of the last set-point: where it is, and how it goes on. Not for a board's tick: multiplies.
    pub fn set_points(&self) -> [SetPoint; N] {
        let mut set_points = self.set_point.map(|position| SetPoint { position, ..SetPoint::default() });
        match &self.motion {
            Motion::Hold | Motion::Waiting { .. } => {}
            Motion::Line { plan, walk } => {
                let jerk = walk.jerk_now(&plan.profile);
                set_points = plan.set_points(walk.way, walk.speed, walk.acceleration, jerk);
            }
            Motion::Braking { plan, way, ramp } => {
                set_points = plan.set_points(*way, ramp.speed, ramp.acceleration, 0);
            }
            Motion::Walking { .. } => {
                for (set_point, walker) in set_points.iter_mut().zip(&self.walkers) {
                    *set_point = walker.set_point();
                }
            }
            Motion::Slowing { ramps, .. } => {
                for (set_point, ramp) in set_points.iter_mut().zip(ramps) {
                    set_point.speed = ramp.speed.wrapping_shl(38 - GLIDE_BITS);
                    set_point.acceleration = ramp.acceleration.wrapping_shl(46 - GLIDE_BITS);
                }
            }
        }
        set_points
    }

    /// Takes a plan that begins at tick `start`.
    pub fn follow(&mut self, plan: LinePlan<N>, start: u32) {
        self.spans.clear();
        self.motion = Motion::Waiting { plan, start };
    }

    /// How many more spans there is room for.
    pub fn room(&self) -> usize {
        self.spans.room()
    }

    /// Forgets the spans that begin at a tick or later.
    pub fn cut(&mut self, tick: u32) {
        let before = self.spans.iter().take_while(|span| !has_come(tick, span.first)).count();
        self.spans.truncate(before);
    }

    /// Takes a span that begins after those there are; false if there is no room.
    pub fn append(&mut self, span: Span<N>) -> bool {
        self.spans.push(span)
    }

    /// What it will be doing at a tick to come, if nothing else is said, of a path that does not stand.
    pub fn going(&self, tick: u32, now: u32) -> Going<N> {
        // The first of a motion moves all axes, whatever they did before.
        if self.spans.get(0).is_some_and(|span| has_come(span.first, tick)) {
            return Going::Walking(self.walking(tick, now));
        }
        match self.motion {
            Motion::Line { plan, walk } => {
                Going::Line(plan, walk.gone(&plan.profile).saturating_add(ticks_to(tick, now)))
            }
            Motion::Walking { .. } => Going::Walking(self.walking(tick, now)),
            // Of what waits for its tick nothing moves yet, and it is replaced as a whole.
            Motion::Hold | Motion::Waiting { .. } | Motion::Braking { .. } | Motion::Slowing { .. } => {
                Going::Rest(self.set_point)
            }
        }
    }

    fn walking(&self, tick: u32, now: u32) -> [(Walker, u32); N] {
        let mut walking = self.walkers.map(|walker| (walker, ticks_to(tick, now)));
        for span in self.spans.iter().take_while(|span| has_come(span.first, tick)) {
            for (state, leg) in walking.iter_mut().zip(&span.legs) {
                if let Some(leg) = leg {
                    *state = (Walker::at(leg), ticks_to(tick, span.first));
                }
            }
        }
        walking
    }

    /// Brakes from the next tick on: on a line along it, elsewhere each axis for itself.
    pub fn brake(&mut self) {
        self.spans.clear();
        self.motion = match self.motion {
            Motion::Line { plan, walk } => {
                let ramp = Ramp { speed: walk.speed, acceleration: walk.acceleration };
                Motion::Braking { plan, way: walk.way, ramp }
            }
            Motion::Walking { .. } => self.slowing(),
            braking @ (Motion::Braking { .. } | Motion::Slowing { .. }) => braking,
            Motion::Hold | Motion::Waiting { .. } => Motion::Hold,
        };
    }

    #[cold]
    fn slowing(&self) -> Motion<N> {
        let ramps = self.walkers.map(|walker| {
            let SetPoint { speed, acceleration, jerk, .. } = walker.set_point();
            // From 38, 46 and 50 fractional bits; a ramp knows the last differences, not derivatives.
            let bits = [38, 46, 50].map(|bits: u32| bits.saturating_sub(GLIDE_BITS));
            let [v, a, j] = [speed >> bits[0], acceleration >> bits[1], jerk >> bits[2]];
            Ramp { speed: v.wrapping_sub(a >> 1).wrapping_add(j / 6), acceleration: a.wrapping_sub(j) }
        });
        Motion::Slowing { ramps, rests: [0; N] }
    }

    /// Whether the set-point stands, and nothing waits.
    pub fn is_holding(&self) -> bool {
        matches!(self.motion, Motion::Hold) && self.spans.is_empty()
    }

    /// Whether spans can be taken: it does not brake by itself, and no line waits for its tick.
    pub fn takes_spans(&self) -> bool {
        !matches!(self.motion, Motion::Waiting { .. } | Motion::Braking { .. } | Motion::Slowing { .. })
    }

    /// Whether it stands and nothing that was begun moves it; a plan may wait.
    pub fn stands(&self) -> bool {
        matches!(self.motion, Motion::Hold | Motion::Waiting { .. }) && self.spans.is_empty()
    }

    /// Whether a span was over and no other there: then all axes come to rest, each for itself.
    pub fn is_starved(&self) -> bool {
        self.starved
    }

    /// The set-point of tick number `tick`.
    pub fn tick(&mut self, tick: u32) -> [Pos; N] {
        let due = self.spans.get(0).is_some_and(|span| has_come(span.first, tick));
        if due {
            self.begin_span();
            return self.set_point;
        }
        if let Motion::Waiting { plan, start } = self.motion {
            // Reached also when the plan came late.
            if has_come(start, tick) {
                self.motion = Motion::Line { plan, walk: Walk::default() };
            }
        }
        self.go_on(tick);
        self.set_point
    }

    fn begin_span(&mut self) {
        let Some(span) = self.spans.pop() else { return };
        for ((walker, leg), place) in self.walkers.iter_mut().zip(&span.legs).zip(&mut self.set_point) {
            match leg {
                Some(leg) => walker.begin(leg),
                None => walker.step(),
            }
            *place = walker.position();
        }
        self.motion = match span.until {
            Until::Rest => Motion::Hold,
            Until::Tick(until) => Motion::Walking { until },
        };
    }

    fn go_on(&mut self, tick: u32) {
        match &mut self.motion {
            Motion::Line { plan, walk } => {
                if walk.tick(&plan.profile) {
                    self.set_point = plan.at(walk.way);
                } else {
                    self.set_point = plan.to;
                    self.motion = Motion::Hold;
                }
            }
            Motion::Braking { plan, way, ramp } => {
                *way = way.wrapping_add(ramp.tick(0, &plan.braking));
                self.set_point = plan.at(*way);
                if ramp.is_at_rest() {
                    self.motion = Motion::Hold;
                }
            }
            Motion::Walking { until } if has_come(*until, tick) => {
                self.starved = true;
                self.motion = self.slowing();
                self.slow_down();
            }
            Motion::Walking { .. } => {
                for (walker, place) in self.walkers.iter_mut().zip(&mut self.set_point) {
                    walker.step();
                    *place = walker.position();
                }
            }
            Motion::Slowing { .. } => self.slow_down(),
            // Stands. Not by name: of names the compiler makes a table with holes, and traps behind them.
            _ => {}
        }
    }

    #[cold]
    fn slow_down(&mut self) {
        let Motion::Slowing { ramps, rests } = &mut self.motion else { return };
        let axes = ramps.iter_mut().zip(rests).zip(&self.brakes).zip(&mut self.set_point);
        let mut stands = true;
        for (((ramp, rest), brake), place) in axes {
            let way = rest.wrapping_add(ramp.tick(0, brake));
            *place = *place + Pos::from_pm(way >> GLIDE_BITS);
            *rest = way & ((1 << GLIDE_BITS) - 1);
            stands &= ramp.is_at_rest();
        }
        if stands {
            self.motion = Motion::Hold;
        }
    }
}

/// Ticks to a tick, none if it is past.
fn ticks_to(tick: u32, from: u32) -> u32 {
    if has_come(from, tick) { tick.wrapping_sub(from) } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::super::profile::Limits;
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { speed: 2e6, acceleration: 5000.0, jerk: 20.0 };

    fn holding(at: [Pos; 2]) -> Path<2> {
        Path::holding(at, [RampLimits::new(5000 << GLIDE_BITS, 20 << GLIDE_BITS); 2])
    }

    fn run(path: &mut Path<2>, from_tick: u32) -> Vec<[Pos; 2]> {
        let mut points = Vec::new();
        let mut tick = from_tick;
        while !path.is_holding() {
            points.push(path.tick(tick));
            tick += 1;
        }
        points
    }

    proptest! {
        #[test]
        fn both_axes_stay_on_the_line_and_end_exactly(
            from in prop::array::uniform2(-200_000_000_000i64..200_000_000_000),
            to in prop::array::uniform2(-2_000_000_000i64..2_000_000_000),
            scale in 0u32..31,
        ) {
            let from = from.map(Pos::from_pm);
            let to = [from[0] + Pos::from_pm(to[0] >> scale), from[1] + Pos::from_pm(to[1] >> scale)];
            let plan = LinePlan::new(from, to, &[LIMITS; 2]);
            let mut path = holding(from);
            path.follow(plan, 0);
            let points = run(&mut path, 0);
            prop_assert_eq!(path.set_point(), to);
            let delta = [(to[0] - from[0]).pm() as f64, (to[1] - from[1]).pm() as f64];
            let length = delta[0].hypot(delta[1]).max(1.0);
            for point in points {
                let gone = [(point[0] - from[0]).pm() as f64, (point[1] - from[1]).pm() as f64];
                let off = (gone[0] * delta[1] - gone[1] * delta[0]) / length;
                prop_assert!(off.abs() <= 1.0, "{off} pm off the line");
            }
        }

        #[test]
        fn braking_stays_on_the_line_within_the_limits_and_never_turns_back(at in 1u32..1600) {
            let from = [Pos::ZERO; 2];
            let to = [Pos::from_mm(1.0), Pos::from_mm(-0.5)];
            let mut path = holding(from);
            path.follow(LinePlan::new(from, to, &[LIMITS; 2]), 0);
            let mut points: Vec<[Pos; 2]> = (0..at).map(|tick| path.tick(tick)).collect();
            path.brake();
            points.extend(run(&mut path, at));
            let x: Vec<i64> = points.iter().map(|p| p[0].pm()).collect();
            for pair in points.windows(2) {
                prop_assert!(pair[1][0] >= pair[0][0]);
                prop_assert!((pair[1][0].pm() + 2 * pair[1][1].pm()).abs() <= 3, "off the line");
            }
            for w in x.windows(3) {
                prop_assert!((w[2] - 2 * w[1] + w[0]).abs() as f64 <= 5000.0 + 4.0);
            }
            for w in x.windows(4) {
                let jerk = w[3] - 3 * w[2] + 3 * w[1] - w[0];
                prop_assert!(jerk.abs() as f64 <= 20.0 + 8.0, "{jerk}");
            }
        }
    }

    #[test]
    fn a_move_to_where_it_stands_ends_at_once() {
        let at = [Pos::from_mm(3.0); 2];
        let mut path = holding(at);
        path.follow(LinePlan::new(at, at, &[LIMITS; 2]), 0);
        assert_eq!(run(&mut path, 0).len(), 1);
        assert_eq!(path.set_point(), at);
    }
}
