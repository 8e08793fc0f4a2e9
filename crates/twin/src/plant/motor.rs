//! `[plant.x.motor]`: a stepper, or a brushed motor on a bridge (`kind = "dc"`).

use super::Range;
use serde::Deserialize;

/// The motor of an axis.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "MotorFile")]
pub enum MotorPlant {
    /// Takes step pulses.
    Stepper(StepperPlant),
    /// Takes the duty of a bridge.
    Dc(DcPlant),
}

/// A stepper.
#[derive(Clone, Debug)]
pub struct StepperPlant {
    /// Full steps a turn.
    pub full_steps: u32,
    /// Pulses a full step.
    pub microsteps: u32,
    /// Holding torque, N·m.
    pub holding_torque_nm: f64,
    /// Detent torque, N·m.
    pub detent_torque_nm: f64,
    /// Speed at which the torque has fallen to 1/√2, rev/s.
    pub corner_rev_s: f64,
    /// Rotor, coupling and screw, kg·mm².
    pub inertia_kg_mm2: f64,
    /// Damping ratio of the rotor's resonance.
    pub damping_ratio: f64,
    /// Peak microstep error, part of a full step.
    pub microstep_error: f64,
}

/// A brushed motor with its H-bridge.
#[derive(Clone, Debug)]
pub struct DcPlant {
    /// Supply of the bridge, V.
    pub supply_v: f64,
    /// Winding, brushes and bridge, Ω.
    pub resistance_ohm: f64,
    /// Winding, mH.
    pub inductance_mh: f64,
    /// Torque of an ampere, N·m/A; the voltage of a turning rotor is the same number of V·s/rad.
    pub constant_nm_a: f64,
    /// Rotor, coupling and screw, kg·mm².
    pub inertia_kg_mm2: f64,
    /// Dry friction of brushes, bearings and preloaded nut, N·m.
    pub drag_nm: f64,
    /// Peak of the torque ripple, part of the torque.
    pub ripple: f64,
    /// Bars of the commutator: ripples a turn.
    pub bars: u32,
    /// Voltage that the bridge's dead time takes from the output, V.
    pub dead_zone_v: f64,
}

/// What drives the axis.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    #[default]
    Stepper,
    Dc,
}

/// The table as it stands in a file. An enum of two tables would lose the line of a wrong key.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorFile {
    #[serde(default)]
    kind: Kind,
    full_steps: Option<u32>,
    microsteps: Option<u32>,
    holding_torque_nm: Option<f64>,
    detent_torque_nm: Option<f64>,
    corner_rev_s: Option<f64>,
    damping_ratio: Option<f64>,
    microstep_error: Option<f64>,
    inertia_kg_mm2: Option<f64>,
    supply_v: Option<f64>,
    resistance_ohm: Option<f64>,
    inductance_mh: Option<f64>,
    constant_nm_a: Option<f64>,
    drag_nm: Option<f64>,
    ripple: Option<f64>,
    bars: Option<u32>,
    dead_zone_v: Option<f64>,
}

/// All keys of one kind and none of the other's.
macro_rules! motor {
    ($file:ident, $kind:literal, $plant:ident { $($own:ident),* }, $($foreign:ident),*) => {{
        $(if $file.$foreign.is_some() {
            return Err(format!(concat!("`", stringify!($foreign), "` is no key of a motor of kind \"{}\""), $kind));
        })*
        Ok($plant {
            $($own: $file.$own.ok_or_else(|| {
                format!(concat!("missing key `", stringify!($own), "` of a motor of kind \"{}\""), $kind)
            })?),*
        })
    }};
}

impl MotorFile {
    fn stepper(self) -> Result<StepperPlant, String> {
        motor!(
            self,
            "stepper",
            StepperPlant {
                full_steps,
                microsteps,
                holding_torque_nm,
                detent_torque_nm,
                corner_rev_s,
                inertia_kg_mm2,
                damping_ratio,
                microstep_error
            },
            supply_v,
            resistance_ohm,
            inductance_mh,
            constant_nm_a,
            drag_nm,
            ripple,
            bars,
            dead_zone_v
        )
    }

    fn dc(self) -> Result<DcPlant, String> {
        motor!(
            self,
            "dc",
            DcPlant {
                supply_v,
                resistance_ohm,
                inductance_mh,
                constant_nm_a,
                inertia_kg_mm2,
                drag_nm,
                ripple,
                bars,
                dead_zone_v
            },
            full_steps,
            microsteps,
            holding_torque_nm,
            detent_torque_nm,
            corner_rev_s,
            damping_ratio,
            microstep_error
        )
    }
}

impl TryFrom<MotorFile> for MotorPlant {
    type Error = String;

    fn try_from(file: MotorFile) -> Result<Self, String> {
        match file.kind {
            Kind::Stepper => file.stepper().map(Self::Stepper),
            Kind::Dc => file.dc().map(Self::Dc),
        }
    }
}

impl MotorPlant {
    /// Rotor, coupling and screw, kg·mm².
    pub fn inertia_kg_mm2(&self) -> f64 {
        match self {
            Self::Stepper(motor) => motor.inertia_kg_mm2,
            Self::Dc(motor) => motor.inertia_kg_mm2,
        }
    }

    pub(super) fn ranges(&self) -> Vec<Range> {
        let mut ranges = match self {
            Self::Stepper(motor) => motor.ranges(),
            Self::Dc(motor) => motor.ranges(),
        };
        ranges.push(Range(".motor", "inertia_kg_mm2", self.inertia_kg_mm2(), 0.1, 1e5));
        ranges
    }
}

impl StepperPlant {
    fn ranges(&self) -> Vec<Range> {
        vec![
            Range(".motor", "full_steps", f64::from(self.full_steps), 4.0, 10_000.0),
            Range(".motor", "microsteps", f64::from(self.microsteps), 1.0, 1024.0),
            Range(".motor", "holding_torque_nm", self.holding_torque_nm, 1e-3, 100.0),
            Range(".motor", "detent_torque_nm", self.detent_torque_nm, 0.0, 100.0),
            Range(".motor", "corner_rev_s", self.corner_rev_s, 0.1, 1e4),
            Range(".motor", "damping_ratio", self.damping_ratio, 0.0, 2.0),
            Range(".motor", "microstep_error", self.microstep_error, 0.0, 1.0),
        ]
    }
}

impl DcPlant {
    fn ranges(&self) -> Vec<Range> {
        vec![
            Range(".motor", "supply_v", self.supply_v, 1.0, 400.0),
            Range(".motor", "resistance_ohm", self.resistance_ohm, 0.01, 1000.0),
            Range(".motor", "inductance_mh", self.inductance_mh, 0.001, 1000.0),
            Range(".motor", "constant_nm_a", self.constant_nm_a, 1e-4, 10.0),
            Range(".motor", "drag_nm", self.drag_nm, 0.0, 10.0),
            Range(".motor", "ripple", self.ripple, 0.0, 0.5),
            Range(".motor", "bars", f64::from(self.bars), 2.0, 200.0),
            Range(".motor", "dead_zone_v", self.dead_zone_v, 0.0, self.supply_v),
        ]
    }
}
