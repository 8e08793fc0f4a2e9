//! Feeds that the stage cannot go: no error, it goes as fast as it may. Each is told once.

use super::course::Course;
use abbe_core::command::axis_name;
use abbe_proto::gcode::Rate;
use std::fmt;

/// So many feeds are told one by one.
pub(crate) const MOST: usize = 10;

/// Part of a speed that is rounding.
const ROUNDING: f64 = 1e-9;

/// A feed that is limited, in one motion or more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limited {
    /// The first line with it.
    pub(crate) line: u64,
    rate: Rate,
    /// 0 for x, 1 for y: the axis that cannot go so fast.
    pub(crate) axis: usize,
    /// What is asked for in that line, mm/s along the path.
    pub(crate) feed_mm_s: f64,
    /// As fast as the stage goes at the slowest place of all these motions, mm/s along the path.
    pub(crate) limit_mm_s: f64,
    /// How many motions have it.
    pub(crate) motions: u64,
}

impl fmt::Display for Limited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, axis, feed_mm_s, limit_mm_s, motions, .. } = *self;
        let axis = axis_name(axis);
        let times = if motions == 1 { String::new() } else { format!(" of {motions} motions with it") };
        write!(
            f,
            "line {line}: the feed of {feed_mm_s:.6} mm/s is more than {axis} can go; it is limited, to {limit_mm_s:.6} mm/s at the slowest place{times}"
        )
    }
}

/// All feeds that are limited.
#[derive(Debug)]
pub(crate) struct Feeds {
    /// The largest speeds of x and y, mm/s.
    speeds: [f64; 2],
    /// The first [`MOST`].
    pub(crate) limited: Vec<Limited>,
    /// Motions with others.
    pub(crate) others: u64,
}

impl Feeds {
    pub(super) fn new(speeds: [f64; 2]) -> Self {
        Self { speeds, limited: Vec::new(), others: 0 }
    }

    /// Looks at the feed of a motion.
    pub(super) fn look(&mut self, line: u64, rate: Rate, course: &Course) {
        let feed_mm_s = match rate {
            Rate::Rapid => return,
            Rate::PerMinute(feed) => feed.mm() / 60.0,
            Rate::Inverse(per_minute) => course.length_mm * per_minute.billionths() as f64 / 1e9 / 60.0,
        };
        let [x, y] = [0, 1].map(|axis| self.speeds[axis] / course.shares[axis]);
        let (axis, limit_mm_s) = if y < x { (1, y) } else { (0, x) };
        // Where nothing moves no axis is limited: the limit is infinite.
        if feed_mm_s > limit_mm_s * (1.0 + ROUNDING) {
            self.add(Limited { line, rate, axis, feed_mm_s, limit_mm_s, motions: 1 });
        }
    }

    fn add(&mut self, new: Limited) {
        let known = self.limited.iter_mut().find(|known| (known.rate, known.axis) == (new.rate, new.axis));
        if let Some(known) = known {
            known.motions += 1;
            known.limit_mm_s = known.limit_mm_s.min(new.limit_mm_s);
        } else if self.limited.len() < MOST {
            self.limited.push(new);
        } else {
            self.others += 1;
        }
    }
}
