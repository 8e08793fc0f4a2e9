//! Programs tick by tick: on their path within the limits, exact at every rest, wherever they are held or hurried.

mod tick;
mod walked;

use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::{Curve, Place};
use abbe_core::plan::segment::{Feed, Segment, Shape};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tick::{Tick, line, pm};
use walked::{STAGE, assert_within};

/// From a place to the nearest one of a curve, by dense sampling between bounds and a search, pm.
fn beside(curve: &Curve, [x, y]: Place) -> f64 {
    let off = |way: f64| {
        let [px, py] = curve.spot(way).at;
        (px - x).hypot(py - y)
    };
    let length = curve.length();
    let parts = if curve.bend().is_none() { 1 } else { 48 };
    let part = length / f64::from(parts);
    let nearest =
        (0..=parts).map(|k| f64::from(k) * part).min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(0.0);
    let (mut low, mut high) = ((nearest - part).max(0.0), (nearest + part).min(length));
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        if off(low + third) < off(high - third) { high -= third } else { low += third }
    }
    off(f64::midpoint(low, high))
}

/// Any program, and its curves.
fn any_program(random: &mut Pcg64Mcg, count: usize) -> ([Pos; 2], Vec<Segment>, Vec<Curve>) {
    let length = 10_f64.powf(random.random_range(4.0..8.5));
    let tolerance =
        if random.random_range(0..4) == 0 { 0.0 } else { 10_f64.powf(random.random_range(2.0..7.0)) };
    let feed = 10_f64.powf(random.random_range(4.5..6.5));
    let from = pm([(); 2].map(|()| random.random_range(1e10..5e10_f64)));
    let (mut at, mut segments, mut curves) = (from, Vec::new(), Vec::new());
    let mut angle = random.random_range(0.0..6.0_f64);
    while segments.len() < count {
        angle += if random.random_range(0..3) == 0 {
            random.random_range(-3.0..3.0)
        } else {
            random.random_range(-0.2..0.2)
        };
        let way = length * random.random_range(0.05..1.0);
        let place = at.map(|at| at.pm() as f64);
        let to = pm([place[0] + way * angle.cos(), place[1] + way * angle.sin()]);
        let shape = match random.random_range(0..12) {
            0 => Shape::Arc {
                centre: pm([
                    f64::midpoint(place[0], to[0].pm() as f64) - way * angle.sin(),
                    f64::midpoint(place[1], to[1].pm() as f64) + way * angle.cos(),
                ]),
                counterclockwise: random.random_range(0..2) == 0,
            },
            1 => Shape::Sine {
                amplitude: Pos::from_pm((way * random.random_range(0.01..0.3)) as i64),
                periods: random.random_range(1..4),
                phase: random.random_range(0..360_000_000_000_i64),
            },
            _ => Shape::Line,
        };
        let segment =
            Segment { shape, to, feed: Feed::from_pm(feed), tolerance: Pos::from_pm(tolerance as i64) };
        if let Some(curve) = segment.curve(at) {
            segments.push(segment);
            curves.push(curve);
            at = to;
        }
    }
    (from, segments, curves)
}

fn assert_on_path(places: &[Place], curves: &[Curve], tolerance: f64) {
    // Sparsely: the search is slow. Along the path, the nearest curve is near the last one.
    let mut near = 0;
    for place in places.iter().step_by(1 + places.len() / 200) {
        let found = (near..curves.len())
            .map(|number| (number, beside(&curves[number], *place)))
            .find(|(_, off)| *off <= tolerance + 12.0);
        let Some((number, _)) = found else {
            let least = curves.iter().map(|curve| beside(curve, *place)).fold(f64::INFINITY, f64::min);
            panic!("{least} pm off the path, {tolerance} allowed, near curve {near} of {}", curves.len());
        };
        near = number.saturating_sub(1);
    }
}

#[test]
fn programs_stay_on_their_path_within_limits_and_end_exactly() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let axes = [STAGE, Limits { speed: 5e5, acceleration: 2000.0, ..STAGE }];
    for number in 0..80 {
        let count = if number % 10 == 0 { 300 } else { random.random_range(1..20) };
        let (from, segments, curves) = any_program(&mut random, count);
        let mut tick = Tick::new(from, axes);
        for segment in &segments {
            tick.make_room();
            tick.program.take(segment).expect("it is one");
        }
        tick.finish();
        assert_within(&tick.places, &axes);
        assert_on_path(&tick.places, &curves, segments[0].tolerance.pm() as f64);
        assert_eq!(pm(*tick.places.last().unwrap()), segments.last().unwrap().to, "program {number}");
    }
}

/// Held, resumed and told another feed at any time, a program leaves its path no more than without, keeps its limits,
/// and comes to its end.
#[test]
fn programs_are_held_and_hurried_within_limits_and_on_their_path() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let axes = [STAGE; 2];
    let (mut holds, mut rates) = (0, 0);
    for number in 0..100 {
        let count = if number % 10 == 0 { 200 } else { random.random_range(1..20) };
        let (from, segments, curves) = any_program(&mut random, count);
        let mut tick = Tick::new(from, axes);
        let mut waiting = segments.iter();
        let mut left = 0;
        for _ in 0..400_000 {
            while tick.program.has_room()
                && let Some(segment) = waiting.next()
            {
                tick.program.take(segment).expect("it is one");
            }
            if left == 0 {
                left = random.random_range(1..4000);
                let start = tick.now.wrapping_add(20);
                let cut = match random.random_range(0..3) {
                    0 => {
                        rates += 1;
                        tick.program.set_rate(random.random_range(0.1..2.0), start)
                    }
                    _ if tick.program.is_held() => {
                        tick.program.go_on();
                        None
                    }
                    _ => {
                        holds += 1;
                        tick.program.rest(start)
                    }
                };
                tick.cut(cut);
            }
            left -= 1;
            tick.tick();
            if tick.program.is_done() && tick.stands() && waiting.len() == 0 {
                break;
            }
        }
        tick.program.go_on();
        tick.cut(None);
        for segment in waiting {
            tick.make_room();
            tick.program.take(segment).expect("it is one");
        }
        tick.finish();
        assert_within(&tick.places, &axes);
        assert_on_path(&tick.places, &curves, segments[0].tolerance.pm() as f64);
        assert_eq!(pm(*tick.places.last().unwrap()), segments.last().unwrap().to, "program {number}");
    }
    assert!(holds > 100 && rates > 60, "{holds} {rates}");
}

/// A hold on a line brakes with full jerk and acceleration, and at once.
#[test]
fn a_hold_takes_no_longer_than_the_limits_ask() {
    let mut tick = Tick::new([Pos::ZERO; 2], [STAGE; 2]);
    tick.program.take(&line([1e10, 0.0], 2e6, 0.0)).expect("it is one");
    (0..2000).for_each(|_| tick.tick());
    let cut = tick.program.rest(tick.now.wrapping_add(20));
    assert_eq!(cut, Some(tick.now.wrapping_add(20)));
    tick.cut(cut);
    let held_at = tick.places.len();
    tick.settle();
    // 20 mm/s at 500 mm/s² and 20 m/s³: 40 + 25 ms, after the 2 ms that a planner has.
    let ticks = tick.places.len() - held_at;
    assert!((665..=675).contains(&ticks), "{ticks}");
    assert_within(&tick.places, &[STAGE; 2]);
    tick.program.go_on();
    tick.finish();
    assert_eq!(tick.places.last(), Some(&[1e10, 0.0]));
    assert_within(&tick.places, &[STAGE; 2]);
}

/// Short lines that go straight on are sped up along and slowed down along over many of them, not over three.
#[test]
fn looking_ahead_over_short_lines_is_worth_its_while() {
    let fastest = |count: u32| {
        let mut tick = Tick::new([Pos::ZERO; 2], [STAGE; 2]);
        for number in 1..=count {
            tick.make_room();
            tick.program.take(&line([f64::from(number) * 1e7, 0.0], 2e6, 1e6)).expect("it is one");
        }
        tick.finish();
        assert_within(&tick.places, &[STAGE; 2]);
        tick.places.windows(2).map(|pair| pair[1][0] - pair[0][0]).fold(0.0, f64::max)
    };
    let (few, many) = (fastest(8), fastest(96));
    assert!(many > 2.0 * few, "{few} {many}");
}

/// A line of no length costs nothing.
#[test]
fn a_line_to_where_it_stands_is_passed_over() {
    let walked = |places: &[f64]| {
        let mut tick = Tick::new([Pos::ZERO; 2], [STAGE; 2]);
        for to in places {
            tick.program.take(&line([*to, 0.0], 2e6, 1e6)).expect("it is one");
        }
        tick.finish();
        assert_within(&tick.places, &[STAGE; 2]);
        tick.places
    };
    assert_eq!(walked(&[1e9, 1e9, 2e9]), walked(&[1e9, 2e9]));
}

/// Around a stop between two lines, too: the second is not begun, or left at once.
#[test]
fn a_hold_is_heard_at_any_tick_around_a_stop() {
    for before in -60..60 {
        let mut tick = Tick::new([Pos::ZERO; 2], [STAGE; 2]);
        tick.program.take(&line([1e9, 0.0], 2e6, 0.0)).expect("it is one");
        tick.program.take(&line([1e10, 0.0], 2e6, 0.0)).expect("it is one");
        // From rest to rest over a millimetre.
        (0..1132 + before).for_each(|_| tick.tick());
        let start = tick.now.wrapping_add(20);
        let cut = tick.program.rest(start);
        tick.cut(cut);
        let asked = tick.places.len();
        tick.settle();
        (0..100).for_each(|_| tick.tick());
        let ticks = tick.places.len() - asked;
        let way = tick.places.last().unwrap()[0] - 1e9;
        assert!(ticks < 400 && way < 1e7, "{before}: {ticks} ticks, {way} pm beyond");
        tick.program.go_on();
        tick.finish();
        assert_within(&tick.places, &[STAGE; 2]);
        assert_eq!(tick.places.last(), Some(&[1e10, 0.0]));
    }
}

/// A polygon of short lines that is gone along without stopping can also be left within a few of them.
#[test]
fn a_hold_among_short_lines_slows_down_through_their_corners() {
    let on = |k: u32| {
        let angle = f64::from(k) * 0.01;
        [1e10 * angle.cos(), 1e10 * angle.sin()].map(f64::round)
    };
    let mut tick = Tick::new(pm(on(0)), [STAGE; 2]);
    let mut next = 1;
    for _ in 0..60_000 {
        if tick.program.has_room() && next < 500 {
            tick.program.take(&line(on(next), 1e6, 1e6)).expect("it is one");
            next += 1;
        }
        tick.tick();
        if next == 400 {
            break;
        }
    }
    let cut = tick.program.rest(tick.now.wrapping_add(20));
    tick.cut(cut);
    let (held_at, place) = (tick.places.len(), *tick.places.last().unwrap());
    tick.settle();
    let way = (tick.places.last().unwrap()[0] - place[0]).hypot(tick.places.last().unwrap()[1] - place[1]);
    println!("{} ticks, {:.3} mm", tick.places.len() - held_at, way / 1e9);
    assert_within(&tick.places, &[STAGE; 2]);
}

/// A corner that becomes known later takes more of its lines than a rest would, and so asks for less speed before: what is
/// gone at already must not be taken back.
#[test]
fn chords_of_a_circle_that_become_known_one_by_one_are_gone_through() {
    let on = |k: u32| {
        let angle = f64::from(k) * 0.002;
        [8e9 + 2e9 * angle.cos(), 1e10 + 2e9 * angle.sin()].map(f64::round)
    };
    let mut tick = Tick::new(pm(on(0)), [STAGE; 2]);
    for k in 1..1600 {
        tick.make_room();
        tick.program.take(&line(on(k), 1e6, 1e6)).expect("it is one");
    }
    tick.finish();
    assert_within(&tick.places, &[STAGE; 2]);
    assert_eq!(tick.places.last(), Some(&on(1599)));
}

/// At a tolerance that is too small for a rounding at speed the lines are laid over each other.
#[test]
fn a_corner_of_a_micrometre_is_sooner_than_a_stop() {
    for (to, tolerance) in
        [([2e9, 1e9], 1e6), ([1e9, 1e9], 1e6), ([1.5e9, 0.3e9], 1e6), ([1e9, 1e9], 1e5), ([1.2e9, -1e9], 1e4)]
    {
        let places = [[0.0, 0.0], [1e9, 0.0], to];
        let walked = |tolerance: f64| {
            let mut tick = Tick::new(pm(places[0]), [STAGE; 2]);
            for place in &places[1..] {
                tick.program.take(&line(*place, 2e6, tolerance)).expect("it is one");
            }
            tick.finish();
            assert_within(&tick.places, &[STAGE; 2]);
            assert_eq!(tick.places.last(), Some(&to));
            tick.places
        };
        let (cut, stopped) = (walked(tolerance), walked(0.0));
        let nearest = cut.iter().map(|[x, y]| (x - 1e9).hypot(*y)).fold(f64::INFINITY, f64::min);
        println!("{nearest} pm of {tolerance}, {} ticks sooner", stopped.len() - cut.len());
        // But for where the ticks fall.
        assert!(nearest <= tolerance * 1.002 + 2.0 && nearest > 0.98 * tolerance, "{nearest} of {tolerance}");
        assert!(cut.len() + 15 < stopped.len(), "{} {}", cut.len(), stopped.len());
    }
}
