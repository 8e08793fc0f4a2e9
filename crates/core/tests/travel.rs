//! Set-points stay within the travel, wherever the stage is sent elsewhere from.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bench;
mod walked;

use abbe_core::plan::segment::{Feed, Segment, Shape};
use abbe_core::{Command, Pos};
use bench::{Bench, mm};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

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
