//! Programs, line after line: whatever stands in them, a line is done or refused with its column, and a refused one has
//! changed nothing.

#![no_main]

use abbe_core::Pos;
use abbe_core::plan::curve;
use abbe_proto::gcode::{
    Action, Arc, Block, Corner, Effect, Error, Fault, Letter, Modes, Move, Number, Path, Place, REACH, Rate,
    State, Turn, interpret, parse, read, slack,
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|program: &[u8]| {
    for skip in [true, false] {
        let mut state = State::new([Pos::ZERO; 2]);
        state.skip_deleted(skip);
        for line in program.split(|byte| *byte == b'\n') {
            look_at(&mut state, line);
        }
    }
});

/// Reads one line; what comes of it, and of the same line written otherwise.
fn look_at(state: &mut State, line: &[u8]) {
    let before = *state;
    let answer = read(state, line);
    match &answer {
        Ok(effect) => {
            assert_effect(&before, state, effect);
            assert_written_again(state);
        }
        Err(error) => {
            assert_eq!(*state, before, "a refused block has changed something");
            assert_shown(line, *error);
        }
    }
    assert_parts(before, line, answer);
    let has_comment_or_checksum = line.iter().any(|byte| b"(;*".contains(byte));
    if !has_comment_or_checksum {
        assert_same(before, &line.to_ascii_lowercase(), answer);
        assert_same(before, &line.to_ascii_uppercase(), answer);
    }
    if !line.ends_with(b"\r") {
        assert_same(before, &[line, b"\n"].concat(), answer);
        assert_same(before, &[line, b"\r\n"].concat(), answer);
    }
}

fn assert_same(mut state: State, line: &[u8], answer: Result<Effect, Error>) {
    assert_eq!(read(&mut state, line), answer, "{}", String::from_utf8_lossy(line));
}

/// Both steps of [`read`] by themselves, twice.
fn assert_parts(before: State, line: &[u8], answer: Result<Effect, Error>) {
    for _ in 0..2 {
        let mut state = before;
        match parse(line) {
            Ok(block) => {
                assert_block(line, &block);
                assert_eq!(interpret(&mut state, &block), answer);
            }
            Err(error) => assert_eq!(Err(error), answer),
        }
    }
}

const LETTERS: [Letter; 9] =
    [Letter::X, Letter::Y, Letter::I, Letter::J, Letter::R, Letter::P, Letter::L, Letter::Q, Letter::F];

/// Each letter is where it is said to be.
fn assert_block(line: &[u8], block: &Block) {
    for letter in LETTERS {
        if let Some(column) = block.column_of(letter) {
            assert_eq!(capital(line, column), Some(letter.letter()));
        }
    }
    assert!(!block.is_end() || !block.is_empty());
}

/// The character in a column of a line, as a capital.
fn capital(line: &[u8], column: u16) -> Option<char> {
    let at = usize::from(column).checked_sub(1)?;
    line.get(at).map(|byte| char::from(byte.to_ascii_uppercase()))
}

/// An error lies in the line, on what it is about, and says what to do.
fn assert_shown(line: &[u8], error: Error) {
    let shown = capital(line, error.column);
    assert!(shown.is_some(), "{error} is beyond {:?}", String::from_utf8_lossy(line));
    assert!(error.to_string().contains("; "), "{error} says not what to do");
    let about = match error.fault {
        Fault::NoNumber(letter)
        | Fault::TooLarge(letter)
        | Fault::NoAxis(letter)
        | Fault::NoSuchLetter(letter)
        | Fault::NoSuchWord(letter, _)
        | Fault::Twice(letter)
        | Fault::Choice { letter, .. }
        | Fault::NotPositive { letter, .. }
        | Fault::Shared(letter)
        | Fault::Unused(letter)
        | Fault::OutOfReach(letter)
        | Fault::Stray(letter) => letter,
        Fault::SameGroup { second, .. } => second.letter,
        Fault::Plane(name) => name.letter,
        Fault::TooFast(_) => 'F',
        Fault::Slash => '/',
        Fault::Percent => '%',
        Fault::Checksum { .. } | Fault::ChecksumForm => '*',
        Fault::Unclosed | Fault::Nested => '(',
        _ => return,
    };
    assert_eq!(shown, Some(about), "{error} in {:?}", String::from_utf8_lossy(line));
}

/// What is to be done begins where the last block ended, ends where the state is, and is all within its bounds.
fn assert_effect(before: &State, state: &State, effect: &Effect) {
    let ends = match effect.action {
        Some(Action::Move(Move { from, to, .. }) | Action::Reference { from, to, .. }) => [from, to],
        _ => [before.position(), before.position()],
    };
    assert_eq!(ends, [before.position(), state.position()]);
    assert!(ends.as_flattened().iter().all(|place| place.abs() <= REACH));
    assert!(state.feed().is_none_or(|feed| feed > Pos::ZERO));
    if let Some(Action::Move(motion)) = effect.action {
        assert_motion(state, &motion);
    }
}

fn assert_motion(state: &State, motion: &Move) {
    match motion.rate {
        Rate::Rapid => assert_eq!(motion.path, Path::Line),
        Rate::PerMinute(feed) => assert!(feed > Pos::ZERO),
        Rate::Inverse(rate) => assert!(rate > Number::default()),
    }
    assert_ne!(motion.corner, Corner::Blend(Some(Pos::ZERO)));
    match motion.path {
        Path::Line => {}
        Path::Arc(arc) => assert_arc(state, motion, &arc),
        Path::Sine(sine) => {
            let phase = sine.phase.billionths() as f64 * 1e-9;
            assert!((0.0..360.0).contains(&phase));
            let [from, to] = [motion.from, motion.to].map(float);
            let amplitude = sine.amplitude.pm() as f64;
            assert!(curve::Sine::new(from, to, amplitude, sine.periods, phase.to_radians()).is_some());
        }
    }
}

/// Its ends are equally far from its centre but for the slack, and the planner takes it.
fn assert_arc(state: &State, motion: &Move, arc: &Arc) {
    let [begins, ends] = [motion.from, motion.to].map(|end| distance(arc.centre, end));
    let limit = slack(Pos::from_pm(begins), state.unit()).pm();
    // A centre that comes of R is rounded to a picometre in x and y.
    assert!((ends - begins).abs() <= limit + 3, "{begins} {ends} {arc:?}");
    assert!((ends - begins - arc.mismatch.pm()).abs() <= 1);
    assert_eq!(arc.full, motion.from == motion.to);
    let [from, to, centre] = [motion.from, motion.to, arc.centre].map(float);
    let planned = curve::Arc::new(from, to, centre, arc.turn == Turn::Counterclockwise);
    assert!(planned.is_some(), "the planner refuses {motion:?}");
}

fn float([x, y]: Place) -> curve::Place {
    [x.pm() as f64, y.pm() as f64]
}

fn distance(from: Place, to: Place) -> i64 {
    let square = |axis: usize| i128::from(to[axis].pm() - from[axis].pm()).pow(2);
    (square(0) + square(1)).isqrt() as i64
}

/// Place and modes, written as a program writes them, are read as the same.
fn assert_written_again(state: &State) {
    let mut again = *state;
    let modes = Modes(state).to_string();
    let (words, feed) = modes.split_once(" F").expect("the feed comes last");
    read(&mut again, words.as_bytes()).expect("modes are words");
    assert_eq!(Modes(&again).to_string(), modes);
    if feed != "0" {
        read(&mut again, format!("G94 F{feed}").as_bytes()).expect("a feed is a number");
        assert!((again.feed().unwrap_or_default() - state.feed().unwrap_or_default()).abs().pm() <= 13);
    }
    let [x, y] = state.position().map(|place| Number::from_billionths(place.pm()));
    let line = format!("G53 G0 G21 X{x} Y{y}");
    let effect = read(&mut again, line.as_bytes()).expect("a place can be gone to");
    assert!(matches!(effect.action, Some(Action::Move(Move { from, to, .. })) if from == to), "{line}");
    assert_eq!(again.position(), state.position());
}
