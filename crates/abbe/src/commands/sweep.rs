//! `abbe sweep`.

use super::sweep_report::SweptReport;
use super::{Answer, HERE, Wanted};
use crate::cli::Sweep;
use crate::failure::Failure;
use crate::folder;
use crate::interrupt;
use crate::preset::Preset;
use crate::progress;
use crate::rig::Rig;
use crate::sweep::plan::Planned;
use crate::sweep::turns::Turn;
use crate::sweep::watch::Watch;
use abbe_core::command::Compare;
use abbe_core::{Command, Pos};
use abbe_metrology::measure::Arrival;
use indicatif::ProgressBar;
use std::path::Path;

/// Ticks between two looks for a fault and for Ctrl-C.
const LOOK_TICKS: u64 = 1024;

pub(crate) fn run(preset: &Preset, seed: u64, asked: &Sweep) -> Result<Answer, Failure> {
    let planned = Planned::new(preset, asked)?;
    let wanted = Wanted::new(preset, seed, &asked.source)?;
    let events = asked.events.as_deref();
    let _folder = events.map(|file| folder::prepare_file("--events", file, asked.force)).transpose()?;
    let mut rig = wanted.homed(Path::new(HERE))?;
    rig.move_to(planned.plan.start().map(Pos::mm))?;
    let mut watch = Watch::new(&planned, rig.tick_hz(), events)?;
    let arrival = sweep(&mut rig, &planned, &mut watch);
    // A sweep that ended badly is the one that somebody wants to look into, but not one that was called off.
    interrupt::check()?;
    if watch.has_begun() {
        watch.done()?;
    }
    let (arrival, turn) = (arrival?, Turn::of(&planned));
    SweptReport { preset, planned: &planned, turn, watch: &watch, arrival, rig: &rig, events }.answer()
}

/// Sweeps with a stage that stands where it begins, and waits for measured arrival.
fn sweep(rig: &mut Rig, planned: &Planned, watch: &mut Watch<'_>) -> Result<Arrival, Failure> {
    let bar = progress::bar("sweeping", planned.plan.lines() as usize);
    let swept = go_through(rig, planned, watch, &bar);
    bar.finish_and_clear();
    if swept.is_err() {
        come_to_rest(rig);
    }
    swept
}

fn go_through(
    rig: &mut Rig,
    planned: &Planned,
    watch: &mut Watch<'_>,
    bar: &ProgressBar,
) -> Result<Arrival, Failure> {
    rig.ask(Command::Compare(Some(Compare { axis: planned.fast(), places: planned.places })))?;
    rig.ask(Command::Go(planned.segment))?;
    let mut ticks: u64 = 0;
    while rig.controller().state().is_busy() {
        rig.tick();
        watch.see(rig.controller(), &rig.twin.truth())?;
        ticks += 1;
        if ticks.is_multiple_of(LOOK_TICKS) {
            rig.check()?;
            bar.set_position(watch.lines().into());
        }
    }
    rig.check()?;
    rig.ask(Command::Compare(None))?;
    Ok(rig.arrival()?)
}

fn come_to_rest(rig: &mut Rig) {
    _ = rig.ask(Command::Stop);
    while rig.controller().state().is_busy() {
        rig.tick();
    }
    if interrupt::check().is_err() {
        rig.tell_where_it_stopped();
    }
}
