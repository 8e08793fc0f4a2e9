//! A glass scale with its reading head, and the front end behind it.
//!
//! e(r) = actual − reading: the slope and curvature that paper A measured (row A10), graduation error, cyclic error,
//! and the expansion of the glass.

use crate::analogue::{Head, HeadEvent};
use crate::noise::Noise;
use crate::plant::{HeadPlant, ScalePlant};
use crate::trig::{floor, sin_turns};
use abbe_core::edge::SinCos;
use abbe_core::front::quadrature::levels;
use abbe_core::front::{QuadratureCounter, Reading};

/// First node of the graduation table, µm, and the distance of its nodes.
const TABLE_LOW_UM: f64 = -10_000.0;
const TABLE_STEP_UM: f64 = 250.0;
const TABLE_NODES: usize = 521;
/// Farther from the reference mark than this, its next place is drawn.
const INDEX_FAR_COUNTS: i64 = 1000;
/// Random waves that make the graduation error.
const WAVES: usize = 96;

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

/// A scale; lengths in µm.
#[derive(Clone, Debug)]
pub struct Scale {
    settings: ScalePlant,
    graduation: Vec<f64>,
    cyclic_phase: f64,
    noise: Noise,
    counter: QuadratureCounter,
    /// Count at which the head stands.
    count: i64,
    reading_um: f64,
    /// Clocks of the front end so far.
    clock: u64,
    /// Clocks that a disturbance has taken from the next move.
    taken: u64,
    /// Edges of this tick with their clocks, if they are to be remembered.
    edges: Option<Vec<(u64, Lines)>>,
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
    /// An analogue head, whose comparators make the lines.
    head: Option<Head>,
}

impl Scale {
    /// A scale with square signals whose head stands at `place_um`. Power-on: the counter starts at zero there.
    pub fn new(settings: &ScalePlant, place_um: f64, seed: u64, name: &str) -> Self {
        Self::with_head(settings, None, place_um, seed, name)
    }

    /// The same, with an analogue head if there is one.
    pub fn with_head(
        settings: &ScalePlant,
        head: Option<&HeadPlant>,
        place_um: f64,
        seed: u64,
        name: &str,
    ) -> Self {
        let mut noise = Noise::new(seed, &format!("scale {name}"));
        let graduation = graduation(settings, &mut noise);
        let cyclic_phase = noise.uniform(0.0, 1.0);
        let index_phase = noise.uniform(0.0, 1.0);
        let mut scale = Self {
            settings: settings.clone(),
            graduation,
            cyclic_phase,
            noise,
            counter: QuadratureCounter::new(settings.filter_clocks, false, false),
            count: 0,
            reading_um: place_um,
            clock: 0,
            taken: 0,
            edges: None,
            edges_from: 0,
            index_phase,
            index_count: 0,
            index_drawn: true,
            expansion: 0.0,
            connected: true,
            head: None,
        };
        for _ in 0..8 {
            scale.reading_um = place_um - scale.error_um(scale.reading_um);
        }
        scale.count = (scale.reading_um / scale.settings.count_um).floor() as i64;
        let (a, b) = levels(scale.count);
        scale.counter = QuadratureCounter::new(scale.settings.filter_clocks, a, b);
        if let Some(head) = head {
            scale.put_on(Head::new(head, settings.grating_um, scale.reading_um, seed, name));
        }
        scale.draw_index();
        scale
    }

    /// actual − reading at a reading, µm.
    pub fn error_um(&self, reading_um: f64) -> f64 {
        let s = &self.settings;
        let mm = reading_um * 1e-3;
        let slow = s.error_offset_um + (s.error_slope_um_mm + s.error_curvature_um_mm2 * mm) * mm;
        let cyclic = s.cyclic_um * sin_turns(reading_um / s.grating_um + self.cyclic_phase);
        slow + self.expansion * reading_um + self.graduation_um(reading_um) + cyclic
    }

    fn graduation_um(&self, reading_um: f64) -> f64 {
        let along = ((reading_um - TABLE_LOW_UM) / TABLE_STEP_UM).clamp(0.0, (TABLE_NODES - 2) as f64);
        let node = along as usize;
        let fraction = along - node as f64;
        let (left, right) = (self.graduation[node], self.graduation[node + 1]);
        left + fraction * (right - left)
    }

    /// The glass is `kelvin` warmer than 20 °C.
    pub fn warm(&mut self, kelvin: f64) {
        if let Some(head) = &mut self.head {
            head.warm(kelvin);
        }
        self.expansion = self.settings.expansion_um_m_k * 1e-6 * kelvin;
    }

    /// A pulled connector leaves both lines where the receiver's fail-safe puts them.
    pub fn connect(&mut self, connected: bool) {
        self.connected = connected;
        if let Some(head) = &mut self.head {
            head.connect(connected);
        }
        if !connected {
            self.edge(self.clock, UNPLUGGED);
        }
    }

    /// Puts an analogue head on: from now on its comparators make the lines.
    fn put_on(&mut self, mut head: Head) {
        let (a, b) = head.compare(self.reading_um);
        // Its offsets may put the comparators a count beside the true place.
        self.count =
            (-1..=2).map(|off| self.count + off).find(|&count| levels(count) == (a, b)).unwrap_or(self.count);
        self.counter = QuadratureCounter::new(self.settings.filter_clocks, a, b);
        self.head = Some(head);
    }

    /// The analogue head moves from one reading to the present one within `clocks`: in parts of a 24th of a period, so that
    /// the comparators see every crossing.
    fn glide_to(&mut self, from_um: f64, clocks: u64) {
        let way = self.reading_um - from_um;
        let parts = (way.abs() * 24.0 / self.settings.grating_um) as u64 + 1;
        let far = (self.true_count(self.reading_um) - self.index_count).abs() > INDEX_FAR_COUNTS;
        if far && !self.index_drawn {
            self.draw_index();
        }
        self.index_drawn = far;
        let clocks = clocks.saturating_sub(core::mem::take(&mut self.taken));
        let mut before = self.lines_at(from_um);
        for part in 1..=parts {
            let reading = from_um + way * part as f64 / parts as f64;
            self.compare(reading);
            let now = self.lines_at(reading);
            if self.connected && now != before {
                self.edge(self.clock + clocks * part / (parts + 1), now);
            }
            before = now;
        }
        self.clock += clocks;
    }

    /// Lets the comparators look, and follows them by a count.
    fn compare(&mut self, reading_um: f64) {
        let Some(head) = &mut self.head else { return };
        let place = |lines| (0..4).find(|&n| levels(n) == lines).unwrap_or(0);
        let turned = place(head.compare(reading_um)) - place(levels(self.count));
        self.count += [0, 1, 2, -1][turned.rem_euclid(4) as usize];
    }

    /// The count in which a reading truly lies.
    fn true_count(&self, reading_um: f64) -> i64 {
        floor(reading_um / self.settings.count_um)
    }

    /// What the converter of an analogue head gives, the head going `um_s`.
    pub fn sample(&mut self, um_s: f64) -> Option<SinCos> {
        let reading = self.reading_um;
        self.head.as_mut()?.sample(reading, um_s)
    }

    /// Something happens to the analogue head.
    pub fn head_event(&mut self, event: HeadEvent) {
        if let Some(head) = &mut self.head {
            head.happen(event);
        }
    }

    /// The lines as they stand.
    pub fn lines(&self) -> Lines {
        self.lines_at(self.reading_um)
    }

    /// The lines with the head at a reading. With an analogue head the mark is a place of the grating: comparators that have
    /// lost their signal do not move it.
    fn lines_at(&self, reading_um: f64) -> Lines {
        if !self.connected {
            return UNPLUGGED;
        }
        let (a, b) = levels(self.count);
        let at = if self.head.is_some() { self.true_count(reading_um) } else { self.count };
        Lines { a, b, z: at == self.index_count }
    }

    /// From now on edges are remembered, until somebody takes them.
    pub fn remember_edges(&mut self) {
        if self.edges.is_none() {
            self.edges = Some(Vec::new());
            self.edges_from = self.clock - self.taken;
        }
    }

    /// The edges of a tick that ends now. It had `clocks_per_tick` clocks of 125 MHz, and `clocks` of those of
    /// [`Scale::move_to`].
    pub fn take_edges(&mut self, clocks_per_tick: u32, clocks: u64) -> Vec<Edge> {
        let from = core::mem::replace(&mut self.edges_from, self.clock);
        let edges = self.edges.as_mut().map(core::mem::take).unwrap_or_default();
        let clock = |at: u64| ((at - from) * u64::from(clocks_per_tick) / clocks) as u32;
        edges.into_iter().map(|(at, lines)| Edge { clock: clock(at), lines }).collect()
    }

    /// Moves the head to `place_um` within `clocks` of the front end: every edge on the way is fed to it.
    pub fn move_to(&mut self, place_um: f64, clocks: u64) {
        // The error changes by at most 5 % of the way: the last reading is a good enough place to ask for it.
        let before = self.reading_um;
        self.reading_um = place_um - self.error_um(self.reading_um);
        if self.head.is_some() {
            self.glide_to(before, clocks);
            return;
        }
        let seen = self.reading_um + self.settings.noise_um * self.noise.normal();
        let to = floor(seen / self.settings.count_um);
        let far = (to - self.index_count).abs() > INDEX_FAR_COUNTS;
        if far && !self.index_drawn {
            self.draw_index();
        }
        self.index_drawn = far;
        let step = if to > self.count { 1 } else { -1 };
        let clocks = clocks.saturating_sub(core::mem::take(&mut self.taken));
        // Evenly spaced, 16 fractional bits of a clock.
        let spacing = (clocks << 16) / (to.abs_diff(self.count) + 1);
        let mut after = 0;
        while self.count != to {
            self.count += step;
            after += spacing;
            if self.connected {
                self.edge(self.clock + (after >> 16), self.lines());
            }
        }
        self.clock += clocks;
    }

    #[inline]
    fn edge(&mut self, clock: u64, lines: Lines) {
        self.counter.edge(clock, lines.a, lines.b, lines.z);
        if let Some(edges) = &mut self.edges {
            edges.push((clock, lines));
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
        self.edge(self.clock, Lines { a: lines.a ^ on_a, b: lines.b ^ !on_a, ..lines });
        let length = self.noise.uniform(1.0, 21.0) as u64;
        self.clock += length;
        // What follows begins at its time all the same.
        self.taken += length;
        self.edge(self.clock, lines);
    }

    /// What a tick reads.
    pub fn read(&mut self) -> Reading {
        self.counter.read(self.clock)
    }

    /// Where the head reads itself, µm, before it is cut into counts.
    pub fn position_um(&self) -> f64 {
        self.reading_um
    }
}

/// A stationary error of the given rms and correlation exp(−(d/length)²), at the nodes, with mean zero.
fn graduation(settings: &ScalePlant, noise: &mut Noise) -> Vec<f64> {
    let spread = core::f64::consts::SQRT_2 / (settings.graduation_length_mm * 1e3) / core::f64::consts::TAU;
    let waves: Vec<(f64, f64)> =
        (0..WAVES).map(|_| (spread * noise.normal(), noise.uniform(0.0, 1.0))).collect();
    let raw: Vec<f64> = (0..TABLE_NODES)
        .map(|node| {
            let at = TABLE_LOW_UM + node as f64 * TABLE_STEP_UM;
            waves.iter().map(|(frequency, phase)| sin_turns(frequency * at + phase)).sum()
        })
        .collect();
    normalised(raw, settings.graduation_rms_um)
}

/// Values shifted to mean zero and scaled to `rms`.
pub(crate) fn normalised(mut values: Vec<f64>, rms: f64) -> Vec<f64> {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let now = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
    let scale = if now > 0.0 { rms / now } else { 0.0 };
    for value in &mut values {
        *value = (*value - mean) * scale;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plant() -> ScalePlant {
        ScalePlant {
            grating_um: 20.0,
            count_um: 0.1,
            error_offset_um: 1.021,
            error_slope_um_mm: 0.6397,
            error_curvature_um_mm2: 0.0168,
            graduation_rms_um: 0.3,
            graduation_length_mm: 5.0,
            cyclic_um: 0.15,
            noise_um: 0.005,
            expansion_um_m_k: 8.0,
            index_mm: 0.0,
            index_jitter_counts: 1.0,
            filter_clocks: 4,
            glitch_probability: 0.0,
        }
    }

    #[test]
    fn not_a_count_is_lost_over_forward_and_back_with_disturbances() {
        let mut scale = Scale::new(&plant(), 5000.0, 1, "x");
        let start = scale.count;
        for step in 0..40_000i32 {
            let phase = f64::from(step) / 40_000.0;
            scale.move_to(5000.0 + 3000.0 * sin_turns(3.0 * phase), 500);
            if step % 7 == 0 {
                scale.glitch();
                scale.move_to(5000.0 + 3000.0 * sin_turns(3.0 * phase), 500);
            }
            assert_eq!(scale.read().illegal, 0);
        }
        scale.move_to(5000.0, 500);
        scale.move_to(5000.0, 500);
        assert_eq!(i64::from(scale.read().counter.cast_signed()), scale.count - start);
    }

    #[test]
    fn reading_and_error_make_the_place() {
        let mut scale = Scale::new(&plant(), 90_000.0, 2, "y");
        for _ in 0..5 {
            scale.move_to(90_000.0, 500);
        }
        let reading = scale.position_um();
        assert!((reading + scale.error_um(reading) - 90_000.0).abs() < 1e-3);
        // Paper A's Y axis at 90 mm: 194.7 µm, and what graduation and cyclic error add.
        assert!((scale.error_um(90_000.0) - 194.7).abs() < 1.5);
    }

    #[test]
    fn graduation_and_cyclic_error_have_their_sizes() {
        let scale = Scale::new(&plant(), 0.0, 3, "x");
        let mean_square: f64 =
            (0..1000).map(|i| scale.graduation_um(f64::from(i) * 100.0).powi(2)).sum::<f64>() / 1000.0;
        assert!((0.2..0.4).contains(&mean_square.sqrt()), "{}", mean_square.sqrt());
        // Neighbours within a grating period differ by the cyclic error alone.
        let inside = (0..200).map(|i| {
            let at = 40_000.0 + f64::from(i) * 0.1;
            scale.error_um(at) - 0.6397e-3 * at - 0.0168e-6 * at * at
        });
        let (low, high) = inside.fold((f64::MAX, f64::MIN), |(l, h), e| (l.min(e), h.max(e)));
        assert!((0.28..0.36).contains(&(high - low)), "{}", high - low);
    }

    #[test]
    fn warm_glass_reads_too_little() {
        let mut scale = Scale::new(&plant(), 0.0, 4, "x");
        let cold = scale.error_um(100_000.0);
        scale.warm(1.5);
        assert!((scale.error_um(100_000.0) - cold - 1.2).abs() < 1e-9);
    }
}
