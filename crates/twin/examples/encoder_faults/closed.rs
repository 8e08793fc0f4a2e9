//! What a head cannot tell alone, in the closed loop: signals that freeze at a good level look like a stage at rest, until
//! the stage is to move and its reading does not. The servo pushes ever harder then, and only the guard ends it.

use super::bench::{TICK_HZ, both_cores};
use super::{HALF_A_PERIOD_UM, PRESET};
use abbe_core::publish::Fault;
use abbe_core::{Command, Controller, Outputs, Pos, background};
use abbe_twin::analogue::{Channel, HeadEvent};
use abbe_twin::noise::Noise;
use abbe_twin::{Event, Plant, Twin, preset};

/// What happens to the encoder of X.
#[derive(Clone, Copy)]
enum What {
    /// The plug is pulled; both channels are left at any level of the converter.
    Plug,
    /// Both channels stay at their last codes; the comparators go on.
    Freezes,
    /// One sample of one channel is wrong, by up to the converter's range.
    Spike,
    /// Noise at the comparators, 20 … 50 % of the amplitude, for the rest of the time.
    Chatter,
}

/// When it happens.
#[derive(Clone, Copy)]
enum When {
    /// In the middle of a move.
    Moving,
    /// At rest; the next move begins within five seconds.
    Resting,
}

/// A row of the table.
pub(crate) struct Row {
    name: &'static str,
    what: What,
    when: When,
    /// It must be a fault within so many ms of motion, or of standing where it does not stay, unless it may go on as long as the position is right.
    within_ms: Option<f64>,
    /// Until then the reading may be off by so many µm.
    within_um: f64,
}

const ROWS: [Row; 5] = [
    Row {
        name: "plug pulled in a move, level anywhere",
        what: What::Plug,
        when: When::Moving,
        within_ms: Some(200.0),
        within_um: 80.0,
    },
    Row {
        name: "plug pulled at rest, level anywhere",
        what: What::Plug,
        when: When::Resting,
        within_ms: Some(200.0),
        within_um: 80.0,
    },
    Row {
        name: "both channels freeze in a move",
        what: What::Freezes,
        when: When::Moving,
        within_ms: Some(10.0),
        within_um: 0.6,
    },
    Row {
        name: "one wild sample in a move",
        what: What::Spike,
        when: When::Moving,
        within_ms: None,
        // A phase lies within half a period of its count's middle, 0.4 µm, and the head within an eighth and what offsets
        // and hysteresis make of it, 0.12; over 5 mm the graduation adds some 0.1.
        within_um: 0.7,
    },
    Row {
        name: "comparators chatter, noise of 20 … 50 %",
        what: What::Chatter,
        when: When::Moving,
        within_ms: None,
        within_um: 2.0,
    },
];

/// Nothing is waited for longer, ticks of motion.
const LONGEST: u32 = 30_000;
/// Ticks in which a stage without torque rolls out.
const ROLLS: u32 = 5000;

/// What the seeds of a row came to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    seeds: usize,
    /// By the signals, by the encoder that does not move with the motor, by the following error, and not at all.
    told_by: [usize; 4],
    /// Of motion, or of standing astray, until the fault.
    median_ms: f64,
    longest_ms: f64,
    /// Reading less slide until then and in the tick of the fault, at most.
    worst_um: f64,
    /// What the slide went on after the fault, at most.
    rolled_um: f64,
    /// No fault, and in the end the position is in another period.
    lost: usize,
    /// Another fault.
    wrong: usize,
}

/// What a seed came to.
struct Seen {
    fault: Option<Fault>,
    ms: f64,
    off_um: f64,
    /// How far the reading is off in the end.
    left_um: f64,
    rolled_um: f64,
}

struct Loop {
    twin: Twin,
    controller: Controller<2>,
    outputs: Outputs<2>,
    noise: Noise,
    /// Length of the moves, mm, there and back: 2 µm … 5 mm.
    length_mm: f64,
    /// Where X stands, and where it stood when the sample was taken that the controller reads now, a tick before; µm.
    slides_um: [f64; 2],
}

impl Loop {
    fn homed(plant: &Plant, seed: u32) -> Self {
        let mut noise = Noise::new(seed.into(), "encoder faults in the closed loop");
        let config = preset::settings(PRESET).expect("the preset has settings").build().expect("they fit");
        let mut stage = Self {
            twin: Twin::standing_at(plant, &config, seed.into(), [1.0, 1.5]),
            controller: Controller::new(config),
            outputs: Outputs::OFF,
            length_mm: 0.002 * (noise.uniform(0.0, 1.0) * 2500_f64.ln()).exp(),
            noise,
            slides_um: [0.0; 2],
        };
        stage.tick();
        for command in [Command::Home, Command::MoveTo([Pos::from_mm(2.0); 2])] {
            stage.begin(command);
            while stage.controller.status().state.is_busy() {
                stage.tick();
            }
        }
        assert_eq!(stage.controller.status().fault, None, "seed {seed}");
        stage
    }

    fn tick(&mut self) {
        let inputs = self.twin.step(&self.outputs);
        self.outputs = self.controller.tick(&inputs);
        while background::advance(&mut self.controller).is_some() {}
        self.slides_um = [self.twin.truth().slides_um[0], self.slides_um[0]];
    }

    fn begin(&mut self, command: Command<2>) {
        self.controller.command(command).expect("the stage is ready");
        self.tick();
    }

    fn reading_um(&self) -> f64 {
        self.controller.status().axes[0].reading.um()
    }

    /// Reading less slide.
    fn beside_um(&self) -> f64 {
        self.reading_um() - self.slides_um[1]
    }

    fn move_on(&mut self) {
        self.begin(Command::MoveBy([Pos::from_mm(self.length_mm), Pos::ZERO]));
        self.length_mm = -self.length_mm;
    }

    fn happen(&mut self, what: What) {
        let head = |event| Event::Head { axis: 0, event };
        let events = match what {
            What::Plug => {
                let level = self.noise.uniform(-1.0, 1.0);
                vec![head(HeadEvent::Unplugged { level }), Event::Encoder { axis: 0, connected: false }]
            }
            What::Freezes => {
                [Channel::Cosine, Channel::Sine].map(|channel| head(HeadEvent::Stick { channel })).to_vec()
            }
            What::Spike => {
                let channel = if self.noise.chance(0.5) { Channel::Cosine } else { Channel::Sine };
                vec![head(HeadEvent::Spike { channel, part: self.noise.uniform(-2.0, 2.0) })]
            }
            What::Chatter => vec![head(HeadEvent::Chatter { part: self.noise.uniform(0.2, 0.5) })],
        };
        for event in events {
            self.twin.happen(event).expect("the axis has a head");
        }
    }

    /// Until somebody moves, or a fault. The ticks in which it did not stay where it stood.
    fn stand(&mut self, ticks: u32, zero_um: f64) -> u32 {
        let mut astray = 0;
        for _ in 0..ticks {
            if self.controller.status().fault.is_some() {
                break;
            }
            self.tick();
            astray += u32::from((self.beside_um() - zero_um).abs() > HALF_A_PERIOD_UM);
        }
        astray
    }

    /// Lets it happen at its moment; at rest some time passes before anybody moves. The ticks in which it was astray.
    fn reach(&mut self, row: &Row, zero_um: f64) -> u32 {
        match row.when {
            When::Moving => {
                let way_um = 1e3 * self.noise.uniform(0.05, 0.95) * self.length_mm.abs();
                let from_um = self.reading_um();
                self.move_on();
                while (self.reading_um() - from_um).abs() < way_um {
                    self.tick();
                }
                self.happen(row.what);
                0
            }
            When::Resting => {
                self.happen(row.what);
                let ticks = self.noise.uniform(0.0, 50_000.0) as u32;
                self.stand(ticks, zero_um)
            }
        }
    }

    /// Moves there and back until there is a fault.
    fn watch(&mut self, astray: u32, zero_um: f64) -> Seen {
        let (mut ticks, mut off_um) = (astray, 0.0_f64);
        loop {
            off_um = off_um.max((self.beside_um() - zero_um).abs());
            let fault = self.controller.status().fault;
            if fault.is_some() || ticks >= LONGEST {
                let ms = f64::from(ticks) * 1e3 / TICK_HZ;
                let left_um = (self.beside_um() - zero_um).abs();
                return Seen { fault, ms, off_um, left_um, rolled_um: 0.0 };
            }
            if self.controller.status().state.is_busy() {
                self.tick();
            } else {
                self.move_on();
            }
            ticks += 1;
        }
    }

    /// How far it rolls without torque, µm.
    fn roll_out(&mut self) -> f64 {
        let from_um = self.slides_um[0];
        (0..ROLLS).for_each(|_| self.tick());
        (self.slides_um[0] - from_um).abs()
    }
}

fn run(row: &Row, plant: &Plant, seed: u32) -> Seen {
    let mut stage = Loop::homed(plant, seed);
    let zero_um = stage.beside_um();
    let astray = stage.reach(row, zero_um);
    let mut seen = stage.watch(astray, zero_um);
    if seen.fault.is_some() {
        seen.rolled_um = stage.roll_out();
    }
    seen
}

/// All seeds of each row, one row after the other.
pub(crate) fn table(seeds: u32) -> impl Iterator<Item = (&'static Row, Tally)> {
    let plant = Plant::read("litho-120", PRESET).expect("the preset can be read");
    ROWS.iter().map(move |row| (row, tally(row, &both_cores(seeds, |seed| run(row, &plant, seed)))))
}

fn tally(row: &Row, all: &[(u32, Seen)]) -> Tally {
    let mut tally = Tally { seeds: all.len(), ..Tally::default() };
    for (seed, seen) in all {
        let told_by = match seen.fault {
            Some(Fault::Signal { axis: 0, .. }) => 0,
            Some(Fault::EncoderLost { axis: 0 }) => 1,
            Some(Fault::FollowingError { axis: 0, .. }) => 2,
            None => {
                tally.lost += usize::from(seen.left_um > HALF_A_PERIOD_UM);
                3
            }
            Some(other) => {
                eprintln!("{}, seed {seed}: {other}", row.name);
                tally.wrong += 1;
                continue;
            }
        };
        tally.told_by[told_by] += 1;
        tally.worst_um = tally.worst_um.max(seen.off_um);
        tally.rolled_um = tally.rolled_um.max(seen.rolled_um);
    }
    let mut ms: Vec<f64> =
        all.iter().filter(|(_, seen)| seen.fault.is_some()).map(|(_, seen)| seen.ms).collect();
    ms.sort_by(f64::total_cmp);
    tally.median_ms = ms.get(ms.len() / 2).copied().unwrap_or_default();
    tally.longest_ms = ms.last().copied().unwrap_or_default();
    tally
}

/// What a row does not hold of what it states.
pub(crate) fn broken(row: &Row, tally: &Tally) -> Option<String> {
    let [.., unnoticed] = tally.told_by;
    let in_time = row.within_ms.is_none_or(|ms| tally.longest_ms <= ms && unnoticed == 0);
    let holds = in_time && tally.lost + tally.wrong == 0 && tally.worst_um <= row.within_um;
    (!holds).then(|| {
        format!("{}: {tally:?}, not within {:?} ms and {} µm", row.name, row.within_ms, row.within_um)
    })
}

pub(crate) const HEAD: &str = "| in the closed loop | told by signals | encoder lost | following error | nothing | told after, ms: median … longest | at most | position off, µm | at most | rolled on, µm | periods lost | wrong |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|";

/// A row as it stands in the table.
pub(crate) fn line(row: &Row, t: &Tally) -> String {
    let [signals, lost, following, nothing] = t.told_by;
    let most = row.within_ms.map_or("–".into(), |ms| ms.to_string());
    format!(
        "| {} | {signals} of {} | {lost} | {following} | {nothing} | {:.1} … {:.1} | {most} | {:.3} | {} | {:.0} | {} | {} |",
        row.name, t.seeds, t.median_ms, t.longest_ms, t.worst_um, row.within_um, t.rolled_um, t.lost, t.wrong
    )
}
