//! Motions from any state to any other: against numeric integration, against their limits, and against another planner.

#[path = "../examples/transfer_trials/cases.rs"]
mod cases;
#[path = "../examples/transfer_trials/other.rs"]
mod other;

use abbe_core::plan::Limits;
use abbe_core::plan::transfer::{Infeasible, State, Transfer, together};
use cases::{Case, Ends, STAGE};
use other::Other;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Integrates the jerk of the phases and nothing else: the acceleration is a line between the changes of the jerk, and
/// Simpson's rule is exact for what comes of it.
fn integrated(transfer: &Transfer, from: State) -> (State, [f64; 3]) {
    let (mut state, mut worst) = (from, [from.speed.abs(), from.acceleration.abs(), 0.0]);
    for phase in transfer.phases() {
        const STEPS: u32 = 16;
        let step = phase.ticks / f64::from(STEPS);
        for _ in 0..STEPS {
            let half = state.acceleration + phase.jerk * step / 2.0;
            let end = state.acceleration + phase.jerk * step;
            let speed_half = state.speed + step / 4.0 * (state.acceleration + half);
            let speed_end = state.speed + step / 6.0 * (state.acceleration + 4.0 * half + end);
            state.position += step / 6.0 * (state.speed + 4.0 * speed_half + speed_end);
            (state.speed, state.acceleration) = (speed_end, end);
            let seen = [state.speed, state.acceleration, phase.jerk];
            worst = std::array::from_fn(|k| f64::max(worst[k], seen[k].abs()));
        }
    }
    (state, worst)
}

/// The planner's own sums are rounded, too.
const ROUNDED: f64 = 1e-9;

fn planned(case: &Case) -> Transfer {
    let transfer = Transfer::fastest(case.from, case.to, &case.limits);
    transfer.unwrap_or_else(|why| panic!("{why}: {case:?}"))
}

/// It ends where it should, and is never beyond a limit.
fn assert_is_right(transfer: &Transfer, &Case { from, to, limits }: &Case) {
    let case = || format!("{from:?} {to:?} {limits:?} {transfer:?}");
    assert!(transfer.phases().iter().all(|phase| phase.ticks >= 0.0), "{}", case());
    let (end, [speed, acceleration, jerk]) = integrated(transfer, from);
    let way = (to.position - from.position).abs() + limits.speed * transfer.ticks();
    let settling = limits.speed.max(limits.acceleration * limits.acceleration / limits.jerk);
    assert!((end.position - to.position).abs() <= ROUNDED * way, "{end:?} {}", case());
    assert!((end.speed - to.speed).abs() <= ROUNDED * settling, "{end:?} {}", case());
    assert!(
        (end.acceleration - to.acceleration).abs() <= ROUNDED * limits.acceleration,
        "{end:?} {}",
        case()
    );
    assert!(speed <= limits.speed * (1.0 + ROUNDED), "{speed} {}", case());
    assert!(acceleration <= limits.acceleration * (1.0 + ROUNDED), "{acceleration} {}", case());
    assert!(jerk <= limits.jerk * (1.0 + ROUNDED), "{jerk} {}", case());
}

#[test]
fn no_plan_fails_in_any_unit_and_each_ends_where_it_should_within_the_limits() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    // Picometres, nanometres, micrometres, millimetres, metres.
    for unit in [1.0, 1e-3, 1e-6, 1e-9, 1e-12] {
        for _ in 0..100_000 {
            let case = Case::random(&mut random, unit, Ends::Any);
            assert_is_right(&planned(&case), &case);
        }
    }
}

#[test]
fn takes_as_long_as_another_planner_s_motion() {
    for ends in [Ends::AtRest, Ends::FromMotion, Ends::Any] {
        takes_as_long(ends);
    }
}

fn takes_as_long(ends: Ends) {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let mut other = Other::<1>::new();
    let (mut compared, mut worst) = (0, [1.0_f64; 2]);
    for _ in 0..100_000 {
        // Metres and seconds, with which the other one does not fail.
        let case = Case::random(&mut random, 1.0, ends).in_units(1e-12, 1e-4);
        let seconds = planned(&case).ticks();
        other.set(&[case]);
        let Some(theirs) = other.plan() else { continue };
        compared += 1;
        worst = [worst[0].min(seconds / theirs), worst[1].max(seconds / theirs)];
    }
    let as_long = worst[0] > 1.0 - 1e-6 && worst[1] < 1.0 + 1e-6;
    assert!(compared > 95_000 && as_long, "{}: {compared} {worst:?}", ends.name());
}

#[test]
fn what_cannot_be_done_is_said() {
    let rest = State::default();
    let too_fast = State { speed: 2.1e6, ..rest };
    let overshooting = State { speed: 1.9e6, acceleration: 4000.0, ..rest };
    let plan = |from, to| Transfer::fastest(from, to, &STAGE).map(|_| ());
    assert_eq!(plan(too_fast, rest), Err(Infeasible::Start));
    assert_eq!(plan(overshooting, rest), Err(Infeasible::Start));
    assert_eq!(plan(rest, too_fast), Err(Infeasible::End));
    // It may be left, but not come to.
    assert_eq!(plan(rest, State { acceleration: -4000.0, ..overshooting }), Err(Infeasible::End));
    assert_eq!(plan(State { acceleration: -4000.0, ..overshooting }, rest), Ok(()));
    assert_eq!(plan(State { position: f64::NAN, ..rest }, rest), Err(Infeasible::NoNumber));
    let [far, farther] = [-f64::MAX, f64::MAX].map(|position| State { position, ..rest });
    assert_eq!(plan(far, farther), Err(Infeasible::NoNumber));
    // It would take longer than numbers tell.
    let crawl = Limits { speed: 1e-155, acceleration: 1e-3, jerk: 1e4 };
    let far = State { position: 1e156, ..rest };
    assert_eq!(Transfer::fastest(rest, far, &crawl), Err(Infeasible::NoNumber));
    let moving = State { speed: 1e-156, ..far };
    assert_eq!(Transfer::fastest(rest, moving, &crawl), Err(Infeasible::NoNumber));
    // Products of such limits are zero.
    let least = Limits { speed: 4.6823e-320, acceleration: 1.8e-284, jerk: 1.8e-284 };
    assert_eq!(
        Transfer::fastest(State { position: 7e-309, ..rest }, rest, &least),
        Err(Infeasible::NoNumber)
    );
    for limits in [
        Limits { jerk: 0.0, ..STAGE },
        Limits { speed: f64::INFINITY, ..STAGE },
        Limits { acceleration: -1.0, ..STAGE },
    ] {
        assert_eq!(Transfer::fastest(rest, rest, &limits), Err(Infeasible::NoNumber));
    }
}

#[test]
fn states_on_the_edge_of_the_limits_have_plans() {
    let full = [-STAGE.speed, 0.0, STAGE.speed];
    let rising = [-STAGE.acceleration, 0.0, STAGE.acceleration];
    let mut ways = vec![0.0];
    ways.extend((0..14).flat_map(|k| [10_f64.powi(k - 2), -10_f64.powi(k - 2)]));
    let mut states = Vec::new();
    for speed in full {
        for acceleration in rising {
            // Where full acceleration just ends at full speed.
            let settles = speed - acceleration * acceleration.abs() / 2.0 / STAGE.jerk;
            states.push(State {
                position: 0.0,
                speed: if acceleration * speed > 0.0 { settles } else { speed },
                acceleration,
            });
        }
    }
    let mut number = 0;
    for from in &states {
        for to in &states {
            for way in &ways {
                let to = State { position: *way, ..*to };
                match Transfer::fastest(*from, to, &STAGE) {
                    Ok(transfer) => {
                        assert_is_right(&transfer, &Case { from: *from, to, limits: STAGE });
                        number += 1;
                    }
                    Err(why) => assert_eq!(why, Infeasible::End, "{from:?} {to:?}"),
                }
            }
        }
    }
    assert!(number > 1000, "{number}");
}

#[test]
fn a_motion_can_be_made_to_last() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut other = Other::<1>::new();
    let (mut longer, mut compared) = (0, 0);
    for _ in 0..100_000 {
        // Metres and seconds, with which the other planner does not fail.
        let case = Case::random(&mut random, 1.0, Ends::Any).in_units(1e-12, 1e-4);
        let fastest = planned(&case);
        let wanted = fastest.ticks() * random.random_range(1.0..1.5);
        let lasting = fastest.lasting(&case.limits, wanted).expect("it is possible");
        assert_is_right(&lasting, &case);
        let ticks = lasting.ticks();
        assert!(ticks >= wanted * (1.0 - ROUNDED), "{ticks} {wanted}");
        if ticks <= wanted * (1.0 + ROUNDED) {
            continue;
        }
        longer += 1;
        other.set(&[case]);
        other.last(wanted);
        let Some(theirs) = other.plan() else { continue };
        compared += 1;
        assert!((ticks / theirs - 1.0).abs() < 1e-6, "{ticks} {theirs} {wanted} {case:?}");
    }
    assert!(longer > 100 && compared * 10 > longer * 9, "{longer} {compared}");
}

/// Whatever moves within the limits tells a time that can be met.
#[test]
fn every_time_that_some_motion_takes_is_met() {
    let mut random = Pcg64Mcg::seed_from_u64(6);
    let mut met = 0;
    while met < 100_000 {
        // From zero on: some of the motions are so short that places far from it would be rounded by more.
        let mut start = Case::random(&mut random, 1.0, Ends::FromMotion);
        start.from.position = 0.0;
        let (to, ticks) = wandered(&mut random, &start);
        let case = Case { to, ..start };
        if ticks == 0.0 {
            assert_eq!(planned(&case).ticks(), 0.0, "{case:?}");
            continue;
        }
        let Ok(fastest) = Transfer::fastest(case.from, case.to, &case.limits) else { continue };
        assert!(fastest.ticks() <= ticks * (1.0 + ROUNDED), "{} {ticks} {case:?}", fastest.ticks());
        let lasting = fastest.lasting(&case.limits, ticks).expect("it is possible");
        assert_is_right(&lasting, &case);
        assert!((lasting.ticks() / ticks - 1.0).abs() <= 1e-6, "{} {ticks} {case:?}", lasting.ticks());
        met += 1;
    }
}

/// Where a few phases of any jerk lead, as far as they stay within the limits, and how long they take.
fn wandered(random: &mut Pcg64Mcg, Case { from, limits, .. }: &Case) -> (State, f64) {
    let (mut state, mut ticks) = (*from, 0.0);
    let unit = (limits.acceleration / limits.jerk).min((limits.speed / limits.jerk).sqrt());
    for _ in 0..random.random_range(2..8) {
        let (time, jerk) =
            (unit * random.random_range(0.0..1.0), limits.jerk * random.random_range(-1.0..=1.0));
        let after = state.after(time, jerk);
        let turn = (-state.acceleration / jerk).clamp(0.0, time);
        let speeds = [state.after(turn, jerk).speed, after.speed];
        let is_within = after.acceleration.abs() <= limits.acceleration
            && speeds.iter().all(|speed| speed.abs() <= limits.speed);
        if is_within {
            (state, ticks) = (after, ticks + time);
        }
    }
    (state, ticks)
}

/// A picometre in a quarter of an hour: what three phases leave of an acceleration must not move it on.
#[test]
fn a_short_way_can_last_for_long() {
    let limits = Limits { speed: 2000.0, acceleration: 3.8e6, jerk: 19_516.0 };
    let from = State { position: -1.0, speed: -0.061, acceleration: -4968.2 };
    let to = State { position: -2.0, speed: -1154.3, acceleration: -4485.7 };
    let fastest = Transfer::fastest(from, to, &limits).expect("it is possible");
    for wanted in [1e6, 1e7, 1e8] {
        let lasting = fastest.lasting(&limits, wanted).expect("it is possible");
        assert!((lasting.ticks() - wanted).abs() <= ROUNDED * wanted, "{}", lasting.ticks());
        let before = lasting.at(wanted - 1.0);
        assert!((before.position - to.position).abs() < 1e3, "{before:?}");
    }
}

/// One axis has no way to go, a short one, or a long one, and takes as long as it is told.
#[test]
fn an_axis_without_a_way_waits_where_it_is() {
    let at = |position: f64| State { position, ..State::default() };
    for way in [0.0, 1.0, 1e3, 1e8, -1e10] {
        let fastest = Transfer::fastest(at(5e9), at(5e9 + way), &STAGE).expect("it is possible");
        for ticks in [0.0, 1.0, 100.0, 542.9, 650.0, 5000.0, 1e7] {
            let lasting = fastest.lasting(&STAGE, ticks).expect("it is possible");
            assert_is_right(&lasting, &Case { from: at(5e9), to: at(5e9 + way), limits: STAGE });
            let wanted = ticks.max(fastest.ticks());
            assert!(
                (lasting.ticks() - wanted).abs() <= ROUNDED * wanted,
                "{way} {ticks}: {}",
                lasting.ticks()
            );
        }
    }
    let [x, y] = together(&[at(0.0); 2], &[at(1e8), at(0.0)], &[STAGE; 2]).expect("it is possible");
    assert!((x.ticks() - y.ticks()).abs() < ROUNDED * x.ticks());
    assert!((0..600).all(|tick| y.at(f64::from(tick)) == at(0.0)), "{y:?}");
}

/// Found by fuzzing: squares of a speed of a thousand million times what full acceleration takes to reach are rounded by more
/// than this way.
#[test]
fn a_short_way_at_a_high_speed_has_a_plan() {
    let limits =
        Limits { speed: 1670837914.1976976, acceleration: 7.69806034624516, jerk: 82.84039716152796 };
    let from = State { position: -517838289.0, speed: -1323636908.3756168, acceleration: -6.098399318455515 };
    let case = Case { from, to: State { position: -1035676577.0, ..from }, limits };
    assert_is_right(&planned(&case), &case);
}

/// To rest at once: nothing that goes on to a place is at rest sooner.
#[test]
fn a_stop_is_over_before_any_other_way_to_rest() {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    for _ in 0..100_000 {
        let case = Case::random(&mut random, 1.0, Ends::FromMotion);
        let stop = Transfer::stop(case.from, &case.limits).expect("it is possible");
        assert_is_right(&stop, &Case { to: stop.end(), ..case });
        assert!(stop.ticks() <= planned(&case).ticks() * (1.0 + ROUNDED), "{case:?}");
        let again = Case { to: stop.end(), ..case };
        assert!(stop.ticks() >= planned(&again).ticks() * (1.0 - ROUNDED), "{case:?}");
    }
    let too_fast = State { speed: 2.1e6, ..State::default() };
    assert_eq!(Transfer::stop(too_fast, &STAGE), Err(Infeasible::Start));
}

#[test]
fn two_axes_arrive_together() {
    assert_eq!(late(Ends::AtRest), 0);
    assert_eq!(late(Ends::FromMotion), 0);
    // From speed to speed the slower axis may have to wait for the faster.
    let late = late(Ends::Any);
    assert!(late < 150, "{late}");
}

#[test]
fn two_axes_from_speed_to_speed_are_there_as_soon_as_with_another_planner() {
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let mut other = Other::<2>::new();
    let (mut compared, mut worst) = (0, [1.0_f64; 2]);
    for _ in 0..100_000 {
        let cases = [(); 2].map(|()| Case::random(&mut random, 1.0, Ends::Any).in_units(1e-12, 1e-4));
        let (from, to) = (cases.map(|case| case.from), cases.map(|case| case.to));
        let [one, two] = together(&from, &to, &cases.map(|case| case.limits)).expect("it is possible");
        let seconds = one.ticks().max(two.ticks());
        other.set(&cases);
        let Some(theirs) = other.plan() else { continue };
        compared += 1;
        worst = [worst[0].min(seconds / theirs), worst[1].max(seconds / theirs)];
    }
    let as_soon = worst[0] > 1.0 - 1e-6 && worst[1] < 1.0 + 1e-6;
    assert!(compared > 95_000 && as_soon, "{compared} {worst:?}");
}

/// In how many of 50 000 cases two axes take longer than the slower one needs.
fn late(ends: Ends) -> usize {
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let is_late = |_: &usize| {
        let cases = [(); 2].map(|()| Case::random(&mut random, 1.0, ends));
        let (from, to) = (cases.map(|case| case.from), cases.map(|case| case.to));
        let motions = together(&from, &to, &cases.map(|case| case.limits)).expect("it is possible");
        for (motion, case) in motions.iter().zip(&cases) {
            assert_is_right(motion, case);
        }
        let [one, two] = motions.map(|motion| motion.ticks());
        assert!((one / two - 1.0).abs() < ROUNDED, "not together: {cases:?}");
        let slower = cases.map(|case| planned(&case).ticks()).into_iter().fold(0.0, f64::max);
        one > slower * (1.0 + ROUNDED)
    };
    (0..50_000).filter(is_late).count()
}

/// The extent of a motion is that of its places, densely looked at.
#[test]
fn the_extent_of_a_motion_is_that_of_its_places() {
    let mut random = Pcg64Mcg::seed_from_u64(11);
    let limits = Limits { speed: 2e6, acceleration: 5000.0, jerk: 20.0 };
    for _ in 0..20_000 {
        let speed = random.random_range(-1.9e6..1.9e6);
        let from = State { position: random.random_range(-1e9..1e9), speed, acceleration: 0.0 };
        let to = State { position: random.random_range(-1e9..1e9), ..State::default() };
        let motion = Transfer::fastest(from, to, &limits).unwrap();
        let [low, high] = motion.extent();
        let mut seen = [f64::INFINITY, f64::NEG_INFINITY];
        for part in 0..=400 {
            let place = motion.at(motion.ticks() * f64::from(part) / 400.0).position;
            seen = [seen[0].min(place), seen[1].max(place)];
        }
        let rounded = 1e-3 + 1e-6 * (high - low);
        assert!(low <= seen[0] + rounded && high >= seen[1] - rounded, "{low} {high} {seen:?}");
        let part = motion.ticks() / 400.0;
        assert!(
            seen[0] - low <= 5000.0 * part * part && high - seen[1] <= 5000.0 * part * part,
            "{low} {high} {seen:?}"
        );
    }
}
