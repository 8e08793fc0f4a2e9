//! The truth of a stage: the `[plant]` half of a preset. Nothing but the twin reads it.

use crate::camera::CameraSettings;
use serde::Deserialize;

mod error;
mod head;
mod motor;

pub use error::{PresetError, line_of};
pub use head::HeadPlant;
pub use motor::{DcPlant, MotorPlant, StepperPlant};

/// Everything that is true of a stage and its surroundings.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plant {
    /// X axis.
    pub x: AxisPlant,
    /// Y axis.
    pub y: AxisPlant,
    /// Guides and how the scales lie to the table.
    pub geometry: GeometryPlant,
    /// Room, motors, glass, aluminium.
    pub heat: HeatPlant,
    /// What stands on the table.
    pub load: LoadPlant,
    /// Delays of the control loop.
    #[serde(rename = "loop")]
    pub timing: LoopPlant,
    /// Reference instrument.
    pub interferometer: InterferometerPlant,
    /// Thermometers on scale and structure.
    pub thermometers: ThermometerPlant,
    /// The microscope's camera.
    pub camera: CameraSettings,
}

/// One axis.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisPlant {
    /// Moving mass without load, kg.
    pub mass_kg: f64,
    /// Motor.
    pub motor: MotorPlant,
    /// Ball screw.
    pub screw: ScrewPlant,
    /// Friction of guides and nut.
    pub friction: FrictionPlant,
    /// Scale and reading head.
    pub scale: ScalePlant,
    /// The head, if it puts out a sine and a cosine; without this table it puts out square waves.
    pub head: Option<HeadPlant>,
    /// Limit switches.
    pub switches: SwitchPlant,
    /// End stops.
    pub stops: StopPlant,
}

/// A ball screw.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScrewPlant {
    /// mm a turn.
    pub lead_mm: f64,
    /// Amplitude of the error that repeats every turn, µm.
    pub once_per_turn_um: f64,
    /// Backlash, µm.
    pub backlash_um: f64,
    /// Stiffness of bearing, screw and nut, N/µm.
    pub stiffness_n_um: f64,
    /// Damping ratio of slide on screw.
    pub damping_ratio: f64,
}

/// LuGre friction.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionPlant {
    /// Coulomb friction, N.
    pub coulomb_n: f64,
    /// Breakaway force, N.
    pub breakaway_n: f64,
    /// Stribeck speed, mm/s.
    pub stribeck_mm_s: f64,
    /// Viscous friction, N per mm/s.
    pub viscous_n_s_mm: f64,
    /// Presliding stiffness, N/µm.
    pub presliding_n_um: f64,
    /// Presliding damping, N per mm/s.
    pub bristle_damping_n_s_mm: f64,
}

/// An incremental scale.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalePlant {
    /// Grating period, µm.
    pub grating_um: f64,
    /// From one edge of the two lines to the next, µm: one count after 4× decoding, whatever the controller decodes.
    pub count_um: f64,
    /// actual − reading at the zero, µm.
    pub error_offset_um: f64,
    /// Slope of the error, µm/mm.
    pub error_slope_um_mm: f64,
    /// Curvature of the error, µm/mm².
    pub error_curvature_um_mm2: f64,
    /// Local graduation error, µm rms.
    pub graduation_rms_um: f64,
    /// Correlation length of the graduation error, mm.
    pub graduation_length_mm: f64,
    /// Amplitude of the cyclic error, µm.
    pub cyclic_um: f64,
    /// Noise of the reading head, µm rms.
    pub noise_um: f64,
    /// What the floor moves the head against the grating, 5 … 50 Hz, nm rms; without this key nothing.
    #[serde(default)]
    pub vibration_nm: f64,
    /// Expansion of the glass, µm/m/K.
    pub expansion_um_m_k: f64,
    /// Reference mark, mm.
    pub index_mm: f64,
    /// Range in which the reference mark repeats, counts.
    pub index_jitter_counts: f64,
    /// Probability of a disturbance on the line, per tick.
    pub glitch_probability: f64,
}

/// Limit switches of an axis.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SwitchPlant {
    /// Low switch, mm.
    pub low_mm: f64,
    /// High switch, mm.
    pub high_mm: f64,
    /// Scatter of the closing place, µm rms.
    pub scatter_um: f64,
    /// Time of bouncing, ms.
    pub bounce_ms: f64,
}

/// Rubber end stops.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StopPlant {
    /// Low stop, mm.
    pub low_mm: f64,
    /// High stop, mm.
    pub high_mm: f64,
}

/// Guides, and where the scales lie.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryPlant {
    /// The Y slide carries the X slide (paper B's stage); without this key X carries Y (paper A's).
    #[serde(default)]
    pub y_carries_x: bool,
    /// Travel over which the waves below are counted, mm.
    pub travel_mm: f64,
    /// Scale to table centre, sideways, mm.
    pub scale_sideways_mm: f64,
    /// Scale to table centre, downwards, mm.
    pub scale_down_mm: f64,
    /// Pitch, yaw and roll, arc seconds peak to peak in two and three waves.
    pub angle_arcsec_pp: f64,
    /// Straightness, µm peak to peak.
    pub straightness_um_pp: f64,
    /// Out of squareness, arc seconds; positive opens the angle.
    pub squareness_arcsec: f64,
    /// Elastic reversal of the table, µm between the two directions.
    pub reversal_um: f64,
    /// Random place of the table, µm rms, drawn anew at each move.
    pub random_um: f64,
}

/// Heat.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeatPlant {
    /// Mean of the room, °C.
    pub room_c: f64,
    /// Swing of the room, ± K.
    pub room_swing_k: f64,
    /// Period of the swing, s.
    pub room_period_s: f64,
    /// Drift of the table when the motors are warm, µm.
    pub motor_drift_um: f64,
    /// Time constant of that drift, s.
    pub motor_time_s: f64,
    /// Time constant of the glass, s.
    pub scale_time_s: f64,
    /// Time constant of the aluminium, s.
    pub structure_time_s: f64,
    /// Expansion of the aluminium, µm/m/K.
    pub structure_um_m_k: f64,
    /// Aluminium between the scale's fixed point and the table's centre, mm.
    pub structure_length_mm: f64,
}

/// What stands on the table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadPlant {
    /// Mass, kg; 0 … 10.
    pub kg: f64,
    /// Additional friction, N/kg.
    pub friction_n_kg: f64,
    /// Sag of the table, µm/kg; it tilts the reading by the down offset.
    pub sag_um_kg: f64,
}

/// Delays of the loop.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopPlant {
    /// Jitter of a tick, part of a tick rms.
    pub jitter: f64,
    /// Probability that a sample comes too late and the last one is seen again.
    pub missed_sample_probability: f64,
}

/// The interferometer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InterferometerPlant {
    /// Noise, µm rms.
    pub noise_um: f64,
    /// Dead path, µm/K.
    pub dead_path_um_k: f64,
    /// Misalignment of a set-up, mrad rms each way.
    pub misalignment_mrad: f64,
    /// Air left after correction, ± ppm.
    pub air_ppm: f64,
}

/// Thermometers.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermometerPlant {
    /// Offset, K rms.
    pub offset_k: f64,
    /// Noise, K rms.
    pub noise_k: f64,
}

/// The two halves; the controller's is somebody else's.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Halves {
    #[serde(rename = "controller")]
    _controller: serde::de::IgnoredAny,
    plant: Plant,
}

/// Lays the values of one table over those of another that has the same keys; names the first key that it has not.
fn lay_over(table: &mut toml::Table, own: &toml::Table) -> Result<(), String> {
    for (key, value) in own {
        let place = table.get_mut(key).ok_or_else(|| format!("the preset has no key `{key}` there"))?;
        match (place, value) {
            (toml::Value::Table(place), toml::Value::Table(value)) => lay_over(place, value)?,
            (place, value) if place.same_type(value) => *place = value.clone(),
            (place, value) => return Err(format!("`{key}` = {value} is of another type than {place}")),
        }
    }
    Ok(())
}

impl Plant {
    /// Reads the `[plant]` half of the text of a preset.
    ///
    /// # Errors
    /// Names file, line and key of what is unknown, missing, of the wrong type or outside its range.
    pub fn read(file: &str, text: &str) -> Result<Self, PresetError> {
        let halves: Halves =
            toml::from_str(text).map_err(|error| PresetError::from_toml(file, text, &error))?;
        halves.plant.check(file, text)?;
        Ok(halves.plant)
    }

    /// The same with some values of its own: a table in the shape of `[plant]` that holds only what differs.
    ///
    /// # Errors
    /// As [`Plant::read`], and for a key that the preset does not have.
    pub fn read_with(file: &str, text: &str, own: &toml::Table) -> Result<Self, PresetError> {
        let wrong = |message: String| PresetError { file: file.to_owned(), line: None, message };
        let mut preset: toml::Table =
            toml::from_str(text).map_err(|error| PresetError::from_toml(file, text, &error))?;
        let plant = preset.get_mut("plant").and_then(toml::Value::as_table_mut);
        lay_over(plant.ok_or_else(|| wrong("there is no [plant]".into()))?, own).map_err(wrong)?;
        Self::read(file, &toml::to_string(&preset).map_err(|error| wrong(error.to_string()))?)
    }

    /// Numbers that no stage can have would make the simulation explode or crawl instead of failing here.
    fn check(&self, file: &str, text: &str) -> Result<(), PresetError> {
        let axes =
            [(&self.x, "x"), (&self.y, "y")].map(|(axis, name)| (axis.ranges(), format!("plant.{name}")));
        for (ranges, place) in axes.into_iter().chain([(self.ranges(), "plant".to_owned())]) {
            for Range(section, key, value, low, high) in ranges {
                if !(low..=high).contains(&value) {
                    let header = format!("[{place}{section}]");
                    let line = line_of(text, &header, key);
                    let message = format!("`{key}` = {value} in {header} must be {low} … {high}");
                    return Err(PresetError { file: file.to_owned(), line, message });
                }
            }
        }
        self.camera.check().map_err(|error| {
            let line = line_of(text, "[plant.camera]", error.key);
            PresetError { file: file.to_owned(), line, message: error.to_string() }
        })
    }
}

impl AxisPlant {
    fn ranges(&self) -> Vec<Range> {
        let (screw, friction, scale) = (&self.screw, &self.friction, &self.scale);
        let mut ranges = vec![
            Range("", "mass_kg", self.mass_kg, 0.1, 1000.0),
            Range(".screw", "lead_mm", screw.lead_mm, 0.05, 100.0),
            Range(".screw", "once_per_turn_um", screw.once_per_turn_um, 0.0, 1000.0),
            Range(".screw", "backlash_um", screw.backlash_um, 0.0, 1000.0),
            Range(".screw", "stiffness_n_um", screw.stiffness_n_um, 0.01, 100.0),
            Range(".screw", "damping_ratio", screw.damping_ratio, 0.0, 1.0),
            Range(".friction", "coulomb_n", friction.coulomb_n, 1e-3, 1e4),
            Range(".friction", "breakaway_n", friction.breakaway_n, 1e-3, 1e4),
            Range(".friction", "stribeck_mm_s", friction.stribeck_mm_s, 1e-3, 1e3),
            Range(".friction", "viscous_n_s_mm", friction.viscous_n_s_mm, 0.0, 10.0),
            Range(".friction", "presliding_n_um", friction.presliding_n_um, 1e-3, 100.0),
            Range(".friction", "bristle_damping_n_s_mm", friction.bristle_damping_n_s_mm, 0.0, 10.0),
            Range(".scale", "grating_um", scale.grating_um, 0.1, 1e4),
            Range(".scale", "count_um", scale.count_um, 0.001, 100.0),
            Range(".scale", "error_offset_um", scale.error_offset_um, -1000.0, 1000.0),
            Range(".scale", "error_slope_um_mm", scale.error_slope_um_mm, -50.0, 50.0),
            Range(".scale", "error_curvature_um_mm2", scale.error_curvature_um_mm2, -0.5, 0.5),
            Range(".scale", "graduation_rms_um", scale.graduation_rms_um, 0.0, 100.0),
            Range(".scale", "graduation_length_mm", scale.graduation_length_mm, 0.5, 1e4),
            Range(".scale", "cyclic_um", scale.cyclic_um, 0.0, 1.0),
            Range(".scale", "noise_um", scale.noise_um, 0.0, 1.0),
            Range(".scale", "vibration_nm", scale.vibration_nm, 0.0, 1e4),
            Range(".scale", "expansion_um_m_k", scale.expansion_um_m_k, -100.0, 100.0),
            Range(".scale", "index_mm", scale.index_mm, -1000.0, 1000.0),
            Range(".scale", "index_jitter_counts", scale.index_jitter_counts, 0.0, 1000.0),
            Range(".scale", "glitch_probability", scale.glitch_probability, 0.0, 1.0),
            Range(".switches", "low_mm", self.switches.low_mm, -1000.0, 1000.0),
            Range(".switches", "high_mm", self.switches.high_mm, self.switches.low_mm, 1000.0),
            Range(".switches", "scatter_um", self.switches.scatter_um, 0.0, 1e4),
            Range(".switches", "bounce_ms", self.switches.bounce_ms, 0.0, 1000.0),
            Range(".stops", "low_mm", self.stops.low_mm, -1000.0, 1000.0),
            Range(".stops", "high_mm", self.stops.high_mm, self.stops.low_mm, 1000.0),
        ];
        ranges.extend(self.motor.ranges());
        if let Some(head) = &self.head {
            // The comparators make four counts of a period, whatever the file says.
            let count = scale.grating_um / 4.0;
            ranges.push(Range(".scale", "count_um", scale.count_um, count, count));
            ranges.extend(head.ranges());
        }
        ranges
    }
}

impl Plant {
    fn ranges(&self) -> Vec<Range> {
        let (geometry, heat, load) = (&self.geometry, &self.heat, &self.load);
        vec![
            Range(".geometry", "travel_mm", geometry.travel_mm, 1.0, 1000.0),
            Range(".geometry", "angle_arcsec_pp", geometry.angle_arcsec_pp, 0.0, 3600.0),
            Range(".geometry", "straightness_um_pp", geometry.straightness_um_pp, 0.0, 1000.0),
            Range(".geometry", "reversal_um", geometry.reversal_um, 0.0, 100.0),
            Range(".geometry", "random_um", geometry.random_um, 0.0, 100.0),
            Range(".heat", "room_period_s", heat.room_period_s, 1.0, 1e6),
            Range(".heat", "motor_time_s", heat.motor_time_s, 1.0, 1e6),
            Range(".heat", "scale_time_s", heat.scale_time_s, 1.0, 1e6),
            Range(".heat", "structure_time_s", heat.structure_time_s, 1.0, 1e6),
            Range(".load", "kg", load.kg, 0.0, 100.0),
            Range(".load", "friction_n_kg", load.friction_n_kg, 0.0, 100.0),
            Range(".loop", "jitter", self.timing.jitter, 0.0, 0.1),
            Range(".loop", "missed_sample_probability", self.timing.missed_sample_probability, 0.0, 0.5),
            Range(".interferometer", "noise_um", self.interferometer.noise_um, 0.0, 1000.0),
            Range(".thermometers", "noise_k", self.thermometers.noise_k, 0.0, 100.0),
        ]
    }
}

/// Section, key and value, and the lowest and highest value that a stage may have.
struct Range(&'static str, &'static str, f64, f64, f64);

#[cfg(test)]
mod tests {
    use super::*;

    const PRESET: &str = include_str!("../../../presets/microscope-100.toml");

    #[test]
    fn a_number_that_no_stage_has_is_named_with_its_line() {
        Plant::read("m", PRESET).unwrap();
        for (good, bad) in [
            ("mass_kg = 3.2", "mass_kg = 1e300"),
            ("graduation_length_mm = 5.0", "graduation_length_mm = 0.0"),
            ("stiffness_n_um = 20.0", "stiffness_n_um = 1e9"),
            ("noise_um = 0.005", "noise_um = 1e9"),
            ("jitter = 0.01", "jitter = nan"),
            ("motor_time_s = 600.0", "motor_time_s = 0.0"),
        ] {
            let text = PRESET.replacen(good, bad, 1);
            let line = 1 + text[..text.find(bad).unwrap()].matches('\n').count();
            let error = Plant::read("m.toml", &text).unwrap_err();
            assert_eq!(error.line, Some(line), "{error}");
        }
    }
}
