//! The sections of the page, in the order in which they are read.

use super::chart::{BLUE, Chart, GREY, INK, Mark, ORANGE, Series};
use super::html::{Table, definitions, embedded_png, escaped, number, signed};
use super::{AxisReport, Before, Report, ReportError, SettledStep, Verdict, capital};
use crate::axis::Approach;
use crate::iso230::{Iso230, evaluate};
use crate::readings::Readings;

const POSITION: &str = "position / mm";
const ERROR: &str = "error / µm";

/// Points of a drawn curve.
const CURVE_POINTS: usize = 200;

/// How far bars of the two directions stand apart, part of the range of the targets.
const BESIDE: f64 = 0.006;

pub(super) fn page(report: &Report) -> Result<String, ReportError> {
    let body = [
        header(report),
        headline(report),
        conditions(report),
        errors_before(report)?,
        degrees(report),
        errors_after(report)?,
        before_and_after(report)?,
        repeatability(report)?,
        iso_figures(report),
        iso_points(report),
        settled_step(report)?,
        temperatures(report)?,
        pictures(report),
        raw_files(report),
    ];
    let title = escaped(&report.title);
    let style = include_str!("style.css");
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style>\n{style}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
        body.concat()
    ))
}

fn header(report: &Report) -> String {
    let c = &report.conditions;
    let parts: Vec<&str> = [&c.preset, &c.date, &c.software]
        .into_iter()
        .filter(|part| !part.is_empty())
        .map(String::as_str)
        .collect();
    format!("<header><h1>{}</h1><p>{}</p></header>\n", escaped(&report.title), escaped(&parts.join(" · ")))
}

fn headline(report: &Report) -> String {
    if report.headline.is_empty() {
        return String::new();
    }
    let mut table = Table::new("wide words", "", &["figure", "paper A", "abbe", "verdict"]);
    for row in &report.headline {
        let (class, verdict) = match &row.verdict {
            Verdict::Met(text) => ("met", text),
            Verdict::Missed(text) => ("missed", text),
            Verdict::Stated(text) => ("", text),
        };
        table.row_with_verdict(&[row.figure.clone(), row.paper.clone(), row.found.clone()], class, verdict);
    }
    section("Result", "", &table.finish())
}

fn conditions(report: &Report) -> String {
    let c = &report.conditions;
    let pair = |name: &str, value: String| (name.to_owned(), value);
    let mut pairs = vec![
        pair("Stage", c.preset.clone()),
        pair("Seed", c.seed.map(|seed| seed.to_string()).unwrap_or_default()),
        pair("Software", c.software.clone()),
        pair("Date", c.date.clone()),
        pair("Warm-up", c.warm_up_s.map(|s| format!("{} min", number(s / 60.0, 0))).unwrap_or_default()),
        pair("Measured", runs(report, readings_before)),
        pair("Verified", runs(report, |a| Some(&a.after))),
    ];
    pairs.extend(c.more.iter().cloned());
    pairs.extend(report.axes.iter().flat_map(notes).map(|note| pair("Note", note)));
    section("Conditions", "", &definitions(&pairs))
}

fn readings_before(axis: &AxisReport) -> Option<&Readings> {
    axis.before.as_ref().map(|before| &before.readings)
}

/// The measurements of an axis in the order in which they were made.
fn measurements(axis: &AxisReport) -> impl Iterator<Item = (&'static str, &Readings)> {
    readings_before(axis).map(|r| ("before", r)).into_iter().chain([("after", &axis.after)])
}

/// How much was measured; empty if no axis has such readings.
fn runs(report: &Report, readings: impl Fn(&AxisReport) -> Option<&Readings>) -> String {
    let sentence = |a: &AxisReport| {
        let (r, axis) = (readings(a)?, capital(a.axis));
        Some(format!("{axis}: {} targets × {} runs × 2 directions", r.targets_mm().len(), r.runs()))
    };
    report.axes.iter().filter_map(sentence).collect::<Vec<_>>().join("; ")
}

/// What is odd about the readings of an axis.
fn notes(axis: &AxisReport) -> Vec<String> {
    let of = |(when, readings): (&str, &Readings)| {
        let sentence = |note: &dyn std::fmt::Display| format!("{} {when}: {note}", capital(axis.axis));
        readings.notes().iter().map(|note| sentence(note)).collect::<Vec<_>>()
    };
    measurements(axis).flat_map(of).collect()
}

fn errors_before(report: &Report) -> Result<String, ReportError> {
    let text = "Error is actual minus commanded position, measured by the interferometer. Marks are means of all runs; \
                the curve is the fitted polynomial that the compensation subtracts.";
    pair_of_charts(report, "Error before compensation", text, |axis| {
        let before = axis.before.as_ref()?;
        Some(Chart {
            title: format!("{}: error and fit of degree {}", capital(axis.axis), before.fit.chosen.degree),
            x: POSITION,
            y: ERROR,
            series: before_series(before),
        })
    })
}

fn before_series(before: &Before) -> Vec<Series> {
    let evaluation = evaluate(&before.readings);
    let polynomial = &before.fit.polynomial;
    let [low, high] = polynomial.range_mm();
    let at = |i: usize| low + (high - low) * i as f64 / CURVE_POINTS as f64;
    let curve = (0..=CURVE_POINTS).map(|i| (at(i), polynomial.value_um(at(i)))).collect();
    let [up, down] = means(&evaluation);
    vec![
        series("fitted polynomial", INK, Mark::Line(curve)),
        series("mean, approached upwards", BLUE, Mark::Dots(up)),
        series("mean, approached downwards", ORANGE, Mark::Crosses(down)),
    ]
}

/// Means of the upward and the downward approach.
fn means(evaluation: &Iso230) -> [Vec<(f64, f64)>; 2] {
    let points = &evaluation.points;
    [
        points.iter().map(|p| (p.target_mm, p.mean_up_um)).collect(),
        points.iter().map(|p| (p.target_mm, p.mean_down_um)).collect(),
    ]
}

fn degrees(report: &Report) -> String {
    let tables = report.axes.iter().filter_map(|axis| {
        let fit = &axis.before.as_ref()?.fit;
        let caption = format!("{} axis", capital(axis.axis));
        let mut table = Table::new("", &caption, &["degree", "SSE / µm²", "R²", "leave-one-out / µm"]);
        for d in &fit.degrees {
            let chosen = d.degree == fit.chosen.degree;
            let name = if chosen { format!("{} (chosen)", d.degree) } else { d.degree.to_string() };
            let cells = [name, number(d.sse_um2, 3), number(d.r2, 6), number(d.cv_um, 3)];
            table.row(if chosen { "chosen" } else { "" }, &cells);
        }
        let formula = escaped(&monomial(&fit.polynomial.monomial_um()));
        Some(format!("<div>{}<p class=\"note\">{formula}</p></div>", table.finish()))
    });
    let text = "SSE falls and R² rises with every degree, whether it means anything or not. The degree is therefore chosen \
                by leave-one-out cross-validation, the root mean square error of predicting each point from all the others: \
                the lowest degree within 5 % of the best.";
    let tables: String = tables.collect();
    if tables.is_empty() {
        tables
    } else {
        section("Choice of degree", text, &format!("<div class=\"pair\">{tables}</div>\n"))
    }
}

/// `e(x) = …` as a paper prints it.
fn monomial(coefficients: &[f64]) -> String {
    let term = |(k, c): (usize, &f64)| {
        let sign = match (k, c.is_sign_negative()) {
            (0, false) => "",
            (0, true) => "−",
            (_, false) => " + ",
            (_, true) => " − ",
        };
        let power: String = k.to_string().chars().map(superscript).collect();
        let x = match k {
            0 => String::new(),
            1 => " x".to_owned(),
            _ => format!(" x{power}"),
        };
        format!("{sign}{}{x}", significant(c.abs()))
    };
    let terms: String = coefficients.iter().enumerate().map(term).collect();
    format!("e(x) = {terms}  (µm, x in mm)")
}

fn superscript(digit: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    digit.to_digit(10).map_or(digit, |d| DIGITS[d as usize])
}

/// Five significant digits; powers of ten where they are shorter.
fn significant(value: f64) -> String {
    if value != 0.0 && value < 1e-4 {
        let text = format!("{value:.4e}");
        let Some((digits, exponent)) = text.split_once("e-") else { return text };
        let exponent: String = exponent.chars().map(superscript).collect();
        return format!("{digits}·10⁻{exponent}");
    }
    let before_point = value.max(1e-4).log10().floor();
    number(value, (4.0 - before_point).clamp(0.0, 8.0) as usize)
}

fn errors_after(report: &Report) -> Result<String, ReportError> {
    let text = "With the compensation on, at new targets. Small marks are single readings.";
    pair_of_charts(report, "What is left", text, |axis| {
        Some(Chart {
            title: format!("{}: error after compensation", capital(axis.axis)),
            x: POSITION,
            y: ERROR,
            series: after_series(axis, report.limits.mean_um),
        })
    })
}

fn after_series(axis: &AxisReport, limit_um: f64) -> Vec<Series> {
    let mean = evaluate(&axis.after).points.iter().map(|p| (p.target_mm, p.mean_um)).collect();
    let singles = |approach| {
        let rows = axis.after.deviations_um(approach);
        let targets = axis.after.targets_mm().iter();
        targets.zip(rows).flat_map(|(&x, row)| row.into_iter().map(move |um| (x, um))).collect()
    };
    vec![
        series(&format!("bound of the means, ±{limit_um} µm"), GREY, Mark::Band(-limit_um, limit_um)),
        series("upwards", BLUE, Mark::Dots(singles(Approach::Up))),
        series("downwards", ORANGE, Mark::Crosses(singles(Approach::Down))),
        series("mean of both", INK, Mark::Line(mean)),
    ]
}

fn before_and_after(report: &Report) -> Result<String, ReportError> {
    let text = "Means of both directions on one scale.";
    pair_of_charts(report, "Before and after", text, |axis| {
        let before = readings_before(axis)?;
        let mean = |readings: &Readings| {
            evaluate(readings).points.iter().map(|p| (p.target_mm, p.mean_um)).collect()
        };
        Some(Chart {
            title: format!("{}: {}", capital(axis.axis), gain(before, &axis.after)),
            x: POSITION,
            y: ERROR,
            series: vec![
                series("before", ORANGE, Mark::Dashed(mean(before))),
                series("after", BLUE, Mark::Line(mean(&axis.after))),
            ],
        })
    })
}

/// "A 233 → 3.1 µm".
fn gain(before: &Readings, after: &Readings) -> String {
    let a = |readings: &Readings| evaluate(readings).figures.a;
    format!("ISO 230-2 A {} → {} µm", number(a(before), 1), number(a(after), 2))
}

fn repeatability(report: &Report) -> Result<String, ReportError> {
    let text = "Mean of all runs at each target; bars reach from the lowest to the highest reading. \
                Upwards stands left of the target, downwards right of it.";
    pair_of_charts(report, "Repeatability", text, |axis| {
        Some(Chart {
            title: format!("{}: mean, lowest and highest of {} runs", capital(axis.axis), axis.after.runs()),
            x: POSITION,
            y: ERROR,
            series: vec![
                series("upwards", BLUE, bars(&axis.after, Approach::Up)),
                series("downwards", ORANGE, bars(&axis.after, Approach::Down)),
            ],
        })
    })
}

fn bars(readings: &Readings, approach: Approach) -> Mark {
    let targets = readings.targets_mm();
    let length = targets[targets.len() - 1] - targets[0];
    let aside = match approach {
        Approach::Up => -BESIDE * length,
        Approach::Down => BESIDE * length,
    };
    let bar = |(target, row): (&f64, Vec<f64>)| {
        let low = row.iter().copied().fold(f64::INFINITY, f64::min);
        let high = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (target + aside, low, row.iter().sum::<f64>() / row.len() as f64, high)
    };
    Mark::Bars(targets.iter().zip(readings.deviations_um(approach)).map(bar).collect())
}

fn iso_figures(report: &Report) -> String {
    if report.axes.is_empty() {
        return String::new();
    }
    let columns = |a: &AxisReport| {
        let name = |when| format!("{} {when} / µm", capital(a.axis));
        measurements(a).map(|(when, readings)| (name(when), evaluate(readings))).collect::<Vec<_>>()
    };
    let (names, evaluations): (Vec<String>, Vec<Iso230>) = report.axes.iter().flat_map(columns).unzip();
    let head: Vec<&str> = ["figure", "meaning"].into_iter().chain(names.iter().map(String::as_str)).collect();
    let mut table = Table::new("wide second-words", "", &head);
    for (i, (letter, meaning)) in MEANINGS.into_iter().enumerate() {
        let values = evaluations.iter().map(|e| number(e.figures.named()[i].1, 3));
        table.row("", &[letter.to_owned(), meaning.to_owned()].into_iter().chain(values).collect::<Vec<_>>());
    }
    let drift = evaluations.iter().map(|e| number(e.drift.span_um, 3));
    let label = ["drift".to_owned(), "range of the runs' mean shifts (not in the standard)".to_owned()];
    table.row("", &label.into_iter().chain(drift).collect::<Vec<_>>());
    section("ISO 230-2:2014", "Coverage factor 2; ↑ and ↓ are the directions of approach.", &table.finish())
}

/// In the order of [`Figures::named`](crate::iso230::Figures::named).
const MEANINGS: [(&str, &str); 12] = [
    ("A", "accuracy, bidirectional"),
    ("A↑", "accuracy, upwards"),
    ("A↓", "accuracy, downwards"),
    ("R", "repeatability, bidirectional"),
    ("R↑", "repeatability, upwards"),
    ("R↓", "repeatability, downwards"),
    ("E", "systematic deviation, bidirectional"),
    ("E↑", "systematic deviation, upwards"),
    ("E↓", "systematic deviation, downwards"),
    ("M", "range of the mean bidirectional deviation"),
    ("B", "reversal value"),
    ("B̄", "mean reversal value"),
];

fn iso_points(report: &Report) -> String {
    let tables = report.axes.iter().map(|axis| {
        let caption = format!("{} axis after compensation, µm", capital(axis.axis));
        let head = ["target / mm", "x̄↑", "x̄↓", "B", "s↑", "s↓", "R"];
        let mut table = Table::new("wide", &caption, &head);
        for p in evaluate(&axis.after).points {
            let cells = [
                number(p.target_mm, 4),
                signed(p.mean_up_um, 2),
                signed(p.mean_down_um, 2),
                signed(p.b_um, 2),
                number(p.s_up_um, 2),
                number(p.s_down_um, 2),
                number(p.r_um, 2),
            ];
            table.row("", &cells);
        }
        format!("<div>{}</div>", table.finish())
    });
    let tables: String = tables.collect();
    if tables.is_empty() {
        tables
    } else {
        section("Point by point", "", &format!("<div class=\"pair\">{tables}</div>\n"))
    }
}

fn settled_step(report: &Report) -> Result<String, ReportError> {
    let Some(step) = &report.step else { return Ok(String::new()) };
    let text = format!(
        "“Done” is a measurement, not the end of the trajectory: the position stayed within ±{} µm for {} ms, and the move was \
         declared done at {} s.",
        number(step.window_um, 2),
        number(step.dwell_s * 1e3, 0),
        number(step.done_s, 3)
    );
    let charts = [whole_step(step).figure()?, end_of_step(step).figure()?].concat();
    Ok(section("A settled move", &text, &format!("<div class=\"pair\">{charts}</div>\n")))
}

fn whole_step(step: &SettledStep) -> Chart {
    let over_time = |values: &[f64]| step.t_s.iter().copied().zip(values.iter().copied()).collect();
    Chart {
        title: format!("{}: position and set-point", capital(step.axis)),
        x: "time / s",
        y: POSITION,
        series: vec![
            series("position", BLUE, Mark::Line(over_time(&step.actual_mm))),
            series("set-point", ORANGE, Mark::Dashed(over_time(&step.set_mm))),
        ],
    }
}

/// The distance to the target, from when it is last ten windows away.
fn end_of_step(step: &SettledStep) -> Chart {
    let target = step.set_mm.last().copied().unwrap_or_default();
    let left: Vec<(f64, f64)> =
        step.t_s.iter().zip(&step.actual_mm).map(|(&t, &x)| (t, (x - target) * 1e3)).collect();
    let far = left.iter().rposition(|(_, um)| um.abs() > 10.0 * step.window_um).unwrap_or(0);
    let near = left[far.min(left.len())..].to_vec();
    let height = near.iter().map(|(_, um)| um.abs()).fold(step.window_um * 1.5, f64::max);
    Chart {
        title: format!("{}: distance to the target", capital(step.axis)),
        x: "time / s",
        y: "distance / µm",
        series: vec![
            series("in-position window", GREY, Mark::Band(-step.window_um, step.window_um)),
            series("position minus target", BLUE, Mark::Line(near)),
            series(
                "declared done",
                ORANGE,
                Mark::Dashed(vec![(step.done_s, -height), (step.done_s, height)]),
            ),
        ],
    }
}

fn temperatures(report: &Report) -> Result<String, ReportError> {
    if report.temperatures.is_empty() {
        return Ok(String::new());
    }
    let colours = [BLUE, ORANGE, INK, GREY].into_iter().cycle();
    let minutes = |readings: &[(f64, f64)]| readings.iter().map(|(s, c)| (s / 60.0, *c)).collect();
    let logs = report.temperatures.iter().zip(colours);
    let chart = Chart {
        title: "Temperature".to_owned(),
        x: "time / min",
        y: "temperature / °C",
        series: logs
            .map(|(log, colour)| series(&log.name, colour, Mark::Line(minutes(&log.readings))))
            .collect(),
    };
    let mut table = Table::new("", "Readings in °C", &["thermometer", "mean", "lowest", "highest"]);
    for log in &report.temperatures {
        let values = || log.readings.iter().map(|(_, c)| *c);
        let mean = values().sum::<f64>() / values().count().max(1) as f64;
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        table.row("", &[log.name.clone(), number(mean, 2), number(low, 2), number(high, 2)]);
    }
    let both = format!("<div class=\"pair\">{}<div>{}</div></div>\n", chart.figure()?, table.finish());
    Ok(section("Thermometers", "", &both))
}

fn pictures(report: &Report) -> String {
    let all: String =
        report.images.iter().map(|picture| embedded_png(&picture.png, &picture.caption)).collect();
    if all.is_empty() { all } else { section("Pictures", "", &all) }
}

fn raw_files(report: &Report) -> String {
    if report.raw_files.is_empty() {
        return String::new();
    }
    let mut table = Table::new("words", "", &["file", "what is in it"]);
    for file in &report.raw_files {
        table.row("", &[file.path.clone(), file.what.clone()]);
    }
    section(
        "Raw data",
        "Everything above can be recomputed from these files, which lie beside this page.",
        &table.finish(),
    )
}

/// A heading, a sentence (plain text, may be empty) and what belongs to them (HTML).
fn section(heading: &str, text: &str, html: &str) -> String {
    let text = if text.is_empty() { String::new() } else { format!("<p>{}</p>\n", escaped(text)) };
    format!("<section>\n<h2>{}</h2>\n{text}{html}</section>\n", escaped(heading))
}

/// One chart an axis, side by side; axes without one are left out, and so is a section without any.
fn pair_of_charts(
    report: &Report,
    heading: &str,
    text: &str,
    chart: impl Fn(&AxisReport) -> Option<Chart>,
) -> Result<String, ReportError> {
    let charts = report.axes.iter().filter_map(chart);
    let figures = charts.map(|chart| chart.figure()).collect::<Result<String, _>>()?;
    if figures.is_empty() {
        return Ok(figures);
    }
    Ok(section(heading, text, &format!("<div class=\"pair\">{figures}</div>\n")))
}

fn series(name: &str, colour: plotters::style::RGBColor, mark: Mark) -> Series {
    Series { name: name.to_owned(), colour, mark }
}
