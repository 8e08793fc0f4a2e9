//! What a controller does for which nobody plans programs and turns: it says so, and goes on.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bench;
mod walked;

use abbe_core::background;
use abbe_core::design::StageSettings;
use abbe_core::machine::State;
use abbe_core::plan::segment::{Feed, Segment};
use abbe_core::publish::Outcome;
use abbe_core::{Command, Controller, Outputs, Pos, Refusal};
use bench::ideal::Ideal;
use bench::{Bench, mm};

#[test]
fn another_target_on_the_path_is_refused_and_the_move_arrives() {
    let mut bench = Bench::plain().homed();
    bench.ask(Command::MoveTo(mm(10.0, 2.0)));
    let number = bench.status().move_number;
    let mut refused = 0;
    while bench.status().state == State::Moving {
        for command in [Command::MoveTo(mm(15.0, 4.0)), Command::MoveBy(mm(1.0, 0.0))] {
            assert_eq!(bench.controller.command(command), Err(Refusal::Busy(State::Moving)));
            refused += 1;
        }
        bench.tick();
    }
    assert!(refused > 5000, "{refused}");
    bench.settle();
    assert_eq!((bench.status().state, bench.outcome()), (State::Ready, Outcome::Arrived));
    assert_eq!(bench.status().move_number, number);
    assert_eq!(bench.status().axes.map(|axis| axis.target), mm(10.0, 2.0));
}

/// While it settles the path has ended, so the next move begins at rest.
#[test]
fn another_target_while_it_settles_is_gone_to() {
    let mut bench = Bench::plain().homed();
    bench.ask(Command::MoveTo(mm(3.0, 2.0)));
    while bench.status().state == State::Moving {
        bench.tick();
    }
    assert_eq!(bench.status().state, State::Settling);
    bench.ask(Command::MoveTo(mm(4.0, 4.0)));
    assert_eq!(bench.outcome(), Outcome::Replaced);
    bench.settle();
    assert_eq!((bench.status().state, bench.outcome()), (State::Ready, Outcome::Arrived));
    assert_eq!(bench.status().axes.map(|axis| axis.set_point), mm(4.0, 4.0));
    bench.assert_moved_within_limits();
}

#[test]
fn a_program_is_refused() {
    let mut bench = Bench::plain().homed();
    let segment = Segment { to: mm(8.0, 1.0), feed: Feed::RAPID, ..Segment::default() };
    assert_eq!(bench.controller.command(Command::Go(segment)), Err(Refusal::NoPlanner));
    bench.run(3 * background::PLAN_MISSING_TICKS);
    assert_eq!((bench.status().state, bench.status().fault), (State::Ready, None));
}

/// A stage of one axis or of three never has a planner.
#[test]
fn stages_of_one_axis_and_of_three_refuse_both() {
    refuses_both::<1>();
    refuses_both::<3>();
}

fn refuses_both<const N: usize>() {
    let mut controller = Controller::new(StageSettings::<N>::default().build().unwrap());
    let mut plant = Ideal::<N>::new();
    let mut outputs = controller.tick(&plant.step(&Outputs::OFF));
    controller.command(Command::Home).unwrap();
    let mut asked = false;
    for _ in 0..600_000 {
        outputs = controller.tick(&plant.step(&outputs));
        background::advance(&mut controller);
        let status = controller.status();
        if status.state == State::Ready && !asked {
            let segment = Segment { to: mm(2.0, 2.0), feed: Feed::RAPID, ..Segment::default() };
            assert_eq!(controller.command(Command::Go(segment)), Err(Refusal::NoPlanner));
            controller.command(Command::MoveTo([Pos::from_mm(3.0); N])).unwrap();
            asked = true;
        } else if status.state == State::Moving {
            let turn = controller.command(Command::MoveTo([Pos::from_mm(4.0); N]));
            assert_eq!(turn, Err(Refusal::Busy(State::Moving)));
        } else if asked && !status.state.is_busy() {
            break;
        }
    }
    let status = controller.status();
    assert_eq!((status.state, status.fault), (State::Ready, None), "{N} axes");
    assert_eq!(status.last_move.unwrap().outcome, Outcome::Arrived);
}
