//! Axes that set out and arrive together.

use super::{Infeasible, State, Transfer};
use crate::plan::Limits;

/// The motions of all axes, from one state each to another: each within its own limits, and as soon as the slowest lets
/// them arrive together.
///
/// The path between is what comes of it; from rest to rest along a line there is [`LinePlan`](crate::plan::LinePlan). An
/// axis that cannot take just as long as the slowest ([`Transfer::lasting`]) is there sooner if it comes to rest, and waits;
/// else it makes the others wait for it.
///
/// # Errors
/// As of [`Transfer::fastest`], with the axis that is the first to have one.
pub fn together<const N: usize>(
    from: &[State; N],
    to: &[State; N],
    limits: &[Limits; N],
) -> Result<[Transfer; N], (usize, Infeasible)> {
    let mut motions = [Transfer::default(); N];
    let mut longest = 0.0_f64;
    for (axis, motion) in motions.iter_mut().enumerate() {
        let (Some(from), Some(to), Some(limits)) = (from.get(axis), to.get(axis), limits.get(axis)) else {
            continue;
        };
        *motion = Transfer::fastest(*from, *to, limits).map_err(|why| (axis, why))?;
        longest = longest.max(motion.ticks());
    }
    // Every round that does not end brings one of them beyond times that it cannot meet.
    for _ in 0..ROUNDS.saturating_mul(N) {
        let before = longest;
        for (axis, (motion, limits)) in motions.iter_mut().zip(limits).enumerate() {
            if motion.ticks() < longest * EVEN {
                *motion = motion.lasting_or_sooner(limits, longest).map_err(|why| (axis, why))?;
            }
            longest = longest.max(motion.ticks());
        }
        if longest <= before * (2.0 - EVEN) {
            break;
        }
    }
    Ok(motions)
}

/// Most gaps in the times that an axis can meet, and one.
const ROUNDS: usize = 4;

/// As long as another but for rounding.
const EVEN: f64 = 1.0 - 1e-12;
