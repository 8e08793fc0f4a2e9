//! Position compare on the edges of a twin: a place of the scale fires wherever the slide truly is there, each time it passes.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use abbe_core::edge::StepRate;
use abbe_core::front::compare::{Counted, Event, Places, When};
use abbe_core::front::{QuadratureCounter, StepEmitter, emitter};
use abbe_twin::Twin;
use abbe_twin::pins::Drive;

/// Clocks of 125 MHz in a tick.
const TICK: u32 = 12_500;
/// That of the preset, in clocks of 125 MHz.
const FILTER: u8 = 50;
/// 5 µm apart, in counts of 0.1 µm from power-on; the scale's noise is less than two.
const PLACES: Places = Places { first: 5000, pitch: 50, number: 200, when: When::Both, play: 4 };

/// x to and fro at up to 16 mm/s, open loop; the events, and the true places of the slide at all ticks, µm.
fn events(ticks: u32) -> (Vec<Event>, Vec<f64>) {
    let mut twin = Twin::standing_at(&common::plant(), &common::config(), 5, [50.0, 50.0]);
    let [lines, _] = twin.lines();
    let mut decoder = QuadratureCounter::new(FILTER, lines.a, lines.b);
    let mut compare = Counted::new(PLACES, decoder.counter(), 0).unwrap();
    let mut emitter = StepEmitter::new(emitter::clocks_per_tick(10_000.0));
    let (mut events, mut truth) = (Vec::new(), vec![twin.truth().slides_um[0]]);
    for tick in 0..ticks {
        let rate = 5.0 * 65_536.0 * (f64::from(tick) / 700.0).sin();
        emitter.begin_tick(StepRate(rate as i32));
        let pulses = [TICK / 2, TICK].map(|at| emitter.pulses_at(at));
        let wires = twin.step_pins(&[Drive { enable: true, pulses, duty: 0 }, Drive::OFF]);
        for edge in &wires.axes[0].edges {
            let clock = u64::from(tick) * u64::from(TICK) + u64::from(edge.clock);
            compare.follow(&mut decoder, clock, |fired| events.extend_from_slice(fired.as_slice()));
            decoder.edge(clock, edge.lines.a, edge.lines.b, edge.lines.z);
        }
        truth.push(twin.truth().slides_um[0]);
    }
    (events, truth)
}

/// Where the slide was when an event fired.
fn place_of(event: &Event, truth: &[f64]) -> f64 {
    let ticks = (event.time - u64::from(FILTER)) as f64 / f64::from(TICK);
    let (tick, part) = (ticks as usize, ticks.fract());
    truth[tick] + part * (truth[tick + 1] - truth[tick])
}

#[test]
fn each_place_fires_in_turn_up_and_down_where_the_slide_is_there() {
    let (events, truth) = events(50_000);
    let mut worst = 0.0_f64;
    for place in 0..PLACES.number {
        let of_place: Vec<&Event> = events.iter().filter(|event| event.place == place).collect();
        // Eleven times to and fro, over all of the places.
        assert!(of_place.len() >= 20, "{place}: {}", of_place.len());
        assert!(of_place[0].up && of_place.windows(2).all(|two| two[0].up != two[1].up), "{place}");
        let spots: Vec<f64> = of_place.iter().map(|event| place_of(event, &truth)).collect();
        let mean = spots.iter().sum::<f64>() / spots.len() as f64;
        worst = spots.iter().fold(worst, |worst, spot| worst.max((spot - mean).abs()));
    }
    println!("{} events, {worst:.3} µm off the mean of their places at most", events.len());
    // The twin spaces the edges of a tick evenly from one whole count to another: up to a count, and the scale's noise.
    assert!(worst < 0.15, "{worst} µm");
}
