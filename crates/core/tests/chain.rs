//! Chains of lines with rounded corners, tick by tick: within tolerance and limits, exact at the end, and how fast.

mod tick;
mod walked;

use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::corner::Corner;
use abbe_core::plan::curve::Place;
use abbe_core::plan::overlap::Overlap;
use abbe_core::plan::program::{BLOCKS, Program};
use abbe_core::plan::segment::{Feed, Segment, Shape};
use abbe_core::plan::steps::Walker;
use abbe_core::plan::transfer::{Infeasible, State, Transfer};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tick::{Tick, line, pm};
use walked::{STAGE, assert_within};

/// How a chain of lines is gone along.
#[derive(Clone, Copy, Debug)]
struct Manner {
    axes: [Limits; 2],
    feed: f64,
    tolerance: f64,
}

/// The set-points of all ticks and of a few beyond, pm.
fn walked(places: &[Place], manner: &Manner) -> Vec<Place> {
    let mut tick = Tick::new(pm(places[0]), manner.axes);
    for place in &places[1..] {
        tick.make_room();
        tick.program.take(&line(*place, manner.feed, manner.tolerance)).expect("it is one");
    }
    tick.finish();
    tick.places
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
fn a_right_angle_is_cut_by_the_tolerance_and_no_more() {
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
        assert!(nearest > 0.98 * tolerance, "{nearest}");
        // But for where the ticks fall.
        assert!(nearest <= 1.001 * tolerance, "{nearest}");
        assert!(path.len() + 100 < stopping.len(), "{} {}", path.len(), stopping.len());
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
fn what_cannot_be_gone_is_an_error_and_is_not_taken() {
    let mut tick = Tick::new(pm([0.0, 0.0]), [STAGE; 2]);
    let mut take = |segment: &Segment| tick.program.take(segment);
    assert_eq!(
        take(&Segment { feed: Feed::default(), ..line([1e9, 0.0], 1.0, 0.0) }),
        Err(Infeasible::NoNumber)
    );
    assert_eq!(take(&line([1e9, 0.0], 1e6, -1.0)), Err(Infeasible::NoNumber));
    let shape = Shape::Sine { amplitude: Pos::ZERO, periods: 1, phase: 0 };
    assert_eq!(take(&Segment { shape, ..line([1e9, 0.0], 1e6, 0.0) }), Err(Infeasible::NoNumber));
    assert_eq!(take(&line([1e9, 0.0], 1e6, 0.0)), Ok(()));
    let mut taken = 1;
    while take(&line([f64::from(taken), 1e9], 1e6, 0.0)).is_ok() {
        taken += 1;
    }
    assert_eq!(taken as usize, BLOCKS);
    for wrong in [f64::NAN, -1.0, f64::INFINITY, 0.0] {
        let axes = [STAGE, Limits { speed: wrong, ..STAGE }];
        let mut program = Program::new(pm([0.0, 0.0]), axes, 1.0, 0);
        assert_eq!(
            program.take(&line([0.0, 1e9], 1e6, 0.0)).is_err(),
            wrong.is_nan() || wrong <= 0.0 || wrong > 1e300,
            "{wrong}"
        );
    }
    // Beyond what fits, in place and in time.
    for (to, feed) in [([549_755_814_000.0, 0.0], 2e6), ([1e11, 0.0], 10.0)] {
        let mut program = Program::new(pm([5.4e11, 0.0]), [STAGE; 2], 1.0, 0);
        program.take(&line(to, feed, 0.0)).expect("it is a line");
        let mut spans = (0..10).map(|now| program.span(now));
        assert!(spans.any(|span| span == Err(Infeasible::NoNumber)), "{to:?}");
    }
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

/// Two corners as wide as their line, with limits that differ much between the axes: found by fuzzing.
#[test]
fn corners_that_fill_their_line_are_gone_through() {
    let places = [
        [68_627_450_980.0, 68_627_450_980.0],
        [68_623_618_065.0, 68_623_572_547.0],
        [68_619_739_632.0, 68_619_694_114.0],
        [68_618_231_333.0, 68_615_815_681.0],
        [68_614_352_900.0, 68_611_937_248.0],
        [68_610_474_467.0, 68_608_058_815.0],
    ];
    let axes = [
        Limits { speed: 200_056.224_215_590_05, acceleration: 500.0, jerk: 2.0 },
        Limits { speed: 1_670_779.21, acceleration: 504.163_189_705_648_73, jerk: 46.584_169_531_325_54 },
    ];
    let path = walked(&places, &Manner { axes, feed: 539_631.588_669_758_8, tolerance: 1_501_310.0 });
    assert_within(&path, &axes);
    assert_eq!(path.last(), places.last());
}

/// Both corners against their cubics summed up: where they begin and end, how near they come, within the limits of both axes.
#[test]
fn corners_are_what_their_cubics_sum_up_to() {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let (mut rounded, mut overlapped) = (0, 0);
    for _ in 0..120_000 {
        let mut place = |size: f64| [(); 2].map(|()| random.random_range(-size..size).round());
        let places = [place(1e9), place(1e9), place(1e9)];
        let [before, behind] = [0, 1].map(|k| {
            let way = [places[k + 1][0] - places[k][0], places[k + 1][1] - places[k][1]];
            let length = way[0].hypot(way[1]);
            (way.map(|part| part / length), length)
        });
        let axes = [(); 2].map(|()| Limits {
            speed: 10_f64.powf(random.random_range(5.0..6.5)),
            acceleration: 10_f64.powf(random.random_range(3.0..4.0)),
            jerk: 10_f64.powf(random.random_range(0.5..2.0)),
        });
        let tolerance = 10_f64.powf(random.random_range(2.0..8.0));
        let room = before.1.min(behind.1) / 2.0;
        let corner = Corner::fastest(places, &axes, 3e6, tolerance, room);
        let along = |way: Place| {
            let by = |of: fn(&Limits) -> f64| (of(&axes[0]) / way[0].abs()).min(of(&axes[1]) / way[1].abs());
            Limits { speed: by(|l| l.speed), acceleration: by(|l| l.acceleration), jerk: by(|l| l.jerk) }
        };
        let limits = [along(before.0), along(behind.0)];
        let lines = [(before.1, &limits[0]), (behind.1, &limits[1])];
        if corner.speed > 0.0 {
            rounded += 1;
            let state = |way: Place, reach: f64| {
                [0, 1].map(|k| (places[1][k] + reach * way[k], corner.speed * way[k], 0.0))
            };
            let ends = [state(before.0, -corner.reach()), state(behind.0, corner.reach())];
            assert!(corner.reach() <= room * (1.0 + 1e-9));
            let pieces = corner.pieces(0.0).map(|piece| piece.expect("it fits"));
            check(
                &pieces,
                &corner.times(0.0),
                corner.ticks(),
                ends,
                (places[1], corner.off(), tolerance),
                &axes,
            );
        }
        if let Some(overlap) = Overlap::longest(places, &axes, lines, tolerance) {
            overlapped += 1;
            let [first, last] = [overlap.before(before.1), overlap.behind()];
            let at = |way: Place, from: Place, state: State| {
                [0, 1].map(|k| {
                    (from[k] + state.position * way[k], state.speed * way[k], state.acceleration * way[k])
                })
            };
            let ends = [at(before.0, places[0], first), at(behind.0, places[1], last)];
            let piece = overlap.piece(0.0).expect("it fits");
            check(&[piece], &[0.0], overlap.ticks(), ends, (places[1], overlap.off(), tolerance), &axes);
        }
    }
    assert!(rounded > 100_000 && overlapped > 100_000, "{rounded} {overlapped}");
}

/// Place, speed and acceleration of both axes.
type States = [(f64, f64, f64); 2];

fn check(
    pieces: &[[abbe_core::plan::steps::Leg; 2]],
    times: &[f64],
    ticks: f64,
    ends: [States; 2],
    (corner, off, tolerance): (Place, f64, f64),
    axes: &[Limits; 2],
) {
    let mut nearest = f64::INFINITY;
    for (number, piece) in pieces.iter().enumerate() {
        let (begins, until) = (times[number], times.get(number + 1).copied().unwrap_or(ticks));
        // What a walker has at its first tick, taken back to where the piece begins.
        let from = piece.map(|leg| {
            let (state, jerk) = Walker::at(&leg).state();
            (state.after(begins - f64::from(leg.first), jerk), jerk)
        });
        let close = |states: [State; 2], ends: States| {
            for (state, (place, speed, acceleration)) in states.iter().zip(ends) {
                assert!((state.position - place).abs() < 0.1, "{} {place}", state.position);
                assert!(
                    (state.speed - speed).abs() < 1e-3 && (state.acceleration - acceleration).abs() < 1e-5
                );
            }
        };
        if number == 0 {
            close(from.map(|(state, _)| state), ends[0]);
        }
        if number + 1 == pieces.len() {
            close(from.map(|(state, jerk)| state.after(until - begins, jerk)), ends[1]);
        }
        for part in 0..=24 {
            let time = (until - begins) * f64::from(part) / 24.0;
            let states = from.map(|(state, jerk)| state.after(time, jerk));
            nearest = nearest.min((states[0].position - corner[0]).hypot(states[1].position - corner[1]));
            for ((state, (_, jerk)), limits) in states.iter().zip(from).zip(axes) {
                let within = |value: f64, limit: f64| value.abs() <= limit * (1.0 + 1e-6) + 1e-3;
                assert!(within(state.speed, limits.speed) && within(state.acceleration, limits.acceleration));
                assert!(within(jerk, limits.jerk), "{jerk} {}", limits.jerk);
            }
        }
    }
    // The middle is one of the parts.
    assert!(
        (nearest - off).abs() <= 0.2 + 1e-6 * off && off <= tolerance * (1.0 + 1e-9),
        "{nearest} {off} {tolerance}"
    );
}
