//! What a replay shows, over time: rows, thinned lines, and marks where something was asked or went wrong.

use super::replay::Seen;
use crate::failure::Failure;
use abbe_core::command::{Compare, axis_name};
use abbe_core::edge::{Actuation, AxisOutputs};
use abbe_core::machine::State;
use abbe_core::plan::segment::Shape;
use abbe_core::publish::{AxisStatus, Fault};
use abbe_core::{Command, Pos, Status};
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Points that a line of a plot is thinned to; more than a plot has pixels.
const MOST_POINTS: u64 = 3000;

/// A part of a recording, s from power-on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
}

impl Window {
    /// The asked part of a recording that covers `self`.
    pub(crate) fn part(self, from_s: Option<f64>, to_s: Option<f64>) -> Result<Self, Failure> {
        for (option, asked_s) in [("--from", from_s), ("--to", to_s)] {
            if let Some(asked_s) = asked_s.filter(|asked_s| !(self.from_s..=self.to_s).contains(asked_s)) {
                return Err(Failure::work(format!(
                    "{option} {asked_s}: the recording covers {:.4} … {:.4} s from power-on",
                    self.from_s, self.to_s
                )));
            }
        }
        Ok(Self { from_s: from_s.unwrap_or(self.from_s), to_s: to_s.unwrap_or(self.to_s) })
    }

    pub(super) fn holds(self, t_s: f64) -> bool {
        (self.from_s..=self.to_s).contains(&t_s)
    }
}

/// One axis at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisRow {
    pub(crate) set_point_mm: f64,
    pub(crate) position_mm: f64,
    pub(crate) error_um: f64,
    /// Step pulses a second, or the duty of a bridge in %.
    pub(crate) drive: f64,
}

impl AxisRow {
    fn of(state: State, status: &AxisStatus, output: &AxisOutputs, tick_hz: f64) -> Self {
        let drive = match output.actuation {
            Actuation::Steps(rate) => f64::from(rate.0) / 65_536.0 * tick_hz,
            Actuation::Pwm(duty) => f64::from(duty) / 327.68,
        };
        // While homing there is no path in the stage frame, only a set-point beside the reading.
        let set_point = match state {
            State::Homing => status.reading + status.following_error,
            _ => status.set_point,
        };
        Self {
            set_point_mm: set_point.mm(),
            position_mm: status.position.mm(),
            error_um: status.following_error.um(),
            drive,
        }
    }
}

/// One tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) t_s: f64,
    pub(crate) state: State,
    pub(crate) axes: [AxisRow; 2],
}

impl Row {
    /// Heads the rows of a file.
    pub(crate) const CSV: &str =
        "t_s,state,x_set_mm,x_mm,x_error_um,x_steps_s,y_set_mm,y_mm,y_error_um,y_steps_s\n";
    /// Heads the rows of a table.
    pub(crate) const TABLE: &str = "       t/s  state        set x/mm       x/mm  error/µm  steps/s    set y/mm       y/mm  error/µm  steps/s\n";

    /// A line of a file.
    pub(crate) fn csv(&self, to: &mut String) {
        _ = write!(to, "{:.4},{}", self.t_s, self.state);
        for axis in &self.axes {
            let AxisRow { set_point_mm, position_mm, error_um, drive } = axis;
            _ = write!(to, ",{set_point_mm:.7},{position_mm:.7},{error_um:.4},{drive:.2}");
        }
        to.push('\n');
    }

    /// A line of a table.
    pub(crate) fn table(&self, to: &mut String) {
        _ = write!(to, "{:>10.4}  {:<9}", self.t_s, self.state.to_string());
        for axis in &self.axes {
            let AxisRow { set_point_mm, position_mm, error_um, drive } = axis;
            _ = write!(to, "  {set_point_mm:>10.5} {position_mm:>10.5} {error_um:>+9.2} {drive:>8.0}");
        }
        to.push('\n');
    }

    /// For programs.
    pub(crate) fn json(&self) -> Value {
        let axis = |axis: &AxisRow| {
            json!({
                "set_point_mm": axis.set_point_mm,
                "position_mm": axis.position_mm,
                "following_error_um": axis.error_um,
                "steps_s": axis.drive,
            })
        };
        let [x, y] = self.axes.each_ref().map(axis);
        json!({ "t_s": self.t_s, "state": self.state.to_string(), "x": x, "y": y })
    }
}

/// What a mark marks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Command,
    Refusal,
    Fault,
    Map,
}

/// Something that happened at an instant.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mark {
    pub(crate) t_s: f64,
    pub(crate) kind: Kind,
    pub(crate) text: String,
}

impl Mark {
    /// For programs.
    pub(crate) fn json(&self) -> Value {
        let kind = match self.kind {
            Kind::Command => "command",
            Kind::Refusal => "refusal",
            Kind::Fault => "fault",
            Kind::Map => "map",
        };
        json!({ "t_s": self.t_s, "kind": kind, "text": self.text })
    }
}

/// A line over time, thinned as it grows: of every few ticks the lowest and the highest, in their order.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    every: u64,
    taken: u64,
    low: (f64, f64),
    high: (f64, f64),
    points: Vec<(f64, f64)>,
}

impl Line {
    fn every(every: u64) -> Self {
        Self { every, taken: 0, low: (0.0, 0.0), high: (0.0, 0.0), points: Vec::new() }
    }

    fn push(&mut self, t_s: f64, value: f64) {
        let new = (t_s, value);
        if self.taken == 0 || value < self.low.1 {
            self.low = new;
        }
        if self.taken == 0 || value > self.high.1 {
            self.high = new;
        }
        self.taken += 1;
        if self.taken == self.every {
            self.end_part();
        }
    }

    fn end_part(&mut self) {
        if self.taken == 0 {
            return;
        }
        let (first, second) =
            if self.low.0 <= self.high.0 { (self.low, self.high) } else { (self.high, self.low) };
        self.points.push(first);
        if second.0 > first.0 {
            self.points.push(second);
        }
        self.taken = 0;
    }

    /// All points.
    pub(crate) fn points(&self) -> &[(f64, f64)] {
        &self.points
    }
}

/// The lines of one axis.
#[derive(Clone, Debug)]
pub(crate) struct AxisLines {
    pub(crate) set_point: Line,
    pub(crate) position: Line,
    pub(crate) error: Line,
    pub(crate) drive: Line,
}

/// Lines of a plot.
#[derive(Clone, Debug)]
pub(crate) struct Lines {
    pub(crate) axes: [AxisLines; 2],
    /// Time and the state from then on.
    pub(crate) states: Vec<(f64, State)>,
}

impl Lines {
    fn over(ticks: u64) -> Self {
        let line = Line::every((ticks / (MOST_POINTS / 2)).max(1));
        let axis =
            AxisLines { set_point: line.clone(), position: line.clone(), error: line.clone(), drive: line };
        Self { axes: [axis.clone(), axis], states: Vec::new() }
    }

    fn push(&mut self, row: &Row) {
        for (lines, axis) in self.axes.iter_mut().zip(&row.axes) {
            lines.set_point.push(row.t_s, axis.set_point_mm);
            lines.position.push(row.t_s, axis.position_mm);
            lines.error.push(row.t_s, axis.error_um);
            lines.drive.push(row.t_s, axis.drive);
        }
        if self.states.last().is_none_or(|(_, state)| *state != row.state) {
            self.states.push((row.t_s, row.state));
        }
    }

    fn end(&mut self) {
        for lines in &mut self.axes {
            for line in [&mut lines.set_point, &mut lines.position, &mut lines.error, &mut lines.drive] {
                line.end_part();
            }
        }
    }
}

/// What is wanted of a replay.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wish {
    /// Every so many ticks a row for people and programs.
    pub(crate) step: Option<u64>,
    /// A row for a file, as often as `step` says or at every tick.
    pub(crate) csv: bool,
    /// Lines to be drawn.
    pub(crate) lines: bool,
}

/// Watches a replay.
#[derive(Debug)]
pub(crate) struct Trace {
    window: Window,
    tick_hz: f64,
    wish: Wish,
    fault: Option<Fault>,
    ticks: u64,
    pub(crate) rows: Vec<Row>,
    pub(crate) csv: String,
    pub(crate) lines: Lines,
    /// Of the whole recording, window or not.
    pub(crate) marks: Vec<Mark>,
}

impl Trace {
    /// Nothing is seen yet.
    pub(crate) fn new(window: Window, tick_hz: f64, wish: Wish) -> Self {
        let ticks = ((window.to_s - window.from_s) * tick_hz) as u64;
        let csv = if wish.csv { Row::CSV.to_owned() } else { String::new() };
        let lines = Lines::over(ticks);
        Self { window, tick_hz, wish, fault: None, ticks: 0, rows: Vec::new(), csv, lines, marks: Vec::new() }
    }

    /// Takes what a replay shows.
    pub(crate) fn see(&mut self, seen: &Seen<'_>) {
        match *seen {
            Seen::Tick { tick, outputs, status } => {
                let t_s = tick as f64 / self.tick_hz;
                self.see_fault(t_s, status);
                if self.window.holds(t_s) {
                    let axis =
                        |k: usize| AxisRow::of(status.state, &status.axes[k], &outputs.axes[k], self.tick_hz);
                    self.take(Row { t_s, state: status.state, axes: [axis(0), axis(1)] });
                }
            }
            Seen::Command { tick, ref command, answer } => {
                let (kind, text) = match answer {
                    Ok(_) => (Kind::Command, words(command)),
                    Err(refusal) => (Kind::Refusal, format!("{} refused: {refusal}", words(command))),
                };
                self.mark(tick as f64 / self.tick_hz, kind, text);
            }
            Seen::Map { tick, axis } => {
                let text = format!("{}: error map", axis_name(axis));
                self.mark(tick as f64 / self.tick_hz, Kind::Map, text);
            }
        }
    }

    /// Nothing more will be seen.
    pub(crate) fn end(&mut self) {
        self.lines.end();
    }

    /// The faults of the whole recording.
    pub(crate) fn faults(&self) -> impl Iterator<Item = &Mark> {
        self.marks.iter().filter(|mark| mark.kind == Kind::Fault)
    }

    /// The marks inside the window.
    pub(crate) fn marks_in_window(&self) -> impl Iterator<Item = &Mark> {
        self.marks.iter().filter(|mark| self.window.holds(mark.t_s))
    }

    /// What is shown.
    pub(crate) fn window(&self) -> Window {
        self.window
    }

    fn see_fault(&mut self, t_s: f64, status: &Status<2>) {
        if let Some(fault) = status.fault.filter(|fault| self.fault != Some(*fault)) {
            self.mark(t_s, Kind::Fault, fault.to_string());
        }
        self.fault = status.fault;
    }

    fn take(&mut self, row: Row) {
        if self.ticks.is_multiple_of(self.wish.step.unwrap_or(1)) {
            if self.wish.csv {
                row.csv(&mut self.csv);
            }
            if self.wish.step.is_some() {
                self.rows.push(row);
            }
        }
        if self.wish.lines {
            self.lines.push(&row);
        }
        self.ticks += 1;
    }

    fn mark(&mut self, t_s: f64, kind: Kind, text: String) {
        self.marks.push(Mark { t_s, kind, text });
    }
}

fn shape(shape: &Shape) -> &'static str {
    match shape {
        Shape::Line => "line",
        Shape::Arc { .. } => "arc",
        Shape::Sine { .. } => "sine",
        Shape::Scan { .. } => "scan",
    }
}

/// A request in words.
fn words(command: &Command<2>) -> String {
    let places = |places: &[Pos; 2]| places.map(|place| format!("{:.4}", place.mm())).join(", ");
    match command {
        Command::Enable => "enable".into(),
        Command::Disable => "disable".into(),
        Command::Home => "home".into(),
        Command::MoveTo(to) => format!("move to {}", places(to)),
        Command::MoveBy(way) => format!("move by {}", places(way)),
        Command::Go(segment) => format!("{} to {}", shape(&segment.shape), places(&segment.to)),
        Command::Compare(None) => "compare nothing".into(),
        Command::Compare(Some(Compare { axis, places })) => {
            format!("{}: compare with {} places", axis_name(*axis), places.number)
        }
        Command::Hold => "hold".into(),
        Command::Resume => "resume".into(),
        Command::FeedRate(percent) => format!("feed rate {percent} %"),
        Command::Stop => "stop".into(),
        Command::Reset => "reset".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_lie_inside_the_recording() {
        let all = Window { from_s: 2.0, to_s: 9.0 };
        assert_eq!(all.part(None, None).unwrap(), all);
        assert_eq!(all.part(Some(3.0), Some(9.0)).unwrap(), Window { from_s: 3.0, to_s: 9.0 });
        for (from, to, name) in
            [(Some(1.0), None, "--from 1"), (Some(9.5), None, "--from 9.5"), (None, Some(10.0), "--to 10")]
        {
            let failure = all.part(from, to).unwrap_err();
            assert_eq!(failure.status(), 1);
            assert!(failure.sentence().contains(name), "{}", failure.sentence());
            assert!(failure.sentence().contains("2.0000 … 9.0000 s"), "{}", failure.sentence());
        }
    }

    #[test]
    fn a_thinned_line_keeps_its_extremes_in_their_order() {
        let mut line = Line::every(100);
        for i in 0..10_050 {
            line.push(f64::from(i), if i == 7_777 { 50.0 } else { f64::from(i % 10) });
        }
        line.end_part();
        let points = line.points();
        assert!(points.len() <= 202 && points.is_sorted_by(|a, b| a.0 < b.0), "{}", points.len());
        assert!(points.contains(&(7_777.0, 50.0)) && points.iter().any(|p| p.1 == 0.0));
    }
}
