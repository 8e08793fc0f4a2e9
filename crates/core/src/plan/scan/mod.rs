//! Line by line over an area: at constant speed inside it, with the turns outside.
//!
//! A line is gone through at its speed exactly, from a time before the area until it is left. At its end the fast axis
//! changes from that speed to the next line's, in one go and without a stop: in a [`Serpentine`](Order::Serpentine) to the
//! same speed backwards, in [`FlyBack`](Order::FlyBack) over a faster way back. Meanwhile the slow axis goes to the next line
//! from rest to rest; the turn is as long as the slower of both needs, and the other takes as long with less.
//!
//! Turns are a little longer still, so that each line enters the area on a whole tick: then all lines are the same in time,
//! and nothing adds up over their number.

mod change;
mod error;
mod pieces;

pub use error::ScanError;
pub use pieces::Pieces;

use super::compare::Axis;
use super::profile::Limits;
use super::steps::LONGEST;
use super::transfer::{Phase, State, Transfer};
use crate::units::Pos;
use change::{Change, FlyBack};

/// How many lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Lines {
    /// So many, evenly spaced, the first and the last on the edges of the area; a single one on the first edge.
    Number(u32),
    /// As many as fit with this distance between them, from the first edge on.
    Pitch(Pos),
}

/// In which direction the lines are gone through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// Every second one backwards.
    Serpentine,
    /// All in the direction of the first.
    FlyBack,
}

/// An area to be scanned.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scan {
    /// Where the first line enters the area, and the corner across.
    pub corners: [[Pos; 2]; 2],
    /// Along which axis the lines run.
    pub fast: Axis,
    /// How many of them.
    pub lines: Lines,
    /// In which direction.
    pub order: Order,
    /// Speed along the lines, pm a tick.
    pub speed: f64,
    /// Ticks at constant speed before a line enters the area: there what the run-up has stirred dies away.
    pub settle: u32,
}

/// A planned scan. It begins and ends at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ScanPlan {
    scan: Scan,
    /// Number of lines.
    number: u32,
    /// From the first line to the last, pm, and how many pitches that is.
    across: (i64, u32),
    /// +1 or −1: the direction of the first line.
    sign: f64,
    /// Ticks at constant speed: before the area and in it.
    straight: f64,
    /// From the beginning of one line to that of the next: a whole number.
    period: f64,
    run_up: Change,
    stop: Change,
    turn: [Phase; 7],
    /// How far a turn goes beyond the end of the line behind it, and before the beginning of the line ahead.
    beyond: [f64; 2],
    /// Limits of the slow axis.
    slow: Limits,
}

/// A line of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Line {
    /// Where it enters the area.
    pub from: [Pos; 2],
    /// Where it leaves it.
    pub to: [Pos; 2],
    /// Ticks from the start of the scan at which the set-point is at `from`.
    pub enters: u32,
    /// Ticks from the start at which it is at `to`.
    pub leaves: f64,
}

impl Scan {
    /// Plans it within the limits of both axes. Whether it is within the travel, too, [`ScanPlan::fits`] says.
    ///
    /// # Errors
    /// What is asked for is no scan, is beyond a limit, or beyond what a tick's integers hold.
    pub fn plan(&self, axes: &[Limits; 2]) -> Result<ScanPlan, ScanError> {
        let (fast, slow) = (of(axes, self.fast), of(axes, other(self.fast)));
        if !(axes.iter().all(Limits::are_numbers) && self.speed.is_finite() && self.speed > 0.0) {
            return Err(ScanError::NoNumber);
        }
        if self.speed > fast.speed {
            let axis = self.fast.index();
            return Err(ScanError::TooFast { axis, asked: self.speed, limit: fast.speed });
        }
        let length = self.along(self.fast).pm();
        if length == 0 {
            return Err(ScanError::NoLength { axis: self.fast.index() });
        }
        let (number, across) = self.rows()?;
        let straight = f64::from(self.settle) + length.abs_diff(0) as f64 / self.speed;
        let step = largest_step(across, &slow)?;
        let soonest = self.turn(&fast, straight, 0.0);
        let period = libm::ceil(straight + soonest.ticks.max(step));
        let turn = self.turn(&fast, straight, period - straight);
        let run_up = Change::soonest(self.speed, &fast);
        let stop = Change::soonest(-self.speed, &fast);
        let plan = ScanPlan {
            scan: *self,
            number,
            across,
            sign: length.signum() as f64,
            straight,
            period,
            run_up: run_up.lasting(libm::ceil(run_up.ticks())),
            stop: stop.lasting(libm::ceil(straight + stop.ticks()) - straight),
            turn: turn.phases,
            beyond: turn.beyond,
            slow,
        };
        plan.fits_a_tick()?;
        Ok(plan)
    }

    /// From the first corner to the other.
    fn along(&self, axis: Axis) -> Pos {
        let [from, to] = self.corners.map(|corner| of(&corner, axis));
        to - from
    }

    /// How many lines, how far it is from the first to the last, and how many pitches that is.
    fn rows(&self) -> Result<(u32, (i64, u32)), ScanError> {
        let width = self.along(other(self.fast)).pm();
        let (number, across) = match self.lines {
            Lines::Number(0) => return Err(ScanError::NoPitch),
            Lines::Number(1) => (1, 0),
            Lines::Number(number) => (number, width),
            Lines::Pitch(pitch) if pitch.pm() <= 0 => return Err(ScanError::NoPitch),
            Lines::Pitch(pitch) => {
                let pitches = width.checked_div(pitch.pm()).unwrap_or(0);
                let number = u32::try_from(pitches.unsigned_abs()).unwrap_or(u32::MAX).saturating_add(1);
                (number, pitches.saturating_mul(pitch.pm()))
            }
        };
        let pitches = number.saturating_sub(1);
        if across.unsigned_abs() < u64::from(pitches) {
            return Err(ScanError::NoPitch);
        }
        Ok((number, (across, pitches.max(1))))
    }

    /// A turn of at least so many ticks, for a line in the positive direction.
    fn turn(&self, fast: &Limits, straight: f64, ticks: f64) -> Turn {
        let (speed, settle) = (self.speed, f64::from(self.settle));
        match self.order {
            Order::Serpentine => {
                // Out as far as the next line needs to settle, and there it turns round.
                let change = Change::soonest(-2.0 * speed, fast);
                let change = change.lasting(change.ticks().max(ticks - settle));
                let [a, b, c] = change.phases();
                let out = Phase { ticks: settle, jerk: 0.0 };
                let none = Phase::default();
                Turn {
                    ticks: settle + change.ticks(),
                    phases: [out, a, b, c, none, none, none],
                    beyond: [settle * speed + change.farthest(speed); 2],
                }
            }
            Order::FlyBack => {
                let soonest = FlyBack::soonest(speed, straight * speed, fast);
                let back = if ticks > soonest.ticks() { soonest.lasting(ticks) } else { soonest };
                let beyond = [back.farthest(), settle * speed + back.farthest()];
                Turn { ticks: back.ticks(), phases: back.phases(), beyond }
            }
        }
    }
}

/// What the fast axis does between two lines.
struct Turn {
    ticks: f64,
    phases: [Phase; 7],
    beyond: [f64; 2],
}

/// Ticks of the longest step from a line to the next.
fn largest_step((across, pitches): (i64, u32), slow: &Limits) -> Result<f64, ScanError> {
    let pitch = across.unsigned_abs().div_ceil(u64::from(pitches.max(1)));
    Ok(step(0.0, pitch as f64, slow)?.ticks())
}

/// From rest to rest.
fn step(from: f64, to: f64, limits: &Limits) -> Result<Transfer, ScanError> {
    let at = |position: f64| State { position, ..State::default() };
    Transfer::fastest(at(from), at(to), limits).map_err(|_| ScanError::DoesNotFit)
}

impl ScanPlan {
    /// How long it takes, ticks.
    pub fn ticks(&self) -> u32 {
        self.ends() as u32
    }

    /// How many lines.
    pub fn lines(&self) -> u32 {
        self.number
    }

    /// A line by its number, from 0.
    pub fn line(&self, number: u32) -> Option<Line> {
        if number >= self.number {
            return None;
        }
        let enters = self.line_begins(number) + f64::from(self.scan.settle);
        let [from, to] = self.edges(number).map(|edge| self.place(edge, self.row(number)));
        Some(Line { from, to, enters: enters as u32, leaves: self.line_ends(number) })
    }

    /// Where the stage must be at rest when it begins.
    pub fn start(&self) -> [Pos; 2] {
        self.place(rounded(self.starts()), self.row(0))
    }

    /// Where it comes to rest.
    pub fn end(&self) -> [Pos; 2] {
        let last = self.number.saturating_sub(1);
        self.place(rounded(self.comes_to_rest()), self.row(last))
    }

    /// The room that it needs beyond the area along the fast axis: on the low side, and on the high side.
    pub fn room(&self) -> [Pos; 2] {
        let last_is_back = self.is_back(self.number.saturating_sub(1));
        let serpentine = self.scan.order == Order::Serpentine;
        let [mut far, mut near] = [0.0, self.run_up_way()];
        if self.number > 1 {
            far = self.beyond[0];
        }
        if self.number > if serpentine { 2 } else { 1 } {
            near = near.max(self.beyond[1]);
        }
        let stops = self.stop.way(self.scan.speed);
        (far, near) = if last_is_back { (far, near.max(stops)) } else { (far.max(stops), near) };
        let sides = if self.sign > 0.0 { [near, far] } else { [far, near] };
        sides.map(|side| Pos::from_pm(libm::ceil(side) as i64))
    }

    /// The lowest and the highest place of both axes.
    pub fn extent(&self) -> [[Pos; 2]; 2] {
        let [first, second] = self.scan.corners.map(|corner| of(&corner, self.scan.fast));
        let [first_row, last_row] = [self.row(0), self.row(self.number.saturating_sub(1))];
        let [low, high] = self.room();
        [
            self.place(first.min(second) - low, first_row.min(last_row)),
            self.place(first.max(second) + high, first_row.max(last_row)),
        ]
    }

    /// Whether all of it is within a travel, from its lowest place to its highest.
    ///
    /// # Errors
    /// [`ScanError::BeyondTravel`], with the first axis that is not.
    pub fn fits(&self, travel: &[[Pos; 2]; 2]) -> Result<(), ScanError> {
        let extent = self.extent();
        for axis in [Axis::X, Axis::Y] {
            let needs = extent.map(|corner| of(&corner, axis));
            let travel = travel.map(|corner| of(&corner, axis));
            if needs[0] < travel[0] || needs[1] > travel[1] {
                return Err(ScanError::BeyondTravel { axis: axis.index(), needs, travel });
            }
        }
        Ok(())
    }

    /// What a tick can walk. The places of all lines lie between those of the first and the last, and their speeds are the
    /// same: what these two fit, all do.
    fn fits_a_tick(&self) -> Result<(), ScanError> {
        if !(0.0..=LONGEST).contains(&self.ends()) {
            return Err(ScanError::TooLong);
        }
        let begin = self
            .pieces()
            .take_while(|piece| piece.is_none_or(|[leg, _]| f64::from(leg.first) <= 2.0 * self.period));
        let end = Pieces::from_line(self, self.number.saturating_sub(2));
        if begin.chain(end).all(|piece| piece.is_some()) { Ok(()) } else { Err(ScanError::DoesNotFit) }
    }

    /// When it comes to rest: a whole tick.
    fn ends(&self) -> f64 {
        libm::round(self.line_ends(self.number.saturating_sub(1)) + self.stop.ticks())
    }

    /// When a line begins, before the area: a whole tick.
    fn line_begins(&self, number: u32) -> f64 {
        libm::round(self.run_up.ticks()) + f64::from(number) * self.period
    }

    /// When it leaves it.
    fn line_ends(&self, number: u32) -> f64 {
        self.line_begins(number) + self.straight
    }

    fn is_back(&self, number: u32) -> bool {
        self.scan.order == Order::Serpentine && number % 2 == 1
    }

    /// +1 or −1.
    fn direction(&self, number: u32) -> f64 {
        if self.is_back(number) { -self.sign } else { self.sign }
    }

    /// Along the fast axis: where a line enters the area, and leaves it.
    fn edges(&self, number: u32) -> [Pos; 2] {
        let [first, second] = self.scan.corners.map(|corner| of(&corner, self.scan.fast));
        if self.is_back(number) { [second, first] } else { [first, second] }
    }

    /// Where a line lies along the slow axis.
    fn row(&self, number: u32) -> Pos {
        let [first, _] = self.scan.corners.map(|corner| of(&corner, other(self.scan.fast)));
        let (across, pitches) = self.across;
        let (across, pitches) = (i128::from(across), i128::from(pitches));
        let twice = across.saturating_mul(i128::from(number)).saturating_mul(2).saturating_add(pitches);
        let way = twice.checked_div_euclid(pitches.saturating_mul(2)).unwrap_or(0);
        first + Pos::from_pm(way as i64)
    }

    /// A place by its fast and its slow axis.
    fn place(&self, fast: Pos, slow: Pos) -> [Pos; 2] {
        match self.scan.fast {
            Axis::X => [fast, slow],
            Axis::Y => [slow, fast],
        }
    }

    /// From where it starts to the area.
    fn run_up_way(&self) -> f64 {
        self.run_up.way(0.0) + f64::from(self.scan.settle) * self.scan.speed
    }

    fn starts(&self) -> f64 {
        let [enters, _] = self.edges(0);
        enters.pm() as f64 - self.direction(0) * self.run_up_way()
    }

    fn comes_to_rest(&self) -> f64 {
        let last = self.number.saturating_sub(1);
        let [_, leaves] = self.edges(last);
        leaves.pm() as f64 + self.direction(last) * self.stop.way(self.scan.speed)
    }
}

fn of<T: Copy>([x, y]: &[T; 2], axis: Axis) -> T {
    match axis {
        Axis::X => *x,
        Axis::Y => *y,
    }
}

fn other(axis: Axis) -> Axis {
    match axis {
        Axis::X => Axis::Y,
        Axis::Y => Axis::X,
    }
}

fn rounded(pm: f64) -> Pos {
    Pos::from_pm(libm::round(pm) as i64)
}
