//! Motions tick by tick: beside the exact motion, and within their limits by the differences of their set-points alone.

use abbe_core::plan::Limits;
use abbe_core::plan::curve::Place;
use abbe_core::plan::pieces::Piece;
use abbe_core::plan::steps::{Leg, Steps, Stride, Walker};
use abbe_core::plan::transfer::{State, Transfer};

/// Longer motions are judged by their closed form alone.
pub(crate) const LONGEST: f64 = 8000.0;

/// What fits a tick's integers: place, speed, acceleration and jerk, 2⁶³ without their fractional bits.
const FITS: [f64; 4] = [549_755_813_888.0, 33_554_432.0, 131_072.0, 8192.0];

/// A motion along one axis.
pub(crate) fn assert_steps(transfer: &Transfer, limits: &Limits) {
    let Some(steps) = Steps::of(transfer) else {
        assert!(does_not_fit(transfer), "it fits: {transfer:?}");
        return;
    };
    assert_eq!(f64::from(steps.ticks()), transfer.ticks().ceil());
    if transfer.ticks() > LONGEST {
        return;
    }
    let (mut stride, mut positions) = (Stride::default(), Vec::new());
    for tick in 0..steps.ticks() {
        stride.tick(&steps);
        assert!(!stride.is_at_end(), "{transfer:?}");
        assert_exact(&stride, &transfer.at(f64::from(tick)), || format!("{tick}: {transfer:?}"));
        positions.push(stride.position().pm() as f64);
    }
    stride.tick(&steps);
    assert!(stride.is_at_end(), "{transfer:?}");
    if transfer.end().speed == 0.0 {
        assert_eq!(stride.position().pm() as f64, transfer.end().position.round(), "{transfer:?}");
    }
    // Whoever ends with a speed or an acceleration goes on with another motion.
    if transfer.end() == (State { position: transfer.end().position, ..State::default() }) {
        positions.extend([stride.position().pm() as f64; 4]);
    }
    assert_differences(positions, limits, 1e-9, 1.0, || format!("{transfer:?}"));
}

/// Within a picometre, as core's `tests/steps.rs` asks.
fn assert_exact(stride: &Stride, exact: &State, case: impl Fn() -> String) {
    let set_point = stride.set_point();
    let off = [
        set_point.position.pm() as f64 - exact.position,
        set_point.speed as f64 / 2_f64.powi(38) - exact.speed,
        set_point.acceleration as f64 / 2_f64.powi(46) - exact.acceleration,
    ];
    assert!(off[0].abs() < 1.0 && off[1].abs() < 1e-3 && off[2].abs() < 1e-6, "{off:?} {}", case());
}

/// No difference of positions, first, second and third, is beyond its limit by more than a part of it and what their
/// rounding makes of it: 2ᵏ roundings.
fn assert_differences(
    mut values: Vec<f64>,
    limits: &Limits,
    part: f64,
    rounding: f64,
    case: impl Fn() -> String,
) {
    for (k, limit) in (1..).zip([limits.speed, limits.acceleration, limits.jerk]) {
        values = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let worst = values.iter().fold(0.0, |worst: f64, value| worst.max(value.abs()));
        let most = limit * (1.0 + part) + rounding * f64::from(1 << k);
        assert!(worst <= most, "difference {k}: {worst} of {limit} {}", case());
    }
}

/// Too long, or somewhere beyond what fits; with a little below it.
fn does_not_fit(transfer: &Transfer) -> bool {
    let mut state = transfer.start();
    let mut is_beyond = transfer.ticks() > 134_217_000.0;
    for phase in transfer.phases() {
        for part in 0..=64 {
            let State { position, speed, acceleration } =
                state.after(phase.ticks * f64::from(part) / 64.0, phase.jerk);
            // A difference is what the next tick brings.
            let numbers = [
                position,
                speed.abs() + acceleration.abs() + phase.jerk.abs(),
                acceleration.abs() + phase.jerk.abs(),
                phase.jerk,
            ];
            is_beyond |= numbers.iter().zip(FITS).any(|(number, most)| number.abs() > 0.99 * most);
        }
        state = state.after(phase.ticks, phase.jerk);
    }
    is_beyond
}

/// Pieces follow each other, and the last of a whole motion is the end.
pub(crate) fn assert_in_order(pieces: &[Piece]) {
    assert!(pieces.windows(2).all(|pair| pair[0][0].first <= pair[1][0].first));
    assert!(pieces.iter().all(|[x, y]| x.first == y.first));
}

/// At the end it is at rest.
pub(crate) fn assert_ends(pieces: &[Piece], ticks: f64) {
    let last = pieces.last().expect("there is an end");
    assert_eq!(f64::from(last[0].first), ticks.ceil());
    assert!(is_end(last), "it is at rest");
}

/// The set-points of all ticks to the last of some pieces, [`LONGEST`] at most, and if it is the end of a few beyond.
pub(crate) fn walked(pieces: &[Piece]) -> Vec<Place> {
    let (mut walkers, mut next) = ([Walker::default(); 2], 0);
    let last = pieces.last().map_or(0, |piece| piece[0].first);
    let beyond = if pieces.last().is_some_and(is_end) { 5 } else { 0 };
    let places = (0..=last.saturating_add(beyond).min(LONGEST as u32)).map(|tick| {
        walkers.iter_mut().for_each(Walker::step);
        while let Some(piece) = pieces.get(next).filter(|piece| piece[0].first <= tick) {
            walkers.iter_mut().zip(piece).for_each(|(walker, leg)| walker.begin(leg));
            next += 1;
        }
        walkers.map(|walker| walker.position().pm() as f64)
    });
    places.collect()
}

/// Whether nothing moves in it.
fn is_end(piece: &Piece) -> bool {
    piece.iter().all(|Leg { differences: [_, rest @ ..], .. }| *rest == [0; 3])
}

/// No axis is beyond a limit, as core's `tests/walked` asks.
pub(crate) fn assert_within(places: &[Place], axes: &[Limits; 2], case: impl Fn() -> String) {
    for (axis, limits) in axes.iter().enumerate() {
        let positions = places.iter().map(|place| place[axis]).collect();
        assert_differences(positions, limits, 1e-6, 2.0, || format!("axis {axis}: {}", case()));
    }
}
