//! Position compare: an event whenever the measured position passes the next of evenly spaced places.
//!
//! A camera line or a laser pulse belongs to a place, not to a time: it is the *measured* position that fires, never the
//! set-point. [`Counted`] is fed every count of the decoder and fires with it, as hardware does; [`Sampled`] is fed one
//! position a tick, which may be finer than a count, and tells afterwards when between two ticks each place was passed.
//!
//! # Which place, and when
//!
//! Place k is `first` + k · `pitch`. It is passed upwards when the position comes to it or beyond, and downwards when the
//! position is below it again: of a counter that is the same edge. Places that are jumped over fire all, in the order of the
//! way. A call keeps [`MOST`] events; how many more places were passed it tells as [`Fired::lost`].
//!
//! # Once a passage
//!
//! A stage trembles and a reading is noisy. A place fires upwards only if the position was more than `play` below it since
//! it last did, and downwards only if it was at least `play` above it since. So a way that never goes back by more than `play`
//! is one way, and fires each place once, where it is first come to; and with [`When::Both`] the places that lie less than
//! `play` before a turn are not passed again on the way back. When it is armed, a place is below the position or is not.
//!
//! It is done by two followers with a dead play, as a loose nut follows a screw: one is pushed up by the position itself and
//! down by what lies `play` above it, the other is its image. The first fires on its way up, the second on its way down.
//!
//! # How exact
//!
//! - [`Counted`]: at the clock at which the count passes, which is the filter's clocks after the edge at the pin.
//! - [`Sampled`]: as if the speed were constant within a tick. At an acceleration a the place where it fires is off by at most
//!   a/8 of a tick's square, at constant speed by nothing but what the two positions are off: 0.6 nm at 500 mm/s² and 10 kHz.

use super::QuadratureCounter;
use crate::units::Pos;
use core::fmt;

/// So many events a call can keep: at 10 kHz 80 000 a second.
pub const MOST: usize = 8;

/// In which direction places fire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum When {
    /// When passed upwards.
    Up,
    /// When passed downwards.
    Down,
    /// When passed.
    Both,
}

/// Evenly spaced places: counts, or picometres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Places {
    /// The lowest.
    pub first: i64,
    /// From each to the next, above zero.
    pub pitch: i64,
    /// How many.
    pub number: u32,
    /// In which direction they fire.
    pub when: When,
    /// How far the position may go back without passing a place again: more than it trembles. 0: each crossing fires.
    pub play: i64,
}

/// What cannot be compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PlacesError {
    /// There is none.
    NoPlace,
    /// The pitch is not above zero.
    Pitch(i64),
    /// The play is below zero.
    Play(i64),
    /// The last place, or how far it is from the first, does not fit 64 bits.
    TooFar,
}

impl fmt::Display for PlacesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPlace => f.write_str("position compare has no place to fire at; give one at least"),
            Self::Pitch(pitch) => {
                write!(
                    f,
                    "the pitch of position compare is {pitch}; it must be above zero, in either direction"
                )
            }
            Self::Play(play) => write!(f, "the play of position compare is {play}; it cannot be below zero"),
            Self::TooFar => f.write_str(
                "the last place of position compare does not fit 64 bits; give fewer, or a smaller pitch",
            ),
        }
    }
}

impl core::error::Error for PlacesError {}

/// A place was passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Event {
    /// Its number, from 0, the lowest.
    pub place: u32,
    /// On the way up.
    pub up: bool,
    /// When: of [`Counted`] the clock, of [`Sampled`] ticks with 32 fractional bits. It wraps with them.
    pub time: u64,
}

/// What one call has fired, in the order of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use = "events are told once"]
pub struct Fired {
    events: [Event; MOST],
    number: usize,
    /// Places passed after these, for which there was no room. They count as passed.
    pub lost: u32,
}

impl Fired {
    /// The events.
    pub fn as_slice(&self) -> &[Event] {
        self.events.get(..self.number).unwrap_or_default()
    }

    fn of(passed: Passed, time: impl Fn(u64) -> u64) -> Self {
        let passages = passed.number();
        let mut fired = Self { lost: passages.saturating_sub(MOST as u32), ..Self::default() };
        for (event, nth) in fired.events.iter_mut().zip(0..passages) {
            *event = Event { place: passed.place(nth), up: passed.is_up(), time: time(u64::from(nth)) };
            fired.number = fired.number.saturating_add(1);
        }
        fired
    }
}

/// Compares each count of a decoder.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Counted {
    passes: Passes,
    counter: u32,
    at: i64,
}

impl Counted {
    /// Armed while the counter reads `counter`, which is `at` among the places: the counter wraps, they do not.
    ///
    /// # Errors
    /// What [`PlacesError`] says.
    pub fn new(places: Places, counter: u32, at: i64) -> Result<Self, PlacesError> {
        Ok(Self { passes: Passes::new(places, at)?, counter, at })
    }

    /// The counter has changed at a clock. Places that several counts at once jump over have the same time.
    #[inline]
    pub fn count(&mut self, clock: u64, counter: u32) -> Fired {
        let moved = counter.wrapping_sub(self.counter).cast_signed();
        (self.counter, self.at) = (counter, self.at.saturating_add(i64::from(moved)));
        Fired::of(self.passes.to(self.at), |_| clock)
    }

    /// Lets pass what a decoder has due by `clock`, count by count. To be called before each of its edges and readings.
    pub fn follow(&mut self, decoder: &mut QuadratureCounter, clock: u64, mut take: impl FnMut(&Fired)) {
        while let Some(due) = decoder.due().filter(|due| *due <= clock) {
            decoder.advance(due);
            let fired = self.count(due, decoder.counter());
            if fired.number > 0 {
                take(&fired);
            }
        }
    }
}

/// Compares one position a tick, and tells when between two ticks places were passed.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sampled {
    passes: Passes,
    tick: u32,
    at: i64,
}

impl Sampled {
    /// Armed at a tick, with the position measured there. Places are picometres.
    ///
    /// # Errors
    /// What [`PlacesError`] says.
    pub fn new(places: Places, tick: u32, position: Pos) -> Result<Self, PlacesError> {
        Ok(Self { passes: Passes::new(places, position.pm())?, tick, at: position.pm() })
    }

    /// The position measured at a later tick, and what was passed until then. Ticks without one are gone over at constant speed.
    pub fn sample(&mut self, tick: u32, position: Pos) -> Fired {
        self.pass(tick, position).fired()
    }

    /// The same, without the times: for a tick.
    pub fn pass(&mut self, tick: u32, position: Pos) -> Passage {
        let (from, to) = (self.at, position.pm());
        let began = core::mem::replace(&mut self.tick, tick);
        self.at = to;
        let Places { first, pitch, .. } = self.passes.places;
        Passage { passed: self.passes.to(to), first, pitch, from, to, began, tick }
    }
}

/// What was passed between two ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Passage {
    passed: Passed,
    first: i64,
    pitch: i64,
    from: i64,
    to: i64,
    began: u32,
    tick: u32,
}

impl Passage {
    /// Whether a place was.
    pub fn is_some(&self) -> bool {
        self.passed.number() > 0
    }

    /// The events with their times. Not for a tick: divides.
    pub fn fired(&self) -> Fired {
        let Self { passed, first, pitch, from, to, began, tick } = *self;
        if passed.number() == 0 {
            return Fired::default();
        }
        let (whole, ticks) = (to.abs_diff(from), tick.wrapping_sub(began));
        let nearest = first.wrapping_add(pitch.wrapping_mul(i64::from(passed.place(0))));
        let to_first = part(nearest.abs_diff(from), whole);
        // One division for all the others.
        let between = if passed.number() > 1 { part(pitch.unsigned_abs(), whole) } else { 0 };
        Fired::of(passed, |nth| {
            let part = to_first.wrapping_add(nth.wrapping_mul(between)).min(1 << 32);
            (u64::from(began) << 32).wrapping_add(part.wrapping_mul(u64::from(ticks)))
        })
    }
}

/// A part of a whole, which is not zero, with 32 fractional bits, rounded down; of a whole beyond 32 bits its upper ones count.
fn part(part: u64, whole: u64) -> u64 {
    let shift = 32_u32.saturating_sub(whole.leading_zeros());
    ((part >> shift) << 32).checked_div(whole >> shift).unwrap_or(0)
}

/// Which places a position passes.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Passes {
    places: Places,
    up: Follower,
    down: Follower,
}

impl Passes {
    fn new(places: Places, at: i64) -> Result<Self, PlacesError> {
        places.check()?;
        let follower = Follower { at, level: places.far_level(at) };
        Ok(Self { places, up: follower, down: follower })
    }

    /// The position is somewhere else. It has passed places in one direction at most.
    #[inline]
    fn to(&mut self, at: i64) -> Passed {
        let Places { when, play, .. } = self.places;
        let up = self.up.follow(&self.places, at, at.saturating_add(play));
        let down = self.down.follow(&self.places, at.saturating_sub(play), at);
        if up.is_up() && when != When::Down {
            up
        } else if !down.is_up() && when != When::Up {
            down
        } else {
            Passed::default()
        }
    }
}

/// What is pushed by the position from below and from above, and how many places it is at or above.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Follower {
    at: i64,
    level: u32,
}

impl Follower {
    #[inline]
    fn follow(&mut self, places: &Places, low: i64, high: i64) -> Passed {
        let from = self.level;
        let at = self.at.max(low).min(high);
        if at != self.at {
            *self = Self { at, level: places.level(at, from) };
        }
        Passed { from, to: self.level }
    }
}

/// From one level to another: the places between.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Passed {
    from: u32,
    to: u32,
}

impl Passed {
    fn is_up(self) -> bool {
        self.to > self.from
    }

    fn number(self) -> u32 {
        self.to.abs_diff(self.from)
    }

    /// The nth on the way.
    fn place(self, nth: u32) -> u32 {
        if self.is_up() { self.from.wrapping_add(nth) } else { self.from.wrapping_sub(1).wrapping_sub(nth) }
    }
}

impl Places {
    fn check(&self) -> Result<(), PlacesError> {
        let Some(last) = self.number.checked_sub(1) else { return Err(PlacesError::NoPlace) };
        if self.pitch <= 0 {
            return Err(PlacesError::Pitch(self.pitch));
        }
        if self.play < 0 {
            return Err(PlacesError::Play(self.play));
        }
        let way = self.pitch.checked_mul(i64::from(last));
        way.and_then(|way| self.first.checked_add(way)).map(|_| ()).ok_or(PlacesError::TooFar)
    }

    /// Of a number that there is: then nothing wraps.
    #[inline]
    fn at(&self, place: u32) -> i64 {
        self.first.wrapping_add(self.pitch.wrapping_mul(i64::from(place)))
    }

    /// How many places are at a position or below it, looked for from a level on: a tick passes few.
    #[inline]
    fn level(&self, at: i64, from: u32) -> u32 {
        let mut level = from;
        for _ in 0..MOST {
            let below = level.wrapping_sub(1);
            if level < self.number && at >= self.at(level) {
                level = level.saturating_add(1);
            } else if level > 0 && at < self.at(below) {
                level = below;
            } else {
                return level;
            }
        }
        self.far_level(at)
    }

    /// Halves the range: a tick has no time for a division.
    #[cold]
    fn far_level(&self, at: i64) -> u32 {
        let (mut low, mut high) = (0, self.number);
        while low < high {
            let middle = low.wrapping_add(high.wrapping_sub(low) >> 1);
            if at >= self.at(middle) {
                low = middle.wrapping_add(1);
            } else {
                high = middle;
            }
        }
        low
    }
}
