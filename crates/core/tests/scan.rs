//! Scans of areas, tick by tick: straight and at constant speed inside, within limits and room everywhere, from rest to rest.

mod walked;

use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::compare::Axis;
use abbe_core::plan::curve::Place;
use abbe_core::plan::pieces::Piece;
use abbe_core::plan::scan::{Line, Lines, Order, Scan, ScanError, ScanPlan};
use abbe_core::plan::transfer::{State, Transfer};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use walked::{STAGE, assert_within};

/// 5 mm/s, 0.1 m/s², 5 m/s³ at 10 kHz.
const LITHO: Limits = Limits { speed: 5e5, acceleration: 1000.0, jerk: 5.0 };

/// 2 × 1 mm from 10, 20 mm on, 11 lines at 10 mm/s, 5 ms to settle.
const SMALL: Scan = Scan {
    corners: [
        [Pos::from_pm(10_000_000_000), Pos::from_pm(20_000_000_000)],
        [Pos::from_pm(12_000_000_000), Pos::from_pm(21_000_000_000)],
    ],
    fast: Axis::X,
    lines: Lines::Number(11),
    order: Order::Serpentine,
    speed: 1e6,
    settle: 50,
};

fn walked(plan: &ScanPlan) -> Vec<Place> {
    let pieces: Vec<Piece> = plan.pieces().map(|piece| piece.expect("it fits")).collect();
    walked::walked(&pieces, f64::from(plan.ticks()))
}

fn places(positions: [Pos; 2]) -> Place {
    positions.map(|position| position.pm() as f64)
}

/// Everything that a scan promises, for each tick; where its lines lie is told apart from the plan.
fn assert_is_scan(scan: &Scan, axes: &[Limits; 2]) -> ScanPlan {
    let plan = scan.plan(axes).unwrap_or_else(|error| panic!("{error} {scan:?}"));
    let path = walked(&plan);
    assert_within(&path, axes);
    assert_rests(&path, &plan);
    assert_extent(&path, &plan);
    let mut within = vec![false; path.len()];
    for number in 0..plan.lines() {
        assert_line(scan, &plan, number, &path, &mut within);
    }
    assert_eq!(plan.line(plan.lines()), None);
    // Nowhere else is the fast axis within the area, but on the way back of a fly-back.
    if scan.order == Order::Serpentine {
        let fast = scan.fast.index();
        let ends = scan.corners.map(|corner| corner[fast].pm() as f64);
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        for (place, within) in path.iter().zip(&within) {
            let inside = place[fast] > low + 2.0 && place[fast] < high - 2.0;
            assert!(!inside || *within, "{place:?} {scan:?}");
        }
    }
    plan
}

fn assert_rests(path: &[Place], plan: &ScanPlan) {
    let ticks = plan.ticks() as usize;
    assert_eq!(path[0], places(plan.start()));
    assert!(path[ticks..].iter().all(|place| *place == places(plan.end())), "{plan:?}");
    for two in [&path[..2], &path[ticks - 1..=ticks]] {
        // Jerk from rest: a sixth of it in the first tick.
        assert!((0..2).all(|axis| (two[1][axis] - two[0][axis]).abs() <= STAGE.jerk / 6.0 + 1.0), "{two:?}");
    }
}

/// All of it is inside, and nothing is spare.
fn assert_extent(path: &[Place], plan: &ScanPlan) {
    let extent = plan.extent().map(places);
    for axis in 0..2 {
        let [low, high] = extent.map(|corner| corner[axis]);
        let of = |place: &Place| place[axis];
        let lowest = path.iter().map(of).fold(f64::INFINITY, f64::min);
        let highest = path.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        // At a turn the place between two ticks is farther than at both.
        let spare = STAGE.acceleration / 8.0 + 2.0;
        assert!(lowest >= low && lowest <= low + spare, "{axis}: {lowest} {low} {plan:?}");
        assert!(highest <= high && highest >= high - spare, "{axis}: {highest} {high} {plan:?}");
    }
}

fn assert_line(scan: &Scan, plan: &ScanPlan, number: u32, path: &[Place], within: &mut [bool]) {
    let (fast, slow) = (scan.fast.index(), 1 - scan.fast.index());
    let line = plan.line(number).expect("there is one");
    let back = scan.order == Order::Serpentine && number % 2 == 1;
    let [mut from, mut to] = scan.corners.map(|corner| corner[fast]);
    if back {
        (from, to) = (to, from);
    }
    assert_eq!((line.from[fast], line.to[fast]), (from, to));
    // Where it lies, by whole numbers.
    let [first, last] = scan.corners.map(|corner| i128::from(corner[slow].pm()));
    let (row, n) = (i128::from(line.from[slow].pm()), i128::from(number));
    let (way, pitches) = match scan.lines {
        Lines::Number(lines) => {
            assert_eq!(plan.lines(), lines);
            ((last - first) * n, i128::from(lines - 1).max(1))
        }
        Lines::Pitch(pitch) => ((last - first).signum() * n * i128::from(pitch.pm()), 1),
    };
    // Rounded to the nearest picometre.
    assert!(2 * ((row - first) * pitches - way).abs() <= pitches, "{row} {scan:?}");
    assert_eq!(line.from[slow], line.to[slow]);
    // Straight and at constant speed, from the settling on.
    let direction = (to - from).pm().signum() as f64;
    let (begins, ends) = (line.enters - scan.settle, line.leaves.floor() as u32);
    for tick in begins..=ends {
        let expected = from.pm() as f64 + direction * scan.speed * (f64::from(tick) - f64::from(line.enters));
        let place = path[tick as usize];
        assert!((place[fast] - expected).abs() <= 1.0, "{tick} {place:?} {expected} {scan:?}");
        assert_eq!(place[slow], line.from[slow].pm() as f64);
        within[tick as usize] = tick >= line.enters;
    }
    assert_eq!(path[line.enters as usize], places(line.from));
    let ticks = (to - from).pm().abs() as f64 / scan.speed;
    assert!((line.leaves - f64::from(line.enters) - ticks).abs() < 1e-6);
}

#[test]
fn a_small_scan_goes_over_all_of_its_lines() {
    for (limits, speed) in [(STAGE, 2e6), (STAGE, 1e6), (LITHO, 5e5), (LITHO, 1e5)] {
        for order in [Order::Serpentine, Order::FlyBack] {
            for fast in [Axis::X, Axis::Y] {
                assert_is_scan(&Scan { speed, order, fast, ..SMALL }, &[limits; 2]);
            }
        }
    }
}

fn random_scan(random: &mut Pcg64Mcg, limits: &[Limits; 2]) -> Scan {
    let mut decades = |low: f64, high: f64| 10_f64.powf(random.random_range(low..high));
    let (length, width) = (decades(0.0, 9.5), decades(1.0, 9.5));
    let part = decades(-2.5, 0.0);
    let fast = [Axis::X, Axis::Y][random.random_range(0..2)];
    let number = random.random_range(1..9_u32);
    let lines = match random.random_range(0..3) {
        0 => Lines::Number(number),
        _ => {
            Lines::Pitch(Pos::from_pm((width / f64::from(number) * random.random_range(0.8..1.0)) as i64 + 1))
        }
    };
    let from = [(); 2].map(|()| random.random_range(0..100_000_000_000_i64));
    let mut way =
        [length, width].map(|way| if random.random() { way.ceil() as i64 } else { -way.ceil() as i64 });
    if fast == Axis::Y {
        way.swap(0, 1);
    }
    let to = [from[0] + way[0], from[1] + way[1]];
    let order = [Order::Serpentine, Order::FlyBack][random.random_range(0..2)];
    let settle = [0, 1, random.random_range(0..300)][random.random_range(0..3)];
    let speed = limits[fast.index()].speed * if random.random_range(0..3) == 0 { 1.0 } else { part };
    Scan { corners: [from, to].map(|corner| corner.map(Pos::from_pm)), fast, lines, order, speed, settle }
}

/// Long and short, wide and narrow, steps that take longer than the turn, both orders, all directions.
#[test]
fn random_scans_keep_all_that_they_promise() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let (mut kept, mut waits) = (0, 0);
    while kept < 2000 {
        let axes = [[STAGE; 2], [LITHO; 2], [STAGE, LITHO], [LITHO, STAGE]][random.random_range(0..4)];
        let scan = random_scan(&mut random, &axes);
        let fast = scan.fast.index();
        let length = (scan.corners[1][fast] - scan.corners[0][fast]).pm().abs() as f64;
        if length / scan.speed > 5000.0 {
            continue;
        }
        let plan = assert_is_scan(&scan, &axes);
        if let [Some(a), Some(b)] = [plan.line(0), plan.line(1)] {
            let ticks = f64::from(b.enters) - a.leaves;
            waits += u32::from(ticks > soonest(&scan, &axes[fast], b, a) + 1.0);
        }
        kept += 1;
    }
    // In some the slow axis decides, not in most.
    assert!((100..1500).contains(&waits), "{waits}");
}

/// Ticks from the end of a line to the next, by the planner for any two states.
fn soonest(scan: &Scan, limits: &Limits, ahead: Line, line: Line) -> f64 {
    let fast = scan.fast.index();
    let [from, to] = [line.to[fast], ahead.from[fast]].map(|pos| pos.pm() as f64);
    let way = |line: Line| (line.to[fast] - line.from[fast]).pm().signum() as f64;
    let (before, after) = (way(line) * scan.speed, way(ahead) * scan.speed);
    let settle = f64::from(scan.settle);
    let from = State { position: from, speed: before, acceleration: 0.0 };
    let to = State { position: to - after * settle, speed: after, acceleration: 0.0 };
    // A line is never left faster than it was gone through.
    let limits = match scan.order {
        Order::Serpentine => Limits { speed: scan.speed, ..*limits },
        Order::FlyBack => *limits,
    };
    Transfer::fastest(from, to, &limits).expect("it is possible").ticks() + settle
}

/// The formulas of both turns, beside the planner for any two states.
#[test]
fn no_turn_takes_a_tick_longer_than_the_soonest() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    for _ in 0..100_000 {
        let axes = [STAGE, LITHO].map(|limits| Limits {
            speed: limits.speed * 10_f64.powf(random.random_range(-1.0..1.0)),
            acceleration: limits.acceleration * 10_f64.powf(random.random_range(-1.0..1.0)),
            ..limits
        });
        let mut scan = random_scan(&mut random, &axes);
        scan.lines = Lines::Number(2);
        // A step that is over at once.
        let slow = 1 - scan.fast.index();
        scan.corners[1][slow] = scan.corners[0][slow] + Pos::from_pm(1);
        let plan = match scan.plan(&axes) {
            Err(ScanError::TooLong) => continue,
            plan => plan.unwrap_or_else(|error| panic!("{error} {scan:?}")),
        };
        let [a, b] = [0, 1].map(|number| plan.line(number).expect("there are two"));
        let fast = &axes[scan.fast.index()];
        let shortest = soonest(&scan, fast, b, a).max(
            Transfer::fastest(State::default(), State { position: 1.0, ..State::default() }, &axes[slow])
                .expect("it is possible")
                .ticks()
                + f64::from(scan.settle),
        );
        let ticks = f64::from(b.enters) - a.leaves;
        assert!(
            ticks >= shortest * (1.0 - 1e-9) && ticks < shortest * (1.0 + 1e-9) + 1.0,
            "{ticks} {shortest} {scan:?}"
        );
    }
}

/// How long turns take, beside stopping, stepping and setting out again. With `--nocapture` it prints a table.
#[test]
fn a_turn_on_the_way_is_sooner_than_a_stop() {
    println!(
        "limits, line speed, pitch: turn and its room, fly-back over 10 mm, stop and go; at 10 kHz, without settling"
    );
    for (name, limits, speed, pitch) in [
        ("microscope-100", STAGE, 20.0, 500.0),
        ("microscope-100", STAGE, 20.0, 50.0),
        ("microscope-100", STAGE, 5.0, 500.0),
        ("litho-120", LITHO, 5.0, 500.0),
        ("litho-120", LITHO, 5.0, 50.0),
        ("litho-120", LITHO, 1.0, 50.0),
    ] {
        let at = |x: f64, y: f64| [Pos::from_um(x), Pos::from_um(y)];
        let scan = |order| Scan {
            corners: [at(0.0, 0.0), at(10_000.0, pitch)],
            lines: Lines::Number(2),
            speed: speed * 1e5,
            settle: 0,
            order,
            ..SMALL
        };
        let [turn, fly_back] = [Order::Serpentine, Order::FlyBack].map(|order| {
            let plan = scan(order).plan(&[limits; 2]).expect("it is possible");
            let [a, b] = [0, 1].map(|number| plan.line(number).expect("there are two"));
            f64::from(b.enters) - a.leaves
        });
        let [_, room] = scan(Order::Serpentine).plan(&[limits; 2]).expect("it is possible").room();
        let rest = |position: f64| State { position, ..State::default() };
        let step = Transfer::fastest(rest(0.0), rest(pitch * 1e6), &limits).expect("it is possible").ticks();
        let moving = State { speed: speed * 1e5, ..State::default() };
        let stop = Transfer::stop(moving, &limits).expect("it is possible").ticks();
        let stop_and_go = 2.0 * stop + step;
        let [turn, fly_back, stop_and_go] = [turn, fly_back, stop_and_go].map(|ticks| ticks / 10.0);
        println!(
            "{name}, {speed} mm/s, {pitch} µm: {turn:.1} ms, {:.3} mm, {fly_back:.1} ms, {stop_and_go:.1} ms",
            room.mm()
        );
        assert!(turn < 0.8 * stop_and_go);
    }
}

#[test]
fn the_room_for_the_turns_is_told_and_the_travel_is_kept() {
    let plan = SMALL.plan(&[STAGE; 2]).expect("it is possible");
    // 5 ms and a turn of ± 10 mm/s: 0.05 + 0.15 mm or so.
    let [low, high] = plan.room();
    assert!(low.um() > 150.0 && low.um() < 300.0 && high.um() > 200.0 && high < low, "{low:?} {high:?}");
    assert_eq!(
        plan.extent(),
        [[Pos::from_mm(10.0) - low, Pos::from_mm(20.0)], [Pos::from_mm(12.0) + high, Pos::from_mm(21.0)],]
    );
    let extent = plan.extent();
    assert_eq!(plan.fits(&extent), Ok(()));
    for (axis, corner, by) in [(0, 0, 1), (0, 1, -1), (1, 0, 1), (1, 1, -1)] {
        let mut travel = extent;
        travel[corner][axis] = travel[corner][axis] + Pos::from_pm(by);
        let [needs, travel_of] = [extent, travel].map(|corners| corners.map(|corner| corner[axis]));
        assert_eq!(plan.fits(&travel), Err(ScanError::BeyondTravel { axis, needs, travel: travel_of }));
    }
    let text =
        plan.fits(&[[Pos::ZERO; 2], [Pos::from_mm(12.0), Pos::from_mm(100.0)]]).unwrap_err().to_string();
    assert!(
        text.starts_with("with its turns the scan needs x = 9.") && text.contains("0.000000 … 12.000000"),
        "{text}"
    );
}

#[test]
fn what_is_no_scan_is_refused() {
    let refused = |scan: Scan| scan.plan(&[STAGE; 2]).unwrap_err();
    for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(refused(Scan { speed, ..SMALL }), ScanError::NoNumber);
        let limits = Limits { acceleration: speed, ..STAGE };
        assert_eq!(SMALL.plan(&[STAGE, limits]), Err(ScanError::NoNumber));
    }
    let too_fast = ScanError::TooFast { axis: 0, asked: 2_500_000, limit: 2_000_000 };
    assert_eq!(refused(Scan { speed: 2.5e6, ..SMALL }), too_fast);
    assert_eq!(
        too_fast.to_string(),
        "the line speed of 2500000 pm a tick is above the limit of x, 2000000; scan slower"
    );
    let [from, [x, y]] = SMALL.corners;
    assert_eq!(refused(Scan { corners: [from, [from[0], y]], ..SMALL }), ScanError::NoLength { axis: 0 });
    let flat = Scan { corners: [from, [x, from[1]]], ..SMALL };
    assert_eq!(refused(flat), ScanError::NoPitch);
    assert_eq!(refused(Scan { lines: Lines::Number(0), ..SMALL }), ScanError::NoPitch);
    assert_eq!(refused(Scan { lines: Lines::Number(1_000_000_002), ..SMALL }), ScanError::NoPitch);
    for pitch in [0, -1] {
        assert_eq!(refused(Scan { lines: Lines::Pitch(Pos::from_pm(pitch)), ..SMALL }), ScanError::NoPitch);
    }
    // One line needs no pitch.
    assert_is_scan(&Scan { lines: Lines::Number(1), ..flat }, &[STAGE; 2]);
    assert_is_scan(&Scan { lines: Lines::Pitch(Pos::from_mm(5.0)), ..SMALL }, &[STAGE; 2]);
}

#[test]
fn what_does_not_fit_a_tick_is_refused() {
    let far = |mm: f64| [[Pos::ZERO; 2], [Pos::from_mm(mm), Pos::from_mm(1.0)]];
    for order in [Order::Serpentine, Order::FlyBack] {
        let plan =
            |scan: Scan, limits: Limits| Scan { order, ..scan }.plan(&[limits; 2]).map(|plan| plan.lines());
        assert_eq!(plan(Scan { corners: far(549.0), ..SMALL }, STAGE), Ok(11));
        // The area fits, its turns do not.
        assert_eq!(plan(Scan { corners: far(549.75), ..SMALL }, STAGE), Err(ScanError::DoesNotFit));
        assert_eq!(plan(Scan { corners: far(1e6), ..SMALL }, STAGE), Err(ScanError::TooLong));
        assert_eq!(plan(Scan { corners: far(1e300), ..SMALL }, STAGE), Err(ScanError::TooLong));
        for speed in [1.0, 1e-300] {
            assert_eq!(plan(Scan { speed, ..SMALL }, STAGE), Err(ScanError::TooLong));
        }
        assert_eq!(
            plan(Scan { lines: Lines::Number(1_000_000_001), ..SMALL }, STAGE),
            Err(ScanError::TooLong)
        );
        assert_eq!(plan(Scan { settle: u32::MAX, ..SMALL }, STAGE), Err(ScanError::TooLong));
        assert_eq!(plan(SMALL, Limits { jerk: 1e5, ..STAGE }), Err(ScanError::DoesNotFit));
        let steep = Limits { speed: 1e8, acceleration: 1e6, jerk: 8000.0 };
        assert_eq!(plan(Scan { speed: 3e7, ..SMALL }, steep), Err(ScanError::DoesNotFit));
    }
}

/// What a builder or a stranger may ask for: refused or planned, and what is planned has all its pieces.
#[test]
fn no_request_makes_a_plan_with_a_hole() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut planned = 0;
    for _ in 0..20_000 {
        let mut any = |low: f64, high: f64| 10_f64.powf(random.random_range(low..high));
        let axes = [(); 2].map(|()| Limits {
            speed: any(-5.0, 9.0),
            acceleration: any(-5.0, 7.0),
            jerk: any(-5.0, 6.0),
        });
        let corner = |random: &mut Pcg64Mcg| {
            [(); 2].map(|()| {
                let size = 10_f64.powf(random.random_range(0.0..13.0));
                Pos::from_pm(if random.random() { size as i64 } else { -size as i64 })
            })
        };
        let scan = Scan {
            corners: [corner(&mut random), corner(&mut random)],
            fast: [Axis::X, Axis::Y][random.random_range(0..2)],
            lines: Lines::Number(random.random_range(0..20)),
            order: [Order::Serpentine, Order::FlyBack][random.random_range(0..2)],
            speed: 10_f64.powf(random.random_range(-3.0..8.0)),
            settle: random.random_range(0..1000),
        };
        let Ok(plan) = scan.plan(&axes) else { continue };
        let pieces: Vec<Piece> =
            plan.pieces().map(|piece| piece.unwrap_or_else(|| panic!("{scan:?}"))).collect();
        assert!(
            pieces
                .windows(2)
                .all(|two| two[0][0].first <= two[1][0].first && two[0][0].first == two[0][1].first)
        );
        assert_eq!(pieces.last().map(|piece| piece[0].first), Some(plan.ticks()));
        planned += 1;
    }
    assert!(planned > 1000, "{planned}");
}
