use abbe_metrology::Axis;
use abbe_metrology::compensation::{
    AxisCompensation, Circumstances, Compensation, CompensationFault, CurveFault, ErrorCurve, INVERSE_STEPS,
};
use abbe_metrology::fit::{ErrorPoint, choose};
use abbe_metrology::polynomial::Polynomial;
use proptest::prelude::*;

/// Paper A's Y axis: µm over mm.
fn paper_y(x: f64) -> f64 {
    0.0168 * x * x + 0.6397 * x + 1.021
}

fn paper_y_axis() -> AxisCompensation {
    let points: Vec<ErrorPoint> = (0..=10)
        .map(|i| ErrorPoint { x_mm: 10.0 * f64::from(i), error_um: paper_y(10.0 * f64::from(i)) })
        .collect();
    let circumstances =
        Circumstances { runs: 5, readings: 110, temperature_c: Some(21.53), warm_up_s: Some(1800.0) };
    AxisCompensation::from_fit(&choose(&points, 8).unwrap(), circumstances).unwrap()
}

fn both_axes() -> Compensation {
    let mut x = paper_y_axis();
    x.circumstances.temperature_c = None;
    let (date, preset) = ("2026-03-14".to_owned(), "microscope-100".to_owned());
    Compensation { date, preset, x: Some(x), y: Some(paper_y_axis()) }
}

/// The paper subtracts the error at the target once; the table then errs by what the curve changes on the way.
#[test]
fn one_subtraction_leaves_what_the_paper_left_and_the_inverse_nothing() {
    let curve = paper_y_axis().curve;
    let left_um = |target: f64, command: f64| (command - target) * 1e3 + paper_y(command);
    for (target, expected) in [(90.0, -0.71), (100.0, -0.93)] {
        let once = left_um(target, target - curve.error_um(target) / 1e3);
        assert!((once - expected).abs() < 0.005, "one subtraction leaves {once} µm at {target} mm");
        let inverse = curve.inverse(target);
        assert!(left_um(target, inverse.command_mm).abs() < 1e-4, "the inverse leaves less than 0.1 nm");
        assert!(inverse.steps <= 5, "{} steps", inverse.steps);
    }
}

#[test]
fn outside_the_range_the_curve_is_its_end_tangent() {
    let curve = paper_y_axis().curve;
    let slope = |x: f64| 2.0 * 0.0168 * x + 0.6397;
    assert!((curve.error_um(104.0) - (paper_y(100.0) + 4.0 * slope(100.0))).abs() < 1e-9);
    assert!((curve.error_um(-3.0) - (paper_y(0.0) - 3.0 * slope(0.0))).abs() < 1e-9);
    assert!((curve.error_um(100.0) - paper_y(100.0)).abs() < 1e-9);
}

#[test]
fn a_written_file_reads_back_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("compensation.toml");
    both_axes().write(&path).unwrap();
    assert_eq!(Compensation::read(&path).unwrap(), both_axes());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let only_y = Compensation { x: None, ..both_axes() };
    let back = Compensation::parse("c.toml", &only_y.to_string()).unwrap();
    assert!(back.axis(Axis::X).is_none() && back.axis(Axis::Y).is_some());
}

#[test]
fn curves_that_no_stage_has_are_refused() {
    let curve = |range, c: &[f64]| ErrorCurve::new(Polynomial::new(range, c.to_vec()).unwrap());
    assert!(curve([0.0, 100.0], &[0.0, 999.0]).is_ok());
    assert!(matches!(curve([0.0, 100.0], &[2.0, 999.0]), Err(CurveFault::TooLarge { x_mm: 100.0, .. })));
    assert!(curve([0.0, 10.0], &[0.0, 249.0]).is_ok());
    assert!(matches!(curve([0.0, 10.0], &[0.0, 250.1]), Err(CurveFault::TooSteep { .. })));
    assert!(matches!(curve([0.0, 1.0], &[f64::MAX, f64::MAX, f64::MAX]), Err(CurveFault::TooLarge { .. })));
}

const FILE: &str = "version = 1\ndate = \"2026-03-14\"\npreset = \"microscope-100\"\n\n[y]\ndegree = 1\n\
                    range_mm = [0.0, 100.0]\nchebyshev_um = [45.0, 44.0]\nsse_um2 = 0.5\nr2 = 0.99\ncv_um = 0.3\n\
                    runs = 5\nreadings = 110\ntemperature_c = 21.5\nwarm_up_s = 1800.0\n";

/// The one sentence that refuses [`FILE`] with `new` in place of `old`.
fn refusal(old: &str, new: &str) -> String {
    let text = FILE.replacen(old, new, 1);
    assert_ne!(text, FILE);
    let sentence = Compensation::parse("c.toml", &text).unwrap_err().to_string();
    assert!(!sentence.contains('\n'), "{sentence}");
    sentence
}

#[test]
fn an_unknown_key_is_answered_with_file_line_and_the_nearest_valid_one() {
    let table = [
        ("degree = 1", "degre = 1", 6, "degre", "degree"),
        ("range_mm", "range", 7, "range", "range_mm"),
        ("chebyshev_um", "chebychev_um", 8, "chebychev_um", "chebyshev_um"),
        ("sse_um2", "sse", 9, "sse", "sse_um2"),
        ("warm_up_s", "warmup", 15, "warmup", "warm_up_s"),
        ("[y]\n", "presets = 3\n[y]\n", 5, "presets", "preset"),
        ("[y]", "[Y]", 5, "Y", "y"),
        ("[y]", "[X]", 5, "X", "x"),
        ("date", "\"da`te\"", 2, "da`te", "date"),
        ("date", "\"da\\nte\"", 2, "da te", "date"),
    ];
    for (old, new, line, key, nearest) in table {
        let expected =
            format!("c.toml, line {line}: unknown key `{key}`; the nearest valid one is `{nearest}`");
        assert_eq!(refusal(old, new), expected);
    }
}

#[test]
fn a_number_that_is_not_finite_is_refused_with_its_line() {
    let table = [
        ("100.0", 7, "y.range_mm"),
        ("45.0", 8, "y: coefficient 0"),
        ("44.0", 8, "y: coefficient 1"),
        ("0.5", 9, "y.sse_um2"),
        ("0.99", 10, "y.r2"),
        ("0.3", 11, "y.cv_um"),
        ("21.5", 14, "y.temperature_c"),
        ("1800.0", 15, "y.warm_up_s"),
    ];
    for (number, line, what) in table {
        for (word, printed) in [("nan", "NaN"), ("inf", "inf"), ("-inf", "-inf")] {
            let sentence = refusal(number, word);
            let expected = format!("c.toml, line {line}: {what} is {printed}, expected ");
            assert!(sentence.starts_with(&expected), "{sentence}\nexpected {expected}");
        }
    }
    assert!(refusal("45.0", "1e999").starts_with("c.toml, line 8: "));
    // Lists over several lines: the line of the number, not of the list.
    let coefficient = refusal("[45.0, 44.0]", "[\n  45.0,\n  nan,\n]");
    assert!(coefficient.starts_with("c.toml, line 10: y: coefficient 1 is NaN"), "{coefficient}");
    let end = refusal("[0.0, 100.0]", "[\n  0.0,\n  inf,\n]");
    assert!(end.starts_with("c.toml, line 9: y.range_mm is inf, expected a finite number"), "{end}");
}

#[test]
fn every_fault_of_a_file_names_file_line_and_value() {
    assert!(Compensation::parse("c.toml", FILE).is_ok());
    let table = [
        ("runs = 5\n", "", "c.toml, line 5: missing field `runs`"),
        ("version = 1", "version = 2", "c.toml, line 1: version 2 is not known, expected 1"),
        ("[0.0, 100.0]", "[100.0, 0.0]", "c.toml, line 7: y: the range 100 to 0 mm is empty or inverted"),
        (
            "degree = 1",
            "degree = 2",
            "c.toml, line 6: y.degree is 2 but there are 2 coefficients, expected degree + 1",
        ),
        ("45.0", "990.0", "c.toml, line 8: y: the error of 1034.0 µm at 100.000 mm is beyond ±1000 µm"),
        ("[0.0, 100.0]", "[0.0, 1.0]", "c.toml, line 8: y: the error changes by 0.0880 mm per mm at 0"),
        ("0.5", "-0.5", "c.toml, line 9: y.sse_um2 is -0.5, expected a number from 0 up"),
        ("1800.0", "-1.0", "c.toml, line 15: y.warm_up_s is -1, expected a time in s from 0 up"),
        ("21.5", "\"warm\"", "c.toml, line 14: invalid type: string \"warm\", expected f64"),
        ("runs = 5", "runs = ", "c.toml, line 12: "),
    ];
    for (old, new, expected) in table {
        let sentence = refusal(old, new);
        assert!(sentence.starts_with(expected), "{sentence}\nexpected {expected}");
    }
    let no_axis = Compensation::parse("c.toml", FILE.split("[y]").next().unwrap()).unwrap_err();
    assert!(matches!(no_axis.fault, CompensationFault::NoAxis));
    let absent = Compensation::read("absent.toml".as_ref()).unwrap_err();
    assert!(matches!(absent.fault, CompensationFault::Unreadable(_)));
}

proptest! {
    #[test]
    fn any_text_is_answered_without_panic(text in "\\PC{0,200}", tail in "[xy\\[\\]=0-9.\\n]{0,100}") {
        let _ = Compensation::parse("fuzz", &text);
        let _ = Compensation::parse("fuzz", &format!("{FILE}{tail}"));
    }

    /// Any accepted curve, inside its range and far outside: the inverse is right to 0.1 nm and never runs out of steps.
    #[test]
    fn the_inverse_always_converges(
        coefficients in prop::collection::vec(-300.0..300.0f64, 1..8),
        low in -500.0..500.0f64,
        length in 1.0..500.0f64,
        target in -2000.0..2000.0f64,
    ) {
        let polynomial = Polynomial::new([low, low + length], coefficients).unwrap();
        if let Ok(curve) = ErrorCurve::new(polynomial) {
            let inverse = curve.inverse(target);
            let left_mm = inverse.command_mm + curve.error_um(inverse.command_mm) / 1e3 - target;
            prop_assert!(left_mm.abs() <= 1e-10, "left {} mm", left_mm);
            prop_assert!(inverse.steps <= INVERSE_STEPS);
        }
    }
}
