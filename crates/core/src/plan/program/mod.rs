//! A program of segments, planned as it comes: any number of them, looked at ahead as far as they are known, and always so
//! that the stage comes to rest at the end of what is known.
//!
//! | what | is |
//! |---|---|
//! | [`Block`] | a segment that was asked for: its curve, its limits, the corner at its end |
//! | [`Part`] | a part of the motion that was decided: along a block, around a corner, or a rest |
//! | [`Span`] | pieces of a part, for the tick |
//!
//! A part is decided when the one before it is about to end, with the corner speeds that all blocks known by then allow.
//! Until it has been passed it can be decided anew, from any tick on: to stop, or for another feed.

mod block;
mod line;
mod part;
mod passage;
mod speeds;

use super::curve::Place;
use super::pieces::Piece;
use super::profile::Limits;
use super::ring::Ring;
use super::scan::{Scan, ScanPlan};
use super::segment::{Segment, place};
use super::span::{Span, Until};
use super::transfer::{Infeasible, State};
use crate::background::PLANNING_TICKS;
use crate::units::Pos;
use block::Block;
use part::{Laying, Part, What};
use speeds::End;

/// Blocks that are known at once: those ahead, and those whose parts may still be decided anew.
pub const BLOCKS: usize = 96;
/// Parts at once.
const PARTS: usize = 64;
/// Most of a block: two runs, a corner or a rest.
const MOST_PARTS: usize = 3;
/// A part is decided this long before it begins at the latest, ticks, and no part sooner.
const AHEAD: f64 = 2000.0;
/// The first is decided so long before: what comes meanwhile, a segment a tick, is known by then.
const FIRST: f64 = PLANNING_TICKS as f64;
/// Times are told from another tick once they are as large as this, so that they fit.
const FAR: f64 = 16_777_216.0;

/// A program being planned.
#[derive(Clone, Debug)]
pub struct Program {
    axes: [Limits; 2],
    /// Lowest and highest place of each axis, pm.
    travel: [[f64; 2]; 2],
    /// Part of the feed.
    rate: f64,
    /// Tick from which times are told.
    origin: u32,
    /// In the order of the path; the first may have been passed.
    blocks: Ring<Block, BLOCKS>,
    /// Number of the first block that waits for a part.
    next: usize,
    /// Where the path of all blocks ends.
    ends: [Pos; 2],
    /// In the order of time; the first may have been passed.
    parts: Ring<Part, PARTS>,
    /// Number of the part that is being laid out.
    laid: usize,
    laying: Laying,
    /// The scan among the parts: there is one at most.
    scan: Option<ScanPlan>,
    /// When the last part is over, and the state along the next block there.
    time: f64,
    state: State,
    /// No more parts are decided.
    held: bool,
}

impl Program {
    /// One that begins at rest at a place, at a tick or later.
    pub fn new(from: [Pos; 2], axes: [Limits; 2], rate: f64, origin: u32) -> Self {
        Self {
            axes,
            travel: [[f64::NEG_INFINITY, f64::INFINITY]; 2],
            rate,
            origin,
            blocks: Ring::default(),
            next: 0,
            ends: from,
            parts: Ring::default(),
            laid: 0,
            laying: Laying::default(),
            scan: None,
            time: 0.0,
            state: State::default(),
            held: false,
        }
    }

    /// The same within a travel, lowest and highest place of each axis. A segment is not looked at: its own path must be inside. But
    /// curves that are laid over each other where they meet may leave both by the tolerance; near the end of the travel they
    /// are given less of it, and none at the end itself.
    #[must_use]
    pub fn within(self, travel: [[Pos; 2]; 2]) -> Self {
        Self { travel: travel.map(place), ..self }
    }

    /// Whether another segment can be taken.
    pub fn has_room(&self) -> bool {
        self.blocks.room() > 0
    }

    /// Takes a segment.
    ///
    /// # Errors
    /// It is no curve, there is no room, or its feed is not above zero.
    pub fn take(&mut self, segment: &Segment) -> Result<(), Infeasible> {
        if let Some(scan) = segment.scan() {
            return self.take_scan(&scan);
        }
        let curve = segment.curve(self.ends).ok_or(Infeasible::NoNumber)?;
        if curve.length() == 0.0 {
            // Nowhere to go: what is before and behind it meets.
            return Ok(());
        }
        let (feed, tolerance) = (segment.feed.pm(), segment.tolerance.pm() as f64);
        let block = Block::new(curve, feed, tolerance, &self.axes, self.rate).ok_or(Infeasible::NoNumber)?;
        let block = block.within(&self.travel);
        if let Some(before) = self.blocks.last_mut() {
            before.meet(&block, &self.axes);
        }
        if !self.blocks.push(block) {
            return Err(Infeasible::NoNumber);
        }
        self.ends = segment.to;
        Ok(())
    }

    fn take_scan(&mut self, scan: &Scan) -> Result<(), Infeasible> {
        let plan = scan.plan(&self.axes).map_err(|_| Infeasible::NoNumber)?;
        if plan.start() != self.ends || !self.blocks.push(Block::scan(*scan, &plan)) {
            return Err(Infeasible::NoNumber);
        }
        self.ends = plan.end();
        Ok(())
    }

    /// Whether it will be scanning at a tick: that can only be broken off.
    pub fn is_scanning(&self, tick: u32) -> bool {
        let time = self.since(tick);
        self.parts
            .iter()
            .any(|part| matches!(part.what, What::Scan) && (part.begins..part.ends).contains(&time))
    }

    /// Whether all is laid out up to a rest, and nothing is left to be decided.
    pub fn is_done(&self) -> bool {
        self.next == self.blocks.len() && self.laid == self.parts.len() && self.rests()
    }

    /// The part of the feed.
    pub const fn rate(&self) -> f64 {
        self.rate
    }

    /// Whether it rests, or will, until [`Program::go_on`].
    pub fn is_held(&self) -> bool {
        self.held
    }

    /// Goes on after a rest that was asked for.
    pub fn go_on(&mut self) {
        self.held = false;
    }

    /// The next span, if it is time for it; `now` is the last tick.
    ///
    /// # Errors
    /// A part cannot be planned or does not fit a tick's integers.
    pub fn span(&mut self, now: u32) -> Result<Option<Span<2>>, Infeasible> {
        self.forget_what_is_past(now);
        self.keep_times_short(now);
        loop {
            let Some(part) = self.parts.get(self.laid).copied() else {
                if self.waits(now) {
                    return Ok(None);
                }
                self.decide(now)?;
                continue;
            };
            let Some((piece, until)) = self.laying.next(&part, self.scan.as_ref()) else {
                self.laid = self.laid.saturating_add(1);
                self.laying = Laying::default();
                continue;
            };
            if let Some(span) = self.span_of(&piece.ok_or(Infeasible::NoNumber)?, until) {
                return Ok(Some(span));
            }
        }
    }

    /// Whether nothing is to be decided yet.
    fn waits(&self, now: u32) -> bool {
        (self.held && self.rests())
            || self.next == self.blocks.len()
            || self.parts.room() < MOST_PARTS
            || self.time - self.since(now) > if self.parts.is_empty() { FIRST } else { AHEAD }
            || (self.next_is_scan() && self.parts.iter().any(|part| matches!(part.what, What::Scan)))
    }

    fn next_is_scan(&self) -> bool {
        self.blocks.get(self.next).is_some_and(|block| block.scan.is_some())
    }

    /// None if no tick falls into it.
    fn span_of(&self, piece: &Piece, until: Option<f64>) -> Option<Span<2>> {
        let [x, y] = piece;
        let until = match until {
            Some(time) => {
                let last = libm::ceil(time) as u32;
                if x.first >= last {
                    return None;
                }
                Until::Tick(self.origin.wrapping_add(last))
            }
            None => Until::Rest,
        };
        Some(Span { first: self.origin.wrapping_add(x.first), until, legs: [Some(*x), Some(*y)] })
    }

    /// Ticks since the origin.
    fn since(&self, tick: u32) -> f64 {
        f64::from(tick.wrapping_sub(self.origin).cast_signed())
    }

    /// The parts of the next block.
    fn decide(&mut self, now: u32) -> Result<(), Infeasible> {
        if self.rests() {
            // At a tick, behind that of the rest, and not in the past.
            let rested = if self.parts.is_empty() { self.time } else { libm::ceil(self.time) + 1.0 };
            self.time = rested.max(self.since(now) + 2.0);
        }
        if let Some(scan) = self.blocks.get(self.next).and_then(|block| block.scan) {
            return self.decide_scan(&scan);
        }
        let decided = self.next_block(self.next, self.state).ok_or(Infeasible::End)?;
        // What is decided while it is held may be left before it rests.
        if !self.held && self.blocks.get(self.next).is_some_and(|block| decided.is_as_slow_as(block.ahead)) {
            self.promise();
        }
        for run in decided.runs.into_iter().flatten() {
            self.append(What::Run(run), run.ticks());
        }
        let (what, ticks, state) = match decided.end {
            End::Round(corner) => (What::Round(corner), corner.ticks(), corner.behind()),
            End::Overlap(overlap) => (What::Overlap(overlap), overlap.ticks(), overlap.behind()),
            End::Rest(at) => (What::Rest(at), 0.0, State::default()),
            End::Within(gone, at) => (What::Rest(at), 0.0, State { position: gone, ..State::default() }),
        };
        self.append(what, ticks);
        self.state = state;
        let is_whole = !matches!(decided.end, End::Within(..));
        self.next = self.next.saturating_add(usize::from(is_whole));
        Ok(())
    }

    fn decide_scan(&mut self, scan: &Scan) -> Result<(), Infeasible> {
        let plan = scan.plan(&self.axes).map_err(|_| Infeasible::NoNumber)?;
        self.scan = Some(plan);
        self.append(What::Scan, f64::from(plan.ticks()));
        self.append(What::Rest(place(plan.end())), 0.0);
        self.next = self.next.saturating_add(1);
        Ok(())
    }

    fn next_block(&mut self, number: usize, state: State) -> Option<speeds::Decided> {
        if self.held { self.slowly(number, state) } else { self.along(number, state) }
    }

    fn rests(&self) -> bool {
        rests(&self.state)
    }

    fn append(&mut self, what: What, ticks: f64) {
        let part = Part { what, block: self.next, begins: self.time, ends: self.time + ticks };
        // There is room: it is looked for before a block is decided.
        _ = self.parts.push(part);
        self.time = part.ends;
    }

    /// Whether there is room to decide anew; if not, there will be in a few ticks.
    pub fn can_change(&self) -> bool {
        self.parts.room() > MOST_PARTS
    }

    /// Comes to rest as soon as the path allows, from a tick on, until [`Program::go_on`].
    ///
    /// The spans that begin at the returned tick or later are no longer true; with none, all are.
    pub fn rest(&mut self, tick: u32) -> Option<u32> {
        self.held = true;
        self.decide_anew(tick)
    }

    /// Goes at another part of the feed from a tick on, or from where it can. Returns as [`Program::rest`] does.
    pub fn set_rate(&mut self, rate: f64, tick: u32) -> Option<u32> {
        self.rate = rate;
        let mut before: Option<usize> = None;
        for number in 0..self.blocks.len() {
            let Some(mut block) = self.blocks.get(number).copied() else { continue };
            block.limit(&self.axes, rate);
            if let Some(met) = before.and_then(|before| self.blocks.get_mut(before)) {
                met.meet(&block, &self.axes);
            }
            if let Some(place) = self.blocks.get_mut(number) {
                *place = block;
            }
            before = Some(number);
        }
        self.decide_anew(tick)
    }

    /// Forgets what was decided for after a tick, from the first run on that can be left for something else.
    fn decide_anew(&mut self, tick: u32) -> Option<u32> {
        let time = self.since(tick);
        (0..self.parts.len()).find_map(|number| {
            let part = *self.parts.get(number)?;
            let time = libm::ceil(time.max(part.begins));
            if time >= part.ends {
                return None;
            }
            let state = match part.what {
                What::Run(run) => run.motion().at(time - part.begins),
                What::Scan if time <= part.begins => State::default(),
                _ => return None,
            };
            // At its end it is about to rest anyway; where it begins at rest it is left out.
            if rests(&state) {
                if time > part.begins {
                    return None;
                }
            } else {
                let decided = self.next_block(part.block, state)?;
                if self.held && self.is_gone_by_slower(number, part.block, &decided) {
                    return None;
                }
            }
            self.cut(number, time);
            (self.next, self.state) = (part.block, state);
            Some(self.origin.wrapping_add(time as u32))
        })
    }

    /// Whether what was decided of a block behind a part comes to its end no faster than this would: then a rest is not
    /// sooner for it, and what is found out anew in every tick gets worse by what was not thought of.
    fn is_gone_by_slower(&self, number: usize, block: usize, decided: &speeds::Decided) -> bool {
        let End::Round(new) = decided.end else { return false };
        let behind = self.parts.iter().skip(number).filter(|part| part.block == block);
        let ends = behind.filter_map(|part| match part.what {
            What::Run(_) | What::Scan => None,
            What::Round(corner) => Some(corner.speed()),
            What::Overlap(_) | What::Rest(_) => Some(0.0),
        });
        ends.last().is_some_and(|speed| speed <= new.speed())
    }

    /// A part ends at a time, and those behind it are no more.
    fn cut(&mut self, number: usize, time: f64) {
        // Of a part that has not begun nothing is left.
        let begun = self.parts.get(number).is_some_and(|part| part.begins < time);
        let kept = number.saturating_add(usize::from(begun));
        self.parts.truncate(kept);
        if let Some(last) = self.parts.last_mut().filter(|_| begun) {
            last.ends = time;
        }
        if self.laid >= kept {
            self.laid = kept;
            self.laying = Laying::default();
        }
        self.time = time;
    }

    fn forget_what_is_past(&mut self, now: u32) {
        let now = self.since(now);
        while self.laid > 0
            && self.parts.get(1).is_some()
            && self.parts.get(0).is_some_and(|part| part.ends < now)
        {
            _ = self.parts.pop();
            self.laid = self.laid.saturating_sub(1);
            let first = self.parts.get(0).map_or(self.next, |part| part.block);
            self.forget_blocks(first);
        }
    }

    /// Those before a block.
    fn forget_blocks(&mut self, first: usize) {
        for _ in 0..first {
            _ = self.blocks.pop();
        }
        self.next = self.next.saturating_sub(first);
        for number in 0..self.parts.len() {
            if let Some(part) = self.parts.get_mut(number) {
                part.block = part.block.saturating_sub(first);
            }
        }
    }

    /// Between two parts: what is being laid out has times of its own. A rest may last for days.
    fn keep_times_short(&mut self, now: u32) {
        let (now, between) = (self.since(now), self.laid == self.parts.len());
        if now.max(self.time) < FAR || !between {
            return;
        }
        let first = self.parts.get(0).map_or(self.time, |part| part.begins);
        let passed = libm::floor(if self.rests() && now > self.time { now } else { first });
        self.origin = self.origin.wrapping_add(passed as u32);
        self.time -= passed;
        for number in 0..self.parts.len() {
            if let Some(part) = self.parts.get_mut(number) {
                part.begins -= passed;
                part.ends -= passed;
            }
        }
    }
}

fn rests(state: &State) -> bool {
    state.speed == 0.0 && state.acceleration == 0.0
}

/// The end of a curve, to a picometre.
fn whole(at: Place) -> Place {
    place(super::segment::rounded(at))
}
