//! What `abbe sweep` says of a sweep.

use super::{Answer, signals};
use crate::failure::{Errors, Failure};
use crate::preset::Preset;
use crate::rig::Rig;
use crate::sweep::ledger::Faulty;
use crate::sweep::plan::Planned;
use crate::sweep::tally::{Figures, Tally};
use crate::sweep::turns::Turn;
use crate::sweep::watch::{Watch, direction};
use abbe_core::Pos;
use abbe_core::command::axis_name;
use abbe_core::units::PM_PER_MM;
use abbe_metrology::measure::Arrival;
use serde_json::{Value, json};
use std::fmt::{self, Write as _};
use std::path::Path;

/// Faulty lines that are told one by one.
const TOLD: usize = 20;

/// A sweep whose end the stage has come to.
pub(super) struct SweptReport<'a> {
    pub(super) preset: &'a Preset,
    pub(super) planned: &'a Planned,
    pub(super) turn: Option<Turn>,
    pub(super) watch: &'a Watch<'a>,
    pub(super) arrival: Arrival,
    pub(super) rig: &'a Rig,
    pub(super) events: Option<&'a Path>,
}

impl SweptReport<'_> {
    /// What was done, if each line has passed each place once.
    pub(super) fn answer(&self) -> Result<Answer, Failure> {
        match self.watch.ledger.faulty() {
            [] => Ok(Answer { text: self.text(), json: self.document() }),
            faulty => Err(Failure::Errors(self.errors(faulty))),
        }
    }

    fn errors(&self, faulty: &[Faulty]) -> Errors {
        let told: Vec<String> = faulty.iter().take(TOLD).map(|line| Told(line).to_string()).collect();
        let advice = "try another --speed, farther from the resonance of the motors, more --settle before each line, or more \
                      --play, the way that it may go back";
        let (sentence, each) = match &told[..] {
            [only] => (format!("{only}; {advice}"), Vec::new()),
            _ => (format!("{}; {advice}", self.how_many(faulty.len())), told),
        };
        let mut document = self.document();
        document["error"] = json!(sentence);
        Errors { sentence, each, document }
    }

    fn how_many(&self, faulty: usize) -> String {
        let untold = faulty.saturating_sub(TOLD);
        let untold = if untold > 0 { format!(" ({untold} of them not shown)") } else { String::new() };
        let lines = self.planned.plan.lines();
        format!("{faulty} of {lines} lines missed places or passed them again{untold}")
    }

    fn text(&self) -> String {
        let Self { planned, watch, .. } = self;
        let fast = axis_name(planned.fast());
        let mut text = format!("a sweep along {fast} on the stage {}\n\n", self.preset.name);
        for (name, figure) in self.figures() {
            _ = writeln!(text, "  {name:<16}{figure}");
        }
        for (axis, following) in watch.following.iter().enumerate() {
            if let Some(Figures { rms, most, .. }) = following.figures() {
                let axis = axis_name(axis);
                _ = writeln!(
                    text,
                    "  {axis:<16}{rms:.3} µm rms following error inside the area, {most:.3} at most"
                );
            }
        }
        _ = writeln!(text, "\nthe table truly was from the places, along {fast}, µm:\n");
        _ = writeln!(text, "  {:<16}{:>10}{:>10}{:>10}{:>10}", "", "mean", "scatter", "rms", "at most");
        for up in [true, false] {
            if let Some(Figures { mean, rms, scatter, most }) = self.beside_truth(up).figures() {
                let name = direction(up);
                _ = writeln!(text, "  {name:<16}{mean:>+10.3}{scatter:>10.3}{rms:>10.3}{most:>10.3}");
            }
        }
        let [x, y] = self.rig.position_mm();
        _ = writeln!(text, "\neach line has passed each place once; arrived at x {x:.4} mm, y {y:.4} mm");
        if let Some(file) = self.events {
            _ = writeln!(text, "{} events → {}", watch.fired, file.display());
        }
        text.push_str(signals::text(&self.rig.status()).trim_start());
        text
    }

    /// A row for each: its name, and what there is to say.
    fn figures(&self) -> Vec<(&'static str, String)> {
        let Self { planned, watch, .. } = self;
        let (places, plan) = (planned.places, planned.plan);
        let [below, above] = plan.room().map(Pos::mm);
        let mut rows = vec![
            ("lines", format!("{} at {} mm/s", plan.lines(), self.speed_mm_s())),
            ("places", format!("{} a line, {} µm apart", places.number, Pos::from_pm(places.pitch).um())),
            ("time", format!("{:.3} s, and {:.0} ms to settle", self.time_s(), self.arrival.settle_s * 1e3)),
        ];
        if let Some(Turn { ticks, stop_and_go }) = self.turn {
            let [turn, stop_and_go] = [ticks, stop_and_go].map(|ticks| self.ms(ticks));
            rows.push(("a turn", format!("{turn:.1} ms; {stop_and_go:.1} if it stopped on the way")));
        }
        rows.push(("room", format!("{below:.4} mm below the area, {above:.4} mm above")));
        rows.push(("events", format!("{} fired, {} lost", watch.fired, watch.lost)));
        if let Some(Figures { rms, most, .. }) = watch.pace.figures() {
            let [rms, most, count] = [rms, most, self.count()].map(|part| part * 100.0);
            let window = self.ms(watch.pace.ticks() as f64);
            rows.push((
                "speed off",
                format!("{rms:.3} % rms, {most:.3} % at most, over {window} ms (a count is {count:.3} %)"),
            ));
        }
        rows
    }

    fn document(&self) -> Value {
        let Self { planned, watch, turn, .. } = self;
        let (plan, places) = (planned.plan, planned.places);
        let [low, high] = planned.scan.corners.map(|corner| corner.map(Pos::mm));
        let [x, y] = watch.following.map(|following| {
            figures(&following, |found| json!({ "rms_um": found.rms, "max_um": found.most }))
        });
        let pace = watch.pace.figures().map(|found| {
            json!({
                "rms_percent": found.rms * 100.0,
                "max_percent": found.most * 100.0,
                "count_percent": self.count() * 100.0,
                "window_ms": self.ms(watch.pace.ticks() as f64),
            })
        });
        let beside = |up| {
            figures(self.beside_truth(up), |found| {
                json!({
                    "mean_um": found.mean,
                    "scatter_um": found.scatter,
                    "rms_um": found.rms,
                    "max_um": found.most,
                })
            })
        };
        json!({
            "preset": self.preset.name,
            "area_mm": { "x": [low[0], high[0]], "y": [low[1], high[1]] },
            "along": axis_name(planned.fast()),
            "lines": plan.lines(),
            "speed_mm_s": self.speed_mm_s(),
            "settle_ms": self.ms(planned.scan.settle.into()),
            "places": places.number,
            "every_um": Pos::from_pm(places.pitch).um(),
            "play_um": Pos::from_pm(places.play).um(),
            "time_s": self.time_s(),
            "settled_s": self.arrival.settle_s,
            "turn_ms": turn.map(|turn| self.ms(turn.ticks)),
            "stop_and_go_ms": turn.map(|turn| self.ms(turn.stop_and_go)),
            "room_mm": plan.room().map(Pos::mm),
            "events": { "fired": watch.fired, "lost": watch.lost, "file": self.events },
            "speed": pace,
            "following": { "x": x, "y": y },
            "truth": { "up": beside(true), "down": beside(false) },
            "faulty_lines": watch.ledger.faulty().iter().take(TOLD).map(faulty).collect::<Vec<_>>(),
            "faulty": watch.ledger.faulty().len(),
            "position_mm": self.rig.position_mm(),
            "signals": signals::json(&self.rig.status()),
        })
    }

    fn beside_truth(&self, up: bool) -> &Tally {
        &self.watch.beside_truth[usize::from(up)]
    }

    fn ms(&self, ticks: f64) -> f64 {
        ticks / self.rig.tick_hz() * 1e3
    }

    fn time_s(&self) -> f64 {
        f64::from(self.planned.plan.ticks()) / self.rig.tick_hz()
    }

    fn speed_mm_s(&self) -> f64 {
        self.planned.scan.speed * self.rig.tick_hz() / PM_PER_MM
    }

    /// What a count is of the way over which the speed is measured.
    fn count(&self) -> f64 {
        let count_um = self.preset.controller.settings.axes[self.planned.fast()].count_um;
        Pos::from_um(count_um).pm() as f64 / self.watch.pace.way()
    }
}

fn figures(tally: &Tally, told: impl Fn(Figures) -> Value) -> Value {
    tally.figures().map_or(Value::Null, told)
}

fn faulty(faulty: &Faulty) -> Value {
    json!({ "line": faulty.line, "missed": faulty.missed, "again": faulty.again })
}

/// A faulty line as a sentence.
struct Told<'a>(&'a Faulty);

impl fmt::Display for Told<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Faulty { line, missed, again } = *self.0;
        write!(f, "line {line} (from 0)")?;
        match (missed, again) {
            (missed, 0) => write!(f, " missed {missed} places"),
            (0, again) => write!(f, " passed {again} places again"),
            (missed, again) => write!(f, " missed {missed} places and passed {again} again"),
        }
    }
}
