//! Chords against the sine itself.

use super::super::compare::FARTHEST;
use super::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn counts(x: i64, y: i64) -> [Counts; 2] {
    [Counts::new(x), Counts::new(y)]
}

fn wave(amplitude: i64, period: i64, periods: u32, phase: u32) -> Wave {
    let (amplitude, period) = (Counts::new(amplitude), Counts::new(period));
    Wave { along: Axis::X, amplitude, period, periods, phase }
}

/// The ends of all chords, the start first.
fn ends(from: [Counts; 2], mut chords: Chords) -> Vec<[Counts; 2]> {
    let mut ends = vec![from];
    while let Some(mut line) = chords.next_line() {
        let mut at = ends[ends.len() - 1];
        while let Some(step) = line.next_step() {
            at = step.from(at);
        }
        ends.push(at);
    }
    ends
}

/// The largest distance across between a sine of an amplitude and its chord from `start` over `angle`.
fn farthest(amplitude: f64, start: f64, angle: f64) -> f64 {
    let (first, last) = (start.sin(), (start + angle).sin());
    let beside = |part: f64| amplitude * ((start + part * angle).sin() - first - part * (last - first)).abs();
    (1..32).map(|n| beside(f64::from(n) / 32.0)).fold(0.0, f64::max)
}

#[test]
fn no_chord_is_farther_than_the_tolerance_and_four_fewer_would_be() {
    let mut random = Pcg64Mcg::seed_from_u64(8);
    for _ in 0..200_000 {
        let amplitude = 2f64.powf(random.random_range(0.0..30.0)).round();
        let tolerance = 10f64.powf(random.random_range(-3.0..4.0));
        let n = chords_per_period(amplitude, tolerance);
        let angle = TAU / f64::from(n);
        // What sines of 10⁻¹⁶ leave of a difference.
        let allowed = tolerance * (1.0 + 1e-9) + amplitude * 1e-15;
        let start = random.random_range(0.0..TAU);
        assert!(farthest(amplitude, start, angle) <= allowed, "A = {amplitude}, T = {tolerance}");
        let over_the_crest = farthest(amplitude, PI / 2.0 - angle / 2.0, angle);
        assert!(over_the_crest <= allowed, "A = {amplitude}, T = {tolerance}");
        if n > 4 {
            let angle = TAU / f64::from(n - 4);
            let over_the_crest = farthest(amplitude, PI / 2.0 - angle / 2.0, angle);
            assert!(over_the_crest >= tolerance * (1.0 - 1e-9) - amplitude * 1e-15, "A = {amplitude}, {n}");
        }
    }
}

/// The distance of a point from a sine around y = `centre`, looked for within a part of a period either side.
fn distance(wave: &Wave, centre: f64, [x, y]: [f64; 2], turns: f64, within: f64) -> f64 {
    let (amplitude, period) = (wave.amplitude.get() as f64, wave.period.get() as f64);
    let begin = f64::from(wave.phase) / 4_294_967_296.0;
    (-200..=200).fold(f64::MAX, |nearest, n| {
        let turns = turns + within * f64::from(n) / 200.0;
        let swing = centre + amplitude * (TAU * (begin + turns)).sin();
        nearest.min((period * turns - x).hypot(swing - y))
    })
}

#[test]
fn every_point_is_near_the_sine() {
    let mut random = Pcg64Mcg::seed_from_u64(88);
    let mut worst = 0.0_f64;
    for _ in 0..60 {
        let tolerance = [0.01, 0.5, 3.0][random.random_range(0..3)];
        let period = random.random_range(-300..300);
        let wave = wave(random.random_range(1..200), period, 2, random.random());
        let mut chords = Chords::new(&wave, counts(0, 0), tolerance).unwrap();
        let centre = -(wave.amplitude.get() as f64) * chords.height(0);
        let per_period = f64::from(chords.per_period());
        let mut at = counts(0, 0);
        let mut chord = 0.5;
        while let Some(mut line) = chords.next_line() {
            while let Some(step) = line.next_step() {
                at = step.from(at);
                let point = at.map(|count| count.get() as f64);
                let off = distance(&wave, centre, point, chord / per_period, 1.0 / per_period);
                worst = worst.max(off - tolerance);
                // Between two places that are tried lies a 200th of a chord.
                let between = 0.005 * (period.abs() as f64 + TAU * wave.amplitude.get() as f64) / per_period;
                assert!(off <= tolerance + std::f64::consts::SQRT_2 + between, "{wave:?} {off}");
            }
            chord += 1.0;
        }
    }
    assert!(worst > 1.2, "the bound is not met from afar: {worst}");
}

#[test]
fn ends_are_the_rounded_sine_and_nothing_adds_up() {
    let wave = wave(1000, 12_345, 7, 0);
    let from = counts(-400, 25);
    let chords = Chords::new(&wave, from, 2.0).unwrap();
    let n = u64::from(chords.per_period());
    assert_eq!(chords.remaining(), 7 * n);
    let ends = ends(from, chords);
    assert_eq!(ends.len() as u64, 7 * n + 1);
    for (chord, end) in ends.iter().enumerate() {
        let turns = chord as f64 / n as f64;
        let exact = [-400.0 + 12_345.0 * turns, 25.0 + 1000.0 * (TAU * turns).sin()];
        for (count, exact) in end.iter().zip(exact) {
            assert!((count.get() as f64 - exact).abs() <= 0.5 + 1e-6, "{chord}");
        }
    }
    assert_eq!(ends[ends.len() - 1], counts(-400 + 7 * 12_345, 25));
}

#[test]
fn a_sine_and_a_cosine_reach_their_crests() {
    for (phase, lowest, highest) in
        [(0, -777, 777), (1 << 30, -1554, 0), (1 << 31, -777, 777), (3 << 30, 0, 1554)]
    {
        for tolerance in [0.1, 5.0, 300.0] {
            let chords = Chords::new(&wave(777, 5000, 1, phase), counts(0, 0), tolerance).unwrap();
            assert_eq!(chords.per_period() % 4, 0);
            let across = || ends(counts(0, 0), chords).into_iter().map(|[_, y]| y.get());
            assert_eq!((across().min(), across().max()), (Some(lowest), Some(highest)));
        }
    }
}

#[test]
fn other_axes_other_ways_and_swings_on_the_spot() {
    let from = counts(10, 20);
    let upward = Chords::new(&wave(50, 400, 3, 1 << 29), from, 0.5).unwrap();
    let other = |point: [Counts; 2], sign: i64| {
        let [x, y] = point.map(Counts::get);
        counts(10 + (y - 20), 20 + sign * (x - 10))
    };
    let turned = Wave { along: Axis::Y, ..wave(50, 400, 3, 1 << 29) };
    let expected: Vec<_> = ends(from, upward).into_iter().map(|point| other(point, 1)).collect();
    assert_eq!(ends(from, Chords::new(&turned, from, 0.5).unwrap()), expected);

    let spot = ends(from, Chords::new(&wave(50, 0, 2, 0), from, 0.5).unwrap());
    assert!(spot.iter().all(|[x, _]| x.get() == 10));
    assert_eq!((spot[spot.len() - 1], spot.iter().map(|[_, y]| y.get()).max()), (from, Some(70)));
    let back = ends(from, Chords::new(&wave(-50, -400, 1, 0), from, 0.5).unwrap());
    assert_eq!(back[back.len() - 1], counts(-390, 20));
    assert!(back[1][1].get() < 20);
    assert_eq!(Chords::new(&wave(0, 400, 1, 0), from, 0.5).unwrap().per_period(), 4);
    assert_eq!(Chords::new(&wave(50, 400, 0, 0), from, 0.5).unwrap().next_line(), None);
}

/// About a line in any direction, with an amplitude that is no whole number of counts: a rotated sine, from end to end.
#[test]
fn a_swing_about_any_line_is_near_its_sine_and_ends_exactly() {
    let mut random = Pcg64Mcg::seed_from_u64(888);
    for _ in 0..60 {
        let (tolerance, from) = (0.5, counts(random.random_range(-50..50), 7));
        let to = counts(random.random_range(60..900), random.random_range(-900..900));
        let (amplitude, periods) = (random.random_range(-90.0..90.0), random.random_range(1..4));
        let swing = Swing { to, amplitude, periods, phase: random.random() };
        let mut chords = Chords::swinging(&swing, from, tolerance).unwrap();
        assert!(chords.farthest() <= tolerance);
        let count = chords.remaining() as f64;
        let ([x, y], [way_x, way_y]) = (from.map(|count| count.get() as f64), way(from, to));
        let length = way_x.hypot(way_y);
        let begin = f64::from(swing.phase) / 4_294_967_296.0;
        let sine = |gone: f64| {
            let turns = begin + gone * f64::from(periods);
            let left = amplitude * ((TAU * turns).sin() - (TAU * begin).sin()) / length;
            [x + gone * way_x - left * way_y, y + gone * way_y + left * way_x]
        };
        let (mut at, mut chord) = (from, 0.5);
        while let Some(mut line) = chords.next_line() {
            while let Some(step) = line.next_step() {
                at = step.from(at);
                let [x, y] = at.map(|count| count.get() as f64);
                let off = (-200..=200).fold(f64::MAX, |nearest, n| {
                    let [sine_x, sine_y] = sine((chord + f64::from(n) / 200.0) / count);
                    nearest.min((sine_x - x).hypot(sine_y - y))
                });
                let steep = length + TAU * amplitude.abs() * f64::from(periods);
                let between = 0.005 * steep / count;
                assert!(off <= tolerance + std::f64::consts::SQRT_2 + between, "{swing:?} {off}");
            }
            chord += 1.0;
        }
        assert_eq!(at, to);
    }
}

#[test]
fn what_is_no_wave_is_named() {
    let small = wave(100, 100, 1, 0);
    for tolerance in [0.0, -1.0, 0.0009, f64::NAN, f64::INFINITY] {
        let error = Chords::new(&small, counts(0, 0), tolerance).unwrap_err();
        assert!(matches!(error, WaveError::Tolerance(_)));
    }
    let error = |wave: Wave, from| Chords::new(&wave, from, 1.0).unwrap_err();
    let far = |axis, at| WaveError::TooFar(TooFar { axis, at: Counts::new(at) });
    assert_eq!(error(small, counts(0, FARTHEST - 99)), far(Axis::Y, FARTHEST + 1));
    assert_eq!(error(small, counts(0, 99 - FARTHEST)), far(Axis::Y, -FARTHEST - 1));
    assert_eq!(error(wave(1, FARTHEST, 2, 0), counts(0, 0)), far(Axis::X, 2 * FARTHEST));
    assert_eq!(error(wave(1, i64::MIN, u32::MAX, 0), counts(0, 0)), far(Axis::X, i64::MIN));
    assert_eq!(error(small, counts(-FARTHEST - 1, 0)), far(Axis::X, -FARTHEST - 1));
    // A cosine begins on its crest.
    assert!(Chords::new(&wave(100, 100, 1, 1 << 30), counts(0, FARTHEST), 1.0).is_ok());
}
