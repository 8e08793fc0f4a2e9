//! A sweep that was asked for, held against the stage before anything moves.

use crate::cli::{AxisName, Sweep};
use crate::failure::Failure;
use crate::preset::Preset;
use crate::program::travel::Travel;
use abbe_core::Pos;
use abbe_core::command::axis_name;
use abbe_core::front::compare::{MOST, Places, Sampled, When};
use abbe_core::plan::compare::Axis;
use abbe_core::plan::scan::{Lines, Order, Scan, ScanError, ScanPlan};
use abbe_core::plan::segment::Feed;
use abbe_core::plan::{Limits, Segment};
use abbe_core::units::PM_PER_MM;

/// Play of two counts: one is what a standing reading may flicker by.
const PLAY_COUNTS: f64 = 2.0;
/// The least play, µm: by what a stage that creeps, a tenth of a millimetre a second, goes back now and then. At the
/// resonance of a stepper no play helps; there another speed does (docs/scans.md).
const LEAST_PLAY_UM: f64 = 1.0;

/// A sweep that the stage can do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planned {
    pub(crate) scan: Scan,
    pub(crate) plan: ScanPlan,
    pub(crate) segment: Segment,
    /// Along the fast axis, pm.
    pub(crate) places: Places,
    /// Of both axes.
    pub(crate) limits: [Limits; 2],
}

impl Planned {
    pub(crate) fn new(preset: &Preset, asked: &Sweep) -> Result<Self, Failure> {
        let config = &preset.controller.config;
        let limits = config.axes.each_ref().map(|axis| axis.limits);
        let scan = scan(preset, asked)?;
        let refused = |why: ScanError| match why {
            ScanError::TooFast { axis, .. } => {
                let limit = preset.controller.settings.axes[axis].speed_mm_s;
                let speed = asked.speed;
                Failure::usage(format!(
                    "--speed {speed}: {why} ({speed} mm/s, and the limit is {limit} mm/s)"
                ))
            }
            _ => Failure::usage(why),
        };
        let plan = scan.plan(&limits).map_err(refused)?;
        let [x, y] = Travel::of(preset).0;
        plan.fits(&[[x[0], y[0]], [x[1], y[1]]]).map_err(refused)?;
        let segment = Segment::scanning(&scan, &limits).map_err(refused)?;
        let planned = Self { scan, plan, segment, places: places(preset, asked, &scan)?, limits };
        planned.check_pace(asked)?;
        planned.check_reach()?;
        Ok(planned)
    }

    /// Number of the fast axis.
    pub(crate) fn fast(&self) -> usize {
        self.scan.fast.index()
    }

    /// Number of the other one.
    pub(crate) fn slow(&self) -> usize {
        1 - self.fast()
    }

    /// Of the area along the fast axis.
    pub(crate) fn length(&self) -> Pos {
        let [low, high] = self.scan.corners;
        high[self.fast()] - low[self.fast()]
    }

    /// A place by its number.
    pub(crate) fn place(&self, number: u32) -> Pos {
        Pos::from_pm(self.places.first + i64::from(number) * self.places.pitch)
    }

    /// More than fits into a tick would be lost.
    fn check_pace(&self, asked: &Sweep) -> Result<(), Failure> {
        let in_a_tick = self.scan.speed / self.places.pitch as f64;
        if in_a_tick <= MOST as f64 {
            return Ok(());
        }
        Err(Failure::usage(format!(
            "--every {}: at {} mm/s that are {in_a_tick:.1} events in a tick, and {MOST} fit; ask for a larger distance, \
             or sweep slower",
            asked.every, asked.speed
        )))
    }

    /// A turn within the play would hide the places before it from the way back. Twice the play leaves some for the
    /// following error.
    fn check_reach(&self) -> Result<(), Failure> {
        let play = Pos::from_pm(self.places.play);
        let reach = self.plan.room().into_iter().min().unwrap_or_default();
        if self.plan.lines() == 1 || reach >= play + play {
            return Ok(());
        }
        Err(Failure::usage(format!(
            "the sweep reaches {:.6} µm beyond the area, and must by twice the play of {:.6} µm at least, or places near the \
             edges are not passed in both directions; give more --settle, or less --play",
            reach.um(),
            play.um()
        )))
    }
}

fn scan(preset: &Preset, asked: &Sweep) -> Result<Scan, Failure> {
    let [width, height] = asked.area;
    if width < 0.0 || height < 0.0 {
        return Err(Failure::usage(format!("--area {width}x{height}: width and height cannot be below 0")));
    }
    let low = asked.at.unwrap_or_else(|| in_the_middle(preset, asked.area));
    let tick_hz = preset.controller.settings.tick_hz;
    Ok(Scan {
        corners: [low, [low[0] + width, low[1] + height]].map(|corner| corner.map(Pos::from_mm)),
        fast: match asked.along {
            AxisName::X => Axis::X,
            AxisName::Y => Axis::Y,
        },
        lines: match asked.pitch {
            Some(um) => Lines::Pitch(Pos::from_um(um)),
            None => Lines::Number(asked.lines.unwrap_or(1)),
        },
        order: if asked.fly_back { Order::FlyBack } else { Order::Serpentine },
        // As a segment holds it, or else its plan would be another one.
        speed: Feed::from_pm(asked.speed * PM_PER_MM / tick_hz).pm(),
        settle: (asked.settle * 1e-3 * tick_hz).round() as u32,
    })
}

fn in_the_middle(preset: &Preset, area_mm: [f64; 2]) -> [f64; 2] {
    let travel =
        preset.controller.settings.axes.each_ref().map(|axis| [axis.travel_low_mm, axis.travel_high_mm]);
    [0, 1].map(|axis| 0.5 * (travel[axis][0] + travel[axis][1] - area_mm[axis]))
}

/// From the low edge of the area on. A way back in between fires nothing.
fn places(preset: &Preset, asked: &Sweep, scan: &Scan) -> Result<Places, Failure> {
    let fast = scan.fast.index();
    let [low, high] = scan.corners.map(|corner| corner[fast]);
    let count_um = preset.controller.settings.axes[fast].count_um;
    let play_um = asked.play.unwrap_or((PLAY_COUNTS * count_um).max(LEAST_PLAY_UM));
    let pitch = Pos::from_um(asked.every).pm();
    let after_the_first = (high - low).pm().checked_div(pitch).unwrap_or(0);
    let number = u32::try_from(after_the_first).ok().and_then(|places| places.checked_add(1));
    let number = number.ok_or_else(|| {
        Failure::usage(format!(
            "--every {}: along {} that are {after_the_first} places, and {} fit; ask for a larger distance",
            asked.every,
            axis_name(fast),
            u32::MAX
        ))
    })?;
    let when = if asked.fly_back { When::Up } else { When::Both };
    let places = Places { first: low.pm(), pitch, number, when, play: Pos::from_um(play_um).pm() };
    // The stage's own judgement, before it moves.
    Sampled::new(places, 0, low).map_err(Failure::usage)?;
    Ok(places)
}
