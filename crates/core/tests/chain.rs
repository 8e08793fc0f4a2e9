//! Chains of lines with rounded corners, tick by tick: within tolerance and limits, exact at the end, and how fast.

mod walked;

use abbe_core::plan::Limits;
use abbe_core::plan::chain::{Manner, look_ahead, walk};
use abbe_core::plan::corner::Corner;
use abbe_core::plan::curve::Place;
use abbe_core::plan::pieces::Piece;
use abbe_core::plan::transfer::{Infeasible, State, Transfer};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use walked::{STAGE, assert_within};

/// The set-points of all ticks and of a few beyond, pm.
fn walked(places: &[Place], manner: &Manner) -> Vec<Place> {
    let mut corners = vec![Corner::default(); places.len().saturating_sub(2)];
    let mut pieces: Vec<Piece> = Vec::new();
    let corners = look_ahead(places, manner, &mut corners);
    let ticks = walk(places, manner, corners, |piece| pieces.push(piece)).expect("it is possible");
    walked::walked(&pieces, ticks)
}

/// From a place to the nearest of the lines, pm.
fn beside(places: &[Place], [x, y]: Place) -> f64 {
    let of = |ends: &[Place]| {
        let [dx, dy] = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        let squared = dx * dx + dy * dy;
        let part =
            if squared > 0.0 { ((x - ends[0][0]) * dx + (y - ends[0][1]) * dy) / squared } else { 0.0 };
        let part = part.clamp(0.0, 1.0);
        (x - ends[0][0] - part * dx).hypot(y - ends[0][1] - part * dy)
    };
    places.windows(2).map(of).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_right_angle_is_cut_by_the_tolerance_and_no_more_if_it_is_worth_it() {
    let places = [[0.0, 0.0], [1e9, 0.0], [1e9, 1e9]];
    for tolerance in [1e6, 1e8] {
        let corner = Corner::fastest(places, &[STAGE; 2], 2e6, tolerance, 0.5e9);
        // 0.7 mm/s at 1 µm.
        assert!(tolerance > 1e7 || (70_000.0..72_000.0).contains(&corner.speed), "{}", corner.speed);
        assert!((corner.off() / tolerance - 1.0).abs() < 1e-9, "{}", corner.off());
        let manner = Manner { axes: [STAGE; 2], feed: 2e6, tolerance };
        let path = walked(&places, &manner);
        assert_within(&path, &manner.axes);
        assert_eq!(path.last(), Some(&places[2]));
        let nearest = path.iter().map(|[x, y]| (x - 1e9).hypot(*y)).fold(f64::INFINITY, f64::min);
        let stopping = walked(&places, &Manner { tolerance: 0.0, ..manner });
        // A micrometre is too little for it: a stop is sooner.
        let rounds = tolerance > 1e7;
        assert_eq!(nearest > 0.0, rounds, "{nearest}");
        // But for where the ticks fall.
        assert!(nearest <= 1.001 * tolerance, "{nearest}");
        assert_eq!(path.len() < stopping.len(), rounds, "{} {}", path.len(), stopping.len());
        assert!(stopping.iter().all(|place| beside(&places, *place) < 1.0));
    }
}

#[test]
fn random_chains_keep_to_tolerance_and_limits_and_end_exactly() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    for number in 0..400 {
        let length = 10_f64.powf(random.random_range(3.0..9.5));
        let mut at = [(); 2].map(|()| random.random_range(0.0..1e11_f64).round());
        let mut places = vec![at];
        let count = if number % 10 == 0 { 200 } else { random.random_range(1..12) };
        for _ in 0..count {
            // Now and then the same place again, straight on, or back.
            let [dx, dy] = match random.random_range(0..20) {
                0 => [0.0; 2],
                1 => [length, 0.0],
                2 => [-length, 0.0],
                _ => [(); 2].map(|()| random.random_range(-length..length)),
            };
            at = [(at[0] + dx).round(), (at[1] + dy).round()];
            places.push(at);
        }
        let tolerance = if number % 5 == 0 { 0.0 } else { 10_f64.powf(random.random_range(1.0..7.0)) };
        let feed = 10_f64.powf(random.random_range(3.0..6.5));
        let axes = [STAGE, Limits { speed: 5e5, acceleration: 2000.0, ..STAGE }];
        let manner = Manner { axes, feed, tolerance };
        if 2.0 * length * f64::from(count) / feed > 300_000.0 {
            continue;
        }
        let path = walked(&places, &manner);
        assert_within(&path, &manner.axes);
        assert_eq!(path.last(), places.last(), "{places:?}");
        for place in &path {
            let off = beside(&places, *place);
            assert!(off <= tolerance + 2.0, "{off} {tolerance} {places:?}");
        }
    }
}

/// A hundred lines of 0.1 mm on a circle of 10 mm: their corners are flat, and one stop in each would take far longer.
#[test]
fn flat_corners_hardly_slow_down() {
    let on = |k: u32| {
        let angle = f64::from(k) * 0.01;
        [1e10 * angle.cos(), 1e10 * angle.sin()].map(f64::round)
    };
    let places: Vec<Place> = (0..=100).map(on).collect();
    let manner = Manner { axes: [STAGE; 2], feed: 1e6, tolerance: 1e6 };
    let (rounded, stopping) =
        (walked(&places, &manner), walked(&places, &Manner { tolerance: 0.0, ..manner }));
    assert_within(&rounded, &manner.axes);
    assert!(3 * rounded.len() < stopping.len(), "{} {}", rounded.len(), stopping.len());
}

#[test]
fn what_is_no_chain_is_an_error_and_moves_nothing() {
    let manner = Manner { axes: [STAGE; 2], feed: 2e6, tolerance: 1e6 };
    let walk_of = |places: &[Place], manner: &Manner| {
        let mut corners = vec![Corner::default(); places.len().saturating_sub(2)];
        let corners = look_ahead(places, manner, &mut corners);
        let mut number = 0;
        walk(places, manner, corners, |_| number += 1).map(|ticks| (ticks, number))
    };
    let right_angle = [[0.0, 0.0], [1e9, 0.0], [1e9, 1e9]];
    assert!(walk_of(&right_angle, &manner).is_ok());
    assert_eq!(walk_of(&[], &manner), Ok((0.0, 0)));
    assert_eq!(walk_of(&right_angle[..1], &manner), Ok((0.0, 1)));
    // Beyond what fits, in place and in time.
    assert_eq!(walk_of(&[[5.4e11, 0.0], [549_755_814_000.0, 0.0]], &manner), Err(Infeasible::NoNumber));
    let crawl = Manner { feed: 10.0, ..manner };
    assert_eq!(walk_of(&[[0.0, 0.0], [1e11, 0.0]], &crawl), Err(Infeasible::NoNumber));
    assert_eq!(walk_of(&[[0.0, 0.0], [f64::NAN, 0.0]], &manner), Err(Infeasible::NoNumber));
    for wrong in [f64::NAN, -1.0] {
        assert_eq!(walk_of(&right_angle, &Manner { feed: wrong, ..manner }), Err(Infeasible::NoNumber));
        assert_eq!(walk_of(&right_angle, &Manner { tolerance: wrong, ..manner }), Err(Infeasible::NoNumber));
        let axes = [STAGE, Limits { speed: wrong, ..STAGE }];
        assert_eq!(walk_of(&right_angle, &Manner { axes, ..manner }), Err(Infeasible::NoNumber));
    }
    // Nothing is left of what stood in the place of the corners before.
    let mut corners = [Corner::fastest(right_angle, &[STAGE; 2], 2e6, 1e8, 5e8)];
    assert!(corners[0].speed > 0.0);
    let stopped = look_ahead(&right_angle, &Manner { feed: f64::NAN, ..manner }, &mut corners);
    assert_eq!(stopped, [Corner::default()]);
    let endless = Limits { speed: f64::INFINITY, ..STAGE };
    let endless = Manner { axes: [endless; 2], feed: f64::INFINITY, ..manner };
    assert_eq!(walk_of(&right_angle, &endless), Err(Infeasible::NoNumber));
}

/// Corners that use all of their lines leave nothing between, but for what is rounded: no reason to go back.
#[test]
fn lines_that_are_all_corners_are_never_gone_back() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    for _ in 0..300 {
        let length = 10_f64.powf(random.random_range(3.0..8.0));
        let mut at = [random.random_range(0.0..1e10_f64).round(), 5e10];
        let mut places = vec![at];
        for _ in 0..60 {
            let angle = random.random_range(-0.6..0.6_f64);
            let length = length * [1.0, 1.0, 1.0, 0.3][random.random_range(0..4)];
            at = [at[0] + length * angle.cos(), at[1] + length * angle.sin()];
            places.push(at);
        }
        let manner = Manner { axes: [STAGE; 2], feed: 2e6, tolerance: 1e9 };
        let path = walked(&places, &manner);
        assert_within(&path, &manner.axes);
        let back = path.windows(2).map(|pair| pair[0][0] - pair[1][0]).fold(0.0, f64::max);
        assert!(back <= 1.0, "{back} pm back, lines of {length}");
    }
}

/// Between two corners that meet half-way a line has a length of nothing but what was rounded, and no time to go it.
#[test]
fn corners_that_meet_on_a_line_leave_it_no_time_and_are_no_error() {
    let axes = [
        Limits { speed: 836_388.0, acceleration: 7504.4, jerk: 6.82 },
        Limits { speed: 11_365_901.0, acceleration: 1589.6, jerk: 37.9 },
    ];
    let manner = Manner { axes, feed: 872_498.0, tolerance: 4_640_936.0 };
    let (here, there) = ([59_972_533_761.0, 20_607_309_071.0], [59_972_532_848.0, 20_627_831_068.0]);
    let places = [here, there, here, there];
    let path = walked(&places, &manner);
    assert_within(&path, &manner.axes);
    assert_eq!(path.last(), Some(&there));
    let [from, to] = [10_260_998.510_154_577, 10_260_998.510_154_58].map(|position| State {
        position,
        speed: 112_146.0,
        acceleration: 0.0,
    });
    assert_eq!(Transfer::fastest(from, to, &axes[1]).map(|motion| motion.ticks()), Ok(0.0));
}
