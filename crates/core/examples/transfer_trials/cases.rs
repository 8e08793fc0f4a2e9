//! Random limits and states of motion, in any unit.

use abbe_core::plan::Limits;
use abbe_core::plan::transfer::State;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// A stage's limits at 10 kHz, pm and ticks: 20 mm/s, 0.5 m/s², 20 m/s³.
pub(crate) const STAGE: Limits = Limits { speed: 2e6, acceleration: 5000.0, jerk: 20.0 };

/// Two states and the limits between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    pub(crate) from: State,
    pub(crate) to: State,
    pub(crate) limits: Limits,
}

/// What moves at the ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    /// Nothing.
    AtRest,
    /// The start.
    FromMotion,
    /// Either, in two thirds of the cases.
    Any,
}

impl Ends {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::AtRest => "from rest to rest",
            Self::FromMotion => "from motion to rest",
            Self::Any => "from any state to any",
        }
    }
}

impl Case {
    /// Limits a decade around those of a stage, ways of 0.1 µm to 100 mm, in a unit: so many in a picometre.
    pub(crate) fn random(random: &mut Pcg64Mcg, unit: f64, ends: Ends) -> Self {
        let mut around =
            |middle: f64, decades: f64| middle * 10_f64.powf(random.random_range(-decades..decades));
        let limits = Limits {
            speed: unit * around(STAGE.speed, 1.0),
            acceleration: unit * around(STAGE.acceleration, 1.0),
            jerk: unit * around(STAGE.jerk, 1.0),
        };
        let longest = unit * around(1e8, 3.0);
        let mut any = |moves: bool| {
            let position = random.random_range(-longest..longest);
            if moves { moving(random, &limits, position) } else { State { position, ..State::default() } }
        };
        let from = any(ends != Ends::AtRest);
        let to = any(ends == Ends::Any);
        let case = Self { from, to, limits };
        if ends == Ends::Any { case.some_at_rest(random) } else { case }
    }

    fn some_at_rest(mut self, random: &mut Pcg64Mcg) -> Self {
        for state in [&mut self.from, &mut self.to] {
            if random.random_range(0..3) == 0 {
                *state = State { position: state.position, ..State::default() };
            }
        }
        self
    }

    /// The same with other units of length and time, so many of which are in a picometre and a tick.
    pub(crate) fn in_units(self, length: f64, time: f64) -> Self {
        let state = |state: State| State {
            position: state.position * length,
            speed: state.speed * length / time,
            acceleration: state.acceleration * length / (time * time),
        };
        let Limits { speed, acceleration, jerk } = self.limits;
        let limits = Limits {
            speed: speed * length / time,
            acceleration: acceleration * length / (time * time),
            jerk: jerk * length / (time * time * time),
        };
        Self { from: state(self.from), to: state(self.to), limits }
    }
}

/// Within the limits, and such that it can be left and reached within them.
fn moving(random: &mut Pcg64Mcg, limits: &Limits, position: f64) -> State {
    let top = 0.999 * limits.speed;
    let speed = random.random_range(-top..top);
    // No more than full jerk ends before full speed.
    let most = (2.0 * limits.jerk * (limits.speed - speed.abs())).sqrt().min(0.999 * limits.acceleration);
    State { position, speed, acceleration: random.random_range(-most..=most) }
}
