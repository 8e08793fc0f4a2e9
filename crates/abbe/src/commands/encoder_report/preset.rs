//! What was found, as `[controller.x.encoder]` of a preset takes it.

use super::Report;
use abbe_core::sense::harmonics::Harmonics;
use serde_json::{Value, json};

/// Keys and their values, in the order of a preset. The table belongs to the ellipse beside which it was learned: both
/// go into the preset, or the first two harmonics are wrong.
#[derive(Clone, Copy, Debug)]
pub(super) struct Keys {
    /// Part of the converter's full scale; none where the converter is not known.
    amplitude: Option<f64>,
    /// Parts of the amplitude; none where the zero is not known.
    offsets: Option<[f64; 2]>,
    gain: f64,
    phase_deg: f64,
    harmonics: Harmonics,
}

impl Keys {
    /// Once a table was learned.
    pub(super) fn of(report: &Report<'_>) -> Option<Self> {
        let agreed = report.agreed?;
        let taken = &report.learned.taken;
        let shape = report.shape(taken);
        let amplitude = report.signals.survey.converter.map(|converter| {
            let [low, high] = converter.ends();
            2.0 * taken.radius / (high + 1.0 - low)
        });
        Some(Self {
            amplitude,
            offsets: shape.offsets.map(|offsets| offsets.map(|percent| percent / 100.0)),
            gain: shape.gain,
            phase_deg: shape.phase_deg,
            harmonics: agreed.harmonics,
        })
    }

    /// Lines of TOML.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        lines.extend(self.amplitude.map(|amplitude| format!("amplitude = {amplitude:.4}")));
        if let Some([cos, sin]) = self.offsets {
            lines.extend([format!("offset_cos = {cos:.5}"), format!("offset_sin = {sin:.5}")]);
        }
        lines.push(format!("gain = {:.5}", self.gain));
        lines.push(format!("phase_deg = {:.3}", self.phase_deg));
        let pairs = self.harmonics.0.map(|[cos, sin]| format!("[{cos:.7}, {sin:.7}]"));
        lines.push(format!("harmonics = [{}]", pairs.join(", ")));
        lines
    }

    /// The same for programs: null where a key is not known.
    pub(super) fn document(&self) -> Value {
        json!({
            "amplitude": self.amplitude,
            "offset_cos": self.offsets.map(|[cos, _]| cos),
            "offset_sin": self.offsets.map(|[_, sin]| sin),
            "gain": self.gain,
            "phase_deg": self.phase_deg,
            "harmonics": self.harmonics.0,
        })
    }
}
