//! `abbe compensate READINGS…`.

use super::{Answer, today};
use crate::cli::Compensate;
use crate::failure::Failure;
use crate::folder;
use crate::preset::Preset;
use abbe_metrology::compensation::{AxisCompensation, Circumstances, Compensation};
use abbe_metrology::fit::{self, Fit};
use abbe_metrology::readings::Readings;
use abbe_metrology::{Axis, iso230};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Fits the mean error of both directions.
pub(super) fn fit(readings: &Readings, max_degree: usize) -> Result<Fit, Failure> {
    Ok(fit::choose(&fit::mean_error(&iso230::evaluate(readings)), max_degree)?)
}

pub(crate) fn run(preset: &Preset, asked: &Compensate) -> Result<Answer, Failure> {
    let given = axes_of(&asked.readings)?;
    let _folder = folder::prepare_file("--out", &asked.out, asked.force)?;
    let mut compensation = Compensation { date: today(), preset: preset.name.clone(), x: None, y: None };
    let (mut text, mut json, mut notes) = (String::new(), Map::new(), Vec::new());
    for (axis, file) in given {
        let readings = Readings::read(&file)?;
        notes.extend(readings.notes().iter().map(|note| format!("{}: {note}", file.display())));
        let unfit = |error: String| Failure::work(format!("{}: {error}", file.display()));
        let fitted =
            fit(&readings, asked.max_degree as usize).map_err(|failure| unfit(failure.sentence()))?;
        let of_axis = of_axis(&fitted, &readings).map_err(|failure| unfit(failure.sentence()))?;
        _ = writeln!(text, "{axis}: {}", sentence(&fitted));
        json.insert(axis.to_string(), document(&fitted));
        match axis {
            Axis::X => compensation.x = Some(of_axis),
            Axis::Y => compensation.y = Some(of_axis),
        }
    }
    compensation.write(&asked.out)?;
    _ = writeln!(text, "→ {}", asked.out.display());
    for note in &notes {
        _ = writeln!(text, "note: {note}");
    }
    json.insert("notes".into(), json!(notes));
    json.insert("file".into(), json!(asked.out));
    Ok(Answer { text, json: Value::Object(json) })
}

fn of_axis(fitted: &Fit, readings: &Readings) -> Result<AxisCompensation, Failure> {
    let circumstances = Circumstances {
        runs: readings.runs(),
        readings: readings.count(),
        temperature_c: None,
        warm_up_s: None,
    };
    Ok(AxisCompensation::from_fit(fitted, circumstances)?)
}

/// Axis and file of everything that was given; no axis twice.
fn axes_of(given: &[String]) -> Result<Vec<(Axis, PathBuf)>, Failure> {
    let mut axes: Vec<(Axis, PathBuf)> = Vec::new();
    for name in given {
        let (axis, file) = axis_of(name)?;
        if let Some((_, first)) = axes.iter().find(|(known, _)| *known == axis) {
            return Err(Failure::usage(format!(
                "{name}: the {axis} axis has been given already by {}; name each axis once",
                first.display()
            )));
        }
        axes.push((axis, file));
    }
    Ok(axes)
}

/// The axis and the file of `readings-x.csv` or `x=FILE`.
fn axis_of(given: &str) -> Result<(Axis, PathBuf), Failure> {
    for (axis, prefix) in [(Axis::X, "x="), (Axis::Y, "y=")] {
        if let Some(file) = given.strip_prefix(prefix) {
            return Ok((axis, PathBuf::from(file)));
        }
    }
    let stem =
        Path::new(given).file_stem().map(|stem| stem.to_string_lossy().to_lowercase()).unwrap_or_default();
    let axis = match stem.rsplit(['-', '_', '.']).next() {
        Some("x") => Axis::X,
        Some("y") => Axis::Y,
        _ => {
            return Err(Failure::usage(format!(
                "{given}: the axis is not clear; let the name end in -x or -y, or write x={given} or y={given}"
            )));
        }
    };
    Ok((axis, PathBuf::from(given)))
}

/// What the fit found, as paper A states it.
pub(super) fn sentence(fitted: &Fit) -> String {
    let polynomial: Vec<String> = fitted
        .polynomial
        .monomial_um()
        .iter()
        .enumerate()
        .map(|(power, coefficient)| match power {
            0 => format!("{coefficient:+.4}"),
            1 => format!("{coefficient:+.4e} x"),
            _ => format!("{coefficient:+.4e} x^{power}"),
        })
        .collect();
    format!(
        "degree {}, SSE {:.3} µm², R² {:.5}: e = {} (µm, x in mm)",
        fitted.chosen.degree,
        fitted.chosen.sse_um2,
        fitted.chosen.r2,
        polynomial.join(" ")
    )
}

/// The same for programs.
pub(super) fn document(fitted: &Fit) -> Value {
    json!({
        "degree": fitted.chosen.degree,
        "sse_um2": fitted.chosen.sse_um2,
        "r2": fitted.chosen.r2,
        "coefficients_um_mm": fitted.polynomial.monomial_um(),
        "degrees": fitted.degrees,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_comes_from_the_name_or_is_asked_for() {
        assert_eq!(axis_of("a/readings-y.csv").unwrap().0, Axis::Y);
        assert_eq!(axis_of("x=a/b.csv").unwrap(), (Axis::X, PathBuf::from("a/b.csv")));
        assert_eq!(axis_of("matrix.csv").unwrap_err().status(), 2);
    }
}
