//! Steps against the curves that the controller goes.

use super::Grid;
use super::pace::Pace;
use super::survey::{Stepped, Survey, Surveyor};
use super::truth::Truth;
use super::walk::{NoSteps, Walk, distance};
use crate::preset::{self, Preset};
use crate::program::course::curve;
use crate::program::lines::Lines;
use crate::program::summary::Kind;
use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::Curve;
use abbe_proto::gcode::{self, Action, Arc, Corner, Move, Number, Path, Place, Rate, Sine, Turn};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::sync::LazyLock;

static USUAL: LazyLock<Preset> = LazyLock::new(|| preset::load(preset::USUAL).unwrap());

/// What the library says of a point that is beside a path of the grid.
const BOUND: f64 = std::f64::consts::FRAC_1_SQRT_2;

pub(crate) fn survey(program: &str, step_um: f64, moves: bool) -> Survey {
    let surveyor = Surveyor::new(&USUAL, 100, Grid::new(Pos::from_um(step_um), None), moves);
    surveyor.run([Pos::ZERO; 2], Lines::new(program.as_bytes(), &|_| ()), "a.nc").unwrap()
}

fn good(program: &str, step_um: f64) -> Vec<Stepped> {
    let survey = survey(program, step_um, false);
    assert_eq!(survey.checked.errors, []);
    assert!(survey.is_exact && survey.beside <= survey.bound);
    survey.told
}

#[test]
fn a_line_has_the_steps_of_both_axes() {
    let told = good("G0 X1 Y1\nG1 X3.0001 Y1.5 F60\nG1 X1 Y1\nG1 X1\n", 0.1);
    assert_eq!(told.len(), 2, "a line to where it begins is none");
    for line in told {
        assert_eq!((line.kind, line.steps), (Kind::Line, [20_001, 5_000]));
        let bound = 25_001.0 / 2.0 / 20_001_f64.hypot(5_000.0);
        assert!(line.beside <= bound + 1e-9 && line.beside > bound - 1e-3, "{} of {bound}", line.beside);
        assert!((line.time_s - line.length_mm).abs() < 1e-9, "1 mm/s");
    }
}

/// In all quadrants, both ways: each as many steps as from end to end, none farther beside it than the library says.
#[test]
fn arcs_of_all_quadrants_and_full_circles_end_exactly() {
    let places: [[f64; 2]; 8] = [
        [0.5, 0.0],
        [0.3, 0.4],
        [0.0, 0.5],
        [-0.4, 0.3],
        [-0.5, 0.0],
        [-0.3, -0.4],
        [0.0, -0.5],
        [0.4, -0.3],
    ];
    for word in ["G2", "G3"] {
        let mut whole = [0, 0];
        let ring = places.iter().chain([&places[0]]).collect::<Vec<_>>();
        let ring: Vec<_> = if word == "G2" { ring.into_iter().rev().collect() } else { ring };
        for pair in ring.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|[x, y]| [x + 2.0, y + 2.0]);
            let (x, y, i, j) = (to[0], to[1], 2.0 - from[0], 2.0 - from[1]);
            let program =
                format!("G0 X{} Y{}\n{word} X{x:.4} Y{y:.4} I{i:.4} J{j:.4} F60\n", from[0], from[1]);
            let [arc] = &good(&program, 0.1)[..] else { panic!("{program}") };
            // Within a quadrant no axis turns back.
            assert_eq!(arc.steps, [0, 1].map(|axis| ((to[axis] - from[axis]).abs() * 1e4).round() as u64));
            assert!(arc.bound < BOUND + 1e-9, "{}", arc.bound);
            whole = [whole[0] + arc.steps[0], whole[1] + arc.steps[1]];
        }
        let [circle] = &good(&format!("G0 X2.5 Y2\n{word} I-0.5 F60\n"), 0.1)[..] else { panic!() };
        assert_eq!((circle.steps, whole), ([20_000, 20_000], [20_000, 20_000]));
        assert!(circle.beside > 0.7 && circle.bound < BOUND + 1e-9, "{circle:?}");
    }
}

#[test]
fn tiny_arcs_have_their_few_steps() {
    let [circle] = &good("G0 X1 Y1\nG3 I0.0001 F60\n", 0.1)[..] else { panic!() };
    assert_eq!(circle.steps, [4, 4]);
    let [quarter] = &good("G0 X1 Y1\nG2 X1.0001 Y1.0001 I0.0001 F60\n", 0.1)[..] else { panic!() };
    assert_eq!(quarter.steps, [1, 1]);
}

#[test]
fn a_sine_is_as_many_chords_as_its_tolerance_asks_for() {
    let [sine] = &good("G0 Y1\nG5.5 X4 Y1 P0.5 L2 Q90 F60\n", 0.1)[..] else { panic!() };
    let chords = sine.chords.unwrap();
    // A step of tolerance at 5000 steps of amplitude: n ≥ π / 2 asin √(1 / 10 000) = 157.07.
    assert_eq!((chords.per_period, chords.count), (160, 320));
    assert!(chords.farthest <= 1.0 && chords.farthest > 0.9);
    assert_eq!(sine.steps[0], 40_000);
    assert!(sine.bound < 1.0 + 2_f64.sqrt() + 1e-3 && sine.beside > 1.0, "{sine:?}");
}

/// Anywhere, beside the grid, with ends that do not fit their centre: the bound holds, it is small, and distances are
/// those from the curve that a stage goes.
#[test]
fn random_motions_keep_to_their_bound() {
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let (mut stepped, mut refused, mut largest) = (0, 0, 0.0_f64);
    for round in 0..1500 {
        let grid = Grid::new(Pos::from_um([0.1, 1.0, 7.0][round % 3]), None);
        let there = motion(&mut random, grid.step());
        let Some(curve) = curve(&there) else { continue };
        let begun = match Walk::begin(&there, &grid, curve.length() * 1e-6) {
            Ok(begun) => begun,
            Err(
                NoSteps::Short { .. } | NoSteps::Tight { .. } | NoSteps::Unequal { .. } | NoSteps::Crossed,
            ) => {
                refused += 1;
                continue;
            }
            Err(error) => panic!("{error}"),
        };
        let truth = Truth::of(&there, &grid, begun.chords.as_ref());
        let mut walk = begun.walk.clone();
        let mut beside = 0.0_f64;
        let samples: Vec<[f64; 2]> = (0..=4000)
            .map(|n| {
                curve.spot(curve.length() * f64::from(n) / 4000.0).at.map(|at| at / grid.step().pm() as f64)
            })
            .collect();
        let apart = curve.length() / grid.step().pm() as f64 / 4000.0;
        let is_gentle = is_gentle(&there, &curve, grid.step());
        let mut number = 0;
        while walk.next().is_some() {
            let point = super::as_floats(walk.at());
            let nearest = truth.nearest(point, walk.chord());
            let off = distance(point, nearest);
            beside = beside.max(off);
            number += 1;
            if number % 97 == 1 {
                let found = samples.iter().map(|&sample| distance(point, sample)).fold(f64::MAX, f64::min);
                let on = samples.iter().map(|&sample| distance(nearest, sample)).fold(f64::MAX, f64::min);
                let near = apart + 1e-3;
                assert!(found <= off + near && on <= near, "{there:?}: {found} {off} {on}");
                // Where it bends sharply another part of it may be nearer than the one that the point belongs to.
                assert!(!is_gentle || off <= found + near, "{there:?}: {found} {off}");
            }
        }
        assert!(beside <= begun.bound + 1e-6, "{there:?}: {beside} of {}", begun.bound);
        assert_eq!(walk.at(), grid.nearest(there.to), "{there:?}");
        // A sine about a line that is short for its crests may be turned by much.
        if !matches!(there.path, Path::Sine(_)) {
            largest = largest.max(begun.bound);
        }
        stepped += 1;
    }
    assert!(stepped > 1200 && refused > 20 && largest < 8.0, "{stepped} {refused} {largest}");
}

/// No radius is less than three steps, and that of an arc stays the same.
fn is_gentle(there: &Move, curve: &Curve, step: Pos) -> bool {
    let least = curve.bend().map_or(f64::INFINITY, |bend| 1.0 / bend.curvature);
    let is_even = match there.path {
        Path::Arc(arc) => {
            let [begin, end] = [there.from, there.to].map(|end| distance(pm(end), pm(arc.centre)));
            (begin - end).abs() < 1e-3 * step.pm() as f64
        }
        _ => true,
    };
    least > 3.0 * step.pm() as f64 && is_even
}

/// Of up to some hundred steps.
fn motion(random: &mut Pcg64Mcg, step: Pos) -> Move {
    let size = 2_f64.powf(random.random_range(0.0..9.0)) * step.pm() as f64;
    let mut somewhere =
        |size: f64| -> Place { [0; 2].map(|_: i32| Pos::from_pm(random.random_range(-size..size) as i64)) };
    let (from, to) = (somewhere(1e9), somewhere(size));
    let to = [from[0] + to[0], from[1] + to[1]];
    let centre = somewhere(size);
    let path = match random.random_range(0..3) {
        0 => Path::Line,
        1 => {
            let full = random.random_bool(0.1);
            let turn = if random.random_bool(0.5) { Turn::Clockwise } else { Turn::Counterclockwise };
            let centre = [from[0] + centre[0], from[1] + centre[1]];
            let radius = distance(pm(from), pm(centre));
            let angle = random.random_range(0.0..std::f64::consts::TAU);
            let wrong = if random.random_bool(0.5) {
                radius
            } else {
                radius + random.random_range(-2.0..2.0) * step.pm() as f64
            };
            let end = [
                centre[0] + Pos::from_pm((wrong * angle.cos()) as i64),
                centre[1] + Pos::from_pm((wrong * angle.sin()) as i64),
            ];
            let to = if full { from } else { end };
            let arc = Arc { centre, turn, full, mismatch: Pos::ZERO };
            return Move {
                from,
                to,
                path: Path::Arc(arc),
                rate: Rate::PerMinute(Pos::from_mm(1.0)),
                corner: Corner::ExactStop,
            };
        }
        _ => Path::Sine(Sine {
            amplitude: Pos::from_pm((size * random.random_range(0.01..1.0)) as i64 + 1),
            periods: random.random_range(1..4),
            phase: Number::from_billionths(random.random_range(0..360_000_000_000)),
        }),
    };
    Move { from, to, path, rate: Rate::PerMinute(Pos::from_mm(1.0)), corner: Corner::ExactStop }
}

fn pm(place: Place) -> [f64; 2] {
    place.map(|at| at.pm() as f64)
}

#[test]
fn what_has_no_steps_is_told_with_its_line() {
    for (program, step_um, told) in [
        (
            "G1 X0.00004 F60\n",
            0.1,
            "line 1: in steps of 0.1 µm: both ends of this motion of 0.0400 µm are one point",
        ),
        ("G1 X0.2 F60\n", 1000.0, "take smaller steps"),
        (
            "G0 X1 Y1\nG2 I0.00005 F60\n",
            0.1,
            "line 2: in steps of 0.1 µm: the radius of 0.0500 µm is less than a step",
        ),
        ("G0 X10 Y10\nG3 X12.0029 Y8 J-2 I0.001 F60\n", 0.1, "steps unequally far from its centre"),
        ("G1 X100 F60\n", 0.6, "lead to x = 100.000200 mm of the machine, beyond the travel"),
    ] {
        let survey = survey(program, step_um, false);
        let [found] = &survey.checked.errors[..] else { panic!("{program}: {:?}", survey.checked) };
        assert!(found.to_string().contains(told), "{found}");
    }
}

#[test]
fn a_stage_is_refused_what_its_steps_cannot_start_and_stop() {
    let paper = survey("G1 X1 F60\nX2\n", 0.1, false);
    assert_eq!((paper.checked.count, paper.fast), (0, 2));
    let stage = survey("G1 X1 F60\nX2\n", 0.1, true);
    let told = "line 1: the feed of 1.000000 mm/s is more than 0.0178";
    assert!(stage.checked.count == 2 && stage.checked.errors[0].to_string().starts_with(told), "{stage:?}");
    // As told, and a little more.
    let most = stage.told[0].start_stop_mm_s * 60.0;
    assert_eq!(survey(&format!("G1 X1 F{most:.9}\n"), 0.1, true).checked.count, 0);
    assert_eq!(survey(&format!("G1 X1 F{:.9}\n", most * 1.001), 0.1, true).checked.count, 1);
}

#[test]
fn a_step_takes_the_time_that_it_is_given() {
    let limits = Limits { speed: 2e6, acceleration: 5000.0, jerk: 20.0 };
    for step_um in [0.1, 7.0, 1000.0] {
        let pace = Pace::new(&Grid::new(Pos::from_um(step_um), None), [limits; 2]);
        let least = pace.least([1, 1]);
        // Four phases of full jerk, as long as the acceleration is not reached.
        let full_jerk = (32.0 * step_um * 1e6 / limits.jerk).cbrt();
        // To a tick, and another one from the rest there to the next step.
        assert!(
            least >= full_jerk + 1.0 && (step_um > 10.0 || least < full_jerk + 2.0),
            "{least} {full_jerk}"
        );
        for part in [1.0, 1.5, 20.0] {
            let [feed, _] = pace.feeds(part * least);
            let slowed = Limits { speed: feed.pm(), ..limits };
            let takes = super::pace::lasts(step_um * 1e6, &slowed);
            let left = part * least - 1.0 - takes;
            assert!((0.0..0.02 + 1e-3 * takes).contains(&left), "{takes} of {}", part * least);
        }
    }
}

#[test]
fn only_motions_at_a_feed_have_steps() {
    let mut state = gcode::State::new([Pos::ZERO; 2]);
    let division = super::stage::Division::new(&USUAL, 50, Grid::new(Pos::from_um(10.0), None));
    let mut segments = |line: &str| {
        let action: Action = gcode::read(&mut state, line.as_bytes()).unwrap().action.unwrap();
        division.segments(&action).map(|segment| segment.to.map(Pos::um)).collect::<Vec<_>>()
    };
    assert_eq!(segments("G0 X0.026 Y0.01"), [[30.0, 10.0]]);
    assert_eq!(segments("G1 X0.05 Y0.02 F6"), [[40.0, 10.0], [40.0, 20.0], [50.0, 20.0]]);
    assert_eq!(segments("G28 X0.06"), [[60.0, 20.0], [0.0, 20.0]]);
    assert!(segments("G4 P1").is_empty());
}
