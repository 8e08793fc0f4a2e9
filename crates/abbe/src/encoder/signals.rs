//! The samples as a controller would see them: codes around a middle, through paper B's first limit filter if asked.
//!
//! Codes of a converter stay what they are, counted from its zero. Other numbers are scaled so that the larger channel
//! fills ±30 000: the parts of the controller that count in 16 bits then see the signal to 1/60 000 of it.

use super::paces::missing;
use super::samples::{Fault, Samples};
use super::survey::Survey;
use crate::failure::Failure;
use abbe_core::edge::SinCos;
use abbe_core::sense::limit::SampleLimit;

/// Codes of the larger channel's amplitude where no converter is known.
const AMPLITUDE: f64 = 30_000.0;

/// What turns numbers of the file into codes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    /// The number that is code 0, each channel.
    pub(crate) middle: [f64; 2],
    /// Codes of a unit.
    pub(crate) codes: f64,
    /// The code of no signal, each channel: zero of the converter, or number 0.
    pub(crate) zero: [f64; 2],
}

impl Scale {
    fn of(survey: &Survey) -> Self {
        if let Some(converter) = survey.converter {
            return Self { middle: [converter.zero(); 2], codes: 1.0, zero: [0.0; 2] };
        }
        let middle = survey.channels.map(|channel| channel.middle());
        let [a, b] = survey.channels.map(|channel| channel.half());
        let codes = AMPLITUDE / a.max(b);
        Self { middle, codes, zero: middle.map(|middle| -middle * codes) }
    }

    fn code(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        [(a - self.middle[0]) * self.codes, (b - self.middle[1]) * self.codes]
    }
}

/// A sample in codes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<'l> {
    /// Cosine and sine.
    pub(crate) codes: [f64; 2],
    /// One of them, or both, were cut off.
    pub(crate) cut: [bool; 2],
    /// The limit filter kept the one before in place of it.
    pub(crate) kept: bool,
    /// Samples that the times say are missing before it.
    pub(crate) missing: u64,
    /// Its line in the file.
    pub(crate) line: u64,
    /// The time as the file writes it.
    pub(crate) time: Option<&'l str>,
}

impl Seen<'_> {
    /// It may teach what the signals are like: nothing stands in its place.
    pub(crate) fn is_own(&self) -> bool {
        !self.is_cut() && !self.kept
    }

    /// Either channel was cut off: counts once, whichever it was.
    pub(crate) fn is_cut(&self) -> bool {
        self.cut != [false; 2]
    }
}

/// The samples of a file as codes.
#[derive(Debug)]
pub(crate) struct Signals<'f> {
    /// The file.
    pub(crate) samples: Samples<'f>,
    /// What the first pass found.
    pub(crate) survey: Survey,
    /// Numbers to codes.
    pub(crate) scale: Scale,
    cuts: [[f64; 2]; 2],
    /// The largest step that the limit filter lets pass, codes.
    limit: Option<u16>,
}

impl<'f> Signals<'f> {
    /// The samples of a file; `limit` is the largest step of the limit filter in the unit of the file.
    pub(crate) fn new(samples: Samples<'f>, survey: Survey, limit: Option<f64>) -> Self {
        let scale = Scale::of(&survey);
        let limit = limit.map(|step| (step * scale.codes).ceil().clamp(1.0, f64::from(u16::MAX)) as u16);
        let cuts = survey.cuts();
        Self { samples, survey, scale, cuts, limit }
    }

    /// The codes from which on the samples of each channel are cut off, below and above.
    pub(crate) fn cut_codes(&self) -> [[f64; 2]; 2] {
        let Scale { middle, codes, .. } = self.scale;
        [0, 1].map(|channel| self.cuts[channel].map(|end| (end - middle[channel]) * codes))
    }

    /// Shows every sample to `look`, from the first on.
    ///
    /// # Errors
    /// What is wrong with the file, what `look` says, or Ctrl-C.
    pub(crate) fn each(
        &self,
        advanced: &dyn Fn(u64),
        mut look: impl FnMut(Seen<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut limits = self.limit.map(|largest| [SampleLimit::new(largest); 2]);
        let usual_s = self.survey.usual_s();
        let mut before_s = None;
        let mut count = 0;
        self.samples.each(advanced, |sample| {
            count += 1;
            let cut = [0, 1].map(|channel| {
                let ([low, high], value) = (self.cuts[channel], sample.channels[channel]);
                value <= low || value >= high
            });
            let time_s = sample.time.map(|(t_s, _)| t_s);
            let step_s = time_s.zip(std::mem::replace(&mut before_s, time_s)).map(|(t, before)| t - before);
            let missing = step_s.zip(usual_s).map_or(0, |(step_s, usual_s)| missing(step_s, usual_s));
            let raw = self.scale.code(sample.channels);
            let codes = limits.as_mut().map_or(raw, |limits| passed(limits, raw));
            // A filter that lets a sample pass leaves its fraction of a code alone.
            let kept = [0, 1].map(|channel| (codes[channel] - raw[channel]).abs() > 0.5);
            let codes = [0, 1].map(|channel| if kept[channel] { codes[channel] } else { raw[channel] });
            let kept = kept != [false; 2];
            let time = sample.time.map(|(_, text)| text);
            look(Seen { codes, cut, kept, missing, line: sample.line, time })
        })?;
        if count != self.survey.samples {
            return Err(self.samples.error(None, Fault::Changed).into());
        }
        Ok(())
    }
}

fn passed(limits: &mut [SampleLimit; 2], [a, b]: [f64; 2]) -> [f64; 2] {
    [limits[0].pass(whole(a)), limits[1].pass(whole(b))].map(f64::from)
}

/// The nearest code.
fn whole(code: f64) -> i16 {
    code.round() as i16
}

/// Both channels as whole codes.
pub(crate) fn whole_codes([a, b]: [f64; 2]) -> SinCos {
    SinCos { sin: whole(b), cos: whole(a) }
}
