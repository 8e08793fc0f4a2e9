//! From any state of motion to any other in the least time, with limited speed, acceleration and jerk.
//!
//! A triple integrator is brought from one state to another soonest with full jerk and at most two changes of its sign
//! (Pontryagin's principle): +, −, + or −, +, −. Limits put pauses between: at full acceleration, at full speed, at full
//! deceleration. That makes seven phases, of which some last no time. A mirrored motion is planned like its image, so only
//! +, −, + is solved here; and a motion run backwards is one forwards, so only those whose start asks for more speed than
//! their end does.
//!
//! All profiles +, −, + between two speeds and accelerations belong to one of two families with one parameter each
//! ([`Family`](family::Family)). How far they lead is a smooth function of the parameter, which turns twice at most: between the turns it
//! is searched for what leads to the end, and of all that do, here and in the image, the soonest is the plan. No quartic is
//! solved, and no tolerance has a unit. Inside, jerk and full acceleration are 1.
//!
//! Where another axis takes longer, [`Transfer::lasting`] goes at a lower speed, or with less acceleration, for just as long.

mod cruise;
mod family;
mod gentle;
mod leg;
mod motion;
mod task;
mod timed;
mod together;
mod turns;

pub use together::together;

use super::profile::{Limits, durations};
use cruise::Cruise;
use motion::way;
use task::Scale;

/// A state of motion along one line: picometres and ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// pm.
    pub position: f64,
    /// pm a tick.
    pub speed: f64,
    /// pm a tick².
    pub acceleration: f64,
}

/// A stretch with constant jerk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Phase {
    /// How long, ticks.
    pub ticks: f64,
    /// pm a tick³.
    pub jerk: f64,
}

/// Why there is no plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Infeasible {
    /// A limit is not a number above zero, or a state not a number; or they are so far apart that no number tells them.
    NoNumber,
    /// The start is beyond a limit, or will be whatever is done.
    Start,
    /// The end is beyond a limit, or what leads to it was.
    End,
}

impl core::fmt::Display for Infeasible {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NoNumber => {
                "a limit is not above zero, a state is not a number, or both are too far apart for numbers"
            }
            Self::Start => "the start is beyond the limits, or will be",
            Self::End => "the end is beyond the limits, or was before it was reached",
        })
    }
}

impl core::error::Error for Infeasible {}

/// A motion from one state to another.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Transfer {
    from: State,
    to: State,
    phases: [Phase; 7],
}

/// A state may be beyond a limit by so much of it: what sums of rounded numbers leave.
const SLACK: f64 = 1e-11;
/// A motion is late if it takes longer by such a part: more than rounding.
const LATE: f64 = 1e-9;
/// The phase of constant speed. What the ones before it leave of an acceleration is rounded, and would grow with the square
/// of its time.
const CRUISE: usize = 3;

impl Transfer {
    /// The fastest motion between two states within limits.
    ///
    /// # Errors
    /// A state is beyond a limit, or cannot be left or reached within them: full jerk does not end an acceleration before
    /// the speed is beyond its own.
    pub fn fastest(from: State, to: State, limits: &Limits) -> Result<Self, Infeasible> {
        let scale = Scale::of(limits)?;
        let task = scale.task(from, to, limits)?;
        if from == to {
            return Ok(Self::standing(from));
        }
        if from.is_at_rest() && to.is_at_rest() {
            return Self { from, to, phases: from_rest_to_rest(to.position - from.position, limits) }.told();
        }
        scale.motion(from, to, &task, task.fastest())
    }

    /// One that takes no time.
    pub fn standing(at: State) -> Self {
        Self { from: at, to: at, ..Self::default() }
    }

    /// To rest as soon as can be, wherever that is.
    ///
    /// # Errors
    /// As of [`Transfer::fastest`], for the start.
    pub fn stop(from: State, limits: &Limits) -> Result<Self, Infeasible> {
        let scale = Scale::of(limits)?;
        let start = scale.of_state(from)?;
        if !start.is_within(limits.speed / scale.speed) {
            return Err(Infeasible::Start);
        }
        Self::to_speed(from, 0.0, limits)
    }

    /// To a speed as soon as can be, wherever that is; the start may be faster than the limit.
    ///
    /// # Errors
    /// The acceleration of the start is beyond its limit, or something is no number.
    pub fn to_speed(from: State, speed: f64, limits: &Limits) -> Result<Self, Infeasible> {
        let scale = Scale::of(limits)?;
        let start = scale.of_state(from)?;
        if !(start.a.abs() <= 1.0 + SLACK && speed.is_finite()) {
            return Err(Infeasible::Start);
        }
        let [a, b, c] = cruise::change(start, speed / scale.speed);
        let phases = scale.phases([a, b, c, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]);
        let position = from.position + scale.length * way(start, &[a, b, c]);
        Self { from, to: State { position, speed, acceleration: 0.0 }, phases }.told()
    }

    /// The lowest and the highest place on the way.
    pub fn extent(&self) -> [f64; 2] {
        let mut state = self.from;
        let mut extent = [state.position; 2];
        for phase in &self.phases {
            // Where the speed is zero: the position turns there.
            let (a, j) = (state.acceleration, phase.jerk);
            let spread = libm::sqrt(a * a - 2.0 * j * state.speed) / j;
            let turns = if j == 0.0 { [-state.speed / a; 2] } else { [-a / j - spread, -a / j + spread] };
            for time in
                turns.into_iter().chain([phase.ticks]).filter(|time| (0.0..=phase.ticks).contains(time))
            {
                let place = state.after(time, j).position;
                extent = [extent[0].min(place), extent[1].max(place)];
            }
            state = state.after(phase.ticks, j);
        }
        extent
    }

    /// Whether it never goes back, but for what is rounded: a part of the highest speed.
    pub fn is_forward(&self, rounded: f64) -> bool {
        let mut state = self.from;
        self.phases.iter().all(|phase| {
            let after = state.after(phase.ticks, phase.jerk);
            let turn = -state.acceleration / phase.jerk;
            let lowest = if turn > 0.0 && turn < phase.ticks {
                state.after(turn, phase.jerk).speed
            } else {
                state.speed
            };
            state = after;
            lowest.min(after.speed) >= -rounded
        })
    }

    /// Itself, if there are numbers for how long it takes and where it ends.
    fn told(self) -> Result<Self, Infeasible> {
        let are_times = self.phases.iter().all(|phase| phase.ticks >= 0.0);
        if are_times && self.ticks().is_finite() && self.to.position.is_finite() {
            Ok(self)
        } else {
            Err(Infeasible::NoNumber)
        }
    }

    /// Of the fastest motion: one between the same states that takes just so long. From speed to speed some times cannot be
    /// met, and then it is the shortest that takes longer.
    ///
    /// # Errors
    /// As of [`Transfer::fastest`], or the time is not a number.
    pub fn lasting(&self, limits: &Limits, ticks: f64) -> Result<Self, Infeasible> {
        if !ticks.is_finite() {
            return Err(Infeasible::NoNumber);
        }
        if ticks <= self.ticks() {
            return Ok(*self);
        }
        let slower = self.cruising(limits, ticks)?;
        if slower.ticks() <= ticks * (1.0 + SLACK) {
            return Ok(slower);
        }
        let others = [self.with_less(limits, ticks), self.soonest_after(limits, ticks)];
        let sooner = others.into_iter().flatten().find(|other| other.ticks() < slower.ticks());
        Ok(sooner.unwrap_or(slower))
    }

    /// The same; but if that would take longer and comes to rest, the fastest, which is there sooner and can wait.
    ///
    /// # Errors
    /// As of [`Transfer::lasting`].
    pub fn lasting_or_sooner(&self, limits: &Limits, ticks: f64) -> Result<Self, Infeasible> {
        let lasting = self.lasting(limits, ticks)?;
        let is_late = lasting.ticks() > ticks * (1.0 + LATE);
        Ok(if is_late && self.to.is_at_rest() { *self } else { lasting })
    }

    /// One with a phase at a lower speed.
    fn cruising(&self, limits: &Limits, ticks: f64) -> Result<Self, Infeasible> {
        let scale = Scale::of(limits)?;
        let task = scale.task(self.from, self.to, limits)?;
        let [rise, pause, fall, ..] = self.phases;
        let peak =
            [rise, pause, fall].iter().fold(self.from, |state, phase| state.after(phase.ticks, phase.jerk));
        let stretches = Cruise::of(&task).lasting(ticks / scale.time, peak.speed / scale.speed);
        scale.motion(self.from, self.to, &task, stretches)
    }

    /// How long it takes, ticks.
    pub fn ticks(&self) -> f64 {
        self.phases.iter().map(|phase| phase.ticks).sum()
    }

    /// Where it begins.
    pub fn start(&self) -> State {
        self.from
    }

    /// Where it ends.
    pub fn end(&self) -> State {
        self.to
    }

    /// Its phases in their order; some last no time.
    pub fn phases(&self) -> &[Phase; 7] {
        &self.phases
    }

    /// The state at a time from its beginning, ticks; after its end it goes on at constant speed.
    pub fn at(&self, ticks: f64) -> State {
        let mut state = self.from;
        let mut left = ticks.max(0.0);
        for (number, phase) in self.phases.into_iter().enumerate() {
            if number == CRUISE && phase.ticks > 0.0 {
                state.acceleration = 0.0;
            }
            if left < phase.ticks {
                return state.after(left, phase.jerk);
            }
            state = state.after(phase.ticks, phase.jerk);
            left -= phase.ticks;
        }
        State { position: self.to.position + self.to.speed * left, acceleration: 0.0, ..self.to }
    }
}

/// For this there are formulas.
fn from_rest_to_rest(way: f64, limits: &Limits) -> [Phase; 7] {
    if way == 0.0 {
        return [Phase::default(); 7];
    }
    let (jerk, acceleration, cruise) = durations(way.abs(), limits);
    let phase = |ticks: f64, sign: f64| Phase { ticks, jerk: sign * way.signum() * limits.jerk };
    [
        phase(jerk, 1.0),
        phase(acceleration, 0.0),
        phase(jerk, -1.0),
        phase(cruise, 0.0),
        phase(jerk, -1.0),
        phase(acceleration, 0.0),
        phase(jerk, 1.0),
    ]
}

impl State {
    fn is_at_rest(&self) -> bool {
        self.speed == 0.0 && self.acceleration == 0.0
    }

    /// Where its acceleration has been taken back with full jerk.
    pub(in crate::plan) fn settled(self, jerk: f64) -> Self {
        self.after(self.acceleration.abs() / jerk, -self.acceleration.signum() * jerk)
    }

    /// After so many ticks with a jerk.
    #[must_use]
    pub fn after(self, ticks: f64, jerk: f64) -> Self {
        let Self { position, speed, acceleration } = self;
        Self {
            position: position + ticks * (speed + ticks / 2.0 * (acceleration + ticks / 3.0 * jerk)),
            speed: speed + ticks * (acceleration + ticks / 2.0 * jerk),
            acceleration: acceleration + ticks * jerk,
        }
    }
}
