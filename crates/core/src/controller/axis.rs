//! One axis of the controller: its sensors, its guard, its law and its drive, and what homing does to them.

use crate::compensate::ErrorMap;
use crate::design::{AxisConfig, GLIDE_BITS};
use crate::drive::Drive;
use crate::edge::AxisInputs;
use crate::guard::{Guard, Watch};
use crate::machine::homing::Homing;
use crate::plan::Ramp;
use crate::publish::{AxisStatus, Fault, HomeReport};
use crate::sense::Sense;
use crate::sense::head::Head;
use crate::servo::IncrementalPid;
use crate::units::Pos;
use crate::wide;

/// One axis: sense, guard, compensate, servo, drive.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Axis {
    pub(super) config: AxisConfig,
    pub(super) sense: Sense,
    pub(super) guard: Guard,
    pub(super) map: Option<ErrorMap>,
    /// Readings at the ends of the travel, margin included.
    pub(super) travel: [Pos; 2],
    pub(super) servo: IncrementalPid,
    pub(super) drive: Drive,
    pub(super) homing: Option<Homing>,
    pub(super) glide: Glide,
    /// Set-point of the last tick, scale frame.
    pub(super) set_point: Pos,
    /// The same in the stage frame, if it was made from there.
    pub(super) place: Pos,
    pub(super) homed: bool,
    pub(super) home: HomeReport,
    /// The side of the zero that counts: see [`Axis::pass_zero`].
    pub(super) is_below_zero: bool,
    pub(super) illegal: u32,
    pub(super) glitches: u32,
}

/// A set-point in the scale frame that moves at a wanted speed, for homing: the zero is not known yet, so there is no
/// stage frame and no path.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Glide {
    pub(super) ramp: Ramp,
    pub(super) wanted: i64,
    /// Part of a picometre left over, [`GLIDE_BITS`] fractional bits.
    pub(super) rest: i64,
}

impl Axis {
    pub(super) fn new(config: &AxisConfig) -> Self {
        Self {
            config: *config,
            sense: Sense::default(),
            guard: Guard::default(),
            map: None,
            travel: [config.low - config.margin, config.high + config.margin],
            servo: IncrementalPid::default(),
            drive: Drive::default(),
            homing: None,
            glide: Glide::default(),
            set_point: Pos::ZERO,
            place: Pos::ZERO,
            homed: false,
            home: HomeReport::default(),
            is_below_zero: false,
            illegal: 0,
            glitches: 0,
        }
    }

    #[cold]
    pub(super) fn count_disturbances(&mut self, inputs: &AxisInputs) {
        self.illegal = self.illegal.wrapping_add(u32::from(inputs.illegal));
        self.glitches = self.glitches.wrapping_add(u32::from(inputs.glitches));
    }

    pub(super) fn begin_homing(&mut self, was_on: bool) {
        if !was_on {
            self.set_point = self.sense.now.position;
            self.servo.reset();
        }
        self.homing = Some(Homing::new(&self.sense.now, &self.config.homing));
        self.glide = Glide::default();
    }

    pub(super) fn guard(&mut self, number: usize, on: bool, homing: bool) -> Option<Fault> {
        let watch = Watch { set_point: self.set_point, travel: &self.travel, on, homing, homed: self.homed };
        let found = self.guard.judge(number, &self.sense.now, &watch, &self.config.guard);
        if found.is_some() || self.sense.now.illegal > 0 {
            self.doubt_the_zero(found, on);
        }
        found.map(|fault| self.in_stage_frame(fault))
    }

    #[cold]
    fn in_stage_frame(&self, fault: Fault) -> Fault {
        match fault {
            Fault::SoftLimit { axis, position } => {
                Fault::SoftLimit { axis, position: self.stage_from_scale(position) }
            }
            fault => fault,
        }
    }

    /// Counts may be missing after an encoder was lost, or when it was disturbed while nobody looked.
    #[cold]
    #[inline(never)]
    fn doubt_the_zero(&mut self, found: Option<Fault>, on: bool) {
        // The signals may have failed in the tick of another fault, and for that tick only.
        let lost = self.sense.now.signal.is_some()
            || matches!(found, Some(Fault::EncoderLost { .. } | Fault::EncoderIllegal { .. }));
        if lost || (!on && self.sense.now.illegal > 0) {
            self.homed = false;
        }
    }

    /// Where the scale reads at the ends of the travel: the guard compares readings.
    pub(super) fn find_ends(&mut self) {
        let (low, high) = (self.config.low - self.config.margin, self.config.high + self.config.margin);
        self.travel = [low, high].map(|end| self.map.as_ref().map_or(end, |map| map.scale_from_stage(end)));
    }

    pub(super) fn has_homed(&self) -> bool {
        self.homing.as_ref().is_some_and(Homing::is_done) && self.glide.ramp.is_at_rest()
    }

    pub(super) fn end_homing(&mut self, head: Option<&Head>) {
        let Some(found) = self.homing.as_ref().and_then(Homing::found) else {
            return;
        };
        self.homing = None;
        let shift = self.sense.set_origin(found.zero, &self.config.sense, head);
        let switch = (found.switch - found.zero).to_pos(self.config.sense.count_pm);
        let again = self.home.count > 0;
        self.home = HomeReport {
            count: self.home.count.saturating_add(1),
            zero_shift: again.then_some(shift),
            switch,
            switch_shift: again.then_some(switch - self.home.switch),
        };
        self.homed = true;
        // The frame moves under the stage: nothing else may.
        self.set_point = self.set_point - shift;
        self.servo.reset();
    }

    pub(super) fn is_inside(&self) -> bool {
        wide::is_within(self.set_point.way_from(self.sense.now.position), self.config.window.pm())
    }

    pub(super) fn glide(&mut self) {
        if self.homing.is_none() {
            return;
        }
        let speed = self.glide.ramp.tick(self.glide.wanted, &self.config.glide);
        let way = self.glide.rest.wrapping_add(speed);
        self.set_point = self.set_point + Pos::from_pm(way >> GLIDE_BITS);
        self.glide.rest = way & ((1 << GLIDE_BITS) - 1);
    }

    /// The place of the set-point, which from now on is where the path begins.
    pub(super) fn hold(&mut self) -> Pos {
        self.place = self.stage_from_scale(self.set_point);
        self.place
    }

    fn stage_from_scale(&self, reading: Pos) -> Pos {
        self.map.as_ref().map_or(reading, |map| map.stage_from_scale(reading))
    }

    /// Puts the set-point where the scale reads when the table is at `place`.
    pub(super) fn follow(&mut self, place: Pos) {
        // From one tick to the next the reading goes about as far as the table.
        let near = Pos::from_pm(self.set_point.pm().wrapping_add(place.way_from(self.place)));
        self.place = place;
        self.set_point = self.map.as_ref().map_or(place, |map| map.scale_from_stage_near(place, near));
    }

    /// The reading is on the other side of the zero: only a count beyond is it passed, or a stage that stands there would
    /// pass it again and again. Before homing there is no zero to be passed, and homing moves it.
    #[cold]
    fn pass_zero(&mut self, reading: Pos, status: &mut AxisStatus) {
        let known = status.homed && self.homed;
        if known && wide::is_within(reading.pm(), i64::from(self.config.sense.count_pm)) {
            return;
        }
        self.is_below_zero = reading.pm() < 0;
        status.zero_crossings = status.zero_crossings.wrapping_add(u32::from(known));
    }

    pub(super) fn publish(&mut self, status: &mut AxisStatus, target: Pos, set_point: Pos) {
        let reading = self.sense.now.position;
        let following_error = Pos::from_pm(self.set_point.way_from(reading));
        status.position = self.stage_from_scale(reading);
        status.set_point = set_point;
        status.target = target;
        if (reading.pm() < 0) != self.is_below_zero {
            self.pass_zero(reading, status);
        }
        status.reading = reading;
        status.following_error = following_error;
        status.in_window = self.is_inside();
        status.homed = self.homed;
        status.mapped = self.map.is_some();
        status.limit_low = self.sense.now.limit_low;
        status.limit_high = self.sense.now.limit_high;
        status.illegal = self.illegal;
        status.glitches = self.glitches;
        if status.home.count != self.home.count {
            status.home = self.home;
        }
    }
}
