//! What a planned motion must be, by the sums of its phases.

use abbe_core::plan::Limits;
use abbe_core::plan::transfer::{State, Transfer};

/// The planner's own sums are rounded: as in core's `tests/transfer.rs`.
pub(crate) const ROUNDED: f64 = 1e-9;

/// The phase of constant speed; what others leave of an acceleration is rounded.
const CRUISE: usize = 3;

/// Integrates the jerk of the phases; highest speed, acceleration and jerk on the way. The speed is
/// highest at an end of a phase, or where the acceleration goes through zero.
fn integrated(transfer: &Transfer, from: State, limits: &Limits) -> (State, [f64; 3]) {
    let (mut state, mut worst) = (from, [from.speed.abs(), from.acceleration.abs(), 0.0]);
    for (number, phase) in transfer.phases().iter().enumerate() {
        if number == CRUISE && phase.ticks > 0.0 {
            assert!(state.acceleration.abs() <= ROUNDED * limits.acceleration, "{transfer:?}");
            state.acceleration = 0.0;
        }
        let turn = -state.acceleration / phase.jerk;
        let end = state.after(phase.ticks, phase.jerk);
        let between = if (0.0..phase.ticks).contains(&turn) { state.after(turn, phase.jerk) } else { end };
        for seen in [between, end] {
            let seen = [seen.speed, seen.acceleration, phase.jerk];
            worst = std::array::from_fn(|k| f64::max(worst[k], seen[k].abs()));
        }
        state = end;
    }
    (state, worst)
}

/// It ends where it should, is never beyond a limit, and is made of numbers.
pub(crate) fn assert_is_right(transfer: &Transfer, from: State, to: State, limits: &Limits) {
    let case = || format!("{from:?} {to:?} {limits:?} {transfer:?}");
    let phases = transfer.phases();
    assert!(phases.iter().all(|phase| phase.ticks >= 0.0 && phase.jerk.is_finite()), "{}", case());
    assert!(transfer.ticks().is_finite() && transfer.start() == from && transfer.end() == to, "{}", case());
    let (end, [speed, acceleration, jerk]) = integrated(transfer, from, limits);
    let way = (to.position - from.position).abs() + limits.speed * transfer.ticks();
    // What the places themselves are rounded by.
    let place = 4.0 * f64::EPSILON * from.position.abs().max(to.position.abs());
    let settling = limits.speed.max(limits.acceleration * limits.acceleration / limits.jerk);
    assert!((end.position - to.position).abs() <= ROUNDED * way + place, "{end:?} {}", case());
    assert!((end.speed - to.speed).abs() <= ROUNDED * settling, "{end:?} {}", case());
    assert!(
        (end.acceleration - to.acceleration).abs() <= ROUNDED * limits.acceleration,
        "{end:?} {}",
        case()
    );
    assert!(speed <= limits.speed * (1.0 + ROUNDED), "speed {speed} {}", case());
    assert!(acceleration <= limits.acceleration * (1.0 + ROUNDED), "acceleration {acceleration} {}", case());
    assert!(jerk <= limits.jerk * (1.0 + ROUNDED), "jerk {jerk} {}", case());
}
