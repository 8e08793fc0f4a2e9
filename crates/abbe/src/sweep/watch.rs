//! What is seen of a sweep, tick by tick: by the controller, and beside it the truth, as instruments see it.

use super::ledger::Ledger;
use super::pace::Pace;
use super::plan::Planned;
use super::tally::Tally;
use crate::failure::Failure;
use crate::folder::Growing;
use abbe_core::front::compare::Event;
use abbe_core::machine::State;
use abbe_core::plan::scan::Line;
use abbe_core::{Controller, Pos};
use abbe_twin::Truth;
use std::fmt::Write as _;
use std::path::Path;

/// Heads the rows of events: s since the sweep began, numbers from 0, where the stage was measured and where its table was.
const HEADER: &str = "t_s,line,place,direction,x_mm,y_mm,true_x_mm,true_y_mm\n";

/// Where a stage is at a tick, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Moment {
    measured: [f64; 2],
    table: [f64; 2],
}

impl Moment {
    /// In between, at a part of the time.
    fn towards(&self, later: &Self, part: f64) -> Self {
        let between = |from: [f64; 2], to: [f64; 2]| [0, 1].map(|k| from[k] + (to[k] - from[k]) * part);
        Self { measured: between(self.measured, later.measured), table: between(self.table, later.table) }
    }
}

/// Looks at a sweep from its first tick on.
pub(crate) struct Watch<'a> {
    planned: &'a Planned,
    tick_hz: f64,
    /// Number of the tick at which it began.
    began: Option<u32>,
    /// The line that is being gone through, its number, and when the next one has its turn.
    line: Option<Line>,
    number: u32,
    until: f64,
    before: Option<Moment>,
    pub(crate) ledger: Ledger,
    pub(crate) pace: Pace,
    /// Inside the area, of both axes, µm.
    pub(crate) following: [Tally; 2],
    /// How far the table was from the place of an event, of those downwards and upwards, µm.
    pub(crate) beside_truth: [Tally; 2],
    pub(crate) fired: u64,
    pub(crate) lost: u64,
    file: Option<Growing>,
    /// A row that is being written.
    row: String,
}

impl<'a> Watch<'a> {
    /// For a stage that stands where the sweep begins.
    pub(crate) fn new(planned: &'a Planned, tick_hz: f64, events: Option<&Path>) -> Result<Self, Failure> {
        let mut file = events.map(Growing::new).transpose()?;
        if let Some(file) = &mut file {
            file.write(HEADER.as_bytes())?;
        }
        let mut watch = Self {
            planned,
            tick_hz,
            began: None,
            line: None,
            number: 0,
            until: 0.0,
            before: None,
            ledger: Ledger::new(planned.places.number),
            pace: Pace::new(planned.scan.speed, tick_hz),
            following: Default::default(),
            beside_truth: Default::default(),
            fired: 0,
            lost: 0,
            file,
            row: String::new(),
        };
        watch.come_to(0);
        Ok(watch)
    }

    /// Whether anything was there to see.
    pub(crate) fn has_begun(&self) -> bool {
        self.began.is_some()
    }

    /// How many lines are over.
    pub(crate) fn lines(&self) -> u32 {
        self.number
    }

    /// Looks at a tick.
    pub(crate) fn see(&mut self, controller: &Controller<2>, truth: &Truth) -> Result<(), Failure> {
        let status = controller.status();
        let now = Moment {
            measured: status.axes.map(|axis| axis.position.mm()),
            table: truth.table_um.map(|um| um * 1e-3),
        };
        let before = self.before.replace(now).unwrap_or(now);
        // At rest until the tick before.
        if self.began.is_none() && controller.set_points()[self.planned.fast()].speed != 0 {
            self.began = Some(status.tick.wrapping_sub(1));
        }
        let Some(began) = self.began else { return Ok(()) };
        let fired = controller.fired();
        self.lost += u64::from(fired.lost);
        for event in fired.as_slice() {
            let tick_before = u64::from(status.tick.wrapping_sub(1)) << 32;
            let at = before.towards(&now, in_ticks(event.time.wrapping_sub(tick_before)));
            let since = in_ticks(event.time.wrapping_sub(u64::from(began) << 32));
            self.go_on(since);
            self.note(event, since, &at)?;
        }
        if status.state == State::Moving {
            let since = status.tick.wrapping_sub(began);
            self.go_on(f64::from(since));
            self.look_inside(since, status.axes.map(|axis| (axis.position, axis.following_error)));
        }
        Ok(())
    }

    /// Nothing comes any more; the file takes its place.
    pub(crate) fn done(&mut self) -> Result<(), Failure> {
        self.go_on(f64::INFINITY);
        self.file.take().map_or(Ok(()), Growing::done)
    }

    /// To the line whose turn it is.
    fn go_on(&mut self, since: f64) {
        while self.line.is_some() && since >= self.until {
            self.ledger.next_line();
            self.pace.end_line();
            self.come_to(self.number + 1);
        }
    }

    /// The next line has its turn in the middle between the two.
    fn come_to(&mut self, number: u32) {
        self.number = number;
        self.line = self.planned.plan.line(number);
        let next = self.planned.plan.line(number + 1);
        self.until = self
            .line
            .zip(next)
            .map_or(f64::INFINITY, |(line, next)| 0.5 * (line.leaves + f64::from(next.enters)));
    }

    /// The line is gone through with rising coordinates.
    fn is_up(&self) -> bool {
        let fast = self.planned.fast();
        self.line.is_some_and(|line| line.to[fast] > line.from[fast])
    }

    fn note(&mut self, event: &Event, since: f64, at: &Moment) -> Result<(), Failure> {
        self.fired += 1;
        self.ledger.fired(event.place, event.up, self.is_up());
        let fast = self.planned.fast();
        let beside_um = (at.table[fast] - self.planned.place(event.place).mm()) * 1e3;
        self.beside_truth[usize::from(event.up)].add(beside_um);
        let Some(file) = &mut self.file else { return Ok(()) };
        let Moment { measured: [x, y], table: [true_x, true_y] } = at;
        let (t_s, direction) = (since / self.tick_hz, direction(event.up));
        self.row.clear();
        _ = writeln!(
            self.row,
            "{t_s:.9},{},{},{direction},{x:.9},{y:.9},{true_x:.9},{true_y:.9}",
            self.number, event.place
        );
        file.write(self.row.as_bytes())
    }

    /// While the set-point is inside the area.
    fn look_inside(&mut self, since: u32, axes: [(Pos, Pos); 2]) {
        let Some(line) = self.line else { return };
        if since < line.enters || f64::from(since) > line.leaves {
            return;
        }
        self.pace.see(axes[self.planned.fast()].0.pm());
        for (following, (_, error)) in self.following.iter_mut().zip(axes) {
            following.add(error.um());
        }
    }
}

/// The word for a direction.
pub(crate) fn direction(up: bool) -> &'static str {
    if up { "up" } else { "down" }
}

/// Of 32 fractional bits.
fn in_ticks(time: u64) -> f64 {
    time.cast_signed() as f64 / (1_u64 << 32) as f64
}
