//! What `abbe run --check` says of a program.

use super::Answer;
use crate::failure::{Errors, Failure};
use crate::preset::Preset;
use crate::program::check::{Checked, Found, What};
use crate::program::feed::Limited;
use crate::program::summary::Kind;
use abbe_core::Pos;
use abbe_core::command::axis_name;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;

/// A program that was gone through.
pub(super) struct Report<'a> {
    pub(super) name: &'a str,
    pub(super) preset: &'a Preset,
    pub(super) checked: &'a Checked,
}

impl Report<'_> {
    /// The figures of a good program; the errors of another one.
    pub(super) fn answer(&self) -> Result<Answer, Failure> {
        self.errors_only()?;
        Ok(Answer { text: self.text(), json: self.document() })
    }

    /// Nothing to say of a good program.
    pub(super) fn errors_only(&self) -> Result<(), Failure> {
        self.errors().map_or(Ok(()), |errors| Err(Failure::Errors(errors)))
    }

    /// The errors, if there are any.
    pub(super) fn errors(&self) -> Option<Errors> {
        let Self { name, checked, .. } = self;
        if checked.count == 0 {
            return None;
        }
        let each: Vec<String> = checked.errors.iter().map(|found| format!("{name}, {found}")).collect();
        let document = json!({
            "error": self.sentence(),
            "errors": checked.errors.iter().map(error).collect::<Vec<_>>(),
            "count": checked.count,
            "refused_line": checked.refused,
        });
        let each = if each.len() > 1 { each } else { Vec::new() };
        Some(Errors { sentence: self.sentence(), each, document })
    }

    fn sentence(&self) -> String {
        let Self { name, checked, .. } = self;
        let untold = checked.count - checked.errors.len() as u64;
        let untold = if untold > 0 { format!(", {untold} of them not shown") } else { String::new() };
        // What the list does not say: where it ceases to be complete.
        let refused = checked.refused.map_or_else(String::new, |line| {
            format!("; behind line {line} only words were looked at, mend it and check again")
        });
        if let [only] = &checked.errors[..] {
            return format!("{name}, {only}{refused}");
        }
        format!("{name}: the program has {} errors{untold}{refused}", checked.count)
    }

    fn text(&self) -> String {
        let Self { name, preset, .. } = self;
        let mut text = format!("{name}: the program fits the stage {}\n\n", preset.name);
        text.push_str(&self.figures());
        for note in self.notes() {
            _ = writeln!(text, "\nnote: {note}");
        }
        text
    }

    /// A row for each.
    pub(super) fn figures(&self) -> String {
        let summary = &self.checked.summary;
        let mut text = String::new();
        _ = writeln!(text, "  {:<16}{:>12}", "lines", summary.lines);
        let all = summary.all();
        _ = writeln!(text, "  {:<16}{:>12}{:>18.6} mm", "motions", all.count, all.length_mm);
        for kind in Kind::ALL {
            let motions = summary.motions(kind);
            if motions.count > 0 {
                _ = writeln!(
                    text,
                    "    {:<14}{:>12}{:>18.6} mm",
                    kind.name(),
                    motions.count,
                    motions.length_mm
                );
            }
        }
        for (axis, [low, high]) in summary.extents.into_iter().flatten().enumerate() {
            let (low, high) = (low.mm(), high.mm());
            _ = writeln!(text, "  {:<16}{low:>12.6} … {high:.6} mm", axis_name(axis));
        }
        if summary.dwells > 0 {
            let s = summary.dwell_s();
            _ = writeln!(text, "  {:<16}{:>12}{s:>18.3} s", "waits for a time", summary.dwells);
        }
        if summary.pauses > 0 {
            _ = writeln!(text, "  {:<16}{:>12}", "waits for a user", summary.pauses);
        }
        text
    }

    /// What else there is to know.
    pub(super) fn notes(&self) -> Vec<String> {
        let Checked { summary, feeds, .. } = self.checked;
        let mut notes: Vec<String> = feeds.limited.iter().map(ToString::to_string).collect();
        if feeds.others > 0 {
            notes.push(format!("{} motions more have feeds that are limited", feeds.others));
        }
        if summary.extents.is_none() {
            notes.push("nothing moves in this program".into());
        }
        if !summary.ends {
            notes.push("the program does not end with M2 or M30".into());
        }
        notes
    }

    /// All of it for programs.
    pub(super) fn document(&self) -> Value {
        let Self { name, preset, checked } = self;
        let summary = &checked.summary;
        let motions: Map<String, Value> = Kind::ALL
            .into_iter()
            .map(|kind| {
                let motions = summary.motions(kind);
                let figures = json!({ "count": motions.count, "length_mm": motions.length_mm });
                (kind.name().to_owned(), figures)
            })
            .collect();
        let extents = summary.extents.map(|axes| {
            let [x, y] = axes.map(|ends| ends.map(Pos::mm));
            json!({ "x": x, "y": y })
        });
        json!({
            "program": name,
            "preset": preset.name,
            "lines": summary.lines,
            "motions": motions,
            "length_mm": summary.all().length_mm,
            "extents_mm": extents,
            "dwells": { "count": summary.dwells, "time_s": summary.dwell_s() },
            "pauses": summary.pauses,
            "ends": summary.ends,
            "limited_feeds": checked.feeds.limited.iter().map(limited).collect::<Vec<_>>(),
            "notes": self.notes(),
        })
    }
}

fn error(found: &Found) -> Value {
    let mut document = json!({
        "line": found.line,
        "column": found.column,
        "message": found.what.to_string(),
    });
    if let What::OutOfTravel { breach, .. } = &found.what {
        document["axis"] = json!(axis_name(breach.axis));
        document["place_mm"] = json!(breach.point.place.map(Pos::mm));
        document["limit_mm"] = json!(breach.limit().mm());
    }
    document
}

fn limited(feed: &Limited) -> Value {
    json!({
        "line": feed.line,
        "axis": axis_name(feed.axis),
        "feed_mm_s": feed.feed_mm_s,
        "limit_mm_s": feed.limit_mm_s,
        "motions": feed.motions,
    })
}
