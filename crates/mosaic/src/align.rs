//! From nominal places to registered ones, and the optics on the way.
//!
//! 1. Phase correlation of every pair of neighbours around the nominal displacement; robust global solution.
//! 2. Pairs that failed are tried again near where that solution puts them.
//! 3. The light over the frame is estimated, so that it does not pass for structure.
//! 4. Every accepted overlap is measured in several blocks; places and lens distortion are solved together.
//! 5. The light is estimated again at the final places.

use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::distortion::{Distortion, DistortionSummary};
use crate::refine::{Division, Match, measure};
use crate::register::{Correlator, Pair, neighbours, overlapping};
use crate::shading::Shading;
use crate::solve::{LensModel, Observation, Settings, Solution, StageModel, solve};
use crate::stitch::StitchOptions;
use crate::tiles::TileSet;

/// Second tries look this far around the solution, px.
const SECOND_RADIUS_PX: usize = 8;

/// A distortion is believed if it is so many standard deviations from zero, …
const LENS_SIGMAS: f64 = 4.0;
/// … known at least so well, px at the corner, …
const LENS_MOST_SIGMA_PX: f64 = 0.2;
/// … and at least so large, px at the corner: less is not worth its risk.
const LENS_LEAST_PX: f64 = 0.1;

/// Terms beyond the radial one are tried with so many blocks or more, …
const POLYNOMIAL_LEAST_BLOCKS: usize = 60;
/// … and believed if the median residual falls to this share.
const POLYNOMIAL_MOST_RESIDUAL: f64 = 0.75;

/// The outcome of registration.
#[derive(Clone, Debug)]
pub(crate) struct Alignment {
    pub(crate) places: Vec<[f64; 2]>,
    pub(crate) pairs: usize,
    pub(crate) pairs_used: usize,
    pub(crate) pairs_rejected: usize,
    pub(crate) residual_rms_px: f64,
    pub(crate) prior_px: f64,
    pub(crate) model: StageModel,
    pub(crate) lens: Distortion,
    /// The lens in short, if its distortion is undone.
    pub(crate) lens_summary: Option<DistortionSummary>,
    pub(crate) shading: Option<Shading>,
    /// How each pair fared.
    pub(crate) overlaps: Vec<OverlapVerdict>,
    /// Tiles that no accepted pair reaches.
    pub(crate) unreached: Vec<usize>,
    /// Sets of two or more tiles that accepted pairs join.
    pub(crate) groups: usize,
}

/// How one pair fared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OverlapVerdict {
    pub(crate) pair: Pair,
    pub(crate) used: bool,
    /// Mean correlation of the blocks that were measured; zero if none was.
    pub(crate) correlation: f64,
}

/// Registers the tiles. `done` is told how many pairs of how many are measured, twice through.
pub(crate) fn align(
    set: &TileSet,
    options: &StitchOptions,
    done: &(dyn Fn(usize, usize) + Sync),
) -> Alignment {
    let work = Work { set, options, nominal: set.places(), lens: Distortion::none(set.tile_size()), done };
    let (pairs, coarse) = work.coarse();
    let first_shading = work.shading(&coarse.solution.places);
    let fine = work.fine(&pairs, &coarse, first_shading.as_ref());
    let (solution, lens_summary) = work.solve_fine(&fine);
    let used = used_pairs(&fine, &solution.kept, pairs.len());
    let matched = coarse.matched.iter().filter(|m| **m).count();
    let pairs_used = used.iter().filter(|u| **u).count();
    let reached = Groups::of(&pairs, &used, set.images.len());
    Alignment {
        pairs: pairs.len(),
        overlaps: verdicts(&pairs, &used, &fine),
        pairs_used,
        pairs_rejected: matched - pairs_used,
        residual_rms_px: solution.residual_rms_px,
        prior_px: solution.prior_px,
        model: solution.model,
        lens: solution.lens,
        lens_summary,
        shading: work.shading(&solution.places),
        unreached: reached.alone(),
        groups: reached.count(),
        places: solution.places,
    }
}

/// What all steps look at.
struct Work<'a> {
    set: &'a TileSet,
    options: &'a StitchOptions,
    nominal: Vec<[f64; 2]>,
    lens: Distortion,
    done: &'a (dyn Fn(usize, usize) + Sync),
}

/// Result of the first two steps.
struct Coarse {
    solution: Solution,
    /// One accepted observation a pair at most.
    accepted: Vec<Observation>,
    /// Whether anything at all was found for each pair, accepted or not.
    matched: Vec<bool>,
}

impl Work<'_> {
    fn coarse(&self) -> (Vec<Pair>, Coarse) {
        let pairs = neighbours(&self.nominal, self.set.tile_size());
        let correlator = Correlator::new();
        let radius = self.options.search_radius_px;
        let mut found = self.matches(&pairs, |pair| {
            correlator.find(self.images(pair), difference(&self.nominal, pair), radius)
        });
        let first = self.solve_coarse(&observations(&pairs, &found));
        let mut trusted = vec![false; pairs.len()];
        for (observation, kept) in observations(&pairs, &found).iter().zip(&first.kept) {
            trusted[observation.pair] = *kept;
        }
        let second: Vec<Option<Match>> = (0..pairs.len())
            .into_par_iter()
            .map(|i| if trusted[i] { None } else { self.second_try(&correlator, pairs[i], &first) })
            .collect();
        for (found, second) in found.iter_mut().zip(second) {
            if second.is_some() {
                *found = second;
            }
        }
        let list = observations(&pairs, &found);
        let solution = self.solve_coarse(&list);
        let accepted = list.into_iter().zip(&solution.kept).filter(|(_, k)| **k).map(|(o, _)| o).collect();
        let matched = found.iter().map(Option::is_some).collect();
        (pairs, Coarse { solution, accepted, matched })
    }

    fn second_try(&self, correlator: &Correlator, pair: Pair, first: &Solution) -> Option<Match> {
        let radius = SECOND_RADIUS_PX.min(self.options.search_radius_px);
        correlator.find(self.images(pair), difference(&first.places, pair), radius)
    }

    fn images(&self, pair: Pair) -> [&crate::image::Image; 2] {
        [&self.set.images[pair.a], &self.set.images[pair.b]]
    }

    /// Measures all pairs, in the order of the list whatever thread was first.
    fn matches<T: Send>(&self, pairs: &[Pair], measure: impl Fn(Pair) -> T + Sync) -> Vec<T> {
        let count = AtomicUsize::new(0);
        let one = |pair: &Pair| {
            let result = measure(*pair);
            (self.done)(count.fetch_add(1, Ordering::Relaxed) + 1, pairs.len());
            result
        };
        pairs.par_iter().map(one).collect()
    }

    fn solve_coarse(&self, list: &[Observation]) -> Solution {
        // Distortion and light are not known yet: half a pixel of error is granted to every pair.
        let settings =
            Settings { floor_px: 0.5, tolerance_px: 2.0, prior_px: self.prior_px(), lens: LensModel::Given };
        solve(&self.nominal, self.lens, list, settings)
    }

    /// Half the search radius: who sets a radius believes the nominal places to be good to about that.
    fn prior_px(&self) -> f64 {
        (self.options.search_radius_px as f64 / 2.0).max(1.0)
    }

    fn fine(&self, pairs: &[Pair], coarse: &Coarse, shading: Option<&Shading>) -> Vec<Observation> {
        let accepted: Vec<Pair> = coarse.accepted.iter().map(|o| pairs[o.pair]).collect();
        let expected: Vec<[f64; 2]> = coarse.accepted.iter().map(|o| o.found.delta).collect();
        let count = AtomicUsize::new(0);
        let blocks: Vec<Vec<Match>> = accepted
            .par_iter()
            .zip(&expected)
            .map(|(pair, expected)| {
                let found = measure(self.images(*pair), *expected, shading, Division::Blocks);
                (self.done)(count.fetch_add(1, Ordering::Relaxed) + 1, accepted.len());
                found
            })
            .collect();
        let mut list = Vec::new();
        for (whole, blocks) in coarse.accepted.iter().zip(blocks) {
            // Where no block alone is beyond doubt, the whole overlap still is.
            let found = if blocks.is_empty() { vec![whole.found.clone()] } else { blocks };
            list.extend(found.into_iter().map(|found| Observation { found, ..whole.clone() }));
        }
        list
    }

    fn solve_fine(&self, list: &[Observation]) -> (Solution, Option<DistortionSummary>) {
        let solved = |lens: LensModel| {
            let settings = Settings { floor_px: 0.03, tolerance_px: 0.3, prior_px: self.prior_px(), lens };
            solve(&self.nominal, self.lens, list, settings)
        };
        let plain = solved(LensModel::Given);
        if !self.options.correct_distortion {
            return (plain, None);
        }
        let radial = Some(solved(LensModel::Radial)).filter(radial_is_believed);
        let simple = radial.as_ref().unwrap_or(&plain);
        if list.len() >= POLYNOMIAL_LEAST_BLOCKS {
            let full = solved(LensModel::Polynomial);
            if full.median_residual_px < POLYNOMIAL_MOST_RESIDUAL * simple.median_residual_px {
                let summary = summary(&full, true);
                return (full, Some(summary));
            }
        }
        match radial {
            Some(radial) => {
                let summary = summary(&radial, false);
                (radial, Some(summary))
            }
            None => (plain, None),
        }
    }

    fn shading(&self, places: &[[f64; 2]]) -> Option<Shading> {
        if !self.options.correct_shading {
            return None;
        }
        let overlaps: Vec<(Pair, [i64; 2])> = overlapping(places, self.set.tile_size())
            .map(|(pair, _)| (pair, difference(places, pair).map(|v| v.round() as i64)))
            .collect();
        Shading::estimate(&self.set.images, &overlaps)
    }
}

fn radial_is_believed(solution: &Solution) -> bool {
    let (size, sigma) = (solution.lens.radial_px().abs(), solution.lens_sigma_px);
    size >= LENS_LEAST_PX && size > LENS_SIGMAS * sigma && sigma < LENS_MOST_SIGMA_PX
}

fn summary(solution: &Solution, beyond_radial: bool) -> DistortionSummary {
    DistortionSummary {
        radial_corner_px: solution.lens.radial_px(),
        radial_sigma_px: solution.lens_sigma_px,
        beyond_radial,
        largest_px: solution.lens.largest_px(),
    }
}

fn difference(places: &[[f64; 2]], pair: Pair) -> [f64; 2] {
    [0, 1].map(|k| places[pair.b][k] - places[pair.a][k])
}

fn observations(pairs: &[Pair], found: &[Option<Match>]) -> Vec<Observation> {
    let list = pairs.iter().zip(found).enumerate();
    list.filter_map(|(pair, (&Pair { a, b }, found))| Some(Observation { pair, a, b, found: found.clone()? }))
        .collect()
}

/// Pairs of which at least one observation was kept.
fn used_pairs(list: &[Observation], kept: &[bool], pairs: usize) -> Vec<bool> {
    let mut used = vec![false; pairs];
    for (observation, _) in list.iter().zip(kept).filter(|(_, k)| **k) {
        used[observation.pair] = true;
    }
    used
}

fn verdicts(pairs: &[Pair], used: &[bool], list: &[Observation]) -> Vec<OverlapVerdict> {
    let mut sums = vec![(0.0, 0.0); pairs.len()];
    for observation in list {
        sums[observation.pair].0 += observation.found.ncc;
        sums[observation.pair].1 += 1.0;
    }
    let each = pairs.iter().zip(used).zip(sums);
    each.map(|((&pair, &used), (sum, n))| OverlapVerdict { pair, used, correlation: sum / f64::max(n, 1.0) })
        .collect()
}

/// Tiles joined by used pairs: for each tile the least tile of its group.
struct Groups(Vec<usize>);

impl Groups {
    fn of(pairs: &[Pair], used: &[bool], tiles: usize) -> Self {
        let mut least: Vec<usize> = (0..tiles).collect();
        let mut changed = true;
        while changed {
            changed = false;
            for (pair, _) in pairs.iter().zip(used).filter(|(_, u)| **u) {
                let low = least[pair.a].min(least[pair.b]);
                changed |= least[pair.a] != low || least[pair.b] != low;
                least[pair.a] = low;
                least[pair.b] = low;
            }
        }
        Self(least)
    }

    /// Groups of two or more.
    fn count(&self) -> usize {
        (0..self.0.len()).filter(|&i| self.0[i] == i && self.size(i) > 1).count()
    }

    fn alone(&self) -> Vec<usize> {
        (0..self.0.len()).filter(|&i| self.size(i) == 1).collect()
    }

    fn size(&self, tile: usize) -> usize {
        self.0.iter().filter(|&&least| least == self.0[tile]).count()
    }
}
