//! The error inside a period, before and after, and where the figures come from.
//!
//! What is seen of it without knowing the true position: the ellipse says what offsets, gain and quadrature do (exactly,
//! [`Ellipse`]); stretches of a smooth motion say what the phase does beside it ([`super::stretches`]). Where no stretch
//! goes smoothly, the radius must do: a harmonic m of the signal vector moves its length and its phase alike,
//! (m − 1) times a period, so the mean radius over the phase is as large as the phase error, in the same unit, if one
//! harmonic of the signals stands behind each. The fit has taken the first and the second away, so those cannot be seen.

use super::follow::Trail;
use super::method::Learned;
use super::stretches::Agreed;
use abbe_core::sense::ellipse::Ellipse;
use abbe_core::sense::harmonics::Harmonics;
use std::f64::consts::TAU;

/// Places of a period at which a curve is known.
pub(crate) const PLACES: usize = 720;

/// Where figures come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum From {
    /// The fitted ellipse alone.
    Ellipse,
    /// Stretches beside their smooth motion, and the ellipse.
    Motion,
    /// The mean radius over the phase.
    Radius,
    /// Two halves of the stretches, each against the other.
    Halves,
}

impl From {
    /// For documents.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ellipse => "ellipse",
            Self::Motion => "motion",
            Self::Radius => "radius",
            Self::Halves => "halves",
        }
    }
}

/// Peak and rms of an error inside a period, periods.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) peak: f64,
    pub(crate) rms: f64,
    /// Standard deviation of the curve, periods rms, where it is known.
    pub(crate) uncertainty: Option<f64>,
    pub(crate) from: From,
}

/// An error over the phase, periods of periods; its mean is taken off, it only moves the zero.
#[derive(Clone, Debug)]
pub(crate) struct Curve(pub(crate) Vec<f64>);

impl Curve {
    fn of(error: impl Fn(f64) -> f64) -> Self {
        let values = (0..PLACES).map(|place| error(place as f64 / PLACES as f64));
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / PLACES as f64;
        Self(values.into_iter().map(|value| value - mean).collect())
    }

    fn estimate(&self, from: From, uncertainty: Option<f64>) -> Estimate {
        let peak = self.0.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
        let rms = (self.0.iter().map(|value| value * value).sum::<f64>() / PLACES as f64).sqrt();
        Estimate { peak, rms, uncertainty, from }
    }
}

/// What is known of the error inside a period.
#[derive(Clone, Debug)]
pub(crate) struct Inside {
    /// Signals taken as they are; none where the zero lies outside of their ellipse.
    pub(crate) before: Option<(Curve, Estimate)>,
    /// After the method, and the table if there is one; the curve where stretches show it.
    pub(crate) after: Result<(Option<Curve>, Estimate), &'static str>,
}

/// What a table is judged by, if one was learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Table {
    Learned,
    None,
}

impl Inside {
    /// From the pass over the file before any table was taken off. `zero` is the code of no signal, `even` whether the
    /// samples lie at even distances of time.
    pub(crate) fn of(learned: &Learned, zero: [f64; 2], trail: &Trail, even: bool, table: Table) -> Self {
        let agreed = trail.stretches.agreed().ok().filter(|_| even);
        let signals = &learned.signals;
        // A place on the ellipse, and the phase that the method gives it.
        let phase = |turns: f64| learned.taken.turns_at(signals, turns);
        let beside = |turns: f64| agreed.map_or(0.0, |agreed| agreed.harmonics.at(phase(turns)));
        let before = holds(signals, zero).then(|| {
            let plain = Ellipse { p: zero[0], q: zero[1], ..Ellipse::circle(signals.radius) };
            let curve = Curve::of(|turns| {
                let seen = plain.turns_at(signals, turns);
                let true_to = if agreed.is_some() { phase(turns) } else { turns };
                nearest(seen - true_to) + beside(turns)
            });
            let from = if agreed.is_some() { From::Motion } else { From::Ellipse };
            let estimate = curve.estimate(from, agreed.map(|agreed| agreed.uncertainty));
            (curve, estimate)
        });
        let after = match (agreed, table) {
            (Some(agreed), Table::None) => Ok(by_motion(&agreed)),
            (Some(agreed), Table::Learned) => by_halves(&agreed),
            (None, _) => Ok((None, by_radius(learned, trail))),
        };
        Self { before, after }
    }
}

/// The zero lies inside the ellipse, so that the plain phase goes round with the signals.
fn holds(signals: &Ellipse, zero: [f64; 2]) -> bool {
    let [u, v] = signals.straighten(zero[0], zero[1]);
    u.hypot(v) < signals.radius
}

fn by_motion(agreed: &Agreed) -> (Option<Curve>, Estimate) {
    let curve = Curve::of(|turns| agreed.harmonics.at(turns));
    let estimate = curve.estimate(From::Motion, Some(agreed.uncertainty));
    (Some(curve), estimate)
}

fn by_halves(agreed: &Agreed) -> Result<(Option<Curve>, Estimate), &'static str> {
    let left: Harmonics = agreed
        .left
        .ok_or("the table was learned from a single stretch, and nothing is left to judge it by")?;
    let curve = Curve::of(|turns| left.at(turns));
    let estimate = curve.estimate(From::Halves, Some(agreed.uncertainty));
    Ok((Some(curve), estimate))
}

/// What the method leaves of the ellipse, and what the mean radius shows.
fn by_radius(learned: &Learned, trail: &Trail) -> Estimate {
    let of_ellipse = Curve::of(|turns| nearest(learned.taken.turns_at(&learned.signals, turns) - turns))
        .estimate(From::Ellipse, None);
    let means: Vec<f64> = trail.parts.iter().filter_map(super::follow::Part::mean).collect();
    let mean = means.iter().sum::<f64>() / means.len().max(1) as f64;
    let off = || means.iter().map(|value| (value - mean) / TAU);
    let rms = (off().map(|off| off * off).sum::<f64>() / means.len().max(1) as f64).sqrt();
    let fewest = trail.parts.iter().map(|part| part.count).filter(|count| *count > 0).min().unwrap_or(1);
    Estimate {
        peak: of_ellipse.peak + off().fold(0.0_f64, |peak, off| peak.max(off.abs())),
        rms: of_ellipse.rms.hypot(rms),
        uncertainty: Some(trail.radius.deviation() / TAU / (fewest as f64).sqrt()),
        from: From::Radius,
    }
}

/// The part of a period nearest to nothing.
fn nearest(turns: f64) -> f64 {
    turns - turns.round()
}

/// The phase that a correction gives to a place on the ellipse that the signals draw.
trait TurnsAt {
    fn turns_at(&self, signals: &Ellipse, turns: f64) -> f64;
}

impl TurnsAt for Ellipse {
    fn turns_at(&self, signals: &Ellipse, turns: f64) -> f64 {
        let angle = TAU * turns;
        let x = signals.radius * angle.cos() + signals.p;
        let y = signals.radius / signals.r * (angle - signals.alpha).sin() + signals.q;
        self.turns(x, y)
    }
}
