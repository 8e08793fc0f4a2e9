//! Position compare: the measured position of an axis, as it is published, against evenly spaced places.

use super::Controller;
use crate::command::{Compare, Refusal};
use crate::front::compare::{Fired, Passage, Sampled};
use crate::machine::State;
use crate::units::Pos;

impl<const N: usize> Controller<N> {
    /// Which places the measured position has passed between the last two ticks, with the times in ticks. Not for a tick of
    /// a board: divides.
    pub fn fired(&self) -> Fired {
        self.passage.fired()
    }

    pub(super) fn arm(&mut self, compare: Option<Compare>) -> Result<(), Refusal> {
        self.disarm();
        if let Some(Compare { axis, places }) = compare {
            if self.state == State::Homing {
                return Err(Refusal::Busy(self.state));
            }
            let published = self.published.get(axis).ok_or(Refusal::NoSuchAxis(axis))?;
            let position = if published.homed { published.position } else { return Err(Refusal::NotHomed) };
            let tick = self.last_tick.unwrap_or(0);
            let armed = Sampled::new(places, tick, position).map_err(Refusal::NoPlaces)?;
            self.compare = Some((axis, armed));
        }
        Ok(())
    }

    pub(super) fn disarm(&mut self) {
        self.compare = None;
        self.passage = Passage::default();
    }

    /// Whether the position that was just published has passed a place.
    #[inline(never)]
    pub(super) fn compare_position(&mut self, tick: u32) -> bool {
        let Some((axis, armed)) = &mut self.compare else { return false };
        let position = self.published.get(*axis).map_or(Pos::ZERO, |axis| axis.position);
        self.passage = armed.pass(tick, position);
        self.passage.is_some()
    }
}
