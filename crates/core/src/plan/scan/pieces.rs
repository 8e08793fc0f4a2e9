//! A planned scan as pieces that a tick can walk.

use super::{ScanPlan, step};
use crate::plan::compare::Axis;
use crate::plan::pieces::Piece;
use crate::plan::steps::{Leg, lay_out};
use crate::plan::transfer::{Phase, State};
use core::cmp::Ordering;

/// The pieces of a scan, in their order; the last is the end, where it stays.
#[derive(Clone, Debug)]
pub struct Pieces {
    plan: ScanPlan,
    /// Number of the next section.
    next: u64,
    section: Section,
}

/// What both axes do from a time on until another, ticks.
#[derive(Clone, Debug, Default)]
struct Section {
    begins: f64,
    ends: f64,
    axes: [Course; 2],
}

/// From a state on, phase by phase.
#[derive(Clone, Copy, Debug, Default)]
struct Course {
    state: State,
    phases: [Phase; 7],
    next: usize,
}

impl ScanPlan {
    /// All pieces. None stands in the place of one that does not fit, and there is none: [`Scan::plan`](super::Scan::plan)
    /// has looked.
    pub fn pieces(&self) -> Pieces {
        Pieces { plan: *self, next: 0, section: Section::default() }
    }

    /// Section 0 is the run-up; then come each line and what is behind it, a turn or the stop.
    fn section(&self, number: u64) -> Option<Section> {
        let Some(number) = number.checked_sub(1) else { return Some(self.run_up()) };
        let line = u32::try_from(number / 2).ok().filter(|line| *line < self.number)?;
        if number % 2 == 0 {
            return Some(self.straight(line));
        }
        match line.checked_add(1).filter(|ahead| *ahead < self.number) {
            Some(ahead) => self.turn(line, ahead),
            None => Some(self.stop(line)),
        }
    }

    fn run_up(&self) -> Section {
        let start = State { position: self.starts(), ..State::default() };
        self.resting([0.0, self.line_begins(0)], 0, start, &self.run_up.phases())
    }

    fn straight(&self, line: u32) -> Section {
        let [enters, _] = self.edges(line);
        let speed = self.direction(line) * self.scan.speed;
        let position = enters.pm() as f64 - f64::from(self.scan.settle) * speed;
        let cruise = Phase { ticks: self.straight, jerk: 0.0 };
        let times = [self.line_begins(line), self.line_ends(line)];
        self.resting(times, line, State { position, speed, acceleration: 0.0 }, &[cruise])
    }

    fn stop(&self, line: u32) -> Section {
        self.resting([self.line_ends(line), self.ends()], line, self.leaving(line), &self.stop.phases())
    }

    /// Both axes at once.
    fn turn(&self, line: u32, ahead: u32) -> Option<Section> {
        let [from, to] = [line, ahead].map(|line| self.row(line).pm() as f64);
        let soonest = step(from, to, &self.slow).ok()?;
        // The same way in a longer time: jerk goes with its third power.
        let longer = (self.period - self.straight) / soonest.ticks();
        let slower = |phase: Phase| Phase {
            ticks: phase.ticks * longer,
            jerk: phase.jerk / (longer * longer * longer),
        };
        let times = [self.line_ends(line), self.line_begins(ahead)];
        Some(self.both(times, line, self.leaving(line), &self.turn, soonest.phases().map(slower)))
    }

    /// At the end of a line.
    fn leaving(&self, line: u32) -> State {
        let [_, leaves] = self.edges(line);
        State {
            position: leaves.pm() as f64,
            speed: self.direction(line) * self.scan.speed,
            acceleration: 0.0,
        }
    }

    /// The fast axis alone.
    fn resting(&self, times: [f64; 2], line: u32, state: State, phases: &[Phase]) -> Section {
        self.both(times, line, state, phases, [Phase::default(); 7])
    }

    /// Phases of the fast axis, as of a line in the positive direction, and those of the slow one from its line on.
    fn both(
        &self,
        times: [f64; 2],
        line: u32,
        state: State,
        phases: &[Phase],
        across: [Phase; 7],
    ) -> Section {
        let direction = self.direction(line);
        let mut fast = Course { state, ..Course::default() };
        for (own, phase) in fast.phases.iter_mut().zip(phases) {
            *own = Phase { jerk: direction * phase.jerk, ..*phase };
        }
        let row = State { position: self.row(line).pm() as f64, ..State::default() };
        let slow = Course { state: row, phases: across, next: 0 };
        let axes = match self.scan.fast {
            Axis::X => [fast, slow],
            Axis::Y => [slow, fast],
        };
        let [begins, ends] = times;
        Section { begins, ends, axes }
    }

    /// The end, after all sections.
    fn rests(&self) -> Option<Piece> {
        let mut piece = [Leg::default(); 2];
        for (leg, place) in piece.iter_mut().zip(self.end()) {
            let state = State { position: place.pm() as f64, ..State::default() };
            *leg = lay_out(self.ends(), state, &Phase::default())?;
        }
        Some(piece)
    }
}

impl Pieces {
    /// From the beginning of a line on.
    pub(super) fn from_line(plan: &ScanPlan, line: u32) -> Self {
        Self { next: u64::from(line).saturating_mul(2).saturating_add(1), ..plan.pieces() }
    }

    fn sections(&self) -> u64 {
        u64::from(self.plan.number).saturating_mul(2).saturating_add(1)
    }
}

impl Iterator for Pieces {
    type Item = Option<Piece>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(piece) = self.section.next() {
                return Some(piece);
            }
            let number = self.next;
            self.next = number.saturating_add(1);
            match number.cmp(&self.sections()) {
                Ordering::Less => match self.plan.section(number) {
                    Some(section) => self.section = section,
                    None => return Some(None),
                },
                Ordering::Equal => return Some(self.plan.rests()),
                Ordering::Greater => return None,
            }
        }
    }
}

impl Iterator for Section {
    type Item = Option<Piece>;

    /// Until the phase of either axis ends.
    fn next(&mut self) -> Option<Self::Item> {
        let length = match self.axes.each_mut().map(Course::left) {
            [Some(x), Some(y)] => x.min(y),
            [x, y] => x.or(y)?,
        };
        let begins = self.begins;
        // Not beyond by what was rounded: that might be a tick beyond.
        self.begins = self.ends.min(begins + length);
        let [x, y] = self.axes.each_mut().map(|course| course.go(begins, length));
        Some(x.zip(y).map(Piece::from))
    }
}

impl Course {
    /// Ticks that are left of the present phase; None after the last.
    fn left(&mut self) -> Option<f64> {
        while let Some(phase) = self.phases.get(self.next) {
            if phase.ticks > 0.0 {
                return Some(phase.ticks);
            }
            self.next = self.next.saturating_add(1);
        }
        None
    }

    /// Goes on for a part of the present phase.
    fn go(&mut self, begins: f64, ticks: f64) -> Option<Leg> {
        let mut none = Phase::default();
        let phase = self.phases.get_mut(self.next).unwrap_or(&mut none);
        let leg = lay_out(begins, self.state, &Phase { ticks, ..*phase });
        self.state = self.state.after(ticks, phase.jerk);
        phase.ticks -= ticks;
        leg
    }
}
