//! One plot as inline SVG: described as a value, drawn in one place, so that all plots look alike.
//!
//! Colours are those of Okabe and Ito, told apart by people who see red and green alike; direction is also told by
//! the shape of the mark, so that the plots survive a black-and-white printer.

use std::fmt::Display;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;

use super::ReportError;
use super::html::{escaped, number};

pub(super) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(super) const ORANGE: RGBColor = RGBColor(213, 94, 0);
pub(super) const GREY: RGBColor = RGBColor(110, 118, 128);
pub(super) const INK: RGBColor = RGBColor(27, 31, 36);
const GRID: RGBColor = RGBColor(226, 230, 234);

/// Plotters draws on whole pixels; drawn this much larger and shown smaller, curves are smooth.
const FINE: u32 = 8;
const WIDTH: u32 = 520;
const HEIGHT: u32 = 310;

/// Points of a line beyond which it is thinned; more than the plot has pixels.
const MOST_POINTS: usize = 1500;

/// The drawing surface inside the two scales.
type Frame<'a, DB> = ChartContext<'a, DB, Cartesian2d<Scale, Scale>>;

/// A linear scale that knows where its labels stand; the library's own loses one now and then to rounding.
#[derive(Clone)]
struct Scale {
    ends: (f64, f64),
    labels: Vec<f64>,
    decimals: usize,
}

impl Scale {
    fn new(ends: (f64, f64)) -> Self {
        let (labels, decimals) = ticks(ends);
        Self { ends, labels, decimals }
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let part = (value - self.ends.0) / (self.ends.1 - self.ends.0);
        from + (part.clamp(-1.0, 2.0) * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.labels.clone() }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.ends.0..self.ends.1
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, value: &f64) -> String {
        number(*value, self.decimals)
    }
}

/// A plot: two scales and what is drawn on them, in order.
pub(super) struct Chart {
    pub(super) title: String,
    pub(super) x: &'static str,
    pub(super) y: &'static str,
    pub(super) series: Vec<Series>,
}

/// One thing drawn, with its name in the key below the plot (no name, no entry).
pub(super) struct Series {
    pub(super) name: String,
    pub(super) colour: RGBColor,
    pub(super) mark: Mark,
}

pub(super) enum Mark {
    Line(Vec<(f64, f64)>),
    Dashed(Vec<(f64, f64)>),
    /// Filled circles: approached from below, or both.
    Dots(Vec<(f64, f64)>),
    /// Upward triangles and downward ones could be confused when small; crosses cannot.
    Crosses(Vec<(f64, f64)>),
    /// `(x, lowest, mean, highest)`.
    Bars(Vec<(f64, f64, f64, f64)>),
    /// A horizontal band from one value to another.
    Band(f64, f64),
}

impl Chart {
    /// The figure with title, plot and key.
    pub(super) fn figure(&self) -> Result<String, ReportError> {
        let key: String = self.series.iter().filter(|s| !s.name.is_empty()).map(Series::key).collect();
        let title = escaped(&self.title);
        Ok(format!(
            "<figure class=\"half\"><h3>{title}</h3>\n{}<figcaption>{key}</figcaption></figure>\n",
            self.svg()?
        ))
    }

    fn svg(&self) -> Result<String, ReportError> {
        let mut drawn = String::new();
        {
            let area = SVGBackend::with_string(&mut drawn, (WIDTH * FINE, HEIGHT * FINE)).into_drawing_area();
            self.draw(&area)
                .map_err(|e| ReportError::Plot { title: self.title.clone(), reason: e.to_string() })?;
        }
        // The backend's own opening tag fixes the size in pixels; the page decides the size here.
        let inside = drawn.split_once('>').map_or("", |(_, inside)| inside);
        let label = escaped(&format!("{}: {} over {}", self.title, self.y, self.x));
        let (w, h) = (WIDTH * FINE, HEIGHT * FINE);
        Ok(format!(
            "<svg class=\"plot\" role=\"img\" aria-label=\"{label}\" viewBox=\"0 0 {w} {h}\">{inside}"
        ))
    }

    fn draw<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        let (x, y) = (self.extent(false), self.extent(true));
        let mut chart = ChartBuilder::on(area)
            .margin(6 * FINE)
            .margin_right(14 * FINE)
            .x_label_area_size(48 * FINE)
            .y_label_area_size(66 * FINE)
            .build_cartesian_2d(Scale::new(x), Scale::new(y))?;
        let text = |size: u32| ("sans-serif", size * FINE).into_font().color(&INK);
        chart
            .configure_mesh()
            .x_desc(self.x)
            .y_desc(self.y)
            .label_style(text(17))
            .axis_desc_style(text(18))
            .axis_style(INK.stroke_width(FINE))
            .bold_line_style(GRID.stroke_width(FINE))
            .light_line_style(TRANSPARENT)
            .set_all_tick_mark_size(4 * FINE)
            .draw()?;
        if y.0 < 0.0 && y.1 > 0.0 {
            chart.draw_series(LineSeries::new([(x.0, 0.0), (x.1, 0.0)], GREY.stroke_width(FINE)))?;
        }
        for series in &self.series {
            series.draw(&mut chart, x, y)?;
        }
        area.present()
    }

    /// Range of the vertical (or horizontal) scale: all that is drawn, a little more, and zero if it is near.
    fn extent(&self, vertical: bool) -> (f64, f64) {
        let mut values: Vec<f64> =
            self.series.iter().flat_map(|series| series.mark.values(vertical)).collect();
        values.retain(|value| value.is_finite());
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if values.is_empty() {
            return (0.0, 1.0);
        }
        let span = (high - low).max(1e-6);
        let margin = if vertical { 0.08 * span } else { 0.03 * span };
        (low - margin, high + margin)
    }
}

impl Mark {
    fn values(&self, vertical: bool) -> Vec<f64> {
        match self {
            Self::Line(points) | Self::Dashed(points) | Self::Dots(points) | Self::Crosses(points) => {
                points.iter().map(|&(x, y)| if vertical { y } else { x }).collect()
            }
            Self::Bars(bars) if vertical => bars.iter().flat_map(|&(_, low, _, high)| [low, high]).collect(),
            Self::Bars(bars) => bars.iter().map(|&(x, ..)| x).collect(),
            Self::Band(low, high) if vertical => vec![*low, *high],
            Self::Band(..) => Vec::new(),
        }
    }

    /// The mark drawn small, 28 × 12, for the key.
    fn sample(&self, colour: &impl Display) -> String {
        match self {
            Self::Line(_) => format!("<path d=\"M1 6H27\" stroke=\"{colour}\" stroke-width=\"2\"/>"),
            Self::Dashed(_) => {
                format!(
                    "<path d=\"M1 6H27\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"7 4\"/>"
                )
            }
            Self::Dots(_) => format!("<circle cx=\"14\" cy=\"6\" r=\"3.5\" fill=\"{colour}\"/>"),
            Self::Crosses(_) => {
                format!(
                    "<path d=\"M11 3l6 6M17 3l-6 6\" stroke=\"{colour}\" stroke-width=\"2\" fill=\"none\"/>"
                )
            }
            Self::Bars(_) => format!(
                "<path d=\"M14 0V12M10 1H18M10 11H18\" stroke=\"{colour}\" stroke-width=\"1.5\"/><circle cx=\"14\" cy=\"6\" r=\"2.5\" fill=\"#fff\" stroke=\"{colour}\"/>"
            ),
            Self::Band(..) => format!(
                "<rect x=\"1\" y=\"1\" width=\"26\" height=\"10\" fill=\"{colour}\" opacity=\"0.25\"/>"
            ),
        }
    }
}

impl Series {
    /// Draws the mark; `x` and `y` are the ends of the scales.
    fn draw<DB: DrawingBackend>(
        &self,
        frame: &mut Frame<'_, DB>,
        x: (f64, f64),
        y: (f64, f64),
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        let (colour, pen) = (self.colour, self.colour.stroke_width(2 * FINE));
        match &self.mark {
            Mark::Line(points) => {
                frame.draw_series(LineSeries::new(thinned(points), pen))?;
            }
            Mark::Dashed(points) => {
                frame.draw_series(DashedLineSeries::new(thinned(points), 7 * FINE, 5 * FINE, pen))?;
            }
            Mark::Dots(points) => {
                frame.draw_series(finite(points).map(|p| Circle::new(p, 3 * FINE, colour.filled())))?;
            }
            Mark::Crosses(points) => {
                frame.draw_series(finite(points).map(|p| Cross::new(p, 3 * FINE, pen)))?;
            }
            Mark::Bars(bars) => {
                let whole = bars.iter().filter(|(x, low, mean, high)| (x + low + mean + high).is_finite());
                let bar = |&(x, low, mean, high)| ErrorBar::new_vertical(x, low, mean, high, pen, 7 * FINE);
                frame.draw_series(whole.map(bar))?;
            }
            Mark::Band(low, high) => {
                let corners = [(x.0, low.max(y.0)), (x.1, high.min(y.1))];
                frame.draw_series([Rectangle::new(corners, colour.mix(0.15).filled())])?;
            }
        }
        Ok(())
    }

    fn key(&self) -> String {
        let RGBColor(r, g, b) = self.colour;
        let sample = self.mark.sample(&format!("#{r:02x}{g:02x}{b:02x}"));
        let name = escaped(&self.name);
        format!(
            "<span class=\"key\"><svg viewBox=\"0 0 28 12\" aria-hidden=\"true\">{sample}</svg>{name}</span>"
        )
    }
}

/// Round places for the labels of a scale, about seven, and the decimals that tell them apart.
fn ticks((low, high): (f64, f64)) -> (Vec<f64>, usize) {
    let least = (high - low) / 8.0;
    let decade = 10f64.powf(least.log10().floor());
    let step =
        [1.0, 2.0, 5.0].map(|m| m * decade).into_iter().find(|step| *step >= least).unwrap_or(10.0 * decade);
    let places = (low / step).ceil() as i64..=(high / step).floor() as i64;
    // A step of exactly 0.1 has a logarithm a hair away from −1.
    let decimals = (-(step.log10() + 1e-9).floor()).clamp(0.0, 6.0);
    (places.map(|i| i as f64 * step).collect(), decimals as usize)
}

fn finite(points: &[(f64, f64)]) -> impl Iterator<Item = (f64, f64)> + '_ {
    points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite())
}

/// The line without points that no eye could see: of each stretch the lowest and the highest, in their order.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let points: Vec<(f64, f64)> = finite(points).collect();
    if points.len() <= MOST_POINTS {
        return points;
    }
    let stretch = points.len().div_ceil(MOST_POINTS / 2);
    let ends = |part: &[(f64, f64)]| {
        let at = |i: &usize, j: &usize| part[*i].1.total_cmp(&part[*j].1);
        let low = (0..part.len()).min_by(at).unwrap_or(0);
        let high = (0..part.len()).max_by(at).unwrap_or(0);
        [part[low.min(high)], part[low.max(high)]]
    };
    points.chunks(stretch).flat_map(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_text_and_odd_values_do_no_harm() {
        let odd = vec![(0.0, f64::NAN), (f64::INFINITY, 1.0), (1.0, 2.0), (3.0, -4.0)];
        let mark = |mark| Series { name: "a < b".to_owned(), colour: BLUE, mark };
        let series = vec![
            mark(Mark::Line(odd.clone())),
            mark(Mark::Dashed(odd.clone())),
            mark(Mark::Dots(odd.clone())),
            mark(Mark::Crosses(odd)),
            mark(Mark::Bars(vec![(1.0, f64::NAN, 0.0, 1.0), (2.0, -1.0, 0.0, 1.0)])),
            mark(Mark::Band(-1.0, 1.0)),
        ];
        let chart = Chart { title: "T & U".to_owned(), x: "position / mm", y: "error / µm", series };
        let figure = chart.figure().unwrap();
        assert!(
            figure.contains("<text") && figure.contains("position / mm") && figure.contains("error / µm")
        );
        assert!(figure.contains("T &amp; U") && figure.contains("a &lt; b") && !figure.contains("NaN"));
        let empty = Chart { title: String::new(), x: "", y: "", series: vec![] };
        assert!(empty.figure().is_ok());
    }

    #[test]
    fn labels_are_round_and_told_apart() {
        let table = [
            ((-2.3, 2.3), vec![-2.0, -1.0, 0.0, 1.0, 2.0], 0),
            ((21.26, 21.89), vec![21.3, 21.4, 21.5, 21.6, 21.7, 21.8], 1),
            ((0.0, 100.0), vec![0.0, 20.0, 40.0, 60.0, 80.0, 100.0], 0),
            ((0.4, 0.81), vec![0.4, 0.5, 0.6, 0.7, 0.8], 1),
            ((-1e-6, 1e-6), vec![-1e-6, -5e-7, 0.0, 5e-7, 1e-6], 6),
        ];
        for (ends, expected, decimals) in table {
            let (places, found) = ticks(ends);
            assert_eq!(found, decimals, "{ends:?}");
            assert_eq!(places.len(), expected.len(), "{places:?}");
            assert!(places.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }

    #[test]
    fn thinning_keeps_the_extremes() {
        let many: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), f64::from(i % 7919))).collect();
        let few = thinned(&many);
        assert!(few.len() <= MOST_POINTS && few.is_sorted_by(|a, b| a.0 <= b.0));
        assert!(few.iter().any(|p| p.1 == 7918.0) && few.iter().any(|p| p.1 == 0.0));
    }
}
