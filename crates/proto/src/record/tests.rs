//! Promises of the format: nothing is lost, little is written, and no bytes whatever make it stumble.

use super::encoder::checksum;
use super::*;
use abbe_core::command::Compare;
use abbe_core::design::StageSettings;
use abbe_core::edge::{Actuation, AxisInputs, AxisOutputs, SinCos, StepRate};
use abbe_core::front::StepEmitter;
use abbe_core::front::compare::{Places, When};
use abbe_core::machine::State;
use abbe_core::plan::compare::Axis;
use abbe_core::plan::scan::{Lines, Order};
use abbe_core::plan::segment::{Feed, Segment, Shape};
use abbe_core::plan::span::{BATCH, Batch, Span, Until};
use abbe_core::plan::steps::Leg;
use abbe_core::{Pos, Status};
use proptest::prelude::*;
use std::convert::Infallible;

// ---- anything that can happen --------------------------------------------------------------------------------------

/// An event that owns its map.
#[derive(Clone, Debug, PartialEq)]
enum Happening<const N: usize> {
    Tick(Inputs<N>),
    Command(Command<N>),
    Plan(u32, u32),
    Refine(usize),
    Spans(Batch<N>),
    Map(usize, Option<Box<ErrorMap>>),
}

impl<const N: usize> Happening<N> {
    fn event(&self) -> Event<'_, N> {
        match self {
            Self::Tick(inputs) => Event::Tick(*inputs),
            Self::Command(command) => Event::Command(*command),
            Self::Refine(axis) => Event::Refine { axis: *axis },
            Self::Spans(batch) => Event::Spans(*batch),
            Self::Plan(number, start) => Event::Plan { number: *number, start: *start },
            Self::Map(axis, map) => Event::Map { axis: *axis, map: map.as_deref() },
        }
    }

    fn of(event: &Event<'_, N>) -> Self {
        match *event {
            Event::Tick(inputs) => Self::Tick(inputs),
            Event::Command(command) => Self::Command(command),
            Event::Refine { axis } => Self::Refine(axis),
            Event::Spans(batch) => Self::Spans(batch),
            Event::Plan { number, start } => Self::Plan(number, start),
            Event::Map { axis, map } => Self::Map(axis, map.map(|map| Box::new(*map))),
        }
    }
}

fn any_axis() -> impl Strategy<Value = AxisInputs> {
    let numbers = (any::<u32>(), any::<u16>(), any::<u16>(), any::<Option<u32>>(), any::<i32>());
    (numbers, any::<[bool; 3]>(), any::<Option<(i16, i16)>>()).prop_map(
        |((counter, illegal, glitches, index, pulses), [limit_low, limit_high, drive_fault], samples)| {
            let sin_cos = samples.map(|(sin, cos)| SinCos { sin, cos });
            AxisInputs {
                counter,
                illegal,
                glitches,
                index,
                sin_cos,
                pulses,
                limit_low,
                limit_high,
                drive_fault,
            }
        },
    )
}

fn any_inputs<const N: usize>() -> impl Strategy<Value = Inputs<N>> {
    let axes = prop::collection::vec(any_axis(), N).prop_map(|axes| axes.try_into().unwrap());
    let shared = (any::<u32>(), any::<[bool; 2]>(), any::<[i16; 2]>(), any::<u8>(), any::<[i32; 2]>());
    (axes, shared, any::<u32>()).prop_map(
        |(axes, (tick, [emergency_stop, trigger], joystick, key_columns, temperatures_mk), heartbeat_age)| {
            Inputs {
                tick,
                axes,
                emergency_stop,
                joystick,
                key_columns,
                trigger,
                temperatures_mk,
                heartbeat_age,
            }
        },
    )
}

fn any_places<const N: usize>() -> impl Strategy<Value = [Pos; N]> {
    prop::collection::vec(any::<i64>().prop_map(Pos::from_pm), N).prop_map(|all| all.try_into().unwrap())
}

fn any_command<const N: usize>() -> impl Strategy<Value = Command<N>> {
    prop_oneof![
        Just(Command::Enable),
        Just(Command::Disable),
        Just(Command::Home),
        Just(Command::Stop),
        Just(Command::Reset),
        any_places().prop_map(Command::MoveTo),
        any_places().prop_map(Command::MoveBy),
        any_segment().prop_map(Command::Go),
        Just(Command::Hold),
        Just(Command::Resume),
        any::<u16>().prop_map(Command::FeedRate),
        prop::option::of(any_compare()).prop_map(Command::Compare),
    ]
}

fn any_compare() -> impl Strategy<Value = Compare> {
    let when = prop_oneof![Just(When::Up), Just(When::Down), Just(When::Both)];
    (0_usize..4, any::<[i64; 3]>(), any::<u32>(), when).prop_map(
        |(axis, [first, pitch, play], number, when)| Compare {
            axis,
            places: Places { first, pitch, number, when, play },
        },
    )
}

fn any_segment() -> impl Strategy<Value = Segment> {
    let shape = (0..5, any_places(), any::<i64>(), any::<u32>(), any::<i64>()).prop_map(
        |(kind, centre, amplitude, periods, phase)| match kind {
            0 => Shape::Line,
            1 => Shape::Arc { centre, counterclockwise: false },
            2 => Shape::Arc { centre, counterclockwise: true },
            3 => Shape::Scan {
                corners: [centre, [Pos::from_pm(amplitude), Pos::from_pm(phase)]],
                fast: if phase % 2 == 0 { Axis::X } else { Axis::Y },
                lines: if phase % 3 == 0 { Lines::Number(periods) } else { Lines::Pitch(centre[0]) },
                order: if phase % 5 == 0 { Order::Serpentine } else { Order::FlyBack },
                settle: periods,
            },
            _ => Shape::Sine { amplitude: Pos::from_pm(amplitude), periods, phase },
        },
    );
    (shape, any_places(), any::<u64>(), any::<i64>()).prop_map(|(shape, to, feed, tolerance)| Segment {
        shape,
        to,
        feed: Feed(feed),
        tolerance: Pos::from_pm(tolerance),
    })
}

fn any_span<const N: usize>() -> impl Strategy<Value = Span<N>> {
    let leg = (any::<u32>(), any::<[i64; 4]>()).prop_map(|(first, differences)| Leg { first, differences });
    let legs = prop::collection::vec(prop::option::of(leg), N).prop_map(|legs| legs.try_into().unwrap());
    (any::<u32>(), any::<Option<u32>>(), legs).prop_map(|(first, until, legs)| Span {
        first,
        until: until.map_or(Until::Rest, Until::Tick),
        legs,
    })
}

fn any_batch<const N: usize>() -> impl Strategy<Value = Batch<N>> {
    let head = (any::<u32>(), any::<u32>(), any::<Option<u32>>(), any::<u8>(), any::<bool>());
    (head, prop::collection::vec(any_span(), 0..=BATCH)).prop_map(
        |((number, revision, cut, took, done), all)| {
            let mut batch = Batch { number, revision, cut, took, done, ..Batch::default() };
            assert!(all.into_iter().all(|span| batch.spans.push(span)));
            batch
        },
    )
}

fn any_map() -> impl Strategy<Value = Box<ErrorMap>> {
    (any::<i64>(), prop::collection::vec(-20_000_000i64..20_000_000, 256)).prop_map(|(low, rises)| {
        let (mut rises, mut error) = (rises.into_iter(), 0i64);
        let map = ErrorMap::sample(Pos::from_pm(low), |_| {
            let next = error + rises.next().unwrap();
            error = if next.abs() <= 1_000_000_000 { next } else { error };
            Pos::from_pm(error)
        });
        Box::new(map.unwrap())
    })
}

/// One step of a script: something new, or the last tick a little later.
#[derive(Clone, Debug)]
enum Step<const N: usize> {
    Anything(Happening<N>),
    Quiet(u8),
    Moves([i8; N]),
    HostSilent(u8),
}

fn any_step<const N: usize>() -> impl Strategy<Value = Step<N>> {
    let moves = prop::collection::vec(any::<i8>(), N).prop_map(|ways| Step::Moves(ways.try_into().unwrap()));
    prop_oneof![
        6 => any_inputs().prop_map(|inputs| Step::Anything(Happening::Tick(inputs))),
        3 => any_command().prop_map(|command| Step::Anything(Happening::Command(command))),
        2 => any::<(u32, u32)>().prop_map(|(n, start)| Step::Anything(Happening::Plan(n, start))),
        2 => any_batch().prop_map(|batch| Step::Anything(Happening::Spans(batch))),
        1 => (0_usize..5).prop_map(|axis| Step::Anything(Happening::Refine(axis))),
        1 => (any::<usize>(), prop::option::of(any_map()))
            .prop_map(|(axis, map)| Step::Anything(Happening::Map(axis, map))),
        4 => any::<u8>().prop_map(Step::Quiet),
        6 => moves,
        2 => any::<u8>().prop_map(Step::HostSilent),
    ]
}

fn told<const N: usize>(steps: Vec<Step<N>>) -> Vec<Happening<N>> {
    let mut told = Vec::new();
    let mut last = Inputs::<N>::at_rest(u32::MAX - 3);
    for step in steps {
        match step {
            Step::Anything(happening) => {
                if let Happening::Tick(inputs) = &happening {
                    last = *inputs;
                }
                told.push(happening);
            }
            Step::Quiet(ticks) => (0..ticks).for_each(|_| told.push(later(&mut last, |_| {}))),
            Step::HostSilent(ticks) => (0..ticks).for_each(|_| {
                told.push(later(&mut last, |now| now.heartbeat_age = now.heartbeat_age.wrapping_add(1)));
            }),
            Step::Moves(ways) => (0..5).for_each(|_| {
                told.push(later(&mut last, |now| {
                    for (axis, way) in now.axes.iter_mut().zip(ways) {
                        axis.counter = axis.counter.wrapping_add_signed(i32::from(way));
                        axis.pulses = axis.pulses.wrapping_add(i32::from(way / 3));
                    }
                }));
            }),
        }
    }
    told
}

fn later<const N: usize>(last: &mut Inputs<N>, change: impl FnOnce(&mut Inputs<N>)) -> Happening<N> {
    last.tick = last.tick.wrapping_add(1);
    change(last);
    Happening::Tick(*last)
}

fn any_run<const N: usize>(longest: usize) -> impl Strategy<Value = Vec<Happening<N>>> {
    prop::collection::vec(any_step(), 0..longest).prop_map(told)
}

// ---- there and back ------------------------------------------------------------------------------------------------

fn written<const N: usize>(run: &[Happening<N>]) -> Vec<Vec<u8>> {
    let mut blocks = Vec::new();
    let mut encoder = Encoder::<N, _>::new(|block: &[u8]| {
        blocks.push(block.to_vec());
        Ok::<(), Infallible>(())
    });
    for happening in run {
        encoder.event(&happening.event()).unwrap();
    }
    _ = encoder.finish().unwrap();
    blocks
}

/// What a recording holds, and how it ends.
fn read<const N: usize>(bytes: &[u8]) -> (Vec<Happening<N>>, Result<(), RecordError>) {
    let mut decoder = Decoder::<N>::new(bytes);
    let mut run = Vec::new();
    loop {
        match decoder.next_entry() {
            Ok(Some(Entry::Event(event))) => run.push(Happening::of(&event)),
            Ok(Some(Entry::Hash(_))) => {}
            Ok(None) => return (run, Ok(())),
            Err(error) => {
                assert!(error.at <= bytes.len());
                assert_eq!(decoder.next_entry(), Ok(None), "nothing comes after an error");
                return (run, Err(error));
            }
        }
    }
}

fn comes_back<const N: usize>(run: &[Happening<N>]) {
    let blocks = written(run);
    assert!(blocks.iter().all(|block| block.len() <= LONGEST_BLOCK));
    let (back, end) = read(&blocks.concat());
    assert_eq!(end, Ok(()));
    assert_eq!(back.len(), run.len());
    for (number, (back, then)) in back.iter().zip(run).enumerate() {
        assert_eq!(back, then, "happening {number}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_run_of_one_axis_comes_back(run in any_run::<1>(60)) {
        comes_back(&run);
    }

    #[test]
    fn every_run_of_two_axes_comes_back(run in any_run::<2>(60)) {
        comes_back(&run);
    }

    #[test]
    fn every_run_of_three_axes_comes_back(run in any_run::<3>(60)) {
        comes_back(&run);
    }

    #[test]
    fn every_block_can_be_read_without_the_ones_before_it(run in any_run::<2>(200)) {
        let blocks = written(&run);
        let mut all = Vec::new();
        for block in &blocks {
            let (part, end) = read::<2>(block);
            prop_assert_eq!(end, Ok(()));
            all.extend(part);
        }
        prop_assert!(all == run);
    }

    // ---- bytes that are no recording ------------------------------------------------------------------------------

    #[test]
    fn random_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 1..200)) {
        prop_assert!(read::<2>(&bytes).1.is_err());
    }

    #[test]
    fn random_entries_under_a_good_checksum_end(
        payload in prop::collection::vec(any::<u8>(), 0..LONGEST_BLOCK - HEAD - 1), opening in 0u8..12,
    ) {
        // Entries that open well go deeper.
        let payload: Vec<u8> =
            payload.into_iter().map(|byte| if byte >= 0xc0 { 0xc0 | (byte % opening.max(1)) } else { byte }).collect();
        let (run, _) = read::<2>(&block_of(&payload));
        prop_assert!(run.len() <= payload.len() * usize::from(entry::LONGEST_RUN));
    }

    #[test]
    fn a_changed_bit_is_found(run in any_run::<2>(20), at in any::<prop::sample::Index>(), bit in 0u8..8) {
        let mut bytes = written(&run).concat();
        let at = at.index(bytes.len());
        bytes[at] ^= 1 << bit;
        let (part, end) = read::<2>(&bytes);
        let error = end.unwrap_err();
        prop_assert!(error.at <= at && at - error.at < LONGEST_BLOCK, "{error}");
        prop_assert!(run.starts_with(&part));
    }

    #[test]
    fn a_recording_that_was_cut_off_says_so(run in any_run::<2>(20), at in any::<prop::sample::Index>()) {
        let blocks = written(&run);
        let bytes = blocks.concat();
        let at = at.index(bytes.len());
        let (part, end) = read::<2>(&bytes[..at]);
        prop_assert!(run.starts_with(&part));
        let mut ends = vec![0];
        ends.extend(blocks.iter().scan(0, |end, block| { *end += block.len(); Some(*end) }));
        if ends.contains(&at) {
            prop_assert_eq!(end, Ok(()), "whole blocks are a recording");
        } else {
            prop_assert_eq!(end.unwrap_err().fault, RecordFault::Truncated);
        }
    }
}

/// A block of entries for two axes with everything right around them.
fn block_of(entries: &[u8]) -> Vec<u8> {
    let payload = [&[FORMAT << 4 | 2], entries].concat();
    let length = (payload.len() as u16).to_le_bytes();
    [&length[..], &checksum(length, &payload).to_le_bytes(), &payload].concat()
}

fn fault_of(entries: &[u8]) -> RecordFault {
    read::<2>(&block_of(entries)).1.unwrap_err().fault
}

#[test]
fn what_is_wrong_with_an_entry_is_named() {
    assert_eq!(fault_of(&[0xff]), RecordFault::Entry(0xff));
    assert_eq!(fault_of(&[entry::MOVE_TO, 0x80]), RecordFault::Cut);
    assert_eq!(fault_of(&[entry::HASH, 1, 2, 3]), RecordFault::Cut);
    // Ten bytes that go on, and a number of more than 64 bit.
    assert_eq!(fault_of(&[&[entry::MOVE_TO][..], &[0xff; 11]].concat()), RecordFault::Number);
    // A number of 33 bit for the number of a move.
    assert_eq!(fault_of(&[entry::PLAN, 0xff, 0xff, 0xff, 0xff, 0x1f]), RecordFault::Number);
    // A map that jumps by 1.1 mm from node to node.
    let jump = [0x80, 0xac, 0x85, 0x99, 0x08];
    let map = [&[entry::MAP, 0, 0][..], &jump.repeat(256)].concat();
    assert!(matches!(fault_of(&map), RecordFault::Map(_)), "{}", fault_of(&map));
}

#[test]
fn another_format_and_another_stage_are_told_from_an_altered_block() {
    let one_axis = written::<1>(&[Happening::Command(Command::Home)]).concat();
    let fault = read::<2>(&one_axis).1.unwrap_err().fault;
    assert_eq!(fault, RecordFault::Axes { recorded: 1, here: 2 });
    let payload = [(FORMAT + 1) << 4 | 2];
    let length = 1u16.to_le_bytes();
    let later = [&length[..], &checksum(length, &payload).to_le_bytes(), &payload].concat();
    assert_eq!(
        read::<2>(&later).1.unwrap_err(),
        RecordError { at: 0, fault: RecordFault::Format(FORMAT + 1) }
    );
    assert_eq!(read::<2>(&[0, 0, 0, 0, 0, 0]).1.unwrap_err().fault, RecordFault::Length(0));
    assert_eq!(read::<2>(&[0xff; 9]).1.unwrap_err().fault, RecordFault::Length(0xffff));
}

// ---- how much is written -------------------------------------------------------------------------------------------

fn bytes_of(ticks: u32, change: impl Fn(&mut Inputs<2>)) -> usize {
    let mut last = Inputs::at_rest(0);
    let run: Vec<_> = (0..ticks).map(|_| later(&mut last, &change)).collect();
    written(&run).concat().len()
}

#[test]
fn a_quiet_stage_costs_a_byte_every_64_ticks() {
    assert!(bytes_of(64_000, |_| {}) < 1_050);
    let silent = bytes_of(64_000, |now| now.heartbeat_age = now.heartbeat_age.wrapping_add(1));
    assert!(silent < 1_050, "a host that says nothing costs {silent}");
}

#[test]
fn a_moving_stage_costs_five_bytes_a_tick() {
    let moving = bytes_of(10_000, |now| {
        for axis in &mut now.axes {
            axis.counter = axis.counter.wrapping_add_signed(-20);
            axis.pulses += 6;
        }
    });
    assert!(moving <= 50_300, "{moving}");
}

#[test]
fn the_longest_tick_finds_room() {
    let axis = AxisInputs {
        counter: 1 << 31,
        illegal: u16::MAX,
        glitches: u16::MAX,
        index: Some(0),
        sin_cos: Some(SinCos { sin: i16::MIN, cos: i16::MIN }),
        pulses: i32::MIN,
        limit_low: true,
        limit_high: true,
        drive_fault: true,
    };
    let far = Inputs::<3> {
        tick: 1 << 31,
        axes: [axis; 3],
        emergency_stop: true,
        joystick: [i16::MIN; 2],
        key_columns: 0xff,
        trigger: true,
        temperatures_mk: [i32::MIN; 2],
        heartbeat_age: 1 << 31,
    };
    let bytes = written(&[Happening::Tick(far)]).concat().len();
    let (head, hash) = (HEAD + 1, 9);
    assert_eq!(bytes - head - hash, 114);
    // The same, there and back again, fills blocks to their ends.
    let run: Vec<_> = (0..500)
        .map(|number| Happening::Tick(if number % 2 == 0 { far } else { Inputs::at_rest(number) }))
        .collect();
    comes_back(&run);
}

#[test]
fn memory_that_is_too_short_is_said_to_be() {
    let mut memory = [0; 40];
    let mut encoder = Encoder::<2, _>::new(SliceSink::new(&mut memory));
    encoder.event(&Event::Command(Command::Home)).unwrap();
    encoder.flush().unwrap();
    assert_eq!(encoder.sink().written().len(), HEAD + 1 + 1 + 9);
    encoder.event(&Event::Command(Command::MoveTo([Pos::from_mm(50.0); 2]))).unwrap();
    assert_eq!(encoder.finish().err(), Some(Full));
}

// ---- a run that happens again --------------------------------------------------------------------------------------

const STEP_PM: i64 = 312_500;
const COUNT_PM: i64 = 100_000;

/// Clocks in a tick.
const CLOCKS: u32 = 12_500;

/// Two slides that follow their pulses exactly, 2 mm above their marks.
struct Slides {
    tick: u32,
    emitters: [StepEmitter; 2],
}

impl Slides {
    fn new() -> Self {
        Self { tick: 0, emitters: [StepEmitter::new(CLOCKS); 2] }
    }

    fn step(&mut self, outputs: &Outputs<2>) -> Inputs<2> {
        self.tick += 1;
        let mut inputs = Inputs::at_rest(self.tick);
        for ((axis, emitter), output) in inputs.axes.iter_mut().zip(&mut self.emitters).zip(&outputs.axes) {
            let place =
                |emitter: &StepEmitter| 2_000_000_000 + i64::from(emitter.pulses_at(CLOCKS)) * STEP_PM;
            let before = place(emitter);
            if let Actuation::Steps(rate) = output.actuation {
                emitter.begin_tick(rate);
            }
            let now = place(emitter);
            axis.counter = now.div_euclid(COUNT_PM) as u32;
            axis.pulses = emitter.pulses_at(CLOCKS);
            axis.index = (before < 0 && now >= 0).then_some(0);
            axis.limit_low = now < -1_000_000_000;
        }
        inputs
    }
}

fn controller() -> Controller<2> {
    Controller::with_planner(StageSettings::default().build().unwrap())
}

/// Homes, maps, moves, is asked nonsense, stops and meets a fault, with a recorder beside it.
fn recorded_run() -> (Vec<u8>, Status<2>, u32) {
    let (mut slides, mut controller, mut outputs) = (Slides::new(), controller(), Outputs::OFF);
    let mut planner = background::Planner::default();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::<2, _>::new(|block: &[u8]| {
        bytes.extend_from_slice(block);
        Ok::<(), Infallible>(())
    });
    let map = ErrorMap::sample(Pos::from_mm(-5.0), |p| Pos::from_pm(p.pm() / 500)).unwrap();
    let ticks = 72_500;
    for tick in 0..ticks {
        let asked = match tick {
            10 | 45_200 => Some(Event::Command(Command::Home)),
            45_000 => Some(Event::Map { axis: 1, map: Some(&map) }),
            45_010 => Some(Event::Command(Command::MoveTo([Pos::from_mm(3.0), Pos::from_mm(7.0)]))),
            45_100 => Some(Event::Command(Command::MoveTo([Pos::from_mm(1.0); 2]))),
            55_000 => Some(Event::Command(Command::Go(Segment {
                to: [Pos::from_mm(2.0); 2],
                feed: Feed::RAPID,
                ..Segment::default()
            }))),
            65_000 | 70_000 => Some(Event::Command(Command::MoveBy([Pos::from_mm(9.0), Pos::from_mm(-1.0)]))),
            67_000 => Some(Event::Command(Command::Stop)),
            _ => None,
        };
        if let Some(event) = asked {
            assert_eq!(apply(&mut controller, &event), None);
            encoder.event(&event).unwrap();
        }
        let mut inputs = slides.step(&outputs);
        inputs.emergency_stop = tick > 72_000;
        encoder.event(&Event::Tick(inputs)).unwrap();
        outputs = controller.tick(&inputs);
        encoder.outputs(&outputs).unwrap();
        while let Some(plan) = planner.advance(&mut controller) {
            encoder.event(&plan.into()).unwrap();
        }
    }
    _ = encoder.finish().unwrap();
    (bytes, controller.status(), ticks)
}

#[test]
fn a_replay_ends_where_the_run_did_and_proves_every_tick() {
    let (bytes, status, ticks) = recorded_run();
    assert_eq!((status.state, status.move_number), (State::Fault, 5), "the run went as far as it should");
    let mut again = controller();
    let mut replay = Replay::new(&bytes);
    let (mut plans, mut refused, mut proofs) = (0, 0, 0);
    while let Some(played) = replay.step(&mut again).unwrap() {
        match played {
            Played::Background => plans += 1,
            Played::Command(_, answer) => refused += u32::from(answer.is_err()),
            Played::Proven => proofs += 1,
            Played::Tick(_) | Played::Map(_) => {}
        }
    }
    assert_eq!((replay.ticks(), replay.proven()), (ticks, ticks));
    assert_eq!((plans, refused, proofs), (9, 1, ticks / HASH_TICKS + 1));
    assert_eq!(again.status(), status);
}

#[test]
fn another_controller_is_found_out_within_a_thousand_ticks_of_where_it_differs() {
    let (bytes, ..) = recorded_run();
    let mut settings = StageSettings::<2>::default();
    settings.axes[1].kp_per_s *= 1.001;
    let mut other = Controller::with_planner(settings.build().unwrap());
    let error = Replay::new(&bytes).run(&mut other).unwrap_err();
    let ReplayError::Differs { same, within } = error else { panic!("{error}") };
    assert_eq!((same, within), (0, HASH_TICKS), "it homes otherwise from the first thousand on");
    let mut unmapped = controller();
    let mut replay = Replay::new(&bytes);
    let error = loop {
        match replay.step(&mut unmapped) {
            Ok(Some(Played::Map(axis))) => unmapped.set_error_map(axis, None).unwrap(),
            Ok(played) => assert_ne!(played, None, "the map makes no difference"),
            Err(error) => break error,
        }
    };
    assert_eq!(error, ReplayError::Differs { same: 45_000, within: HASH_TICKS });
}

// ---- the hash ------------------------------------------------------------------------------------------------------

fn hash_of(outputs: &Outputs<2>) -> u64 {
    let mut hash = OutputsHash::EMPTY;
    hash.add(outputs);
    hash.value()
}

#[test]
fn every_field_of_the_outputs_changes_the_hash() {
    let axis = |change: fn(&mut AxisOutputs)| {
        let mut outputs = Outputs::<2>::OFF;
        change(&mut outputs.axes[1]);
        outputs
    };
    let others = [
        axis(|axis| axis.actuation = Actuation::Steps(StepRate(1))),
        axis(|axis| axis.actuation = Actuation::Steps(StepRate(i32::MIN))),
        axis(|axis| axis.actuation = Actuation::Pwm(0)),
        axis(|axis| axis.actuation = Actuation::Pwm(1)),
        axis(|axis| axis.piezo = 1),
        axis(|axis| axis.enable = true),
        Outputs { compare: Some(0), ..Outputs::OFF },
        Outputs { compare: Some(1), ..Outputs::OFF },
        Outputs { trigger: true, ..Outputs::OFF },
        Outputs { key_row: 1, ..Outputs::OFF },
        Outputs { display: 1, ..Outputs::OFF },
        Outputs { lamp: true, ..Outputs::OFF },
        Outputs::OFF,
    ];
    let mut hashes: Vec<u64> = others.iter().map(hash_of).collect();
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), others.len());
    // The same on every machine and in every version of the program.
    assert_eq!(hash_of(&Outputs::OFF), 0xd7e4_fcfa_299d_713d);
}
