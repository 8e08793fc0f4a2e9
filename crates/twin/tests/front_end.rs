//! Decoding and the pulse filter as a builder sets them, from the preset's key to where the slides stand.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod preset;

use abbe_core::design::AxisSettings;
use abbe_core::publish::{Fault, Outcome};
use abbe_core::sense::health::SignalFault;
use abbe_core::{Command, Controller, Outputs, Pos, background};
use abbe_twin::{Plant, Twin};

struct Stage {
    twin: Twin,
    controller: Controller<2>,
    outputs: Outputs<2>,
    /// What the counters of both axes show.
    counters: [u32; 2],
}

impl Stage {
    /// Powers a stage on whose builder has set his axes otherwise, with so many disturbances a tick on each axis.
    fn new(text: &str, disturbances: f64, set: impl Fn(&mut AxisSettings)) -> Self {
        let mut settings = preset::settings(text).unwrap();
        settings.axes.iter_mut().for_each(set);
        let mut plant = Plant::read("preset", text).unwrap();
        plant.x.scale.glitch_probability = disturbances;
        plant.y.scale.glitch_probability = disturbances;
        let config = settings.build().unwrap();
        let twin = Twin::standing_at(&plant, &config, 3, [1.0, 1.5]);
        let mut stage =
            Self { twin, controller: Controller::new(config), outputs: Outputs::OFF, counters: [0; 2] };
        stage.tick();
        stage
    }

    fn tick(&mut self) {
        let inputs = self.twin.step(&self.outputs);
        self.counters = inputs.axes.map(|axis| axis.counter);
        self.outputs = self.controller.tick(&inputs);
        while background::advance(&mut self.controller).is_some() {}
    }

    /// What came of it, if it is a fault.
    fn work(&mut self, command: Command<2>) -> Option<Fault> {
        self.controller.command(command).unwrap();
        self.tick();
        while self.controller.status().state.is_busy() {
            self.tick();
        }
        self.controller.status().fault
    }

    /// Goes there and is inside its window.
    fn go(&mut self, mm: f64) {
        assert_eq!(self.work(Command::MoveTo([Pos::from_mm(mm); 2])), None);
        let status = self.controller.status();
        assert_eq!(status.last_move.unwrap().outcome, Outcome::Arrived);
        for (axis, config) in status.axes.iter().zip(&self.controller.config().axes) {
            let off = Pos::from_mm(mm) - axis.position;
            assert!(off.pm().abs() <= config.window.pm(), "{} µm beside {mm} mm", off.um());
        }
    }

    fn glitches(&self) -> [u32; 2] {
        self.controller.status().axes.map(|axis| axis.glitches)
    }
}

/// Counts of 0.1, 0.2 and 0.4 µm: the same way is so many, and the table goes the same way.
#[test]
fn each_decoding_homes_and_moves_by_its_own_counts() {
    const WAY_MM: f64 = 2.5;
    for (decode, count_um) in [(4, 0.1), (2, 0.2), (1, 0.4)] {
        let mut stage = Stage::new(preset::MICROSCOPE_100, 0.0002, |axis| {
            axis.decode = decode;
            axis.count_um = count_um;
        });
        assert_eq!(stage.work(Command::Home), None);
        stage.go(0.5);
        let (counters, slides) = (stage.counters, stage.twin.truth().slides_um);
        stage.go(0.5 + WAY_MM);
        // Either end may be a window beside its target.
        let expected = WAY_MM * 1e3 / count_um;
        for (after, before) in stage.counters.iter().zip(counters) {
            let counts = f64::from(after.wrapping_sub(before).cast_signed());
            assert!((counts - expected).abs() <= 1.0 / count_um, "{decode}×: {counts} counts");
        }
        // Paper A's scales err by 0.95 and 0.64 µm a millimetre; graduation and cyclic error add to the windows.
        for ((after, before), slope) in stage.twin.truth().slides_um.iter().zip(slides).zip([0.9473, 0.6397])
        {
            let beside = after - before - WAY_MM * (1e3 + slope);
            assert!(beside.abs() < 2.0, "{decode}×: the slide went {beside} µm too far");
        }
    }
}

/// The preset's disturbances, a thousand times as many, of 0.1 to 2 µs each. Those that pass the filter count to and fro; where
/// that meets the change of the other line, counts are lost, which is seen by the phase.
#[test]
fn without_its_filter_the_stage_of_paper_b_counts_disturbances() {
    let disturbed = |filter_ns| Stage::new(preset::LITHO_120, 0.2, |axis| axis.filter_ns = filter_ns);
    let mut filtered = disturbed(2000);
    assert_eq!(filtered.work(Command::Home), None);
    filtered.go(0.5);
    let status = filtered.controller.status();
    assert_eq!(status.axes.map(|axis| axis.illegal), [0; 2]);
    // One tick in five.
    let ticks = f64::from(status.tick);
    for glitches in filtered.glitches() {
        assert!((f64::from(glitches) / ticks - 0.2).abs() < 0.01, "{glitches} in {ticks} ticks");
    }
    for filter_ns in [0, 300] {
        let mut bare = disturbed(filter_ns);
        let fault = bare.work(Command::Home);
        let disagrees = |axis| Some(Fault::Signal { axis, what: SignalFault::Disagrees });
        assert!(fault == disagrees(0) || fault == disagrees(1), "filter {filter_ns} ns: {fault:?}");
        assert!(bare.controller.status().axes.iter().any(|axis| axis.illegal > 0), "filter {filter_ns} ns");
    }
}

/// As many disturbances as the preset has: what is shorter than the filter is told as a glitch, and what is not is not.
#[test]
fn the_filter_decides_what_is_a_glitch() {
    let glitches = |filter_ns| {
        let mut stage = Stage::new(preset::MICROSCOPE_100, 0.0002, |axis| axis.filter_ns = filter_ns);
        assert_eq!(stage.work(Command::Home), None);
        stage.go(5.0);
        stage.glitches().iter().sum::<u32>()
    };
    // Of 0.1 … 2 µs three in twenty are shorter than 400 ns, the filter of 300 ns at the twin's clock.
    let [off, preset, longest] = [0, 300, 2000].map(glitches);
    assert!(off == 0 && preset > 0 && preset < longest, "{off}, {preset}, {longest}");
}
