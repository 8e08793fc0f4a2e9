//! Arcs and sines against a search that only knows how a place follows from a parameter.

use crate::program::course::{self, Course};
use abbe_core::Pos;
use abbe_proto::gcode::{Action, Arc, Move, Path, Place, Sine, State, Turn, read};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// The motion of a line of G-code that begins at a place.
fn motion(from: Place, line: &str) -> Option<Move> {
    match read(&mut State::new(from), line.as_bytes()).ok()?.action {
        Some(Action::Move(there)) => Some(there),
        _ => None,
    }
}

fn course(there: &Move) -> Course {
    Course::of(there, &course::curve(there).unwrap())
}

/// A path over 0 … 1, pm from its beginning, and places on it at even distances of the parameter.
struct Curve<'a> {
    at: &'a dyn Fn(f64) -> [f64; 2],
    samples: Vec<[f64; 2]>,
}

impl<'a> Curve<'a> {
    fn new(at: &'a dyn Fn(f64) -> [f64; 2], steps: u32) -> Self {
        let samples = (0..=steps).map(|k| at(f64::from(k) / f64::from(steps))).collect();
        Self { at, samples }
    }

    /// The lowest and the highest place on an axis: a search beside each sample that no neighbour surpasses.
    fn ends(&self, axis: usize) -> [f64; 2] {
        [-1.0, 1.0].map(|sign| {
            let last = self.samples.len() - 1;
            let value = |k: usize| sign * self.samples[k][axis];
            let is_crest = |&k: &usize| {
                let neighbours = [k.saturating_sub(1), (k + 1).min(last)];
                neighbours.iter().all(|&other| value(other) <= value(k))
            };
            let found = (0..=last).filter(is_crest).map(|k| self.crest_near(k, axis, sign));
            sign * found.fold(f64::MIN, f64::max)
        })
    }

    /// The highest place (the lowest with −1) between the neighbours of a sample.
    fn crest_near(&self, k: usize, axis: usize, sign: f64) -> f64 {
        let value = |t: f64| sign * (self.at)(t)[axis];
        let (k, steps) = (k as f64, (self.samples.len() - 1) as f64);
        let [mut low, mut high] = [k - 1.0, k + 1.0].map(|k| (k / steps).clamp(0.0, 1.0));
        for _ in 0..60 {
            let [a, b] = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
            if value(a) < value(b) {
                low = a;
            } else {
                high = b;
            }
        }
        value(k / steps).max(value(0.5 * (low + high)))
    }

    /// Its length by chords, and the largest part of it that a chord goes along each axis.
    fn chords(&self) -> (f64, [f64; 2]) {
        let (mut length, mut shares) = (0.0, [0.0_f64; 2]);
        for pair in self.samples.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let way = [b[0] - a[0], b[1] - a[1]];
            let chord = way[0].hypot(way[1]);
            length += chord;
            shares = [0, 1].map(|axis| shares[axis].max(way[axis].abs() / chord));
        }
        (length, shares)
    }
}

/// How far a course is from the curve: at its extremes (pm), in its length (a part), in its shares.
fn differences(there: &Move, curve: &Curve<'_>) -> [f64; 3] {
    let course = course(there);
    let mut most = 0.0_f64;
    for axis in [0, 1] {
        let from = there.from[axis];
        let [low, high] = course.reach.0[axis].map(|point| point.place[axis]);
        // The beginning belongs to the motion before.
        let found = [low.min(from), high.max(from)].map(|place| (place - from).pm() as f64);
        let sought = curve.ends(axis);
        most = most.max((found[0] - sought[0]).abs()).max((found[1] - sought[1]).abs());
    }
    let (length, shares) = curve.chords();
    let part = (course.length_mm * 1e9 / length - 1.0).abs();
    let share = (0..2).map(|axis| (course.shares[axis] - shares[axis]).abs()).fold(0.0, f64::max);
    [most, part, share]
}

/// An arc as its angles tell it, without a word of crests.
fn arc_differences(there: &Move, arc: &Arc) -> [f64; 3] {
    let from_centre = |place: Place| [0, 1].map(|k| (place[k] - arc.centre[k]).pm() as f64);
    let (begin, end) = (from_centre(there.from), from_centre(there.to));
    let [first, last] = [begin, end].map(|[x, y]| y.atan2(x));
    let sense = if arc.turn == Turn::Clockwise { -1.0 } else { 1.0 };
    let sweep = if arc.full { TAU } else { (sense * (last - first)).rem_euclid(TAU) };
    let [r0, r1] = [begin, end].map(|[x, y]| x.hypot(y));
    let at = |t: f64| {
        let (sin, cos) = (first + sense * sweep * t).sin_cos();
        let radius = r0 + (r1 - r0) * t;
        [radius * cos - begin[0], radius * sin - begin[1]]
    };
    differences(there, &Curve::new(&at, 600))
}

fn sine_differences(there: &Move, sine: &Sine) -> [f64; 3] {
    let way = [0, 1].map(|k| (there.to[k] - there.from[k]).pm() as f64);
    let phase = (sine.phase.billionths() as f64 / 1e9).to_radians();
    let length = way[0].hypot(way[1]);
    let at = |t: f64| {
        let swing = (TAU * f64::from(sine.periods) * t + phase).sin() - phase.sin();
        let swing = sine.amplitude.pm() as f64 * swing / length;
        [way[0] * t - way[1] * swing, way[1] * t + way[0] * swing]
    };
    differences(there, &Curve::new(&at, 400 * sine.periods))
}

fn there_length(there: &Move) -> f64 {
    course(there).length_mm * 1e9
}

/// A place that is written with so many decimals of a millimetre.
fn rounded(mm: f64, decimals: i32) -> f64 {
    let tens = 10.0_f64.powi(decimals);
    (mm * tens).round() / tens
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12_000))]

    /// With nine decimals the two radii are one to the picometre; with three they differ as they do in real programs.
    #[test]
    fn an_arc_bulges_as_far_as_its_points(
        start in [0.0..100.0_f64, 0.0..100.0],
        radius in prop_oneof![0.05..1.0_f64, 1.0..80.0],
        angle in 0.0..TAU,
        sweep in prop_oneof![4 => 0.05..6.2_f64, 1 => Just(TAU)],
        quarters in prop::bool::weighted(0.2),
        clockwise in any::<bool>(),
        decimals in prop_oneof![Just(3), Just(4), Just(9)],
    ) {
        // Arcs that begin and end at crests are what people write.
        let quarter = |angle: f64| (angle / TAU * 4.0).ceil() * TAU / 4.0;
        let (angle, sweep) = if quarters { (quarter(angle), quarter(sweep)) } else { (angle, sweep) };
        let start = start.map(|mm| rounded(mm, decimals));
        let offset = [radius * angle.cos(), radius * angle.sin()].map(|mm| rounded(-mm, decimals));
        let last = if clockwise { angle - sweep } else { angle + sweep };
        let [x, y] = [[0, 1].map(|k| start[k] + offset[k])]
            .map(|[cx, cy]| [cx + radius * last.cos(), cy + radius * last.sin()])[0];
        let ends = if sweep > 6.25 { String::new() } else { format!("X{x:.*} Y{y:.*}", decimals as usize, decimals as usize) };
        let word = if clockwise { "G2" } else { "G3" };
        let line = format!("{word} {ends} I{:.9} J{:.9} F100", offset[0], offset[1]);
        let from = start.map(Pos::from_mm);
        // An arc so short that rounding has eaten it is refused.
        let Some(there) = motion(from, &line) else { return Err(TestCaseError::reject(line)) };
        let Path::Arc(arc) = there.path else { unreachable!() };
        let [place, length, share] = arc_differences(&there, &arc);
        let mismatch = arc.mismatch.pm().abs() as f64;
        // What it widens in a radian, or in all of a short one, tilts it at its crests.
        let widens = mismatch / (there_length(&there) / (radius * 1e9)).min(1.0);
        let off = (widens * widens / (radius * 1e9)).min(mismatch);
        prop_assert!(place <= 1.0 + off, "{place} pm, mismatch {mismatch} pm: {line} from {start:?}");
        // Shares are those of the circle; a mismatch tilts the path against it.
        let tilt = mismatch / (there_length(&there) + 1.0);
        // The length is that of the larger radius.
        let longer = 1.2 * mismatch / (radius * 1e9);
        prop_assert!(length < 1e-4 + longer && share < 0.01 + 2.0 * tilt, "{length} {share}: {line} from {start:?}");
    }

    #[test]
    fn a_sine_swings_as_far_as_its_points(
        start in [0.0..100.0_f64, 0.0..100.0],
        way in prop_oneof![
            3 => [-60.0..60.0_f64, -60.0..60.0],
            1 => (-60.0..60.0_f64).prop_map(|mm| [mm, 0.0]),
            1 => (-60.0..60.0_f64).prop_map(|mm| [0.0, mm]),
        ],
        // From far flatter than its line to far steeper.
        steep in -3.0..2.0_f64,
        periods in 1..8_u32,
        phase in prop_oneof![0.0..359.9_f64, prop::sample::select(vec![0.0, 45.0, 90.0, 180.0, 270.0])],
    ) {
        let from = start.map(Pos::from_mm);
        let [x, y] = [0, 1].map(|k| start[k] + way[k]);
        let length = way[0].hypot(way[1]);
        let amplitude = length / f64::from(periods) / TAU * 10.0_f64.powf(steep);
        let period = length / f64::from(periods);
        let line = format!("G5.5 X{x:.9} Y{y:.9} P{amplitude:.9} L{period:.9} Q{phase:.9} F100");
        let Some(there) = motion(from, &line) else { return Err(TestCaseError::reject(line)) };
        let Path::Sine(sine) = there.path else { unreachable!() };
        let [place, length, share] = sine_differences(&there, &sine);
        prop_assert!(place <= 1.0, "{place} pm: {line} from {start:?}");
        // At the crests of a steep sine a chord sees little of how fast it turns.
        let turned = 0.008 * 10.0_f64.powf(steep);
        prop_assert!(length < 3e-3 && share < 0.01 + turned * turned, "{length} {share}: {line} from {start:?}");
    }
}

/// What one can compute in one's head.
#[test]
fn known_curves_have_known_lengths() {
    let from = [50.0, 50.0].map(Pos::from_mm);
    for (line, length, ends) in [
        ("G2 I10 F1", TAU * 10.0, [[50.0, 70.0], [40.0, 60.0]]),
        ("G3 X70 I10 F1", TAU * 5.0, [[50.0, 70.0], [40.0, 50.0]]),
        ("G3 X60 Y60 J10 F1", TAU * 2.5, [[50.0, 60.0], [50.0, 60.0]]),
        // Three quarters of a turn about (60, 50).
        ("G2 X60 Y40 I10 F1", TAU * 7.5, [[50.0, 70.0], [40.0, 60.0]]),
        ("G2 X60 Y60 R-10 F1", TAU * 7.5, [[40.0, 60.0], [50.0, 70.0]]),
        ("G1 X53 Y46 F1", 5.0, [[50.0, 53.0], [46.0, 50.0]]),
        // sin: √2 · 2/π · E(½) = 1.216006723 times its line of one period, 2π wide.
        ("G5.5 X56.283185307 P1 L6.283185307 F1", 7.640395578, [[50.0, 56.283185307], [49.0, 51.0]]),
        // cos: it begins at a crest.
        ("G5.5 Y60 P1 L5 Q90 F1", 13.206582267, [[50.0, 52.0], [50.0, 60.0]]),
    ] {
        let there = motion(from, line).unwrap();
        let course = course(&there);
        assert!((course.length_mm - length).abs() < 1e-9, "{line}: {}", course.length_mm);
        let found = [0, 1].map(|axis| {
            let [low, high] = course.reach.0[axis].map(|point| point.place[axis]);
            [low.min(from[axis]), high.max(from[axis])]
        });
        assert_eq!(found, ends.map(|ends| ends.map(Pos::from_mm)), "{line}");
    }
}

/// From a crest on with a radius that grows, or up to one with a radius that shrinks: the path turns back 16 nm farther out,
/// beside its crest. That is less than the square of the mismatch, 2 µm, over the radius.
#[test]
fn an_arc_with_a_mismatch_turns_back_hardly_beyond_its_crest() {
    for (from, line, axis) in [
        ([1.05, 1.0], "G3 X1 Y1.052 I-0.05 J0 F1", 0),
        ([1.05, 1.0], "G2 X1 Y0.948 I-0.05 J0 F1", 0),
        ([1.0, 1.052], "G2 X1.05 Y1 I0 J-0.052 F1", 0),
        ([1.052, 1.0], "G3 X1 Y1.05 I-0.052 J0 F1", 1),
    ] {
        let there = motion(from.map(Pos::from_mm), line).unwrap();
        let Path::Arc(arc) = there.path else { unreachable!() };
        let [place, ..] = arc_differences(&there, &arc);
        assert!((15_000.0..80_000.0).contains(&place), "{place} pm: {line}");
        let high = course(&there).reach.0[axis][1].place[axis].max(there.from[axis]);
        assert_eq!(high, Pos::from_mm(1.05), "{line}");
    }
}
