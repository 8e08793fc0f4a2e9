//! Any numbers at all: nothing panics, what is refused says why, and no plan holds what is no number.

use super::bytes::Bytes;
use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::{Arc, Curve, Sine};
use abbe_core::plan::pieces::Along;
use abbe_core::plan::program::Program;
use abbe_core::plan::segment::{Feed, Segment};
use abbe_core::plan::steps::{Steps, Stride};
use abbe_core::plan::transfer::{Infeasible, State, Transfer, together};

/// Most pieces of a curve that are looked at.
const PIECES: usize = 1000;

pub(crate) fn numbers(bytes: &mut Bytes) {
    match bytes.byte() % 4 {
        0 => transfers(bytes),
        1 => curves(bytes),
        2 => programs(bytes),
        _ => pairs(bytes),
    }
}

fn any<const N: usize>(bytes: &mut Bytes) -> [f64; N] {
    [(); N].map(|()| bytes.any())
}

fn state(bytes: &mut Bytes) -> State {
    let [position, speed, acceleration] = any(bytes);
    State { position, speed, acceleration }
}

fn limits(bytes: &mut Bytes) -> Limits {
    let [speed, acceleration, jerk] = any(bytes);
    Limits { speed, acceleration, jerk }
}

fn transfers(bytes: &mut Bytes) {
    let (limits, from, to) = (limits(bytes), state(bytes), state(bytes));
    let planned = Transfer::fastest(from, to, &limits);
    match planned {
        Ok(motion) => {
            assert_numbers(&motion, &limits);
            if let Ok(lasting) = motion.lasting(&limits, bytes.any()) {
                assert_numbers(&lasting, &limits);
            }
        }
        Err(why) => assert_reason(why, from, to, &limits),
    }
    match Transfer::stop(from, &limits) {
        Ok(stop) => assert_numbers(&stop, &limits),
        Err(why) => assert_reason(why, from, State::default(), &limits),
    }
}

fn pairs(bytes: &mut Bytes) {
    let limits = [(); 2].map(|()| limits(bytes));
    let [from, to] = [(); 2].map(|()| [(); 2].map(|()| state(bytes)));
    match together(&from, &to, &limits) {
        Ok(motions) => {
            motions.iter().zip(&limits).for_each(|(motion, limits)| assert_numbers(motion, limits));
        }
        Err((axis, why)) => assert_reason(why, from[axis], to[axis], &limits[axis]),
    }
}

/// Numbers, and what a tick makes of them.
fn assert_numbers(motion: &Transfer, limits: &Limits) {
    let case = || format!("{motion:?} {limits:?}");
    assert!(limits.are_numbers(), "{}", case());
    let good = motion.phases().iter().all(|phase| phase.ticks >= 0.0 && phase.jerk.is_finite());
    assert!(good && motion.ticks().is_finite(), "{}", case());
    let middle = motion.at(motion.ticks() / 2.0);
    assert!(middle.speed.is_finite() && middle.acceleration.is_finite(), "{}", case());
    if let Some(steps) = Steps::of(motion) {
        assert_eq!(f64::from(steps.ticks()), motion.ticks().ceil());
        let mut stride = Stride::default();
        (0..100.min(steps.ticks())).for_each(|_| stride.tick(&steps));
    }
}

/// A start or an end is beyond the limits; all else that is refused is no number, or far from what any stage does.
fn assert_reason(why: Infeasible, from: State, to: State, limits: &Limits) {
    let reversed = State { acceleration: -to.acceleration, ..to };
    match why {
        Infeasible::Start => assert!(is_beyond(from, limits), "{from:?} {limits:?}"),
        Infeasible::End => assert!(is_beyond(reversed, limits), "{to:?} {limits:?}"),
        Infeasible::NoNumber => {}
    }
}

/// Beyond a limit, or full jerk does not end its acceleration before the speed is.
fn is_beyond(state: State, limits: &Limits) -> bool {
    let State { speed, acceleration, .. } = state;
    let settled = speed + acceleration / limits.jerk * acceleration.abs() / 2.0;
    speed.abs() > limits.speed || acceleration.abs() > limits.acceleration || settled.abs() > limits.speed
}

fn curves(bytes: &mut Bytes) {
    let [from, to, centre] = [(); 3].map(|()| any(bytes));
    let [amplitude, phase] = any(bytes);
    let periods = u32::from(bytes.byte());
    let curves = [
        Some(Curve::Line { from, to }),
        Arc::new(from, to, centre, bytes.byte().is_multiple_of(2)).map(Curve::Arc),
        Sine::new(from, to, amplitude, periods, phase).map(Curve::Sine),
    ];
    let (axes, feed) = ([(); 2].map(|()| limits(bytes)), bytes.any());
    for curve in curves.into_iter().flatten() {
        if let Ok(along) = Along::fastest(curve, &axes, feed) {
            assert!(feed > 0.0 && axes.iter().all(Limits::are_numbers));
            assert!(along.ticks() >= 0.0 && along.ticks().is_finite(), "{along:?}");
            along.pieces().take(PIECES).for_each(drop);
        }
    }
}

fn programs(bytes: &mut Bytes) {
    let axes = [(); 2].map(|()| limits(bytes));
    let place = |bytes: &mut Bytes| [(); 2].map(|()| Pos::from_pm(bytes.any() as i64));
    let mut program = Program::new(place(bytes), axes, 1.0, 0);
    for _ in 0..bytes.byte() % 6 {
        let feed = Feed::from_pm(bytes.any());
        let tolerance = Pos::from_pm(bytes.any() as i64);
        _ = program.take(&Segment { to: place(bytes), feed, tolerance, ..Segment::default() });
    }
    for now in 0..20 {
        if now == 10 {
            _ = program.set_rate(bytes.any(), now + 5);
        }
        if program.span(now).is_err() {
            break;
        }
    }
}
