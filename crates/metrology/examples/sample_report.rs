//! Writes a report of invented readings, to look at the page without a stage.
//!
//! `cargo run --release -p abbe-metrology --example sample_report -- OUT.html [PICTURE.png]`

use std::error::Error;
use std::path::Path;

use abbe_metrology::compensation::ErrorCurve;
use abbe_metrology::readings::Readings;
use abbe_metrology::report::{
    AxisReport, Before, Conditions, Picture, RawFile, Report, SettledStep, TemperatureLog, headline,
};
use abbe_metrology::verify::Limits;
use abbe_metrology::{Axis, fit, iso230, targets};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A stage with the polynomials of paper A, a screw, a reversal, a drift from run to run, and scatter. µm over mm.
struct Invented {
    polynomial: [f64; 3],
    reversal: f64,
    random: Pcg64,
}

impl Invented {
    fn error_um(&mut self, x: f64, from_above: bool, run: usize) -> f64 {
        let [a, b, c] = self.polynomial;
        let screw = 0.4 * (x * std::f64::consts::TAU / 12.7).sin();
        let reversal = if from_above { -self.reversal } else { 0.0 };
        let scatter: f64 = (0..12).map(|_| self.random.random::<f64>()).sum::<f64>() - 6.0;
        a + b * x + c * x * x + screw + reversal + 0.05 * run as f64 + 0.12 * scatter
    }

    /// Readings at `targets`, each commanded where `curve` says.
    fn measure(
        &mut self,
        targets: &[f64],
        runs: usize,
        curve: Option<&ErrorCurve>,
    ) -> Result<Readings, Box<dyn Error>> {
        let mut side = |from_above| -> Vec<Vec<f64>> {
            let at = |&target: &f64| {
                let command = curve.map_or(target, |curve| curve.inverse(target).command_mm);
                (0..runs).map(|run| command + self.error_um(command, from_above, run) / 1e3).collect()
            };
            targets.iter().map(at).collect()
        };
        Ok(Readings::new(targets, &side(false), &side(true))?)
    }
}

fn axis_report(axis: Axis, polynomial: [f64; 3], seed: u64) -> Result<AxisReport, Box<dyn Error>> {
    let mut stage = Invented { polynomial, reversal: 0.5, random: Pcg64::seed_from_u64(seed) };
    let before = stage.measure(&targets::even(0.0, 100.0, 5.0)?, 5, None)?;
    let fit = fit::choose(&fit::mean_error(&iso230::evaluate(&before)), fit::DEFAULT_MAX_DEGREE)?;
    let curve = ErrorCurve::new(fit.polynomial.clone())?;
    let after = stage.measure(&targets::iso230(0.0, 100.0, 11, seed)?, 7, Some(&curve))?;
    Ok(AxisReport { axis, before: Some(Before { readings: before, fit }), after })
}

/// A move of 5 mm with a lag and a ring that dies out.
fn step() -> SettledStep {
    let t_s: Vec<f64> = (0..8000).map(|i| f64::from(i) * 1e-4).collect();
    let set = |t: f64| {
        let u = (t / 0.4).min(1.0);
        10.0 + 5.0 * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
    };
    let ring =
        |t: f64| if t > 0.4 { 4e-3 * (-(t - 0.4) * 30.0).exp() * ((t - 0.4) * 400.0).cos() } else { 0.0 };
    SettledStep {
        axis: Axis::X,
        set_mm: t_s.iter().map(|&t| set(t)).collect(),
        actual_mm: t_s.iter().map(|&t| set((t - 0.004).max(0.0)) + ring(t)).collect(),
        window_um: 0.3,
        dwell_s: 0.05,
        done_s: 0.55,
        t_s,
    }
}

fn temperature(name: &str, offset: f64) -> TemperatureLog {
    let wave = |i: i32| 21.5 + offset + 0.2 * (f64::from(i) * 0.3).sin();
    TemperatureLog {
        name: name.to_owned(),
        readings: (0..40).map(|i| (f64::from(i) * 60.0, wave(i))).collect(),
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("give the path of the report")?;
    let axes = vec![
        axis_report(Axis::X, [1.563, 0.9473, -0.0006], 1)?,
        axis_report(Axis::Y, [1.021, 0.6397, 0.0168], 2)?,
    ];
    let images = match arguments.next() {
        Some(path) => {
            vec![Picture { png: std::fs::read(path)?, caption: "The stitched specimen (preview)".into() }]
        }
        None => Vec::new(),
    };
    let raw = |path: &str, what: &str| RawFile { path: path.into(), what: what.into() };
    let limits = Limits::default();
    let report = Report {
        title: "Positioning of a microscope stage".into(),
        conditions: Conditions {
            preset: "invented stage".into(),
            seed: Some(1),
            software: concat!("abbe ", env!("CARGO_PKG_VERSION")).into(),
            date: "2026-01-01".into(),
            warm_up_s: Some(1800.0),
            more: vec![("Measuring line".into(), "through the centre of the table".into())],
        },
        headline: headline(&axes, &limits),
        axes,
        limits,
        step: Some(step()),
        temperatures: vec![temperature("scale", 0.0), temperature("structure", 0.15)],
        images,
        raw_files: vec![
            raw("measure/readings-x.csv", "interferometer readings before compensation, X"),
            raw("verify/readings-x.csv", "interferometer readings after compensation, X"),
        ],
    };
    report.write(Path::new(&out))?;
    Ok(())
}
