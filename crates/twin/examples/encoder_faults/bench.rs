//! A head over a grating, in motion, and what happens to it.

use super::cases::{Danger, Range, What};
use abbe_core::front::Setup;
use abbe_core::sense::ellipse::Ellipse;
use abbe_core::sense::harmonics::Harmonics;
use abbe_core::sense::head::{Config, Head};
use abbe_core::sense::health::{Findings, SignalFault};
use abbe_twin::analogue::{Channel, Dirt, HeadEvent};
use abbe_twin::noise::Noise;
use abbe_twin::scale::Scale;
use abbe_twin::{Plant, preset};

/// Ticks in a second, and clocks of the twin's front end in a tick.
pub(crate) const TICK_HZ: f64 = 1e4;
const CLOCKS: u64 = 1000;
const CLOCK_HZ: u32 = 10_000_000;
/// Ticks in which the head learns its ellipse, before anything happens.
pub(crate) const LEARNS: u32 = 6000;
/// Tick in which every second head stops to follow its ellipse.
const ADJUSTED: u32 = LEARNS - 1500;
/// Change of the speed in a tick, mm/s: 100 mm/s².
const CHANGE: f64 = 0.01;
/// Paper B's grating.
const PERIOD_UM: f64 = 0.8;
const FULL_SCALE: f64 = 32_768.0;

/// The stage: its truth, and how its builder has set up the front ends.
pub(crate) struct Stage {
    plant: Plant,
    fronts: [Setup; 2],
}

impl Stage {
    pub(crate) fn read(preset: &str) -> Self {
        let plant = Plant::read("litho-120", preset).expect("the preset can be read");
        let settings = preset::settings(preset).expect("the preset can be read");
        let config = settings.build().expect("its settings are valid");
        Self { plant, fronts: config.axes.map(|axis| axis.front) }
    }
}

/// What each seed comes to, in no order.
pub(crate) fn both_cores<T: Send>(seeds: u32, run: impl Fn(u32) -> T + Sync) -> Vec<(u32, T)> {
    let run_half = |from: u32| (from..seeds).step_by(2).map(|seed| (seed, run(seed))).collect::<Vec<_>>();
    std::thread::scope(|scope| {
        let halves = [0, 1].map(|from| scope.spawn(move || run_half(from)));
        halves.into_iter().flat_map(|half| half.join().expect("a thread ends")).collect()
    })
}

/// A speed that swings, or goes to a goal and stays there; mm/s.
struct Motion {
    learning: f64,
    /// Size, Hz, and part of a turn at which it begins.
    swings: [[f64; 3]; 2],
    goal: Option<f64>,
    now: f64,
}

impl Motion {
    fn new(noise: &mut Noise) -> Self {
        let mut swing =
            |hz: Range| [noise.uniform(0.3, 2.3), noise.uniform(hz[0], hz[1]), noise.uniform(0.0, 1.0)];
        let swings = [swing([0.3, 0.9]), swing([4.0, 16.0])];
        let learning = 0.4 * sign(noise);
        Self { learning, swings, goal: None, now: learning }
    }

    fn go_on(&mut self, tick: u32) -> f64 {
        let t = f64::from(tick) / TICK_HZ;
        let swing = |[size, hz, from]: [f64; 3]| size * (std::f64::consts::TAU * (hz * t + from)).sin();
        let swinging = self.learning + self.swings.iter().copied().map(swing).sum::<f64>();
        let wanted = self.goal.unwrap_or(if tick < LEARNS { self.learning } else { swinging });
        self.now += (wanted - self.now).clamp(-CHANGE, CHANGE);
        self.now
    }

    /// Goes to a speed. Returns the way until it is reached, mm.
    fn go_to(&mut self, goal: f64) -> f64 {
        self.goal = Some(goal);
        let seconds = (goal - self.now).abs() / CHANGE / TICK_HZ;
        0.5 * (self.now + goal) * seconds
    }
}

fn sign(noise: &mut Noise) -> f64 {
    if noise.chance(0.5) { 1.0 } else { -1.0 }
}

/// Evenly by the logarithm: what is small is met as often as what is large.
fn log_uniform(noise: &mut Noise, [low, high]: Range) -> f64 {
    low * (noise.uniform(0.0, 1.0) * (high / low).ln()).exp()
}

/// What goes on happening.
#[derive(Clone, Copy)]
enum Ongoing {
    Nothing,
    Fading { left: f64, a_tick: f64 },
    Spot { at_um: f64, inner_um: f64 },
    Jumping { left: u32, periods: Range },
}

/// What a tick showed.
pub(crate) struct Seen {
    pub(crate) fault: Option<SignalFault>,
    pub(crate) findings: Findings,
    /// How far the position is off, µm.
    pub(crate) off_um: f64,
}

pub(crate) struct Bench {
    scale: Scale,
    head: Head,
    config: Config,
    noise: Noise,
    motion: Motion,
    last: u32,
    count: i64,
    place_um: f64,
    /// From the head's zero to the scale's, µm.
    zero_um: Option<f64>,
    ongoing: Ongoing,
    /// Samples are taken from it: that they are missed is to be told.
    loses: bool,
    /// The twin's converter loses one now and then, too: that this is told is right.
    lost: bool,
}

impl Bench {
    pub(crate) fn new(stage: &Stage, seed: u32, counted: bool) -> Self {
        let Stage { plant, fronts: [x, y] } = stage;
        let mut noise = Noise::new(seed.into(), "encoder faults");
        let (axis, setup, name) = if noise.chance(0.5) { (&plant.x, x, "x") } else { (&plant.y, y, "y") };
        let head = axis.head.as_ref().expect("the preset has analogue heads");
        let config = Config {
            period_pm: 800_000,
            ellipse: Ellipse::circle(head.amplitude * FULL_SCALE),
            harmonics: Harmonics::default(),
            rail: 32_500,
            counted,
            // Paper B's 5 nm or as fine as the samples are: no fault is told by it.
            factor: if noise.chance(0.5) { 160 } else { 0 },
            sample_limit: 0,
            count_limit: false,
            tracks: true,
        };
        let place_um = noise.uniform(20e3, 100e3);
        Self {
            scale: Scale::new(axis, *setup, CLOCK_HZ, place_um, seed.into(), name),
            head: Head::new(&config),
            config,
            motion: Motion::new(&mut noise),
            noise,
            last: 0,
            count: 0,
            place_um,
            zero_um: None,
            ongoing: Ongoing::Nothing,
            loses: false,
            lost: false,
        }
    }

    /// The tick at which it happens.
    pub(crate) fn moment(&mut self) -> u32 {
        LEARNS + self.noise.uniform(600.0, 4000.0) as u32
    }

    pub(crate) fn tick(&mut self, tick: u32) -> Seen {
        if tick == ADJUSTED && self.noise.chance(0.5) {
            self.adjust();
        }
        let mm_s = self.motion.go_on(tick);
        self.place_um += mm_s * 1e3 / TICK_HZ + self.go_on();
        self.scale.move_to(self.place_um, CLOCKS);
        let reading = self.scale.read();
        self.count += i64::from(reading.counter.wrapping_sub(self.last).cast_signed());
        self.last = reading.counter;
        if reading.illegal != 0 {
            self.head.illegal();
        }
        let sample = self.scale.sample(mm_s);
        self.lost |= sample.is_none();
        let read = self.head.read(sample, self.count, &self.config);
        self.head.refine();
        let off = read.position.pm(self.config.period_pm) as f64 * 1e-6 - self.scale.position_um();
        if tick == LEARNS {
            self.zero_um = Some(off);
        }
        Seen {
            fault: read.fault,
            findings: self.findings(),
            off_um: (off - self.zero_um.unwrap_or(off)).abs(),
        }
    }

    /// From now on the correction stays as it was found: a head that somebody has adjusted, and that tracks no more.
    fn adjust(&mut self) {
        self.config = Config { ellipse: *self.head.ellipse(), tracks: false, ..self.config };
        self.head = Head::new(&self.config);
    }

    fn findings(&self) -> Findings {
        let report = self.head.report().unwrap_or_default();
        let found = report.warn.and(report.fail);
        if self.lost && !self.loses { Findings(found.0 & !Findings::MISSED.0) } else { found }
    }

    /// What goes on happening in a tick; how far it moves the head, µm.
    fn go_on(&mut self) -> f64 {
        match &mut self.ongoing {
            Ongoing::Nothing | Ongoing::Spot { .. } | Ongoing::Jumping { left: 0, .. } => 0.0,
            Ongoing::Fading { left, a_tick } => {
                *left = (*left - *a_tick).max(0.0);
                let part = *left;
                self.head_event(HeadEvent::Light { part });
                0.0
            }
            Ongoing::Jumping { left, periods } => {
                *left -= 1;
                let [low, high] = *periods;
                sign(&mut self.noise) * self.noise.uniform(low, high) * PERIOD_UM
            }
        }
    }

    pub(crate) fn is_in_danger(&self, danger: Danger, seen: &Seen) -> bool {
        match (danger, self.ongoing) {
            (Danger::Off, _) => seen.off_um > 0.05,
            (Danger::HalfTheLight, Ongoing::Fading { left, .. }) => left < 0.5,
            (Danger::HalfTheLight, Ongoing::Spot { at_um, inner_um }) => {
                (self.scale.position_um() - at_um).abs() < inner_um
            }
            _ => true,
        }
    }

    pub(crate) fn happen(&mut self, what: What) {
        self.loses = matches!(what, What::Missing(_));
        let noise = &mut self.noise;
        let mut drawn = |[low, high]: Range| noise.uniform(low, high);
        match what {
            What::Nothing => {}
            What::Pulled(level) => {
                let level = drawn(level);
                self.pull(level);
            }
            What::Freezes => {
                self.head_event(HeadEvent::Stick { channel: Channel::Cosine });
                self.head_event(HeadEvent::Stick { channel: Channel::Sine });
            }
            What::Light(part) => {
                let part = drawn(part);
                self.head_event(HeadEvent::Light { part });
            }
            What::Fades(seconds) => {
                let a_tick = 1.0 / (drawn(seconds) * TICK_HZ);
                self.ongoing = Ongoing::Fading { left: 1.0, a_tick };
            }
            What::Dirt { depth, width_mm, mm_s } => self.lay_dirt(depth, width_mm, mm_s),
            What::Amplify(factor) => {
                let factor = drawn(factor);
                self.head_event(HeadEvent::Amplify { factor });
            }
            What::Noise(factor) => {
                let factor = drawn(factor);
                self.head_event(HeadEvent::Noise { factor });
            }
            What::Chatter(part) => {
                let part = drawn(part);
                self.head_event(HeadEvent::Chatter { part });
            }
            What::Sticks => {
                let channel = if noise.chance(0.5) { Channel::Cosine } else { Channel::Sine };
                self.head_event(HeadEvent::Stick { channel });
            }
            What::Missing(ticks) => {
                let ticks = drawn(ticks).round() as u32;
                self.head_event(HeadEvent::LoseSamples { ticks });
            }
            What::Counts(number) => self.count += (drawn(number).round() * sign(noise)) as i64,
            What::Jumps { samples, periods } => self.ongoing = Ongoing::Jumping { left: samples, periods },
        }
    }

    /// The head floats at this level of the converter.
    fn pull(&mut self, level: f64) {
        self.head_event(HeadEvent::Unplugged { level });
        self.scale.connect(false);
    }

    fn head_event(&mut self, event: HeadEvent) {
        self.scale.head_mut().expect("the preset has analogue heads").happen(event);
    }

    /// A spot ahead, and a steady speed at which it passes within a second.
    fn lay_dirt(&mut self, depth: Range, width_mm: Range, [slowest, fastest]: Range) {
        let width_mm = log_uniform(&mut self.noise, width_mm);
        let mm_s = log_uniform(&mut self.noise, [slowest.max(width_mm), fastest]) * sign(&mut self.noise);
        let ahead = self.motion.go_to(mm_s) + mm_s.signum() * (0.5 * width_mm + 0.01);
        let loss = [0; 2].map(|_: u8| self.noise.uniform(depth[0], depth[1]));
        let at_mm = self.place_um * 1e-3 + ahead;
        self.head_event(HeadEvent::Dirt(Dirt { at_mm, width_mm, loss }));
        self.ongoing = Ongoing::Spot { at_um: at_mm * 1e3, inner_um: 250.0 * width_mm };
    }
}
