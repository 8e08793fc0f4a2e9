//! A stage that goes forth and back, each way at an acceleration of its own: places at any clock, in closed form.
//!
//! Times are clocks of 125 MHz, places 2⁻³² of a signal period.

use super::grating::PERIOD_UM;
use abbe_core::front::CLOCK_HZ;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// One period.
pub(crate) const PERIOD: i64 = 1 << 32;

/// What a stage does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// The fastest it goes; each way has a top speed between nine tenths of this and this.
    pub(crate) speed_mm_s: f64,
    /// Each way has an acceleration from here to there.
    pub(crate) accelerations_m_s2: [f64; 2],
}

impl Pace {
    /// Of a stage that has a light table or a heavy one.
    pub(crate) const fn of_a_stage(speed_mm_s: f64) -> Self {
        Self { speed_mm_s, accelerations_m_s2: [0.1, 10.0] }
    }
}

/// A stretch at a constant acceleration.
#[derive(Clone, Copy, Debug, Default)]
struct Stretch {
    clocks: u64,
    /// At its beginning, a clock.
    speed: f64,
    /// Change of the speed, a clock.
    change: f64,
}

/// A turn: which way from there on, and where.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    pub(crate) ahead: bool,
    pub(crate) place: i64,
}

#[derive(Debug)]
pub(crate) struct Motion {
    random: Pcg64Mcg,
    pace: Pace,
    ahead: bool,
    stretches: [Stretch; 3],
    which: usize,
    begun: u64,
    from: i64,
}

impl Motion {
    /// Begins at rest, at clock 0, somewhere in the first period.
    pub(crate) fn new(pace: Pace, seed: u64) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let from = random.random_range(0..PERIOD);
        let mut motion =
            Self { random, pace, ahead: true, stretches: Default::default(), which: 0, begun: 0, from };
        motion.stretches = motion.way();
        motion
    }

    /// The place at a clock of the present stretch.
    #[inline]
    pub(crate) fn at(&self, clock: u64) -> i64 {
        let Stretch { speed, change, .. } = self.stretches[self.which];
        let clocks = (clock - self.begun) as f64;
        self.from + ((speed + change / 2.0 * clocks) * clocks) as i64
    }

    /// The speed at a clock of the present stretch, without its sign.
    pub(crate) fn speed(&self, clock: u64) -> f64 {
        let Stretch { speed, change, .. } = self.stretches[self.which];
        (speed + change * (clock - self.begun) as f64).abs()
    }

    /// The clock at which the present stretch ends.
    pub(crate) fn end(&self) -> u64 {
        self.begun + self.stretches[self.which].clocks
    }

    /// The next stretch; the turn if it begins with one.
    pub(crate) fn go_on(&mut self) -> Option<Turn> {
        let end = self.end();
        (self.from, self.begun) = (self.at(end), end);
        self.which = (self.which + 1) % self.stretches.len();
        (self.which == 0).then(|| {
            self.ahead = !self.ahead;
            self.stretches = self.way();
            Turn { ahead: self.ahead, place: self.from }
        })
    }

    /// From rest to rest.
    fn way(&mut self) -> [Stretch; 3] {
        let unit = PERIOD as f64 / (PERIOD_UM * 1e-6);
        let clock_s = 1.0 / f64::from(CLOCK_HZ);
        let [least, most] = self.pace.accelerations_m_s2;
        let acceleration = least * (most / least).powf(self.random.random());
        let acceleration = acceleration * unit * clock_s * clock_s;
        let top = self.pace.speed_mm_s * self.random.random_range(0.9..=1.0) * 1e-3 * unit * clock_s;
        let length = self.length(top * top / acceleration);
        let ramp = (top.min((length * acceleration).sqrt()) / acceleration).ceil();
        let reached = ramp * acceleration;
        let rest = ((length / reached - ramp).max(0.0)).ceil();
        let sign = if self.ahead { 1.0 } else { -1.0 };
        let stretch = |clocks: f64, speed: f64, change: f64| Stretch {
            clocks: clocks as u64,
            speed: sign * speed,
            change: sign * change,
        };
        [stretch(ramp, 0.0, acceleration), stretch(rest, reached, 0.0), stretch(ramp, reached, -acceleration)]
    }

    /// Half of the ways are shorter than a period, as of a stage that shakes; a quarter are long enough for the top
    /// speed, which takes `ramps`.
    fn length(&mut self, ramps: f64) -> f64 {
        let periods = PERIOD as f64 * self.random.random_range(0.001..1.0);
        match self.random.random_range(0..4) {
            0 | 1 => periods,
            2 => 16.0 * periods,
            _ => ramps + 1024.0 * periods,
        }
    }
}
