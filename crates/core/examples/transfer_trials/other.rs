//! The other planner, rsruckig: a port of Ruckig (Berscheid and Kröger, Robotics: Science and Systems 2021).

use super::cases::Case;
use rsruckig::prelude::*;

/// Its planner and what it works on, made once.
pub(crate) struct Other<const N: usize> {
    planner: Ruckig<N, ThrowErrorHandler>,
    input: InputParameter<N>,
    trajectory: Trajectory<N>,
}

impl<const N: usize> Other<N> {
    pub(crate) fn new() -> Self {
        Self {
            planner: Ruckig::new(None, 1.0),
            input: InputParameter::new(None),
            trajectory: Trajectory::new(None),
        }
    }

    pub(crate) fn set(&mut self, cases: &[Case; N]) {
        let input = &mut self.input;
        input.minimum_duration = None;
        for (axis, Case { from, to, limits }) in cases.iter().enumerate() {
            (input.current_position[axis], input.target_position[axis]) = (from.position, to.position);
            (input.current_velocity[axis], input.target_velocity[axis]) = (from.speed, to.speed);
            (input.current_acceleration[axis], input.target_acceleration[axis]) =
                (from.acceleration, to.acceleration);
            input.max_velocity[axis] = limits.speed;
            input.max_acceleration[axis] = limits.acceleration;
            input.max_jerk[axis] = limits.jerk;
        }
    }

    /// What was set is to take so long, or longer.
    pub(crate) fn last(&mut self, seconds: f64) {
        self.input.minimum_duration = Some(seconds);
    }

    /// Plans what was set; how long it takes, or none where it finds nothing.
    pub(crate) fn plan(&mut self) -> Option<f64> {
        let found = self.planner.calculate(&self.input, &mut self.trajectory).ok()?;
        let found = matches!(found, RuckigResult::Working | RuckigResult::Finished);
        found.then(|| self.trajectory.get_duration())
    }
}
