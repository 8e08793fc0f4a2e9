//! Motions along curves, tick by tick: on the curve, within the limits of each axis by their differences, exact at the end.

mod walked;

use abbe_core::plan::Limits;
use abbe_core::plan::curve::{Arc, Curve, Place, Sine};
use abbe_core::plan::pieces::{Along, Piece};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;
use walked::{STAGE, assert_within};

/// 5 mm/s.
const LITHO: Limits = Limits { speed: 5e5, ..STAGE };

/// The set-points of a motion, pm.
fn walked(along: &Along) -> Vec<Place> {
    let pieces: Vec<Piece> = along.pieces().map(|piece| piece.expect("it fits")).collect();
    walked::walked(&pieces, along.ticks())
}

/// How far from a line a place is, pm, to its left.
fn off_line(from: Place, to: Place, [x, y]: Place) -> f64 {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    ((y - from[1]) * dx - (x - from[0]) * dy) / dx.hypot(dy).max(1.0)
}

fn off_circle(centre: Place, radius: f64, [x, y]: Place) -> f64 {
    (x - centre[0]).hypot(y - centre[1]) - radius
}

/// A sine by its equation.
#[derive(Clone, Copy, Debug)]
struct Wave {
    from: Place,
    to: Place,
    amplitude: f64,
    periods: u32,
    phase: f64,
}

impl Wave {
    /// How far from it a place is, by the tangent of its equation there.
    fn off(&self, [x, y]: Place) -> f64 {
        let [dx, dy] = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let length = dx.hypot(dy);
        let along = ((x - self.from[0]) * dx + (y - self.from[1]) * dy) / length;
        let turn = TAU * f64::from(self.periods) / length;
        let angle = turn * along + self.phase;
        let left = self.amplitude * (angle.sin() - self.phase.sin());
        let slope = self.amplitude * turn * angle.cos();
        (off_line(self.from, self.to, [x, y]) - left) / slope.hypot(1.0)
    }
}

/// Radial error of a circle of 10 mm, smallest and largest, pm.
fn circle(limits: Limits) -> [f64; 2] {
    let (from, centre) = ([5e10, 2e10], [4e10, 2e10]);
    let curve = Curve::Arc(Arc::new(from, from, centre, true).expect("an arc"));
    let along = Along::fastest(curve, &[limits; 2], limits.speed).expect("it is possible");
    let places = walked(&along);
    assert_within(&places, &[limits; 2]);
    assert_eq!(places.last(), Some(&from));
    let errors = places.iter().map(|place| off_circle(centre, 1e10, *place));
    errors.fold([f64::MAX, f64::MIN], |[low, high], error| [low.min(error), high.max(error)])
}

#[test]
fn a_circle_is_round() {
    for (name, limits) in [("microscope-100, 20 mm/s", STAGE), ("litho-120, 5 mm/s", LITHO)] {
        let [low, high] = circle(limits);
        println!("{name}: radial error {low:.1} … {high:.1} pm");
        // 5 nm were asked for.
        assert!(low > -15.0 && high < 15.0, "{name}: {low} {high}");
    }
}

#[test]
fn random_curves_are_kept_to_and_end_exactly() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut kept = 0;
    for number in 0..3000 {
        let mut place = || [(); 2].map(|()| random.random_range(0.0..1e11_f64).round());
        let from = place();
        let size = 10_f64.powf(random.random_range(2.0..10.0));
        let [angle, sweep] = [(); 2].map(|()| random.random_range(0.0..TAU));
        let axes = [STAGE, if number % 2 == 0 { STAGE } else { LITHO }];
        let feed = 2e6 * 10_f64.powf(random.random_range(-3.0..0.5));
        let on = |angle: f64| [from[0] + size * angle.cos(), from[1] + size * angle.sin()];
        let curve = if number % 3 == 0 {
            Curve::Line { from, to: on(angle).map(f64::round) }
        } else {
            let ends = [on(angle), on(angle + sweep)];
            Curve::Arc(Arc::new(ends[0], ends[1], from, random.random()).expect("an arc"))
        };
        let along = Along::fastest(curve, &axes, feed).expect("it is possible");
        if along.ticks() > 100_000.0 {
            continue;
        }
        let places = walked(&along);
        assert_within(&places, &axes);
        for place in &places {
            let error = match curve {
                Curve::Line { from, to } => off_line(from, to, *place),
                _ => off_circle(from, size, *place),
            };
            assert!(error.abs() < 15.0, "{error} {curve:?}");
        }
        let end = curve.spot(curve.length()).at.map(f64::round);
        assert_eq!(places.last(), Some(&end), "{curve:?}");
        kept += 1;
    }
    assert!(kept > 1500, "{kept}");
}

/// Flat and steep, one period and many.
#[test]
fn random_sines_are_kept_to_and_end_exactly() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let mut kept = 0;
    for _ in 0..250 {
        let mut decades = |low: f64, high: f64| 10_f64.powf(random.random_range(low..high));
        let (length, amplitude) = (decades(6.0, 10.5), decades(4.0, 9.5));
        let periods = decades(0.0, 2.0) as u32;
        let [angle, phase] = [(); 2].map(|()| random.random_range(0.0..TAU));
        let from = [(); 2].map(|()| random.random_range(0.0..1e11_f64).round());
        let to = [from[0] + length * angle.cos(), from[1] + length * angle.sin()];
        let wave = Wave { from, to, amplitude, periods, phase };
        let curve = Curve::Sine(Sine::new(from, to, amplitude, periods, phase).expect("a sine"));
        let axes = [STAGE, LITHO];
        let along = Along::fastest(curve, &axes, 2e6).expect("it is possible");
        if along.ticks() > 200_000.0 {
            continue;
        }
        let places = walked(&along);
        assert_within(&places, &axes);
        for place in &places {
            assert!(wave.off(*place).abs() < 15.0, "{} {wave:?}", wave.off(*place));
        }
        assert_eq!(places.last(), Some(&to.map(f64::round)), "{wave:?}");
        kept += 1;
    }
    assert!(kept > 100, "{kept}");
}

/// As rounded numbers leave them, and as far apart as an arc's ends may be.
#[test]
fn arcs_with_two_radii_stay_within_the_limits_and_end_exactly() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut kept = 0;
    for number in 0..400 {
        let size = 10_f64.powf(random.random_range(5.0..9.7));
        let widens = 1.0 + random.random_range(-0.09..0.09) * if number % 2 == 0 { 1.0 } else { 1e-3 };
        let [angle, sweep] = [(); 2].map(|()| random.random_range(0.1..TAU));
        let on = |angle: f64, size: f64| [5e10 + size * angle.cos(), 4e10 + size * angle.sin()];
        let ends = [on(angle, size), on(angle + sweep, size * widens)];
        let curve = Curve::Arc(Arc::new(ends[0], ends[1], [5e10, 4e10], true).expect("an arc"));
        let feed = 10_f64.powf(random.random_range(3.5..6.3));
        let along = Along::fastest(curve, &[STAGE; 2], feed).expect("it is possible");
        if along.ticks() > 100_000.0 {
            continue;
        }
        let places = walked(&along);
        assert_within(&places, &[STAGE; 2]);
        let fastest = places.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]));
        assert!(fastest.fold(0.0, f64::max) <= feed * (1.0 + 1e-6) + 2.0, "{feed} {curve:?}");
        assert!((places[places.len() - 1][0] - ends[1][0]).abs() < 1.0, "{curve:?}");
        kept += 1;
    }
    assert!(kept > 150, "{kept}");
}

/// An arc just as long as full speed takes to be reached and left, and by a few roundings more or less.
#[test]
fn a_cruise_of_no_ticks_changes_nothing() {
    let radius = 5e9;
    let arc = |sweep: f64| {
        let ends = [0.0, sweep].map(|angle: f64| [radius * angle.cos(), radius * angle.sin()]);
        Curve::Arc(Arc::new(ends[0], ends[1], [0.0; 2], true).expect("an arc"))
    };
    let Limits { speed, acceleration, jerk } = arc(1.0).limits(&[STAGE; 2], 2e6);
    let changes = 2.0
        * if speed * jerk < acceleration * acceleration {
            2.0 * (speed / jerk).sqrt()
        } else {
            speed / acceleration + acceleration / jerk
        };
    for k in -40..40 {
        let along = Along::fastest(
            arc(speed * changes / 2.0 / radius * (1.0 + f64::from(k) * 1e-15)),
            &[STAGE; 2],
            2e6,
        );
        let along = along.expect("it is possible");
        let places = walked(&along);
        assert_within(&places, &[STAGE; 2]);
        assert!(places.iter().all(|place| off_circle([0.0; 2], radius, *place).abs() < 15.0));
    }
}

#[test]
fn what_is_no_curve_is_refused() {
    let (from, to) = ([0.0, 0.0], [1e9, 0.0]);
    assert!(Arc::new(from, to, [5e8, 0.0], true).is_some());
    assert_eq!(Arc::new(from, to, from, true), None);
    assert_eq!(Arc::new(from, to, [1e8, 0.0], true), None);
    // A tenth of the larger radius is the most, and what rounding to picometres adds.
    let ends = |radius: f64| Arc::new([1e7, 0.0], [0.0, radius], [0.0; 2], true);
    assert!(ends(9e6).is_some() && ends(9e6 - 2.0).is_some());
    assert_eq!([ends(9e6 - 10.0), ends(1.12e7)], [None, None]);
    assert!(Arc::new([1.0, 0.0], [1.0, 1.0], [0.0; 2], true).is_some());
    assert_eq!(Arc::new([1.0, 0.0], [0.0; 2], [0.0; 2], true), None);
    assert!(Sine::new(from, to, 1e6, 1, 0.0).is_some());
    let sines = [(to, 0.0, 1), (to, -1e6, 1), (to, 1e6, 0), (from, 1e6, 1), (to, f64::NAN, 1)];
    for (to, amplitude, periods) in sines {
        assert_eq!(Sine::new(from, to, amplitude, periods, 0.0), None);
    }
    let line = Curve::Line { from, to };
    for feed in [0.0, -1.0, f64::NAN] {
        assert!(Along::fastest(line, &[STAGE; 2], feed).is_err());
    }
    let y = Limits { speed: f64::NAN, ..STAGE };
    assert!(Along::fastest(line, &[STAGE, y], 1e6).is_err());
    // Its ends fit, its crest does not.
    let [left, right] = [-1e10, 1e10].map(|x| [x, 549_756_000_000.0 - 1e10]);
    let crest = Curve::Arc(Arc::new(right, left, [0.0, 549_756_000_000.0 - 1e10], true).expect("an arc"));
    let along = Along::fastest(crest, &[STAGE; 2], 2e6).expect("it is possible");
    assert!(along.pieces().any(|piece| piece.is_none()));
}
