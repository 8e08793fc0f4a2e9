//! Golden traces on this machine.

use abbe_core::Controller;
use abbe_core::design::StageSettings;
use abbe_proto::record::{OutputsHash, Replay, ReplayError, stage};
use anyhow::{Result, anyhow};

use super::{End, Found};

/// Replays a trace on its stage.
///
/// # Errors
/// The stage cannot be built.
pub fn replay(trace: &[u8]) -> Result<Found> {
    replay_with(trace, |_| ())
}

/// Replays a trace on a stage of which something was changed, to see that it matters.
///
/// # Errors
/// That stage cannot be built.
pub fn replay_with(trace: &[u8], change: impl FnOnce(&mut StageSettings<2>)) -> Result<Found> {
    let (stage, blocks) = match stage::split(trace) {
        Ok(split) => split,
        Err(error) => {
            let end = End::Unreadable(error.to_string());
            return Ok(Found { ticks: 0, proven: 0, hash: OutputsHash::EMPTY.value(), end });
        }
    };
    let mut settings = stage.unwrap_or_default();
    change(&mut settings);
    let mut controller = Controller::with_planner(settings.build().map_err(|error| anyhow!("{error}"))?);
    let mut replay = Replay::new(blocks);
    let end = match replay.run(&mut controller) {
        Ok(_) => End::Whole,
        Err(ReplayError::Differs { .. }) => End::Differs,
        Err(ReplayError::Record(error)) => End::Unreadable(error.to_string()),
    };
    Ok(Found { ticks: replay.ticks(), proven: replay.proven(), hash: replay.hash().value(), end })
}
