//! What `abbe run` says of a program that was run.

use super::run_report::Report;
use super::stepwise_report::StepwiseReport;
use super::{Answer, signals};
use crate::failure::{Errors, Failure};
use crate::preset::Preset;
use crate::program::runner::Ran;
use crate::program::watch::Watch;
use crate::rig::Rig;
use abbe_core::command::axis_name;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// A program that was run, or the part of it before an error.
pub(super) struct RanReport<'a> {
    pub(super) name: &'a str,
    pub(super) preset: &'a Preset,
    pub(super) ran: &'a Ran,
    pub(super) watch: &'a Watch,
    pub(super) rig: &'a Rig,
    /// What it was on paper, if it was gone through step by step.
    pub(super) survey: Option<StepwiseReport<'a>>,
}

impl RanReport<'_> {
    /// What was done, or the error before which the stage has come to rest.
    pub(super) fn answer(&self) -> Result<Answer, Failure> {
        match self.report().errors() {
            None => Ok(Answer { text: self.text(), json: self.document() }),
            Some(errors) => Err(Failure::Errors(self.where_it_rests(errors))),
        }
    }

    fn report(&self) -> Report<'_> {
        Report { name: self.name, preset: self.preset, checked: &self.ran.checked }
    }

    fn where_it_rests(&self, errors: Errors) -> Errors {
        let [x, y] = self.rig.position_mm();
        let Errors { sentence, each, mut document } = errors;
        let sentence =
            format!("{sentence}; the stage rests at x {x:.4} mm, y {y:.4} mm, behind the line before");
        document["error"] = json!(sentence);
        document["position_mm"] = json!([x, y]);
        document["segments"] = json!(self.ran.segments);
        Errors { sentence, each, document }
    }

    fn text(&self) -> String {
        let Self { name, preset, ran, .. } = self;
        let mut text = format!("{name}: the program was run on the stage {}\n\n", preset.name);
        text.push_str(&self.report().figures());
        _ = writeln!(text, "  {:<16}{:>12}", "segments", ran.segments);
        _ = writeln!(text, "  {:<16}{:>12.3} s", "on the path", ran.path_s);
        if self.feed_rate() != 100 {
            _ = writeln!(text, "  {:<16}{:>12} %", "feed rate", self.feed_rate());
        }
        for (axis, following) in self.watch.following.iter().enumerate() {
            let (axis, most, rms) = (axis_name(axis), following.most_um, following.rms_um());
            _ = writeln!(text, "  {axis:<16}{most:>12.3} µm following error at most, {rms:.3} µm rms");
        }
        if let Some(survey) = &self.survey {
            text.push_str(&survey.text());
        }
        _ = writeln!(text, "\n{}", self.arrived());
        for note in self.notes() {
            _ = writeln!(text, "\nnote: {note}");
        }
        text.push_str(signals::text(&self.rig.status()).trim_start());
        text
    }

    fn arrived(&self) -> String {
        let Some(arrival) = &self.ran.arrival else { return "the stage has not moved".into() };
        let [x, y] = arrival.position_mm;
        let [error_x, error_y] = self.following_error_um();
        format!(
            "arrived at x {x:.4} mm, y {y:.4} mm ({error_x:+.2} µm, {error_y:+.2} µm from the set-point); \
             {:.0} ms to settle (with the dwell)",
            arrival.settle_s * 1e3
        )
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = self.report().notes();
        match self.ran.unwaited {
            0 => {}
            1 => notes.push("it did not wait for a user, there is no terminal to answer at".into()),
            times => notes.push(format!(
                "it did not wait for a user, {times} times; there is no terminal to answer at"
            )),
        }
        notes
    }

    fn feed_rate(&self) -> u16 {
        self.rig.status().feed_rate
    }

    fn following_error_um(&self) -> [f64; 2] {
        self.rig.status().axes.map(|axis| axis.following_error.um())
    }

    fn document(&self) -> Value {
        let Ran { segments, path_s, arrival, unwaited, .. } = self.ran;
        let [x, y] = self
            .watch
            .following
            .map(|following| json!({ "max_um": following.most_um, "rms_um": following.rms_um() }));
        let mut document = self.report().document();
        document["notes"] = json!(self.notes());
        document["segments"] = json!(segments);
        document["path_s"] = json!(path_s);
        document["feed_rate"] = json!(self.feed_rate());
        document["following"] = json!({ "x": x, "y": y });
        document["position_mm"] = json!(self.rig.position_mm());
        document["following_error_um"] = json!(self.following_error_um());
        document["settle_s"] = json!(arrival.as_ref().map(|arrival| arrival.settle_s));
        document["pauses_without_user"] = json!(unwaited);
        if let Some(survey) = &self.survey {
            document["stepwise"] = survey.document();
        }
        document["signals"] = signals::json(&self.rig.status());
        document
    }
}
