//! A program on a stage: line by line, each looked at before it is sent, and no more than a few lines ahead of the stage.

use super::ahead::{Ahead, Next};
use super::check::{Check, Checked};
use super::lines::{Line, LinesError};
use super::steps::segments;
use super::stepwise::stage::Division;
use super::travel::Travel;
use super::watch::Watch;
use crate::failure::Failure;
use crate::interrupt;
use crate::preset::Preset;
use crate::progress;
use crate::rig::Rig;
use abbe_core::command::Refusal;
use abbe_core::machine::State;
use abbe_core::plan::segment::Segment;
use abbe_core::{Command, Pos};
use abbe_metrology::measure::Arrival;
use abbe_proto::gcode::{Action, Effect, Flow};
use std::io::{self, IsTerminal};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Ticks between two looks for a fault and for Ctrl-C.
const LOOK_TICKS: u64 = 1024;
/// Between two looks for Ctrl-C while a user is waited for.
const LOOK: Duration = Duration::from_millis(50);

/// What a stage did for a program.
#[derive(Debug)]
pub(crate) struct Ran {
    /// What was said of the lines that were read; with an error if a line was not sent.
    pub(crate) checked: Checked,
    pub(crate) segments: u64,
    /// On the path, without settling and waits, s.
    pub(crate) path_s: f64,
    /// How the last motion ended, if there was one.
    pub(crate) arrival: Option<Arrival>,
    /// Waits for a user that nobody was there for.
    pub(crate) unwaited: u64,
}

/// A stage that goes through a program.
pub(crate) struct Runner<'a> {
    /// Of the program.
    name: &'a str,
    rig: &'a mut Rig,
    watch: &'a mut Watch,
    check: Check,
    /// Whoever is waited for sits at a terminal.
    asks_user: bool,
    /// Motions are gone through step by step.
    division: Option<Division>,
    /// A motion was begun, and its arrival was not looked at.
    moves: bool,
    ticks: u64,
    segments: u64,
    path_s: f64,
    arrival: Option<Arrival>,
    unwaited: u64,
}

impl<'a> Runner<'a> {
    /// For a stage that stands where programs begin, and goes at so many percent of their feeds. `asks_user`: in M0, if
    /// stdin is a terminal.
    pub(crate) fn new(
        name: &'a str,
        preset: &Preset,
        rig: &'a mut Rig,
        watch: &'a mut Watch,
        asks_user: bool,
    ) -> Self {
        let percent = rig.status().feed_rate;
        Self {
            name,
            rig,
            watch,
            check: Check::new(preset, percent),
            asks_user: asks_user && io::stdin().is_terminal(),
            division: None,
            moves: false,
            ticks: 0,
            segments: 0,
            path_s: 0.0,
            arrival: None,
            unwaited: 0,
        }
    }

    /// Step by step, if a division is given.
    pub(crate) fn divided(mut self, division: Option<Division>) -> Self {
        self.division = division;
        self
    }

    /// Goes through a program, up to its end or to a line with an error; then the stage has arrived.
    ///
    /// # Errors
    /// The input cannot be read, the stage did not do what it should, or Ctrl-C. Then it stands all the same.
    pub(crate) fn run(mut self, ahead: &Ahead) -> Result<Ran, Failure> {
        match self.go_through(ahead) {
            Ok(()) => Ok(self.ran()),
            Err(failure) => {
                self.come_to_rest();
                Err(failure)
            }
        }
    }

    fn go_through(&mut self, ahead: &Ahead) -> Result<(), Failure> {
        while let Some(line) = self.next_line(ahead)? {
            let looked = self.check.line(&line);
            if self.check.checked.count > 0 {
                // Behind it nothing was looked at.
                self.check.checked.refused = None;
                break;
            }
            if let Some(effect) = looked.effect {
                self.act(line.number, &effect)?;
            }
            if looked.is_last {
                break;
            }
        }
        self.arrive()
    }

    fn next_line(&mut self, ahead: &Ahead) -> Result<Option<Line<'static>>, Failure> {
        let told = |error: LinesError| error.of(self.name);
        let mut next = ahead.next().map_err(told)?;
        if matches!(next, Next::Pause) {
            self.arrive()?;
            next = ahead.wait().map_err(told)?;
        }
        Ok(match next {
            Next::Line(line) => Some(line),
            Next::Pause | Next::End => None,
        })
    }

    fn act(&mut self, line: u64, effect: &Effect) -> Result<(), Failure> {
        if let Some(Action::Dwell { nanoseconds }) = effect.action {
            self.dwell(nanoseconds)?;
        }
        if let Some(action) = &effect.action {
            let segments: Box<dyn Iterator<Item = Segment>> = match &self.division {
                Some(division) => division.segments(action),
                None => Box::new(segments(action, self.rig.tick_hz())),
            };
            for segment in segments {
                self.go(line, segment)?;
            }
        }
        if effect.flow == Some(Flow::Pause) {
            self.wait_for_user(line)?;
        }
        Ok(())
    }

    /// Sends a segment as soon as there is room.
    fn go(&mut self, line: u64, segment: Segment) -> Result<(), Failure> {
        if self.rig.controller().state() == State::Settling {
            self.arrive()?;
        }
        loop {
            self.watch.begin(self.rig.controller())?;
            match self.rig.ask(Command::Go(segment)) {
                Ok(_) => break,
                Err(Refusal::QueueFull) => self.tick()?,
                Err(refusal) => {
                    // A fault is told as such.
                    self.rig.check()?;
                    return Err(Failure::work(format!("{}, line {line}: {refusal}", self.name)));
                }
            }
        }
        (self.moves, self.segments) = (true, self.segments + 1);
        Ok(())
    }

    fn tick(&mut self) -> Result<(), Failure> {
        self.rig.tick();
        self.watch.see(self.rig.controller(), &self.rig.status())?;
        self.ticks += 1;
        if self.ticks.is_multiple_of(LOOK_TICKS) {
            self.rig.check()?;
        }
        Ok(())
    }

    /// Waits until what was sent is done and the stage is measured to be there.
    fn arrive(&mut self) -> Result<(), Failure> {
        while self.rig.controller().state().is_busy() {
            self.tick()?;
        }
        self.rig.check()?;
        if std::mem::take(&mut self.moves) {
            let arrival = self.rig.arrival()?;
            self.path_s += arrival.moved_s;
            self.arrival = Some(arrival);
        }
        Ok(())
    }

    fn dwell(&mut self, nanoseconds: u64) -> Result<(), Failure> {
        self.arrive()?;
        let ticks = (nanoseconds as f64 / 1e9 * self.rig.tick_hz()).round() as u64;
        for _ in 0..ticks {
            self.tick()?;
        }
        self.rig.check()?;
        Ok(())
    }

    /// The stage's time stands still meanwhile.
    fn wait_for_user(&mut self, line: u64) -> Result<(), Failure> {
        self.arrive()?;
        if !self.asks_user {
            self.unwaited += 1;
            return Ok(());
        }
        progress::note(&format!("{}, line {line}: the program waits; press Enter to go on", self.name));
        let (to, enter) = channel();
        thread::spawn(move || to.send(io::stdin().read_line(&mut String::new())));
        loop {
            match enter.recv_timeout(LOOK) {
                Ok(read) => return read.map(|_| ()).map_err(Failure::from),
                Err(RecvTimeoutError::Timeout) => interrupt::check()?,
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
        }
    }

    /// After Ctrl-C on the path at once, else at the end of what was sent.
    fn come_to_rest(&mut self) {
        let is_asked = interrupt::check().is_err();
        if is_asked {
            _ = self.rig.ask(Command::Stop);
        }
        while self.rig.controller().state().is_busy() {
            self.rig.tick();
            _ = self.watch.see(self.rig.controller(), &self.rig.status());
            // Ctrl-C may also come now.
            if !is_asked && interrupt::check().is_err() {
                return self.come_to_rest();
            }
        }
        if is_asked {
            self.rig.tell_where_it_stopped();
        }
    }

    fn ran(self) -> Ran {
        let Self { check, segments, path_s, arrival, unwaited, .. } = self;
        Ran { checked: check.checked, segments, path_s, arrival, unwaited }
    }
}

/// Where the program has a stage begin, mm.
pub(crate) fn start_mm(preset: &Preset) -> [f64; 2] {
    Travel::of(preset).start().map(Pos::mm)
}
