//! What a tick walks, handed over before its time: pieces of motion that begin at ticks of the controller.

use super::ring::Ring;
use super::steps::Leg;

/// Spans in a batch.
pub const BATCH: usize = 4;

/// How long a span holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Until {
    /// The stage stands: until something else comes.
    #[default]
    Rest,
    /// Up to this tick, not included: then another must be there.
    Tick(u32),
}

/// A piece of the motion of N axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Span<const N: usize> {
    /// Tick at which it begins; the legs' own ticks do not count.
    pub first: u32,
    /// When it is over.
    pub until: Until,
    /// What each axis does; where there is none, the axis goes on with the leg it has.
    #[cfg_attr(feature = "serde", serde(with = "crate::arrays"))]
    pub legs: [Option<Leg>; N],
}

impl<const N: usize> Default for Span<N> {
    fn default() -> Self {
        Self { first: 0, until: Until::Rest, legs: [None; N] }
    }
}

/// Whether a tick has come.
#[inline]
pub const fn has_come(tick: u32, now: u32) -> bool {
    now.wrapping_sub(tick) < u32::MAX / 2
}

/// What a planner hands over at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Batch<const N: usize> {
    /// Of which move.
    pub number: u32,
    /// Which wish of the user it knows of; see [`Asked`](crate::background::Asked).
    pub revision: u32,
    /// Spans that begin at this tick or later are no longer true; those of the batch come in their place.
    pub cut: Option<u32>,
    /// So many segments were taken from the controller's queue.
    pub took: u8,
    /// Behind these spans comes nothing, as far as segments are known.
    pub done: bool,
    /// In the order of their ticks.
    pub spans: Ring<Span<N>, BATCH>,
}
