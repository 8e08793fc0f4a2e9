//! The picture of a pair of signals: what they draw, and the error over the phase before and after.

use super::error::{Curve, PLACES};
use super::signals::Signals;
use crate::drawing::{self, Area, Drawn, Panel, TEXT_SIZE, TITLE_SIZE, names};
use crate::palette::{BLUE, GREY, GRID, INK, ORANGE};
use abbe_core::sense::ellipse::Ellipse;
use plotters::prelude::*;
use std::f64::consts::TAU;

const SIZE: (u32, u32) = (1240, 640);
/// Places at which the ellipse is drawn.
const CORNERS: u32 = 360;

/// What is drawn.
pub(crate) struct Picture<'p> {
    pub(crate) title: String,
    pub(crate) signals: &'p Signals<'p>,
    pub(crate) ellipse: &'p Ellipse,
    /// Some samples, codes.
    pub(crate) points: &'p [(f64, f64)],
    pub(crate) before: Option<&'p Curve>,
    pub(crate) after: Option<&'p Curve>,
    pub(crate) period_um: f64,
}

impl Picture<'_> {
    /// The picture as SVG.
    pub(crate) fn svg(&self) -> anyhow::Result<String> {
        drawing::svg(SIZE, |area| self.draw(area))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        area.fill(&WHITE)?;
        let area = area.titled(&self.title, ("sans-serif", TITLE_SIZE).into_font().color(&INK))?;
        let (left, right) = area.split_horizontally(SIZE.1);
        self.lissajous(&left)?;
        self.errors(&right)?;
        area.present()?;
        Ok(())
    }

    /// Codes as the file counts them.
    fn in_unit(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let scale = &self.signals.scale;
        (a / scale.codes + scale.middle[0], b / scale.codes + scale.middle[1])
    }

    fn lissajous(&self, area: &Area<'_>) -> Drawn {
        let [a, b] = self.signals.survey.channels;
        let reach = 1.06 * a.half().max(b.half());
        let ends = |middle: f64| middle - reach..middle + reach;
        let mut panel = ChartBuilder::on(area)
            .margin(8)
            .x_label_area_size(38)
            .y_label_area_size(78)
            .build_cartesian_2d(ends(a.middle()), ends(b.middle()))?;
        mesh(&mut panel, ["a (cosine)", "b (sine)"], 2.0 * reach)?;
        let dots = self.points.iter().map(|&point| Circle::new(self.in_unit(point), 1, BLUE.filled()));
        panel.draw_series(dots)?.label("samples").legend(key(BLUE));
        let ellipse = (0..=CORNERS).map(|corner| {
            let angle = f64::from(corner) / f64::from(CORNERS) * TAU;
            let Ellipse { p, q, r, alpha, radius } = *self.ellipse;
            self.in_unit((radius * angle.cos() + p, radius / r * (angle - alpha).sin() + q))
        });
        panel
            .draw_series(LineSeries::new(ellipse, ORANGE.stroke_width(2)))?
            .label("ellipse")
            .legend(key(ORANGE));
        names(&mut panel)
    }

    fn errors(&self, area: &Area<'_>) -> Drawn {
        let nm = 1e3 * self.period_um;
        let curves = [(self.before, ORANGE, "before"), (self.after, BLUE, "after")];
        let values = curves.iter().filter_map(|(curve, ..)| *curve).flat_map(|Curve(values)| values);
        let reach = 1.1 * values.fold(1e-6, |reach: f64, value| reach.max(value.abs() * nm));
        let mut panel = ChartBuilder::on(area)
            .margin(8)
            .margin_right(24)
            .x_label_area_size(38)
            .y_label_area_size(78)
            .build_cartesian_2d(0.0..360.0, -reach..reach)?;
        mesh(&mut panel, ["phase / °", "error of the position / nm"], 2.0 * reach)?;
        panel.draw_series(LineSeries::new([(0.0, 0.0), (360.0, 0.0)], GREY.stroke_width(1)))?;
        for (curve, colour, name) in curves {
            let Some(Curve(values)) = curve else { continue };
            let points = (0..)
                .zip(values)
                .map(|(place, value)| (f64::from(place) / PLACES as f64 * 360.0, value * nm));
            panel
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
                .label(name)
                .legend(key(colour));
        }
        names(&mut panel)
    }
}

fn mesh(panel: &mut Panel<'_, '_>, [across, up]: [&str; 2], length: f64) -> Drawn {
    // Decimals that tell six labels on a scale of this length apart; beyond any sense powers of ten do.
    let decimals = 1.0 - length.log10().floor();
    let format = |value: &f64| {
        if (-5.0..=6.0).contains(&decimals) {
            format!("{value:.*}", decimals.max(0.0) as usize)
        } else {
            format!("{value:.2e}")
        }
    };
    panel
        .configure_mesh()
        .x_desc(across)
        .y_desc(up)
        .x_labels(7)
        .y_labels(9)
        .y_label_formatter(&format)
        .x_label_formatter(&|value| {
            if across.starts_with("phase") { format!("{value:.0}") } else { format(value) }
        })
        .label_style(("sans-serif", TEXT_SIZE).into_font().color(&INK))
        .axis_desc_style(("sans-serif", TEXT_SIZE).into_font().color(&INK))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .draw()?;
    Ok(())
}

fn key(colour: RGBColor) -> impl Fn((i32, i32)) -> PathElement<(i32, i32)> {
    move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
}
