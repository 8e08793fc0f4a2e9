//! Motions laid out in ticks: against the exact motion, and against their limits by their differences alone.

#[path = "../examples/transfer_trials/cases.rs"]
#[allow(dead_code, reason = "not all ends are looked at here")]
mod cases;

use abbe_core::plan::Limits;
use abbe_core::plan::steps::{Steps, Stride};
use abbe_core::plan::transfer::{State, Transfer};
use cases::{Case, Ends, STAGE};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// The set-points of all ticks to the end and a few beyond.
fn walked(steps: &Steps) -> Vec<Stride> {
    let mut stride = Stride::default();
    let mut strides = Vec::new();
    let mut beyond = 0;
    while beyond < 5 {
        stride.tick(steps);
        beyond += u32::from(stride.is_at_end());
        strides.push(stride);
    }
    strides
}

/// The k-th differences of positions, pm.
fn difference(positions: &[f64], k: usize) -> Vec<f64> {
    (0..k).fold(positions.to_vec(), |values, _| values.windows(2).map(|pair| pair[1] - pair[0]).collect())
}

fn assert_exact(case: &Case) {
    let transfer = Transfer::fastest(case.from, case.to, &case.limits).expect("it is possible");
    let steps = Steps::of(&transfer).expect("it fits");
    assert_eq!(steps.ticks(), transfer.ticks().ceil() as u32);
    let strides = walked(&steps);
    for (tick, stride) in strides.iter().enumerate() {
        let exact = transfer.at(tick as f64);
        let set_point = stride.set_point();
        let off = [
            set_point.position.pm() as f64 - exact.position,
            set_point.speed as f64 / 2_f64.powi(38) - exact.speed,
            set_point.acceleration as f64 / 2_f64.powi(46) - exact.acceleration,
        ];
        if tick < steps.ticks() as usize {
            assert!(
                off[0].abs() < 1.0 && off[1].abs() < 1e-3 && off[2].abs() < 1e-6,
                "{tick}: {off:?} {case:?}"
            );
        }
    }
    let mut positions: Vec<f64> = strides.iter().map(|stride| stride.position().pm() as f64).collect();
    if case.to.speed == 0.0 {
        assert_eq!(positions.last(), Some(&case.to.position.round()), "{case:?}");
    } else {
        // Whoever ends with an acceleration goes on with another motion.
        positions.truncate(steps.ticks() as usize);
    }
    for (k, limit) in [(1, case.limits.speed), (2, case.limits.acceleration), (3, case.limits.jerk)] {
        // Each position is rounded to a picometre.
        let most = limit * (1.0 + 1e-9) + f64::from(1 << k);
        let worst = difference(&positions, k).into_iter().fold(0.0, |worst: f64, d| worst.max(d.abs()));
        assert!(worst <= most, "difference {k}: {worst} {limit} {case:?}");
    }
}

/// Somewhere in the travel, in whole picometres.
fn in_travel(mut case: Case) -> Case {
    case.from.position = (case.from.position % 1e11).round();
    case.to.position = (case.to.position % 1e11).round();
    case
}

#[test]
fn each_tick_is_the_exact_motion_to_a_picometre_and_within_its_limits() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut number = 0;
    while number < 2000 {
        let ends = if number % 2 == 0 { Ends::FromMotion } else { Ends::Any };
        let case = in_travel(Case::random(&mut random, 1.0, ends));
        let ticks = Transfer::fastest(case.from, case.to, &case.limits).expect("it is possible").ticks();
        if ticks < 20_000.0 {
            assert_exact(&case);
            number += 1;
        }
    }
}

/// A crawl has the longest phases of all, and one that begins in the middle of a motion leaves most to be rounded.
#[test]
fn a_hundred_millimetres_at_a_crawl_end_exactly() {
    let to = State { position: 1e11, ..State::default() };
    for (speed, from) in [
        (20_000.0, State::default()),
        (10_000.0, State { speed: 8200.0, acceleration: 25.46, position: 0.0 }),
    ] {
        assert_exact(&Case { from, to, limits: Limits { speed, ..STAGE } });
    }
}

/// From rest to rest in an hour and more: too many ticks to look at each, so only how far the sums are when they end.
#[test]
fn what_is_rounded_does_not_add_up() {
    let to = State { position: 5e10, ..State::default() };
    let from = State { speed: 820.0, acceleration: 25.46, position: 0.0 };
    let transfer = Transfer::fastest(from, to, &Limits { speed: 1000.0, ..STAGE }).expect("it is possible");
    let steps = Steps::of(&transfer).expect("it fits");
    let mut stride = Stride::default();
    let mut before = stride;
    while !stride.is_at_end() {
        before = stride;
        stride.tick(&steps);
    }
    let last = stride.position().pm() - before.position().pm();
    // Slow as it is before its end, it is there but for what was rounded.
    assert!(last.abs() <= 2, "{last}");
    assert_eq!(stride.position().pm(), 50_000_000_000);
}

#[test]
fn what_does_not_fit_is_refused() {
    let far = |position: f64| {
        let to = State { position, ..State::default() };
        Transfer::fastest(State::default(), to, &STAGE).expect("it is possible")
    };
    assert!(Steps::of(&far(1e11)).is_some());
    assert_eq!(Steps::of(&far(1e12)), None);
    assert_eq!(Steps::of(&far(1e16)), None);
    // Its ends fit, what lies between does not.
    let from = State { position: 549_750_488_253.0, speed: 185_920.6, acceleration: -3427.49 };
    let to = State { position: 549_754_716_786.0, ..State::default() };
    assert_eq!(Steps::of(&Transfer::fastest(from, to, &STAGE).expect("it is possible")), None);
}

/// The acceleration fits in every tick, but not what the next one would make of it: it must not wrap.
#[test]
fn what_does_not_fit_in_the_next_tick_is_refused() {
    let limits = Limits { speed: 2e7, acceleration: 131_000.0, jerk: 4185.027738175093 };
    let from = State { position: -1.0, speed: -61_037.01895199438, acceleration: 127_735.46447720187 };
    let to = State { position: -2.0, speed: -1_770_073.549607837, acceleration: -249.6204789893086 };
    let transfer = Transfer::fastest(from, to, &limits).expect("it is possible");
    let most = transfer.at(61.0).acceleration;
    assert!(most > -131_072.0 && most - limits.jerk < -131_072.0, "{most}");
    assert_eq!(Steps::of(&transfer), None);
}

#[test]
fn a_way_of_nothing_is_over_at_once() {
    let at = State { position: 5e9, ..State::default() };
    let steps = Steps::of(&Transfer::fastest(at, at, &STAGE).expect("it is possible")).expect("it fits");
    let mut stride = Stride::default();
    stride.tick(&steps);
    assert!(stride.is_at_end());
    assert_eq!(stride.position().pm(), 5_000_000_000);
}

/// Where a cruise just begins, its mean speed is what was rounded of two places.
#[test]
fn a_cruise_of_no_ticks_changes_nothing() {
    let limits =
        Limits { speed: 1_912_292.155_899_773_6, acceleration: 3660.309443306244, jerk: 28.50635459509447 };
    let from = State { position: 22_110_691_097.0, ..State::default() };
    for ulps in -50..50 {
        let way = 1_244_602_547.096_103_7 * (1.0 + f64::from(ulps) * f64::EPSILON);
        let to = State { position: from.position + way, ..State::default() };
        let transfer = Transfer::fastest(from, to, &limits).expect("it is possible");
        let strides = walked(&Steps::of(&transfer).expect("it fits"));
        let fastest = strides.iter().map(|stride| stride.set_point().speed).max().unwrap_or(0);
        assert!(fastest as f64 / 2_f64.powi(38) < limits.speed * (1.0 + 1e-6), "{ulps}");
    }
}
