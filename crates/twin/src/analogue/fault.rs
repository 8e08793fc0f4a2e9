//! What may happen to a head.

use super::converter::Converter;
use crate::trig::sin_turns;

/// One of the two signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The cosine.
    Cosine,
    /// The sine.
    Sine,
}

/// A spot on the grating: nothing at its rim, most in its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dirt {
    /// Its middle, mm of the scale.
    pub at_mm: f64,
    /// Its width, mm.
    pub width_mm: f64,
    /// Part of the amplitude that is lost in its middle, of cosine and sine.
    pub loss: [f64; 2],
}

impl Dirt {
    /// Part of the amplitude that is left at a reading: cosine, sine.
    fn kept(&self, reading_um: f64) -> [f64; 2] {
        let across = (reading_um * 1e-3 - self.at_mm) / self.width_mm;
        let depth = if across.abs() < 0.5 { 0.5 + 0.5 * sin_turns(across + 0.25) } else { 0.0 };
        self.loss.map(|loss| 1.0 - loss * depth)
    }
}

/// Something that happens to an analogue head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeadEvent {
    /// Dirt falls on the grating; it replaces what was there.
    Dirt(Dirt),
    /// The grating is cleaned.
    Clean,
    /// The lamp gives this part of its light. The offsets stay: they are the amplifiers'.
    Light {
        /// 1: as new.
        part: f64,
    },
    /// The amplifiers' gain changes; too high, the signals stop at the converter's rails.
    Amplify {
        /// 1: as it should be.
        factor: f64,
    },
    /// A channel of the converter stays at the middle of its range.
    Stick {
        /// Which.
        channel: Channel,
    },
    /// Both channels convert again.
    Unstick,
    /// The converter delivers nothing for some ticks.
    LoseSamples {
        /// How many.
        ticks: u32,
    },
    /// Noise at the comparators, part of the nominal amplitude, rms; beyond the hysteresis they chatter, and where both
    /// change at once counts are lost.
    Chatter {
        /// 0: none.
        part: f64,
    },
}

/// What has happened so far.
#[derive(Clone, Debug)]
pub(super) struct Faults {
    pub(super) light: f64,
    pub(super) amplifier: f64,
    pub(super) chatter: f64,
    dirt: Option<Dirt>,
    /// The code at which a channel stays.
    stuck: [Option<i16>; 2],
    lose: u32,
}

impl Default for Faults {
    fn default() -> Self {
        Self { light: 1.0, amplifier: 1.0, chatter: 0.0, dirt: None, stuck: [None; 2], lose: 0 }
    }
}

impl Faults {
    pub(super) fn happen(&mut self, event: HeadEvent, converter: &Converter) {
        match event {
            HeadEvent::Dirt(dirt) => self.dirt = Some(dirt),
            HeadEvent::Clean => self.dirt = None,
            HeadEvent::Light { part } => self.light = part,
            HeadEvent::Amplify { factor } => self.amplifier = factor,
            HeadEvent::Stick { channel: Channel::Cosine } => self.stuck[0] = Some(converter.middle()),
            HeadEvent::Stick { channel: Channel::Sine } => self.stuck[1] = Some(converter.middle()),
            HeadEvent::Unstick => self.stuck = [None; 2],
            HeadEvent::LoseSamples { ticks } => self.lose = ticks,
            HeadEvent::Chatter { part } => self.chatter = part,
        }
    }

    /// Part of the amplitude that dirt leaves at a reading: cosine, sine.
    pub(super) fn kept(&self, reading_um: f64) -> [f64; 2] {
        self.dirt.map_or([1.0; 2], |dirt| dirt.kept(reading_um))
    }

    /// The converter delivers nothing this time.
    pub(super) fn loses_a_sample(&mut self) -> bool {
        let loses = self.lose > 0;
        self.lose = self.lose.saturating_sub(1);
        loses
    }

    /// What the converter shows: cosine, sine.
    pub(super) fn shown(&self, codes: [i16; 2]) -> [i16; 2] {
        [self.stuck[0].unwrap_or(codes[0]), self.stuck[1].unwrap_or(codes[1])]
    }
}
