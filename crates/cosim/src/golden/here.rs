//! Golden traces on this machine.

use abbe_core::Controller;
use abbe_core::design::StageSettings;
use abbe_proto::record::{Replay, ReplayError};
use anyhow::{Result, anyhow};

use super::{End, Found};

/// Replays a trace on the default stage.
///
/// # Errors
/// The default stage cannot be built.
pub fn replay(trace: &[u8]) -> Result<Found> {
    replay_with(trace, &StageSettings::default())
}

/// Replays a trace on another stage, to see that it matters.
///
/// # Errors
/// That stage cannot be built.
pub fn replay_with(trace: &[u8], settings: &StageSettings<2>) -> Result<Found> {
    let mut controller = Controller::new(settings.build().map_err(|error| anyhow!("{error}"))?);
    let mut replay = Replay::new(trace);
    let end = match replay.run(&mut controller) {
        Ok(_) => End::Whole,
        Err(ReplayError::Differs { .. }) => End::Differs,
        Err(ReplayError::Record(error)) => End::Unreadable(error.to_string()),
    };
    Ok(Found { ticks: replay.ticks(), proven: replay.proven(), hash: replay.hash().value(), end })
}
