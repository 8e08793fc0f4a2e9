//! What is to be planned, in units in which jerk and full acceleration are 1.

use super::family::{Family, Member};
use super::gentle::Gentle;
use super::motion::{Motion, Stretch, mirrored, time, way_of_all};
use super::{Infeasible, Limits, Phase, State, Transfer};

/// The sums of its phases may miss the end by so much of the way: what rounding leaves.
const MISSES: f64 = 1e-10;

/// Units in which jerk and full acceleration are 1.
pub(super) struct Scale {
    pub(super) time: f64,
    jerk: f64,
    acceleration: f64,
    pub(super) speed: f64,
    pub(super) length: f64,
}

impl Scale {
    pub(super) fn of(limits: &Limits) -> Result<Self, Infeasible> {
        let Limits { speed, acceleration, jerk } = *limits;
        if !limits.are_numbers() {
            return Err(Infeasible::NoNumber);
        }
        let time = acceleration / jerk;
        let scale =
            Self { time, jerk, acceleration, speed: acceleration * time, length: acceleration * time * time };
        let told =
            [scale.time, scale.speed, scale.length, speed / scale.speed].iter().all(|unit| unit.is_normal());
        if told { Ok(scale) } else { Err(Infeasible::NoNumber) }
    }

    /// The motion of these stretches, if they lead where they should.
    pub(super) fn motion(
        &self,
        from: State,
        to: State,
        task: &Task,
        stretches: [Stretch; 7],
    ) -> Result<Transfer, Infeasible> {
        let misses = (way_of_all(task.start, &stretches) - task.way).abs();
        let whole = task.way.abs() + task.top * time(&stretches);
        if misses <= MISSES * whole + task.blur {
            Transfer { from, to, phases: self.phases(stretches) }.told()
        } else {
            Err(Infeasible::NoNumber)
        }
    }

    pub(super) fn task(&self, from: State, to: State, limits: &Limits) -> Result<Task, Infeasible> {
        let task = Task {
            start: self.of_state(from)?,
            end: self.of_state(to)?,
            way: (to.position - from.position) / self.length,
            blur: 2.0 * f64::EPSILON * from.position.abs().max(to.position.abs()) / self.length,
            top: limits.speed / self.speed,
        };
        if !task.way.is_finite() {
            return Err(Infeasible::NoNumber);
        }
        task.is_possible()?;
        Ok(task)
    }

    pub(super) fn phases(&self, stretches: [Stretch; 7]) -> [Phase; 7] {
        stretches.map(|(time, jerk)| Phase { ticks: time * self.time, jerk: jerk * self.jerk })
    }

    pub(super) fn of_state(&self, state: State) -> Result<Motion, Infeasible> {
        let motion = Motion { v: state.speed / self.speed, a: state.acceleration / self.acceleration };
        let numbers = [state.position, motion.v, motion.a];
        if numbers.iter().all(|number| number.is_finite()) { Ok(motion) } else { Err(Infeasible::NoNumber) }
    }
}

/// What is to be planned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task {
    pub(super) start: Motion,
    pub(super) end: Motion,
    pub(super) way: f64,
    /// What the places it lies between may have been rounded by.
    pub(super) blur: f64,
    /// Full speed.
    pub(super) top: f64,
}

impl Task {
    fn is_possible(&self) -> Result<(), Infeasible> {
        if !self.start.is_within(self.top) {
            return Err(Infeasible::Start);
        }
        if !self.end.reversed().is_within(self.top) {
            return Err(Infeasible::End);
        }
        Ok(())
    }

    /// The seven phases: of all that lead there, those that take the least time.
    pub(super) fn fastest(&self) -> [Stretch; 7] {
        // One of both families leads there; rounding alone may say that neither does, and then its first is meant.
        self.soonest_after(f64::NEG_INFINITY).unwrap_or_else(|| {
            let family = Family::of(self);
            family.phases(&family.straightest())
        })
    }

    /// Of all full profiles that lead there and take longer than a time, the one that takes the least.
    pub(super) fn soonest_after(&self, after: f64) -> Option<[Stretch; 7]> {
        let image = self.mirrored();
        let mut best: Option<(Family, Member, bool)> = None;
        for (task, is_image) in [(self, false), (&image, true)] {
            for family in Family::of(task).all() {
                let Some(member) = family.reaching(task, after) else { continue };
                if best.is_none_or(|(_, best, _)| member.time < best.time) {
                    best = Some((family, member, is_image));
                }
            }
        }
        best.map(|(family, member, is_image)| {
            let phases = family.phases(&member);
            if is_image { mirrored(phases) } else { phases }
        })
    }

    /// What leads farthest in a time with a part of full acceleration, and what leads least far: how far beyond the way, and
    /// the phases.
    pub(super) fn extremes(&self, time: f64, part: f64) -> Option<[(f64, [Stretch; 7]); 2]> {
        let image = self.mirrored();
        let farthest = |task: &Self| {
            let families = Family::of(task).all().filter_map(|family| Gentle::of(family, part));
            let lasting = |family: Gentle| family.lasting(time, task.top);
            { families }.find_map(lasting).map(|(far, phases)| (far - task.way, phases))
        };
        let (here, there) = (farthest(self)?, farthest(&image)?);
        Some([here, (-there.0, mirrored(there.1))])
    }

    fn mirrored(&self) -> Self {
        Self { start: self.start.mirrored(), end: self.end.mirrored(), way: -self.way, ..*self }
    }
}
