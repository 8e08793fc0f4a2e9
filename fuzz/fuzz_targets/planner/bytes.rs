//! Bytes as numbers of a planner's size. Behind the last there are zeros.

use abbe_core::plan::Limits;
use abbe_core::plan::curve::Place;
use abbe_core::plan::transfer::State;

pub(crate) struct Bytes<'a> {
    left: &'a [u8],
}

/// A stage's limits at 10 kHz, pm and ticks: 20 mm/s, 0.5 m/s², 20 m/s³.
const STAGE: [f64; 3] = [2e6, 5000.0, 20.0];

impl<'a> Bytes<'a> {
    pub(crate) fn of(left: &'a [u8]) -> Self {
        Self { left }
    }

    pub(crate) fn byte(&mut self) -> u8 {
        let [byte] = self.some();
        byte
    }

    fn some<const N: usize>(&mut self) -> [u8; N] {
        let mut some = [0; N];
        let (now, later) = self.left.split_at(N.min(self.left.len()));
        some[..now.len()].copy_from_slice(now);
        self.left = later;
        some
    }

    /// Any number at all, NaN and infinity among them.
    pub(crate) fn any(&mut self) -> f64 {
        f64::from_le_bytes(self.some())
    }

    /// 0 … 1, both of which can be met.
    pub(crate) fn part(&mut self) -> f64 {
        f64::from(u16::from_le_bytes(self.some())) / f64::from(u16::MAX)
    }

    /// −1 … 1; 0 is 0.
    pub(crate) fn signed(&mut self) -> f64 {
        (f64::from(i16::from_le_bytes(self.some())) / f64::from(i16::MAX)).max(-1.0)
    }

    /// Any size between two powers of ten.
    pub(crate) fn decades(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(low + (high - low) * self.part())
    }

    /// A length of either sign, 1 pm to 10ⁿ pm, or none; 0 is none.
    pub(crate) fn length(&mut self, high: f64) -> f64 {
        let part = self.signed();
        if part == 0.0 { 0.0 } else { part.signum() * 10_f64.powf(high * part.abs()) }
    }

    /// Limits so many decades about those of a stage.
    pub(crate) fn limits(&mut self, decades: f64) -> Limits {
        let [speed, acceleration, jerk] = STAGE.map(|middle| middle * self.decades(-decades, decades));
        Limits { speed, acceleration, jerk }
    }

    /// A state that can be left within limits and come to within them, up to their very edge.
    pub(crate) fn state(&mut self, limits: &Limits, position: f64) -> State {
        let Limits { speed, acceleration, jerk } = *limits;
        let speed_part = self.signed();
        // No more than full jerk ends before full speed.
        let most = (2.0 * jerk * speed * (1.0 - speed_part.abs())).sqrt().min(acceleration);
        State { position, speed: speed_part * speed, acceleration: self.signed() * most }
    }

    /// A place of a stage, in whole picometres.
    pub(crate) fn place(&mut self) -> Place {
        [(); 2].map(|()| (1e11 * self.part()).round())
    }
}
