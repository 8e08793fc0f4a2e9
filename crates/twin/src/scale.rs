//! A glass scale with its reading head, and the front end behind it. The head is digital, or an analogue
//! [`Head`] whose comparators make the edges.
//!
//! e(r) = actual − reading: the slope and curvature that paper A measured (row A10), graduation error, cyclic error,
//! and the expansion of the glass.

use crate::analogue::Head;
use crate::noise::Noise;
use crate::plant::{AxisPlant, ScalePlant};
use crate::trig::{floor, sin_turns};
use crate::wander::Wander;
use abbe_core::edge::SinCos;
use abbe_core::front::quadrature::levels;
use abbe_core::front::{QuadratureCounter, Reading, Setup};

/// Farther from the reference mark than this, its next place is drawn.
const INDEX_FAR_COUNTS: i64 = 1000;

/// The three lines of an encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lines {
    /// Level of A.
    pub a: bool,
    /// Level of B.
    pub b: bool,
    /// Level of Z, the reference mark.
    pub z: bool,
}

/// The receiver's fail-safe levels, when no encoder is plugged in.
const UNPLUGGED: Lines = Lines { a: true, b: true, z: false };

/// The lines have these levels from this moment on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Clocks of 125 MHz since the tick began.
    pub clock: u32,
    /// Levels.
    pub lines: Lines,
}

/// What takes the edges.
#[derive(Clone, Debug)]
struct FrontEnd {
    counter: QuadratureCounter,
    /// Edges of this tick with their clocks, if they are to be remembered.
    edges: Option<Vec<(u64, Lines)>>,
}

impl FrontEnd {
    fn new(setup: Setup, clock_hz: u32, lines: Lines) -> Self {
        let filter = setup.filter_at(clock_hz);
        Self { counter: QuadratureCounter::decoding(setup.decode, filter, lines.a, lines.b), edges: None }
    }

    #[inline]
    fn edge(&mut self, clock: u64, lines: Lines) {
        self.counter.edge(clock, lines.a, lines.b, lines.z);
        if let Some(edges) = &mut self.edges {
            edges.push((clock, lines));
        }
    }
}

/// A scale; lengths in µm.
#[derive(Clone, Debug)]
pub struct Scale {
    settings: ScalePlant,
    graduation: Wander,
    cyclic_phase: f64,
    noise: Noise,
    front_end: FrontEnd,
    head: Option<Head>,
    /// Count at which a digital head stands.
    count: i64,
    reading_um: f64,
    /// Where the head saw itself last, with its noise.
    seen_um: f64,
    /// Clocks of the front end so far.
    clock: u64,
    /// Clocks that a disturbance has taken from the next move.
    taken: u64,
    /// Clocks at which the tick began.
    edges_from: u64,
    /// Where the reference mark lies between two counts, 0 … 1.
    index_phase: f64,
    /// Count at which the index pulse will come this time.
    index_count: i64,
    /// It has been drawn since the head was last near it.
    index_drawn: bool,
    expansion: f64,
    connected: bool,
}

impl Scale {
    /// The scale of an axis whose head stands at `place_um`, and a front end of `clock_hz` clocks a second that the
    /// controller's builder has set up. Power-on: the counter starts at zero there.
    pub fn new(axis: &AxisPlant, setup: Setup, clock_hz: u32, place_um: f64, seed: u64, name: &str) -> Self {
        let settings = &axis.scale;
        let mut noise = Noise::new(seed, &format!("scale {name}"));
        let (rms, length) = (settings.graduation_rms_um, settings.graduation_length_mm);
        let graduation = Wander::new(rms, length, axis.stops.high_mm, &mut noise);
        let cyclic_phase = noise.uniform(0.0, 1.0);
        let index_phase = noise.uniform(0.0, 1.0);
        let mut scale = Self {
            settings: settings.clone(),
            graduation,
            cyclic_phase,
            noise,
            front_end: FrontEnd::new(setup, clock_hz, Lines::default()),
            head: None,
            count: 0,
            reading_um: place_um,
            seen_um: 0.0,
            clock: 0,
            taken: 0,
            edges_from: 0,
            index_phase,
            index_count: 0,
            index_drawn: true,
            expansion: 0.0,
            connected: true,
        };
        for _ in 0..8 {
            scale.reading_um = place_um - scale.error_um(scale.reading_um);
        }
        scale.seen_um = scale.reading_um;
        scale.count = (scale.reading_um / scale.settings.count_um).floor() as i64;
        scale.head = Head::new(axis, scale.reading_um, seed, name);
        scale.front_end = FrontEnd::new(setup, clock_hz, scale.lines());
        scale.draw_index();
        scale
    }

    /// actual − reading at a reading, µm.
    pub fn error_um(&self, reading_um: f64) -> f64 {
        let s = &self.settings;
        let mm = reading_um * 1e-3;
        let slow = s.error_offset_um + (s.error_slope_um_mm + s.error_curvature_um_mm2 * mm) * mm;
        let cyclic = s.cyclic_um * sin_turns(reading_um / s.grating_um + self.cyclic_phase);
        slow + self.expansion * reading_um + self.graduation.at(reading_um) + cyclic
    }

    /// The glass is `kelvin` warmer than 20 °C.
    pub fn warm(&mut self, kelvin: f64) {
        self.expansion = self.settings.expansion_um_m_k * 1e-6 * kelvin;
        if let Some(head) = &mut self.head {
            head.warm(kelvin);
        }
    }

    /// The head, if it puts out a sine and a cosine.
    pub fn head_mut(&mut self) -> Option<&mut Head> {
        self.head.as_mut()
    }

    /// What the converter of an analogue head reads now.
    pub fn sample(&mut self, speed_mm_s: f64) -> Option<SinCos> {
        self.head.as_mut().and_then(|head| head.sample(self.seen_um, speed_mm_s, self.connected))
    }

    /// A pulled connector leaves both lines where the receiver's fail-safe puts them.
    pub fn connect(&mut self, connected: bool) {
        self.connected = connected;
        if !connected {
            self.front_end.edge(self.clock, UNPLUGGED);
        } else if let Some(head) = &self.head {
            self.front_end.edge(self.clock, head.lines());
        }
    }

    /// The lines as they stand.
    pub fn lines(&self) -> Lines {
        if !self.connected {
            return UNPLUGGED;
        }
        if let Some(head) = &self.head {
            return head.lines();
        }
        let (a, b) = levels(self.count);
        Lines { a, b, z: self.count == self.index_count }
    }

    /// From now on edges are remembered, until somebody takes them.
    pub fn remember_edges(&mut self) {
        if self.front_end.edges.is_none() {
            self.front_end.edges = Some(Vec::new());
            self.edges_from = self.clock - self.taken;
        }
    }

    /// The edges of a tick that ends now. It had `clocks_per_tick` clocks of 125 MHz, and `clocks` of those of
    /// [`Scale::move_to`].
    pub fn take_edges(&mut self, clocks_per_tick: u32, clocks: u64) -> Vec<Edge> {
        let from = core::mem::replace(&mut self.edges_from, self.clock);
        let edges = self.front_end.edges.as_mut().map(core::mem::take).unwrap_or_default();
        let clock = |at: u64| ((at - from) * u64::from(clocks_per_tick) / clocks) as u32;
        edges.into_iter().map(|(at, lines)| Edge { clock: clock(at), lines }).collect()
    }

    /// Moves the head to `place_um` within `clocks` of the front end: every edge on the way is fed to it.
    pub fn move_to(&mut self, place_um: f64, clocks: u64) {
        // The error changes by at most 5 % of the way: the last reading is a good enough place to ask for it.
        self.reading_um = place_um - self.error_um(self.reading_um);
        let seen = self.reading_um + self.settings.noise_um * self.noise.normal();
        let to = floor(seen / self.settings.count_um);
        let far = (to - self.index_count).abs() > INDEX_FAR_COUNTS;
        if far && !self.index_drawn {
            self.draw_index();
        }
        self.index_drawn = far;
        let clocks = clocks.saturating_sub(core::mem::take(&mut self.taken));
        let from = core::mem::replace(&mut self.seen_um, seen);
        if let Some(head) = &mut self.head {
            let (front_end, begin, connected) = (&mut self.front_end, self.clock, self.connected);
            head.go([from, seen], clocks, self.index_count, |after, lines| {
                if connected {
                    front_end.edge(begin + after, lines);
                }
            });
        } else {
            self.count_to(to, clocks);
        }
        self.clock += clocks;
    }

    /// A digital head's edges up to a count, evenly spaced within `clocks`.
    fn count_to(&mut self, to: i64, clocks: u64) {
        let step = if to > self.count { 1 } else { -1 };
        // 16 fractional bits of a clock.
        let spacing = (clocks << 16) / (to.abs_diff(self.count) + 1);
        let mut after = 0;
        while self.count != to {
            self.count += step;
            after += spacing;
            if self.connected {
                self.front_end.edge(self.clock + (after >> 16), self.lines());
            }
        }
    }

    /// The reference mark repeats to a count, no better.
    fn draw_index(&mut self) {
        let nominal = self.settings.index_mm * 1e3 / self.settings.count_um + self.index_phase;
        let jitter = self.noise.uniform(-0.5, 0.5) * self.settings.index_jitter_counts;
        self.index_count = floor(nominal + jitter);
    }

    /// A disturbance on one of the two lines, of 1 to 20 clocks: shorter than the filter or longer.
    pub fn glitch(&mut self) {
        if !self.connected {
            return;
        }
        let lines = self.lines();
        let on_a = self.noise.chance(0.5);
        self.front_end.edge(self.clock, Lines { a: lines.a ^ on_a, b: lines.b ^ !on_a, ..lines });
        let length = self.noise.uniform(1.0, 21.0) as u64;
        self.clock += length;
        // What follows begins at its time all the same.
        self.taken += length;
        self.front_end.edge(self.clock, lines);
    }

    /// What a tick reads.
    pub fn read(&mut self) -> Reading {
        self.front_end.counter.read(self.clock)
    }

    /// Where the head reads itself, µm, before it is cut into counts.
    pub fn position_um(&self) -> f64 {
        self.reading_um
    }
}

#[cfg(test)]
mod tests;
