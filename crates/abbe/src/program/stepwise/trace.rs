//! The steps in a file: a row for each, and for each place that no steps lead to.

use crate::failure::Failure;
use crate::folder::Growing;
use abbe_core::Pos;
use abbe_proto::gcode::Place;
use std::fmt::Write as _;
use std::path::Path;

/// As of a run on a stage, without what is measured there. Speed and acceleration are means: from the row before to this
/// one, and of the speeds of both.
pub(super) const HEADER: &str = "t_s,x_mm,y_mm,vx,vy,ax,ay\n";

/// A trace that is being written.
pub(crate) struct Trace {
    file: Growing,
    row: String,
    last: Option<(f64, Place)>,
    speed: [f64; 2],
}

impl Trace {
    pub(crate) fn new(file: &Path) -> Result<Self, Failure> {
        let mut file = Growing::new(file)?;
        file.write(HEADER.as_bytes())?;
        Ok(Self { file, row: String::new(), last: None, speed: [0.0; 2] })
    }

    /// Of the motion that leads there only its end is told, at rest. The same place once more is no row.
    pub(super) fn come_to(&mut self, t_s: f64, place: Place) -> Result<(), Failure> {
        if self.last.is_some_and(|(_, last)| last == place) {
            return Ok(());
        }
        (self.last, self.speed) = (Some((t_s, place)), [0.0; 2]);
        self.write(t_s, place, [0.0; 2])
    }

    pub(super) fn step(&mut self, t_s: f64, place: Place) -> Result<(), Failure> {
        let (last_s, last) = self.last.unwrap_or((t_s, place));
        let past_s = t_s - last_s;
        let speed = [0, 1].map(|axis| (place[axis] - last[axis]).mm() / past_s);
        let acceleration = [0, 1].map(|axis| (speed[axis] - self.speed[axis]) / past_s);
        (self.last, self.speed) = (Some((t_s, place)), speed);
        self.write(t_s, place, acceleration)
    }

    fn write(&mut self, t_s: f64, place: Place, [ax, ay]: [f64; 2]) -> Result<(), Failure> {
        let ([x, y], [vx, vy]) = (place.map(Pos::mm), self.speed);
        self.row.clear();
        _ = writeln!(self.row, "{t_s:.9},{x:.9},{y:.9},{vx:.6},{vy:.6},{ax:.6},{ay:.6}");
        self.file.write(self.row.as_bytes())
    }

    /// The file takes its place.
    pub(crate) fn done(self) -> Result<(), Failure> {
        self.file.done()
    }
}
