//! The stairs of a program beside its path: all of it, and a part in which single steps can be seen.

use crate::drawing::{self, Area, Drawn, TITLE_SIZE, names};
use crate::palette::{INK, LIGHT_BLUE, ORANGE};
use crate::program::picture::{Points, curve, ends, mesh};
use abbe_core::plan::compare::{Sign, Step};
use plotters::prelude::*;
use std::collections::VecDeque;

const SIZE: (u32, u32) = (1240, 640);
/// Steps either side of the place that is shown large.
const AROUND: usize = 16;
/// Steps of the whole path that are drawn at most.
const MOST: usize = 4096;

/// A point of the steps, and the place of the path nearest to it; in steps.
type Pair = [[f64; 2]; 2];

/// What makes a place worth to be seen, the best last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Something moves.
    Start,
    /// Both axes step along a bend.
    Bend,
    /// Two motions meet.
    Corner,
    /// An axis turns back on a bend: another quadrant begins.
    Turn,
}

/// A picture that is being collected.
#[derive(Debug, Default)]
pub(crate) struct Picture {
    whole: Vec<Pair>,
    /// Of so many steps one is kept.
    every: u64,
    seen: u64,
    /// The last steps.
    recent: VecDeque<(Pair, Option<Step>)>,
    large: Option<Large>,
    is_bent: bool,
    begins: bool,
}

#[derive(Debug)]
struct Large {
    rank: Rank,
    pairs: Vec<Pair>,
    /// Steps that still belong to it.
    more: usize,
}

impl Picture {
    /// Where no steps lead.
    pub(super) fn come_to(&mut self, point: [f64; 2]) {
        self.recent.clear();
        match &mut self.large {
            Some(large) => large.more = 0,
            // No step was made yet: how it came there does not matter.
            None => self.whole.clear(),
        }
        self.keep([point, point]);
        self.recent.push_back(([point, point], None));
    }

    /// A motion begins, along a bend or not.
    pub(super) fn begin(&mut self, true_start: [f64; 2], is_bent: bool) {
        (self.is_bent, self.begins) = (is_bent, true);
        if let Some((pair, _)) = self.recent.back_mut() {
            pair[1] = true_start;
        }
    }

    pub(super) fn step(&mut self, point: [f64; 2], nearest: [f64; 2], step: Step) {
        let pair = [point, nearest];
        self.keep(pair);
        let rank = self.rank(step);
        if let Some(large) = self.large.as_mut().filter(|large| large.more > 0) {
            large.more -= 1;
            large.pairs.push(pair);
        }
        let is_better = self.large.as_ref().is_none_or(|large| rank > Some(large.rank));
        if let Some(rank) = rank.filter(|_| is_better) {
            let pairs = self.recent.iter().map(|(pair, _)| *pair).chain([pair]).collect();
            self.large = Some(Large { rank, pairs, more: AROUND });
        }
        if self.recent.len() > AROUND {
            self.recent.pop_front();
        }
        self.recent.push_back((pair, Some(step)));
        self.begins = false;
    }

    fn rank(&self, step: Step) -> Option<Rank> {
        let steps = || self.recent.iter().rev().filter_map(|(_, step)| *step);
        let sign = |step: Step| step.sign == Sign::Plus;
        let turns = steps().find(|one| one.axis == step.axis).is_some_and(|one| sign(one) != sign(step));
        let of_axis = steps().filter(|one| one.axis == step.axis).count();
        let is_between = (AROUND / 4..=3 * AROUND / 4).contains(&of_axis);
        match (self.begins, self.is_bent) {
            (true, _) => Some(if steps().next().is_some() { Rank::Corner } else { Rank::Start }),
            (_, true) if turns => Some(Rank::Turn),
            (_, true) if is_between && self.recent.len() > AROUND => Some(Rank::Bend),
            _ => None,
        }
    }

    fn keep(&mut self, pair: Pair) {
        if self.whole.len() >= MOST {
            let mut number = 0_u32;
            self.whole.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.every *= 2;
        }
        self.every = self.every.max(1);
        if self.seen.is_multiple_of(self.every) {
            self.whole.push(pair);
        }
        self.seen += 1;
    }

    /// The picture as SVG; a step in mm.
    pub(crate) fn svg(&self, title: &str, step_mm: f64) -> anyhow::Result<String> {
        drawing::svg(SIZE, |area| self.draw(area, title, step_mm))
    }

    fn draw(&self, area: &Area<'_>, title: &str, step_mm: f64) -> Drawn {
        area.fill(&WHITE)?;
        let area = area.titled(title, ("sans-serif", TITLE_SIZE).into_font().color(&INK))?;
        let (left, right) = area.split_horizontally(SIZE.1);
        let last = self.recent.back().map(|(pair, _)| *pair);
        let whole: Vec<Pair> = self.whole.iter().copied().chain(last).collect();
        stairs(&left, &whole, step_mm, false)?;
        let large = self.large.as_ref().map_or(&whole, |large| &large.pairs);
        stairs(&right, large, step_mm, true)?;
        area.present()?;
        Ok(())
    }
}

/// As long in x as in y, so that a step is as long on both.
fn stairs(area: &Area<'_>, pairs: &[Pair], step_mm: f64, is_large: bool) -> Drawn {
    let points = |which: usize| -> Points {
        pairs.iter().map(|pair| (pair[which][0] * step_mm, pair[which][1] * step_mm)).collect()
    };
    let (steps, path) = (points(0), points(1));
    let both = || steps.iter().chain(&path);
    let [x, y] = [ends(both().map(|point| point.0)), ends(both().map(|point| point.1))];
    let half = 0.55 * (x.1 - x.0).max(y.1 - y.0).max(4.0 * step_mm);
    let about = |(low, high): (f64, f64)| 0.5 * (low + high) - half..0.5 * (low + high) + half;
    let mut panel = ChartBuilder::on(area)
        .margin(8)
        .margin_right(24)
        .x_label_area_size(38)
        .y_label_area_size(88)
        .build_cartesian_2d(about(x), about(y))?;
    mesh(&mut panel, ["x / mm", "y / mm"], [2.0 * half; 2])?;
    if is_large {
        let points = steps.iter().map(|&point| Circle::new(point, 3, ORANGE.filled()));
        panel.draw_series(points)?;
    }
    curve(&mut panel, path, LIGHT_BLUE.stroke_width(3), "true path")?;
    curve(&mut panel, steps, ORANGE.stroke_width(1), if is_large { "single steps" } else { "steps" })?;
    names(&mut panel)
}
