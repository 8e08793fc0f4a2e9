//! An analogue head from end to end: poor signals, a converter, comparators with hysteresis, motion, and what goes wrong.
//!
//! The signals are made here, in floats, from the model in `docs/theory.md`; the head sees codes and counts.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use abbe_core::edge::SinCos;
use abbe_core::sense::ellipse::Ellipse;
use abbe_core::sense::harmonics::{Harmonics, Sweep};
use abbe_core::sense::head::{Config, Head};
use abbe_core::sense::health::{Findings, Grade, Report, SignalFault};
use abbe_core::sense::periods::Periods;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// nm.
const PERIOD: f64 = 800.0;
const TICK: f64 = 1e-4;
const RADIUS: f64 = 22_000.0;

const CONFIG: Config = Config {
    period_pm: 800_000,
    ellipse: Ellipse::circle(RADIUS),
    harmonics: Harmonics([[0.0; 2]; 8]),
    rail: 32_500,
    counted: true,
    factor: 0,
    sample_limit: 0,
    count_limit: false,
    tracks: true,
};

/// A grating's signals: offsets +5 % and −3 %, gain 1.08, 4° from quadrature, 0.3 % noise, 14 bits.
struct Grating {
    random: Pcg64Mcg,
    amplitude: f64,
    third: f64,
    /// Added to the offset of the cosine.
    offset: f64,
    noise: f64,
    /// Counts of the comparators, each with a hysteresis of 3 % of the amplitude.
    a: bool,
    b: bool,
    count: i64,
    counting: bool,
}

impl Grating {
    fn new(seed: u64, nm: f64) -> Self {
        let mut grating = Self {
            random: Pcg64Mcg::seed_from_u64(seed),
            amplitude: 1.0,
            third: 0.0,
            offset: 0.0,
            noise: 0.003,
            a: false,
            b: false,
            count: 0,
            counting: true,
        };
        let [x, y] = grating.signals(nm);
        (grating.a, grating.b) = (x < 0.0, y < 0.0);
        grating
    }

    fn signals(&self, nm: f64) -> [f64; 2] {
        let angle = nm / PERIOD * TAU;
        let later = angle + 4_f64.to_radians();
        let x = angle.cos() + self.third * (3.0 * angle).cos();
        let y = later.sin() - self.third * (3.0 * later).sin();
        [self.amplitude * x + 0.05 + self.offset, self.amplitude * 1.08 * y - 0.03]
    }

    /// The head goes to a place; the comparators see all that lies between.
    fn go(&mut self, from: f64, to: f64) {
        let steps = ((to - from).abs() / 10.0).ceil().max(1.0) as u32;
        for step in 1..=steps {
            let [x, y] = self.signals(from + (to - from) * f64::from(step) / f64::from(steps));
            let before = (self.a, self.b);
            self.a = if self.a { x < 0.03 } else { x < -0.03 };
            self.b = if self.b { y < 0.03 } else { y < -0.03 };
            let place = |(a, b)| match (a, b) {
                (false, false) => 0_i64,
                (true, false) => 1,
                (true, true) => 2,
                (false, true) => 3,
            };
            let way = (place((self.a, self.b)) - place(before)).rem_euclid(4);
            if self.counting {
                self.count += [0, 1, 0, -1][way as usize];
            }
        }
    }

    fn sample(&mut self, nm: f64) -> SinCos {
        let [x, y] = self.signals(nm);
        let mut code = |value: f64| {
            let code = ((value
                + self.noise * Distribution::<f64>::sample(&StandardNormal, &mut self.random))
                * RADIUS
                / 4.0)
                .round()
                * 4.0;
            code.clamp(-32_768.0, 32_764.0) as i16
        };
        SinCos { cos: code(x), sin: code(y) }
    }
}

/// Smooth motion within a speed, from a standstill: nm, tick by tick.
fn motion(speed_mm_s: f64) -> impl Fn(u32) -> f64 {
    // Two incommensurate swings; the second keeps reversals from falling on the same places.
    move |tick| {
        // Time passes slower at first: no stage has its speed at once.
        let (ticks, slow) = (f64::from(tick), 1000.0);
        let t = TICK * if ticks < slow { ticks * ticks / slow / 2.0 } else { ticks - slow / 2.0 };
        let (slow, fast) = (3.1, 17.3);
        let size = speed_mm_s * 1e6 / TAU / 2.0;
        size / slow * (slow * t * TAU).sin() + size / fast * (fast * t * TAU).sin()
    }
}

struct Run {
    grating: Grating,
    head: Head,
    config: Config,
    zero: Option<f64>,
    at: f64,
}

impl Run {
    fn new(seed: u64, config: Config, nm: f64) -> Self {
        Self { grating: Grating::new(seed, nm), head: Head::new(&config), config, zero: None, at: nm }
    }

    fn report(&self) -> Report {
        self.head.report().unwrap()
    }

    /// Goes there and samples: what the head makes of it, off by so many nm from the first.
    fn step(&mut self, to: f64, sampled: bool) -> (f64, Option<SignalFault>) {
        self.grating.go(self.at, to);
        self.at = to;
        let sample = sampled.then(|| self.grating.sample(to));
        self.read(sample)
    }

    fn read(&mut self, sample: Option<SinCos>) -> (f64, Option<SignalFault>) {
        let read = self.head.read(sample, self.grating.count, &self.config);
        let off = Periods(read.position.0).pm(self.config.period_pm) as f64 / 1e3 - self.at;
        let zero = *self.zero.get_or_insert((off / PERIOD).round() * PERIOD);
        self.head.refine();
        (off - zero, read.fault)
    }
}

#[test]
fn poor_signals_become_a_position_within_a_nanometre_at_5_and_at_50_mm_s() {
    for (speed, seed) in [(0.05, 1), (5.0, 2), (50.0, 3)] {
        let mut run = Run::new(seed, CONFIG, 0.0);
        // A slow stretch first: the recursion learns only far below aliasing.
        for tick in 0..6000 {
            run.step(f64::from(tick) * 31.0, true);
        }
        let (began, path) = (run.at, motion(speed));
        let (mut worst, mut sum, ticks) = (0.0_f64, 0.0, 60_000);
        for tick in 0..ticks {
            let (off, fault) = run.step(began + path(tick), true);
            assert_eq!(fault, None, "{speed} mm/s, tick {tick}");
            worst = worst.max(off.abs());
            sum += off * off;
        }
        let rms = (sum / f64::from(ticks)).sqrt();
        println!("{speed} mm/s: {rms:.2} nm rms, worst {worst:.2} nm");
        // Noise of 0.3 % alone is 0.4 nm rms.
        assert!(rms < 0.6 && worst < 3.0, "{speed} mm/s: {rms} nm rms, worst {worst} nm");
        assert_eq!(run.report().grade(), Grade::Good, "{:?}", run.report());
    }
}

/// What is left inside a period, nm: the mean of each of 40 parts beside the mean of all, at its peak.
fn inside_a_period(run: &mut Run, ticks: u32) -> f64 {
    let mut parts = [[0.0; 2]; 40];
    for _ in 0..ticks {
        let (off, fault) = run.step(run.at + 31.7, true);
        assert_eq!(fault, None);
        let [number, sum] = &mut parts[((run.at / PERIOD).fract() * 40.0) as usize];
        *number += 1.0;
        *sum += off;
    }
    let means = parts.map(|[number, sum]| sum / number);
    let all = means.iter().sum::<f64>() / 40.0;
    means.iter().fold(0.0, |peak: f64, mean| peak.max((mean - all).abs()))
}

/// A third harmonic stays with the ellipse; a sweep teaches the table, and the table takes it off in the loop.
#[test]
fn a_learned_table_takes_a_third_harmonic_off_in_the_tick() {
    let mut run = Run::new(21, CONFIG, 0.0);
    run.grating.third = 0.01;
    (0..6000).for_each(|_| _ = run.step(run.at + 31.7, true));
    let untaught = inside_a_period(&mut run, 40_000);
    let learned = *run.head.ellipse();
    let mut still = Run::new(22, Config { ellipse: learned, tracks: false, ..CONFIG }, 0.0);
    still.grating.third = 0.01;
    let mut sweep = Sweep::default();
    for _ in 0..40_000 {
        still.grating.go(still.at, still.at + 31.7);
        still.at += 31.7;
        let sample = still.grating.sample(still.at);
        sweep.add(still.head.read(Some(sample), still.grating.count, &still.config).position);
    }
    let (harmonics, _) = sweep.learn().unwrap();
    let mut taught = Run::new(23, Config { ellipse: learned, harmonics, tracks: false, ..CONFIG }, 0.0);
    taught.grating.third = 0.01;
    let taught = inside_a_period(&mut taught, 40_000);
    assert!((1.0..2.0).contains(&untaught) && taught <= 0.1, "{untaught} nm, with the table {taught} nm");
}

/// A fixed correction is not changed, but who watches the signals sees that they are no longer what they were.
#[test]
fn without_tracking_the_live_ellipse_is_graded_and_nothing_else() {
    let poor = Ellipse { p: 0.05 * RADIUS, q: -0.03 * RADIUS, ..Ellipse::circle(RADIUS) };
    let mut run = Run::new(31, Config { ellipse: poor, tracks: false, ..CONFIG }, 0.0);
    (0..6000).for_each(|_| assert_eq!(run.step(run.at + 30.0, true).1, None));
    assert_eq!((run.report().warn, run.report().fail), (Findings::NONE, Findings::NONE));
    run.grating.offset = 0.15;
    let mut inside = [f64::MAX, f64::MIN];
    for _ in 0..6000 {
        let (off, fault) = run.step(run.at + 30.0, true);
        assert_eq!(fault, None);
        inside = [inside[0].min(off), inside[1].max(off)];
    }
    assert!(run.report().warn.has(Findings::OFFSET), "{:?}", run.report());
    // 15 % of the radius beside the corrected circle: ± 19 nm stay in the position.
    assert!(inside[1] - inside[0] > 30.0, "{inside:?}");
}

/// However far an offset jumps, it is graded for what it is, and taken off by a head that tracks.
#[test]
fn an_offset_that_jumps_off_the_circle_is_found() {
    for (total, tracks) in [(0.25, true), (0.35, true), (0.45, true), (0.35, false), (0.45, false)] {
        for step in [7.0, 30.0] {
            let poor = Ellipse { p: 0.05 * RADIUS, q: -0.03 * RADIUS, ..Ellipse::circle(RADIUS) };
            let mut run = Run::new(37, Config { ellipse: poor, tracks, ..CONFIG }, 0.0);
            (0..20_000).for_each(|_| assert_eq!(run.step(run.at + step, true).1, None));
            run.grating.offset = total - 0.05;
            (0..60_000).for_each(|_| _ = run.step(run.at + step, true));
            let report = run.report();
            let found = report.warn.and(report.fail).has(Findings::OFFSET) && report.grade() >= Grade::Warn;
            assert!(found, "{total}, {tracks}, {step}: {report:?}");
            assert_eq!(
                report.fail.has(Findings::OFFSET),
                total > 0.26,
                "{total}, {tracks}, {step}: {report:?}"
            );
            let (low, high) = (0..2000)
                .map(|_| run.step(run.at + step, true).0)
                .fold((f64::MAX, f64::MIN), |(low, high), off| (low.min(off), high.max(off)));
            assert!(!tracks || high - low < 12.0, "{total}, {step}: {} nm", high - low);
        }
    }
}

#[test]
fn what_the_converter_cuts_off_does_not_bend_the_ellipse() {
    let config = Config { ellipse: Ellipse::circle(1.45 * RADIUS), ..CONFIG };
    let mut run = Run::new(31, config, 0.0);
    run.grating.amplitude = 1.45;
    (0..20_000).for_each(|_| _ = run.step(run.at + 31.7, true));
    assert!(run.report().warn.and(run.report().fail).has(Findings::CLIPPED));
    let found = run.head.ellipse();
    assert!(
        (1.0 / found.r - 1.08).abs() < 0.003 && (found.radius / RADIUS - 1.45).abs() < 0.005,
        "{found:?}"
    );
}

#[test]
fn without_a_counter_speed_is_no_limit_but_acceleration() {
    let config = Config { counted: false, ..CONFIG };
    let mut run = Run::new(4, config, 0.0);
    // 0 to 60 mm/s and back, at 10 m/s²: a quarter of the limit, 40 m/s².
    let (mut at, mut speed) = (0.0, 0.0);
    for tick in 0..3000 {
        let acceleration = [100.0, 0.0, -100.0, -100.0, 0.0, 100.0][(tick / 60 % 6) as usize];
        speed += acceleration;
        at += speed;
        let (off, fault) = run.step(at, true);
        assert!(fault.is_none() && off.abs() < 20.0, "tick {tick}: {off} nm, {fault:?}");
    }
    // Beyond it: told in the very sample.
    let found = (0..20).find_map(|_| {
        speed += 330.0;
        at += speed;
        run.step(at, true).1
    });
    assert_eq!(found, Some(SignalFault::Fast));
}

#[test]
fn steps_of_a_160th_are_multiples_of_5_nm() {
    for count_limit in [false, true] {
        let mut run = Run::new(5, Config { factor: 160, count_limit, ..CONFIG }, 0.0);
        let path = motion(2.0);
        for tick in 0..20_000 {
            run.grating.go(run.at, path(tick));
            run.at = path(tick);
            let sample = run.grating.sample(run.at);
            let position = run.head.read(Some(sample), run.grating.count, &run.config).position;
            let steps = position.turns() * 160.0;
            assert!((steps - steps.round()).abs() < 1e-5, "{steps}");
        }
    }
}

#[test]
fn a_pulled_plug_dirt_clipping_and_lost_counts_are_found_before_the_position_is_wrong() {
    let path = motion(4.0);
    for seed in 0..40 {
        let from = 200 + 37 * seed as u32;
        let spoil = |what: &dyn Fn(&mut Run)| {
            let mut run = Run::new(seed, CONFIG, 0.0);
            let mut worst = 0.0_f64;
            for tick in 0..from + 20_000 {
                if tick == from {
                    what(&mut run);
                }
                let (off, fault) = run.step(path(tick), true);
                if let Some(fault) = fault {
                    return (tick.checked_sub(from), fault, worst);
                }
                worst = worst.max(off.abs());
            }
            panic!("seed {seed}: never found; {:?}", run.report());
        };
        // No light: within three samples, and the position stands still meanwhile (4 mm/s are 400 nm a tick).
        let (after, fault, _) = spoil(&|run| run.grating.amplitude = 0.02);
        assert_eq!((after, fault), (Some(2), SignalFault::Lost));
        // The counter stops: found within half a period of travel, the position is right until then.
        let (_, fault, worst) = spoil(&|run| run.grating.counting = false);
        assert!(matches!(fault, SignalFault::Disagrees) && worst < 20.0, "{fault:?}: {worst} nm");
        // Two counts at once, as an illegal transition swallows them: in the very sample.
        let (_, fault, worst) = {
            let mut run = Run::new(seed, CONFIG, 0.0);
            let mut worst = 0.0_f64;
            (0..40_000)
                .find_map(|tick| {
                    if tick == from {
                        run.grating.count += 2;
                    }
                    let (off, fault) = run.step(path(tick), true);
                    worst = if fault.is_none() { worst.max(off.abs()) } else { worst };
                    fault.map(|fault| (tick, fault, worst))
                })
                .unwrap()
        };
        assert!(matches!(fault, SignalFault::Disagrees) && worst < 20.0, "{fault:?}: {worst} nm");
    }
}

#[test]
fn after_lost_counts_the_head_goes_on_from_where_it_is() {
    let path = motion(1.0);
    for lost in [-8, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 8, 12] {
        let mut run = Run::new(13, CONFIG, 0.0);
        let mut faults = 0;
        for tick in 0..30_000 {
            if tick == 1000 {
                run.grating.count += lost;
            }
            let (off, fault) = run.step(path(tick), true);
            faults += u32::from(fault.is_some());
            // Off by whole periods, no more than the counts that were lost.
            assert!((off - (off / PERIOD).round() * PERIOD).abs() < 40.0, "{lost}, tick {tick}: {off} nm");
            let periods = (lost.unsigned_abs() / 4 + 1) as f64;
            assert!(off.abs() < periods * PERIOD + 40.0, "{lost}, tick {tick}: {off} nm");
        }
        // None is silent, not even a single one; and a fault does not go on when nothing is lost any more.
        assert!((1..5).contains(&faults), "{lost}: {faults} faults");
        assert_eq!(run.report().fail, Findings::NONE);
    }
}

#[test]
fn missed_samples_are_bridged_by_the_count_and_too_many_are_a_fault() {
    let mut run = Run::new(9, CONFIG, 0.0);
    (0..6000).for_each(|_| _ = run.step(run.at + 31.0, true));
    (0..100).for_each(|tick| _ = run.step(run.at + 31.0 - 0.31 * f64::from(tick), true));
    let (began, path) = (run.at, motion(5.0));
    let path = |tick| began + path(tick);
    for tick in 0..20_000 {
        let (off, fault) = run.step(path(tick), tick % 50 != 7 && tick % 50 != 8 && tick % 50 != 9);
        // It went on as before, within what the count says: 0.3 m/s² are not expected.
        assert!(fault.is_none() && off.abs() < 40.0, "tick {tick}: {off} nm, {fault:?}");
    }
    assert!(run.report().warn.has(Findings::MISSED), "{:?}", run.report());
    let faults: Vec<_> = (20_000..20_012).map(|tick| run.step(path(tick), false).1).collect();
    assert_eq!(faults.iter().position(Option::is_some), Some(8), "{faults:?}");
}

/// Counts that are lost by whole periods leave count and phase as they were, at any speed and at none.
#[test]
fn whole_periods_lost_between_two_samples_are_told_in_the_second() {
    for speed in [0.0, 0.01, 0.8, 5.0, 8.0, 50.0] {
        for (seed, lost) in [-8, -4, 4, 8, 40].into_iter().enumerate() {
            let path = motion(speed);
            let mut run = Run::new(seed as u64, CONFIG, 0.0);
            let from = 3000 + 171 * seed as u32;
            let found = (0..from + 100).find_map(|tick| {
                if tick == from {
                    run.grating.count += lost;
                }
                Some((tick, run.step(path(tick), true).1?))
            });
            assert_eq!(found, Some((from + 1, SignalFault::Slipped)), "{speed} mm/s, {lost} counts");
        }
    }
}

/// At 8 mm/s a sample has gone ten periods of 0.8 µm since the last, and its phase seems to stand still.
#[test]
fn samples_of_a_fast_motion_are_not_gathered_whatever_their_phase() {
    for (mm_s, learns) in [(0.8, true), (7.9, false), (8.1, false), (16.1, false)] {
        let mut run = Run::new(41, CONFIG, 0.0);
        let speed = mm_s * 1e6 * TICK;
        let (mut at, mut now) = (0.0, 0.0);
        for _ in 0..40_000 {
            now = f64::min(now + 5.0, speed);
            at += now;
            run.step(at, true);
        }
        // On the way up to its speed it is slow for a few periods.
        assert_eq!(*run.head.ellipse() != CONFIG.ellipse, learns, "{mm_s} mm/s");
    }
}

/// What the converter gave before, once more: count and phase of a tick ago.
#[test]
fn late_samples_are_no_fault_at_any_speed_with_a_counter_and_without() {
    for (counted, speed) in
        [(true, 0.5), (true, 5.0), (true, 50.0), (false, 0.5), (false, 4.0), (false, 50.0)]
    {
        let path = motion(speed);
        let mut run = Run::new(51, Config { counted, ..CONFIG }, 0.0);
        let mut last = None;
        for tick in 0..40_000 {
            let count = run.grating.count;
            run.grating.go(run.at, path(tick));
            run.at = path(tick);
            let sample = run.grating.sample(run.at);
            let late = tick % 97 == 50;
            let shown = if late { last } else { Some((sample, run.grating.count)) };
            let (shown, at) = shown.unwrap_or((sample, count));
            let read = run.head.read(Some(shown), at, &run.config);
            run.head.refine();
            assert_eq!(read.fault, None, "{counted} {speed}, tick {tick}");
            last = Some((sample, run.grating.count));
            let off = read.position.pm(800_000) as f64 / 1e3 - run.at;
            let zero = *run.zero.get_or_insert((off / PERIOD).round() * PERIOD);
            assert!(late || (off - zero).abs() < 30.0, "{counted} {speed}, tick {tick}: {off}");
        }
    }
}

/// One wild sample costs an uncounted head a period at most together with a fault.
#[test]
fn a_wild_sample_without_a_counter_is_a_fault_or_does_no_harm() {
    for speed in [0.5, 3.0, 5.0, 20.0] {
        for number in 0..250 {
            let path = motion(speed);
            let mut run = Run::new(number, Config { counted: false, tracks: false, ..CONFIG }, 0.0);
            let mut fault = None;
            for tick in 0..3000 + 40 {
                if tick == 3000 {
                    run.grating.go(run.at, path(tick));
                    run.at = path(tick);
                    let angle = f64::from(number as u32) / 250.0 * TAU;
                    let [cos, sin] = [angle.cos(), angle.sin()].map(|part| (part * RADIUS) as i16);
                    fault = fault.or(run.read(Some(SinCos { sin, cos })).1);
                    continue;
                }
                let (off, found) = run.step(path(tick), true);
                fault = fault.or(found);
                assert!(tick > 3000 || found.is_none());
                assert!(fault.is_some() || off.abs() < 40.0, "{speed} {number}: {off} nm, tick {tick}");
            }
        }
    }
}

/// Half a period a sample and a standing stage look alike to who believes in a speed.
#[test]
fn a_stage_that_stands_after_a_fault_is_not_seen_to_move() {
    for counted in [false, true] {
        for seed in 0..40 {
            let mut run = Run::new(seed, Config { counted, tracks: false, ..CONFIG }, 0.0);
            let path = motion(5.0);
            let from = 3000 + 53 * seed as u32;
            (0..from).for_each(|tick| _ = run.step(path(tick), true));
            let speed = path(from) - path(from - 1);
            run.grating.amplitude = 0.01;
            let faults = (0..5).filter(|_| run.step(run.at + speed, true).1.is_some()).count();
            assert!(faults >= 3, "{faults}");
            run.grating.amplitude = 1.0;
            // It is braked within 0.05 s, and rests.
            (0..500).for_each(|k| _ = run.step(run.at + speed * (1.0 - f64::from(k) / 500.0), true));
            (0..100).for_each(|_| _ = run.step(run.at, true));
            let (before, _) = run.step(run.at, true);
            let moved =
                (0..1000).map(|_| run.step(run.at, true).0 - before).fold(0.0, |m: f64, x| m.max(x.abs()));
            assert!(moved < 10.0, "{counted}, seed {seed}: {moved} nm");
        }
    }
}

#[test]
fn a_head_may_begin_without_samples_at_any_phase() {
    for place in 0..20 {
        for missing in 1..6 {
            let at = 40.0 * f64::from(place);
            let mut run = Run::new(61, CONFIG, at);
            (0..missing).for_each(|_| assert_eq!(run.step(at, false).1, None));
            assert!((0..50).all(|_| run.step(at, true).1.is_none()), "{at} nm, {missing} missing");
        }
    }
}

/// A plug that is pulled may leave any level, and a counter that counts no more.
#[test]
fn signals_that_freeze_in_motion_are_told() {
    for (noise, within) in [(0.0, 5), (0.003, 3)] {
        for seed in 0..40 {
            // 2 mm/s: nothing stops within a tick from there.
            let mut run = Run::new(seed, Config { tracks: false, ..CONFIG }, 0.0);
            let mut speed = 0.0_f64;
            for _ in 0..300 {
                speed = (speed + 2.0).min(200.0);
                assert_eq!(run.step(run.at + speed, true).1, None);
            }
            (0..seed).for_each(|_| _ = run.step(run.at + speed, true));
            run.grating.noise = 0.0;
            let frozen = run.grating.sample(run.at);
            let told = (1..50).find(|&tick| {
                let wave = noise * RADIUS * f64::from(tick * 7 % 5 - 2);
                let sample = SinCos { sin: frozen.sin + wave as i16, cos: frozen.cos - wave as i16 };
                run.read(Some(sample)).1.is_some()
            });
            assert!(told.is_some_and(|told| told <= within), "{noise}, seed {seed}: {told:?}");
        }
    }
}

/// While a channel sticks, count and phase may meet where they never belong together.
#[test]
fn what_a_stuck_channel_taught_is_forgotten_with_the_fault() {
    let mut met_wrong = 0;
    for seed in 0..60 {
        let [kept, forgotten] = [false, true].map(|doubts| {
            let mut run = Run::new(seed, CONFIG, 0.0);
            (0..3000).for_each(|_| assert_eq!(run.step(run.at + 30.0, true).1, None));
            let stuck = run.grating.sample(run.at).sin;
            // It coasts to rest.
            for tick in 0..1000 + 7 * seed {
                let to = run.at + 100.0 / (1.0 + tick as f64 / 100.0);
                run.grating.go(run.at, to);
                run.at = to;
                let sample = SinCos { sin: stuck, ..run.grating.sample(to) };
                run.read(Some(sample));
            }
            if doubts {
                run.head.doubt();
            }
            (0..2000).filter(|_| run.step(run.at + 3.0, true).1.is_some()).count()
        });
        met_wrong += u32::from(kept > 0);
        assert_eq!(forgotten, 0, "seed {seed}");
    }
    assert!(met_wrong > 0, "nothing was shown");
}

#[test]
fn while_there_is_no_signal_the_position_stays() {
    let mut run = Run::new(71, CONFIG, 0.0);
    (0..3000).for_each(|k| _ = run.step(f64::from(k), true));
    run.grating.amplitude = 0.001;
    (0..10).for_each(|_| _ = run.step(run.at, true));
    let (before, _) = run.step(run.at, true);
    let moved = (0..10_000).map(|_| (run.step(run.at, true).0 - before).abs()).fold(0.0, f64::max);
    assert!(moved < 400.0, "{moved} nm");
}

#[test]
fn saturation_and_dirt_are_graded() {
    let grade = |amplitude: f64| {
        let mut run = Run::new(11, CONFIG, 0.0);
        run.grating.amplitude = amplitude;
        let fault = (0..3000).find_map(|tick| run.step(f64::from(tick) * 41.0, true).1);
        (run.report(), fault)
    };
    let (dirty, fault) = grade(0.6);
    assert!(fault.is_none() && dirty.warn.has(Findings::WEAK), "{dirty:?}");
    let (dirtier, fault) = grade(0.45);
    assert!(fault.is_none() && dirtier.fail.has(Findings::WEAK), "{dirtier:?}");
    let (strong, fault) = grade(1.45);
    assert!(fault.is_none() && strong.fail.has(Findings::CLIPPED), "{strong:?}");
}
