//! Paper B's extremes of a channel, but for those that the converter has cut off: where the signal went beyond its end,
//! nobody has seen how far.

use abbe_core::sense::peaks::Peaks;

/// The last maximum and minimum, one after the other, that were both seen whole.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turns {
    peaks: Peaks,
    /// The codes from which on samples are cut off, below and above.
    cuts: [f64; 2],
    whole: Option<(i16, i16)>,
}

impl Turns {
    /// Of a channel that is cut off at `cuts`; see [`Peaks::new`] for the hysteresis.
    pub(crate) fn new(hysteresis: u16, cuts: [f64; 2]) -> Self {
        Self { peaks: Peaks::new(hysteresis), cuts, whole: None }
    }

    /// One sample, cut off or not: it says where the signal turns.
    pub(crate) fn sample(&mut self, code: i16) {
        self.peaks.sample(code);
        let [below, above] = self.cuts;
        let is_whole =
            |&(highest, lowest): &(i16, i16)| f64::from(highest) < above && f64::from(lowest) > below;
        self.whole = self.peaks.extremes().filter(is_whole).or(self.whole);
    }

    /// Offset and amplitude, once both extremes were seen.
    pub(crate) fn circle(&self) -> Option<(f64, f64)> {
        let (highest, lowest) = self.whole?;
        let [highest, lowest] = [highest, lowest].map(f64::from);
        Some((f64::midpoint(highest, lowest), (highest - lowest) / 2.0))
    }
}
