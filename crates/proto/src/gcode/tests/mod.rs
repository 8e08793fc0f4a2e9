//! The reader as its callers see it.

mod bad;
mod curves;
mod document;
mod good;
mod program;
mod random;

use super::*;
use abbe_core::Pos;

fn mm(mm: f64) -> Pos {
    Pos::from_mm(mm)
}

/// A state after some lines, each of which must be good.
fn after(lines: &[&str]) -> State {
    let mut state = State::new([Pos::ZERO; 2]);
    for line in lines {
        if let Err(error) = read(&mut state, line.as_bytes()) {
            panic!("{line}: {error}");
        }
    }
    state
}

/// Lengths in mm, with as many decimals as they need.
fn place([x, y]: Place) -> String {
    let [x, y] = [x, y].map(|pos| Number::from_billionths(pos.pm()));
    format!("({x}, {y})")
}

fn length(length: Pos) -> String {
    Number::from_billionths(length.pm()).to_string()
}

/// An effect as a sentence, for tables.
fn show(effect: &Effect) -> String {
    let action = effect.action.as_ref().map_or("nothing".into(), show_action);
    match effect.flow {
        None => action,
        Some(Flow::Pause) => format!("{action}, pause"),
        Some(Flow::End) => format!("{action}, end"),
    }
}

fn show_action(action: &Action) -> String {
    match action {
        Action::Dwell { nanoseconds } => format!("dwell {nanoseconds} ns"),
        Action::Move(there) => show_move(there),
        Action::Reference { from, via, to } => {
            format!("reference {} via {} to {}", place(*from), place(*via), place(*to))
        }
        Action::Stored(Stored::Origin { system, origin }) => format!("origin {system} {}", place(*origin)),
        Action::Stored(Stored::Reference { number, place: there }) => {
            format!("reference {number} is {}", place(*there))
        }
        Action::Stored(Stored::Shift(shift)) => format!("shift {}", place(*shift)),
    }
}

fn show_move(there: &Move) -> String {
    let ends = format!("{} to {}", place(there.from), place(there.to));
    let path = match there.path {
        Path::Line => format!("line {ends}"),
        Path::Arc(arc) => {
            let sense = if arc.turn == Turn::Clockwise { "cw" } else { "ccw" };
            let full = if arc.full { "circle" } else { "arc" };
            format!("{full} {sense} {ends} about {}", place(arc.centre))
        }
        Path::Sine(Sine { amplitude, periods, phase }) => {
            format!("sine {ends} {} high {periods} times from {phase}", length(amplitude))
        }
    };
    let rate = match there.rate {
        Rate::Rapid => "rapid".into(),
        Rate::PerMinute(feed) => format!("F{}", length(feed)),
        Rate::Inverse(rate) => format!("{rate}/min"),
    };
    let corner = match there.corner {
        Corner::ExactStop => String::new(),
        Corner::Blend(None) => " blend".into(),
        Corner::Blend(Some(tolerance)) => format!(" blend {}", length(tolerance)),
    };
    format!("{path} {rate}{corner}")
}
