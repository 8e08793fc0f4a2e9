//! The same run once more, proven bit for bit.

use super::file::{Recording, RecordingError};
use super::snapshot;
use crate::interrupt::{self, Interrupted};
use abbe_core::{Accepted, Command, Controller, Outputs, Refusal, Status};
use abbe_proto::record::{OutputsHash, Played, Replay, ReplayError};

/// Ticks between two looks for Ctrl-C.
const INTERRUPT_TICKS: u64 = 4096;

/// What a replay shows as it goes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Seen<'a> {
    /// A tick.
    Tick {
        /// Its number, from power-on.
        tick: u64,
        /// What the power stages were told.
        outputs: &'a Outputs<2>,
        /// What was known after it.
        status: &'a Status<2>,
    },
    /// A request after tick number `tick`, and its answer.
    Command { tick: u64, command: Command<2>, answer: Result<Accepted, Refusal> },
    /// An error map was offered to this axis after tick number `tick`.
    Map { tick: u64, axis: usize },
}

/// What a replay that came to its end has proven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Proof {
    /// So many ticks gave the outputs of the recorded run, bit for bit.
    pub(crate) ticks: u64,
    /// What the outputs of its last stretch hash to.
    pub(crate) hash: u64,
}

/// A run that does not happen again.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlayError {
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(
        "the outputs differ from the recorded run, first within the ticks {first} … {last} ({from_s:.4} … {to_s:.4} s)"
    )]
    Differs { first: u64, last: u64, from_s: f64, to_s: f64 },
    #[error("the controller after tick {tick} is not the one that was recorded there")]
    Gap { tick: u64 },
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// Lets a recorded run happen once more; `see` is shown all of it.
pub(crate) fn play(recording: &Recording, mut see: impl FnMut(Seen<'_>)) -> Result<Proof, PlayError> {
    let mut run = Run { tick_hz: recording.tick_hz(), tick: recording.numbers()[0], last: None };
    let mut proof = Proof { ticks: 0, hash: OutputsHash::EMPTY.value() };
    for stretch in &recording.stretches {
        let began = snapshot::controller(&stretch.snapshot).map_err(RecordingError::from)?;
        run.meets(&stretch.snapshot)?;
        let (controller, played) = run.stretch(began, &stretch.blocks, &mut see)?;
        let whole = u64::from(played.proven()) == stretch.ticks && played.ticks() == played.proven();
        if !whole || run.tick != stretch.numbers[1] {
            let reason = format!("only {} ticks of {} have their hash", played.proven(), stretch.ticks);
            return Err(RecordingError::Contents(reason).into());
        }
        proof = Proof { ticks: proof.ticks + stretch.ticks, hash: played.hash().value() };
        run.last = Some(controller);
    }
    Ok(proof)
}

struct Run {
    tick_hz: f64,
    /// Number of the last tick.
    tick: u64,
    /// The controller after the last stretch.
    last: Option<Controller<2>>,
}

impl Run {
    /// A stretch begins with the controller with which the one before it ended.
    fn meets(&self, snapshot: &[u8]) -> Result<(), PlayError> {
        match &self.last {
            Some(last) if snapshot::of(last).map_err(RecordingError::from)? != snapshot => {
                Err(PlayError::Gap { tick: self.tick })
            }
            _ => Ok(()),
        }
    }

    fn stretch<'a>(
        &mut self,
        mut controller: Controller<2>,
        blocks: &'a [u8],
        see: &mut impl FnMut(Seen<'_>),
    ) -> Result<(Controller<2>, Replay<'a, 2>), PlayError> {
        let mut replay = Replay::new(blocks);
        // The number of the tick that follows the last hash.
        let mut unproven = self.tick + 1;
        loop {
            let played = replay.step(&mut controller).map_err(|error| self.told(error, unproven))?;
            match played {
                None => return Ok((controller, replay)),
                Some(Played::Tick(outputs)) => self.tick(&controller, &outputs, see)?,
                Some(Played::Command(command, answer)) => {
                    see(Seen::Command { tick: self.tick, command, answer });
                }
                Some(Played::Map(axis)) => see(Seen::Map { tick: self.tick, axis }),
                Some(Played::Proven) => unproven = self.tick + 1,
                Some(Played::Background) => {}
            }
        }
    }

    fn tick(
        &mut self,
        controller: &Controller<2>,
        outputs: &Outputs<2>,
        see: &mut impl FnMut(Seen<'_>),
    ) -> Result<(), PlayError> {
        let status = controller.status();
        // Numbers of ticks wrap after some days, and jump where ticks were missed.
        self.tick += u64::from(status.tick.wrapping_sub(self.tick as u32));
        see(Seen::Tick { tick: self.tick, outputs, status: &status });
        if self.tick.is_multiple_of(INTERRUPT_TICKS) {
            interrupt::check()?;
        }
        Ok(())
    }

    fn told(&self, error: ReplayError, unproven: u64) -> PlayError {
        let seconds = |tick: u64| tick as f64 / self.tick_hz;
        match error {
            ReplayError::Record(error) => RecordingError::Contents(error.to_string()).into(),
            ReplayError::Differs { .. } => PlayError::Differs {
                first: unproven,
                last: self.tick,
                from_s: seconds(unproven),
                to_s: seconds(self.tick),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::tests::rig;
    use abbe_proto::record::{Encoder, Entry};
    use std::convert::Infallible;

    fn recording() -> Recording {
        let mut rig = rig(2);
        rig.recorder_mut().shorten_stretches(15_000);
        rig.home().unwrap();
        rig.move_to([0.5, 0.25]).unwrap();
        rig.recorder_mut().recording().unwrap()
    }

    fn ticks_of(recording: &Recording) -> u64 {
        recording.stretches.iter().map(|stretch| stretch.ticks).sum()
    }

    /// The same recording with the hash number `which` of its last stretch changed.
    fn with_another_hash(recording: &Recording, which: usize) -> Recording {
        let mut other = recording.clone();
        let stretch = other.stretches.last_mut().unwrap();
        let mut blocks = Vec::new();
        let mut encoder = Encoder::<2, _>::new(|block: &[u8]| {
            blocks.extend_from_slice(block);
            Ok::<(), Infallible>(())
        });
        let mut controller = snapshot::controller(&stretch.snapshot).unwrap();
        let mut decoder = abbe_proto::record::Decoder::<2>::new(&stretch.blocks);
        let mut ticks = 0;
        while let Some(entry) = decoder.next_entry().unwrap() {
            let Entry::Event(event) = entry else { continue };
            encoder.event(&event).unwrap();
            if let Some(mut outputs) = abbe_proto::record::apply(&mut controller, &event) {
                ticks += 1;
                outputs.lamp ^= ticks == 1000 * which + 1;
                encoder.outputs(&outputs).unwrap();
            }
        }
        _ = encoder.finish().unwrap();
        stretch.blocks = blocks;
        other
    }

    #[test]
    fn a_replay_shows_every_tick_once_and_proves_them() {
        let recording = recording();
        let (mut ticks, mut asked) = (Vec::new(), 0);
        let proof = play(&recording, |seen| match seen {
            Seen::Tick { tick, .. } => ticks.push(tick),
            Seen::Command { .. } => asked += 1,
            Seen::Map { .. } => {}
        })
        .unwrap();
        assert_eq!(proof.ticks, ticks_of(&recording));
        assert_eq!(ticks, (1..=ticks_of(&recording)).collect::<Vec<_>>());
        assert_eq!(asked, 2);
    }

    #[test]
    fn a_difference_is_told_with_its_ticks() {
        let recording = recording();
        let stretch_begins = ticks_of(&recording) - recording.stretches.last().unwrap().ticks;
        let error = play(&with_another_hash(&recording, 2), |_| {}).unwrap_err();
        let PlayError::Differs { first, last, .. } = error else { panic!("{error}") };
        assert_eq!((first, last), (stretch_begins + 2001, stretch_begins + 3000));
    }

    #[test]
    fn a_stretch_that_does_not_follow_the_one_before_it_is_found() {
        let mut recording = recording();
        assert!(recording.stretches.len() > 2);
        let missing = recording.stretches.remove(1);
        let error = play(&recording, |_| {}).unwrap_err();
        assert!(matches!(error, PlayError::Gap { tick } if tick == missing.ticks), "{error}");
    }
}
