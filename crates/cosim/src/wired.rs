//! The board wired to the twin, pin by pin: STEP, DIR and enable out; encoders, switches and faults in.
//!
//! Time goes in ticks. While the board runs one, the edges of the twin's last one are played at its pins; then the
//! pulses that its STEP pins gave move the twin by one more. The mechanics are one tick behind the pins, which is the
//! delay that the twin has by itself when it is run without a board, so both run alike.

use crate::board::design::{AXES, DRIVE_FAULT, EMERGENCY_STOP, NOT_ENABLE, PULSE_LEAD_CLOCKS};
use crate::board::{Board, Rise, TICK_CLOCKS, Telemetry};
use crate::image::Image;
use abbe_core::front::pulse_words::LAG;
use abbe_twin::Twin;
use abbe_twin::pins::{Drive, Wires};
use abbe_twin::scale::Lines;
use anyhow::{Context, Result, ensure};

/// The line of pulses begins with a pause, and a pause takes seven clocks beside its gap.
const LEAD: u64 = PULSE_LEAD_CLOCKS as u64 + 7;
/// Clocks after a tick was due at which the pulses of the tick before are over, drives on or off.
const OVER: u64 = LEAD + 500;
/// Clocks before the next tick at which the last edge has been played.
const QUIET: u64 = 200;

/// Pulses of an axis until a clock: at least, and at most. They differ when one rises in the very instruction that
/// passes it.
pub type Between = [i32; 2];

/// Board and twin.
pub struct Wired {
    /// The board.
    pub board: Board,
    /// The stage.
    pub twin: Twin,
    /// Pulses until the last tile's end, signed.
    pulses: [i32; 2],
    /// Rises that belong to tiles to come.
    rises: [Vec<Rise>; 2],
    last: Telemetry,
    /// The board drove its enable pin before this tick began.
    enabled: bool,
}

/// What the STEP pins gave in a tick: until its middle and until its end, signed, from power-on.
pub type Pulses = [[Between; 2]; 2];

impl Wired {
    /// Powers both on and runs until the board ticks.
    ///
    /// # Errors
    /// It does not tick.
    pub fn power_on(image: &Image, mut twin: Twin) -> Result<Self> {
        let mut board = Board::power_on(image)?;
        for (axis, lines) in twin.lines().into_iter().enumerate() {
            set_lines(&mut board, 0, axis, lines);
        }
        // From here on the twin remembers its edges.
        let wires = twin.step_pins(&[Drive::OFF; 2]);
        set_contacts(&mut board, 0, &wires);
        let last = board.run_to_next_tick(100).context("the board does not tick")?;
        for (axis, lines) in twin.lines().into_iter().enumerate() {
            set_lines(&mut board, last.due + TICK_CLOCKS / 2, axis, lines);
        }
        Ok(Self { board, twin, pulses: [0; 2], rises: Default::default(), last, enabled: false })
    }

    /// The last tick of the board.
    pub fn last(&self) -> Telemetry {
        self.last
    }

    /// One tick of both. `choose` says how many pulses were given where the pins leave it open.
    ///
    /// # Errors
    /// The board has stopped ticking, or has crashed.
    pub fn tick(&mut self, choose: impl FnOnce(&Pulses) -> [[i32; 2]; 2]) -> Result<Telemetry> {
        let over = self.tile_end().unwrap_or(self.last.due + OVER);
        self.board.run_until(over + 1);
        let seen = self.take_pulses(over);
        let chosen = choose(&seen);
        let drives = [0, 1].map(|axis| Drive { enable: self.enabled, pulses: chosen[axis], duty: 0 });
        for (axis, halves) in chosen.iter().enumerate() {
            self.forget_rises(axis, halves[1]);
        }
        let wires = self.twin.step_pins(&drives);
        self.play(&wires);
        let next = self.last.due + TICK_CLOCKS;
        self.board.run_until(next - 1 - QUIET / 2);
        self.enabled = !self.board.is_high(NOT_ENABLE);
        // A tick is not over sooner; looking for its end at every instruction takes time.
        self.board.run_until(next + TICK_CLOCKS / 5);
        self.last = self.board.run_to_next_tick(20).context("the board has stopped ticking")?;
        ensure!(!self.board.has_crashed(), "the board has crashed");
        Ok(self.last)
    }

    /// The clock at which the pulses of the tick before the last one are over, on the emitters' own line of time.
    fn tile_end(&self) -> Option<u64> {
        let begin = self.board.emitters_since()? + LEAD + u64::from(LAG);
        let after_tick = (self.last.due + TICK_CLOCKS / 2).saturating_sub(begin);
        Some(begin + after_tick / TICK_CLOCKS * TICK_CLOCKS)
    }

    /// Counts the pulses until the middle and the end of the tile that ends at `over`.
    fn take_pulses(&mut self, over: u64) -> Pulses {
        let mut seen = [[[0; 2]; 2]; 2];
        for (axis, seen) in seen.iter_mut().enumerate() {
            let rises = &mut self.rises[axis];
            rises.extend(self.board.take_rises(axis));
            let ways = |rises: &[Rise]| rises.iter().map(|rise| if rise.up { 1 } else { -1 }).sum::<i32>();
            for (half, end) in seen.iter_mut().zip([over - TICK_CLOCKS / 2, over]) {
                // A level is seen one clock after the one in which it rises.
                let surely = rises.partition_point(|rise| rise.between[1] <= end + 1);
                let at_most = rises.partition_point(|rise| rise.between[0] <= end);
                *half = [surely, at_most].map(|rises_of| self.pulses[axis] + ways(&rises[..rises_of]));
            }
        }
        seen
    }

    /// Forgets the rises that belong to the tiles until now; `pulses` were counted until their end.
    fn forget_rises(&mut self, axis: usize, pulses: i32) {
        let rises = &mut self.rises[axis];
        let mut counted = self.pulses[axis];
        while counted != pulses && !rises.is_empty() {
            counted += if rises.remove(0).up { 1 } else { -1 };
        }
        self.pulses[axis] = counted;
    }

    /// Plays a tick of the twin at the board's pins, before its next tick.
    fn play(&mut self, wires: &Wires) {
        let from = self.board.clock() + 20;
        let to = self.last.due + TICK_CLOCKS - QUIET;
        set_contacts(&mut self.board, from, wires);
        for (axis, wires) in wires.axes.iter().enumerate() {
            for edge in &wires.edges {
                let at = from + u64::from(edge.clock) * (to - from) / TICK_CLOCKS;
                set_lines(&mut self.board, at, axis, edge.lines);
            }
        }
    }
}

fn set_lines(board: &mut Board, at: u64, axis: usize, lines: Lines) {
    board.set_at(at, AXES[axis].a, lines.a);
    board.set_at(at, AXES[axis].a + 1, lines.b);
    board.set_at(at, AXES[axis].z, lines.z);
}

fn set_contacts(board: &mut Board, at: u64, wires: &Wires) {
    for (axis, wires) in wires.axes.iter().enumerate() {
        board.set_at(at, AXES[axis].limit_low, wires.limit_low);
        board.set_at(at, AXES[axis].limit_high, wires.limit_high);
    }
    board.set_at(at, DRIVE_FAULT, wires.axes.iter().any(|axis| axis.drive_fault));
    board.set_at(at, EMERGENCY_STOP, wires.emergency_stop);
}
