//! The first pass: what the samples reach, and whether they were cut off there.

use super::paces::Paces;
use super::rails::Channel;
use super::samples::{CHANNELS, Fault, Sample, Samples, SamplesError};
use crate::failure::Failure;

/// Steps of time that differ by more than this part are not even.
const UNEVEN: f64 = 0.1;

/// The times of the samples, s.
#[derive(Clone, Debug)]
pub(crate) struct Times {
    first: f64,
    last: f64,
    shortest: f64,
    paces: Paces,
}

/// How a converter writes its codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coding {
    /// 0 … 2ⁿ − 1; the middle is 2ⁿ⁻¹.
    Unsigned,
    /// −2ⁿ⁻¹ … 2ⁿ⁻¹ − 1.
    Signed,
}

/// A converter whose codes the samples are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Converter {
    /// Its resolution.
    pub(crate) bits: u32,
    /// How it writes its codes.
    pub(crate) coding: Coding,
}

impl Converter {
    /// The lowest and the highest code.
    pub(crate) fn ends(self) -> [f64; 2] {
        let half = f64::from(1 << (self.bits - 1));
        match self.coding {
            Coding::Unsigned => [0.0, 2.0 * half - 1.0],
            Coding::Signed => [-half, half - 1.0],
        }
    }

    /// The code of no signal.
    pub(crate) fn zero(self) -> f64 {
        let half = f64::from(1 << (self.bits - 1));
        if self.coding == Coding::Unsigned { half } else { 0.0 }
    }
}

/// What the first pass found.
#[derive(Clone, Debug)]
pub(crate) struct Survey {
    /// How many samples.
    pub(crate) samples: u64,
    /// Cosine and sine.
    pub(crate) channels: [Channel; 2],
    /// Their times.
    pub(crate) times: Option<Times>,
    /// The converter, where its bits were given.
    pub(crate) converter: Option<Converter>,
}

impl Survey {
    /// Looks through a file; `bits` says that its numbers are codes of a converter.
    ///
    /// # Errors
    /// What is wrong with the file; too few samples; a channel that stands still.
    pub(crate) fn of(
        samples: &Samples<'_>,
        bits: Option<u32>,
        advanced: &dyn Fn(u64),
    ) -> Result<Self, Failure> {
        let mut survey = Self { samples: 0, channels: [Channel::NONE; 2], times: None, converter: None };
        let mut codes = bits.map(Codes::new);
        samples.each(advanced, |sample| {
            let here = |fault| samples.error(Some(sample.line), fault);
            if let Some(codes) = &mut codes {
                codes.see(&sample).map_err(here)?;
            }
            survey.see(&sample).map_err(here)?;
            Ok(())
        })?;
        survey.converter = codes.map(|codes| codes.converter());
        survey.check(samples)?;
        Ok(survey)
    }

    fn see(&mut self, sample: &Sample<'_>) -> Result<(), Fault> {
        self.samples += 1;
        let [a, b] = sample.channels;
        let others = [self.channels[1].part(b), self.channels[0].part(a)];
        for ((channel, value), other) in self.channels.iter_mut().zip(sample.channels).zip(others) {
            channel.see(value, other);
        }
        let Some((t_s, _)) = sample.time else { return Ok(()) };
        let times = self.times.get_or_insert(Times {
            first: t_s,
            last: f64::NAN,
            shortest: f64::INFINITY,
            paces: Paces::default(),
        });
        let before_s = std::mem::replace(&mut times.last, t_s);
        if t_s <= before_s {
            return Err(Fault::NotAscending { t_s, before_s });
        }
        // Of the first sample it is no number, which it does not take.
        times.shortest = times.shortest.min(t_s - before_s);
        if !before_s.is_nan() {
            times.paces.add(t_s - before_s);
        }
        Ok(())
    }

    fn check(&self, samples: &Samples<'_>) -> Result<(), SamplesError> {
        match self.samples {
            0 => return Err(samples.error(None, Fault::NoSamples)),
            count @ 1..=4 => return Err(samples.error(None, Fault::TooFew { samples: count })),
            _ => {}
        }
        for (channel, column) in self.channels.iter().zip(CHANNELS) {
            let (half, value) = (channel.half(), channel.low.value);
            if half <= 1e-12 * channel.middle().abs() || half < f64::MIN_POSITIVE * 1e9 {
                return Err(samples.error(None, Fault::Constant { column, value }));
            }
        }
        Ok(())
    }

    /// The value from which on the samples of each channel are cut off, below and above; without end where they are
    /// not.
    pub(crate) fn cuts(&self) -> [[f64; 2]; 2] {
        self.channels.map(|channel| {
            let [lowest, highest] =
                self.converter.map_or([f64::NEG_INFINITY, f64::INFINITY], Converter::ends);
            let low = if channel.low.is_cut() { channel.low.value } else { lowest };
            let high = if channel.high.is_cut() { channel.high.value } else { highest };
            [low, high]
        })
    }

    /// The usual step of time, s, where there is one.
    pub(crate) fn usual_s(&self) -> Option<f64> {
        self.times.as_ref().and_then(|times| times.paces.usual_s())
    }

    /// Samples a second, where there are times.
    pub(crate) fn rate_hz(&self) -> Option<f64> {
        let times = self.times.as_ref()?;
        let mean_hz = (self.samples - 1) as f64 / (times.last - times.first);
        Some(times.paces.usual_s().map_or(mean_hz, f64::recip))
    }

    /// The samples lie at even distances of time, as far as is known; gaps of missing ones do not count.
    pub(crate) fn is_even(&self) -> bool {
        self.times.as_ref().is_none_or(|times| {
            times.paces.usual_s().is_some_and(|usual_s| {
                let longest_s = times.paces.longest_below_gap_s(usual_s);
                (longest_s - usual_s).max(usual_s - times.shortest) <= UNEVEN * usual_s
            })
        })
    }
}

/// Whether numbers are codes, and written how.
struct Codes {
    bits: u32,
    negative: bool,
    above: bool,
}

impl Codes {
    const fn new(bits: u32) -> Self {
        Self { bits, negative: false, above: false }
    }

    fn see(&mut self, sample: &Sample<'_>) -> Result<(), Fault> {
        let half = f64::from(1 << (self.bits - 1));
        for (value, column) in sample.channels.into_iter().zip(CHANNELS) {
            self.negative |= value < 0.0;
            self.above |= value >= half;
            let allowed = value.fract() == 0.0 && value >= -half && value < 2.0 * half;
            if !allowed || (self.negative && self.above) {
                let [top, signed] = [2.0 * half - 1.0, half - 1.0];
                let range = format!("whole, and all of them 0 … {top} or all of them −{half} … {signed}");
                return Err(Fault::NoCode { column, value, bits: self.bits, range });
            }
        }
        Ok(())
    }

    fn converter(&self) -> Converter {
        let coding = if self.negative { Coding::Signed } else { Coding::Unsigned };
        Converter { bits: self.bits, coding }
    }
}
