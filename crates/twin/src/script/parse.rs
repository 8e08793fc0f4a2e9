//! From words to steps.

use super::{Expectation, Line, Step, Within};
use crate::Event;
use crate::analogue::{Channel, Dirt, HeadEvent};
use abbe_core::machine::{STATES, State};
use abbe_core::plan::Segment;
use abbe_core::plan::segment::{Feed, Shape};
use abbe_core::sense::health::Grade;
use abbe_core::{Command, Pos};

/// Longest wait and most repetitions of a line: beyond, a unit was mistaken.
const LONGEST_WAIT_S: f64 = 3600.0;
const MOST_TIMES: u32 = 100_000;
/// Places and forces beyond which a unit was mistaken, mm, µm or N.
const LARGEST: f64 = 1e6;
/// More light or gain than any lamp or amplifier gives.
const MOST_GAIN: f64 = 100.0;

/// A line that is not understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {message}")]
pub struct ScriptError {
    /// Its number, from 1.
    pub line: usize,
    /// What is wrong with it.
    pub message: String,
}

/// Reads a script; what stands after `#` is a comment.
///
/// # Errors
/// When a line is not understood, with its number and the word.
pub fn parse(text: &str) -> Result<Vec<Line>, ScriptError> {
    let mut lines = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let number = index + 1;
        let step = step(&words).map_err(|message| ScriptError { line: number, message })?;
        lines.push(Line { number, step });
    }
    Ok(lines)
}

fn step(words: &[&str]) -> Result<Step, String> {
    Ok(match words {
        ["home"] => Step::Do(Command::Home),
        ["enable"] => Step::Do(Command::Enable),
        ["move", "by", x, y] => Step::Do(Command::MoveBy([mm(x)?, mm(y)?])),
        ["move", x, y] => Step::Do(Command::MoveTo([mm(x)?, mm(y)?])),
        ["start", "home"] => Step::Ask(Command::Home),
        ["start", "move", x, y] => Step::Ask(Command::MoveTo([mm(x)?, mm(y)?])),
        ["disable"] => Step::Ask(Command::Disable),
        ["reset"] => Step::Ask(Command::Reset),
        ["stop"] => Step::Ask(Command::Stop),
        ["hold"] => Step::Ask(Command::Hold),
        ["resume"] => Step::Ask(Command::Resume),
        ["feed", "rate", percent] => {
            Step::Ask(Command::FeedRate(whole(percent, u32::from(u16::MAX))? as u16))
        }
        ["line" | "arc" | "sine", ..] => go(words)?,
        ["repeat", times, rest @ ..] if !rest.is_empty() => {
            Step::Repeat(whole(times, MOST_TIMES)?, Box::new(step(rest)?))
        }
        ["settle"] => Step::Settle,
        ["wait", "until", "fault"] => Step::WaitUntilFault,
        ["wait", "until", "rest"] => Step::WaitUntilRest,
        ["wait", seconds] => Step::Wait(seconds_of(seconds)?),
        ["expect", rest @ ..] => Step::Expect(expectation(rest)?),
        _ => Step::Happen(event(words)?),
    })
}

/// A segment of a program; `feed F` and `corner UM` may stand at its end.
fn go(words: &[&str]) -> Result<Step, String> {
    let mut segment = Segment { feed: Feed::RAPID, ..Segment::default() };
    let (mut feed, mut left) = (None, words);
    while let [rest @ .., word @ ("feed" | "corner"), value] = left {
        match *word {
            "feed" => feed = Some(number(value)?),
            _ => segment.tolerance = Pos::from_um(number(value)?),
        }
        left = rest;
    }
    let (x, y) = match *left {
        ["line", x, y] => (x, y),
        ["arc", x, y, "about", cx, cy, turn @ ("cw" | "ccw")] => {
            segment.shape = Shape::Arc { centre: [mm(cx)?, mm(cy)?], counterclockwise: turn == "ccw" };
            (x, y)
        }
        ["sine", x, y, "amplitude", um, "periods", periods] => {
            let amplitude = Pos::from_um(number(um)?);
            segment.shape = Shape::Sine { amplitude, periods: whole(periods, MOST_TIMES)?, phase: 0 };
            (x, y)
        }
        _ => return Err(unknown(words)),
    };
    segment.to = [mm(x)?, mm(y)?];
    Ok(Step::Go(segment, feed))
}

fn event(words: &[&str]) -> Result<Event, String> {
    Ok(match words {
        ["pull", "encoder", name] => Event::Encoder { axis: axis(name)?, connected: false },
        ["plug", "encoder", name] => Event::Encoder { axis: axis(name)?, connected: true },
        ["jam", name] => Event::Jam { axis: axis(name)?, jammed: true },
        ["free", name] => Event::Jam { axis: axis(name)?, jammed: false },
        ["push", name, newton] => Event::Push { axis: axis(name)?, newton: number(newton)? },
        ["shift", "switch", name, um] => Event::MoveSwitch { axis: axis(name)?, um: number(um)? },
        ["break", "switch", name] => Event::LoseSwitch { axis: axis(name)? },
        ["press", "emergency", "stop"] => Event::EmergencyStop { pressed: true },
        ["release", "emergency", "stop"] => Event::EmergencyStop { pressed: false },
        ["drive", "fault", name] => Event::DriveFault { axis: axis(name)?, faulty: true },
        ["drive", "repaired", name] => Event::DriveFault { axis: axis(name)?, faulty: false },
        ["skip", ticks, "ticks"] => Event::SkipTicks { ticks: whole(ticks, MOST_TIMES)? },
        ["host", "falls", "silent"] => Event::HostSilent { silent: true },
        ["host", "speaks"] => Event::HostSilent { silent: false },
        _ => return head_event(words),
    })
}

fn head_event(words: &[&str]) -> Result<Event, String> {
    let (name, event) = match *words {
        ["dirt", name, at, "width", width, "depth", cosine, sine] => {
            (name, HeadEvent::Dirt(dirt([at, width, cosine, sine])?))
        }
        ["clean", name] => (name, HeadEvent::Clean),
        ["light", name, part] => (name, HeadEvent::Light { part: between(part, 0.0, MOST_GAIN)? }),
        ["amplify", name, factor] => (name, HeadEvent::Amplify { factor: between(factor, 0.0, MOST_GAIN)? }),
        ["noise", name, factor] => (name, HeadEvent::Noise { factor: between(factor, 0.0, LARGEST)? }),
        ["stick", "cosine", name] => (name, HeadEvent::Stick { channel: Channel::Cosine }),
        ["stick", "sine", name] => (name, HeadEvent::Stick { channel: Channel::Sine }),
        ["unstick", name] => (name, HeadEvent::Unstick),
        ["lose", ticks, "samples", name] => {
            (name, HeadEvent::LoseSamples { ticks: whole(ticks, MOST_TIMES)? })
        }
        ["chatter", name, part] => (name, HeadEvent::Chatter { part: between(part, 0.0, 1.0)? }),
        _ => return Err(unknown(words)),
    };
    Ok(Event::Head { axis: axis(name)?, event })
}

fn dirt([at, width, cosine, sine]: [&str; 4]) -> Result<Dirt, String> {
    let loss = [between(cosine, 0.0, 1.0)?, between(sine, 0.0, 1.0)?];
    Ok(Dirt { at_mm: number(at)?, width_mm: between(width, 0.001, LARGEST)?, loss })
}

fn expectation(words: &[&str]) -> Result<Expectation, String> {
    Ok(match words {
        ["state", name] => Expectation::State(state(name)?),
        ["fault", fault @ ..] if !fault.is_empty() => Expectation::Fault(fault.join(" ")),
        ["no", "fault"] => Expectation::NoFault,
        ["refused", text @ ..] => Expectation::Refused(text.join(" ")),
        ["accepted"] => Expectation::Accepted,
        ["at", x, y, "within", um, "um"] => Expectation::At([mm(x)?, mm(y)?], within(um)?),
        ["slides", "stopped", "within", limit, "mm"] => {
            Expectation::SlidesStopped(Within(number(limit)? * 1e3))
        }
        ["following", "error", "below", um, "um"] => Expectation::FollowingErrorBelow(within(um)?),
        ["path", "within", um, "um"] => Expectation::PathWithin(within(um)?),
        ["targets", x, y] => Expectation::Targets([mm(x)?, mm(y)?]),
        ["zero", "shift", name, "within", um, "um"] => Expectation::ZeroShift(axis(name)?, within(um)?),
        ["switch", "shift", name, expected, "within", um, "um"] => {
            Expectation::SwitchShift(axis(name)?, number(expected)?, within(um)?)
        }
        ["signals", name, grade] => Expectation::Signals(axis(name)?, self::grade(grade)?),
        ["position", "positive"] => Expectation::PositionPositive,
        _ => return Err(format!("`expect {}` is no expectation", words.join(" "))),
    })
}

/// The words that a line may begin with.
const FIRST: [&str; 38] = [
    "line", "arc", "sine", "hold", "resume", "feed", "home", "enable", "disable", "move", "start", "stop",
    "reset", "wait", "settle", "repeat", "pull", "plug", "jam", "free", "push", "shift", "break", "press",
    "release", "drive", "skip", "host", "expect", "dirt", "clean", "light", "noise", "amplify", "stick",
    "unstick", "lose", "chatter",
];

fn unknown(words: &[&str]) -> String {
    let line = words.join(" ");
    let first = words.first().copied().unwrap_or_default();
    if FIRST.contains(&first) {
        return format!("`{line}`: `{first}` wants other words after it");
    }
    let likeness = |known: &&&str| (strsim::jaro_winkler(first, known) * 1e6) as u64;
    let nearest = FIRST.iter().max_by_key(likeness).copied().unwrap_or_default();
    format!("`{line}`: no line begins with `{first}`; the nearest word is `{nearest}`")
}

fn axis(name: &str) -> Result<usize, String> {
    ["x", "y"].iter().position(|known| *known == name).ok_or_else(|| format!("`{name}` is no axis: x or y"))
}

fn state(name: &str) -> Result<State, String> {
    let found = STATES.into_iter().find(|state| state.to_string() == name);
    found.ok_or_else(|| format!("`{name}` is no state: {}", STATES.map(|state| state.to_string()).join(", ")))
}

fn grade(name: &str) -> Result<Grade, String> {
    let found = [Grade::Good, Grade::Warn, Grade::Fail].into_iter().find(|grade| grade.to_string() == name);
    found.ok_or_else(|| format!("`{name}` is no grade: good, warn or fail"))
}

fn number(word: &str) -> Result<f64, String> {
    let number: f64 = word.parse().map_err(|_| format!("`{word}` is not a number"))?;
    let allowed = number.abs() <= LARGEST;
    allowed.then_some(number).ok_or_else(|| format!("`{word}` is not within ±{LARGEST}"))
}

fn between(word: &str, low: f64, high: f64) -> Result<f64, String> {
    let number = number(word)?;
    let allowed = (low..=high).contains(&number);
    allowed.then_some(number).ok_or_else(|| format!("`{word}` is not within {low} … {high}"))
}

fn whole(word: &str, most: u32) -> Result<u32, String> {
    let fits = word.parse().ok().filter(|number| (1..=most).contains(number));
    fits.ok_or_else(|| format!("`{word}` is not a whole number from 1 to {most}"))
}

fn seconds_of(word: &str) -> Result<f64, String> {
    let seconds = number(word)?;
    let allowed = (0.0..=LONGEST_WAIT_S).contains(&seconds);
    allowed.then_some(seconds).ok_or_else(|| format!("`{word}` s is not within 0 … {LONGEST_WAIT_S} s"))
}

fn mm(word: &str) -> Result<Pos, String> {
    number(word).map(Pos::from_mm)
}

fn within(word: &str) -> Result<Within, String> {
    number(word).map(Within)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_become_steps_with_the_numbers_of_their_lines() {
        let script =
            "# a comment\nhome   # another\n\nrepeat 2 move by 1 -1\nskip 3 ticks\nexpect state ready\n";
        let way = [Pos::from_mm(1.0), Pos::from_mm(-1.0)];
        let steps = [
            (2, Step::Do(Command::Home)),
            (4, Step::Repeat(2, Box::new(Step::Do(Command::MoveBy(way))))),
            (5, Step::Happen(Event::SkipTicks { ticks: 3 })),
            (6, Step::Expect(Expectation::State(State::Ready))),
        ];
        assert_eq!(parse(script), Ok(steps.map(|(number, step)| Line { number, step }).to_vec()));
    }

    #[test]
    fn words_for_a_head_become_events_of_its_axis() {
        let script = "dirt y 40 width 2 depth 0.7 0.5\nstick sine x\nlose 20 samples x\nchatter y 0.4\nlight x 0.5\nnoise x 9\nclean y";
        let dirt = Dirt { at_mm: 40.0, width_mm: 2.0, loss: [0.7, 0.5] };
        let events = [
            (1, HeadEvent::Dirt(dirt)),
            (0, HeadEvent::Stick { channel: Channel::Sine }),
            (0, HeadEvent::LoseSamples { ticks: 20 }),
            (1, HeadEvent::Chatter { part: 0.4 }),
            (0, HeadEvent::Light { part: 0.5 }),
            (0, HeadEvent::Noise { factor: 9.0 }),
            (1, HeadEvent::Clean),
        ];
        let steps: Vec<Step> = parse(script).unwrap().into_iter().map(|line| line.step).collect();
        assert_eq!(steps, events.map(|(axis, event)| Step::Happen(Event::Head { axis, event })));
    }

    #[test]
    fn what_is_not_understood_is_named_with_its_line() {
        for (line, names) in [
            ("hmoe", "`home`"),
            ("move 1", "`move` wants other words"),
            ("move 1 nan", "`nan`"),
            ("move 1 y", "`y` is not a number"),
            ("jam z", "`z` is no axis"),
            ("wait -1", "`-1` s"),
            ("wait 1e5", "3600"),
            ("repeat 0 home", "`0`"),
            ("repeat 3", "`repeat`"),
            ("repeat 3 sing", "`sing`"),
            ("light x -0.1", "`-0.1` is not within 0 … 100"),
            ("noise x -1", "`-1` is not within 0"),
            ("chatter x 1.5", "`1.5` is not within 0 … 1"),
            ("dirt x 40 width 0 depth 1 1", "`0` is not within 0.001"),
            ("dirt x 40 width 2 depth 1.2 1", "`1.2` is not within 0 … 1"),
            ("dirt x 40 2 1 1", "`dirt` wants other words"),
            ("stick x", "`stick` wants other words"),
            ("expect state asleep", "off, homing, ready"),
            ("expect fault", "`expect fault`"),
            ("expect signals x bad", "good, warn or fail"),
            ("expect nothing", "`expect nothing`"),
        ] {
            let error = parse(&format!("home\n{line}")).unwrap_err();
            assert_eq!(error.line, 2, "{line}");
            assert!(error.to_string().contains(names), "{error}");
        }
    }
}
