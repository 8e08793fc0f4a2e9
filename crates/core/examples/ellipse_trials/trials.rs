//! Signals of a poor encoder, made up with a seed, and what each method leaves of their error inside a period.
//!
//! Shared by the example that prints tables and by the test that holds the figures.

use abbe_core::edge::SinCos;
use abbe_core::sense::correct::{Correction, Residual};
use abbe_core::sense::ellipse::Ellipse;
use abbe_core::sense::harmonics::Sweep;
use abbe_core::sense::moments::Moments;
use abbe_core::sense::peaks::Peaks;
use abbe_core::sense::periods::Unwrap;
use abbe_core::sense::recursive::{Gather, Recursive, Update};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Period of the signals, nm: paper B's grating.
pub(crate) const PERIOD_NM: f64 = 800.0;
/// Amplitude of the cosine channel, codes of 16 bits.
pub(crate) const AMPLITUDE: f64 = 27_000.0;
/// Offsets of +5 % and −3 %, gain 1.08, quadrature error 4°.
pub(crate) const POOR: Ellipse = Ellipse {
    p: 0.05 * AMPLITUDE,
    q: -0.03 * AMPLITUDE,
    r: 1.0 / 1.08,
    alpha: -4.0 * TAU / 360.0,
    radius: AMPLITUDE,
};

/// How an ellipse is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    /// [`Ellipse::fit`].
    Heydemann,
    /// [`Moments::estimate`].
    Moments,
    /// Paper B's extremes: offsets alone.
    Peaks,
    /// From a circle on, block by block.
    Recursive,
}

impl Method {
    /// All of them, in the order of the tables.
    pub(crate) const ALL: [Self; 4] = [Self::Heydemann, Self::Moments, Self::Peaks, Self::Recursive];

    /// The ellipse that it finds in samples, codes; none where it finds none.
    pub(crate) fn find(self, samples: &[SinCos]) -> Option<Ellipse> {
        match self {
            Self::Heydemann => Ellipse::fit(&sums(samples)).ok(),
            Self::Moments => sums(samples).estimate().ok(),
            Self::Peaks => by_peaks(samples),
            Self::Recursive => by_recursion(samples),
        }
    }
}

fn sums(samples: &[SinCos]) -> Moments {
    Moments::of_all(samples.iter().map(|sample| [f64::from(sample.cos), f64::from(sample.sin)]))
}

fn by_peaks(samples: &[SinCos]) -> Option<Ellipse> {
    let mut peaks = [Peaks::new(AMPLITUDE as u16 / 5); 2];
    for sample in samples {
        peaks[0].sample(sample.cos);
        peaks[1].sample(sample.sin);
    }
    let [p, q] = peaks.map(|peaks| peaks.offset().map(f64::from));
    Some(Ellipse { p: p?, q: q?, ..Ellipse::circle(AMPLITUDE) })
}

fn by_recursion(samples: &[SinCos]) -> Option<Ellipse> {
    let mut recursive = Recursive::new(Ellipse::circle(AMPLITUDE));
    let mut gather = Gather::new([0, 0], AMPLITUDE as u16);
    let mut found = false;
    for sample in samples {
        let polar = recursive.correction().polar(*sample);
        if gather.sample(*sample, polar, recursive.nominal()) {
            found |= !matches!(recursive.update(&gather.take().moments()), Update::Refused(_));
        }
    }
    found.then(|| *recursive.ellipse())
}

/// A signal that goes at a constant speed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// How many samples.
    pub(crate) samples: u32,
    /// Noise of each channel, part of the amplitude.
    pub(crate) noise: f64,
    /// Third harmonic of the signals, part of the amplitude.
    pub(crate) third: f64,
}

impl Motion {
    /// Its samples: 1/50 … 1/9 of a period from one to the next, from any phase on. Another seed, another signal.
    pub(crate) fn samples(self, seed: u64) -> Vec<SinCos> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let (from, speed) = (random.random::<f64>(), 0.02 + 0.09 * random.random::<f64>());
        let places = (0..self.samples).map(|k| from + speed * f64::from(k));
        places
            .map(|turns| {
                let [cos, sin] = self.at(turns);
                let mut noise = || self.noise * AMPLITUDE * random.sample::<f64, _>(StandardNormal);
                SinCos { cos: (cos + noise()).round() as i16, sin: (sin + noise()).round() as i16 }
            })
            .collect()
    }

    /// The signals without noise: each the same wave, the sine a quarter of a period later, then made poor.
    fn at(self, turns: f64) -> [f64; 2] {
        let wave = |angle: f64| angle.cos() + self.third * (3.0 * angle).cos();
        let cos = POOR.radius * wave(turns * TAU) + POOR.p;
        let sin = POOR.radius / POOR.r * wave(turns * TAU - POOR.alpha - TAU / 4.0) + POOR.q;
        [cos, sin]
    }

    /// Peak error inside a period that a correction leaves, nm, the mean taken off.
    pub(crate) fn left_nm(self, correction: &Correction, table: &Residual) -> f64 {
        const PLACES: u32 = 720;
        let off: Vec<f64> = (0..PLACES)
            .map(|place| {
                let turns = f64::from(place) / f64::from(PLACES);
                let [cos, sin] = self.at(turns).map(|code| code.round() as i16);
                let off = table.take_off(correction.polar(SinCos { sin, cos }).phase).turns() - turns;
                (off - off.round()) * PERIOD_NM
            })
            .collect();
        let mean = off.iter().sum::<f64>() / f64::from(PLACES);
        off.iter().fold(0.0, |peak: f64, off| peak.max((off - mean).abs()))
    }

    /// Peak error that each of `trials` signals keeps, nm, ascending; none where the method finds nothing.
    pub(crate) fn trials(self, method: Method, trials: u64) -> Option<Vec<f64>> {
        let one = |seed| {
            let ellipse = method.find(&self.samples(seed))?;
            Some(self.left_nm(&Correction::of(&ellipse), &Residual::NONE))
        };
        let mut left: Vec<f64> = (0..trials).map(one).collect::<Option<_>>()?;
        left.sort_by(f64::total_cmp);
        Some(left)
    }

    /// The same with the ellipse fitted and, `with` it, the harmonics learned from the same samples.
    pub(crate) fn sweeps(self, with: bool, trials: u64) -> Option<Vec<f64>> {
        let one = |seed| {
            let samples = self.samples(seed);
            let correction = Correction::of(&Method::Heydemann.find(&samples)?);
            let table = if with { learned(&samples, &correction)? } else { Residual::NONE };
            Some(self.left_nm(&correction, &table))
        };
        let mut left: Vec<f64> = (0..trials).map(one).collect::<Option<_>>()?;
        left.sort_by(f64::total_cmp);
        Some(left)
    }
}

fn learned(samples: &[SinCos], correction: &Correction) -> Option<Residual> {
    let (mut unwrap, mut sweep) = (Unwrap::default(), Sweep::default());
    for sample in samples {
        sweep.add(unwrap.next(correction.polar(*sample).phase).position);
    }
    Some(sweep.learn().ok()?.0.residual())
}

/// Mean of all.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// What 95 of 100 stay below; the values ascend.
pub(crate) fn p95(values: &[f64]) -> f64 {
    values[(values.len() * 95).div_ceil(100) - 1]
}
