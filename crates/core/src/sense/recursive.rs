//! The ellipse, kept up to date while the stage works: offsets and gains drift with temperature and along a grating.
//!
//! Recursive least squares in its information form: the tick adds the sums of a block in integers
//! ([`super::moments::Block`]), and between ticks each block joins the sums of those before it, which fade. That is the
//! same estimate as the recursion of gains and covariances gives, block by block, but nothing in it can wind up or lose
//! its symmetry, and the tick has no division.
//!
//! An update needs a whole round. It is taken only when the new ellipse fits better than chance allows, so that noise
//! does not move a healthy signal's parameters; and it goes no farther than [`FARTHEST`] at once.

use super::correct::{CODE_BITS, Correction};
use super::ellipse::{Ellipse, FIRST, FitError, Normal};
use super::moments::{Block, Moments};
use super::phase::{Phase, Polar};
use crate::edge::SinCos;

/// What is kept of the sums when a block joins them.
const FADING: f64 = 0.75;
/// Samples of a block at least.
const FEWEST: u16 = 400;
/// Of these, each eighth of the period must hold so many and may hold no more: where a stage dithers in an eighth, that
/// eighth would speak for the whole, and harmonics are not the same all around.
const LEAST: u8 = 30;
const MOST: u8 = 75;
/// After so many samples that an eighth had no use for it was an arc, over and over.
const USELESS: u16 = 1500;
/// An ellipse must fit better by so many times the scatter of one sample; five constants alone win 5, and 35 by chance
/// once in a million.
const BETTER: f64 = 35.0;
/// From one sample of a block to the next, 2⁻³² of a period: at least 1/128, so that a standing signal adds nothing.
const SLOWEST: u32 = 1 << 25;
/// Slower than 1/8 of a period in a tick is slow enough to gather, 2⁻³²: channels that are sampled 200 ns apart are then
/// 0.1° off, not more.
pub const FASTEST: u32 = 1 << 29;
/// An update changes no constant by more: offsets as parts of the radius, the ratio, the radius as a part, radians. What is
/// farther off takes another block. A drift is slower by far; more at once is an accident that fits well by chance.
pub const FARTHEST: f64 = 0.1;
/// A sample farther from the circle than a quarter of its radius is a disturbance and not a sign of drift; before the first
/// fit, when nobody knows the circle yet, than half of it. Bits of the radius.
const OFF_CIRCLE: u32 = 2;
const OFF_CIRCLE_AT_FIRST: u32 = 1;
/// So many of them before a block is whole are no disturbance: the circle itself has moved, and the gate opens as at first.
const STRANGE: u16 = 400;

/// Gathers samples in the tick until they are worth a fit.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gather {
    block: Block,
    empty: Block,
    shares: Shares,
    /// How far a sample may be off the circle: see [`OFF_CIRCLE`]. With [`CODE_BITS`].
    off_circle: u32,
    /// Samples off the circle since the block began.
    strange: u16,
    /// Phase of the last sample that was added.
    added: Phase,
}

impl Gather {
    /// For signals around `centre` whose amplitude is `radius` codes.
    pub fn new(centre: [i16; 2], radius: u16) -> Self {
        let empty = Block::around(centre, radius.saturating_add(radius / 2));
        Self {
            block: empty,
            empty,
            shares: Shares::NONE,
            off_circle: u32::from(radius) << CODE_BITS >> OFF_CIRCLE_AT_FIRST,
            strange: 0,
            added: Phase(0),
        }
    }

    /// One sample of a slow motion with its corrected phase and radius; `nominal` is the radius of the circle, both with
    /// [`CODE_BITS`]. True when the block is ready.
    ///
    /// A sample is added in two ticks, a half of the work in each; the one that comes between is not looked at.
    #[inline]
    pub fn sample(&mut self, sample: SinCos, polar: Polar, nominal: u32) -> bool {
        if self.block.go_on() {
            return self.block.samples() >= FEWEST && self.shares.poor == 0;
        }
        let way = polar.phase.way_from(self.added).unsigned_abs();
        if way < SLOWEST {
            return false;
        }
        if polar.radius.abs_diff(nominal) > self.off_circle {
            self.see_strange(polar.phase, nominal);
        } else {
            self.added = polar.phase;
            if self.shares.take(polar.phase.octant()) {
                self.block.begin_shared(sample.cos, sample.sin);
            } else {
                self.skip();
            }
        }
        false
    }

    /// A single one is left out. Were they all, an offset that jumps by a third would never be seen.
    #[cold]
    fn see_strange(&mut self, phase: Phase, nominal: u32) {
        self.added = phase;
        self.strange = self.strange.wrapping_add(1);
        if self.strange >= STRANGE {
            self.off_circle = nominal >> OFF_CIRCLE_AT_FIRST;
            self.begin();
        }
    }

    #[cold]
    fn skip(&mut self) {
        self.shares.useless = self.shares.useless.wrapping_add(1);
        if self.shares.useless >= USELESS {
            self.begin();
        }
    }

    /// The block, once it is ready, for [`Recursive::update`].
    pub fn block(&self) -> Block {
        self.block.round()
    }

    /// Begins the next block.
    pub fn begin(&mut self) {
        self.block = self.empty;
        self.shares = Shares::NONE;
        self.strange = 0;
    }

    /// There was a fit: the circle is known, with `nominal` as its radius.
    pub fn has_fitted(&mut self, nominal: u32) {
        self.off_circle = nominal >> OFF_CIRCLE;
    }

    /// The block that is ready; the next one begins.
    pub fn take(&mut self) -> Block {
        let block = self.block();
        self.begin();
        block
    }
}

/// How a block's samples are shared out over the eighths of a period.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Shares {
    of: [u8; 8],
    /// Eighths with fewer than [`LEAST`].
    poor: u8,
    /// Samples of eighths that had enough.
    useless: u16,
}

impl Shares {
    const NONE: Self = Self { of: [0; 8], poor: 8, useless: 0 };

    /// A sample of an eighth; false when that has enough.
    #[inline]
    fn take(&mut self, octant: u8) -> bool {
        let Some(share) = self.of.get_mut(usize::from(octant)) else { return false };
        if *share >= MOST {
            return false;
        }
        *share = share.wrapping_add(1);
        if *share == LEAST {
            self.poor = self.poor.wrapping_sub(1);
        }
        true
    }
}

/// The estimate, between ticks.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Recursive {
    sums: Option<Moments>,
    ellipse: Ellipse,
}

/// What an update came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Update {
    /// The ellipse in use fits as well as any.
    Kept,
    /// A better one is in use.
    Changed(Ellipse),
    /// The sums give none; the one in use stays.
    Refused(FitError),
}

impl Recursive {
    /// Begins with an ellipse that is in use.
    pub const fn new(ellipse: Ellipse) -> Self {
        Self { sums: None, ellipse }
    }

    /// The ellipse in use.
    pub fn ellipse(&self) -> &Ellipse {
        &self.ellipse
    }

    /// A block was taken in.
    pub fn has_learned(&self) -> bool {
        self.sums.is_some()
    }

    /// What the tick takes off.
    pub fn correction(&self) -> Correction {
        Correction::of(&self.ellipse)
    }

    /// The radius that a good sample has, with [`CODE_BITS`].
    pub fn nominal(&self) -> u32 {
        libm::round(libm::ldexp(self.ellipse.radius, CODE_BITS as i32)) as u32
    }

    /// Takes a block in.
    pub fn update(&mut self, block: &Moments) -> Update {
        let sums = match &self.sums {
            Some(before) => before.faded(FADING).with(block),
            None => *block,
        };
        self.sums = Some(sums);
        let better = match Self::better(&sums, &self.ellipse) {
            Ok(better) => better,
            Err(error) => return Update::Refused(error),
        };
        match better {
            Some(found) => {
                self.ellipse = towards(&self.ellipse, &found);
                Update::Changed(self.ellipse)
            }
            None => Update::Kept,
        }
    }

    /// An ellipse that fits better than chance allows.
    fn better(sums: &Moments, now: &Ellipse) -> Result<Option<Ellipse>, FitError> {
        let normal = Normal::of(sums)?;
        let conic = normal.solve().ok_or(FitError::NoEllipse)?;
        let found = normal.ellipse(conic)?;
        let misfit = normal.misfit(&conic).max(0.0);
        let scatter = misfit / (sums.sum(0, 0) - FIRST as f64).max(1.0);
        let won = normal.misfit_of(now).map_or(f64::INFINITY, |before| before - misfit);
        Ok((won > BETTER * scatter).then_some(found))
    }
}

/// The found ellipse, or as far towards it as an update may go.
fn towards(now: &Ellipse, found: &Ellipse) -> Ellipse {
    // Unlike `clamp` it has no case that panics.
    let step = |now: f64, found: f64, most: f64| found.max(now - most).min(now + most);
    let codes = FARTHEST * now.radius;
    Ellipse {
        p: step(now.p, found.p, codes),
        q: step(now.q, found.q, codes),
        r: step(now.r, found.r, FARTHEST),
        alpha: step(now.alpha, found.alpha, FARTHEST),
        radius: step(now.radius, found.radius, codes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use rand::{Rng, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    const RADIUS: f64 = 22_000.0;
    const POOR: Ellipse =
        Ellipse { p: 0.05 * RADIUS, q: -0.03 * RADIUS, r: 1.0 / 1.08, alpha: -0.069_813, radius: RADIUS };

    fn normal(random: &mut impl Rng) -> f64 {
        StandardNormal.sample(random)
    }

    fn sample(ellipse: &Ellipse, turns: f64, noise: f64, random: &mut impl Rng) -> SinCos {
        let cos = ellipse.radius * (turns * TAU).cos() + ellipse.p + noise * RADIUS * normal(random);
        let sin = ellipse.radius / ellipse.r * (turns * TAU - ellipse.alpha).sin()
            + ellipse.q
            + noise * RADIUS * normal(random);
        SinCos { sin: sin.round() as i16, cos: cos.round() as i16 }
    }

    /// Peak of what is left inside a period, nm of 800, mean taken off.
    fn left(truth: &Ellipse, used: &Ellipse) -> f64 {
        let off: Vec<f64> = (0..360)
            .map(|k| {
                let turns = f64::from(k) / 360.0;
                let cos = truth.radius * (turns * TAU).cos() + truth.p;
                let sin = truth.radius / truth.r * (turns * TAU - truth.alpha).sin() + truth.q;
                let off = used.turns(cos, sin) - turns;
                800.0 * (off - off.round())
            })
            .collect();
        let mean = off.iter().sum::<f64>() / 360.0;
        off.iter().map(|off| (off - mean).abs()).fold(0.0, f64::max)
    }

    /// Samples of a motion, block by block, until `samples` were seen; how often the ellipse changed.
    fn run(
        recursive: &mut Recursive,
        truth: &Ellipse,
        noise: f64,
        turns: impl Iterator<Item = f64>,
        seed: u64,
    ) -> u32 {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut gather = Gather::new([0, 0], RADIUS as u16);
        let mut changed = 0;
        for turns in turns {
            let sample = sample(truth, turns, noise, &mut random);
            let polar = recursive.correction().polar(sample);
            if gather.sample(sample, polar, recursive.nominal()) {
                changed +=
                    u32::from(matches!(recursive.update(&gather.take().moments()), Update::Changed(_)));
            }
        }
        changed
    }

    /// Batch fits of as many samples as the recursion sees in 50 periods, p95 of what they leave.
    fn batch(noise: f64, samples: u32) -> f64 {
        let mut left: Vec<f64> = (0..100)
            .map(|seed| {
                let mut random = Pcg64Mcg::seed_from_u64(seed + 1000);
                let all: Vec<[f64; 2]> = (0..samples)
                    .map(|k| sample(&POOR, f64::from(k) / 20.0 + 0.013, noise, &mut random))
                    .map(|s| [f64::from(s.cos), f64::from(s.sin)])
                    .collect();
                super::tests::left(&POOR, &Ellipse::fit(&Moments::of_all(all.into_iter())).unwrap())
            })
            .collect();
        left.sort_by(f64::total_cmp);
        left[94]
    }

    #[test]
    fn a_poor_signal_is_within_twice_the_batch_residual_inside_50_periods() {
        for noise in [0.001, 0.01] {
            let batch = batch(noise, 1000);
            let mut all: Vec<f64> = (0..100)
                .map(|seed| {
                    let mut recursive = Recursive::new(Ellipse::circle(RADIUS));
                    run(&mut recursive, &POOR, noise, (0..1000).map(|k| f64::from(k) / 20.0 + 0.013), seed);
                    left(&POOR, recursive.ellipse())
                })
                .collect();
            all.sort_by(f64::total_cmp);
            assert!(all[94] < 2.0 * batch, "noise {noise}: p95 {} nm, batch {batch} nm", all[94]);
        }
    }

    #[test]
    fn a_healthy_signal_is_never_made_worse() {
        let healthy = Ellipse::circle(RADIUS);
        let (mut changed, mut worst) = (0, 0.0_f64);
        for seed in 0..60 {
            let mut recursive = Recursive::new(healthy);
            changed += run(&mut recursive, &healthy, 0.01, (0..20_000).map(|k| f64::from(k) * 0.043), seed);
            worst = worst.max(left(&healthy, recursive.ellipse()));
        }
        assert!(changed == 0 && worst < 1e-9, "changed {changed} times, {worst} nm");
    }

    /// A third harmonic is no ellipse, and the fit of a part of it is another one than that of the whole.
    #[test]
    fn a_stage_that_dithers_does_not_bend_a_healthy_signal() {
        let worst = (0..6).map(dithering).fold(0.0, f64::max);
        // A third harmonic of 1 % alone leaves 1.27 nm.
        assert!(worst < 1.27 * 1.15, "{worst} nm");
    }

    /// Peak error, nm, after jogs inside an eighth with a round each 1600 samples.
    fn dithering(seed: u64) -> f64 {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut recursive = Recursive::new(Ellipse::circle(RADIUS));
        let mut gather = Gather::new([0, 0], RADIUS as u16);
        let place = |k: u32| match k % 1600 {
            round @ 0..200 => f64::from(round) / 100.0,
            jog => 0.01 + f64::from(seed as u32) / 8.0 + 0.05 * (1.0 - (f64::from(jog) * 0.3).cos()),
        };
        let signals = |turns: f64| {
            let angle = turns * TAU;
            [angle.cos() + 0.01 * (3.0 * angle).cos(), angle.sin() - 0.01 * (3.0 * angle).sin()]
        };
        for k in 0..40_000 {
            let [cos, sin] =
                signals(place(k)).map(|part| (RADIUS * (part + 0.003 * normal(&mut random))).round() as i16);
            let sample = SinCos { sin, cos };
            let polar = recursive.correction().polar(sample);
            if gather.sample(sample, polar, recursive.nominal()) {
                recursive.update(&gather.take().moments());
            }
        }
        let off = |k: u32| {
            let turns = f64::from(k) / 720.0;
            let [cos, sin] = signals(turns).map(|part| RADIUS * part);
            let off = recursive.ellipse().turns(cos, sin) - turns;
            800.0 * (off - off.round())
        };
        let mean = (0..720).map(off).sum::<f64>() / 720.0;
        (0..720).map(|k| (off(k) - mean).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_poor_encoder_is_known_for_what_it_is() {
        for poor in [
            Ellipse { p: 0.22 * RADIUS, r: 0.75, ..Ellipse::circle(RADIUS) },
            Ellipse { q: 0.35 * RADIUS, ..Ellipse::circle(RADIUS) },
        ] {
            let mut recursive = Recursive::new(Ellipse::circle(RADIUS));
            run(&mut recursive, &poor, 0.003, (0..20_000).map(|k| f64::from(k) * 0.008), 3);
            let found = recursive.ellipse();
            assert!((found.p - poor.p).abs() < 0.01 * RADIUS && (found.r - poor.r).abs() < 0.01, "{found:?}");
            assert!((found.q - poor.q).abs() < 0.01 * RADIUS, "{found:?}");
        }
    }

    #[test]
    fn standing_still_and_arcs_move_nothing() {
        for seed in 0..20 {
            let mut recursive = Recursive::new(POOR);
            let drifted = Ellipse { p: POOR.p + 500.0, ..POOR };
            let standing = (0..30_000).map(|k| 0.3 + 0.001 * (f64::from(k) * 0.01).sin());
            let arc = (0..30_000).map(|k| 0.3 + 0.3 * (f64::from(k) * 0.05).sin());
            assert_eq!(run(&mut recursive, &drifted, 0.01, standing.chain(arc), seed), 0);
            assert_eq!(recursive.ellipse(), &POOR);
        }
    }

    #[test]
    fn drift_is_followed() {
        let mut recursive = Recursive::new(POOR);
        for step in 0..40 {
            let drifted =
                Ellipse { p: POOR.p - 40.0 * f64::from(step), r: 0.93 + 0.002 * f64::from(step), ..POOR };
            run(&mut recursive, &drifted, 0.003, (0..4000).map(|k| f64::from(k) * 0.037), step as u64);
            let off = left(&drifted, recursive.ellipse());
            assert!(off < 0.5, "step {step}: {off} nm");
        }
    }

    #[test]
    fn no_update_goes_farther_than_a_tenth() {
        let far = Ellipse { p: 0.18 * RADIUS, q: -0.16 * RADIUS, r: 1.0, alpha: 0.0, radius: RADIUS };
        let mut recursive = Recursive::new(Ellipse::circle(RADIUS));
        let mut before = *recursive.ellipse();
        for (stretch, codes) in [(0, 0.1 * RADIUS), (1, 0.1 * RADIUS)] {
            let turns = (0..1000).map(|k| f64::from(k) / 20.0 + 0.013);
            assert_eq!(run(&mut recursive, &far, 0.002, turns, stretch), 1);
            let now = *recursive.ellipse();
            assert!((now.p - before.p).abs() <= codes && (now.q - before.q).abs() <= codes, "{now:?}");
            before = now;
        }
        assert!((before.p - far.p).abs() < 0.005 * RADIUS, "{before:?}");
    }

    #[test]
    fn what_is_far_off_the_circle_is_left_out() {
        let mut recursive = Recursive::new(Ellipse::circle(RADIUS));
        let weak = Ellipse { radius: RADIUS / 2.0, ..POOR };
        assert_eq!(run(&mut recursive, &weak, 0.001, (0..20_000).map(|k| f64::from(k) * 0.03), 1), 0);
    }
}
