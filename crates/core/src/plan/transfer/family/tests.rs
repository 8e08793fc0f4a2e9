//! What is in closed form, beside what it stands for.

use super::super::motion::{Motion, way_of_all};
use super::super::task::Task;
use super::{Family, Member};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Both ends move, and full speed is a third of a decade to two decades around where full acceleration is reached.
fn random_task(random: &mut Pcg64Mcg) -> Task {
    let top = 10_f64.powf(random.random_range(-2.0..2.0));
    let mut motion = || {
        let v: f64 = random.random_range(-top..top);
        let most = (2.0 * (top - v.abs())).sqrt().min(1.0);
        Motion { v, a: random.random_range(-most..=most) }
    };
    Task { start: motion(), end: motion(), way: 0.0, blur: 0.0, top }
}

fn ends(family: &Family) -> [f64; 2] {
    if family.above { [family.most(), 0.0] } else { [family.least(), family.most()] }
}

#[test]
fn between_two_turns_the_ways_only_grow_or_only_shrink() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut turns_seen = [0; 3];
    for _ in 0..20_000 {
        let task = random_task(&mut random);
        for family in Family::of(&task).all() {
            let [first, last] = ends(&family);
            let turns = family.turns();
            turns_seen[turns.iter().flatten().count()] += 1;
            let way = |y: f64| family.beyond(0.0, y).f;
            let mut from = first;
            for to in turns.into_iter().flatten().chain([last]) {
                let ways: Vec<f64> =
                    (0..=64).map(|part| way(from + (to - from) * f64::from(part) / 64.0)).collect();
                let rounded = 1e-13 * ways.iter().fold(1e-6, |most: f64, way| most.max(way.abs()));
                let grows = ways[64] > ways[0];
                for two in ways.windows(2) {
                    let change = if grows { two[1] - two[0] } else { two[0] - two[1] };
                    assert!(change >= -rounded, "{change} {from} {to} {turns:?} {task:?}");
                }
                from = to;
            }
        }
    }
    assert!(turns_seen.iter().all(|seen| *seen > 100), "{turns_seen:?}");
}

#[test]
fn way_time_and_slope_are_those_of_the_phases() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    for _ in 0..20_000 {
        let task = random_task(&mut random);
        for family in Family::of(&task).all() {
            let [first, last] = ends(&family);
            let y = first + (last - first) * random.random_range(0.01..0.99);
            let member: Member = family.member(y, 0.0);
            let phases = family.phases(&member);
            let seconds: f64 = phases.iter().map(|(time, _)| time).sum();
            let scale = 1e-3 + task.top * seconds;
            assert!((member.time - seconds).abs() < 1e-12 * (1.0 + seconds), "{task:?}");
            let beyond = family.beyond(0.0, y);
            assert!((beyond.f - way_of_all(task.start, &phases)).abs() < 1e-12 * scale, "{task:?}");
            let step = 1e-6 * (last - first).abs();
            let [less, more] = [y - step, y + step].map(|y| family.beyond(0.0, y).f);
            let slope = (more - less) / (2.0 * step);
            // The steps of the quotient are rounded, and the slope bends where a peak is cut off.
            assert!(
                (slope - beyond.slope).abs() < 1e-4 * (slope.abs() + scale / (last - first).abs()),
                "{slope} {} {family:?} {y}",
                beyond.slope
            );
        }
    }
}
