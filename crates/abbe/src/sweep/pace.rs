//! How even a measured speed is.

use super::tally::{Figures, Tally};
use std::collections::VecDeque;

/// Time over which a speed is measured, s: long enough that a count does not hide it, short enough for the resonance of a
/// motor near 220 Hz.
const WINDOW_S: f64 = 2e-3;

/// Speeds of one line after the other, over a window that goes along.
#[derive(Clone, Debug)]
pub(crate) struct Pace {
    /// pm a tick.
    speed: f64,
    ticks: usize,
    window: VecDeque<i64>,
    /// Parts of the speed.
    off: Tally,
}

impl Pace {
    /// Beside a speed, pm a tick.
    pub(crate) fn new(speed: f64, tick_hz: f64) -> Self {
        let ticks = (WINDOW_S * tick_hz).round().max(1.0) as usize;
        Self { speed, ticks, window: VecDeque::with_capacity(ticks + 1), off: Tally::default() }
    }

    /// A place of a line, pm, a tick after the one before.
    pub(crate) fn see(&mut self, place: i64) {
        self.window.push_back(place);
        if self.window.len() <= self.ticks {
            return;
        }
        if let Some(from) = self.window.pop_front() {
            self.off.add(place.abs_diff(from) as f64 / self.way() - 1.0);
        }
    }

    /// What comes next belongs to another line.
    pub(crate) fn end_line(&mut self) {
        self.window.clear();
    }

    /// Parts of the speed; none if no line was as long as the window.
    pub(crate) fn figures(&self) -> Option<Figures> {
        self.off.figures()
    }

    /// The window, ticks.
    pub(crate) fn ticks(&self) -> usize {
        self.ticks
    }

    /// The way in a window at the speed asked for, pm.
    pub(crate) fn way(&self) -> f64 {
        self.speed * self.ticks as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_is_measured_within_lines_only() {
        let mut pace = Pace::new(1e6, 10_000.0);
        let line = |pace: &mut Pace, from: i64, step: i64| {
            (0..30).for_each(|tick| pace.see(from + tick * step));
            pace.end_line();
        };
        (0..20).for_each(|tick| pace.see(tick * 1_000_000));
        assert_eq!((pace.figures(), pace.ticks()), (None, 20));
        pace.end_line();
        line(&mut pace, 0, 1_000_000);
        assert_eq!(pace.figures().map(|off| off.most), Some(0.0));
        line(&mut pace, 30_000_000, -1_100_000);
        let off = pace.figures().unwrap();
        assert!((off.most - 0.1).abs() < 1e-12 && (off.mean - 0.05).abs() < 1e-12, "{off:?}");
    }
}
