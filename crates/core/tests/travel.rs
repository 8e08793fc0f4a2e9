//! Set-points stay within the travel, wherever the stage is sent elsewhere from.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bench;
mod tick;
mod walked;

use abbe_core::plan::segment::{Feed, Segment, Shape};
use abbe_core::{Command, Pos};
use bench::{Bench, mm};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tick::Tick;
use walked::STAGE;

/// A place so far from the ends of both travels, mm: the lower ones or the upper ones.
fn inside(from_end: [f64; 2], upper: bool) -> [Pos; 2] {
    let [x, y] = from_end.map(|from_end| if upper { 100.0 - from_end } else { from_end });
    mm(x, y)
}

/// Near the corner of the travel, now and then at its end.
fn any_place(random: &mut Pcg64Mcg) -> [f64; 2] {
    let size = 10_f64.powf(random.random_range(-5.0..1.0));
    [(); 2].map(|()| if random.random_range(0..3) == 0 { 0.0 } else { random.random_range(0.0..size) })
}

fn outside(bench: &Bench) -> f64 {
    bench.places.iter().flatten().map(|at| (-at).max(at - 1e11)).fold(0.0, f64::max)
}

/// Around a circle that touches the end of both travels, until it is near to one.
fn circle_along_the_end(bench: &mut Bench, random: &mut Pcg64Mcg, upper: bool) {
    let radius = 10_f64.powf(random.random_range(-1.5..0.5));
    let far = radius * (1.0 + 0.5_f64.sqrt());
    let start = inside([far; 2], upper);
    bench.move_to(start[0].mm(), start[1].mm());
    bench.places.clear();
    let (centre, counterclockwise) = (inside([radius; 2], upper), random.random_range(0..2) == 0);
    let shape = Shape::Arc { centre, counterclockwise };
    bench.go(&[Segment { shape, to: start, feed: Feed::RAPID, ..Segment::default() }]);
    let near = radius * 10_f64.powf(random.random_range(-3.0..0.0));
    for _ in 0..20_000 {
        bench.tick();
        if bench.places.last().unwrap().iter().any(|at| at.min(1e11 - at) < near * 1e9) {
            break;
        }
    }
}

/// To come to rest takes more way than to turn back, and that a circle may leave none of.
#[test]
fn a_turn_stays_within_the_travel() {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let (mut worst, mut turns) = ([0.0_f64; 2], 0);
    let mut bench = Bench::new().homed();
    for number in 0..600 {
        let (circling, upper) = (number % 2 == 0, number >= 300);
        if circling {
            circle_along_the_end(&mut bench, &mut random, upper);
        } else {
            let start = inside([3.0, 5.0], upper);
            bench.move_to(start[0].mm(), start[1].mm());
            bench.places.clear();
        }
        for _ in 0..10 {
            bench.ask(Command::MoveTo(inside(any_place(&mut random), upper)));
            turns += 1;
            bench.run(random.random_range(1..300));
        }
        bench.settle();
        bench.assert_moved_within_limits();
        let worst = &mut worst[usize::from(circling)];
        *worst = worst.max(outside(&bench));
    }
    println!("{worst:?} pm outside, {turns} turns");
    assert!(worst == [0.0; 2], "{worst:?} pm outside");
}

/// Two arcs that crest 2 nm before the end of the travel meet in a kink between: laid over each other they would cut across it.
#[test]
fn curves_laid_over_each_other_stay_within_the_travel() {
    let (radius, kink, crest): (f64, f64, f64) = (1e9, 0.3, 1e11 - 2e3);
    let [below, above] = [-1.0, 1.0].map(|side| [crest - radius, 5e10 + side * radius * kink.sin()]);
    let on = |centre: [f64; 2], angle: f64| {
        [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
            .map(|at| Pos::from_pm(at.round() as i64))
    };
    let arc = |centre: [f64; 2], to: f64| Segment {
        shape: Shape::Arc { centre: centre.map(|at| Pos::from_pm(at as i64)), counterclockwise: true },
        to: on(centre, to),
        feed: Feed::RAPID,
        tolerance: Pos::from_um(200.0),
    };
    let chain = [arc(below, kink), arc(above, 1.2)];
    let farthest = |travel: Option<[[Pos; 2]; 2]>| {
        let mut tick = Tick::new(on(below, -1.2), [STAGE; 2]);
        if let Some(travel) = travel {
            tick.program = tick.program.within(travel);
        }
        for segment in &chain {
            tick.program.take(segment).unwrap();
        }
        tick.finish();
        (tick.places.iter().map(|place| place[0]).fold(0.0, f64::max), tick.places.len())
    };
    let end = [[Pos::ZERO, Pos::from_mm(100.0)]; 2];
    let ((free, soon), (within, later)) = (farthest(None), farthest(Some(end)));
    assert!(free > 1e11 + 1e6, "{free}");
    assert!(within <= 1e11, "{within}");
    // As soon as ever where the end of the travel is farther away than the tolerance.
    let far = farthest(Some([[Pos::ZERO, Pos::from_mm(101.0)]; 2]));
    assert_eq!(far, (free, soon));
    assert!(later > soon, "{later} {soon}");
}
