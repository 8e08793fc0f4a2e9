//! G-code, line by line: a reader for programs and for the protocols that speak it.
//!
//! [`parse`] turns a line into a [`Block`] of words, [`interpret`] a block into at most one [`Action`], with a [`State`]
//! that is carried from block to block. Neither keeps more than a block, so a program may be endless. The words are in
//! one [table](TABLE), after NIST RS274/NGC version 3 (NISTIR 6556); what is a choice of this reader:
//!
//! - Numbers are decimals, never floats. Places are whole picometres; an inch is 25.4 mm exactly.
//! - Modes hold for their whole block, wherever they stand in it.
//! - What a block does not use is refused, so that nothing that was written is silently without effect.
//! - A refused block changes nothing.
//!
//! Limits of travel and of speed are the planner's: a feed is handed on as it was written.
//!
//! ```
//! use abbe_core::Pos;
//! use abbe_proto::gcode::{Action, State, read};
//!
//! let mut state = State::new([Pos::ZERO; 2]);
//! let effect = read(&mut state, b"G1 X10 Y-2.5 F600 (to the first field)").unwrap();
//! assert!(matches!(effect.action, Some(Action::Move(there)) if there.to == state.position()));
//! let error = read(&mut state, b"G2 X20 Y0 I4").unwrap_err();
//! assert_eq!(error.column, 11);
//! ```

mod action;
mod arc;
mod block;
mod fault;
mod interpret;
mod number;
mod state;
mod take;
#[cfg(test)]
mod tests;
mod words;

pub use action::{Action, Arc, Corner, Effect, Flow, Move, Path, Place, Rate, Sine, Stored, Turn};
pub use arc::slack;
pub use block::{Block, parse};
pub use fault::{Error, Fault};
pub use interpret::interpret;
pub use number::{Number, REACH, Unit};
pub use state::{Modes, REFERENCES, SYSTEMS, State};
pub use words::{Group, Letter, Name, Row, TABLE, Word, name_of};

/// Longest line, bytes without its end, as in NIST RS274/NGC.
pub const LONGEST: usize = 256;

/// Reads a line and does what it says: [`parse`] and [`interpret`].
///
/// # Errors
/// Says what is wrong and in which column; then the state is as it was.
pub fn read(state: &mut State, line: &[u8]) -> Result<Effect, Error> {
    interpret(state, &parse(line)?)
}
