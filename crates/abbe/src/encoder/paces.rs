//! The steps of time from sample to sample: what they mostly are, and how many steps a gap is long.

use std::collections::BTreeMap;

/// Steps of time that lie within 1/16 of an octave are counted together.
const PARTS_OF_OCTAVE: f64 = 16.0;
/// A longer step than this many usual ones is a gap.
const GAP: f64 = 1.5;
/// Gaps are rare, or there is no usual step: at most one in so many.
const RARE: u64 = 20;

/// Steps of time, counted by their size.
#[derive(Clone, Debug, Default)]
pub(crate) struct Paces {
    /// How many, and their sum in s.
    sizes: BTreeMap<i32, (u64, f64)>,
    count: u64,
}

impl Paces {
    /// One more step, s, above 0.
    pub(crate) fn add(&mut self, step_s: f64) {
        let (count, sum) = self.sizes.entry((step_s.log2() * PARTS_OF_OCTAVE).floor() as i32).or_default();
        *count += 1;
        *sum += step_s;
        self.count += 1;
    }

    /// The usual step, s: the mean of those like the median. None where longer ones are no exception: such times are
    /// written too coarsely, or the samples were not taken at a rate.
    pub(crate) fn usual_s(&self) -> Option<f64> {
        let mut below = 0;
        let (&middle, _) = self.sizes.iter().find(|(_, (count, _))| {
            below += count;
            2 * below >= self.count
        })?;
        let (count, sum) = self
            .sizes
            .range(middle - 1..=middle + 1)
            .fold((0, 0.0), |(counts, sums), (_, (count, sum))| (counts + count, sums + sum));
        let usual_s = sum / count as f64;
        let is_gap = |(count, sum): &&(u64, f64)| sum / *count as f64 > GAP * usual_s;
        let gaps: u64 = self.sizes.values().filter(is_gap).map(|(count, _)| count).sum();
        (gaps * RARE <= self.count).then_some(usual_s)
    }

    /// The longest step that is no gap, s: the mean of those like it.
    pub(crate) fn longest_below_gap_s(&self, usual_s: f64) -> f64 {
        let means = self.sizes.values().map(|(count, sum)| sum / *count as f64);
        means.filter(|mean_s| *mean_s <= GAP * usual_s).fold(0.0, f64::max)
    }
}

/// Samples that did not come in a step of time.
pub(crate) fn missing(step_s: f64, usual_s: f64) -> u64 {
    let steps = step_s / usual_s;
    if steps > GAP { steps.round() as u64 - 1 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_step_is_found_beside_gaps_and_jitter() {
        let mut paces = Paces::default();
        for k in 0..1000_u32 {
            let jitter = f64::from(k % 7) - 3.0;
            paces.add(if k % 100 == 50 { 0.137 } else { 1e-3 + 1e-5 * jitter });
        }
        let usual_s = paces.usual_s().unwrap();
        assert!((usual_s - 1e-3).abs() < 1e-6, "{usual_s}");
        let longest_s = paces.longest_below_gap_s(usual_s);
        assert!((longest_s - 1.03e-3).abs() < 2e-5, "{longest_s}");
        assert_eq!([1e-3, 1.4e-3, 2e-3, 0.137].map(|step_s| missing(step_s, usual_s)), [0, 0, 1, 136]);
    }

    #[test]
    fn times_without_a_rate_have_no_usual_step() {
        let mut coarse = Paces::default();
        (0..1000).for_each(|k| coarse.add(if k % 3 == 0 { 2e-3 } else { 1e-3 }));
        assert_eq!((coarse.usual_s(), Paces::default().usual_s()), (None, None));
    }
}
