use abbe_metrology::readings::Readings;
use abbe_metrology::report::{
    AxisReport, Before, Conditions, Picture, RawFile, Report, SettledStep, Verdict, headline,
    temperature_logs,
};
use abbe_metrology::verify::Limits;
use abbe_metrology::{Axis, fit, iso230};

fn hand_computed() -> Readings {
    Readings::parse("hand_computed.csv", include_bytes!("../data/hand_computed.csv")).unwrap()
}

fn axis(axis: Axis) -> AxisReport {
    let readings = hand_computed();
    let fit = fit::choose(&fit::mean_error(&iso230::evaluate(&readings)), 8).unwrap();
    AxisReport { axis, before: Some(Before { readings, fit }), after: hand_computed() }
}

fn verified_only(axis: Axis) -> AxisReport {
    AxisReport { axis, before: None, after: hand_computed() }
}

fn full() -> Report {
    page_of(vec![axis(Axis::X), axis(Axis::Y)])
}

/// A report with everything that does not belong to an axis, and these axes.
fn page_of(axes: Vec<AxisReport>) -> Report {
    let t_s: Vec<f64> = (0..100).map(|i| f64::from(i) * 0.01).collect();
    Report {
        title: "Stage <script>alert('1')</script> & \"more\"".into(),
        conditions: Conditions {
            preset: "microscope-100".into(),
            seed: Some(7),
            more: vec![("<i>name".into(), "<i>value".into())],
            ..Conditions::default()
        },
        headline: headline(&axes, &Limits::default()),
        axes,
        limits: Limits::default(),
        step: Some(SettledStep {
            axis: Axis::X,
            set_mm: vec![1.0; 100],
            actual_mm: t_s.iter().map(|t| 1.0 - 0.5 * (-20.0 * t).exp()).collect(),
            t_s,
            window_um: 0.3,
            dwell_s: 0.05,
            done_s: 0.6,
        }),
        temperatures: temperature_logs(
            &["scale<".into()],
            &[abbe_metrology::measure::TemperatureRecord { elapsed_s: 60.0, celsius: vec![21.5] }],
        ),
        images: vec![Picture { png: b"foobar".to_vec(), caption: "a > b".into() }],
        raw_files: vec![RawFile { path: "measure/<x>.csv".into(), what: "readings".into() }],
    }
}

#[test]
fn the_page_is_self_contained_and_every_value_is_escaped() {
    let page = full().html().unwrap();
    assert!(!page.contains("http") && !page.contains("<script") && !page.contains("url("));
    assert!(
        !page.contains("<i>") && page.contains("&lt;i&gt;value") && page.contains("measure/&lt;x&gt;.csv")
    );
    assert!(page.contains("data:image/png;base64,Zm9vYmFy\""));
    assert!(page.contains("scale&lt;") && page.contains("a &gt; b"));
    assert!(!page.contains("NaN") && !page.contains("inf"));
}

#[test]
fn every_section_and_plot_is_there() {
    let page = full().html().unwrap();
    let expected = [
        "Result",
        "Conditions",
        "Error before compensation",
        "Choice of degree",
        "What is left",
        "Before and after",
        "Repeatability",
        "ISO 230-2:2014",
        "Point by point",
        "A settled move",
        "Thermometers",
        "Pictures",
        "Raw data",
    ];
    assert_eq!(texts(&page, "h2"), expected);
    // Four pairs of plots, two of the move, one of the temperatures; each with real text in it.
    let plots: Vec<&str> = page.split("<svg class=\"plot\"").skip(1).collect();
    assert_eq!(plots.len(), 11);
    assert!(plots.iter().all(|plot| plot.split("</svg>").next().unwrap().matches("<text").count() > 8));
    assert_eq!(page.matches("<section>").count(), page.matches("</section>").count());
}

/// What stands between every `<tag>` and its end.
fn texts<'a>(page: &'a str, tag: &str) -> Vec<&'a str> {
    let (opening, closing) = (format!("<{tag}>"), format!("</{tag}>"));
    let inside = page.split(opening.as_str()).skip(1);
    inside.map(|rest| rest.split(closing.as_str()).next().unwrap()).collect()
}

#[test]
fn a_verification_alone_is_a_complete_page() {
    let page = page_of(vec![verified_only(Axis::X), verified_only(Axis::Y)]).html().unwrap();
    let expected = [
        "Result",
        "Conditions",
        "What is left",
        "Repeatability",
        "ISO 230-2:2014",
        "Point by point",
        "A settled move",
        "Thermometers",
        "Pictures",
        "Raw data",
    ];
    assert_eq!(texts(&page, "h2"), expected);
    let plots = [
        "X: error after compensation",
        "Y: error after compensation",
        "X: mean, lowest and highest of 5 runs",
        "Y: mean, lowest and highest of 5 runs",
        "X: position and set-point",
        "X: distance to the target",
        "Temperature",
    ];
    assert_eq!(texts(&page, "h3"), plots);
    let conditions = texts(&page, "dt");
    assert!(conditions.contains(&"Verified") && !conditions.contains(&"Measured"));
    let columns = texts(&page, "th");
    assert!(columns.contains(&"X after / µm") && columns.contains(&"Y after / µm"));
    // Neither a row nor a column nor a sentence may speak of what was never measured.
    assert!(!page.to_lowercase().contains("before") && !page.contains("raw stage"));
    assert!(
        ["Mean error per point", "Worst single error", "Spread of", "accuracy A"]
            .iter()
            .all(|figure| { texts(&page, "td").iter().any(|cell| cell.contains(figure)) })
    );
}

#[test]
fn an_axis_without_before_is_left_out_where_the_other_has_it() {
    let page = page_of(vec![axis(Axis::X), verified_only(Axis::Y)]).html().unwrap();
    assert_eq!(texts(&page, "h2").len(), 13);
    let (plots, columns) = (texts(&page, "h3"), texts(&page, "th"));
    let of = |axis: &str| plots.iter().filter(|title| title.starts_with(axis)).count();
    assert_eq!([of("X: "), of("Y: ")], [6, 2], "X has two plots more, and both of the move");
    assert!(columns.contains(&"X before / µm") && !columns.contains(&"Y before / µm"));
    assert!(page.contains("<td>X +3 µm at 40 mm</td>") && page.contains("<caption>X axis</caption>"));
    assert!(page.contains("<dd>X: 5 targets × 5 runs × 2 directions</dd>"));
    assert!(!page.contains("<caption>Y axis</caption>"));
}

#[test]
fn the_headline_states_figures_and_verdicts() {
    let rows = headline(&[axis(Axis::X)], &Limits::default());
    let found: Vec<&str> = rows.iter().map(|row| row.found.as_str()).collect();
    assert_eq!(found, ["X +3 µm at 40 mm", "X −1.00 … +3.00 µm", "X +3.10 µm", "X 1.00 µm", "X 4.40 µm"]);
    let verdicts: Vec<&Verdict> = rows.iter().map(|row| &row.verdict).collect();
    assert_eq!(*verdicts[1], Verdict::Missed("✗ beyond ±2 µm".into()));
    assert_eq!(*verdicts[4], Verdict::Met("✓ within 5 µm".into()));
}

#[test]
fn an_empty_report_is_a_page_without_sections() {
    let page = Report::default().html().unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    assert_eq!(page.matches("<svg").count(), 0);
}

#[test]
fn the_page_is_the_same_every_time_and_arrives_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    full().write(&path).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), full().html().unwrap());
    assert!(full().write(folder.path().join("no/report.html").as_ref()).is_err());
}
