//! A part of the motion that was decided, and its pieces.

use super::super::curve::Place;
use super::super::overlap::Overlap;
use super::super::pieces::{Along, Piece, Pieces, rest};
use super::super::scan::{self, ScanPlan};
use super::passage::Passage;

/// What a part is.
#[derive(Clone, Copy, Debug)]
pub(super) enum What {
    /// Along a block.
    Run(Along),
    /// Around the corner at its end.
    Round(Passage),
    /// Around it where both lines would stop.
    Overlap(Overlap),
    /// Line by line over an area: the program's only scan.
    Scan,
    /// There.
    Rest(Place),
}

/// A part of the motion. Times are ticks since the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub(super) what: What,
    /// Number of the block it belongs to.
    pub(super) block: usize,
    pub(super) begins: f64,
    pub(super) ends: f64,
}

impl Default for Part {
    fn default() -> Self {
        Self { what: What::Rest([0.0; 2]), block: 0, begins: 0.0, ends: 0.0 }
    }
}

/// How far a part is laid out.
#[allow(clippy::large_enum_variant, reason = "there is no other place for it")]
#[derive(Clone, Debug, Default)]
pub(super) enum Laying {
    #[default]
    Nothing,
    Run(Pieces),
    /// And the piece that comes next.
    Scan(scan::Pieces, Option<Piece>),
    /// So many pieces of the corner.
    Round(usize),
    All,
}

/// A piece that was laid out, if it could be, and when it is over; never, if it is a rest.
pub(super) type Laid = (Option<Piece>, Option<f64>);

impl Laying {
    /// The next piece of a part.
    pub(super) fn next(&mut self, part: &Part, scan: Option<&ScanPlan>) -> Option<Laid> {
        match part.what {
            What::Run(along) => {
                if let Self::Nothing = self {
                    *self = Self::Run(along.pieces_from(part.begins));
                }
                let Self::Run(pieces) = self else { return None };
                // The rest may have been decided anew.
                if pieces.time() >= part.ends {
                    return None;
                }
                let piece = pieces.next_of_motion()?;
                // The end of the part, without what sums have rounded, or where something else begins.
                let until = if pieces.is_over() { part.ends } else { pieces.time().min(part.ends) };
                Some((piece, Some(until)))
            }
            What::Scan => self.next_of_scan(part, scan?),
            What::Round(corner) => self.next_of_corner(part, &corner),
            What::Overlap(overlap) => self.once(|| (overlap.piece(part.begins), Some(part.ends))),
            What::Rest(at) => self.once(|| (rest(part.begins, at), None)),
        }
    }

    /// There is one piece.
    fn once(&mut self, piece: impl Fn() -> Laid) -> Option<Laid> {
        let is_new = matches!(self, Self::Nothing);
        *self = Self::All;
        is_new.then(piece)
    }

    /// But for its end: a rest comes behind it.
    fn next_of_scan(&mut self, part: &Part, plan: &ScanPlan) -> Option<Laid> {
        if let Self::Nothing = self {
            let mut pieces = plan.pieces();
            let first = pieces.next().flatten();
            *self = Self::Scan(pieces, first);
        }
        let Self::Scan(pieces, next) = self else { return None };
        let mut piece = (*next)?;
        *next = pieces.next().flatten();
        let [ahead, _] = (*next)?;
        let until = part.begins + f64::from(ahead.first);
        for leg in &mut piece {
            leg.first = leg.first.saturating_add(part.begins as u32);
        }
        Some((Some(piece), Some(until)))
    }

    fn next_of_corner(&mut self, part: &Part, corner: &Passage) -> Option<Laid> {
        let number = if let Self::Round(number) = self { *number } else { 0 };
        *self = Self::Round(number.saturating_add(1));
        let (piece, until) = corner.piece(number, part.begins, part.ends)?;
        Some((piece, Some(until)))
    }
}
