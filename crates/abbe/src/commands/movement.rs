//! `abbe move X Y`.

use super::{Answer, HERE, Wanted, signals};
use crate::cli::Move;
use crate::failure::Failure;
use crate::preset::Preset;
use serde_json::json;
use std::path::Path;

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Move) -> Result<Answer, Failure> {
    let mut rig = Wanted::new(preset, seed, &asked.source)?.homed(Path::new(HERE))?;
    let to = [asked.x, asked.y];
    let arrival = if asked.sequential { rig.move_in_turn_to(to)? } else { rig.move_to(to)? };
    let [x, y] = arrival.position_mm;
    let [error_x, error_y] = rig.status().axes.map(|axis| axis.following_error.um());
    let text = format!(
        "arrived at x {x:.4} mm, y {y:.4} mm ({error_x:+.2} µm, {error_y:+.2} µm from the set-point); \
         {:.3} s on the path{}, {:.0} ms to settle (with the dwell){}",
        arrival.moved_s,
        if asked.sequential { " (x first, then y)" } else { "" },
        arrival.settle_s * 1e3,
        signals::text(&rig.status())
    );
    let json = json!({
        "target_mm": [asked.x, asked.y],
        "position_mm": [x, y],
        "following_error_um": [error_x, error_y],
        "sequential": asked.sequential,
        "moved_s": arrival.moved_s,
        "settle_s": arrival.settle_s,
        "signals": signals::json(&rig.status()),
    });
    Ok(Answer { text, json })
}
