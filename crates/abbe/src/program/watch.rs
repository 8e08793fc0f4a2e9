//! What a stage shows at every tick of a program: how well it follows, for a file, and for a picture.

use super::picture::Thinned;
use crate::failure::Failure;
use crate::folder::Growing;
use abbe_core::machine::State;
use abbe_core::plan::steps::SetPoint;
use abbe_core::{Controller, Status};
use std::fmt::Write as _;
use std::path::Path;

/// Heads the rows of a trace: s, mm, mm/s and mm/s², the set-point in the stage frame and, with m, where the stage is.
const HEADER: &str = "t_s,x_mm,y_mm,vx,vy,ax,ay,xm_mm,ym_mm\n";

/// How far an axis was from its set-point while the path went on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Following {
    /// µm.
    pub(crate) most_um: f64,
    squares: f64,
    ticks: u64,
}

impl Following {
    fn see(&mut self, error_um: f64) {
        self.most_um = self.most_um.max(error_um.abs());
        self.squares += error_um * error_um;
        self.ticks += 1;
    }

    /// µm.
    pub(crate) fn rms_um(&self) -> f64 {
        if self.ticks == 0 { 0.0 } else { (self.squares / self.ticks as f64).sqrt() }
    }
}

/// A stage at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    pub(super) t_s: f64,
    pub(super) asked_mm: [f64; 2],
    pub(super) measured_mm: [f64; 2],
    pub(super) error_um: [f64; 2],
}

/// Looks at a stage from the tick of its first motion on.
pub(crate) struct Watch {
    tick_hz: f64,
    /// Since the first motion.
    ticks: Option<u64>,
    pub(crate) following: [Following; 2],
    file: Option<Growing>,
    /// A row that is being written.
    row: String,
    thinned: Option<Thinned>,
}

impl Watch {
    /// For a trace, and for a picture if one is wanted.
    pub(crate) fn new(tick_hz: f64, trace: Option<&Path>, is_drawn: bool) -> Result<Self, Failure> {
        let mut file = trace.map(Growing::new).transpose()?;
        if let Some(file) = &mut file {
            file.write(HEADER.as_bytes())?;
        }
        let thinned = is_drawn.then(Thinned::default);
        Ok(Self { tick_hz, ticks: None, following: Default::default(), file, row: String::new(), thinned })
    }

    /// The first motion begins with the next tick.
    pub(super) fn begin(&mut self, controller: &Controller<2>) -> Result<(), Failure> {
        if self.ticks.is_none() {
            self.ticks = Some(0);
            self.keep(controller, &controller.status())?;
        }
        Ok(())
    }

    /// Whether anything was there to see.
    pub(crate) fn has_begun(&self) -> bool {
        self.ticks.is_some()
    }

    /// Looks at a tick.
    pub(super) fn see(&mut self, controller: &Controller<2>, status: &Status<2>) -> Result<(), Failure> {
        let Some(ticks) = &mut self.ticks else { return Ok(()) };
        *ticks += 1;
        if status.state == State::Moving {
            for (following, axis) in self.following.iter_mut().zip(&status.axes) {
                following.see(axis.following_error.um());
            }
        }
        self.keep(controller, status)
    }

    fn keep(&mut self, controller: &Controller<2>, status: &Status<2>) -> Result<(), Failure> {
        let t_s = self.ticks.unwrap_or(0) as f64 / self.tick_hz;
        let sample = Sample {
            t_s,
            asked_mm: status.axes.each_ref().map(|axis| axis.set_point.mm()),
            measured_mm: status.axes.each_ref().map(|axis| axis.position.mm()),
            error_um: status.axes.each_ref().map(|axis| axis.following_error.um()),
        };
        if let Some(thinned) = &mut self.thinned {
            thinned.add(sample);
        }
        if self.file.is_some() {
            self.write(&sample, controller.set_points())?;
        }
        Ok(())
    }

    /// Nine decimals of a millimetre are a picometre.
    fn write(&mut self, sample: &Sample, set_points: [SetPoint; 2]) -> Result<(), Failure> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let Sample { t_s, asked_mm: [x, y], measured_mm: [xm, ym], .. } = *sample;
        let [vx, vy] = set_points.map(|set_point| speed_mm_s(set_point.speed, self.tick_hz));
        let [ax, ay] = set_points.map(|set_point| acceleration_mm_s2(set_point.acceleration, self.tick_hz));
        self.row.clear();
        _ = writeln!(self.row, "{t_s:.9},{x:.9},{y:.9},{vx:.6},{vy:.6},{ax:.6},{ay:.6},{xm:.9},{ym:.9}");
        file.write(self.row.as_bytes())
    }

    /// The picture, if one is wanted.
    pub(crate) fn svg(&self, title: &str) -> anyhow::Result<Option<String>> {
        self.thinned.as_ref().map(|thinned| thinned.svg(title)).transpose()
    }

    /// The file takes its place.
    pub(crate) fn done(&mut self) -> Result<(), Failure> {
        self.file.take().map_or(Ok(()), Growing::done)
    }
}

/// From pm a tick with 38 fractional bits.
fn speed_mm_s(speed: i64, tick_hz: f64) -> f64 {
    speed as f64 / (1_u64 << 38) as f64 * tick_hz / abbe_core::units::PM_PER_MM
}

/// From pm a tick² with 46 fractional bits.
fn acceleration_mm_s2(acceleration: i64, tick_hz: f64) -> f64 {
    acceleration as f64 / (1_u64 << 46) as f64 * tick_hz * tick_hz / abbe_core::units::PM_PER_MM
}

#[cfg(test)]
mod tests {
    use super::Following;

    #[test]
    fn following_is_the_most_and_the_mean_square() {
        let mut following = Following::default();
        assert_eq!(following.rms_um(), 0.0);
        for error_um in [3.0, -4.0, 0.0, 0.0] {
            following.see(error_um);
        }
        assert_eq!((following.most_um, following.rms_um()), (4.0, 2.5));
    }
}
