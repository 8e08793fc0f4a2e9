//! `abbe home`.

use super::{Answer, HERE, Wanted, signals};
use crate::cli::Home;
use crate::failure::Failure;
use crate::preset::Preset;
use crate::progress;
use crate::rig::Rig;
use abbe_core::Pos;
use abbe_core::publish::HomeReport;
use abbe_twin::noise::Noise;
use indicatif::ProgressBar;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Home) -> Result<Answer, Failure> {
    let mut rig = Wanted::new(preset, seed, &asked.source)?.homed(Path::new(HERE))?;
    let mut homings = vec![reports(&rig)];
    let mut places = Noise::new(seed, "places to home from");
    let again = asked.times - 1;
    let bar = if again > 0 { progress::bar("homing again", again as usize) } else { ProgressBar::hidden() };
    for _ in 0..again {
        bar.inc(1);
        let travel = rig.controller().config().axes.map(|axis| [axis.low.mm(), axis.high.mm()]);
        rig.move_to(travel.map(|[low, high]| places.uniform(low, high)))?;
        rig.home()?;
        homings.push(reports(&rig));
    }
    bar.finish_and_clear();
    Ok(Answer { text: text(&rig, &homings), json: document(&rig, &homings) })
}

fn reports(rig: &Rig) -> [HomeReport; 2] {
    rig.status().axes.map(|axis| axis.home)
}

fn worst_shift_um(homings: &[[HomeReport; 2]], axis: usize) -> Option<f64> {
    let shifts = homings.iter().filter_map(|both| both[axis].zero_shift);
    shifts.map(|shift| shift.um().abs()).max_by(f64::total_cmp)
}

fn text(rig: &Rig, homings: &[[HomeReport; 2]]) -> String {
    let mut text = String::new();
    let last = &homings[homings.len() - 1];
    for (axis, (name, report)) in ["x", "y"].into_iter().zip(last).enumerate() {
        let position = rig.position_mm()[axis];
        _ = write!(
            text,
            "{name}: homed at {position:.4} mm; the switch closes at {:.4} mm",
            report.switch.mm()
        );
        if let Some(shift) = report.zero_shift {
            _ = write!(text, "; zero moved {:+.2} µm since last time", shift.um());
        }
        if let Some(shift) = report.switch_shift {
            _ = write!(text, ", the switch {:+.1} µm", shift.um());
        }
        if let Some(worst) = worst_shift_um(homings, axis).filter(|_| homings.len() > 2) {
            _ = write!(text, "; largest move of zero in {} homings {worst:.2} µm", homings.len());
        }
        text.push('\n');
    }
    text.push_str(signals::text(&rig.status()).trim_start());
    text
}

fn document(rig: &Rig, homings: &[[HomeReport; 2]]) -> Value {
    let axis = |axis: usize| {
        let each: Vec<Value> = homings
            .iter()
            .map(|both| {
                let report = both[axis];
                json!({
                    "switch_mm": report.switch.mm(),
                    "zero_shift_um": report.zero_shift.map(Pos::um),
                    "switch_shift_um": report.switch_shift.map(Pos::um),
                })
            })
            .collect();
        json!({
            "position_mm": rig.position_mm()[axis],
            "largest_zero_shift_um": worst_shift_um(homings, axis),
            "homings": each,
        })
    };
    json!({
        "homed": true,
        "x": axis(0),
        "y": axis(1),
        "signals": signals::json(&rig.status()),
        "simulated_s": rig.time_s(),
    })
}
