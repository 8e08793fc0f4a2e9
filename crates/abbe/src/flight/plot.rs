//! The picture of a replay: position and set-point, following error, step rate and state, one below the other, with a
//! line across all of them wherever something was asked or went wrong.

use super::trace::{AxisLines, Kind, Line, Trace, Window};
use crate::drawing::{self, Area, Drawn, Panel, TEXT_SIZE, TITLE_SIZE, decimals, names};
use crate::palette::{BLUE, GREY, GRID, INK, LIGHT_BLUE, LIGHT_ORANGE, ORANGE, RED};
use abbe_core::machine::STATES;
use plotters::prelude::*;
use plotters::style::FontTransform;

const SIZE: (u32, u32) = (1200, 1180);
/// More marks than this stay without their words: nobody could read them.
const MOST_WORDS: usize = 24;
const LONGEST_WORDS: usize = 36;

/// One line with its colour and its name in the key.
struct Curve<'a> {
    points: &'a [(f64, f64)],
    colour: RGBColor,
    name: &'static str,
}

/// The picture as SVG.
pub(crate) fn svg(trace: &Trace, title: &str) -> anyhow::Result<String> {
    drawing::svg(SIZE, |area| draw(area, trace, title))
}

/// A page of its own around the picture.
pub(crate) fn page(trace: &Trace, title: &str, proof: &str) -> anyhow::Result<String> {
    let (title_text, proof) = (escaped(title), escaped(proof));
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{title_text}</title>\n\
         <style>body{{font-family:sans-serif;color:#1b1f24;max-width:{}px;margin:2em auto}}svg{{max-width:100%}}</style>\
         </head>\n<body>\n<p>{proof}</p>\n{}\n</body>\n</html>\n",
        SIZE.0,
        svg(trace, title)?
    ))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn draw(area: &Area<'_>, trace: &Trace, title: &str) -> Drawn {
    area.fill(&WHITE)?;
    let area = area.titled(title, ("sans-serif", TITLE_SIZE).into_font().color(&INK))?;
    let panels = area.split_evenly((4, 1));
    let [x, y] = &trace.lines.axes;
    let pair = |line: fn(&AxisLines) -> &Line| {
        [("x", BLUE, line(x)), ("y", ORANGE, line(y))].map(|(name, colour, line)| Curve {
            points: line.points(),
            colour,
            name,
        })
    };
    let set_points = [
        Curve { points: x.set_point.points(), colour: LIGHT_BLUE, name: "x, set-point" },
        Curve { points: y.set_point.points(), colour: LIGHT_ORANGE, name: "y, set-point" },
    ];
    let places: Vec<Curve<'_>> = set_points.into_iter().chain(pair(|axis| &axis.position)).collect();
    curves(&panels[0], trace, "place / mm", &places)?;
    curves(&panels[1], trace, "following error / µm", &pair(|axis| &axis.error))?;
    curves(&panels[2], trace, "steps a second", &pair(|axis| &axis.drive))?;
    states(&panels[3], trace)?;
    area.present()?;
    Ok(())
}

fn curves(area: &Area<'_>, trace: &Trace, name: &str, curves: &[Curve<'_>]) -> Drawn {
    let values = || curves.iter().flat_map(|curve| curve.points).map(|point| point.1);
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
    let margin = (0.06 * (high - low)).max(1e-3);
    let mut panel = panel(area, trace.window(), (low - margin, high + margin))?;
    mesh(&mut panel, name, 6, &|value| format!("{value:.*}", decimals(high - low)))?;
    marks(&mut panel, trace, (low - margin, high + margin))?;
    for curve in curves {
        let pen = curve.colour.stroke_width(1);
        let colour = curve.colour;
        panel
            .draw_series(LineSeries::new(curve.points.iter().copied(), pen))?
            .label(curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    names(&mut panel)
}

fn states(area: &Area<'_>, trace: &Trace) -> Drawn {
    let number = |state| STATES.iter().position(|known| *known == state).unwrap_or_default() as f64;
    let ends = (-0.5, STATES.len() as f64 - 0.5);
    let mut panel = panel(area, trace.window(), ends)?;
    let name = |value: &f64| {
        let whole = (value - value.round()).abs() < 1e-6;
        let state = STATES.get(value.round().max(0.0) as usize).filter(|_| whole);
        state.map(ToString::to_string).unwrap_or_default()
    };
    mesh(&mut panel, "state", STATES.len() * 2, &name)?;
    marks(&mut panel, trace, ends)?;
    let mut steps = Vec::new();
    for &(t_s, state) in &trace.lines.states {
        steps.extend(steps.last().map(|&(_, last)| (t_s, last)));
        steps.push((t_s, number(state)));
    }
    steps.extend(steps.last().map(|&(_, last)| (trace.window().to_s, last)));
    panel.draw_series(LineSeries::new(steps, INK.stroke_width(2)))?;
    words(&mut panel, trace, ends.0)
}

fn panel<'a, 'b>(
    area: &Area<'b>,
    window: Window,
    (low, high): (f64, f64),
) -> Result<Panel<'a, 'b>, Box<dyn std::error::Error>>
where
    'b: 'a,
{
    Ok(ChartBuilder::on(area)
        .margin(8)
        .margin_right(20)
        .x_label_area_size(38)
        .y_label_area_size(78)
        .build_cartesian_2d(window.from_s..window.to_s, low..high)?)
}

fn mesh(panel: &mut Panel<'_, '_>, name: &str, labels: usize, format: &dyn Fn(&f64) -> String) -> Drawn {
    panel
        .configure_mesh()
        .x_desc("time from power-on / s")
        .y_desc(name)
        .y_labels(labels)
        .y_label_formatter(&format)
        .label_style(("sans-serif", TEXT_SIZE).into_font().color(&INK))
        .axis_desc_style(("sans-serif", TEXT_SIZE).into_font().color(&INK))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .draw()?;
    Ok(())
}

fn colour_of(kind: Kind) -> RGBColor {
    match kind {
        Kind::Command | Kind::Map => GREY,
        Kind::Refusal | Kind::Fault => RED,
    }
}

fn marks(panel: &mut Panel<'_, '_>, trace: &Trace, (low, high): (f64, f64)) -> Drawn {
    for mark in trace.marks_in_window() {
        let pen = colour_of(mark.kind).stroke_width(1);
        panel.draw_series(DashedLineSeries::new([(mark.t_s, low), (mark.t_s, high)], 4, 4, pen))?;
    }
    Ok(())
}

/// The words of the marks, upright beside their lines.
fn words(panel: &mut Panel<'_, '_>, trace: &Trace, low: f64) -> Drawn {
    if trace.marks_in_window().count() > MOST_WORDS {
        return Ok(());
    }
    for mark in trace.marks_in_window() {
        let style = ("sans-serif", TEXT_SIZE - 3).into_font().transform(FontTransform::Rotate270);
        let at = (mark.t_s, low + 0.1);
        panel.draw_series([Text::new(shortened(&mark.text), at, style.color(&colour_of(mark.kind)))])?;
    }
    Ok(())
}

/// As much as the height of a panel holds.
fn shortened(text: &str) -> String {
    if text.chars().count() <= LONGEST_WORDS {
        return text.to_owned();
    }
    let kept: String = text.chars().take(LONGEST_WORDS - 1).collect();
    format!("{kept}…")
}
