//! Two comparators with hysteresis, and the line of the reference mark.

use crate::scale::Lines;

/// Low as long as its signal is positive: A follows the cosine, B the sine.
#[derive(Clone, Debug, Default)]
pub(super) struct Comparators {
    pub(super) lines: Lines,
    /// Signals at the last look.
    last: [f64; 2],
    /// Half the hysteresis, part of the converter's full scale.
    half: f64,
}

impl Comparators {
    pub(super) fn new(signals: [f64; 2], half: f64) -> Self {
        let [cos, sin] = signals;
        Self { lines: Lines { a: cos < 0.0, b: sin < 0.0, z: false }, last: signals, half }
    }

    /// The signals come in straight lines from those of the last look, between two clocks.
    #[inline]
    pub(super) fn see(
        &mut self,
        signals: [f64; 2],
        z: bool,
        clocks: [u64; 2],
        edge: &mut impl FnMut(u64, Lines),
    ) {
        let (levels, last) = ([self.lines.a, self.lines.b], self.last);
        self.last = signals;
        let crossed = [0, 1].map(|channel| {
            let threshold = if levels[channel] { self.half } else { -self.half };
            let over = (signals[channel] > threshold) == levels[channel];
            over.then(|| crossing(threshold, last[channel], signals[channel], clocks))
        });
        match crossed {
            [None, None] => {}
            [Some(at), None] => self.turn([true, false], at, edge),
            [None, Some(at)] => self.turn([false, true], at, edge),
            [Some(a), Some(b)] if a == b => self.turn([true, true], a, edge),
            [Some(a), Some(b)] => {
                self.turn([a < b, b < a], a.min(b), edge);
                self.turn([b < a, a < b], a.max(b), edge);
            }
        }
        if z != self.lines.z {
            self.lines.z = z;
            edge(clocks[1], self.lines);
        }
    }

    fn turn(&mut self, [a, b]: [bool; 2], clock: u64, edge: &mut impl FnMut(u64, Lines)) {
        self.lines.a ^= a;
        self.lines.b ^= b;
        edge(clock, self.lines);
    }
}

/// The clock at which a straight line meets the threshold; at once, if noise has put it beyond already.
fn crossing(threshold: f64, from: f64, to: f64, [begin, end]: [u64; 2]) -> u64 {
    let share = if from == to { 1.0 } else { ((threshold - from) / (to - from)).clamp(0.0, 1.0) };
    begin + ((end - begin) as f64 * share) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_edge_comes_where_its_line_meets_the_threshold() {
        let mut comparators = Comparators::new([1.0, 1.0], 0.1);
        let mut edges = Vec::new();
        let mut see = |signals, clocks| {
            comparators.see(signals, false, clocks, &mut |clock, lines: Lines| {
                edges.push((clock, lines.a, lines.b));
            });
        };
        // The cosine falls through −0.1 at 1.1/2 of the way, the sine at 1.1/1.5.
        see([-1.0, -0.5], [0, 1000]);
        // Not back far enough.
        see([0.05, -0.5], [1000, 2000]);
        see([0.25, -0.5], [2000, 3000]);
        assert_eq!(edges, [(550, true, false), (733, true, true), (2250, false, true)]);
    }
}
