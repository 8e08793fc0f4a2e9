//! A scan that never stops: what is asked of the stage, and what is seen of it tick by tick.

pub(crate) mod ledger;
pub(crate) mod pace;
pub(crate) mod plan;
pub(crate) mod tally;
pub(crate) mod turns;
pub(crate) mod watch;

#[cfg(test)]
mod tests;
