//! Arcs against the circle itself, from the points alone.

use super::super::{FARTHEST, TooFar};
use super::*;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::collections::HashMap;

type Point = [i64; 2];

const BOTH: [Turn; 2] = [Turn::Clockwise, Turn::Counterclockwise];
const CENTRE: Point = [-20, 7];

fn counts(point: Point) -> [Counts; 2] {
    point.map(Counts::new)
}

fn around_centre([x, y]: Point) -> [Counts; 2] {
    counts([x + CENTRE[0], y + CENTRE[1]])
}

fn circle(square: u64) -> Circle {
    Circle::with_square(counts(CENTRE), square).unwrap()
}

/// All points of an arc as seen from the centre, its start first; walks until it ends.
fn walk(from: Point, mut arc: Arc) -> Vec<Point> {
    let mut points = vec![around_centre(from)];
    let expected = arc.remaining();
    while let Some(step) = arc.next_step() {
        points.push(step.from(points[points.len() - 1]));
        assert_eq!(arc.remaining() + points.len() as u64, expected + 1);
    }
    assert_eq!((points.len() as u64, arc.next_step()), (expected + 1, None));
    points.iter().map(|[x, y]| [x.get() - CENTRE[0], y.get() - CENTRE[1]]).collect()
}

/// Whether | ρ − R | < √½, exactly: then |F| = |ρ − R| (ρ + R) < 2 √½ min(ρ, R) + ½.
fn is_near([x, y]: Point, square: u64) -> bool {
    let (x, y, square) = (i128::from(x), i128::from(y), i128::from(square));
    let length = x * x + y * y;
    let beyond = 2 * (length - square).abs() - 1;
    beyond <= 0 || beyond * beyond < 8 * length.min(square)
}

fn distance([x, y]: Point, square: u64) -> f64 {
    ((x as f64).hypot(y as f64) - (square as f64).sqrt()).abs()
}

/// All points whose square of one count the circle cuts along its outward diagonal, by definition.
fn ring(square: u64) -> Vec<Point> {
    let reach = square.isqrt() as i64 + 2;
    let all = (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| [x, y]));
    all.filter(|[x, y]| {
        let (sum, deviation) = (x.abs() + y.abs(), x * x + y * y - square as i64);
        -sum <= deviation && deviation < sum
    })
    .collect()
}

#[test]
fn every_point_is_drawn_and_the_ring_is_the_same_both_ways() {
    let mut worst = 0.0_f64;
    let between = (15..=40).flat_map(|r| [r * r - r / 2, r * r + r]);
    for square in (1..=200).chain(between).chain((15..=60).map(|r| r * r)) {
        let (circle, ring) = (circle(square), ring(square));
        assert_eq!(circle.steps_around(), ring.len() as u64, "R² = {square}");
        for (&from, turn) in ring.iter().flat_map(|from| BOTH.iter().map(move |turn| (from, *turn))) {
            let arc = |to: Point| Arc::new(&circle, around_centre(from), around_centre(to), turn).unwrap();
            let points = walk(from, arc(from));
            assert_eq!(points[points.len() - 1], from, "R² = {square}");
            // The angle never goes back.
            let sense = if turn == Turn::Clockwise { -1 } else { 1 };
            for pair in points.windows(2) {
                assert!(sense * (pair[0][0] * pair[1][1] - pair[0][1] * pair[1][0]) >= 0);
            }
            assert!(points.iter().all(|&point| is_near(point, square)));
            worst = points.iter().map(|&point| distance(point, square)).fold(worst, f64::max);
            // Whatever the end, the count of steps leads to it: its place in the walk once around.
            let places: HashMap<_, _> =
                points.iter().enumerate().skip(1).map(|(n, &p)| (p, n as u64)).collect();
            assert_eq!(places.len(), ring.len());
            assert!(ring.iter().all(|&to| arc(to).remaining() == places[&to]), "R² = {square}");
        }
    }
    assert!(worst > 0.69, "no smaller bound holds: {worst}");
}

#[test]
fn every_arc_of_small_circles_ends_on_its_end() {
    for square in (1..=12).flat_map(|r| [r * r - r + 1, r * r, r * r + r]) {
        let (circle, ring) = (circle(square), ring(square));
        for (&from, &to) in ring.iter().flat_map(|from| ring.iter().map(move |to| (from, to))) {
            for turn in BOTH {
                let arc = Arc::new(&circle, around_centre(from), around_centre(to), turn).unwrap();
                assert_eq!(walk(from, arc).last(), Some(&to));
            }
        }
    }
}

/// Points of the grid within a count of the circle, by definition.
fn near(square: u64) -> Vec<Point> {
    let (reach, radius) = (square.isqrt() as i64 + 3, (square as f64).sqrt());
    let all = (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| [x, y]));
    all.filter(|[x, y]| (((x * x + y * y) as f64).sqrt() - radius).abs() <= 1.0 + 1e-9).collect()
}

#[test]
fn a_point_within_a_count_is_a_step_from_the_ring() {
    for square in 1..=900 {
        let (circle, ring, near) = (circle(square), ring(square), near(square));
        let fits = |[x, y]: Point| circle.end(around_centre([x, y]), Which::End).is_ok();
        let reach = square.isqrt() as i64 + 4;
        let all = (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| [x, y]));
        assert_eq!(all.filter(|&point| fits(point)).count(), near.len(), "R² = {square}");
        for &point in &near {
            let offset = circle.end(around_centre(point), Which::Start).unwrap();
            let (drawn, step) = circle.drawn_beside(offset);
            assert_eq!(step.is_none(), ring.contains(&point));
            assert!(ring.contains(&drawn.0), "R² = {square}: {point:?}");
            let way = (drawn.0[0] - point[0]).abs() + (drawn.0[1] - point[1]).abs();
            assert_eq!(way, i64::from(step.is_some()));
        }
    }
}

#[test]
fn ends_beside_the_circle_are_met_and_never_by_a_turn_too_many() {
    for square in (1..=150).chain([361, 400, 421, 900]) {
        let (circle, near) = (circle(square), near(square));
        for (&from, &to) in near.iter().flat_map(|from| near.iter().map(move |to| (from, to))) {
            for turn in BOTH {
                let arc = Arc::new(&circle, around_centre(from), around_centre(to), turn).unwrap();
                if square <= 150 {
                    let points = walk(from, arc);
                    assert_eq!(points.last(), Some(&to), "R² = {square}: {from:?}");
                    let inner = points.get(1..points.len() - 1).unwrap_or_default();
                    assert!(inner.iter().all(|&point| is_near(point, square)));
                }
                // An end that lies ahead by less than a quarter is not a turn away.
                let sense = if turn == Turn::Clockwise { -1 } else { 1 };
                let ahead = sense * (from[0] * to[1] - from[1] * to[0]) > 0;
                let less_than_a_quarter = from[0] * to[0] + from[1] * to[1] > 0;
                if ahead && less_than_a_quarter {
                    assert!(
                        arc.remaining() <= circle.steps_around() / 4 + 4,
                        "R² = {square}: {from:?} {to:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_circle_of_one_count_by_hand() {
    let circle = Circle::new(counts([0, 0]), Counts::new(1)).unwrap();
    let [from, to] = [[1, 0], [0, 1]].map(counts);
    let arc = Arc::new(&circle, from, to, Turn::Counterclockwise).unwrap();
    assert_eq!((arc.remaining(), arc.falling, arc.rising, arc.deviation), (2, 1, 0, 0));
    // F − u + v + ½ is −½: y rises to F = 1; then ½ + 1: x falls.
    let mut arc = arc;
    assert_eq!(arc.next_step(), Some(Step { axis: Axis::Y, sign: Sign::Plus }));
    assert_eq!(arc.next_step(), Some(Step { axis: Axis::X, sign: Sign::Minus }));
    assert_eq!(arc.next_step(), None);
    assert_eq!(Arc::new(&circle, from, to, Turn::Clockwise).unwrap().remaining(), 6);
    assert_eq!(Arc::new(&circle, from, from, Turn::Clockwise).unwrap().remaining(), 8);
}

#[test]
fn a_circle_by_its_radius_and_by_a_point_is_one() {
    let [centre, point] = [[5, -3], [8, 1]].map(counts);
    let circle = Circle::new(centre, Counts::new(5)).unwrap();
    assert_eq!(Circle::through(centre, point), Ok(circle));
    assert_eq!(Circle::with_square(centre, 25), Ok(circle));
}

#[test]
fn what_is_no_arc_is_named() {
    let centre = counts([0, 0]);
    assert_eq!(Circle::new(centre, Counts::ZERO), Err(CircleError::NoRadius));
    assert_eq!(Circle::new(centre, Counts::new(i64::MIN)), Err(CircleError::NoRadius));
    assert_eq!(Circle::through(centre, centre), Err(CircleError::NoRadius));
    assert_eq!(Circle::new(centre, Counts::new(FARTHEST + 1)), Err(CircleError::TooLarge));
    assert_eq!(Circle::with_square(centre, u64::MAX), Err(CircleError::TooLarge));
    assert_eq!(Circle::through(centre, counts([FARTHEST, 1])), Err(CircleError::TooLarge));
    let far = TooFar { axis: Axis::X, at: Counts::new(-FARTHEST - 1) };
    let beyond = counts([-FARTHEST - 1, 0]);
    assert_eq!(Circle::new(beyond, Counts::new(1)), Err(CircleError::TooFar(far)));

    let circle = Circle::new(centre, Counts::new(100)).unwrap();
    let error = |from, to| Arc::new(&circle, counts(from), counts(to), Turn::Clockwise).unwrap_err();
    assert_eq!(error([-FARTHEST - 1, 0], [100, 0]), CircleError::TooFar(far));
    // √(60² + 82²) = 101.6071
    let beside = error([100, 0], [60, 82]);
    assert_eq!(beside, CircleError::Beside { end: Which::End, thousandths: 1608 });
    assert_eq!(
        beside.to_string(),
        "the end of the arc lies 1.608 counts outside its circle; one count is allowed: mend the radius, the centre or \
         that point"
    );
    let inside = error([0, 98], [100, 0]);
    assert_eq!(inside, CircleError::Beside { end: Which::Start, thousandths: -2000 });
    assert!(inside.to_string().contains("the start of the arc lies 2.000 counts inside"));
    assert!(Arc::new(&circle, counts([0, 99]), counts([101, 0]), Turn::Clockwise).is_ok());
}

/// A point of the ring of a large circle, of any quadrant: one coordinate chosen, the other to the nearest count.
fn drawn(square: u64, share: f64, quadrant: u8) -> Point {
    let radius = (square as f64).sqrt();
    let u = ((radius * share.min(std::f64::consts::FRAC_1_SQRT_2)) as u64).min(square.isqrt());
    let rest = square - u * u;
    let below = rest.isqrt();
    let v = (below + u64::from(rest > below * (below + 1))) as i64;
    let u = u as i64;
    match quadrant {
        0 => [v, u],
        1 => [-u, v],
        2 => [-v, -u],
        _ => [u, -v],
    }
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn large_arcs_stay_less_than_a_diagonal_half_beside_and_lead_back(
        radius in 1_000.0f64..1_073_741_824.0,
        share in prop_oneof![0.0f64..1.0, 0.0f64..1e-6],
        quadrant in 0u8..4,
        clockwise in any::<bool>(),
        steps in 1u64..4000,
    ) {
        let square = (radius * radius) as u64;
        let circle = Circle::with_square(counts([0, 0]), square).unwrap();
        let (turn, back) = if clockwise { (BOTH[0], BOTH[1]) } else { (BOTH[1], BOTH[0]) };
        let from = drawn(square, share, quadrant);
        let mut once_around = Arc::new(&circle, counts(from), counts(from), turn).unwrap();
        let mut point = counts(from);
        for _ in 0..steps {
            point = once_around.next_step().unwrap().from(point);
            let [x, y] = point.map(|c| i128::from(c.get()));
            prop_assert_eq!(i128::from(once_around.deviation), x * x + y * y - i128::from(square));
            prop_assert!(is_near(point.map(Counts::get), square));
        }
        let mut arc = Arc::new(&circle, point, counts(from), back).unwrap();
        let rest = Arc::new(&circle, point, counts(from), turn).unwrap();
        prop_assert_eq!(rest.remaining(), once_around.remaining());
        if once_around.remaining() > 0 {
            prop_assert_eq!(arc.remaining(), steps);
        }
        while let Some(step) = arc.next_step() {
            point = step.from(point);
        }
        prop_assert_eq!(point, counts(from));
    }

    #[test]
    fn a_point_of_the_circle_rounded_to_counts_is_drawn(radius in 1.0f64..1e6, angle in 0.0f64..std::f64::consts::TAU) {
        let circle = Circle::with_square(counts([0, 0]), (radius * radius).round() as u64).unwrap();
        let radius = (radius * radius).round().sqrt();
        let point = [(radius * angle.cos()).round() as i64, (radius * angle.sin()).round() as i64];
        let offset = circle.end(counts(point), Which::Start).unwrap();
        prop_assert_eq!(circle.drawn_beside(offset).1, None);
    }
}
