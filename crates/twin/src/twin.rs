//! The twin itself: two axes, their scales and switches, a table, a room.

use crate::axis::Mechanics;
use crate::event::{DigitalHead, Event};
use crate::geometry::Geometry;
use crate::heat::Heat;
use crate::instruments::Thermometer;
use crate::noise::Noise;
use crate::pins::{AxisWires, Drive};
use crate::plant::{AxisPlant, Plant};
use crate::scale::{Lines, Scale};
use crate::switches::Switch;
use crate::table::Table;
use crate::vibration::Vibration;
use abbe_core::design::Config;
use abbe_core::edge::{Actuation, AxisInputs, AxisOutputs, Inputs, Outputs, StepRate};
use abbe_core::front::{StepEmitter, emitter};

/// Steps of the mechanics in a tick.
const SUBSTEPS: u64 = 2;
/// Clocks of the twin's own decoder in a tick: 100 ns each at 10 kHz, where a board's are 8 ns. The filter of the
/// controller's builder is rounded up to them, see [`abbe_core::front::Setup::filter_at`].
const CLOCKS: u64 = 1000;
/// Ticks between two steps of heat.
const HEAT_TICKS: u32 = 100;

/// What only instruments may see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Time since power-on, s.
    pub time_s: f64,
    /// The table's centre, µm.
    pub table_um: [f64; 2],
    /// The slides at their scales, µm.
    pub slides_um: [f64; 2],
    /// Speed of the slides, mm/s.
    pub speed_mm_s: [f64; 2],
}

/// One axis with its sensors.
#[derive(Clone, Debug)]
struct Axis {
    mechanics: Mechanics,
    vibration: Vibration,
    scale: Scale,
    low: Switch,
    high: Switch,
    emitter: StepEmitter,
    /// Pulses at the end of the last tick.
    pulses: i32,
    table: Table,
    drive_fault: bool,
    glitch_probability: f64,
    /// What the last tick saw, for samples that come too late.
    seen: AxisInputs,
}

impl Axis {
    fn new(plant: &Plant, number: usize, config: &Config<2>, place_mm: f64, seed: u64) -> Self {
        let (axis, name): (&AxisPlant, _) = [(&plant.x, "x"), (&plant.y, "y")][number];
        let (setup, clock_hz) = (config.axes[number].front, (CLOCKS as f64 * config.tick_hz) as u32);
        let place_um = place_mm * 1e3;
        let switches = &axis.switches;
        Self {
            mechanics: Mechanics::new(axis, &plant.load, place_mm, seed, name),
            vibration: Vibration::new(axis.scale.vibration_nm, seed, name),
            scale: Scale::new(axis, setup, clock_hz, place_um, seed, name),
            low: Switch::new(switches, switches.low_mm, -1.0, seed, &format!("{name} low")),
            high: Switch::new(switches, switches.high_mm, 1.0, seed, &format!("{name} high")),
            emitter: StepEmitter::new(emitter::clocks_per_tick(config.tick_hz)),
            pulses: 0,
            table: Table::new(plant, place_um, seed, name),
            drive_fault: false,
            glitch_probability: axis.scale.glitch_probability,
            seen: AxisInputs::default(),
        }
    }

    /// What the output does at the power stage in the tick that begins.
    fn drive(&mut self, output: &AxisOutputs) -> Drive {
        let rate = match output.actuation {
            Actuation::Steps(rate) if output.enable && !self.drive_fault => rate,
            _ => StepRate(0),
        };
        self.emitter.begin_tick(rate);
        let clocks = self.emitter.clocks_per_tick();
        let pulses = [clocks / 2, clocks].map(|clock| self.emitter.pulses_at(clock));
        let duty = if let Actuation::Pwm(duty) = output.actuation { duty } else { 0 };
        Drive { enable: output.enable, pulses, duty }
    }

    /// One tick of `dt` seconds.
    fn step(&mut self, drive: &Drive, dt: f64) {
        self.mechanics.energise(drive.enable && !self.drive_fault, self.pulses, drive.duty);
        for pulses in drive.pulses {
            self.mechanics.step(pulses, dt / SUBSTEPS as f64);
            self.vibration.step(dt / SUBSTEPS as f64);
            self.scale.move_to(self.place_um(), CLOCKS / SUBSTEPS);
            self.pulses = pulses;
        }
        self.table.step(self.mechanics.place_um(), self.mechanics.speed_mm_s());
    }

    /// The slide's place with what the floor does to it, µm.
    fn place_um(&self) -> f64 {
        self.mechanics.place_um() + self.vibration.um()
    }

    /// The contacts of both switches, low and high.
    fn contacts(&mut self, dt: f64) -> [bool; 2] {
        let place = self.mechanics.place_um();
        [self.low.contact(place, dt), self.high.contact(place, dt)]
    }

    fn disturb(&mut self, noise: &mut Noise) {
        if noise.chance(self.glitch_probability) {
            self.scale.glitch();
        }
    }

    fn sample(&mut self, dt: f64, missed: bool, noise: &mut Noise) -> AxisInputs {
        let [limit_low, limit_high] = self.contacts(dt);
        if missed {
            self.disturb(noise);
            // The counts are not lost, only late.
            return AxisInputs { illegal: 0, glitches: 0, index: None, ..self.seen };
        }
        let reading = self.scale.read();
        let sin_cos = self.scale.sample(self.mechanics.speed_mm_s());
        self.seen = AxisInputs {
            counter: reading.counter,
            illegal: reading.illegal,
            glitches: reading.glitches,
            index: reading.index,
            sin_cos,
            pulses: self.pulses,
            limit_low,
            limit_high,
            drive_fault: self.drive_fault,
        };
        self.disturb(noise);
        self.seen
    }
}

/// The simulated stage.
#[derive(Clone, Debug)]
pub struct Twin {
    plant: Plant,
    seed: u64,
    tick_s: f64,
    tick: u32,
    time_s: f64,
    axes: [Axis; 2],
    geometry: Geometry,
    heat: Heat,
    thermometers: [Thermometer; 2],
    temperatures_mk: [i32; 2],
    emergency_stop: bool,
    heartbeat_age: Option<u32>,
    noise: Noise,
    /// Outputs on their way to the power stages, and inputs on their way to the controller.
    outputs: Outputs<2>,
    inputs: Inputs<2>,
}

impl Twin {
    /// A stage that has stood switched off for a day, its slides wherever somebody left them.
    ///
    /// Of the controller's `config` it takes what a board is set up with at power-on, and nothing else: the length of a
    /// tick, and decoding and filter of each axis' front end.
    pub fn new(plant: &Plant, config: &Config<2>, seed: u64) -> Self {
        let mut noise = Noise::new(seed, "loop");
        let left_at = [noise.uniform(10.0, 90.0), noise.uniform(10.0, 90.0)];
        Self::standing_at(plant, config, seed, left_at)
    }

    /// The same with the slides at a given place, mm.
    pub fn standing_at(plant: &Plant, config: &Config<2>, seed: u64, place_mm: [f64; 2]) -> Self {
        let heat = Heat::new(&plant.heat, seed);
        let axes = [0, 1].map(|number| Axis::new(plant, number, config, place_mm[number], seed));
        let thermometers =
            ["scale", "structure"].map(|name| Thermometer::new(&plant.thermometers, seed, name));
        let mut twin = Self {
            plant: plant.clone(),
            seed,
            tick_s: 1.0 / config.tick_hz,
            tick: 0,
            time_s: 0.0,
            axes,
            geometry: Geometry::new(&plant.geometry, seed),
            heat,
            thermometers,
            temperatures_mk: [0; 2],
            emergency_stop: false,
            heartbeat_age: None,
            noise: Noise::new(seed, "jitter"),
            outputs: Outputs::OFF,
            inputs: Inputs::at_rest(0),
        };
        twin.step_heat(false);
        twin.inputs = twin.sample();
        twin
    }

    /// One tick: takes what the controller puts out, returns what it sees next. Both are a tick late, as on a real
    /// board.
    pub fn step(&mut self, outputs: &Outputs<2>) -> Inputs<2> {
        let acting = core::mem::replace(&mut self.outputs, *outputs);
        let mut drives = [Drive::OFF; 2];
        for ((drive, axis), output) in drives.iter_mut().zip(&mut self.axes).zip(&acting.axes) {
            *drive = axis.drive(output);
        }
        self.go_on(&drives);
        let fresh = self.sample();
        let tick = fresh.tick;
        let delayed = core::mem::replace(&mut self.inputs, fresh);
        // The number is the tick's own, whatever the age of what it sees.
        Inputs { tick, ..delayed }
    }

    /// One tick of everything that moves, however it is driven.
    pub(crate) fn go_on(&mut self, drives: &[Drive; 2]) {
        let dt = self.tick_s * (1.0 + self.plant.timing.jitter * self.noise.normal());
        for (axis, drive) in self.axes.iter_mut().zip(drives) {
            axis.step(drive, dt);
        }
        self.time_s += dt;
        self.tick = self.tick.wrapping_add(1);
        if self.tick.is_multiple_of(HEAT_TICKS) {
            self.step_heat(drives.iter().any(|drive| drive.enable));
        }
        if let Some(age) = &mut self.heartbeat_age {
            *age = age.saturating_add(1);
        }
    }

    /// From now on the edges of each tick are kept for [`Twin::wires`].
    pub(crate) fn remember_edges(&mut self) {
        for axis in &mut self.axes {
            axis.scale.remember_edges();
        }
    }

    /// The levels of all wires after a tick, and the edges of the encoders in it.
    pub(crate) fn wires(&mut self) -> [AxisWires; 2] {
        // A sample that comes too late is the board's business; the stream of chance goes on as in `step`.
        self.noise.chance(self.plant.timing.missed_sample_probability);
        let (dt, noise) = (self.tick_s, &mut self.noise);
        self.axes.each_mut().map(|axis| {
            let edges = axis.scale.take_edges(axis.emitter.clocks_per_tick(), CLOCKS);
            let [limit_low, limit_high] = axis.contacts(dt);
            axis.disturb(noise);
            AxisWires { edges, limit_low, limit_high, drive_fault: axis.drive_fault }
        })
    }

    /// The encoder lines of each axis as they stand.
    pub fn lines(&self) -> [Lines; 2] {
        self.axes.each_ref().map(|axis| axis.scale.lines())
    }

    /// The emergency stop is pressed.
    pub(crate) fn emergency_stop(&self) -> bool {
        self.emergency_stop
    }

    fn sample(&mut self) -> Inputs<2> {
        let missed = self.noise.chance(self.plant.timing.missed_sample_probability);
        let (dt, noise) = (self.tick_s, &mut self.noise);
        let mut inputs = Inputs::at_rest(self.tick);
        for (input, axis) in inputs.axes.iter_mut().zip(&mut self.axes) {
            *input = axis.sample(dt, missed, noise);
        }
        inputs.emergency_stop = self.emergency_stop;
        inputs.temperatures_mk = self.temperatures_mk;
        inputs.heartbeat_age = self.heartbeat_age.unwrap_or(0);
        inputs
    }

    fn step_heat(&mut self, drives_on: bool) {
        self.heat.step(f64::from(HEAT_TICKS) * self.tick_s, drives_on);
        let warmer = self.heat.scale_c() - 20.0;
        for axis in &mut self.axes {
            axis.scale.warm(warmer);
        }
        let shown = [self.heat.scale_c(), self.heat.structure_c()];
        for ((mk, thermometer), true_c) in
            self.temperatures_mk.iter_mut().zip(&mut self.thermometers).zip(shown)
        {
            *mk = (thermometer.read_c(true_c) * 1e3).round() as i32;
        }
    }

    /// Something happens to the stage.
    ///
    /// # Errors
    /// When it is something that can only happen to an analogue head, and the head of the axis is digital.
    pub fn happen(&mut self, event: Event) -> Result<(), DigitalHead> {
        match event {
            Event::Encoder { axis, connected } => self.axes[axis].scale.connect(connected),
            Event::Head { axis, event } => {
                self.axes[axis].scale.head_mut().ok_or(DigitalHead { axis })?.happen(event);
            }
            Event::Jam { axis, jammed } => self.axes[axis].mechanics.jammed = jammed,
            Event::Push { axis, newton } => self.axes[axis].mechanics.push = newton,
            Event::MoveSwitch { axis, um } => self.axes[axis].low.shift(um),
            Event::LoseSwitch { axis } => self.axes[axis].low.shift(-1e9),
            Event::EmergencyStop { pressed } => self.emergency_stop = pressed,
            Event::DriveFault { axis, faulty } => self.axes[axis].drive_fault = faulty,
            Event::SkipTicks { ticks } => self.go_on_alone(ticks),
            Event::HostSilent { silent } => self.heartbeat_age = silent.then_some(0),
        }
        Ok(())
    }

    /// The controller sleeps; the stage goes on with what it was told last, and what it shows meanwhile is lost.
    fn go_on_alone(&mut self, ticks: u32) {
        let outputs = self.outputs;
        for _ in 0..ticks {
            self.step(&outputs);
        }
    }

    /// Where everything really is. For instruments only.
    pub fn truth(&self) -> Truth {
        let slides_um = self.axes.each_ref().map(Axis::place_um);
        // The floor is too quick for the table's elastic reversal to swallow it.
        let tables = self.axes.each_ref().map(|axis| axis.table.place_um() + axis.vibration.um());
        let bent = self.geometry.deviation_um(slides_um);
        let drift = self.heat.drift_um();
        Truth {
            time_s: self.time_s,
            table_um: [0, 1].map(|axis| tables[axis] + bent[axis] + drift[axis] + self.sag_um(tables[axis])),
            slides_um,
            speed_mm_s: self.axes.each_ref().map(|axis| axis.mechanics.speed_mm_s()),
        }
    }

    /// The load bends the middle plate: nothing in the middle of the travel, the whole sag at its ends, where the load
    /// hangs over.
    fn sag_um(&self, place_um: f64) -> f64 {
        let middle_um = self.plant.geometry.travel_mm * 500.0;
        self.plant.load.sag_um_kg * self.plant.load.kg * (place_um - middle_um) / middle_um
    }

    /// The room. For instruments only.
    pub fn heat(&self) -> &Heat {
        &self.heat
    }

    /// The truth this twin was made from. For instruments only.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The seed this twin was made with.
    pub fn seed(&self) -> u64 {
        self.seed
    }
}
