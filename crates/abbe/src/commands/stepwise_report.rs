//! What `abbe run --stepwise` says of the steps of a program.

use super::Answer;
use super::run_report::Report;
use crate::failure::Failure;
use crate::preset::Preset;
use crate::program::stepwise::survey::{Divided, Stepped, Survey};
use abbe_core::Pos;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// A program in steps.
pub(super) struct StepwiseReport<'a> {
    pub(super) survey: &'a Survey,
}

impl StepwiseReport<'_> {
    /// All of it, where no stage was.
    pub(super) fn on_paper(&self, name: &str, preset: &Preset) -> Result<Answer, Failure> {
        let report = Report { name, preset, checked: &self.survey.checked };
        report.errors_only()?;
        let mut text =
            format!("{name}: the program step by step, on paper, for the stage {}\n\n", preset.name);
        text.push_str(&report.figures());
        text.push_str(&self.text());
        let mut notes = report.notes();
        notes.extend(self.note());
        for note in &notes {
            _ = writeln!(text, "\nnote: {note}");
        }
        let mut document = report.document();
        document["notes"] = json!(notes);
        document["stepwise"] = self.document();
        Ok(Answer { text, json: document })
    }

    /// Of motions that a stage could not go.
    fn note(&self) -> Option<String> {
        let (line, fault) = self.survey.first_fast?;
        let others = match self.survey.fast {
            1 => String::new(),
            2 => "; so is 1 motion more".into(),
            motions => format!("; so are {} motions more", motions - 1),
        };
        Some(format!("line {line}: {fault}{others}; with --twin this is an error"))
    }

    fn nm(&self, steps: f64) -> f64 {
        steps * self.survey.grid.step().pm() as f64 / 1e3
    }

    /// A row for each motion, and the sums.
    pub(super) fn text(&self) -> String {
        let survey = self.survey;
        let grid = survey.grid;
        let mut text = String::new();
        _ = writeln!(text, "\n  in steps of {} µm", grid.step().um());
        let [head, feed, beside] = ["steps", "mm/s", "steps"];
        _ = writeln!(
            text,
            "  {:>7} {:<6}{:>12}{:>12}{:>13}{:>12}{:>12}{:>11}{:>13}",
            "line", "kind", "x", "y", head, "beside", "at most", "chords", feed
        );
        for stepped in &survey.told {
            _ = writeln!(text, "{}", row(stepped));
        }
        if survey.others > 0 {
            _ = writeln!(text, "  {:>7} {} motions more", "…", survey.others);
        }
        let [x, y] = survey.steps;
        let all = x + y;
        _ = writeln!(
            text,
            "  {:>7} {:<6}{x:>12}{y:>12}{all:>13}{:>12.4}{:>12.4}",
            "all", "", survey.beside, survey.bound
        );
        _ = writeln!(
            text,
            "\n  {:.4} {beside} ({:.1} nm) beside the true path at most, of the {:.4} ({:.1} nm) that may be; ends {}",
            survey.beside,
            self.nm(survey.beside),
            survey.bound,
            self.nm(survey.bound),
            if survey.is_exact { "exact" } else { "NOT exact" }
        );
        if survey.chords > 0 {
            _ = writeln!(
                text,
                "  {} chords, each within {} µm of its sine",
                survey.chords,
                (self.nm(grid.tolerance()) * 10.0).round() / 1e4
            );
        }
        _ = writeln!(text, "  {:.3} s at the feeds, with rapids and waits", survey.time_s);
        text
    }

    /// All of it for programs.
    pub(super) fn document(&self) -> Value {
        let survey = self.survey;
        let [x, y] = survey.steps;
        json!({
            "step_um": survey.grid.step().um(),
            "chord_tolerance_um": self.nm(survey.grid.tolerance()) / 1e3,
            "steps": { "x": x, "y": y, "total": x + y },
            "beside": self.beside(survey.beside, survey.bound),
            "ends_exact": survey.is_exact,
            "chords": survey.chords,
            "time_s": survey.time_s,
            "too_fast_motions": survey.fast,
            "motions": survey.told.iter().map(|stepped| self.motion(stepped)).collect::<Vec<_>>(),
            "motions_not_told": survey.others,
        })
    }

    fn beside(&self, beside: f64, bound: f64) -> Value {
        json!({ "steps": beside, "nm": self.nm(beside), "bound_steps": bound, "bound_nm": self.nm(bound) })
    }

    fn motion(&self, stepped: &Stepped) -> Value {
        let [x, y] = stepped.steps;
        json!({
            "line": stepped.line,
            "kind": stepped.kind.name(),
            "steps": { "x": x, "y": y, "total": x + y },
            "beside": self.beside(stepped.beside, stepped.bound),
            "end_mm": stepped.end.map(Pos::mm),
            "end_exact": stepped.is_exact,
            "chords": stepped.chords.map(|chords| self.chords(&chords)),
            "length_mm": stepped.length_mm,
            "feed_mm_s": stepped.feed_mm_s,
            "start_stop_mm_s": stepped.start_stop_mm_s,
            "time_s": stepped.time_s,
        })
    }

    fn chords(&self, chords: &Divided) -> Value {
        json!({
            "count": chords.count,
            "per_period": chords.per_period,
            "farthest_um": self.nm(chords.farthest) / 1e3,
        })
    }
}

fn row(stepped: &Stepped) -> String {
    let Stepped { line, steps: [x, y], beside, bound, feed_mm_s, .. } = stepped;
    let kind = stepped.kind.name();
    let chords = stepped.chords.map_or_else(String::new, |chords| chords.count.to_string());
    let all = x + y;
    format!(
        "  {line:>7} {kind:<6}{x:>12}{y:>12}{all:>13}{beside:>12.4}{bound:>12.4}{chords:>11}{feed_mm_s:>13.6}"
    )
}
