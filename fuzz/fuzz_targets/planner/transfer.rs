//! Motions along one axis, and of two together.

use super::bytes::Bytes;
use super::judge::{ROUNDED, assert_is_right};
use super::walk::assert_steps;
use abbe_core::plan::Limits;
use abbe_core::plan::transfer::{self, State, Transfer};

/// Limits, and two states within them.
#[derive(Clone, Copy, Debug)]
struct Case {
    from: State,
    to: State,
    limits: Limits,
}

impl Case {
    fn of(bytes: &mut Bytes) -> Self {
        let limits = bytes.limits(3.0);
        let (start, way) = (bytes.length(11.0), bytes.length(11.0));
        let from = bytes.state(&limits, start.round());
        let to = bytes.state(&limits, (start + way).round());
        Self { from, to, limits }
    }

    fn fastest(&self) -> Transfer {
        let planned = Transfer::fastest(self.from, self.to, &self.limits);
        planned.unwrap_or_else(|why| panic!("{why}: {self:?}"))
    }

    fn assert_right(&self, transfer: &Transfer) {
        assert_is_right(transfer, self.from, self.to, &self.limits);
        assert_steps(transfer, &self.limits);
    }
}

pub(crate) fn fastest(bytes: &mut Bytes) {
    let case = Case::of(bytes);
    let transfer = case.fastest();
    case.assert_right(&transfer);
    assert_runs_backwards(&case, &transfer);
}

/// The same way back, mirrored in time, takes as long.
fn assert_runs_backwards(case: &Case, transfer: &Transfer) {
    let reversed = |state: State| State { speed: -state.speed, ..state };
    let back = Case { from: reversed(case.to), to: reversed(case.from), ..*case };
    let (forth, back) = (transfer.ticks(), back.fastest().ticks());
    // An acceleration over at once is a time as short as the root of what was rounded.
    assert!((forth - back).abs() <= 1e-6 * forth.max(back), "{forth} {back} {case:?}");
}

pub(crate) fn stop(bytes: &mut Bytes) {
    let case = Case::of(bytes);
    let stop = Transfer::stop(case.from, &case.limits).unwrap_or_else(|why| panic!("{why}: {case:?}"));
    let stopped = Case { to: stop.end(), ..case };
    assert_eq!((stop.end().speed, stop.end().acceleration), (0.0, 0.0));
    stopped.assert_right(&stop);
    // Nothing is at rest sooner.
    let there = Case { to: State { position: case.to.position, ..State::default() }, ..case };
    assert!(stop.ticks() <= there.fastest().ticks() * (1.0 + 1e-6), "{case:?}");
}

pub(crate) fn lasting(bytes: &mut Bytes) {
    let case = Case::of(bytes);
    let fastest = case.fastest();
    let wanted = fastest.ticks() * bytes.decades(0.0, 4.0);
    let lasting =
        fastest.lasting(&case.limits, wanted).unwrap_or_else(|why| panic!("{why}: {wanted} {case:?}"));
    case.assert_right(&lasting);
    assert!(lasting.ticks() >= wanted * (1.0 - ROUNDED), "{} {wanted} {case:?}", lasting.ticks());
    let ends_at_rest = case.to.speed == 0.0 && case.to.acceleration == 0.0;
    if ends_at_rest {
        assert!(lasting.ticks() <= wanted * (1.0 + ROUNDED), "{} {wanted} {case:?}", lasting.ticks());
    }
}

pub(crate) fn together(bytes: &mut Bytes) {
    let cases = [(); 2].map(|()| Case::of(bytes));
    let (from, to) = (cases.map(|case| case.from), cases.map(|case| case.to));
    let motions = transfer::together(&from, &to, &cases.map(|case| case.limits));
    let motions = motions.unwrap_or_else(|why| panic!("{why:?}: {cases:?}"));
    for (motion, case) in motions.iter().zip(&cases) {
        case.assert_right(motion);
    }
    let [one, two] = motions.map(|motion| motion.ticks());
    assert!((one - two).abs() <= ROUNDED * one.max(two), "{one} {two}: {cases:?}");
}
