//! The third pass: phases followed to positions, and what they tell on the way.

use super::method::{Corrector, Learned, phase_of};
use super::signals::Seen;
use super::stretches::Stretches;
use super::way::{Gaps, Placed, Way};
use abbe_core::sense::correct::Residual;
use abbe_core::sense::health::{SHORT, SURPRISE, WEAKNESS};
use abbe_core::sense::limit::CountLimit;
use abbe_core::sense::periods::Periods;
use abbe_core::sense::phase::Phase;
use abbe_core::sense::subdivide::Subdivider;
use std::f64::consts::TAU;

/// Parts of a period in which the radius is averaged.
pub(crate) const PARTS: usize = 64;
/// Samples over which the radius is averaged to find weak places.
const PATCH: u32 = 64;
/// Samples kept for the picture, at most twice as many.
const POINTS: usize = 4000;

/// Counts of a subdivided period.
#[derive(Debug)]
pub(crate) struct Counts {
    table: Subdivider,
    /// Paper B's second limit filter.
    limit: Option<CountLimit>,
}

impl Counts {
    /// Counts by a table, through the limit filter if asked.
    pub(crate) fn new(table: Subdivider, limited: bool) -> Self {
        Self { table, limit: limited.then(CountLimit::default) }
    }

    /// The position in periods that a counter of these steps shows.
    fn read(&mut self, position: Periods) -> f64 {
        let (phase, factor) = (position.phase(), i64::from(self.table.factor()));
        let (sin, cos) = (TAU * phase.turns()).sin_cos();
        let step = self.table.step((sin * AMPLITUDE) as i32, (cos * AMPLITUDE) as i32);
        // The step may round up into the next period: then it is 0 there.
        let whole = position.0 >> 32;
        let carried = step == 0 && phase.turns() > 0.5;
        let count = (whole + i64::from(carried)) * factor + i64::from(step);
        let count = self.limit.as_mut().map_or(count, |limit| limit.pass(count));
        count as f64 / factor as f64
    }
}

/// As long as the table takes: 2²⁹.
const AMPLITUDE: f64 = 536_870_912.0;

/// The mean and the spread of what comes by.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Spread {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Spread {
    /// One more value (Welford, 1962).
    fn add(&mut self, value: f64) {
        self.count += 1;
        let off = value - self.mean;
        self.mean += off / self.count as f64;
        self.squares += off * (value - self.mean);
    }

    /// Standard deviation.
    pub(crate) fn deviation(&self) -> f64 {
        if self.count == 0 { 0.0 } else { (self.squares / self.count as f64).sqrt() }
    }
}

/// The median of magnitudes without keeping them: counted in steps of 1 % over all that a phase can do.
#[derive(Clone, Debug)]
struct Median {
    counts: Vec<u64>,
    total: u64,
}

impl Median {
    const STEPS: f64 = 64.0;

    fn new() -> Self {
        Self { counts: vec![0; 33 * Self::STEPS as usize], total: 0 }
    }

    fn add(&mut self, magnitude: u32) {
        let place = (f64::from(magnitude).max(1.0).log2() * Self::STEPS) as usize;
        // Nothing at all has a place of its own, the first; one unit shares the second with nobody.
        let place = if magnitude == 0 { 0 } else { place + 1 };
        self.counts[place] += 1;
        self.total += 1;
    }

    fn value(&self) -> f64 {
        let mut below = 0;
        let middle = self.counts.iter().position(|count| {
            below += count;
            2 * below >= self.total
        });
        match middle {
            None | Some(0) => 0.0,
            Some(place) => ((place as f64 - 0.5) / Self::STEPS).exp2(),
        }
    }
}

/// The mean radius in one part of the period.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Part {
    /// Samples that fell into it.
    pub(crate) count: u64,
    sum: f64,
}

impl Part {
    /// The mean radius, as part of the circle's.
    pub(crate) fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}

/// Follows the samples of a file.
#[derive(Debug)]
pub(crate) struct Follow<'l> {
    learned: &'l Learned,
    corrector: Corrector,
    table: Option<&'l Residual>,
    way: Way,
    seen: Trail,
}

/// What a pass over the file leaves.
#[derive(Debug)]
pub(crate) struct Trail {
    /// How many samples.
    pub(crate) samples: u64,
    /// Periods from the lowest to the highest position, the first, the last.
    pub(crate) lowest: f64,
    pub(crate) highest: f64,
    pub(crate) first: f64,
    pub(crate) last: f64,
    /// The largest way from one sample to the next, periods.
    pub(crate) largest_step: f64,
    /// The largest distance of a sample from where the two before it pointed, periods.
    pub(crate) largest_surprise: f64,
    /// The line of the first that was so far off that periods may have been lost.
    pub(crate) lost_from: Option<u64>,
    /// Samples that were missing, or too short to have a phase.
    pub(crate) gaps: Gaps,
    /// Distance of the samples from the ellipse, as part of its radius.
    pub(crate) radius: Spread,
    /// The same, in parts of the period.
    pub(crate) parts: [Part; PARTS],
    /// The weakest patch's mean radius, as part of the ellipse's.
    pub(crate) weakest: f64,
    /// Samples too weak to be learned from: see [`WEAKNESS`].
    pub(crate) weak: u64,
    /// Harmonics of the phase beside a smooth motion.
    pub(crate) stretches: Stretches,
    /// Some of the samples, codes.
    pub(crate) points: Points,
    surprises: Median,
    before: Option<Periods>,
    patch: (u32, f64),
}

/// Some samples, evenly taken from all.
#[derive(Debug)]
pub(crate) struct Points {
    /// Cosine and sine, codes.
    pub(crate) taken: Vec<(f64, f64)>,
    every: u64,
}

impl Points {
    fn see(&mut self, number: u64, [a, b]: [f64; 2]) {
        if !number.is_multiple_of(self.every) {
            return;
        }
        self.taken.push((a, b));
        if self.taken.len() >= 2 * POINTS {
            let mut kept = false;
            self.taken.retain(|_| {
                kept = !kept;
                kept
            });
            self.every *= 2;
        }
    }
}

impl<'l> Follow<'l> {
    /// From the first sample on; `table` is taken off the phase after the ellipse. Harmonics are learned where the motion
    /// is not slower than `floor`, periods a sample.
    pub(crate) fn new(learned: &'l Learned, table: Option<&'l Residual>, floor: f64) -> Self {
        Self { learned, corrector: learned.corrector(), table, way: Way::default(), seen: Trail::new(floor) }
    }

    /// The next sample; its position.
    pub(crate) fn sample(&mut self, seen: &Seen<'_>) -> Periods {
        let phase = self.corrector.sample(seen);
        let phase = self.table.map_or(phase, |table| table.take_off(phase));
        let [u, v] = self.learned.signals.straighten(seen.codes[0], seen.codes[1]);
        let radius = u.hypot(v) / self.learned.signals.radius;
        let placed = self.way.next(phase, seen.missing, radius < SHORT, seen.line);
        self.seen.place(placed, seen.line);
        let is_weak = radius <= 1.0 - WEAKNESS.warn;
        self.seen.weak += u64::from(is_weak);
        self.seen.stretches.add(placed, seen.is_own() && !is_weak);
        self.seen.vector([u, v], radius);
        self.seen.points.see(self.seen.samples, seen.codes);
        self.seen.samples += 1;
        placed.position
    }

    /// What was seen on the way.
    pub(crate) fn end(mut self) -> Trail {
        self.seen.stretches.end();
        self.seen.gaps = self.way.end();
        self.seen
    }
}

/// What a counter of `counts` shows at a position, or the position itself; periods.
pub(crate) fn shown(position: Periods, counts: Option<&mut Counts>) -> f64 {
    counts.map_or_else(|| position.turns(), |counts| counts.read(position))
}

impl Trail {
    fn new(floor: f64) -> Self {
        Self {
            samples: 0,
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            first: 0.0,
            last: 0.0,
            largest_step: 0.0,
            largest_surprise: 0.0,
            lost_from: None,
            gaps: Gaps::default(),
            radius: Spread::default(),
            parts: [Part::default(); PARTS],
            weakest: f64::INFINITY,
            weak: 0,
            stretches: Stretches::faster_than(floor),
            points: Points { taken: Vec::new(), every: 1 },
            surprises: Median::new(),
            before: None,
            patch: (0, 0.0),
        }
    }

    fn place(&mut self, Placed { position, surprise, is_whole }: Placed, line: u64) {
        let turns = position.turns();
        self.lowest = self.lowest.min(turns);
        self.highest = self.highest.max(turns);
        self.last = turns;
        match self.before.replace(position) {
            None => self.first = turns,
            Some(_) if !is_whole => {}
            Some(before) => {
                let step = Periods(position.way_from(before)).turns().abs();
                self.largest_step = self.largest_step.max(step);
            }
        }
        if let Some(surprise) = surprise.map(i32::unsigned_abs) {
            let turns = Phase(surprise).turns();
            self.largest_surprise = self.largest_surprise.max(turns);
            self.surprises.add(surprise);
            if turns > SURPRISE.fail {
                self.lost_from.get_or_insert(line);
            }
        }
    }

    /// A vector around the middle of the circle, and its length as part of the radius.
    fn vector(&mut self, [u, v]: [f64; 2], radius: f64) {
        self.radius.add(radius);
        let part = (phase_of(v.atan2(u) / TAU).0 >> 26) as usize;
        self.parts[part].count += 1;
        self.parts[part].sum += radius;
        let (count, sum) = &mut self.patch;
        *count += 1;
        *sum += radius;
        if *count == PATCH {
            self.weakest = self.weakest.min(*sum / f64::from(PATCH));
            self.patch = (0, 0.0);
        }
    }

    /// Noise of a position, periods rms, from the second differences of the positions: white noise makes them √6 times
    /// as large, and their median magnitude is 0.6745 of that. Constant speed does not touch them, single wild samples
    /// hardly do.
    pub(crate) fn noise(&self) -> f64 {
        self.surprises.value() / 4_294_967_296.0 / 0.6745 / 6_f64.sqrt()
    }

    /// Parts of the period that were seen.
    pub(crate) fn parts_seen(&self) -> usize {
        self.parts.iter().filter(|part| part.count > 0).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_right_to_a_hundredth() {
        let mut median = Median::new();
        (1..=100_001_u32).for_each(|value| median.add(value * 7));
        assert!((median.value() / 350_007.0 - 1.0).abs() < 0.01, "{}", median.value());
        let mut still = Median::new();
        for value in [0, 0, 0, 5] {
            still.add(value);
        }
        assert_eq!(still.value(), 0.0);
        assert_eq!(Median::new().value(), 0.0);
        median.add(u32::MAX);
    }

    #[test]
    fn counts_are_the_nearest_steps_and_go_on_over_the_end_of_a_period() {
        let mut counts = Counts::new(Subdivider::new(160).unwrap(), false);
        for k in -5000..5000 {
            let turns = f64::from(k) * 0.000_777;
            let position = Periods((turns * 4_294_967_296.0).round() as i64);
            let shown = counts.read(position);
            assert!((shown - turns).abs() <= 0.5 / 160.0 + 1e-8, "{turns}: {shown}");
            assert!((shown * 160.0).fract().abs() < 1e-9);
        }
    }

    #[test]
    fn points_stay_few_and_even() {
        let mut points = Points { taken: Vec::new(), every: 1 };
        (0..100_000).for_each(|k| points.see(k, [k as f64, 0.0]));
        assert!((POINTS..2 * POINTS).contains(&points.taken.len()));
        let step = points.taken[1].0;
        assert!(points.taken.windows(2).all(|pair| pair[1].0 - pair[0].0 == step));
    }
}
