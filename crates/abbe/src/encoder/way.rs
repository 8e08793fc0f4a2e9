//! From phases to positions, over gaps too: samples that are missing, and such as are too short to have a phase.
//!
//! Each sample is expected where those before it point, and taken as the place of its phase that is nearest to it. Over a
//! gap the speed is that of as many samples before it as the gap has, 64 at most: the noise of two samples alone, times
//! the length of a long gap, would be periods. Whether the speed has held is seen behind the gap; if it has changed so
//! much that the expectation may be half a period out, nobody knows the positions from there on.

use abbe_core::sense::health::SURPRISE;
use abbe_core::sense::periods::Periods;
use abbe_core::sense::phase::Phase;
use std::collections::VecDeque;

/// Samples that tell the speed beside a gap, at most. A longer gap than this must be shorter than what was seen in one
/// piece before it, or nothing says that the speed has held.
const REACH: usize = 64;
/// Follows phases.
#[derive(Debug, Default)]
pub(crate) struct Way {
    /// Found since the last gap; the last ones.
    recent: VecDeque<Periods>,
    /// Way of a sample, where `recent` does not tell it.
    speed: i64,
    /// Found in all, and since the last gap.
    found: u64,
    in_one_piece: u64,
    /// Samples without a phase, or missing, since the last one found.
    open: u64,
    /// The last gap, until enough samples behind it say what it was like.
    gap: Option<Gap>,
    /// All that were crossed.
    pub(crate) gaps: Gaps,
}

/// Where a sample is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub(crate) position: Periods,
    /// From the expected to the found position, 2⁻³² of a period; none behind a gap, and where nothing was expected.
    pub(crate) surprise: Option<i32>,
    /// Nothing is missing before it, and it has a phase.
    pub(crate) is_whole: bool,
}

#[derive(Clone, Copy, Debug)]
struct Gap {
    samples: u64,
    /// Way of a sample before it.
    before: i64,
    surprise: i32,
    line: u64,
    /// It was longer than what was seen before it.
    is_blind: bool,
}

/// What is to be said of gaps.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gaps {
    /// Samples that the times say are missing; in how many places; the first line behind such a place.
    pub(crate) missing: u64,
    pub(crate) places: u64,
    pub(crate) missing_before: Option<u64>,
    /// Samples without a phase, and the line of the first.
    pub(crate) short: u64,
    pub(crate) short_from: Option<u64>,
    /// By how much an expectation behind a gap may have been out, periods; the most.
    pub(crate) doubt: f64,
    /// The first line from which on periods may have been lost.
    pub(crate) lost_from: Option<u64>,
    /// The longest gap, in samples that told the speed before it; and the line behind it.
    pub(crate) longest: (f64, u64),
}

impl Way {
    /// The next sample, `missing` samples after the one before; a short one has no phase, and is where it is expected.
    pub(crate) fn next(&mut self, phase: Phase, missing: u64, is_short: bool, line: u64) -> Placed {
        self.gaps.see(missing, is_short, line);
        let Some(&last) = self.recent.back() else {
            let position = Periods(i64::from(phase.0));
            if !is_short {
                self.keep(position);
            }
            return Placed { position, surprise: None, is_whole: !is_short };
        };
        let gap = self.open.saturating_add(missing);
        let (speed, told_by) = self.speed(gap);
        let way = i128::from(speed) * (i128::from(gap) + 1);
        let expected = Periods(last.0.wrapping_add(way as i64));
        if is_short {
            self.open = gap.saturating_add(1);
            return Placed { position: expected, surprise: None, is_whole: false };
        }
        let position = expected.nearest(phase);
        let surprise = position.way_from(expected) as i32;
        if gap > 0 {
            self.judge();
            self.gaps.reach(gap as f64 / told_by as f64, line);
            let is_blind = gap > self.in_one_piece.max(REACH as u64);
            self.gap = Some(Gap { samples: gap, before: speed, surprise, line, is_blind });
            self.speed = (i128::from(position.way_from(last)) / (i128::from(gap) + 1)) as i64;
            self.recent.clear();
            (self.open, self.in_one_piece) = (0, 0);
        }
        let expects = gap == 0 && self.found >= 2;
        self.keep(position);
        Placed { position, surprise: expects.then_some(surprise), is_whole: gap == 0 }
    }

    fn keep(&mut self, position: Periods) {
        self.recent.push_back(position);
        if self.recent.len() > REACH + 1 {
            self.recent.pop_front();
        }
        self.found += 1;
        self.in_one_piece += 1;
        if self.gap.is_some_and(|gap| self.recent.len() as u64 > gap.samples.min(REACH as u64)) {
            self.judge();
        }
    }

    /// Way of a sample beside a gap of so many, and how many steps have told it.
    fn speed(&self, gap: u64) -> (i64, usize) {
        let steps = (gap.clamp(1, REACH as u64) as usize).min(self.recent.len().saturating_sub(1));
        let from = self.recent.iter().rev().nth(steps);
        match (from, self.recent.back()) {
            (Some(from), Some(last)) if steps > 0 => (last.way_from(*from) / steps as i64, steps),
            _ => (self.speed, 1),
        }
    }

    /// What the samples behind the last gap say of it: a speed that has changed by Δ on the way was Δ/2 off in the mean.
    fn judge(&mut self) {
        let Some(gap) = self.gap.take() else { return };
        let (after, _) = self.speed(gap.samples);
        let off = gap.samples as f64 * Periods(after.wrapping_sub(gap.before)).turns().abs() / 2.0;
        let doubt = off.max(Phase(gap.surprise.unsigned_abs()).turns());
        self.gaps.doubt = self.gaps.doubt.max(doubt);
        if gap.is_blind || doubt > SURPRISE.fail {
            self.gaps.lost_from.get_or_insert(gap.line);
        }
    }

    /// The gaps, the last one too.
    pub(crate) fn end(mut self) -> Gaps {
        self.judge();
        self.gaps
    }
}

impl Gaps {
    fn see(&mut self, missing: u64, is_short: bool, line: u64) {
        if missing > 0 {
            self.missing = self.missing.saturating_add(missing);
            self.places += 1;
            self.missing_before.get_or_insert(line);
        }
        if is_short {
            self.short += 1;
            self.short_from.get_or_insert(line);
        }
    }

    fn reach(&mut self, length: f64, line: u64) {
        if length > self.longest.0 {
            self.longest = (length, line);
        }
    }

    /// The first line from which on periods may have been lost, with positions known to `noise` periods rms: the speed
    /// before a gap is known to √2 of it over the samples that told it, and twice that may be out.
    pub(crate) fn lost_from(&self, noise: f64) -> Option<u64> {
        let (length, line) = self.longest;
        let by_noise = (2.0 * 2_f64.sqrt() * noise * length > SURPRISE.fail).then_some(line);
        self.lost_from.into_iter().chain(by_noise).min()
    }
}
