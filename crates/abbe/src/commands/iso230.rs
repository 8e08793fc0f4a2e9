//! `abbe iso230 READINGS.csv`.

use super::Answer;
use crate::cli::Iso230;
use crate::failure::Failure;
use abbe_metrology::iso230::{Iso230 as Evaluation, evaluate};
use abbe_metrology::readings::Readings;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;

pub(crate) fn run(asked: &Iso230) -> Result<Answer, Failure> {
    let readings = Readings::read(&asked.readings)?;
    let notes: Vec<String> = readings.notes().iter().map(ToString::to_string).collect();
    let evaluation = evaluate(&readings);
    let mut document: Map<String, Value> =
        evaluation.figures.named().iter().map(|(name, value)| ((*name).to_owned(), json!(value))).collect();
    document.insert("runs".into(), json!(readings.runs()));
    document.insert("points".into(), json!(evaluation.points));
    document.insert("drift".into(), json!(evaluation.drift));
    document.insert("notes".into(), json!(notes));
    Ok(Answer { text: text(&evaluation, readings.runs(), &notes), json: Value::Object(document) })
}

/// The figures and the table behind them.
fn text(evaluation: &Evaluation, runs: usize, notes: &[String]) -> String {
    let mut text =
        format!("ISO 230-2:2014, {} targets, {runs} runs each way; µm\n\n", evaluation.points.len());
    for (name, value) in evaluation.figures.named() {
        _ = writeln!(text, "  {name:<8}{value:>12.4}");
    }
    _ = writeln!(
        text,
        "\n  {:>12}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}",
        "target mm", "mean up", "mean down", "B", "s up", "s down", "R"
    );
    for point in &evaluation.points {
        _ = writeln!(
            text,
            "  {:>12.4}{:>10.4}{:>10.4}{:>10.4}{:>10.4}{:>10.4}{:>10.4}",
            point.target_mm,
            point.mean_up_um,
            point.mean_down_um,
            point.b_um,
            point.s_up_um,
            point.s_down_um,
            point.r_um
        );
    }
    for note in notes {
        _ = writeln!(text, "\nnote: {note}");
    }
    text
}
