//! Machine: decides the mode. Every change of mode is one row of [`TRANSITIONS`].

pub mod homing;

use core::fmt;

/// What the stage is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum State {
    /// No torque, no pulses.
    Off,
    /// Looking for switches and reference marks.
    Homing,
    /// Holding a position in closed loop.
    Ready,
    /// On a path, or waiting for its plan.
    Moving,
    /// The path has ended; the stage has not yet been inside the window for the dwell time.
    Settling,
    /// Braking.
    Stopping,
    /// Off after a fault, until a reset.
    Fault,
}

/// All states, for exhaustive walks.
pub const STATES: [State; 7] =
    [State::Off, State::Homing, State::Ready, State::Moving, State::Settling, State::Stopping, State::Fault];

impl State {
    /// Whether the drives carry torque.
    pub const fn is_on(self) -> bool {
        !matches!(self, Self::Off | Self::Fault)
    }

    /// Whether a request is being worked on.
    pub const fn is_busy(self) -> bool {
        matches!(self, Self::Homing | Self::Moving | Self::Settling | Self::Stopping)
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Off => "off",
            Self::Homing => "homing",
            Self::Ready => "ready",
            Self::Moving => "moving",
            Self::Settling => "settling",
            Self::Stopping => "stopping",
            Self::Fault => "fault",
        })
    }
}

/// What can happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    /// Asked to switch the drives on.
    Enable,
    /// Asked to switch the drives off.
    Disable,
    /// Asked to home.
    Home,
    /// Asked to move.
    Move,
    /// Asked to stop.
    Stop,
    /// Asked to leave the fault.
    Reset,
    /// All zeros are found and the stage stands.
    Homed,
    /// The last set-point of the path was given.
    PathEnd,
    /// Inside the in-position window for the dwell time.
    InPosition,
    /// The window was not reached in time.
    TimedOut,
    /// Braking has ended.
    Halted,
    /// Braking for a fault has ended.
    HaltedInFault,
    /// A fault that allows braking on the path.
    ControlledFault,
    /// A fault after which nothing may be driven.
    CutFault,
}

/// All events, for exhaustive walks.
pub const EVENTS: [Event; 14] = [
    Event::Enable,
    Event::Disable,
    Event::Home,
    Event::Move,
    Event::Stop,
    Event::Reset,
    Event::Homed,
    Event::PathEnd,
    Event::InPosition,
    Event::TimedOut,
    Event::Halted,
    Event::HaltedInFault,
    Event::ControlledFault,
    Event::CutFault,
];

/// How a row ends the motion that was going on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// There is nothing to end.
    None,
    /// Brake on the path, within the limits of acceleration and jerk.
    Controlled,
    /// Off in the same tick.
    Cut,
}

/// One change of mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// In this state …
    pub from: State,
    /// … when this happens …
    pub on: Event,
    /// … the machine goes there …
    pub to: State,
    /// … and ends its motion so.
    pub stop: Stop,
}

const fn row(from: State, on: Event, to: State, stop: Stop) -> Row {
    Row { from, on, to, stop }
}

/// Every change of mode there is. A pair that has no row changes nothing; a request without a row is refused.
pub const TRANSITIONS: [Row; 34] = [
    // Off: no torque.
    row(State::Off, Event::Enable, State::Ready, Stop::None),
    row(State::Off, Event::Home, State::Homing, Stop::None),
    row(State::Off, Event::ControlledFault, State::Fault, Stop::Cut),
    row(State::Off, Event::CutFault, State::Fault, Stop::Cut),
    // Homing.
    row(State::Homing, Event::Homed, State::Ready, Stop::None),
    row(State::Homing, Event::Stop, State::Stopping, Stop::Controlled),
    row(State::Homing, Event::Disable, State::Off, Stop::Cut),
    row(State::Homing, Event::ControlledFault, State::Stopping, Stop::Controlled),
    row(State::Homing, Event::CutFault, State::Fault, Stop::Cut),
    // Ready: holding.
    row(State::Ready, Event::Move, State::Moving, Stop::None),
    row(State::Ready, Event::Home, State::Homing, Stop::None),
    row(State::Ready, Event::Disable, State::Off, Stop::Cut),
    row(State::Ready, Event::ControlledFault, State::Stopping, Stop::Controlled),
    row(State::Ready, Event::CutFault, State::Fault, Stop::Cut),
    // Moving.
    row(State::Moving, Event::Move, State::Moving, Stop::None),
    row(State::Moving, Event::PathEnd, State::Settling, Stop::None),
    row(State::Moving, Event::Stop, State::Stopping, Stop::Controlled),
    row(State::Moving, Event::Disable, State::Off, Stop::Cut),
    row(State::Moving, Event::ControlledFault, State::Stopping, Stop::Controlled),
    row(State::Moving, Event::CutFault, State::Fault, Stop::Cut),
    // Settling.
    row(State::Settling, Event::Move, State::Moving, Stop::None),
    row(State::Settling, Event::InPosition, State::Ready, Stop::None),
    row(State::Settling, Event::TimedOut, State::Ready, Stop::None),
    row(State::Settling, Event::Stop, State::Stopping, Stop::Controlled),
    row(State::Settling, Event::Disable, State::Off, Stop::Cut),
    row(State::Settling, Event::ControlledFault, State::Stopping, Stop::Controlled),
    row(State::Settling, Event::CutFault, State::Fault, Stop::Cut),
    // Stopping.
    row(State::Stopping, Event::Halted, State::Ready, Stop::None),
    row(State::Stopping, Event::HaltedInFault, State::Fault, Stop::Cut),
    row(State::Stopping, Event::Disable, State::Off, Stop::Cut),
    row(State::Stopping, Event::ControlledFault, State::Stopping, Stop::Controlled),
    row(State::Stopping, Event::CutFault, State::Fault, Stop::Cut),
    // Fault: off, explained, until a reset.
    row(State::Fault, Event::Reset, State::Off, Stop::None),
    row(State::Fault, Event::CutFault, State::Fault, Stop::Cut),
];

/// Where the row of each pair stands in [`TRANSITIONS`]; beyond its end for a pair without one. The tick must not search.
#[allow(
    clippy::indexing_slicing,
    reason = "done by the compiler, which stops at an index that does not exist"
)]
const ROW_OF_PAIR: [[u8; EVENTS.len()]; STATES.len()] = {
    let mut table = [[u8::MAX; EVENTS.len()]; STATES.len()];
    let mut number = 0;
    while number < TRANSITIONS.len() {
        let row = TRANSITIONS[number];
        table[row.from as usize][row.on as usize] = number as u8;
        number += 1;
    }
    table
};

/// The row of a pair, if it has one.
pub fn transition(state: State, event: Event) -> Option<&'static Row> {
    let number = *ROW_OF_PAIR.get(state as usize)?.get(event as usize)?;
    TRANSITIONS.get(usize::from(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs() -> impl Iterator<Item = (State, Event)> {
        STATES.into_iter().flat_map(|state| EVENTS.into_iter().map(move |event| (state, event)))
    }

    #[test]
    fn every_pair_has_at_most_one_row_and_it_is_found() {
        for (state, event) in pairs() {
            let rows: Vec<&Row> =
                TRANSITIONS.iter().filter(|row| row.from == state && row.on == event).collect();
            assert!(rows.len() <= 1, "{state:?} {event:?}");
            assert_eq!(transition(state, event), rows.first().copied());
        }
    }

    #[test]
    fn a_cut_fault_ends_in_fault_from_everywhere() {
        for state in STATES {
            let row = transition(state, Event::CutFault).unwrap();
            assert_eq!((row.to, row.stop), (State::Fault, Stop::Cut), "{state:?}");
        }
    }

    #[test]
    fn a_controlled_fault_brakes_whatever_is_driven_and_nothing_else() {
        for state in STATES {
            match transition(state, Event::ControlledFault) {
                Some(row) if state.is_on() => {
                    assert_eq!((row.to, row.stop), (State::Stopping, Stop::Controlled), "{state:?}");
                }
                Some(row) => assert_eq!((state, row.to), (State::Off, State::Fault)),
                None => assert_eq!(state, State::Fault),
            }
        }
    }

    #[test]
    fn every_row_that_switches_off_cuts_in_the_same_tick() {
        for row in TRANSITIONS.iter().filter(|row| row.from.is_on() && !row.to.is_on()) {
            assert_eq!(row.stop, Stop::Cut, "{row:?}");
        }
    }

    #[test]
    fn drives_come_on_only_by_request_and_leave_fault_only_by_reset() {
        for (state, event) in pairs() {
            let Some(row) = transition(state, event) else {
                continue;
            };
            if !state.is_on() && row.to.is_on() {
                assert_eq!(state, State::Off, "{row:?}");
                assert!(matches!(event, Event::Enable | Event::Home), "{row:?}");
            }
            if state == State::Fault && row.to != State::Fault {
                assert_eq!((event, row.to), (Event::Reset, State::Off));
            }
        }
    }

    #[test]
    fn whatever_is_driven_can_be_switched_off_and_whatever_moves_can_be_stopped() {
        for state in STATES.into_iter().filter(|state| state.is_on()) {
            assert_eq!(transition(state, Event::Disable).unwrap().to, State::Off, "{state:?}");
            if state.is_busy() && state != State::Stopping {
                assert_eq!(transition(state, Event::Stop).unwrap().to, State::Stopping, "{state:?}");
            }
        }
    }

    #[test]
    fn done_is_reached_only_through_settling() {
        for row in TRANSITIONS.iter().filter(|row| row.from == State::Moving) {
            assert_ne!(row.to, State::Ready, "the end of a path is not arrival: {row:?}");
        }
    }
}
