//! What can happen to an analogue encoder, how soon it is noticed, and how wrong the position was until then:
//! `encoder_faults [SEEDS]`, 20 if not said. Ends with 1 if one was not noticed or nothing was taken for something.
//!
//! The stage's grating, head, comparators, converter and counter are the twin's (preset `litho-120`, axis x), the reading is
//! core's. Each seed has its own motion, up to 4 mm/s with reversals, its own grating, and its own moment.

use abbe_core::sense::ellipse::Ellipse;
use abbe_core::sense::harmonics::Harmonics;
use abbe_core::sense::head::{Config, Head};
use abbe_core::sense::health::{Findings, SignalFault};
use abbe_twin::Plant;
use abbe_twin::analogue::{Channel, Dirt, HeadEvent};
use abbe_twin::scale::Scale;
use std::process::ExitCode;

const PRESET: &str = include_str!("../../../presets/litho-120.toml");
/// Ticks in a second, and clocks of the twin's front end in a tick.
const TICK_HZ: f64 = 1e4;
const CLOCKS: u64 = 1000;
/// Ticks in which the head learns its ellipse, before anything happens.
const LEARNS: u32 = 6000;
/// Nothing may take longer to be noticed, ticks.
const LONGEST: u32 = 10_000;
const FULL_SCALE: f64 = 32_768.0;

/// What happens.
#[derive(Clone, Copy)]
enum What {
    Nothing,
    Pulled,
    Head(HeadEvent),
    /// Dirt on the way, this deep.
    Dirty(f64),
    /// So many counts are lost.
    Lost(i64),
    /// The motion changes by more than can be followed; no counter.
    Jerked,
}

/// How it must be noticed.
#[derive(Clone, Copy)]
enum Notice {
    Fault(&'static [SignalFault]),
    Finding(Findings),
    Never,
}

/// A row of the table.
struct Case {
    name: &'static str,
    what: What,
    notice: Notice,
    /// Ticks, at most.
    within: u32,
}

/// What the seeds of a case came to.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    pub(crate) seeds: u32,
    /// Ticks until it was noticed.
    pub(crate) median: u32,
    pub(crate) longest: u32,
    /// Until then the position was off by so much, µm, at most.
    pub(crate) worst_um: f64,
    pub(crate) unnoticed: u32,
    /// Something else was told, or told before it happened.
    pub(crate) wrong: u32,
    pub(crate) late: u32,
}

const CASES: [Case; 12] = [
    case("nothing", What::Nothing, Notice::Never, 0),
    case("plug pulled", What::Pulled, Notice::Fault(&[SignalFault::Lost]), 3),
    case(
        "light gone to 15 %",
        What::Head(HeadEvent::Light { part: 0.15 }),
        Notice::Fault(&[SignalFault::Lost]),
        3,
    ),
    case(
        "light gone to 60 %",
        What::Head(HeadEvent::Light { part: 0.6 }),
        Notice::Finding(Findings::WEAK),
        512,
    ),
    case(
        "gain 1.7 times too high",
        What::Head(HeadEvent::Amplify { factor: 1.7 }),
        Notice::Finding(Findings::CLIPPED),
        512,
    ),
    case(
        "noise 15 times higher",
        What::Head(HeadEvent::Noise { factor: 15.0 }),
        Notice::Finding(Findings::NOISY),
        512,
    ),
    case("dirt that takes all light", What::Dirty(1.0), Notice::Fault(&[SignalFault::Lost]), LONGEST),
    case("dirt that takes half of it", What::Dirty(0.55), Notice::Finding(Findings::WEAK), LONGEST),
    case("cosine stands still", What::Head(HeadEvent::Stick { channel: Channel::Cosine }), STUCK, LONGEST),
    case(
        "no samples",
        What::Head(HeadEvent::LoseSamples { ticks: 1000 }),
        Notice::Fault(&[SignalFault::Missed]),
        9,
    ),
    case("two counts lost", What::Lost(2), Notice::Fault(&[SignalFault::Disagrees]), 1),
    case("too fast to follow", What::Jerked, Notice::Fault(&[SignalFault::Fast]), 1),
];
const STUCK: Notice = Notice::Fault(&[SignalFault::Disagrees, SignalFault::Lost, SignalFault::OffCircle]);

const fn case(name: &'static str, what: What, notice: Notice, within: u32) -> Case {
    Case { name, what, notice, within }
}

/// A head over a grating, in motion.
struct Bench {
    scale: Scale,
    head: Head,
    config: Config,
    last: u32,
    count: i64,
    place_um: f64,
    /// From the head's zero to the scale's, µm.
    zero_um: Option<f64>,
    /// Two swings: mm/s and Hz.
    swings: [[f64; 2]; 2],
    dashes: f64,
}

impl Bench {
    fn new(plant: &Plant, seed: u32, counted: bool) -> Self {
        let head = plant.x.head.as_ref().expect("the preset has an analogue head");
        let part = |k: u32| f64::from((seed * 7919 + k * 104_729) % 1000) / 1000.0;
        let place_um = 20_000.0 + 60_000.0 * part(1);
        let config = Config {
            period_pm: 800_000,
            ellipse: Ellipse::circle(head.amplitude * FULL_SCALE),
            harmonics: Harmonics::default(),
            rail: 32_500,
            counted,
            factor: 0,
            sample_limit: 0,
            count_limit: false,
            tracks: true,
        };
        Self {
            scale: Scale::new(&plant.x, place_um, seed.into(), "x"),
            head: Head::new(&config),
            config,
            last: 0,
            count: 0,
            place_um,
            zero_um: None,
            swings: [[1.0 + 2.0 * part(2), 1.0 + 2.0 * part(3)], [0.3 + 0.6 * part(4), 7.0 + 9.0 * part(5)]],
            dashes: 0.0,
        }
    }

    /// Speed at a tick, mm/s: first slowly one way, so that the head can learn.
    fn speed(&self, tick: u32) -> f64 {
        let t = f64::from(tick.saturating_sub(LEARNS)) / TICK_HZ;
        let swings = self.swings.iter().map(|[size, hz]| size * (hz * t * std::f64::consts::TAU).sin());
        0.4 + swings.sum::<f64>() + self.dashes
    }

    /// One tick: the fault, if there is one, and how far the position is off, µm.
    fn tick(&mut self, tick: u32) -> (Option<SignalFault>, f64) {
        let um_s = self.speed(tick) * 1e3;
        self.place_um += um_s / TICK_HZ;
        self.scale.move_to(self.place_um, CLOCKS);
        let reading = self.scale.read();
        self.count += i64::from(reading.counter.wrapping_sub(self.last).cast_signed());
        self.last = reading.counter;
        if reading.illegal != 0 {
            self.head.illegal();
        }
        let sample = self.scale.sample(um_s * 1e-3);
        let read = self.head.read(sample, self.count, &self.config);
        self.head.update();
        let off = read.position.pm(self.config.period_pm) as f64 * 1e-6 - self.scale.position_um();
        if tick == LEARNS {
            self.zero_um = Some(off);
        }
        (read.fault, off - self.zero_um.unwrap_or(off))
    }

    fn happen(&mut self, what: What) {
        match what {
            What::Nothing => {}
            What::Pulled => self.scale.connect(false),
            What::Head(event) => self.scale.happen(event),
            What::Dirty(depth) => {
                // A little ahead, wide enough for many samples.
                let dirt =
                    Dirt { at_mm: self.place_um * 1e-3 + 0.05, width_mm: 0.09, loss: [depth, 0.75 * depth] };
                self.scale.happen(HeadEvent::Dirt(dirt));
            }
            What::Lost(counts) => self.count += counts,
            // 3.6 µm a tick more: half a period and a little, four times over.
            What::Jerked => self.dashes = 35.2,
        }
    }
}

/// One seed: ticks until it was noticed, how far off the position was until then; or what went wrong.
fn run(case: &Case, plant: &Plant, seed: u32) -> Result<(u32, f64), Wrong> {
    let counted = !matches!(case.what, What::Jerked);
    let mut bench = Bench::new(plant, seed, counted);
    let begins = LEARNS + 600 + seed * 37 % 2000;
    let mut worst = 0.0_f64;
    for tick in 0..begins + LONGEST {
        if tick == begins {
            bench.happen(case.what);
        }
        let (fault, off) = bench.tick(tick);
        let report = bench.head.report();
        // The twin's converter loses a sample now and then: that such a one is told is right.
        let found = Findings(report.warn.and(report.fail).0 & !Findings::MISSED.0);
        let since = tick.wrapping_sub(begins).wrapping_add(1);
        if tick < begins {
            // Until it has learned, its offsets are findings, and rightly.
            let early = fault.is_some() || (tick > LEARNS + 300 && found != Findings::NONE);
            if early {
                return Err(Wrong::Other(fault, found));
            }
            continue;
        }
        let noticed = match case.notice {
            Notice::Never => false,
            Notice::Fault(faults) => fault.is_some_and(|fault| faults.contains(&fault)),
            Notice::Finding(finding) => found.has(finding),
        };
        if noticed {
            return Ok((since, worst));
        }
        let other = fault.is_some() || (matches!(case.notice, Notice::Never) && found != Findings::NONE);
        if other {
            return Err(Wrong::Other(fault, found));
        }
        worst = worst.max(off.abs());
    }
    if matches!(case.notice, Notice::Never) { Ok((0, worst)) } else { Err(Wrong::Unnoticed) }
}

/// What can go wrong with noticing.
enum Wrong {
    Unnoticed,
    Other(Option<SignalFault>, Findings),
}

/// All seeds of all cases, by name.
pub(crate) fn table(seeds: u32) -> Vec<(&'static str, Tally)> {
    let plant = Plant::read("litho-120", PRESET).expect("the preset can be read");
    CASES.iter().map(|case| (case.name, tally(case, &plant, seeds))).collect()
}

fn tally(case: &Case, plant: &Plant, seeds: u32) -> Tally {
    let run_all =
        |from: u32| (from..seeds).step_by(2).map(|seed| (seed, run(case, plant, seed))).collect::<Vec<_>>();
    let all: Vec<_> = std::thread::scope(|scope| {
        let halves = [0, 1].map(|from| scope.spawn(move || run_all(from)));
        halves.into_iter().flat_map(|half| half.join().expect("a thread ends")).collect()
    });
    let mut ticks = Vec::new();
    let mut tally = Tally { seeds, ..Tally::default() };
    for (seed, found) in all {
        match found {
            Ok((since, off)) => {
                ticks.push(since);
                tally.worst_um = tally.worst_um.max(off);
                tally.late += u32::from(since > case.within);
            }
            Err(Wrong::Unnoticed) => tally.unnoticed += 1,
            Err(Wrong::Other(fault, findings)) => {
                tally.wrong += 1;
                eprintln!("{}, seed {seed}: {fault:?}, {findings}", case.name);
            }
        }
    }
    ticks.sort_unstable();
    tally.median = ticks.get(ticks.len() / 2).copied().unwrap_or(0);
    tally.longest = ticks.last().copied().unwrap_or(0);
    tally
}

fn main() -> ExitCode {
    let asked = std::env::args().nth(1).unwrap_or_else(|| "20".into());
    let Ok(seeds) = asked.parse::<u32>() else {
        eprintln!("encoder_faults: {asked} is not a number of seeds");
        return ExitCode::from(2);
    };
    println!(
        "| what happens | noticed after, ms: median … longest | position off until then, µm | late | unnoticed | wrong |"
    );
    println!("|---|---:|---:|---:|---:|---:|");
    let mut bad = 0;
    for (name, t) in table(seeds) {
        let ms = |ticks: u32| f64::from(ticks) * 1e3 / TICK_HZ;
        println!(
            "| {name} | {:.1} … {:.1} | {:.3} | {} | {} of {} | {} |",
            ms(t.median),
            ms(t.longest),
            t.worst_um,
            t.late,
            t.unnoticed,
            t.seeds,
            t.wrong
        );
        bad += t.unnoticed + t.wrong + t.late;
    }
    ExitCode::from(u8::from(bad != 0))
}
