//! The picture of a run: its path, asked and measured, and how far the stage was from it over time.

use super::watch::Sample;
use crate::drawing::{self, Area, Drawn, Panel, TEXT_SIZE, TITLE_SIZE, decimals, names};
use crate::palette::{BLUE, GREY, GRID, INK, LIGHT_BLUE, ORANGE};
use plotters::prelude::*;

const SIZE: (u32, u32) = (1240, 640);
/// Around a panel, and for the numbers and words beside and below it, px.
const MARGIN: u32 = 8;
const BESIDE: u32 = 78;
const BELOW: u32 = 38;
/// Groups of samples that are kept at most.
const MOST: usize = 1000;

/// A run of any length in some thousand samples: of each group of neighbours the outermost ones.
#[derive(Debug)]
pub(super) struct Thinned {
    /// The samples kept of each group, in their order; the last group may still grow.
    groups: Vec<Vec<Sample>>,
    /// Samples in a group.
    size: u64,
    /// Samples in the last group.
    filled: u64,
}

impl Default for Thinned {
    fn default() -> Self {
        Self { groups: Vec::new(), size: 1, filled: 1 }
    }
}

impl Thinned {
    pub(super) fn add(&mut self, sample: Sample) {
        if self.filled == self.size {
            if self.groups.len() == MOST {
                self.halve();
            }
            self.groups.push(Vec::new());
            self.filled = 0;
        }
        self.filled += 1;
        if let Some(group) = self.groups.last_mut() {
            group.push(sample);
            keep_outermost(group);
        }
    }

    /// Two groups become one.
    fn halve(&mut self) {
        let pairs = self.groups.chunks(2).map(|pair| {
            let mut both = pair.concat();
            keep_outermost(&mut both);
            both
        });
        self.groups = pairs.collect();
        self.size *= 2;
    }

    fn samples(&self) -> impl Iterator<Item = &Sample> {
        self.groups.iter().flatten()
    }
}

/// Of a group the first sample, and of each number in it where it is lowest and highest.
fn keep_outermost(group: &mut Vec<Sample>) {
    const NUMBERS: [fn(&Sample) -> f64; 6] = [
        |sample| sample.asked_mm[0],
        |sample| sample.asked_mm[1],
        |sample| sample.measured_mm[0],
        |sample| sample.measured_mm[1],
        |sample| sample.error_um[0],
        |sample| sample.error_um[1],
    ];
    if group.len() <= 2 {
        return;
    }
    let mut kept = vec![false; group.len()];
    kept[0] = true;
    for number in NUMBERS {
        let order = |&one: &usize, &other: &usize| number(&group[one]).total_cmp(&number(&group[other]));
        let ends = [(0..group.len()).min_by(order), (0..group.len()).max_by(order)];
        ends.into_iter().flatten().for_each(|end| kept[end] = true);
    }
    let mut kept = kept.into_iter();
    group.retain(|_| kept.next().unwrap_or(false));
}

pub(super) type Points = Vec<(f64, f64)>;

impl Thinned {
    /// The picture as SVG.
    pub(super) fn svg(&self, title: &str) -> anyhow::Result<String> {
        drawing::svg(SIZE, |area| self.draw(area, title))
    }

    fn draw(&self, area: &Area<'_>, title: &str) -> Drawn {
        area.fill(&WHITE)?;
        let area = area.titled(title, ("sans-serif", TITLE_SIZE).into_font().color(&INK))?;
        let (left, right) = area.split_horizontally(SIZE.1);
        self.path(&left)?;
        self.errors(&right)?;
        area.present()?;
        Ok(())
    }

    /// As long in x as in y, so that a circle is one.
    fn path(&self, area: &Area<'_>) -> Drawn {
        let asked: Points = self.samples().map(|sample| sample.asked_mm.into()).collect();
        let measured: Points = self.samples().map(|sample| sample.measured_mm.into()).collect();
        let both = || asked.iter().chain(&measured);
        let [x, y] = [ends(both().map(|point| point.0)), ends(both().map(|point| point.1))];
        let (width, height) = area.dim_in_pixel();
        let across = f64::from(width.saturating_sub(2 * MARGIN + BESIDE));
        let up = f64::from(height.saturating_sub(2 * MARGIN + BELOW));
        let mm_per_px = (1.06 * (x.1 - x.0) / across).max(1.06 * (y.1 - y.0) / up).max(1e-6);
        let about = |(low, high): (f64, f64), px: f64| {
            let (middle, half) = (f64::midpoint(low, high), 0.5 * px * mm_per_px);
            middle - half..middle + half
        };
        let mut panel = ChartBuilder::on(area)
            .margin(MARGIN)
            .x_label_area_size(BELOW)
            .y_label_area_size(BESIDE)
            .build_cartesian_2d(about(x, across), about(y, up))?;
        mesh(&mut panel, ["x / mm", "y / mm"], [across * mm_per_px, up * mm_per_px])?;
        // On most scales they lie on each other: one is seen on both sides of the other.
        curve(&mut panel, asked, LIGHT_BLUE.stroke_width(6), "asked")?;
        curve(&mut panel, measured, ORANGE.stroke_width(2), "measured")?;
        names(&mut panel)
    }

    /// One above the other on the same scale: on each other, one would hide the other.
    fn errors(&self, area: &Area<'_>) -> Drawn {
        let all = self.samples().flat_map(|sample| sample.error_um);
        let reach = 1.1 * all.fold(1e-3, |reach: f64, error| reach.max(error.abs()));
        let (above, below) = area.split_vertically(area.dim_in_pixel().1 / 2);
        self.errors_of(&above, 0, reach, "following error of x / µm")?;
        self.errors_of(&below, 1, reach, "following error of y / µm")
    }

    fn errors_of(&self, area: &Area<'_>, axis: usize, reach_um: f64, name: &str) -> Drawn {
        let last_s = self.samples().last().map_or(0.0, |sample| sample.t_s).max(1e-3);
        let mut panel = ChartBuilder::on(area)
            .margin(MARGIN)
            .margin_right(24)
            .x_label_area_size(BELOW)
            .y_label_area_size(BESIDE)
            .build_cartesian_2d(0.0..last_s, -reach_um..reach_um)?;
        mesh(&mut panel, ["time / s", name], [last_s, 2.0 * reach_um])?;
        panel.draw_series(LineSeries::new([(0.0, 0.0), (last_s, 0.0)], GREY.stroke_width(1)))?;
        let points = self.samples().map(|sample| (sample.t_s, sample.error_um[axis]));
        panel.draw_series(LineSeries::new(points, BLUE.stroke_width(1)))?;
        Ok(())
    }
}

/// The lowest and the highest of some numbers.
pub(super) fn ends(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = numbers
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), number| (low.min(number), high.max(number)));
    if low <= high { (low, high) } else { (0.0, 0.0) }
}

pub(super) fn curve(panel: &mut Panel<'_, '_>, points: Points, pen: ShapeStyle, name: &str) -> Drawn {
    panel
        .draw_series(LineSeries::new(points, pen))?
        .label(name)
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], pen));
    Ok(())
}

pub(super) fn mesh(panel: &mut Panel<'_, '_>, [across, up]: [&str; 2], [width, height]: [f64; 2]) -> Drawn {
    panel
        .configure_mesh()
        .x_desc(across)
        .y_desc(up)
        .x_labels(7)
        .y_labels(9)
        .x_label_formatter(&|value| format!("{value:.*}", decimals(width)))
        .y_label_formatter(&|value| format!("{value:.*}", decimals(height)))
        .label_style(("sans-serif", TEXT_SIZE).into_font().color(&INK))
        .axis_desc_style(("sans-serif", TEXT_SIZE).into_font().color(&INK))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One sample in a million is far out; it stays, and so do order and beginning.
    #[test]
    fn a_long_run_keeps_its_extremes_in_little_room() {
        let mut thinned = Thinned::default();
        let far = [(123_457, 5.0), (777_777, -7.0)];
        for k in 0..1_000_000_u32 {
            let error = far.iter().find(|far| far.0 == k).map_or(0.1, |far| far.1);
            let t_s = f64::from(k);
            let [x, y] = [(t_s * 1e-3).cos(), (t_s * 1e-3).sin()];
            thinned.add(Sample { t_s, asked_mm: [x, y], measured_mm: [x, y], error_um: [error, 0.0] });
        }
        let kept: Vec<&Sample> = thinned.samples().collect();
        assert!(kept.len() < 13 * MOST && kept.is_sorted_by(|a, b| a.t_s < b.t_s), "{}", kept.len());
        assert_eq!(kept[0].t_s, 0.0);
        for (k, error) in far {
            assert!(kept.iter().any(|sample| sample.t_s == f64::from(k) && sample.error_um[0] == error));
        }
        let (low, high) = ends(kept.iter().map(|sample| sample.asked_mm[0]));
        assert!(low < -0.999_999 && high == 1.0, "{low} {high}");
    }

    #[test]
    fn a_picture_of_nothing_is_drawn_too() {
        let svg = Thinned::default().svg("nothing").unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("following error") && !svg.contains("NaN"));
    }
}
