//! Promises of the whole controller, kept against a plant so simple that it hides nothing.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bench;
mod walked;

use abbe_core::background;
use abbe_core::compensate::ErrorMap;
use abbe_core::design::StageSettings;
use abbe_core::edge::{Actuation, AxisInputs, Inputs, Outputs, StepRate};
use abbe_core::machine::State;
use abbe_core::plan::LinePlan;
use abbe_core::publish::{Fault, Outcome};
use abbe_core::{Command, Controller, Pos, Refusal};
use bench::Bench;
use proptest::prelude::*;

#[test]
fn done_means_measured() {
    let mut bench = Bench::plain().homed();
    bench.move_to(3.0, 3.0);
    assert_eq!(bench.status().last_move.unwrap().outcome, Outcome::Arrived);
    // The path ends but something shakes the reading out of the window again and again.
    bench.controller.command(Command::MoveTo([Pos::from_mm(4.0); 2])).unwrap();
    let mut seen_settling = false;
    for tick in 0..40_000 {
        bench.plant.offset_pm = if tick % 100 < 50 { 2_000_000 } else { -2_000_000 };
        bench.tick();
        seen_settling |= bench.status().state == State::Settling;
        if !bench.status().state.is_busy() {
            break;
        }
    }
    assert!(seen_settling);
    assert_eq!(bench.status().last_move.unwrap().outcome, Outcome::NotArrived);
}

#[test]
fn a_stage_that_trembles_on_the_zero_has_passed_it_once() {
    let mut bench = Bench::plain().homed();
    bench.move_to(0.01, 0.01);
    let crossings = |bench: &Bench| bench.status().axes[0].zero_crossings;
    let before = crossings(&bench);
    bench.move_to(0.0, 0.0);
    for tick in 0..200 {
        bench.plant.offset_pm = if tick % 2 == 0 { 60_000 } else { -60_000 };
        bench.tick();
    }
    assert_eq!(crossings(&bench), before);
    let mut pushed = |um: i64| {
        bench.plant.offset_pm = um * 1_000_000;
        (0..3).for_each(|_| bench.tick());
        crossings(&bench) - before
    };
    assert_eq!([-1, 1, 2, -3].map(&mut pushed), [1, 2, 2, 3]);
}

#[test]
fn busy_holds_from_the_instant_of_the_request() {
    let mut bench = Bench::plain().homed();
    let asked = Command::MoveTo([Pos::from_mm(3.0); 2]);
    let accepted = bench.controller.command(asked).unwrap();
    assert_eq!(bench.status().state, State::Moving);
    assert_eq!(bench.status().move_number, accepted.move_number);
    assert_eq!(bench.controller.command(Command::Home), Err(Refusal::Busy(State::Moving)));
}

#[test]
fn a_relative_move_starts_from_the_target_and_not_from_the_reading() {
    let mut bench = Bench::plain().homed();
    bench.move_to(3.0, 3.0);
    for _ in 0..50 {
        bench.controller.command(Command::MoveBy([Pos::from_um(10.0), Pos::from_um(-7.0)])).unwrap();
        bench.settle();
    }
    let targets = bench.status().axes.map(|axis| axis.target);
    assert_eq!(targets, [Pos::from_mm(3.5), Pos::from_mm(2.65)]);
}

#[test]
fn after_a_stop_the_target_is_the_reading_taken_once() {
    let mut bench = Bench::plain().homed();
    bench.controller.command(Command::MoveTo([Pos::from_mm(9.0); 2])).unwrap();
    for _ in 0..2000 {
        bench.tick();
    }
    bench.controller.command(Command::Stop).unwrap();
    bench.settle();
    let held = bench.status().axes.map(|axis| axis.target);
    assert!(held[0] > Pos::from_mm(0.5) && held[0] < Pos::from_mm(8.5));
    // The reading now wanders inside its noise; the target does not.
    for tick in 0..500 {
        bench.plant.offset_pm = if tick % 2 == 0 { 100_000 } else { 0 };
        bench.tick();
        assert_eq!(bench.status().axes.map(|axis| axis.target), held);
    }
    assert_eq!(bench.status().last_move.unwrap().outcome, Outcome::Stopped);
}

#[test]
fn a_stop_before_the_plan_came_stays_where_it_was() {
    let mut bench = Bench::plain().homed();
    let before = bench.status().axes.map(|axis| axis.reading);
    bench.controller.command(Command::MoveTo([Pos::from_mm(9.0); 2])).unwrap();
    bench.controller.command(Command::Stop).unwrap();
    bench.settle();
    for _ in 0..1000 {
        bench.tick();
    }
    assert_eq!(bench.status().state, State::Ready);
    for (axis, before) in bench.status().axes.iter().zip(before) {
        assert!((axis.reading - before).abs() <= Pos::from_um(0.5));
    }
    bench.move_to(1.0, 1.0);
    assert_eq!(bench.status().last_move.unwrap().outcome, Outcome::Arrived);
}

#[test]
fn a_plan_that_comes_after_the_stop_moves_nothing() {
    let mut bench = Bench::plain().homed();
    let held = bench.status().axes.map(|axis| axis.set_point);
    bench.controller.command(Command::MoveTo([Pos::from_mm(9.0); 2])).unwrap();
    let request = bench.controller.wanted_plan().unwrap();
    bench.controller.command(Command::Stop).unwrap();
    let plan = LinePlan::new(request.from, request.to, &request.limits);
    bench.controller.take_plan(request.number, plan, request.asked_at);
    for _ in 0..5000 {
        bench.tick();
    }
    assert_eq!(bench.status().state, State::Ready);
    for (axis, held) in bench.status().axes.iter().zip(held) {
        assert!((axis.set_point - held).abs() <= Pos::from_um(0.5), "{:?}", axis.set_point);
    }
}

#[test]
fn a_plan_that_never_comes_is_a_fault_and_not_a_wait_for_ever() {
    let mut bench = Bench::plain().homed();
    bench.controller.command(Command::MoveTo([Pos::from_mm(9.0); 2])).unwrap();
    for _ in 0..background::PLAN_MISSING_TICKS + 10 {
        let inputs = bench.plant.step(&bench.outputs);
        bench.outputs = bench.controller.tick(&inputs);
    }
    assert_eq!((bench.status().state, bench.status().fault), (State::Fault, Some(Fault::PlanMissing)));
    assert_eq!(bench.status().last_move.unwrap().outcome, Outcome::Aborted);
    bench.controller.command(Command::Reset).unwrap();
    bench.controller.command(Command::Enable).unwrap();
    bench.move_to(3.0, 3.0);
    assert_eq!(bench.status().last_move.unwrap().outcome, Outcome::Arrived);
}

#[test]
fn an_error_map_renames_the_place_and_does_not_move_the_table() {
    let mut bench = Bench::plain().homed();
    bench.move_to(3.0, 3.0);
    let before = bench.status().axes[0].reading;
    let map = ErrorMap::sample(Pos::from_mm(-5.0), |p| Pos::from_pm(p.pm() / 500)).unwrap();
    bench.controller.set_error_map(0, Some(map)).unwrap();
    for _ in 0..2000 {
        bench.tick();
        assert!((bench.status().axes[0].reading - before).abs() <= Pos::from_um(0.5));
    }
    assert!((bench.status().axes[0].position - Pos::from_mm(3.006)).abs() <= Pos::from_um(1.0));
    bench.move_to(5.0, 3.0);
    // The table is at 5 mm when the scale reads 5 / 1.002.
    assert!((bench.status().axes[0].reading - Pos::from_mm(5.0 / 1.002)).abs() <= Pos::from_um(0.5));
    bench.controller.command(Command::MoveTo([Pos::from_mm(6.0); 2])).unwrap();
    assert_eq!(bench.controller.set_error_map(0, None), Err(Refusal::Busy(State::Moving)));
}

#[test]
fn the_same_inputs_and_commands_give_the_same_outputs() {
    let mut bench = Bench::plain();
    let mut script = Vec::new();
    for tick in 0..60_000u32 {
        let command = match tick {
            10 => Some(Command::Home),
            42_000 => Some(Command::MoveTo([Pos::from_mm(2.0), Pos::from_mm(7.0)])),
            45_000 => Some(Command::Stop),
            50_000 => Some(Command::MoveBy([Pos::from_mm(-0.5); 2])),
            _ => None,
        };
        if let Some(command) = command {
            _ = bench.controller.command(command);
        }
        let inputs = bench.plant.step(&bench.outputs);
        bench.outputs = bench.controller.tick(&inputs);
        background::advance(&mut bench.controller);
        script.push((command, inputs, bench.outputs, bench.status()));
    }
    let mut again = Controller::new(*bench.controller.config());
    again.tick(&Inputs { tick: script[0].1.tick - 1, ..Bench::plain().plant.step(&Outputs::OFF) });
    let mut trace = Fnv::default();
    for (command, inputs, outputs, status) in script {
        if let Some(command) = command {
            _ = again.command(command);
        }
        assert_eq!(again.tick(&inputs), outputs);
        background::advance(&mut again);
        assert_eq!(again.status(), status);
        for axis in outputs.axes {
            let Actuation::Steps(StepRate(rate)) = axis.actuation else { unreachable!() };
            trace.add(&rate.to_le_bytes());
            trace.add(&[u8::from(axis.enable)]);
        }
    }
    // The same on every machine. It changes only when the controller is meant to behave differently.
    assert_eq!(trace.0, GOLDEN, "{:#018x}", trace.0);
}

/// Hash of all outputs of the run above.
const GOLDEN: u64 = 0x8dcf_34c4_0023_0095;

/// FNV-1a, 64 bit.
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

fn any_command() -> impl Strategy<Value = Command<2>> {
    let places =
        prop::array::uniform2(-200_000_000_000i64..200_000_000_000).prop_map(|pm| pm.map(Pos::from_pm));
    prop_oneof![
        Just(Command::Enable),
        Just(Command::Disable),
        Just(Command::Home),
        Just(Command::Stop),
        Just(Command::Reset),
        places.clone().prop_map(Command::MoveTo),
        places.prop_map(Command::MoveBy),
        Just(Command::MoveBy([Pos::from_pm(i64::MAX), Pos::from_pm(i64::MIN)])),
    ]
}

fn any_axis() -> impl Strategy<Value = AxisInputs> {
    let numbers = (any::<u32>(), any::<u16>(), any::<u16>(), any::<Option<u32>>(), any::<i32>());
    (numbers, any::<[bool; 3]>()).prop_map(
        |((counter, illegal, glitches, index, pulses), [low, high, fault])| AxisInputs {
            counter,
            illegal,
            glitches,
            index,
            sin_cos: None,
            pulses,
            limit_low: low,
            limit_high: high,
            drive_fault: fault,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Whatever the sensors show and whoever asks for what: no torque and no pulses unless the state says so, the
    /// rate inside its limit, and a fault is always explained.
    #[test]
    fn nonsense_never_drives_a_motor_that_is_off(
        script in prop::collection::vec(
            (prop::option::weighted(0.2, any_command()), prop::array::uniform2(any_axis()), 0u8..30), 1..80),
        stale in any::<bool>(),
    ) {
        let config = StageSettings::<2>::default().build().unwrap();
        let fastest = config.axes[0].drive.fastest;
        let mut controller = Controller::new(config);
        let (mut tick, mut last) = (u32::MAX - 20, Inputs::<2>::at_rest(0).axes);
        for (command, axes, kind) in script {
            if let Some(command) = command {
                _ = controller.command(command);
            }
            // Most ticks are quiet, or the machine would never leave the fault.
            if kind < 3 && !stale {
                last = axes;
            }
            let mut inputs = Inputs { axes: last, ..Inputs::at_rest(tick) };
            inputs.emergency_stop = kind == 29;
            tick = tick.wrapping_add(if kind == 28 { 2 } else { 1 });
            let outputs = controller.tick(&inputs);
            background::advance(&mut controller);
            let status = controller.status();
            prop_assert_eq!(status.state == State::Fault, status.fault.is_some() && !status.state.is_on());
            for output in outputs.axes {
                let Actuation::Steps(StepRate(rate)) = output.actuation else { unreachable!() };
                prop_assert_eq!(output.enable, status.state.is_on());
                prop_assert!(output.enable || rate == 0);
                prop_assert!(rate.abs() <= fastest);
            }
        }
    }
}
