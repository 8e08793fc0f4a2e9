//! A proof by linking that the controller cannot panic.
//!
//! The panic handler calls `abbe_can_panic`, which exists nowhere. With fat link-time optimisation, a handler that no
//! code reaches disappears together with its call; if a single panic path is left in anything that
//! [`every_public_entry`] calls, the linker stops with `undefined symbol: abbe_can_panic`.
//!
//! Nothing here is ever run.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::hint::black_box;
use core::panic::PanicInfo;

use abbe_core::background::Planner;
use abbe_core::command::axis_name;
use abbe_core::compensate::{ErrorMap, MapError};
use abbe_core::design::StageSettings;
use abbe_core::edge::StepRate;
use abbe_core::front::compare::{Counted, Fired, Places, PlacesError, Sampled, When};
use abbe_core::front::quadrature::{FilterError, filter_for, levels};
use abbe_core::front::{Decode, DecoderWords, QuadratureCounter, Runs, Setup, StepEmitter, emitter};
use abbe_core::machine::{Event, State, transition};
use abbe_core::plan::chords::{Chords, Swing, Wave, WaveError};
use abbe_core::plan::compare::{Arc, Axis, Circle, CircleError, Line, Step, TooFar, Turn};
use abbe_core::plan::corner::Corner;
use abbe_core::plan::curve::{self, Curve};
use abbe_core::plan::elsewhere::turn;
use abbe_core::plan::joint::Joint;
use abbe_core::plan::overlap::Overlap;
use abbe_core::plan::pieces::{Along, Piece};
use abbe_core::plan::program::Program;
use abbe_core::plan::scan::{Lines, Order, Scan, ScanError};
use abbe_core::plan::segment::{Feed, Shape};
use abbe_core::plan::span::Batch;
use abbe_core::plan::steps::{Steps, Stride, Walker};
use abbe_core::plan::transfer::{Infeasible, State as Motion, Transfer, together};
use abbe_core::plan::{Limits, LinePlan, Segment};
use abbe_core::publish::{End, Fault, HomingFailure};
use abbe_core::{Command, Controller, Counts, Inputs, Outputs, Pos, Refusal, background};
use abbe_proto::gcode::{self, Modes};
use abbe_proto::record::{
    Decoder, Encoder, Entry, Event as Recorded, Full, OutputsHash, Replay, SliceSink, apply,
};

/// Calls every public entry of `abbe-core` and `abbe-proto`.
///
/// Every argument goes through [`black_box`], so that no branch can be left out because its input is known; so does
/// every answer, so that no call can be left out because nobody reads it. A new public entry gets its line here.
fn every_public_entry() {
    // One axis is a slave node, two are the stage, three add a focus.
    stage::<1>();
    stage::<2>();
    stage::<3>();
    recorder::<1>();
    recorder::<2>();
    recorder::<3>();
    map();
    point_by_point();
    plans();
    planner();
    front();
    compared();
    words();
    programs();
}

fn stage<const N: usize>() {
    match black_box(StageSettings::<N>::default()).build() {
        Ok(config) => controller(Controller::new(black_box(config))),
        Err(error) => _ = write!(Nowhere, "{}", black_box(error)),
    }
}

fn controller<const N: usize>(mut controller: Controller<N>) {
    while black_box(true) {
        black_box(controller.tick(black_box(&Inputs::at_rest(0))));
        black_box(&controller.command(black_box(Command::MoveTo([Pos::ZERO; N]))));
        black_box(&controller.command_without_floats(black_box(Command::Stop)));
        black_box(controller.status());
        black_box(controller.config());
        black_box(controller.wanted_plan());
        black_box((controller.state(), controller.set_points()));
        asked(&mut controller);
        if let Some(plan) = background::advance(black_box(&mut controller)) {
            background::repeat(black_box(&mut controller), &black_box(plan));
        }
        black_box(&controller.set_error_map(black_box(0), black_box(Some(ErrorMap::NONE))));
        plan(&mut controller);
    }
}

/// What a planner asks for and hands over.
fn asked<const N: usize>(controller: &mut Controller<N>) {
    black_box((controller.program(), controller.segment(black_box(0)), controller.room()));
    if let Some(request) = black_box(controller.wanted_turn()) {
        black_box(&turn(&request.going, &request.to, &request.limits, &request.travel, request.start));
    }
    black_box(controller.take_spans(black_box(&Batch::default())));
}

/// A planner with a memory, for a stage of two axes.
fn planner() {
    let Ok(config) = black_box(StageSettings::<2>::default()).build() else { return };
    let mut controller = Controller::with_planner(config);
    let mut planner = black_box(Planner::default());
    while black_box(true) {
        let shapes = [Shape::Line, Shape::Arc { centre: [Pos::ZERO; 2], counterclockwise: true }];
        for shape in black_box(shapes) {
            let segment = Segment { shape, feed: Feed::from_pm(black_box(1.0)), ..Segment::default() };
            black_box((segment.curve(black_box([Pos::ZERO; 2])), segment.feed.pm()));
            black_box(&controller.command(black_box(Command::Go(segment))));
        }
        black_box(&planner.advance(black_box(&mut controller)));
    }
}

fn plan<const N: usize>(controller: &mut Controller<N>) {
    let limits = black_box(controller.config().axes.map(|axis| axis.limits));
    let plan = LinePlan::new(black_box([Pos::ZERO; N]), black_box([Pos::ZERO; N]), &limits);
    black_box(plan.ticks());
    controller.take_plan(black_box(1), black_box(plan), black_box(2));
}

fn recorder<const N: usize>() {
    let mut memory = black_box([0_u8; 8192]);
    let mut encoder = Encoder::<N, _>::new(SliceSink::new(&mut memory));
    let map = black_box(ErrorMap::NONE);
    while black_box(true) {
        let event = black_box(Recorded::Map { axis: black_box(0), map: Some(&map) });
        black_box(&encoder.event(&event));
        black_box(&encoder.outputs(black_box(&Outputs::OFF)));
        black_box(&encoder.flush());
        black_box(encoder.hash());
        black_box(encoder.sink().written());
    }
    match encoder.finish() {
        Ok(sink) => replay::<N>(black_box(sink.written())),
        Err(full) => _ = write!(Nowhere, "{}{}", black_box(full), black_box(Full)),
    }
}

fn replay<const N: usize>(recording: &[u8]) {
    let Ok(config) = black_box(StageSettings::<N>::default()).build() else { return };
    let mut controller = Controller::new(config);
    let mut decoder = Decoder::<N>::new(recording);
    let mut hash = OutputsHash::of_value(black_box(1));
    while black_box(true) {
        match decoder.next_entry() {
            Ok(Some(Entry::Event(event))) => {
                if let Some(outputs) = apply(&mut controller, &event) {
                    hash.add(&outputs);
                }
            }
            Ok(entry) => _ = black_box(entry),
            Err(error) => _ = write!(Nowhere, "{}", black_box(error)),
        }
        black_box((decoder.at(), hash.value()));
    }
    let mut replay = Replay::<N>::new(recording);
    if let Err(error) = replay.run(&mut controller) {
        _ = write!(Nowhere, "{}", black_box(error));
    }
    black_box((replay.ticks(), replay.proven(), replay.hash()));
}

fn map() {
    let Ok(map) = ErrorMap::sample(black_box(Pos::ZERO), black_box) else { return };
    let map = black_box(map);
    black_box(map.low());
    black_box(map.nodes());
    black_box(map.error_at(black_box(Pos::ZERO)));
    black_box(map.stage_from_scale(black_box(Pos::ZERO)));
    black_box(map.scale_from_stage(black_box(Pos::ZERO)));
}

fn point_by_point() {
    let [from, to] = black_box([[Counts::ZERO; 2]; 2]);
    match Line::new(from, to) {
        Ok(line) => walk(black_box(line), Line::next_step, |line| line.remaining()),
        Err(error) => too_far(&error),
    }
    let circles = [
        Circle::new(from, black_box(Counts::ZERO)),
        Circle::through(from, to),
        Circle::with_square(from, black_box(1)),
    ];
    for circle in black_box(circles) {
        let turn = black_box(Turn::Clockwise);
        match circle.and_then(|circle| Arc::new(&circle, from, to, turn)) {
            Ok(arc) => walk(black_box(arc), Arc::next_step, |arc| arc.remaining()),
            Err(error) => _ = write!(Nowhere, "{}", black_box::<CircleError>(error)),
        }
    }
    let (amplitude, period) = black_box((Counts::ZERO, Counts::ZERO));
    let wave = black_box(Wave { along: Axis::X, amplitude, period, periods: 1, phase: 2 });
    let swing = black_box(Swing { to, amplitude: 1.0, periods: 1, phase: 2 });
    for chords in [Chords::new(&wave, from, black_box(1.0)), Chords::swinging(&swing, from, black_box(1.0))] {
        match chords {
            Ok(chords) => {
                let mut chords = black_box(chords);
                black_box(&chords.next_line());
                black_box((chords.per_period(), chords.remaining(), chords.farthest()));
            }
            Err(error) => _ = write!(Nowhere, "{}", black_box::<WaveError>(error)),
        }
    }
}

fn walk<P>(mut path: P, next: fn(&mut P) -> Option<Step>, remaining: fn(&P) -> u64) {
    while let Some(step) = black_box(next)(&mut path) {
        black_box(black_box(step).from(black_box([Counts::ZERO; 2])));
        black_box(black_box(remaining)(&path));
    }
}

fn plans() {
    let [from, to] = black_box([Motion::default(); 2]);
    let limits = black_box(Limits::default());
    black_box(limits.are_numbers());
    let planned = [Transfer::fastest(from, to, &limits), Transfer::stop(from, &limits)];
    for motion in black_box(planned).into_iter().flatten() {
        black_box((motion.at(black_box(0.0)), motion.ticks(), motion.start(), motion.end(), motion.phases()));
        _ = black_box(motion.lasting(&limits, black_box(0.0)));
        black_box((
            motion.is_forward(black_box(0.0)),
            Transfer::to_speed(from, black_box(1.0), &limits).is_ok(),
        ));
        steps(&motion);
    }
    match together(&black_box([from; 2]), &[to; 2], &[limits; 2]) {
        Ok(motions) => _ = black_box(motions),
        Err((axis, error)) => _ = write!(Nowhere, "{} {}", black_box(axis), black_box::<Infeasible>(error)),
    }
    curves(&limits);
    corners(&limits);
    program(&limits);
    scans(&limits);
}

fn steps(motion: &Transfer) {
    let Some(steps) = black_box(Steps::of(black_box(motion))) else { return };
    black_box(steps.ticks());
    let mut stride = black_box(Stride::default());
    while !black_box(stride.is_at_end()) {
        stride.tick(black_box(&steps));
        black_box((stride.position(), stride.set_point()));
    }
}

fn curves(limits: &Limits) {
    let [from, to, centre] = black_box([[0.0; 2]; 3]);
    let arc = curve::Arc::new(from, to, centre, black_box(true)).map(Curve::Arc);
    let sine = curve::Sine::new(from, to, black_box(1.0), black_box(1), black_box(0.0)).map(Curve::Sine);
    for curve in black_box([Some(Curve::Line { from, to }), arc, sine]).into_iter().flatten() {
        black_box((
            curve.length(),
            curve.bend(),
            curve.spot(black_box(0.0)),
            curve.limits(&[*limits; 2], 1.0),
        ));
        curve.turning_points(&mut |place| _ = black_box(place));
        let Ok(along) = Along::fastest(curve, &[*limits; 2], black_box(1.0)) else { continue };
        black_box(along.ticks());
        for piece in along.pieces() {
            walk_piece(black_box(piece));
        }
    }
}

fn walk_piece(piece: Option<Piece>) {
    for leg in piece.into_iter().flatten() {
        let mut walker = black_box(Walker::default());
        walker.begin(black_box(&leg));
        walker.step();
        black_box((walker.position(), walker.set_point()));
    }
}

fn corners(limits: &Limits) {
    let (places, axes) = black_box(([[0.0; 2]; 3], [*limits; 2]));
    let corner = Corner::fastest(places, &axes, black_box(1.0), black_box(1.0), black_box(1.0));
    black_box((corner.ticks(), corner.reach(), corner.off(), corner.slowed(1.0, |_| black_box(1.0))));
    black_box((corner.pieces(black_box(0.0)), corner.times(black_box(0.0))));
    let [from, at, to] = places;
    let arc = curve::Arc::new(at, to, from, black_box(true)).map(Curve::Arc).unwrap_or_default();
    let line = Curve::Line { from, to: at };
    let joint = Joint::fastest([line, arc], &axes, black_box(1.0), black_box(1.0), black_box(1.0));
    black_box((joint.ticks(), joint.reach(), joint.off()));
    black_box((joint.piece(black_box(0), black_box(0.0)), arc.turning(black_box(0.0))));
    if let Some(overlap) = Overlap::longest(places, &axes, [(1.0, limits); 2], black_box(1.0)) {
        black_box((overlap.ticks(), overlap.reach(), overlap.off(), overlap.before(1.0), overlap.behind()));
        walk_piece(overlap.piece(black_box(0.0)));
    }
}

/// Programs, beside the planner that uses them.
fn program(limits: &Limits) {
    let mut program = Program::new(black_box([Pos::ZERO; 2]), [*limits; 2], black_box(1.0), black_box(0))
        .within(black_box([[Pos::ZERO; 2]; 2]));
    while black_box(program.has_room()) {
        black_box(program.take(black_box(&Segment::default())).is_ok());
        black_box(program.span(black_box(0)).is_ok());
        black_box((program.is_done(), program.is_held(), program.rate(), program.can_change()));
        black_box((program.is_scanning(black_box(1)), program.rest(black_box(1)), program.set_rate(1.0, 1)));
        program.go_on();
    }
}

fn scans(limits: &Limits) {
    for (lines, order) in
        black_box([(Lines::Number(2), Order::Serpentine), (Lines::Pitch(Pos::ZERO), Order::FlyBack)])
    {
        let corners = black_box([[Pos::ZERO; 2]; 2]);
        let scan = black_box(Scan { corners, fast: Axis::X, lines, order, speed: 1.0, settle: 1 });
        let plan = match scan.plan(&[*limits; 2]) {
            Ok(plan) => black_box(plan),
            Err(error) => {
                _ = write!(Nowhere, "{}", black_box::<ScanError>(error));
                continue;
            }
        };
        black_box((plan.ticks(), plan.lines(), plan.start(), plan.end(), plan.room(), plan.extent()));
        black_box(plan.line(black_box(0)));
        if let Err(error) = plan.fits(&corners) {
            _ = write!(Nowhere, "{}", black_box(error));
        }
        for piece in plan.pieces() {
            walk_piece(black_box(piece));
        }
    }
}

fn too_far(error: &TooFar) {
    _ = write!(Nowhere, "{}", black_box(error));
}

/// A place for text that takes all and keeps nothing.
struct Nowhere;

impl Write for Nowhere {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        black_box(text);
        Ok(())
    }
}

/// Everything that writes itself as text.
fn words() {
    black_box(transition(black_box(State::Off), black_box(Event::Enable)));
    black_box(axis_name(black_box(0)));
    let _ = write!(
        Nowhere,
        "{}{}{}{}{}",
        black_box(State::Off),
        black_box(End::Low),
        black_box(HomingFailure::SwitchStuck),
        black_box(axis_name(0)),
        black_box(levels(black_box(3)).0),
    );
    let _ = write!(Nowhere, "{}", black_box(Fault::EmergencyStop));
    let _ = write!(Nowhere, "{}", black_box(Refusal::NotHomed));
    let _ = write!(Nowhere, "{}", black_box(MapError::TooLarge(Pos::ZERO)));
    let _ = write!(Nowhere, "{}", black_box(FilterError { pulse_ns: 3000 }));
}

fn front() {
    let mut decoder = black_box(QuadratureCounter::new(black_box(3), black_box(false), black_box(false)));
    decoder.edge(black_box(1), black_box(true), black_box(false), black_box(true));
    decoder.advance(black_box(2));
    black_box(decoder.read(black_box(3)));
    black_box(QuadratureCounter::decoding(black_box(Decode::X1), black_box(3), black_box(false), true));
    black_box(filter_for(black_box(100)).is_ok());
    if let Some(decode) = Decode::of_counts(black_box(2)) {
        black_box(black_box(Setup { decode, filter: 3 }).filter_at(black_box(10_000_000)));
    }
    let clocks = black_box(emitter::clocks_per_tick(black_box(10_000.0)));
    let mut emitter = black_box(StepEmitter::new(clocks));
    black_box(emitter.clocks_per_tick());
    let train = black_box(emitter.begin_tick(black_box(StepRate(1))));
    black_box(emitter.pulses_at(black_box(2)));
    black_box(train.pulses_until(black_box(3)));
    black_box(train.last());
    let words = black_box(Runs::new(black_box(clocks))).words(black_box(&train));
    black_box(words.as_slice());
    let mut decoder = black_box(DecoderWords::new(black_box(1)));
    black_box(decoder.read(black_box(2), black_box(&[3, 4]), black_box(true)));
}

fn compared() {
    let places = black_box(Places { first: 0, pitch: 1, number: 1, when: When::Both, play: 0 });
    let told = |fired: &Fired| _ = black_box((fired.as_slice(), fired.lost));
    match Counted::new(places, black_box(0), black_box(0)) {
        Ok(counted) => {
            let mut counted = black_box(counted);
            told(&counted.count(black_box(1), black_box(2)));
            let mut decoder = black_box(QuadratureCounter::new(black_box(3), black_box(false), false));
            counted.follow(&mut decoder, black_box(4), told);
            black_box((decoder.due(), decoder.counter()));
        }
        Err(error) => _ = write!(Nowhere, "{}", black_box::<PlacesError>(error)),
    }
    if let Ok(sampled) = Sampled::new(places, black_box(0), black_box(Pos::ZERO)) {
        told(&black_box(sampled).sample(black_box(1), black_box(Pos::ZERO)));
    }
}

fn programs() {
    let mut state = black_box(gcode::State::new(black_box([Pos::ZERO; 2])));
    while black_box(true) {
        match gcode::parse(black_box(b"G1 X1 F1")) {
            Ok(block) => {
                black_box((block.line_number(), block.is_deleted(), block.is_percent(), block.is_empty()));
                black_box(&gcode::interpret(&mut state, black_box(&block)));
            }
            Err(error) => _ = write!(Nowhere, "{}", black_box(error)),
        }
        black_box(&gcode::read(&mut state, black_box(b"G2 X1 R1")));
        _ = write!(Nowhere, "{}", black_box(Modes(&state)));
        black_box((
            state.position(),
            state.origin(),
            state.shift(),
            state.feed(),
            state.corner(),
            state.unit(),
        ));
        black_box((state.in_force(black_box(gcode::Group::Motion)), state.system()));
        black_box((state.origin_of(black_box(0)), state.reference(black_box(0))));
        state.set_position(black_box([Pos::ZERO; 2]));
        state.set_origin(black_box(0), black_box([Pos::ZERO; 2]));
        state.set_reference(black_box(0), black_box([Pos::ZERO; 2]));
        state.skip_deleted(black_box(true));
    }
    let number = black_box(gcode::Number::from_billionths(black_box(1)));
    black_box((number.whole(), number.billionths(), number.length(black_box(gcode::Unit::Inch))));
    black_box(gcode::slack(black_box(Pos::ZERO), black_box(gcode::Unit::Inch)));
    for row in black_box(gcode::TABLE) {
        _ = write!(Nowhere, "{}{}", row.name, row.group.name());
        black_box((gcode::name_of(row.word), row.group.is_modal()));
    }
}

/// Where the image would start.
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> ! {
    loop {
        every_public_entry();
        #[cfg(feature = "known-panic")]
        black_box(black_box([1_u8, 2, 3])[black_box(7_usize)]);
    }
}

unsafe extern "C" {
    /// Defined nowhere: a reference to it fails the link, and that failure is the finding.
    fn abbe_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: an image in which this call is left does not link, so it is never executed.
    unsafe { abbe_can_panic() }
}
