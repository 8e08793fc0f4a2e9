//! Plain words on a serial line: what a person types into a terminal to try a board.
//!
//! A request is a line of ASCII, ended by CR, LF or both; an answer is one line, ended by CR LF. Lengths are mm.
//!
//! | request | does | answer |
//! |---|---|---|
//! | `home` | finds the zero of both axes | `ok` |
//! | `move X Y` | goes to a place | `ok move N` |
//! | `by X Y` | goes a distance from the last target | `ok move N` |
//! | `stop` | brakes on the path | `ok` |
//! | `on`, `off` | drives on and holding; drives off | `ok` |
//! | `reset` | leaves a fault | `ok` |
//! | `status` | changes nothing | see [`StatusLine`] |
//! | `help` | changes nothing | the words above |
//!
//! Whatever is wrong is answered by `error: ` and a sentence. Garbage is a wrong line and nothing more: the next line
//! is read as if nothing had been.

use abbe_core::command::Command;
use abbe_core::publish::{Outcome, Status};
use abbe_core::units::{InMm, InUm};
use abbe_core::{Accepted, Pos, Refusal};
use core::fmt;

/// Longest request, bytes.
pub const LONGEST: usize = 64;

/// Longest answer, bytes, without its line end (`no_answer_is_longer_than_said`).
pub const LONGEST_ANSWER: usize = 400;

/// What a line asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Something for the controller.
    Command(Command<2>),
    /// The snapshot.
    Status,
    /// The words.
    Help,
}

/// Why a line is no request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mistake {
    /// Longer than [`LONGEST`].
    TooLong,
    /// Holds a byte that is no printable ASCII.
    NotText,
    /// Begins with a word that means nothing.
    UnknownWord,
    /// A place needs two numbers.
    TwoNumbers,
    /// A number that is none, or has more than nine decimals, or is beyond ±1000 mm.
    NotANumber,
    /// Words behind a whole request.
    Surplus,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooLong => "the line is longer than 64 characters",
            Self::NotText => "the line holds something that is no text",
            Self::UnknownWord => "unknown word; help lists them",
            Self::TwoNumbers => "two numbers are needed, x and y in mm",
            Self::NotANumber => "not a number of mm within 1000, with nine decimals at most",
            Self::Surplus => "more words than the request takes",
        })
    }
}

impl core::error::Error for Mistake {}

/// The words, for `help`.
pub const HELP: &str = "home | move X Y | by X Y | stop | on | off | reset | status | help (X, Y in mm)";

/// Reads a line, without its end. An empty line asks for nothing.
///
/// # Errors
/// Says what is wrong with it.
pub fn parse(line: &[u8]) -> Result<Option<Request>, Mistake> {
    if line.iter().any(|byte| !(byte.is_ascii_graphic() || byte.is_ascii_whitespace())) {
        return Err(Mistake::NotText);
    }
    let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let Some(word) = words.next() else {
        return Ok(None);
    };
    let request = match word {
        b"home" => Request::Command(Command::Home),
        b"move" => Request::Command(Command::MoveTo(place(&mut words)?)),
        b"by" => Request::Command(Command::MoveBy(place(&mut words)?)),
        b"stop" => Request::Command(Command::Stop),
        b"on" => Request::Command(Command::Enable),
        b"off" => Request::Command(Command::Disable),
        b"reset" => Request::Command(Command::Reset),
        b"status" => Request::Status,
        b"help" => Request::Help,
        _ => return Err(Mistake::UnknownWord),
    };
    if words.next().is_some() { Err(Mistake::Surplus) } else { Ok(Some(request)) }
}

fn place<'a>(words: &mut impl Iterator<Item = &'a [u8]>) -> Result<[Pos; 2], Mistake> {
    let mut number = || words.next().ok_or(Mistake::TwoNumbers).and_then(millimetres);
    Ok([number()?, number()?])
}

/// A decimal number of mm, exactly: picometres are its ninth decimal.
fn millimetres(word: &[u8]) -> Result<Pos, Mistake> {
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, word),
    };
    let mut parts = digits.splitn(2, |&byte| byte == b'.');
    let whole = parts.next().unwrap_or_default();
    let decimals = parts.next().unwrap_or_default();
    if (whole.is_empty() && decimals.is_empty()) || whole.len() > 4 || decimals.len() > 9 {
        return Err(Mistake::NotANumber);
    }
    let mut pm: i64 = 0;
    let padding = core::iter::repeat_n(&b'0', 9_usize.saturating_sub(decimals.len()));
    for &digit in whole.iter().chain(decimals).chain(padding) {
        let value = digit.wrapping_sub(b'0');
        if value > 9 {
            return Err(Mistake::NotANumber);
        }
        pm = pm.saturating_mul(10).saturating_add(i64::from(value));
    }
    if pm > 1_000_000_000_000 {
        return Err(Mistake::NotANumber);
    }
    Ok(Pos::from_pm(if negative { pm.saturating_neg() } else { pm }))
}

/// Collects bytes into lines.
#[derive(Clone, Copy, Debug)]
pub struct Lines {
    bytes: [u8; LONGEST],
    length: usize,
    /// Bytes of this line did not fit, or were lost before they came here.
    spoilt: Option<Mistake>,
}

impl Default for Lines {
    fn default() -> Self {
        Self { bytes: [0; LONGEST], length: 0, spoilt: None }
    }
}

impl Lines {
    /// Takes one byte; a line that it ends is handed to `take`, or what is wrong with it.
    pub fn push(&mut self, byte: u8, mut take: impl FnMut(Result<&[u8], Mistake>)) {
        if byte != b'\n' && byte != b'\r' {
            match self.bytes.get_mut(self.length) {
                Some(place) => {
                    *place = byte;
                    self.length = self.length.saturating_add(1);
                }
                None => self.spoilt = self.spoilt.or(Some(Mistake::TooLong)),
            }
            return;
        }
        match self.spoilt.take() {
            Some(mistake) => take(Err(mistake)),
            None => take(Ok(self.bytes.get(..self.length).unwrap_or_default())),
        }
        self.length = 0;
    }

    /// A byte of this line was lost on the way: the whole line is, too.
    pub fn spoil(&mut self) {
        self.spoilt = self.spoilt.or(Some(Mistake::NotText));
    }
}

/// An answer, without its line end.
#[derive(Clone, Copy, Debug)]
pub enum Answer<'a> {
    /// The controller took the request, or did not.
    Command(Result<Accepted, Refusal>, &'a Command<2>),
    /// The line was no request.
    Mistake(Mistake),
    /// The snapshot.
    Status(StatusLine<'a>),
    /// The words.
    Help,
    /// No tick has answered: it has stalled.
    NoTick,
}

impl fmt::Display for Answer<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Command(Ok(accepted), Command::MoveTo(_) | Command::MoveBy(_)) => {
                f.write_str("ok move ")?;
                fmt::Display::fmt(&accepted.move_number, f)
            }
            Self::Command(Ok(_), _) => f.write_str("ok"),
            Self::Command(Err(refusal), _) => {
                f.write_str("error: ")?;
                fmt::Display::fmt(refusal, f)
            }
            Self::Mistake(mistake) => {
                f.write_str("error: ")?;
                fmt::Display::fmt(mistake, f)
            }
            Self::Status(line) => fmt::Display::fmt(line, f),
            Self::Help => f.write_str(HELP),
            Self::NoTick => f.write_str(
                "error: the tick has stalled and the drives are off; the board starts anew by itself",
            ),
        }
    }
}

/// A snapshot in one line:
/// `ready x 3.000000 y 4.000000 error 0.1 -0.1 um homed xy limits - move 2 arrived tick 12345`, and behind it, when
/// there is something to say, `fault` or `board` with a sentence.
#[derive(Clone, Copy, Debug)]
pub struct StatusLine<'a> {
    /// The snapshot.
    pub status: &'a Status<2>,
    /// What the board itself has to say, or nothing.
    pub board: &'a str,
}

impl fmt::Display for StatusLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let status = self.status;
        let [x, y] = &status.axes;
        write!(f, "{} x {} y {}", status.state, InMm(x.position), InMm(y.position))?;
        write!(f, " error {} {} um homed ", InUm(x.following_error), InUm(y.following_error))?;
        letters(f, [(x.homed, "x"), (y.homed, "y")])?;
        f.write_str(" limits ")?;
        let limits = [(x.limit_low, "x-"), (x.limit_high, "x+"), (y.limit_low, "y-"), (y.limit_high, "y+")];
        letters(f, limits)?;
        write!(f, " move {} {}", status.move_number, outcome(status))?;
        write!(f, " tick {}", status.tick)?;
        if let Some(fault) = &status.fault {
            write!(f, " fault {fault}")?;
        }
        if !self.board.is_empty() {
            write!(f, " board {}", self.board)?;
        }
        Ok(())
    }
}

fn outcome(status: &Status<2>) -> &'static str {
    match status.last_move {
        Some(last) if last.number == status.move_number => match last.outcome {
            Outcome::Arrived => "arrived",
            Outcome::NotArrived => "not-arrived",
            Outcome::Stopped => "stopped",
            Outcome::Replaced => "replaced",
            Outcome::Aborted => "aborted",
        },
        _ if status.move_number == 0 => "none",
        _ => "under-way",
    }
}

/// The words of what is true, or a dash.
fn letters<const N: usize>(f: &mut fmt::Formatter<'_>, flags: [(bool, &str); N]) -> fmt::Result {
    if !flags.iter().any(|(set, _)| *set) {
        return f.write_str("-");
    }
    flags.iter().filter(|(set, _)| *set).try_for_each(|(_, word)| f.write_str(word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use abbe_core::publish::{End, Fault, HomingFailure};
    use proptest::prelude::*;

    fn command(line: &str) -> Result<Option<Request>, Mistake> {
        parse(line.as_bytes())
    }

    #[test]
    fn every_word_is_understood() {
        let pm = |x, y| [Pos::from_pm(x), Pos::from_pm(y)];
        let cases = [
            ("home", Command::Home),
            ("  move 1 -2.5 ", Command::MoveTo(pm(1_000_000_000, -2_500_000_000))),
            ("by +.000000001 0.", Command::MoveBy(pm(1, 0))),
            ("stop", Command::Stop),
            ("on", Command::Enable),
            ("off", Command::Disable),
            ("reset", Command::Reset),
        ];
        for (line, expected) in cases {
            assert_eq!(command(line), Ok(Some(Request::Command(expected))), "{line}");
        }
        assert_eq!(command("status"), Ok(Some(Request::Status)));
        assert_eq!(command("help"), Ok(Some(Request::Help)));
        assert_eq!(command(" \t"), Ok(None));
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (line, mistake) in [
            ("hime", Mistake::UnknownWord),
            ("HOME", Mistake::UnknownWord),
            ("move", Mistake::TwoNumbers),
            ("move 1", Mistake::TwoNumbers),
            ("move 1 2 3", Mistake::Surplus),
            ("home now", Mistake::Surplus),
            ("move 1 two", Mistake::NotANumber),
            ("move 1 1e3", Mistake::NotANumber),
            ("move 1 --2", Mistake::NotANumber),
            ("move 1 .", Mistake::NotANumber),
            ("move 1 0.0000000001", Mistake::NotANumber),
            ("move 1000.000000001 0", Mistake::NotANumber),
            ("move 99999999999999999999 0", Mistake::NotANumber),
            ("home\u{7}", Mistake::NotText),
            ("höme", Mistake::NotText),
        ] {
            assert_eq!(command(line), Err(mistake), "{line}");
        }
        assert!(command("move -1000 1000").is_ok());
    }

    fn lines(bytes: &[u8]) -> Vec<Result<Vec<u8>, Mistake>> {
        let (mut lines, mut seen) = (Lines::default(), Vec::new());
        for &byte in bytes {
            lines.push(byte, |line| seen.push(line.map(<[u8]>::to_vec)));
        }
        seen
    }

    #[test]
    fn a_line_too_long_spoils_itself_only() {
        let mut bytes = vec![b'x'; 65];
        bytes.extend_from_slice(b"\nhome\r");
        assert_eq!(lines(&bytes), [Err(Mistake::TooLong), Ok(b"home".to_vec())]);
        assert_eq!(
            lines(&[b'x'; 64].iter().copied().chain(*b"\n").collect::<Vec<_>>())[0].as_ref().unwrap().len(),
            64
        );
    }

    #[test]
    fn a_byte_that_was_lost_spoils_its_line_only() {
        let (mut lines, mut seen) = (Lines::default(), Vec::new());
        lines.spoil();
        for &byte in b"ome\nhome\n" {
            lines.push(byte, |line| seen.push(line.map(<[u8]>::to_vec)));
        }
        assert_eq!(seen, [Err(Mistake::NotText), Ok(b"home".to_vec())]);
    }

    #[test]
    fn no_answer_is_longer_than_said() {
        let far = Pos::from_pm(i64::MIN);
        let faults = [
            Fault::EmergencyStop,
            Fault::TickOverrun { missed: u32::MAX },
            Fault::HostGone,
            Fault::PlanMissing,
            Fault::DriveFault { axis: 0 },
            Fault::LimitSwitch { axis: 0, end: End::High },
            Fault::SoftLimit { axis: 0, position: far },
            Fault::FollowingError { axis: 0, error: far },
            Fault::EncoderLost { axis: 0 },
            Fault::EncoderIllegal { axis: 0, transitions: u16::MAX },
            Fault::Stall { axis: 0 },
            Fault::Homing { axis: 0, failure: HomingFailure::SwitchNotFound },
            Fault::Homing { axis: 0, failure: HomingFailure::SwitchStuck },
            Fault::Homing { axis: 0, failure: HomingFailure::IndexNotFound },
        ];
        let config = abbe_core::design::StageSettings::<2>::default().build().unwrap();
        let mut status = abbe_core::Controller::new(config).status();
        status.tick = u32::MAX;
        status.move_number = u32::MAX;
        status.state = abbe_core::machine::State::Settling;
        for axis in &mut status.axes {
            axis.position = far;
            axis.following_error = far;
            (axis.homed, axis.limit_low, axis.limit_high) = (true, true, true);
        }
        // As long as the longest note of a board.
        let board = "the tick stalled and the drives were switched off";
        for fault in faults {
            status.fault = Some(fault);
            let line = Answer::Status(StatusLine { status: &status, board }).to_string();
            assert!(line.len() <= LONGEST_ANSWER, "{} {line}", line.len());
            let refused = Answer::Command(Err(Refusal::InFault(fault)), &Command::Home).to_string();
            assert!(refused.len() <= LONGEST_ANSWER);
        }
        let refusal = Refusal::OutOfTravel { axis: 0, asked: far, low: far, high: far };
        assert!(Answer::Command(Err(refusal), &Command::Home).to_string().len() <= LONGEST_ANSWER);
    }

    proptest! {
        #[test]
        fn any_bytes_are_lines_and_the_next_line_is_read(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let mut all = bytes;
            all.extend_from_slice(b"\nstatus\n");
            let seen = lines(&all);
            for line in seen.iter().flatten() {
                _ = parse(line);
            }
            prop_assert_eq!(parse(seen.last().unwrap().as_ref().unwrap()), Ok(Some(Request::Status)));
        }

        #[test]
        fn numbers_are_exact(pm in -1_000_000_000_000i64..=1_000_000_000_000) {
            let sign = if pm < 0 { "-" } else { "" };
            let text = format!("{sign}{}.{:09}", pm.abs() / 1_000_000_000, pm.abs() % 1_000_000_000);
            prop_assert_eq!(millimetres(text.as_bytes()), Ok(Pos::from_pm(pm)));
        }
    }

    #[test]
    fn a_status_is_one_line() {
        let config = abbe_core::design::StageSettings::<2>::default().build().unwrap();
        let mut controller = abbe_core::Controller::new(config);
        let mut inputs = abbe_core::Inputs::at_rest(7);
        inputs.emergency_stop = true;
        inputs.axes[1].limit_low = true;
        for _ in 0..5 {
            controller.tick(&inputs);
            inputs.tick += 1;
        }
        let status = controller.status();
        let line = StatusLine { status: &status, board: "" }.to_string();
        assert_eq!(
            line,
            "fault x 0.000000 y 0.000000 error 0.0 0.0 um homed - limits y- move 0 none tick 11 fault emergency stop"
        );
        assert!(StatusLine { status: &status, board: "late" }.to_string().ends_with(" board late"));
    }
}
