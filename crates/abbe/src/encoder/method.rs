//! The second pass: the ellipse that the signals draw, and what a method takes off them.

use super::samples::Fault;
use super::signals::{Seen, Signals, whole_codes};
use super::turns::Turns;
use crate::cli::Method;
use crate::failure::Failure;
use abbe_core::sense::ellipse::{Ellipse, FitError};
use abbe_core::sense::moments::Moments;
use abbe_core::sense::periods::Unwrap;
use abbe_core::sense::phase::Phase;
use abbe_core::sense::recursive::{FASTEST, Gather, Recursive, Update};

/// A turn counts beyond this part of the way between the extremes.
const HYSTERESIS: f64 = 0.1;

/// Means and variances that are farther than this from the fitted ellipse, parts of its radius, are those of an uneven
/// cover: 5.1 nm of 0.8 µm. Eight periods and a half stay within it.
const UNEVEN: f64 = 0.04;

/// What the second pass found.
#[derive(Clone, Debug)]
pub(crate) struct Learned {
    /// The ellipse that fits all samples best, whatever the method; codes.
    pub(crate) signals: Ellipse,
    /// What the method takes off, at the end of the file; codes.
    pub(crate) taken: Ellipse,
    /// Samples cut off in each channel.
    pub(crate) cut: [u64; 2],
    /// Samples cut off in either.
    pub(crate) cut_samples: u64,
    /// Samples in place of which the limit filter kept another.
    pub(crate) kept: u64,
    /// The recursion as it is where it first fits.
    running: Option<Recursive>,
}

/// Corrects one sample after another.
#[derive(Debug)]
pub(crate) enum Corrector {
    /// The same ellipse all the way, in floats.
    Fixed(Ellipse),
    /// One that follows the signals, in the controller's whole numbers.
    Running(Box<Runner>),
}

/// The recursion over a file.
#[derive(Clone, Debug)]
pub(crate) struct Runner {
    recursive: Recursive,
    gather: Gather,
    /// Samples of a slow motion alone are gathered.
    way: Unwrap,
    first: Option<Recursive>,
}

impl Learned {
    /// Learns from all samples that were not cut off, and in whose place the limit filter kept no other.
    ///
    /// # Errors
    /// The signals draw no ellipse that can be found, by fit or by the method.
    pub(crate) fn of(signals: &Signals<'_>, method: Method, advanced: &dyn Fn(u64)) -> Result<Self, Failure> {
        let mut pupil = Pupil::new(signals);
        signals.each(advanced, |seen| {
            pupil.see(&seen, method);
            Ok(())
        })?;
        let no_answer = |reason: &str| signals.samples.error(None, Fault::NoFit(pupil.reason(reason)));
        let refused = |error: FitError| no_answer(&error.to_string());
        let ellipse = Ellipse::fit(&pupil.moments).map_err(refused)?;
        let taken = match method {
            Method::Heydemann => ellipse,
            Method::Moments => {
                let found = pupil.moments.estimate().map_err(refused)?;
                let [offset, shape] = differ(&found, &ellipse);
                if offset.max(shape) > UNEVEN {
                    return Err(no_answer(&format!(
                        "--method moments is right only for samples that cover whole periods evenly, and these do not: beside the fitted ellipse its offsets are {:.1} % of the amplitude off, gain and quadrature {:.1} %; take --method heydemann",
                        100.0 * offset, 100.0 * shape
                    )).into());
                }
                found
            }
            Method::Peaks => pupil.turned().ok_or_else(|| {
                no_answer("no maximum and minimum of both channels were passed, which --method peaks needs")
            })?,
            Method::Recursive => *pupil.runner.recursive.ellipse(),
            Method::None => {
                let [p, q] = signals.scale.zero;
                Ellipse { p, q, ..Ellipse::circle(ellipse.radius) }
            }
        };
        let running = (method == Method::Recursive)
            .then(|| {
                pupil.runner.first.ok_or_else(|| {
                    no_answer(
                        "--method recursive needs 400 samples that go all the way round at 1/128 … 1/8 of a period a sample, and takes every other one; there are not so many",
                    )
                })
            })
            .transpose()?;
        Ok(Self {
            signals: ellipse,
            taken,
            cut: pupil.cut,
            cut_samples: pupil.cut_samples,
            kept: pupil.kept,
            running,
        })
    }

    /// A corrector at the beginning of the file.
    pub(crate) fn corrector(&self) -> Corrector {
        match &self.running {
            Some(recursive) => Corrector::Running(Box::new(Runner::new(*recursive))),
            None => Corrector::Fixed(self.taken),
        }
    }
}

/// All that learns in one pass.
struct Pupil {
    moments: Moments,
    turns: [Turns; 2],
    runner: Runner,
    cut: [u64; 2],
    cut_samples: u64,
    kept: u64,
}

impl Pupil {
    fn new(signals: &Signals<'_>) -> Self {
        let (scale, channels) = (&signals.scale, &signals.survey.channels);
        let middle = [0, 1].map(|c| (channels[c].middle() - scale.middle[c]) * scale.codes);
        let half = channels.map(|channel| channel.half() * scale.codes);
        let hysteresis = half.map(|half| (2.0 * HYSTERESIS * half).round() as u16);
        let cuts = signals.cut_codes();
        let rough = Ellipse { p: middle[0], q: middle[1], r: half[0] / half[1], alpha: 0.0, radius: half[0] };
        Self {
            moments: Moments::around(middle),
            turns: [0, 1].map(|channel| Turns::new(hysteresis[channel], cuts[channel])),
            runner: Runner::new(Recursive::new(rough)),
            cut: [0; 2],
            cut_samples: 0,
            kept: 0,
        }
    }

    fn see(&mut self, seen: &Seen<'_>, method: Method) {
        self.kept += u64::from(seen.kept);
        self.cut.iter_mut().zip(seen.cut).for_each(|(count, cut)| *count += u64::from(cut));
        self.cut_samples += u64::from(seen.is_cut());
        if seen.is_own() {
            self.moments.add(seen.codes);
        }
        match method {
            // What was cut off says at least where the signal turns; what the filter put there says nothing.
            Method::Peaks if seen.kept => {}
            Method::Peaks => {
                let codes = whole_codes(seen.codes);
                self.turns
                    .iter_mut()
                    .zip([codes.cos, codes.sin])
                    .for_each(|(turns, code)| turns.sample(code));
            }
            Method::Recursive => _ = self.runner.sample(seen),
            Method::Heydemann | Method::Moments | Method::None => {}
        }
    }

    /// Offsets by paper B's extremes, and nothing else.
    fn turned(&self) -> Option<Ellipse> {
        let [(p, radius), (q, _)] = [self.turns[0].circle()?, self.turns[1].circle()?];
        Some(Ellipse { p, q, ..Ellipse::circle(radius) })
    }

    fn reason(&self, reason: &str) -> String {
        match (self.cut_samples, self.kept) {
            (0, 0) => reason.into(),
            (cut, 0) => format!("{reason} ({cut} samples at full scale were left out)"),
            (0, kept) => format!(
                "{reason} ({kept} samples were left out, in whose place --limit-samples kept another)"
            ),
            (cut, kept) => format!(
                "{reason} ({cut} samples at full scale were left out, and {kept} in whose place --limit-samples kept another)"
            ),
        }
    }
}

impl Runner {
    fn new(recursive: Recursive) -> Self {
        let ellipse = recursive.ellipse();
        let centre = [ellipse.p, ellipse.q].map(|offset| offset.round() as i16);
        let gather = Gather::new(centre, ellipse.radius.round() as u16);
        Self { recursive, gather, way: Unwrap::default(), first: None }
    }

    fn sample(&mut self, seen: &Seen<'_>) -> Phase {
        let sample = whole_codes(seen.codes);
        let polar = self.recursive.correction().polar(sample);
        self.way.next(polar.phase);
        // As in the tick: what the converter has cut off draws no ellipse, and a fast motion a skewed one.
        let worth = seen.is_own() && self.way.is_slower_than(FASTEST);
        if worth && self.gather.sample(sample, polar, self.recursive.nominal()) {
            let update = self.recursive.update(&self.gather.take().moments());
            if !matches!(update, Update::Refused(_)) {
                self.first.get_or_insert(self.recursive);
            }
        }
        polar.phase
    }
}

impl Corrector {
    /// The phase of the next sample.
    pub(crate) fn sample(&mut self, seen: &Seen<'_>) -> Phase {
        match self {
            Self::Fixed(ellipse) => phase_of(ellipse.turns(seen.codes[0], seen.codes[1])),
            Self::Running(runner) => runner.sample(seen),
        }
    }
}

/// How far two ellipses are apart, parts of the second's radius: offsets; and gain or angle, whichever is more.
fn differ(one: &Ellipse, other: &Ellipse) -> [f64; 2] {
    let offset = (one.p - other.p).hypot((one.q - other.q) * other.r) / other.radius;
    [offset, (one.r / other.r - 1.0).abs().max((one.alpha - other.alpha).abs())]
}

/// Turns as a phase.
pub(crate) fn phase_of(turns: f64) -> Phase {
    Phase((turns * 4_294_967_296.0).round() as i64 as u32)
}
