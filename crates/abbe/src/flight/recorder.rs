//! A controller with a recorder beside it: nothing reaches it unrecorded.

use super::file::{Origin, Recording, RecordingError, Stretch};
use super::snapshot;
use abbe_core::background::Planner;
use abbe_core::compensate::ErrorMap;
use abbe_core::{Accepted, Command, Controller, Inputs, Outputs, Refusal};
use abbe_proto::record::{Encoder, Event, Sink};
use std::collections::VecDeque;
use std::convert::Infallible;

/// Length of a stretch, s of the stage's time.
const STRETCH_S: f64 = 5.0;
/// The ring keeps at least so much, s of the stage's time.
const RING_S: f64 = 120.0;
/// And never more than this, bytes: six times what two minutes of motion take.
const RING_BYTES: usize = 48 << 20;

/// How much is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Keep {
    /// The last two minutes.
    LastMinutes,
    /// Everything since power-on.
    All,
}

/// The blocks of a stretch.
#[derive(Debug, Default)]
struct Blocks(Vec<u8>);

impl Sink for Blocks {
    type Error = Infallible;

    fn block(&mut self, block: &[u8]) -> Result<(), Infallible> {
        self.0.extend_from_slice(block);
        Ok(())
    }
}

/// A stretch that is over.
#[derive(Debug)]
struct Past {
    began: Box<Controller<2>>,
    ticks: u64,
    numbers: [u64; 2],
    blocks: Vec<u8>,
}

/// The stretch that is being recorded.
#[derive(Debug)]
struct Present {
    began: Box<Controller<2>>,
    ticks: u64,
    /// Number of the last tick before it.
    number: u64,
    encoder: Encoder<2, Blocks>,
}

impl Present {
    fn begin(controller: &Controller<2>, number: u64) -> Self {
        let began = Box::new(controller.clone());
        Self { began, ticks: 0, number, encoder: Encoder::new(Blocks::default()) }
    }

    fn event(&mut self, event: &Event<'_, 2>) {
        let Ok(()) = self.encoder.event(event);
    }
}

/// A controller and what happened to it.
#[derive(Debug)]
pub(crate) struct Recorder {
    controller: Controller<2>,
    planner: Planner,
    origin: Origin,
    keep: Keep,
    past: VecDeque<Past>,
    present: Present,
    /// Number of the last tick, from power-on; the controller's own wraps after some days.
    number: u64,
    stretch_ticks: u64,
    ring_stretches: usize,
}

impl Recorder {
    /// A controller that has just been switched on.
    pub(crate) fn new(controller: Controller<2>, origin: Origin, keep: Keep) -> Self {
        let tick_hz = controller.config().tick_hz;
        Self {
            present: Present::begin(&controller, 0),
            number: 0,
            controller,
            planner: Planner::default(),
            origin,
            keep,
            past: VecDeque::new(),
            stretch_ticks: (STRETCH_S * tick_hz).max(1.0) as u64,
            ring_stretches: (RING_S / STRETCH_S).ceil() as usize,
        }
    }

    /// The controller, to look at.
    pub(crate) fn controller(&self) -> &Controller<2> {
        &self.controller
    }

    /// One tick, and the planning after it.
    pub(crate) fn tick(&mut self, inputs: &Inputs<2>) -> Outputs<2> {
        if self.present.ticks == self.stretch_ticks {
            self.next_stretch();
        }
        self.present.event(&Event::Tick(*inputs));
        let outputs = self.controller.tick(inputs);
        let Ok(()) = self.present.encoder.outputs(&outputs);
        self.present.ticks += 1;
        self.number += u64::from(inputs.tick.wrapping_sub(self.number as u32));
        if let Some(done) = self.planner.advance(&mut self.controller) {
            self.present.event(&done.into());
        }
        outputs
    }

    /// Asks the controller.
    pub(crate) fn command(&mut self, command: Command<2>) -> Result<Accepted, Refusal> {
        self.present.event(&Event::Command(command));
        self.controller.command(command)
    }

    /// Puts an error map in use.
    pub(crate) fn set_error_map(&mut self, axis: usize, map: &ErrorMap) -> Result<(), Refusal> {
        self.present.event(&Event::Map { axis, map: Some(map) });
        self.controller.set_error_map(axis, Some(*map))
    }

    /// All that is kept.
    pub(crate) fn recording(&mut self) -> Result<Recording, RecordingError> {
        let Ok(()) = self.present.encoder.flush();
        let past = self.past.iter().map(|past| (&past.began, past.ticks, past.numbers, &past.blocks));
        let Present { began, ticks, number, encoder } = &self.present;
        let all = past.chain([(began, *ticks, [*number, self.number], &encoder.sink().0)]);
        let stretches = all.map(|(began, ticks, numbers, blocks)| {
            Ok(Stretch { ticks, numbers, snapshot: snapshot::of(began)?, blocks: blocks.clone() })
        });
        let stretches = stretches.collect::<Result<Vec<_>, postcard::Error>>()?;
        Ok(Recording { origin: self.origin.clone(), stretches })
    }

    fn next_stretch(&mut self) {
        let over = std::mem::replace(&mut self.present, Present::begin(&self.controller, self.number));
        let Ok(Blocks(blocks)) = over.encoder.finish();
        let numbers = [over.number, self.number];
        self.past.push_back(Past { began: over.began, ticks: over.ticks, numbers, blocks });
        while self.keep == Keep::LastMinutes && self.is_too_much() {
            self.past.pop_front();
        }
    }

    fn is_too_much(&self) -> bool {
        let bytes: usize = self.past.iter().map(|past| past.blocks.len()).sum();
        self.past.len() > self.ring_stretches || bytes > RING_BYTES
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::replay;
    use crate::rig::tests::rig;

    impl Recorder {
        pub(crate) fn shorten_stretches(&mut self, ticks: u64) {
            self.stretch_ticks = ticks;
        }
    }

    #[test]
    fn the_ring_keeps_two_minutes_and_replays_from_the_middle() {
        let mut rig = rig(5);
        // A quarter of the stretches' length, so that the test is short.
        rig.recorder_mut().shorten_stretches(2_000);
        rig.home().unwrap();
        while rig.recorder_mut().past.len() < 24 || rig.time_s() < 8.0 {
            rig.move_to([1.0, 2.0]).unwrap();
            rig.move_to([2.0, 1.5]).unwrap();
        }
        let ticks = (rig.time_s() * 1e4).round() as u64;
        let recording = rig.recorder_mut().recording().unwrap();
        let kept: u64 = recording.stretches.iter().map(|stretch| stretch.ticks).sum();
        assert!((48_000..=50_000).contains(&kept) && kept < ticks, "{kept} of {ticks}");
        let mut last = None;
        let proof = replay::play(&recording, |seen| {
            if let replay::Seen::Tick { status, .. } = seen {
                last = Some(*status);
            }
        });
        assert_eq!(proof.unwrap().ticks, kept);
        assert_eq!(last, Some(rig.status()));
    }

    #[test]
    fn a_flood_is_bounded_in_bytes_too() {
        let mut rig = rig(5);
        rig.recorder_mut().shorten_stretches(10);
        let flood = |ticks| Past {
            began: Box::new(rig.controller().clone()),
            ticks,
            numbers: [0, 0],
            blocks: vec![0; RING_BYTES / 4],
        };
        let floods: Vec<Past> = (0..8).map(flood).collect();
        rig.recorder_mut().past.extend(floods);
        for _ in 0..30 {
            rig.tick();
        }
        let kept: usize = rig.recorder_mut().past.iter().map(|past| past.blocks.len()).sum();
        assert!(kept <= RING_BYTES, "{kept}");
    }
}
