//! Whether each line has passed each place exactly once.

/// A line that has not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Faulty {
    /// Its number, from 0.
    pub(crate) line: u32,
    /// Places that did not fire when it was their turn.
    pub(crate) missed: u32,
    /// Events that nobody waited for: of a place that had its turn, or in the wrong direction.
    pub(crate) again: u32,
}

/// Lines in their order, each with its places in theirs. It keeps only the faulty ones, so a sweep may be of any length.
#[derive(Clone, Debug)]
pub(crate) struct Ledger {
    places: u32,
    line: Faulty,
    /// How many places of the line have had their turn.
    past: u32,
    faulty: Vec<Faulty>,
}

impl Ledger {
    /// Before the first line, for so many places.
    pub(crate) fn new(places: u32) -> Self {
        Self { places, line: Faulty { line: 0, missed: 0, again: 0 }, past: 0, faulty: Vec::new() }
    }

    /// A place, by its number from the low edge, has fired on a line that goes up or not.
    pub(crate) fn fired(&mut self, place: u32, up: bool, line_is_up: bool) {
        let turn = if line_is_up { place } else { self.places - 1 - place };
        if up != line_is_up || turn < self.past {
            self.line.again += 1;
        } else {
            self.line.missed += turn - self.past;
            self.past = turn + 1;
        }
    }

    /// The line is over, and the next begins.
    pub(crate) fn next_line(&mut self) {
        self.line.missed += self.places - self.past;
        if self.line.missed + self.line.again > 0 {
            self.faulty.push(self.line);
        }
        self.line = Faulty { line: self.line.line + 1, missed: 0, again: 0 };
        self.past = 0;
    }

    /// Of the lines that are over.
    pub(crate) fn faulty(&self) -> &[Faulty] {
        &self.faulty
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places of two lines, up and down, and what is wrong with each: missed, again.
    fn found(lines: [&[(u32, bool)]; 2]) -> Vec<(u32, u32, u32)> {
        let mut ledger = Ledger::new(4);
        for (number, line) in lines.into_iter().enumerate() {
            for (place, up) in line {
                ledger.fired(*place, *up, number == 0);
            }
            ledger.next_line();
        }
        ledger.faulty().iter().map(|faulty| (faulty.line, faulty.missed, faulty.again)).collect()
    }

    #[test]
    fn what_is_missed_and_what_comes_again_is_found_with_its_line() {
        let up: Vec<_> = (0..4).map(|place| (place, true)).collect();
        let down: Vec<_> = (0..4).rev().map(|place| (place, false)).collect();
        assert_eq!(found([&up, &down]), []);
        assert_eq!(found([&up[1..], &down]), [(0, 1, 0)]);
        assert_eq!(found([&up, &down[..2]]), [(1, 2, 0)]);
        assert_eq!(found([&[], &down]), [(0, 4, 0)]);
        assert_eq!(found([&[up[0], up[1], up[1], up[2], up[3]], &down]), [(0, 0, 1)]);
        assert_eq!(found([&up, &[down[0], up[3], down[1], down[3]]]), [(1, 1, 1)]);
        assert_eq!(found([&[up[0], up[2], up[1], up[3]], &down]), [(0, 1, 1)]);
    }
}
