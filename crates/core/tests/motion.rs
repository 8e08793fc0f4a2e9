//! Programs and turns in the hands of the whole controller.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bench;
mod walked;

use abbe_core::background::{self, Done};
use abbe_core::command::Compare;
use abbe_core::front::compare::{Places, PlacesError, When};
use abbe_core::machine::State;
use abbe_core::plan::compare::Axis;
use abbe_core::plan::scan::{Lines, Order, Scan};
use abbe_core::plan::segment::{Feed, Segment, Shape};
use abbe_core::plan::steps::SetPoint;
use abbe_core::publish::{Fault, Outcome};
use abbe_core::{Command, Controller, Pos, Refusal};
use bench::{Bench, Plans, mm};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn line(x: f64, y: f64, tolerance_um: f64) -> Segment {
    let tolerance = Pos::from_um(tolerance_um);
    Segment { to: mm(x, y), feed: Feed::RAPID, tolerance, ..Segment::default() }
}

fn circle(x: f64, y: f64, radius: f64, counterclockwise: bool) -> Segment {
    let shape = Shape::Arc { centre: mm(x + radius, y), counterclockwise };
    Segment { shape, to: mm(x, y), feed: Feed::from_pm(1e6), ..Segment::default() }
}

#[test]
fn a_program_is_one_move_that_ends_where_it_should() {
    let mut bench = Bench::new().homed();
    let before = bench.status().move_number;
    let path = [line(4.0, 4.0, 5.0), line(8.0, 4.0, 5.0), line(8.0, 8.0, 0.0), circle(8.0, 8.0, 1.0, true)];
    bench.go(&path);
    assert_eq!(bench.controller.command(Command::Home), Err(Refusal::Busy(State::Moving)));
    bench.settle();
    let status = bench.status();
    assert_eq!((status.state, bench.outcome()), (State::Ready, Outcome::Arrived));
    assert_eq!((status.move_number, status.last_move.unwrap().number), (before + 1, before + 1));
    assert_eq!(status.axes.map(|axis| axis.set_point), mm(8.0, 8.0));
    assert_eq!(status.axes.map(|axis| axis.target), mm(8.0, 8.0));
    bench.assert_moved_within_limits();
    // 3 mm further: a relative move starts from the last target.
    bench.ask(Command::MoveBy(mm(1.0, 0.0)));
    bench.settle();
    assert_eq!(bench.status().axes[0].set_point, Pos::from_mm(9.0));
}

#[test]
fn segments_that_cannot_be_gone_are_refused_and_change_nothing() {
    let mut bench = Bench::new().homed();
    let go = |bench: &mut Bench, segment| bench.controller.command(Command::Go(segment));
    bench.ask(Command::MoveTo(mm(2.0, 2.0)));
    bench.settle();
    let refused = go(&mut bench, line(2.0, 1e3, 0.0));
    assert!(matches!(refused, Err(Refusal::OutOfTravel { axis: 1, .. })), "{refused:?}");
    // The ends lie within the travel, the arc bulges out of it to -1 mm.
    let bulging = Segment {
        shape: Shape::Arc { centre: mm(1.0, 2.0), counterclockwise: true },
        to: mm(2.0, 2.0),
        ..circle(0.0, 0.0, 1.0, true)
    };
    assert_eq!(go(&mut bench, bulging), Ok(abbe_core::Accepted { move_number: 2 }));
    bench.settle();
    let shape = Shape::Arc { centre: mm(0.5, 2.0), counterclockwise: true };
    let refused = go(&mut bench, Segment { shape, ..bulging });
    let Err(Refusal::OutOfTravel { axis: 0, asked, .. }) = refused else { panic!("{refused:?}") };
    assert!((asked - Pos::from_mm(-1.0)).abs() <= Pos::from_pm(2), "{asked:?}");
    let shape = Shape::Arc { centre: mm(0.5, 2.5), counterclockwise: true };
    assert_eq!(go(&mut bench, Segment { shape, to: mm(2.0, 3.5), ..bulging }), Err(Refusal::NoCurve));
    let shape = Shape::Sine { amplitude: Pos::from_mm(2.5), periods: 3, phase: 0 };
    let refused = go(&mut bench, Segment { shape, to: mm(6.0, 2.0), ..bulging });
    assert!(matches!(refused, Err(Refusal::OutOfTravel { axis: 1, .. })), "{refused:?}");
    let shape = Shape::Sine { amplitude: Pos::ZERO, periods: 3, phase: 0 };
    assert_eq!(go(&mut bench, Segment { shape, to: mm(6.0, 2.0), ..bulging }), Err(Refusal::NoCurve));
    assert_eq!(
        go(&mut bench, Segment { feed: Feed::default(), ..line(3.0, 3.0, 0.0) }),
        Err(Refusal::NoFeed)
    );
    let below = Segment { tolerance: Pos::from_pm(-1), ..line(3.0, 3.0, 0.0) };
    assert_eq!(go(&mut bench, below), Err(Refusal::Tolerance(Pos::from_pm(-1))));
    let crawl = Segment { feed: Feed::from_pm(10.0), ..line(3.0, 3.0, 0.0) };
    assert_eq!(go(&mut bench, crawl), Err(Refusal::TooLong));
    for command in [Command::Hold, Command::Resume] {
        assert_eq!(bench.controller.command(command), Err(Refusal::NoProgram));
    }
    for percent in [0, 201] {
        assert_eq!(bench.controller.command(Command::FeedRate(percent)), Err(Refusal::FeedRate(percent)));
    }
    bench.run(100);
    assert_eq!((bench.status().state, bench.status().move_number), (State::Ready, 2));
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(2.0, 2.0));
    let mut cold = Controller::with_planner(*bench.controller.config());
    cold.tick(&abbe_core::Inputs::at_rest(1));
    assert_eq!(cold.command(Command::Go(line(1.0, 1.0, 0.0))), Err(Refusal::DrivesOff));
}

#[test]
fn a_queue_that_is_full_says_so_and_takes_the_segment_later() {
    let mut bench = Bench::new().homed();
    let mut taken = 0;
    while bench.controller.command(Command::Go(line(1.0 + f64::from(taken) * 0.01, 1.0, 1.0))).is_ok() {
        taken += 1;
    }
    assert_eq!(taken as usize, abbe_core::controller::QUEUE);
    let refused = bench.controller.command(Command::Go(line(1.0, 1.0, 1.0)));
    assert_eq!(refused, Err(Refusal::QueueFull));
    bench.tick();
    bench.go(&[line(1.0, 1.0, 1.0)]);
    bench.settle();
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(1.0, 1.0));
    bench.assert_moved_within_limits();
}

/// A host that sends a segment a tick does not stop behind the first.
#[test]
fn a_segment_a_tick_is_as_soon_as_all_at_once() {
    let ticks = |apart: u32| {
        let mut bench = Bench::new().homed();
        for k in 1..=8 {
            bench.go(&[line(0.05 * f64::from(k), 0.002 * f64::from(k * k), 2.0)]);
            bench.run(apart);
        }
        bench.settle();
        bench.assert_moved_within_limits();
        bench.status().last_move.unwrap().path_ticks
    };
    assert_eq!([ticks(1), ticks(2)], [ticks(0); 2]);
}

#[test]
fn a_stop_brakes_on_the_path_and_forgets_the_rest() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    for _ in 0..20 {
        let mut bench = Bench::new().homed();
        bench.go(&[
            line(3.0, 3.0, 20.0),
            line(6.0, 3.0, 20.0),
            line(6.0, 6.0, 20.0),
            circle(6.0, 6.0, 1.0, false),
        ]);
        bench.run(random.random_range(1..9000));
        bench.ask(Command::Stop);
        bench.settle();
        assert_eq!((bench.status().state, bench.outcome()), (State::Ready, Outcome::Stopped));
        // The last is the reading, which is taken for the target.
        _ = bench.places.pop();
        bench.assert_moved_within_limits();
        let held = bench.status().axes.map(|axis| axis.set_point);
        bench.run(3000);
        assert_eq!(bench.status().axes.map(|axis| axis.set_point), held);
        // On one of the lines, or on the circle; after the stop the target is the reading, within a count.
        let [x, y] = held.map(Pos::mm);
        let off =
            [(x - y).abs() / 1.4, (y - 3.0).abs(), (x - 6.0).abs(), ((x - 7.0).hypot(y - 6.0) - 1.0).abs()];
        let off = off.into_iter().fold(f64::INFINITY, f64::min);
        assert!(off < 0.0205, "{off} mm off the path at {x} {y}");
        bench.ask(Command::MoveTo(mm(1.0, 2.0)));
        bench.settle();
        assert_eq!(bench.outcome(), Outcome::Arrived);
    }
}

/// Asked for in any gap around the end of what is known, a stop is heard, and what was asked for just before it forgotten.
#[test]
fn a_stop_behind_a_segment_is_heard_in_every_gap_around_a_rest() {
    let mut whole = Bench::new().homed();
    whole.go(&[line(6.0, 6.0, 0.0)]);
    while whole.status().state == State::Moving {
        whole.tick();
    }
    let path = whole.places.len() as u32;
    for gap in path - 12..path + 6 {
        let mut bench = Bench::new().homed();
        bench.go(&[line(6.0, 6.0, 0.0)]);
        bench.run(gap);
        let slow = Segment { feed: Feed::from_pm(1e5), ..line(9.0, 3.0, 0.0) };
        _ = bench.controller.command(Command::Go(slow));
        bench.ask(Command::Stop);
        bench.planner.advance(&mut bench.controller);
        bench.settle();
        let at = bench.status().axes.map(|axis| axis.set_point.mm());
        assert!((at[0] - 6.0).abs() < 0.1 && (at[1] - 6.0).abs() < 0.1, "{gap}: {at:?}");
    }
}

/// A program that is held near its end has not ended.
#[test]
fn a_hold_near_the_end_holds_what_comes_next() {
    let mut bench = Bench::new().homed();
    bench.go(&[line(6.0, 6.0, 0.0)]);
    while bench.status().axes[0].set_point < Pos::from_mm(5.9) {
        bench.tick();
    }
    bench.ask(Command::Hold);
    bench.run(3000);
    assert!(bench.status().held && bench.status().state == State::Moving);
    bench.go(&[line(9.0, 3.0, 0.0)]);
    bench.run(3000);
    assert!(bench.status().axes[0].set_point <= Pos::from_mm(6.0));
    bench.ask(Command::Resume);
    bench.settle();
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(9.0, 3.0));
    bench.assert_moved_within_limits();
}

#[test]
fn a_program_rests_while_it_is_held_and_goes_on() {
    let mut bench = Bench::new().homed();
    bench.go(&[line(8.0, 1.0, 0.0), line(8.0, 3.0, 0.0)]);
    bench.run(2500);
    bench.ask(Command::Hold);
    bench.run(2000);
    let status = bench.status();
    assert!(status.held && status.state == State::Moving);
    let at = status.axes.map(|axis| axis.set_point);
    // Longer than a plan may be missing.
    bench.run(2 * background::PLAN_MISSING_TICKS);
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), at);
    assert!(at[0] > Pos::from_mm(0.5) && at[0] < Pos::from_mm(8.0));
    bench.ask(Command::FeedRate(50));
    bench.ask(Command::Resume);
    bench.settle();
    assert_eq!(bench.outcome(), Outcome::Arrived);
    assert_eq!(bench.status().feed_rate, 50);
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(8.0, 3.0));
    bench.assert_moved_within_limits();
}

/// Stopped, held, hurried and sent elsewhere at random: always within limits, never a fault.
#[test]
fn whatever_is_asked_of_it_moves_within_its_limits() {
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let mut replaced = 0;
    for _ in 0..60 {
        let mut bench = Bench::new().homed();
        for _ in 0..16 {
            let place = [(); 2].map(|()| random.random_range(1.0..20.0));
            let command = match random.random_range(0..9) {
                0 | 1 => Command::MoveTo(mm(place[0], place[1])),
                2 => Command::MoveBy(mm(0.01 * place[0], -0.01 * place[1])),
                3 => Command::Hold,
                4 => Command::Resume,
                5 => Command::FeedRate(random.random_range(10..200)),
                6 if random.random_range(0..3) == 0 => Command::Stop,
                _ => Command::Go(line(place[0], place[1], 30.0)),
            };
            let before = bench.status().last_move;
            _ = bench.controller.command(command);
            let after = bench.status().last_move;
            replaced += u32::from(before != after && after.unwrap().outcome == Outcome::Replaced);
            // Now and then before a planner has answered.
            let longest = if random.random_range(0..2) == 0 { 30 } else { 2500 };
            bench.run(random.random_range(0..longest));
            // Where a stop ends the set-point becomes the reading: a jump of the servo's error.
            if bench.status().last_move.is_some_and(|last| last.outcome == Outcome::Stopped) {
                bench.places.clear();
                break;
            }
        }
        _ = bench.controller.command(Command::Resume);
        bench.settle();
        assert_eq!((bench.status().state, bench.status().fault), (State::Ready, None));
        if bench.status().last_move.is_some_and(|last| last.outcome == Outcome::Stopped) {
            _ = bench.places.pop();
        }
        bench.assert_moved_within_limits();
    }
    assert!(replaced > 20, "{replaced}");
}

/// A scan runs behind a program's line to its start; each line passes each place once, in their order, evenly in time.
#[test]
fn a_scan_fires_at_the_places_that_the_measured_position_passes() {
    let mut bench = Bench::new().homed();
    let scan = Scan {
        corners: [mm(5.0, 5.0), mm(7.0, 6.0)],
        fast: Axis::X,
        lines: Lines::Number(5),
        order: Order::Serpentine,
        speed: 1e6,
        settle: 50,
    };
    let limits = bench.limits();
    let segment = Segment::scanning(&scan, &limits).unwrap();
    let start = scan.plan(&limits).unwrap().start();
    let refused = bench.controller.command(Command::Go(segment));
    assert_eq!(refused, Err(Refusal::ScanStart(start)));
    bench.go(&[line(start[0].mm(), start[1].mm(), 0.0)]);
    bench.settle();
    let places =
        Places { first: 5_000_000_000, pitch: 100_000_000, number: 21, when: When::Both, play: 1_000_000 };
    bench.ask(Command::Compare(Some(Compare { axis: 0, places })));
    bench.go(&[segment, line(1.0, 1.0, 0.0)]);
    let (mut events, mut triggers) = (Vec::new(), 0);
    bench.tick();
    while bench.status().state.is_busy() {
        bench.tick();
        events.extend_from_slice(bench.controller.fired().as_slice());
        triggers += u32::from(bench.outputs.trigger);
        if events.len() == 105 {
            bench.ask(Command::Compare(None));
        }
    }
    assert_eq!((events.len(), triggers), (105, 105));
    for (number, line) in events.chunks(21).enumerate() {
        let up = number % 2 == 0;
        let order: Vec<u32> = if up { (0..21).collect() } else { (0..21).rev().collect() };
        assert!(line.iter().map(|event| event.place).eq(order) && line.iter().all(|event| event.up == up));
        for pair in line.windows(2) {
            // 100 µm at 1 µm a tick; the ideal slide steps by 0.3125 µm and counts by 0.1.
            let ticks = (pair[1].time - pair[0].time) as f64 / f64::from(1 << 16) / f64::from(1 << 16);
            assert!((ticks - 100.0).abs() < 1.0, "{ticks}");
        }
    }
    assert_eq!(bench.outcome(), Outcome::Arrived);
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(1.0, 1.0));
    bench.assert_moved_within_limits();
    let places = Places { pitch: 0, ..places };
    let armed = bench.controller.command(Command::Compare(Some(Compare { axis: 0, places })));
    assert_eq!(armed, Err(Refusal::NoPlaces(PlacesError::Pitch(0))));
}

/// It cannot be held inside, which would leave it at another speed; it can be stopped.
#[test]
fn a_scan_is_held_behind_its_end_and_stopped_at_once() {
    let scan = Scan {
        corners: [mm(5.0, 5.0), mm(8.0, 6.0)],
        fast: Axis::X,
        lines: Lines::Number(3),
        order: Order::FlyBack,
        speed: 1e6,
        settle: 50,
    };
    for stops in [false, true] {
        let mut bench = Bench::new().homed();
        let limits = bench.limits();
        let segment = Segment::scanning(&scan, &limits).unwrap();
        let start = scan.plan(&limits).unwrap().start();
        bench.go(&[line(start[0].mm(), start[1].mm(), 0.0), segment, line(1.0, 1.0, 0.0)]);
        bench.run(8000);
        bench.ask(if stops { Command::Stop } else { Command::Hold });
        let asked = bench.places.len();
        if stops {
            bench.settle();
            assert_eq!(bench.outcome(), Outcome::Stopped);
            assert!(bench.places.len() - asked < 800);
            _ = bench.places.pop();
        } else {
            bench.run(20_000);
            assert!(bench.status().held && bench.status().state == State::Moving);
            assert_eq!(bench.status().axes.map(|axis| axis.set_point), segment.to);
            bench.ask(Command::Resume);
            bench.settle();
            assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(1.0, 1.0));
        }
        bench.assert_moved_within_limits();
    }
}

#[test]
fn another_target_in_flight_is_reached_without_a_stop() {
    let mut bench = Bench::new().homed();
    bench.ask(Command::MoveTo(mm(10.0, 2.0)));
    bench.run(3000);
    let number = bench.status().move_number;
    bench.ask(Command::MoveTo(mm(15.0, 4.0)));
    let replaced = bench.status().last_move.unwrap();
    assert_eq!((replaced.number, replaced.outcome), (number, Outcome::Replaced));
    let turned = bench.places.len();
    bench.settle();
    assert_eq!(bench.outcome(), Outcome::Arrived);
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(15.0, 4.0));
    let slowest = bench.places[turned..turned + 3000].windows(2).map(|pair| pair[1][0] - pair[0][0]);
    assert!(slowest.fold(f64::INFINITY, f64::min) > 1.9e6, "it slowed down");
    bench.assert_moved_within_limits();
}

#[test]
fn without_a_planner_a_program_is_a_fault_and_one_that_loses_it_brakes() {
    let mut bench = Bench::new().homed();
    bench.plans = Plans::Nothing;
    bench.go(&[line(8.0, 1.0, 0.0)]);
    bench.settle();
    assert_eq!((bench.status().state, bench.status().fault), (State::Fault, Some(Fault::PlanMissing)));
    bench.plans = Plans::Everything;
    bench.ask(Command::Reset);
    bench.ask(Command::Enable);
    // A sine has many pieces, more than are handed over at once.
    let shape = Shape::Sine { amplitude: Pos::from_mm(1.0), periods: 8, phase: 0 };
    bench.places.clear();
    bench.go(&[line(3.0, 3.0, 0.0), Segment { shape, ..line(13.0, 3.0, 0.0) }]);
    bench.run(6000);
    assert_eq!(bench.status().state, State::Moving);
    bench.plans = Plans::Nothing;
    bench.settle();
    assert_eq!((bench.status().state, bench.status().fault), (State::Fault, Some(Fault::PlanMissing)));
    assert_eq!(bench.outcome(), Outcome::Aborted);
    bench.assert_moved_within_limits();
    // A stop that nobody plans is no fault, and comes soon.
    let mut bench = Bench::new().homed();
    bench.go(&[line(9.0, 3.0, 0.0)]);
    bench.run(3000);
    bench.plans = Plans::Nothing;
    bench.ask(Command::Stop);
    let asked = bench.places.len();
    bench.settle();
    assert_eq!((bench.status().state, bench.outcome()), (State::Ready, Outcome::Stopped));
    assert!(bench.places.len() - asked < 800, "{}", bench.places.len() - asked);
    _ = bench.places.pop();
    bench.assert_moved_within_limits();
}

#[test]
fn spans_that_come_too_late_or_for_another_move_change_nothing() {
    let mut bench = Bench::new().homed();
    bench.plans = Plans::Nothing;
    bench.go(&[line(9.0, 3.0, 0.0)]);
    let (mut other, batch) = loop {
        bench.tick();
        let other = bench.controller.clone();
        match bench.planner.advance(&mut bench.controller) {
            Some(Done::Spans(batch)) if !batch.spans.is_empty() => break (other, batch),
            _ => assert!(bench.places.len() < 100, "no spans"),
        }
    };
    assert!(!other.take_spans(&abbe_core::plan::span::Batch { number: batch.number + 1, ..batch }));
    assert!(other.take_spans(&batch));
    let mut late = bench.controller.clone();
    late.command(Command::Stop).unwrap();
    let first = batch.spans.get(0).unwrap().first;
    while bench.status().tick != first {
        bench.tick();
    }
    assert!(!bench.controller.take_spans(&batch));
    late.tick(&abbe_core::Inputs::at_rest(1));
}

/// Speed, acceleration and jerk of a set-point are those of the places around it, whatever moves the stage.
#[test]
fn set_points_know_how_they_go_on() {
    for programmed in [false, true] {
        let mut bench = Bench::new().homed();
        if programmed {
            bench.go(&[line(6.0, 3.0, 0.0)]);
        } else {
            bench.ask(Command::MoveTo(mm(6.0, 3.0)));
        }
        let mut seen = Vec::new();
        while bench.status().state.is_busy() {
            bench.tick();
            seen.push(bench.controller.set_points());
        }
        let mut largest = 0.0_f64;
        for (three, axis) in seen.windows(3).flat_map(|three| [(three, 0), (three, 1)]) {
            let [before, now, after] = [0, 1, 2].map(|k| three[k][axis].position.pm() as f64);
            let SetPoint { speed, acceleration, jerk, .. } = three[1][axis];
            let [speed, acceleration, jerk] = [(speed, 38), (acceleration, 46), (jerk, 50)]
                .map(|(fixed, bits)| fixed as f64 / 2_f64.powi(bits));
            // Means over two ticks: off by a sixth of the jerk, at a change of it by more, and by what is rounded.
            assert!((speed - (after - before) / 2.0).abs() < 12.0, "{speed} {}", (after - before) / 2.0);
            assert!((acceleration - (after - 2.0 * now + before)).abs() < 24.0, "{acceleration}");
            assert!(jerk.abs() < 20.001, "{jerk} {programmed}");
            largest = largest.max(speed);
        }
        // Whole ticks cost a single move a little.
        assert!((1.998e6..2.000_01e6).contains(&largest), "{largest}");
    }
}

/// A run repeats from its recorded batches alone.
#[test]
fn the_batches_of_a_run_repeat_it_without_a_planner() {
    let mut bench = Bench::new().homed();
    let mut again = bench.controller.clone();
    let mut plant = Vec::new();
    let asked = [
        (5, Command::Go(line(6.0, 3.0, 10.0))),
        (6, Command::Go(line(6.0, 9.0, 10.0))),
        (2000, Command::Hold),
        (4000, Command::Resume),
        (5000, Command::MoveTo(mm(1.0, 1.0))),
        (6000, Command::FeedRate(70)),
        (6100, Command::MoveBy(mm(3.0, 0.0))),
    ];
    for number in 0..20_000 {
        for (_, command) in asked.iter().filter(|(tick, _)| *tick == number) {
            assert_eq!(bench.controller.command(*command), again.command(*command), "{command:?}");
        }
        let inputs = bench.plant.step(&bench.outputs);
        bench.outputs = bench.controller.tick(&inputs);
        assert_eq!(again.tick(&inputs), bench.outputs, "tick {number}");
        while let Some(done) = bench.planner.advance(&mut bench.controller) {
            background::repeat(&mut again, &done);
            plant.push(done);
        }
        assert_eq!(again.status(), bench.status());
    }
    assert_eq!(bench.outcome(), Outcome::Arrived);
    assert!(plant.iter().any(|done| matches!(done, Done::Spans(_))));
}

/// A program that is held makes no room by itself: whoever waits for it is told.
#[test]
fn a_queue_that_is_full_while_the_program_is_held_says_what_to_do() {
    let mut bench = Bench::new().homed();
    bench.go(&[line(6.0, 6.0, 0.0)]);
    bench.run(100);
    bench.ask(Command::Hold);
    bench.run(2000);
    let mut refused = Ok(abbe_core::Accepted { move_number: 0 });
    for number in 0..1000 {
        refused = bench.controller.command(Command::Go(line(6.0 + f64::from(number % 2), 7.0, 1.0)));
        if refused.is_err() {
            break;
        }
        bench.tick();
    }
    assert_eq!(refused, Err(Refusal::QueueHeld));
    let told = Refusal::QueueHeld.to_string();
    assert!(told.contains("held") && told.contains("resume"), "{told}");
    bench.ask(Command::Resume);
    bench.go(&[line(5.0, 5.0, 0.0)]);
    bench.settle();
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(5.0, 5.0));
    bench.assert_moved_within_limits();
}
