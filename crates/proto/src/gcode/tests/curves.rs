//! Arcs and sines against plain geometry.

use super::*;
use proptest::prelude::*;

/// A length of any size up to 10 m, either sign.
fn coordinate() -> impl Strategy<Value = i64> {
    (-10_000_000_000_000_i64..=10_000_000_000_000, 0_u32..40).prop_map(|(pm, shift)| pm >> shift)
}

fn arc(from: Place, line: &str) -> Result<Arc, Error> {
    let mut state = State::new(from);
    match read(&mut state, format!("F1 {line}").as_bytes())?.action {
        Some(Action::Move(Move { path: Path::Arc(arc), .. })) => Ok(arc),
        other => panic!("{line} gives {other:?}"),
    }
}

/// Twice the area between the ways from the centre to the ends: positive if the second lies to the left.
fn left(arc: &Arc, from: Place, to: Place) -> i128 {
    let way = |there: Place| [0, 1].map(|axis| i128::from(there[axis].pm() - arc.centre[axis].pm()));
    let ([x0, y0], [x1, y1]) = (way(from), way(to));
    x0 * y1 - y0 * x1
}

fn distance(one: Place, other: Place) -> f64 {
    (one[0].pm() as f64 - other[0].pm() as f64).hypot(one[1].pm() as f64 - other[1].pm() as f64)
}

/// The planner looks at both radii, too: an arc that is read must be one to it.
#[test]
fn the_largest_mismatch_and_the_smallest_radius_are_arcs_to_the_planner() {
    let planned = |line: &str| {
        let arc = arc([Pos::ZERO; 2], line).unwrap();
        let mut state = State::new([Pos::ZERO; 2]);
        read(&mut state, format!("F1 {line}").as_bytes()).unwrap();
        let float = |place: Place| place.map(|pos| pos.pm() as f64);
        let to = float(state.position());
        let counterclockwise = arc.turn == Turn::Counterclockwise;
        abbe_core::plan::curve::Arc::new([0.0; 2], to, float(arc.centre), counterclockwise).is_some()
    };
    // A tenth of the radius, below and above it; radii of a few picometres.
    for line in [
        "G3 X-0.01 Y0.009 I-0.01",
        "G3 X-0.01 Y0.011 I-0.01",
        "G2 X0.000000001 Y0.000000001 I0.000000001",
        "G2 X0.000000003 Y0.000000002 R0.000000003",
    ] {
        assert!(planned(line), "{line}");
    }
    // Of a picometre rounding leaves no centre.
    let nothing = arc([Pos::ZERO; 2], "G3 X0.000000001 R0.000000001").map_err(|error| error.fault);
    assert_eq!(nothing, Err(Fault::NoRadius));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, ..ProptestConfig::default() })]

    /// The centre lies at the radius from both ends, on the side that sense and sign choose, for chords and radii of any
    /// proportion. Bound: √2 pm for a centre within 1 pm in each coordinate, and what `f64` adds here.
    #[test]
    fn a_radius_gives_its_centre(x in coordinate(), y in coordinate(), dx in coordinate(), dy in coordinate(),
                                 longer in 0_i64..1_000_000_000_000, clockwise: bool, short: bool) {
        prop_assume!((dx, dy) != (0, 0));
        let from = [x, y].map(Pos::from_pm);
        let to = [x + dx, y + dy].map(Pos::from_pm);
        let radius = (dx as f64).hypot(dy as f64) as i64 / 2 + 1 + longer;
        let sign = if short { 1 } else { -1 };
        let number = |pm| Number::from_billionths(pm);
        let word = if clockwise { "G2" } else { "G3" };
        let line = format!("{word} X{} Y{} R{}", number(x + dx), number(y + dy), number(sign * radius));
        let arc = arc(from, &line).unwrap();
        for end in [from, to] {
            prop_assert!((distance(arc.centre, end) - radius as f64).abs() < 1.5, "{line}: {arc:?}");
        }
        prop_assert!(arc.mismatch.pm().abs() <= 2);
        // Half a turn, within the rounding of the centre, has no side.
        let side = left(&arc, from, to);
        if side.unsigned_abs() as f64 > 4.0 * distance(from, to) {
            prop_assert_eq!(side > 0, short != clockwise, "{}", line);
        }
    }

    /// An arc that stood in a program with three decimals is accepted, whatever its rounding was.
    #[test]
    fn three_decimals_are_enough(x in -50.0..50.0, y in -50.0..50.0, radius in 0.03..50.0,
                                 begin in 0.0..core::f64::consts::TAU, turn in 0.1..6.1) {
        let on = |angle: f64| [x + radius * f64::cos(angle), y + radius * f64::sin(angle)];
        let ([x0, y0], [x1, y1]) = (on(begin), on(begin + turn));
        let from = [x0, y0].map(|mm: f64| Pos::from_pm((mm * 1e3).round() as i64 * 1_000_000));
        let line = format!("G3 X{x1:.3} Y{y1:.3} I{:.3} J{:.3}", x - x0, y - y0);
        let arc = arc(from, &line);
        prop_assert!(arc.is_ok(), "{}: {:?}", line, arc);
        prop_assert!(arc.unwrap().mismatch.pm().abs() < 2_830_000);
    }
}

#[test]
fn the_mismatch_is_handed_on() {
    let from = [Pos::ZERO; 2];
    assert_eq!(arc(from, "G3 X1.0005 Y1 J1").unwrap().mismatch, Pos::from_pm(500_000));
    assert_eq!(arc(from, "G3 X.9995 Y1 J1").unwrap().mismatch, Pos::from_pm(-500_000));
    assert_eq!(arc(from, "G3 X1 Y1 J1").unwrap().mismatch, Pos::ZERO);
    assert_eq!(arc(from, "G3 X2.004 R1").unwrap().mismatch, Pos::ZERO);
}

#[test]
fn the_slack_is_what_rounding_leaves() {
    assert_eq!(slack(mm(1.0), Unit::Millimetre), mm(0.003));
    assert_eq!(slack(mm(1.0), Unit::Inch), mm(0.0075));
    assert_eq!(slack(mm(0.01), Unit::Inch), mm(0.001));
}
