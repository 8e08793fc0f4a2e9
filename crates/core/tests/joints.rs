//! Arcs, sines and lines that go over into each other without a stop: within limits, near their curves, exact at the end.

mod beside;
mod tick;
mod walked;

use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::{Curve, Place};
use abbe_core::plan::segment::{Feed, Segment, Shape};
use beside::{assert_on_path, beside};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tick::{Tick, line, pm};
use walked::{STAGE, assert_within};

/// A chain of curves, and how it is to be gone along.
#[derive(Debug)]
struct Chain {
    from: [Pos; 2],
    segments: Vec<Segment>,
    curves: Vec<Curve>,
    axes: [Limits; 2],
    tolerance: f64,
}

impl Chain {
    /// Any curves of any sizes: every other goes on as the last one ends, some with a kink, some with a sharp one, and some
    /// are whole circles.
    fn any(random: &mut Pcg64Mcg, number: usize) -> Self {
        let axes = [(); 2].map(|()| any_limits(random));
        let size = 10_f64.powf(random.random_range(5.0..9.5));
        let feed = size * 10_f64.powf(random.random_range(-2.5..-0.5));
        let tolerance = 10_f64.powf(random.random_range(2.0..7.0)).round();
        let from = pm([(); 2].map(|()| random.random_range(3e10..5e10_f64)));
        let mut chain = Self { from, segments: Vec::new(), curves: Vec::new(), axes, tolerance };
        let (mut at, mut heading) = (from, random.random_range(0.0..6.0_f64));
        while chain.segments.len() < number {
            let segment = Segment {
                feed: Feed::from_pm(feed),
                tolerance: Pos::from_pm(tolerance as i64),
                ..any_segment(random, at, heading, size)
            };
            let Some(curve) = segment.curve(at).filter(|curve| curve.length() > 0.0) else { continue };
            let end = curve.spot(curve.length()).tangent;
            heading = end[1].atan2(end[0])
                + match random.random_range(0..6) {
                    0 => random.random_range(-0.02..0.02),
                    1 => random.random_range(-3.1..3.1),
                    _ => 0.0,
                };
            at = segment.to;
            chain.segments.push(segment);
            chain.curves.push(curve);
        }
        chain
    }

    /// Gone along without being held.
    fn walked(&self) -> Vec<Place> {
        let mut tick = Tick::new(self.from, self.axes);
        for segment in &self.segments {
            tick.make_room();
            tick.program.take(segment).expect("it is one");
        }
        tick.finish();
        tick.places
    }

    fn assert_on_path(&self, places: &[Place], number: usize) {
        assert_on_path(places, &self.curves, self.tolerance, number);
        assert_eq!(places.last().map(|at| pm(*at)), self.segments.last().map(|last| last.to));
    }

    /// With a stop behind each curve.
    fn stopping(&self) -> Self {
        let segments =
            self.segments.iter().map(|segment| Segment { tolerance: Pos::ZERO, ..*segment }).collect();
        Self { segments, curves: self.curves.clone(), ..*self }
    }
}

fn any_limits(random: &mut Pcg64Mcg) -> Limits {
    let mut some = |middle: f64| middle * 10_f64.powf(random.random_range(-0.5..0.5));
    Limits { speed: some(2e6), acceleration: some(5000.0), jerk: some(20.0) }
}

fn any_segment(random: &mut Pcg64Mcg, at: [Pos; 2], heading: f64, size: f64) -> Segment {
    let place = at.map(|at| at.pm() as f64);
    let from = |place: Place, angle: f64, way: f64| {
        [place[0] + way * angle.cos(), place[1] + way * angle.sin()].map(f64::round)
    };
    let way = size * 10_f64.powf(random.random_range(-1.0..0.3));
    match random.random_range(0..5) {
        0 => Segment { to: pm(from(place, heading, way)), ..Segment::default() },
        1 => {
            let (periods, amplitude) = (random.random_range(1..3_u32), way * random.random_range(0.005..0.1));
            let phase = random.random_range(0..4_i64) * 90_000_000_000;
            // So that it begins in the direction of the last.
            let steep = amplitude * f64::from(periods) * std::f64::consts::TAU / way;
            let slope = (steep * (phase as f64 / 1e9).to_radians().cos()).atan();
            let shape = Shape::Sine { amplitude: Pos::from_pm(amplitude as i64), periods, phase };
            Segment { shape, to: pm(from(place, heading - slope, way)), ..Segment::default() }
        }
        kind => {
            let turn = if random.random_range(0..2) == 0 { 1.0 } else { -1.0 };
            let sweep = turn * random.random_range(0.1..6.2);
            let centre = from(place, heading + turn * std::f64::consts::FRAC_PI_2, way);
            let to = if kind == 4 {
                at
            } else {
                pm(from(centre, heading - turn * std::f64::consts::FRAC_PI_2 + sweep, way))
            };
            let shape = Shape::Arc { centre: pm(centre), counterclockwise: turn > 0.0 };
            Segment { shape, to, ..Segment::default() }
        }
    }
}

#[test]
fn curves_go_over_into_each_other_within_limits_and_tolerance() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let (mut through, mut stopping) = (0, 0);
    for number in 0..400 {
        let chain = Chain::any(&mut random, 2 + number % 4);
        let places = chain.walked();
        assert_within(&places, &chain.axes);
        chain.assert_on_path(&places, 60);
        let stopped = chain.stopping().walked();
        // But for where the ticks fall.
        assert!(places.len() <= stopped.len() + 3, "{} {}: {chain:?}", places.len(), stopped.len());
        through += places.len();
        stopping += stopped.len();
    }
    println!("{through} ticks, {stopping} with stops");
    assert!(20 * through < 19 * stopping, "{through} {stopping}");
}

/// Held, resumed and told another feed at any time, as lines are.
#[test]
fn curves_are_held_and_hurried_within_limits_and_tolerance() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let (mut holds, mut rates) = (0, 0);
    for number in 0..200 {
        let chain = Chain::any(&mut random, 2 + number % 8);
        let mut tick = Tick::new(chain.from, chain.axes);
        for segment in &chain.segments {
            tick.program.take(segment).expect("it is one");
        }
        let mut left = 0;
        for _ in 0..200_000 {
            if left == 0 {
                left = random.random_range(1..600);
                let start = tick.now.wrapping_add(20);
                let cut = match random.random_range(0..4) {
                    0 | 1 => {
                        rates += 1;
                        tick.program.set_rate(random.random_range(0.05..2.0), start)
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
            if tick.program.is_done() && tick.stands() {
                break;
            }
        }
        tick.program.go_on();
        tick.finish();
        chain.assert_on_path(&tick.places, 60);
        assert_within(&tick.places, &chain.axes);
    }
    assert!(holds > 500 && rates > 1000, "{holds} {rates}");
}

/// An arc about a centre, at 10 mm/s and 10 µm at its end.
fn arc(to: Place, centre: Place, tolerance: f64) -> Segment {
    let shape = Shape::Arc { centre: pm(centre), counterclockwise: true };
    Segment { shape, ..line(to, 1e6, tolerance) }
}

/// Two lines of 10 mm and two half circles of 5 mm.
fn stadium(tolerance: f64) -> [Segment; 4] {
    [
        line([1e10, 0.0], 1e6, tolerance),
        arc([1e10, 1e10], [1e10, 5e9], tolerance),
        line([0.0, 1e10], 1e6, tolerance),
        arc([0.0, 0.0], [0.0, 5e9], tolerance),
    ]
}

/// A circle of 5 mm in four quarters.
fn quarters(tolerance: f64) -> [Segment; 4] {
    [[0.0, 5e9], [-5e9, 0.0], [0.0, -5e9], [5e9, 0.0]].map(|to| arc(to, [0.0; 2], tolerance))
}

fn gone(from: Place, segments: &[Segment]) -> Vec<Place> {
    let mut tick = Tick::new(pm(from), [STAGE; 2]);
    for segment in segments {
        tick.program.take(segment).expect("it is one");
    }
    tick.finish();
    assert_within(&tick.places, &[STAGE; 2]);
    tick.places
}

/// The lowest speed between two ticks.
fn slowest(places: &[Place]) -> f64 {
    let speed = |pair: &[Place]| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
    places.windows(2).map(speed).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_stadium_is_gone_around_without_a_stop() {
    let (through, stopped) = (gone([0.0; 2], &stadium(1e7)), gone([0.0; 2], &stadium(0.0)));
    let middle = &through[1000..through.len() - 1000];
    println!("{} ticks, {} with stops; {} pm a tick at least", through.len(), stopped.len(), slowest(middle));
    assert!(slowest(middle) > 0.999e6);
    // Each stop costs 40 ms at least.
    assert!(through.len() + 1200 < stopped.len());
}

/// With decimals of a micrometre, as a program is written: there is a kink then.
#[test]
fn a_rounded_stadium_is_gone_around_without_a_stop() {
    let coarse = |at: Place| at.map(|at| (at / 1e6).round() * 1e6);
    let (sin, cos) = 0.3_f64.sin_cos();
    let turned = |[x, y]: Place| coarse([3e10 + cos * x - sin * y, 3e10 + sin * x + cos * y]);
    let segments = stadium(1e7).map(|segment| {
        let to = pm(turned(segment.to.map(|at| at.pm() as f64)));
        let shape = match segment.shape {
            Shape::Arc { centre, counterclockwise } => {
                Shape::Arc { centre: pm(turned(centre.map(|at| at.pm() as f64))), counterclockwise }
            }
            shape => shape,
        };
        Segment { shape, to, ..segment }
    });
    let through = gone(turned([0.0; 2]), &segments);
    let lowest = slowest(&through[1000..through.len() - 1000]);
    println!("{} ticks, {lowest} pm a tick at least", through.len());
    assert!(lowest > 0.99e6, "{lowest}");
}

#[test]
fn a_circle_in_quarters_is_gone_around_as_a_whole_one() {
    let whole = gone([5e9, 0.0], &[arc([5e9, 0.0], [0.0; 2], 0.0)]).len();
    let [cut, stopped] = [1e7, 0.0].map(|tolerance| gone([5e9, 0.0], &quarters(tolerance)).len());
    println!("{cut} ticks, {whole} of a whole circle, {stopped} with stops");
    assert!(cut <= whole + 3 && cut + 1200 < stopped, "{cut} {whole} {stopped}");
}

/// Small circles, where the tolerance decides: what is cut is not more than that, and not much less.
#[test]
fn a_line_into_a_small_arc_is_cut_by_its_tolerance() {
    for (radius, tolerance) in [(1e8, 1e4), (1e8, 1e3), (1e7, 1e4), (1e9, 1e3)] {
        let (to, centre) = ([1e9 + radius, radius], [1e9, radius]);
        let segments = [line([1e9, 0.0], 2e6, tolerance), arc(to, centre, 0.0)];
        let places = gone([0.0; 2], &segments);
        let stopped = gone([0.0; 2], &segments.map(|segment| Segment { tolerance: Pos::ZERO, ..segment }));
        let curves = [segments[0].curve(pm([0.0; 2])), segments[1].curve(segments[0].to)].map(Option::unwrap);
        let off =
            |place: &Place| curves.iter().map(|curve| beside(curve, *place)).fold(f64::INFINITY, f64::min);
        let off = places.iter().filter(|[x, _]| *x > 0.8e9).map(off).fold(0.0, f64::max);
        println!("{radius} pm: {off} of {tolerance} pm, {} of {} ticks", places.len(), stopped.len());
        assert!(off <= tolerance + 12.0 && off > 0.3 * tolerance, "{off} of {tolerance}");
        assert!(places.len() + 30 < stopped.len());
    }
}

#[test]
fn without_a_tolerance_it_stops_where_curves_meet() {
    for segments in [stadium(0.0).to_vec(), quarters(0.0).to_vec()] {
        let from = segments.last().map_or([0.0; 2], |last| last.to.map(|at| at.pm() as f64));
        let places = gone(from, &segments);
        for segment in &segments {
            let to = segment.to.map(|at| at.pm() as f64);
            assert!(places.windows(2).any(|pair| pair == [to, to]), "it does not stop at {to:?}");
        }
    }
}
