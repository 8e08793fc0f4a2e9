//! Programs: segments that were asked for, and spans that were handed over.

use super::bytes::{Reader, Writer};
use super::error::RecordFault;
use abbe_core::Pos;
use abbe_core::command::Compare;
use abbe_core::front::compare::{Places, When};
use abbe_core::plan::compare::Axis;
use abbe_core::plan::scan::{Lines, Order};
use abbe_core::plan::segment::{Feed, Segment, Shape};
use abbe_core::plan::span::{Batch, Span, Until};
use abbe_core::plan::steps::Leg;

/// Whether something is there.
const ARMED: u8 = 1;

/// Shapes of a segment.
const LINE: u8 = 0;
const ARC: u8 = 1;
const SINE: u8 = 2;
const SCAN: u8 = 3;
/// Added to an arc's.
const COUNTERCLOCKWISE: u8 = 4;
/// Added to a scan's.
const ALONG_Y: u8 = 4;
const FLY_BACK: u8 = 8;
const BY_PITCH: u8 = 16;

/// Bits of a batch.
const CUT: u8 = 1;
const DONE: u8 = 1 << 1;

/// Bit of a span that holds up to a tick; the lowest say which axes have legs.
const ENDS: u8 = 1 << 7;

impl Writer<'_> {
    pub(super) fn segment(&mut self, segment: &Segment) {
        let Segment { shape, to, feed, tolerance } = segment;
        match shape {
            Shape::Line => self.byte(LINE),
            Shape::Arc { centre, counterclockwise } => {
                self.byte(if *counterclockwise { ARC | COUNTERCLOCKWISE } else { ARC });
                self.plane(centre);
            }
            Shape::Sine { amplitude, periods, phase } => {
                self.byte(SINE);
                self.signed(amplitude.pm());
                self.number32(*periods);
                self.signed(*phase);
            }
            Shape::Scan { corners, fast, lines, order, settle } => {
                let fast = if *fast == Axis::Y { ALONG_Y } else { 0 };
                let order = if *order == Order::FlyBack { FLY_BACK } else { 0 };
                let by = if matches!(lines, Lines::Pitch(_)) { BY_PITCH } else { 0 };
                self.byte(SCAN | fast | order | by);
                for corner in corners {
                    self.plane(corner);
                }
                match lines {
                    Lines::Number(number) => self.number32(*number),
                    Lines::Pitch(pitch) => self.signed(pitch.pm()),
                }
                self.number32(*settle);
            }
        }
        self.plane(to);
        self.number(feed.0);
        self.signed(tolerance.pm());
    }

    pub(super) fn compare(&mut self, compare: Option<&Compare>) {
        let Some(Compare { axis, places }) = compare else { return self.byte(0) };
        let Places { first, pitch, number, when, play } = *places;
        self.byte(ARMED);
        self.number(*axis as u64);
        for number in [first, pitch, play] {
            self.signed(number);
        }
        self.number32(number);
        self.byte(when as u8);
    }

    fn plane(&mut self, places: &[Pos; 2]) {
        for place in places {
            self.signed(place.pm());
        }
    }

    pub(super) fn batch<const N: usize>(&mut self, batch: &Batch<N>) {
        let Batch { number, revision, cut, took, done, spans } = batch;
        self.byte(if cut.is_some() { CUT } else { 0 } | if *done { DONE } else { 0 });
        self.number32(*number);
        self.number32(*revision);
        if let Some(cut) = cut {
            self.number32(*cut);
        }
        self.byte(*took);
        self.byte(spans.len() as u8);
        let mut last = cut.unwrap_or(0);
        for span in spans.iter() {
            self.span(span, last);
            last = span.first;
        }
    }

    /// Told apart from the tick of the one before.
    fn span<const N: usize>(&mut self, span: &Span<N>, last: u32) {
        let mut mask = if span.until == Until::Rest { 0 } else { ENDS };
        for (axis, _) in span.legs.iter().enumerate().filter(|(_, leg)| leg.is_some()) {
            mask |= 1_u8.checked_shl(axis as u32).unwrap_or(0);
        }
        self.byte(mask);
        self.signed32(span.first.wrapping_sub(last).cast_signed());
        if let Until::Tick(until) = span.until {
            self.signed32(until.wrapping_sub(span.first).cast_signed());
        }
        for leg in span.legs.iter().flatten() {
            self.number32(leg.first);
            for difference in leg.differences {
                self.signed(difference);
            }
        }
    }
}

impl Reader<'_> {
    pub(super) fn segment(&mut self) -> Result<Segment, RecordFault> {
        let shape = match self.byte()? {
            LINE => Shape::Line,
            kind if kind & !COUNTERCLOCKWISE == ARC => {
                Shape::Arc { centre: self.plane()?, counterclockwise: kind & COUNTERCLOCKWISE != 0 }
            }
            SINE => Shape::Sine {
                amplitude: Pos::from_pm(self.signed()?),
                periods: self.number32()?,
                phase: self.signed()?,
            },
            kind if kind & 3 == SCAN && kind < 32 => {
                let corners = [self.plane()?, self.plane()?];
                let lines = if kind & BY_PITCH == 0 {
                    Lines::Number(self.number32()?)
                } else {
                    Lines::Pitch(Pos::from_pm(self.signed()?))
                };
                let fast = if kind & ALONG_Y == 0 { Axis::X } else { Axis::Y };
                let order = if kind & FLY_BACK == 0 { Order::Serpentine } else { Order::FlyBack };
                Shape::Scan { corners, fast, lines, order, settle: self.number32()? }
            }
            unknown => return Err(RecordFault::Entry(unknown)),
        };
        let to = self.plane()?;
        Ok(Segment { shape, to, feed: Feed(self.number()?), tolerance: Pos::from_pm(self.signed()?) })
    }

    pub(super) fn compare(&mut self) -> Result<Option<Compare>, RecordFault> {
        if self.byte()? != ARMED {
            return Ok(None);
        }
        let axis = usize::try_from(self.number()?).map_err(|_| RecordFault::Number)?;
        let (first, pitch, play) = (self.signed()?, self.signed()?, self.signed()?);
        let number = self.number32()?;
        let when = match self.byte()? {
            0 => When::Up,
            1 => When::Down,
            2 => When::Both,
            unknown => return Err(RecordFault::Entry(unknown)),
        };
        Ok(Some(Compare { axis, places: Places { first, pitch, number, when, play } }))
    }

    fn plane(&mut self) -> Result<[Pos; 2], RecordFault> {
        Ok([Pos::from_pm(self.signed()?), Pos::from_pm(self.signed()?)])
    }

    pub(super) fn batch<const N: usize>(&mut self) -> Result<Batch<N>, RecordFault> {
        let bits = self.byte()?;
        let mut batch = Batch {
            number: self.number32()?,
            revision: self.number32()?,
            done: bits & DONE != 0,
            ..Batch::default()
        };
        if bits & CUT != 0 {
            batch.cut = Some(self.number32()?);
        }
        batch.took = self.byte()?;
        let mut last = batch.cut.unwrap_or(0);
        for _ in 0..self.byte()? {
            let span = self.span(last)?;
            last = span.first;
            if !batch.spans.push(span) {
                return Err(RecordFault::Number);
            }
        }
        Ok(batch)
    }

    fn span<const N: usize>(&mut self, last: u32) -> Result<Span<N>, RecordFault> {
        let mask = self.byte()?;
        let first = last.wrapping_add(self.signed32()?.cast_unsigned());
        let mut span = Span { first, until: Until::Rest, legs: [None; N] };
        if mask & ENDS != 0 {
            span.until = Until::Tick(first.wrapping_add(self.signed32()?.cast_unsigned()));
        }
        for (axis, place) in span.legs.iter_mut().enumerate() {
            if axis < 7 && mask & (1 << axis) != 0 {
                *place = Some(self.leg()?);
            }
        }
        Ok(span)
    }

    fn leg(&mut self) -> Result<Leg, RecordFault> {
        let mut leg = Leg { first: self.number32()?, differences: [0; 4] };
        for difference in &mut leg.differences {
            *difference = self.signed()?;
        }
        Ok(leg)
    }
}
