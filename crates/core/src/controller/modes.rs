//! Changes of mode, and what each begins and ends: homing, braking, switching off.

use super::Controller;
use super::axis::{Axis, Glide};
use crate::command::Refusal;
use crate::machine::{Event, State, Stop, transition};
use crate::publish::{Fault, Outcome};

impl<const N: usize> Controller<N> {
    /// One row of the table, if there is one. Returns whether there was.
    pub(super) fn happen(&mut self, event: Event) -> bool {
        let Some(row) = transition(self.state, event) else {
            return false;
        };
        let was_on = self.state.is_on();
        match row.stop {
            Stop::None => {}
            Stop::Controlled => self.brake(),
            Stop::Cut => self.cut(),
        }
        self.state = row.to;
        match row.to {
            State::Homing => self.begin_homing(was_on),
            State::Ready if !was_on => self.hold_reading(),
            State::Off => {
                self.fault = None;
                self.doubt_heads();
            }
            _ => {}
        }
        true
    }

    /// A head that cost its axis the zero may have been false until now, when somebody says that it no longer is.
    #[cold]
    fn doubt_heads(&mut self) {
        for (axis, head) in self.axes.iter().zip(&mut self.heads) {
            if let (false, Some(head)) = (axis.homed, head) {
                head.doubt();
            }
        }
    }

    pub(super) fn request(&mut self, event: Event) -> Result<(), Refusal> {
        if self.happen(event) || (event == Event::Enable && self.state == State::Ready) {
            return Ok(());
        }
        Err(self.refusal())
    }

    pub(super) fn refusal(&self) -> Refusal {
        match (self.state, self.fault) {
            (State::Off, _) => Refusal::DrivesOff,
            (State::Fault, Some(fault)) => Refusal::InFault(fault),
            (state, _) => Refusal::Busy(state),
        }
    }

    pub(super) fn disable(&mut self) {
        // Off while braking for a fault is still a fault: it stays explained until the reset.
        let event = if self.fault.is_some() { Event::HaltedInFault } else { Event::Disable };
        _ = self.happen(event);
    }

    fn begin_homing(&mut self, was_on: bool) {
        self.disarm();
        for axis in &mut self.axes {
            axis.begin_homing(was_on);
        }
    }

    pub(super) fn home(&mut self) {
        let mut failed = None;
        for (number, axis) in self.axes.iter_mut().enumerate() {
            if let Some(homing) = axis.homing.as_mut() {
                match homing.tick(&axis.sense.now, &axis.config.homing) {
                    Ok(speed) => axis.glide.wanted = speed,
                    Err(failure) => failed = failed.or(Some(Fault::Homing { axis: number, failure })),
                }
            }
        }
        if let Some(fault) = failed {
            self.fail(fault);
        } else if let Some(number) = self.axes.iter().position(Axis::has_homed) {
            // One a tick: it is the longest work there is.
            self.end_homing(number);
        } else if self.axes.iter().all(|axis| axis.homing.is_none()) {
            _ = self.happen(Event::Homed);
        }
    }

    fn end_homing(&mut self, number: usize) {
        let axis_and_target = self.axes.get_mut(number).zip(self.target.get_mut(number));
        if let Some((axis, target)) = axis_and_target {
            axis.end_homing(self.heads.get(number).and_then(Option::as_ref));
            *target = axis.hold();
            self.path.hold_axis(number, *target);
        }
    }

    pub(super) fn halt(&mut self, tick: u32) {
        self.stop_without_planner(tick);
        let stands = self.path.is_holding() && self.axes.iter().all(|axis| axis.glide.ramp.is_at_rest());
        if !stands {
            return;
        }
        self.program.close();
        for axis in &mut self.axes {
            axis.homing = None;
        }
        if self.fault.is_some() {
            _ = self.happen(Event::HaltedInFault);
        } else {
            self.end_move(Outcome::Stopped);
            _ = self.happen(Event::Halted);
            self.hold_reading();
        }
    }

    fn brake(&mut self) {
        if !self.stop_program() {
            self.path.brake();
        }
        for axis in &mut self.axes {
            axis.glide.wanted = 0;
        }
    }

    fn cut(&mut self) {
        self.end_move(Outcome::Aborted);
        self.program.close();
        for axis in &mut self.axes {
            axis.homing = None;
            axis.glide = Glide::default();
        }
        self.path.hold(self.path.set_point());
    }

    /// Takes the reading for the target, once: after this the target no longer follows the reading.
    fn hold_reading(&mut self) {
        for axis in &mut self.axes {
            axis.set_point = axis.sense.now.position;
            axis.servo.reset();
        }
        self.hold_set_point();
    }

    /// The place of the set-point becomes path and target; the table does not move.
    pub(super) fn hold_set_point(&mut self) {
        for (target, axis) in self.target.iter_mut().zip(&mut self.axes) {
            *target = axis.hold();
        }
        self.path.hold(self.target);
    }
}
