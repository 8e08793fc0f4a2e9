//! Lines against their definition: F = a y − b x from the points alone, in 128 bits.

use super::super::FARTHEST;
use super::*;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn at(x: i64, y: i64) -> [Counts; 2] {
    [Counts::new(x), Counts::new(y)]
}

fn points(from: [Counts; 2], mut line: Line) -> Vec<[Counts; 2]> {
    let mut points = vec![from];
    while let Some(step) = line.next_step() {
        points.push(step.from(points[points.len() - 1]));
    }
    points
}

fn gcd(a: i64, b: i64) -> i64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// 2 |F| at a point of the line from (3, −5) to (3 + dx, −5 + dy).
fn twice_off(point: [Counts; 2], dx: i64, dy: i64) -> i64 {
    let (x, y) = (point[0].get() - 3, point[1].get() + 5);
    2 * (dx * y - dy * x).abs()
}

#[test]
fn no_point_is_beyond_the_bound_and_some_are_on_it() {
    for (dx, dy) in (-40..=40).flat_map(|dx| (-40..=40).map(move |dy| (dx, dy))) {
        let (from, to) = (at(3, -5), at(3 + dx, -5 + dy));
        let line = Line::new(from, to).unwrap();
        let points = points(from, line);
        assert_eq!(points[points.len() - 1], to);
        let steps = dx.unsigned_abs() + dy.unsigned_abs();
        assert_eq!((line.remaining(), points.len() as u64), (steps, steps + 1), "{dx} {dy}");
        let worst = points.iter().map(|&point| twice_off(point, dx, dy)).max().unwrap();
        let (a, b) = (dx.abs(), dy.abs());
        let g = gcd(a, b);
        let on_the_axis = a == 0 || b == 0;
        let is_met = g != 0 && (a + b) / g % 2 == 0;
        let largest = if is_met { a + b } else { a + b - g };
        assert_eq!(worst, if on_the_axis { 0 } else { largest }, "{dx} {dy}");
    }
}

#[test]
fn remaining_counts_down_and_the_end_is_the_end() {
    let mut line = Line::new(at(0, 0), at(-7, 4)).unwrap();
    for left in (0..11).rev() {
        assert!(line.next_step().is_some());
        assert_eq!(line.remaining(), left);
    }
    assert_eq!((line.next_step(), line.next_step(), line.remaining()), (None, None, 0));
}

#[test]
fn the_four_steps_by_hand() {
    // a = 3, b = 1; F + 1 is judged. x to F = −1, x to −2, y to 1, x to 0.
    let mut line = Line::new(at(0, 0), at(3, -1)).unwrap();
    let (x, y) = (Step { axis: Axis::X, sign: Sign::Plus }, Step { axis: Axis::Y, sign: Sign::Minus });
    let expected = [(x, -1), (x, -2), (y, 1), (x, 0)];
    for (step, deviation) in expected {
        assert_eq!((line.next_step(), line.deviation), (Some(step), deviation));
    }
    assert_eq!(line.next_step(), None);
}

#[test]
fn what_lies_too_far_is_named() {
    let far = Counts::new(FARTHEST + 1);
    let error = Line::new(at(0, 0), [Counts::ZERO, far]).unwrap_err();
    assert_eq!(error, TooFar { axis: Axis::Y, at: far });
    assert_eq!(error.to_string(), "y = 1073741825 counts lies beyond ±1073741824; use a coarser count");
    let lowest = Counts::new(i64::MIN);
    assert_eq!(
        Line::new([lowest, Counts::ZERO], at(0, 0)).unwrap_err(),
        TooFar { axis: Axis::X, at: lowest }
    );
}

/// Where the line over a and b is after k steps: F is −k b modulo a + b, in −(a + b)/2 … (a + b)/2, and k = x + y.
fn after(k: u64, [a, b]: [i64; 2]) -> (i128, [i128; 2]) {
    let (k, a, b) = (i128::from(k), i128::from(a), i128::from(b));
    let around = a + b;
    let remainder = (-k * b).rem_euclid(around);
    let deviation = if 2 * remainder >= around { remainder - around } else { remainder };
    let x = (a * k - deviation) / around;
    (deviation, [x, k - x])
}

fn coordinate() -> impl Strategy<Value = i64> {
    (-FARTHEST..=FARTHEST, 0u32..30, 0u8..6).prop_map(|(n, shift, end)| match end {
        0 => FARTHEST,
        1 => -FARTHEST,
        _ => n >> shift,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn long_lines_are_what_the_closed_form_says_anywhere(
        from in (coordinate(), coordinate()),
        to in (coordinate(), coordinate()),
        part in 0u64..=1000,
    ) {
        let mut line = Line::new(at(from.0, from.1), at(to.0, to.1)).unwrap();
        let whole = line.remaining();
        prop_assume!(whole > 0);
        // The tail once in a while, so that the end is met.
        let start = (whole / 1000 * part).min(whole - whole.min(400));
        line.remaining = whole - start;
        line.deviation = after(start, line.way).0 as i64;
        let [mut x, mut y] = after(start, line.way).1;
        for k in start..whole.min(start + 800) {
            let step = line.next_step().unwrap();
            let (gone, towards) = match step.axis {
                Axis::X => (&mut x, to.0 - from.0),
                Axis::Y => (&mut y, to.1 - from.1),
            };
            *gone += 1;
            prop_assert_eq!(step.sign, Sign::of(towards));
            let (deviation, place) = after(k + 1, line.way);
            prop_assert_eq!((i128::from(line.deviation), [x, y]), (deviation, place));
            let [a, b] = line.way.map(i128::from);
            prop_assert!(deviation == a * y - b * x && 2 * deviation.abs() <= a + b);
        }
        if line.remaining() == 0 {
            prop_assert_eq!([x, y], line.way.map(i128::from));
            prop_assert_eq!(line.next_step(), None);
        }
    }
}
