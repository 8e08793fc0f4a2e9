//! How true the set-points of programs are to their paths, tick by tick: circles, corners, joints and scans.
//!
//! `cargo run --release -p abbe-core --example paths`. It fails if a set-point is farther from its path than it may be, or a
//! difference of set-points beyond a limit.

mod walk;

use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::compare::Axis;
use abbe_core::plan::corner::Corner;
use abbe_core::plan::curve::Place;
use abbe_core::plan::scan::{Lines, Order, Scan};
use abbe_core::plan::segment::{Feed, Segment, Shape};
use walk::Walk;

/// A stage at 10 kHz, pm and ticks.
struct Stage {
    name: &'static str,
    limits: Limits,
}

const STAGES: [Stage; 2] = [
    Stage { name: "microscope-100", limits: Limits { speed: 2e6, acceleration: 5000.0, jerk: 20.0 } },
    Stage { name: "litho-120", limits: Limits { speed: 5e5, acceleration: 1000.0, jerk: 5.0 } },
];

/// Part of a limit: what the sums of a walk have rounded.
const ROUNDED: f64 = 1e-6;

fn main() {
    let mut good = circles();
    good &= corners();
    good &= joints();
    corner_speeds();
    chords();
    scans();
    assert!(good, "a set-point is where it may not be");
}

fn pm(place: Place) -> [Pos; 2] {
    place.map(|at| Pos::from_pm(at as i64))
}

fn line(to: Place, tolerance: f64) -> Segment {
    let tolerance = Pos::from_pm(tolerance as i64);
    Segment { to: pm(to), feed: Feed::RAPID, tolerance, ..Segment::default() }
}

/// Full circles at full speed: how far the set-points are from them.
fn circles() -> bool {
    println!(
        "| circle of 10 mm | speed, mm/s | set-points | radial error, nm | largest difference, part of its limit |"
    );
    println!("|---|---:|---:|---:|---:|");
    let mut good = true;
    for Stage { name, limits } in STAGES {
        let (radius, begins) = (1e10, [6e10, 5e10]);
        let shape = Shape::Arc { centre: pm([5e10, 5e10]), counterclockwise: true };
        let circle = Segment { shape, to: pm(begins), feed: Feed::RAPID, ..Segment::default() };
        let walk = Walk::of(pm(begins), [limits; 2], &[circle]);
        let off =
            walk.exact.iter().map(|[(x, _), (y, _)]| (x.position - 5e10).hypot(y.position - 5e10) - radius);
        let [low, high] = off.fold([0.0, 0.0], |[low, high]: [f64; 2], off| [low.min(off), high.max(off)]);
        let most = walk.largest(&limits);
        let speed = limits.speed * 1e4 / 1e9;
        println!(
            "| `{name}` | {speed:.0} | {} | {:.4} … {:+.4} | {most:.4} |",
            walk.places.len(),
            low / 1e3,
            high / 1e3
        );
        good &= low > -5000.0 && high < 5000.0 && most <= 1.0 + ROUNDED;
    }
    good
}

/// Corners of two lines of 10 mm, cut by a micrometre at most, beside stops.
fn corners() -> bool {
    println!(
        "\n| corner of two lines of 10 mm, `microscope-100` | tolerance, µm | cut by, µm | ticks | with a stop | largest difference, part of its limit |"
    );
    println!("|---|---:|---:|---:|---:|---:|");
    let limits = STAGES[0].limits;
    let mut good = true;
    for (degrees, tolerance) in [(90.0, 1e6), (45.0, 1e6), (10.0, 1e6), (1.0, 1e6), (90.0, 1e8)] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let places = [[0.0, 0.0], [1e10, 0.0], [(1e10 * (1.0 + cos)).round(), (1e10 * sin).round()]];
        let walked = |tolerance| {
            Walk::of(pm(places[0]), [limits; 2], &[line(places[1], tolerance), line(places[2], tolerance)])
        };
        let (cut, stopped) = (walked(tolerance), walked(0.0));
        let nearest = cut.between(|[x, y]| (x - 1e10).hypot(y));
        let most = cut.largest(&limits);
        println!(
            "| {degrees:.0}° | {} | {:.4} | {} | {} | {most:.4} |",
            tolerance / 1e6,
            nearest / 1e6,
            cut.places.len(),
            stopped.places.len()
        );
        good &= nearest <= tolerance * 1.0001 + 2.0
            && cut.places.len() <= stopped.places.len()
            && most <= 1.0 + ROUNDED;
    }
    good
}

/// A stadium of two lines of 10 mm and two half circles, and a circle of 5 mm in quarters, at 10 mm/s and 10 µm, beside stops.
fn joints() -> bool {
    println!(
        "\n| lines and arcs of 5 mm at 10 mm/s, 10 µm, `microscope-100` | ticks | with stops | slowest, mm/s | largest difference, part of its limit |"
    );
    println!("|---|---:|---:|---:|---:|");
    let feed = Feed::from_pm(1e6);
    let line = |to, tolerance| Segment { feed, ..line(to, tolerance) };
    let arc = |to, centre, tolerance| {
        let shape = Shape::Arc { centre: pm(centre), counterclockwise: true };
        Segment { shape, ..line(to, tolerance) }
    };
    let stadium = |tolerance| {
        [
            line([2e10, 1e10], tolerance),
            arc([2e10, 2e10], [2e10, 1.5e10], tolerance),
            line([1e10, 2e10], tolerance),
            arc([1e10, 1e10], [1e10, 1.5e10], tolerance),
        ]
    };
    let quarters = |tolerance| {
        [[1.5e10, 1e10], [2e10, 1.5e10], [1.5e10, 2e10], [1e10, 1.5e10]]
            .map(|to| arc(to, [1.5e10, 1.5e10], tolerance))
    };
    let mut good = true;
    let limits = STAGES[0].limits;
    for (name, from, segments) in [
        ("stadium", [1e10, 1e10], [stadium(1e7), stadium(0.0)]),
        ("circle in quarters", [1e10, 1.5e10], [quarters(1e7), quarters(0.0)]),
    ] {
        let [through, stopped] = segments.map(|segments| Walk::of(pm(from), [limits; 2], &segments));
        // But for the ends.
        let places = &through.places[1000..through.places.len() - 1000];
        let speed = |pair: &[Place]| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]) * 1e4 / 1e9;
        let slowest = places.windows(2).map(speed).fold(f64::INFINITY, f64::min);
        let most = through.largest(&limits);
        println!(
            "| {name} | {} | {} | {slowest:.3} | {most:.4} |",
            through.places.len(),
            stopped.places.len()
        );
        good &= slowest > 9.99 && through.places.len() < stopped.places.len() && most <= 1.0 + ROUNDED;
    }
    good
}

/// The speed through a right angle at a micrometre when nothing limits the jerk, beside an arc tangent to both lines, as
/// controllers without such a limit put there: its radius is (1 + √2) of the tolerance, and the acceleration is for the
/// turn alone.
fn corner_speeds() {
    let limits = Limits { jerk: 1e9, ..STAGES[0].limits };
    let places = [[0.0, 0.0], [1e10, 0.0], [1e10, 1e10]];
    let corner = Corner::fastest(places, &[limits; 2], limits.speed, 1e6, 5e9);
    let arc = (limits.acceleration * 1e6 * (1.0 + std::f64::consts::SQRT_2)).sqrt();
    let in_mm_s = |speed: f64| speed * 1e4 / 1e9;
    println!("\n| right angle at 1 µm, 500 mm/s², no limit of jerk | mm/s |");
    println!("|---|---:|");
    println!("| this corner | {:.3} |", in_mm_s(corner.speed));
    println!("| an arc between the lines | {:.3} |", in_mm_s(arc));
}

/// A circle of 2 mm radius in chords at 10 mm/s, corners cut by a micrometre at most: how fast it is gone through.
fn chords() {
    println!("\n| circle of 2 mm in chords, `microscope-100`, 1 µm, 10 mm/s asked for | mean speed, mm/s |");
    println!("|---|---:|");
    let limits = STAGES[0].limits;
    for um in [4.0, 20.0, 100.0, 500.0] {
        let (radius, angle) = (2e9, um * 1e6 / 2e9);
        let on = |number: u32| {
            let at = angle * f64::from(number);
            [6e9 + radius * at.cos(), 6e9 + radius * at.sin()].map(f64::round)
        };
        let number = (1.5 * std::f64::consts::PI / angle) as u32;
        let feed = Feed::from_pm(1e6);
        let segments: Vec<Segment> = (1..=number).map(|k| Segment { feed, ..line(on(k), 1e6) }).collect();
        let walk = Walk::of(pm(on(0)), [limits; 2], &segments);
        let way = f64::from(number) * 2.0 * radius * (angle / 2.0).sin();
        println!("| {um:.0} µm | {:.2} |", way / 1e9 / (walk.places.len() as f64 / 1e4));
    }
}

/// Scans of 10 × 5 mm at full speed, 0.5 mm between lines.
fn scans() {
    println!(
        "\n| serpentine of 10 × 5 mm, 11 lines | turn, ticks | stop and go, ticks | off its lines, pm | speed off, pm a tick | largest difference, part of its limit |"
    );
    println!("|---|---:|---:|---:|---:|---:|");
    for Stage { name, limits } in STAGES {
        let scan = Scan {
            corners: [pm([1e10, 1e10]), pm([2e10, 1.5e10])],
            fast: Axis::X,
            lines: Lines::Number(11),
            order: Order::Serpentine,
            speed: limits.speed,
            settle: 0,
        };
        let axes = [limits; 2];
        let plan = scan.plan(&axes).expect("it can be scanned");
        let segment = Segment::scanning(&scan, &axes).expect("it can be scanned");
        let walk = Walk::of(plan.start(), axes, &[segment]);
        let (mut off, mut uneven) = (0.0_f64, 0.0_f64);
        let lines: Vec<_> = (0..plan.lines()).filter_map(|number| plan.line(number)).collect();
        for line in &lines {
            let inside =
                &walk.places[line.enters as usize + walk.begins..=line.leaves as usize + walk.begins];
            let direction = (line.to[0] - line.from[0]).pm().signum() as f64;
            for (number, [x, y]) in inside.iter().enumerate() {
                let ahead = line.from[0].pm() as f64 + direction * limits.speed * number as f64;
                off = off.max((x - ahead).abs()).max((y - line.from[1].pm() as f64).abs());
            }
            for pair in inside.windows(2) {
                uneven = uneven.max(((pair[1][0] - pair[0][0]).abs() - limits.speed).abs());
            }
        }
        let turn = f64::from(lines[1].enters) - lines[0].leaves;
        let stopping = stop_and_go(&limits);
        println!(
            "| `{name}` | {turn:.0} | {stopping:.0} | {off:.0} | {uneven:.0} | {:.4} |",
            walk.largest(&limits)
        );
        assert!(off <= 2.0 && uneven <= 2.0);
    }
}

/// To rest, half a millimetre across, and up to speed again.
fn stop_and_go(limits: &Limits) -> f64 {
    use abbe_core::plan::transfer::{State, Transfer};
    let going = State { speed: limits.speed, ..State::default() };
    let stop = Transfer::stop(going, limits).expect("it can stop").ticks();
    let across = State { position: 5e8, ..State::default() };
    2.0 * stop + Transfer::fastest(State::default(), across, limits).expect("it can step").ticks()
}
