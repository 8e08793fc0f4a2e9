//! Paper B's two limit filters (row B8): one on the samples, one on the subdivision. Both are options.
//!
//! They hide single wild samples. What they hide they also delay: a filter that keeps an old value adds its age to the
//! loop. The health of the signals ([`super::health`]) says what a filter would hide, and is on always.

/// Keeps the last sample when the next is farther from it than allowed: if │Yn − Yn−1│ > ΔY, Yn−1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SampleLimit {
    /// Largest step, converter codes.
    largest: u16,
    last: Option<i16>,
    /// Samples kept in a row.
    kept: u8,
}

/// After so many samples kept in a row the next one is believed: a filter that holds for ever hides motion, too.
const MOST_KEPT: u8 = 3;

impl SampleLimit {
    /// A filter that lets steps up to `largest` codes pass; at P/4 a sample the signal moves by 1.4 amplitudes.
    pub const fn new(largest: u16) -> Self {
        Self { largest, last: None, kept: 0 }
    }

    /// The sample, or the one before it. The paper keeps without end; here at most three in a row.
    #[inline]
    pub fn pass(&mut self, sample: i16) -> i16 {
        let kept = self.last.filter(|&last| sample.abs_diff(last) > self.largest && self.kept < MOST_KEPT);
        self.kept = if kept.is_some() { self.kept.saturating_add(1) } else { 0 };
        let passed = kept.unwrap_or(sample);
        self.last = Some(passed);
        passed
    }
}

/// Steadies the count of the subdivision: a difference of 0 keeps it, of 1 keeps the one before, of more gives the
/// mean of both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CountLimit {
    last: Option<i64>,
}

impl CountLimit {
    /// The steadied count. It stands up to one count behind a slow motion, and the way of a sample behind a fast
    /// one.
    #[inline]
    pub fn pass(&mut self, count: i64) -> i64 {
        let passed = match self.last {
            None => count,
            Some(last) => match count.wrapping_sub(last) {
                -1..=1 => last,
                // The mean, rounded towards the last.
                way => last.wrapping_add(way / 2),
            },
        };
        self.last = Some(passed);
        passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_wild_sample_is_kept_out_and_motion_is_let_in() {
        let mut limit = SampleLimit::new(100);
        assert_eq!([10, 60, 9000, 110, 150].map(|y| limit.pass(y)), [10, 60, 60, 110, 150]);
        assert_eq!([9000, 9010, 9020, 9030, 9040].map(|y| limit.pass(y)), [150, 150, 150, 9030, 9040]);
        assert_eq!([i16::MAX, i16::MIN].map(|y| SampleLimit::new(0).pass(y)), [i16::MAX, i16::MIN]);
    }

    #[test]
    fn one_count_is_kept_and_more_is_halved() {
        let mut limit = CountLimit::default();
        assert_eq!([5, 5, 6, 5, 4].map(|n| limit.pass(n)), [5; 5]);
        assert_eq!([9, 9, 9, -1].map(|n| limit.pass(n)), [7, 8, 8, 4]);
    }
}
