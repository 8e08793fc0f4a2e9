//! What may happen to a head.

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
    /// The noise of converter and comparators becomes so many times what it was: a motor that interferes, a bad shield.
    Noise {
        /// 1: as it should be.
        factor: f64,
    },
    /// The amplifiers' gain changes; too high, the signals stop at the converter's rails.
    Amplify {
        /// 1: as it should be.
        factor: f64,
    },
    /// A channel of the converter stays at its last code.
    Stick {
        /// Which.
        channel: Channel,
    },
    /// Both channels convert again.
    Unstick,
    /// The next sample of a channel is wrong by this part of the converter's full scale: a spark, a bit that fell over.
    Spike {
        /// Which.
        channel: Channel,
        /// −2 … 2; the converter ends where it ends.
        part: f64,
    },
    /// The converter delivers nothing for some ticks.
    LoseSamples {
        /// How many.
        ticks: u32,
    },
    /// Both channels float at this level once the plug is out, part of the converter's full scale.
    Unplugged {
        /// −1 … 1.
        level: f64,
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
    pub(super) noise: f64,
    pub(super) chatter: f64,
    /// Where a pulled plug leaves the channels, if not where the preset says.
    pub(super) unplugged: Option<f64>,
    dirt: Option<Dirt>,
    stuck: [bool; 2],
    /// What the next sample is wrong by, codes.
    spikes: [i16; 2],
    /// What was shown last.
    codes: [i16; 2],
    lose: u32,
}

impl Default for Faults {
    fn default() -> Self {
        Self {
            light: 1.0,
            amplifier: 1.0,
            noise: 1.0,
            chatter: 0.0,
            unplugged: None,
            dirt: None,
            stuck: [false; 2],
            spikes: [0; 2],
            codes: [0; 2],
            lose: 0,
        }
    }
}

impl Faults {
    pub(super) fn happen(&mut self, event: HeadEvent) {
        match event {
            HeadEvent::Dirt(dirt) => self.dirt = Some(dirt),
            HeadEvent::Clean => self.dirt = None,
            HeadEvent::Light { part } => self.light = part,
            HeadEvent::Noise { factor } => self.noise = factor,
            HeadEvent::Amplify { factor } => self.amplifier = factor,
            HeadEvent::Stick { channel: Channel::Cosine } => self.stuck[0] = true,
            HeadEvent::Stick { channel: Channel::Sine } => self.stuck[1] = true,
            HeadEvent::Spike { channel: Channel::Cosine, part } => self.spikes[0] = codes_of(part),
            HeadEvent::Spike { channel: Channel::Sine, part } => self.spikes[1] = codes_of(part),
            HeadEvent::Unstick => self.stuck = [false; 2],
            HeadEvent::LoseSamples { ticks } => self.lose = ticks,
            HeadEvent::Unplugged { level } => self.unplugged = Some(level),
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
    pub(super) fn shown(&mut self, codes: [i16; 2]) -> [i16; 2] {
        for ((shown, code), stuck) in self.codes.iter_mut().zip(codes).zip(self.stuck) {
            if !stuck {
                *shown = code;
            }
        }
        let spikes = std::mem::take(&mut self.spikes);
        [0, 1].map(|channel| self.codes[channel].saturating_add(spikes[channel]))
    }
}

/// A part of the converter's full scale.
fn codes_of(part: f64) -> i16 {
    (part * 32_768.0) as i16
}
