//! The emitter program repeats the pulses of [`abbe_core::front::StepEmitter`] to the clock, on two axes at once.

use abbe_core::edge::StepRate;
use abbe_core::front::emitter::fastest;
use abbe_cosim::emitter::Emitters;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Ticks of the longest run; `ABBE_TICKS` asks for more.
fn ticks(usual: u64) -> u64 {
    std::env::var("ABBE_TICKS").ok().and_then(|ticks| ticks.parse().ok()).unwrap_or(usual)
}

/// A rate of any size and direction: whole range, slow, none, the fastest.
fn any_rate(random: &mut Pcg64Mcg, fastest: i32) -> StepRate {
    let range = [fastest, fastest / 4, fastest / 100, 1, fastest][random.random_range(0..5)];
    let rate = random.random_range(-range..=range);
    StepRate(if random.random_bool(0.1) { fastest * rate.signum() } else { rate })
}

/// Runs ticks whose words come at any time before the ones before are used up.
fn run(clocks: u32, seed: u64, ticks: u64, rate: impl Fn(&mut Pcg64Mcg) -> StepRate) -> Emitters {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut emitters = Emitters::new(clocks);
    for tick in 0..ticks {
        emitters.begin_tick([rate(&mut random), rate(&mut random)]);
        // The next tick's words come somewhere in this one.
        let late = random.random_range(1..clocks - 60);
        let until = tick * u64::from(clocks) + u64::from(late);
        go_on_until(&mut emitters, until);
    }
    emitters
}

fn go_on_until(emitters: &mut Emitters, clock: u64) {
    while emitters.clock() < clock {
        if let Err(wrong) = emitters.step() {
            panic!("{wrong:?} at clock {}", emitters.clock());
        }
    }
}

/// Runs dry, and looks whether all that was promised came.
fn finish(mut emitters: Emitters) {
    let end = emitters.promised_until() + 200;
    go_on_until(&mut emitters, end);
    assert_eq!(emitters.outstanding(), 0);
    for (seen, counted) in emitters.seen_and_counted() {
        assert_eq!(seen, counted);
    }
}

#[test]
fn every_pulse_of_random_rates_rises_at_its_clock_and_none_is_lost() {
    let clocks = 1250;
    finish(run(clocks, 1, ticks(100_000), |random| any_rate(random, fastest(clocks).0)));
}

#[test]
fn ticks_of_a_stage_are_repeated_as_well() {
    let clocks = 12_500;
    finish(run(clocks, 2, 2000, |random| any_rate(random, fastest(clocks).0)));
}

/// 1.95 MHz on both axes, reversing in every tick as often as not.
#[test]
fn both_axes_reach_the_fastest_rate_at_once() {
    let clocks = 12_500;
    let fastest = fastest(clocks).0;
    let emitters =
        run(clocks, 3, 500, |random| StepRate(if random.random_bool(0.5) { fastest } else { -fastest }));
    finish(emitters);
}

#[test]
fn an_emitter_that_runs_dry_waits_with_step_low_and_goes_on_cleanly() {
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let mut emitters = Emitters::new(1250);
    for _ in 0..2000 {
        emitters.begin_tick([any_rate(&mut random, fastest(1250).0), any_rate(&mut random, fastest(1250).0)]);
        // Dry at any place: a fall is due at 32 clocks, nothing else may happen.
        let end = emitters.promised_until() + random.random_range(50..300);
        go_on_until(&mut emitters, end);
        assert_eq!(emitters.outstanding(), 0);
        emitters.start_again();
    }
    finish(emitters);
}
