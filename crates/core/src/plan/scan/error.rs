//! Why there is no scan.

use crate::command::axis_name;
use crate::units::{InMm, Pos};

/// Why an area cannot be scanned as asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScanError {
    /// A limit or the line speed is not a number above zero.
    NoNumber,
    /// Both corners are at the same place along the fast axis.
    NoLength {
        /// The fast axis.
        axis: usize,
    },
    /// There is no line, or two would lie in one place.
    NoPitch,
    /// The line speed is above the limit of the fast axis; pm a tick.
    TooFast {
        /// The fast axis.
        axis: usize,
        /// What was asked for.
        asked: f64,
        /// Its limit.
        limit: f64,
    },
    /// It would take more than 2²⁷ ticks.
    TooLong,
    /// A place, a speed or a limit is beyond what a tick's integers hold ([`Steps`](crate::plan::steps::Steps)).
    DoesNotFit,
    /// The stage would leave its travel: the turns lie outside the area.
    BeyondTravel {
        /// Which axis.
        axis: usize,
        /// Lowest and highest place of the scan.
        needs: [Pos; 2],
        /// Lowest and highest place of the travel.
        travel: [Pos; 2],
    },
}

impl core::fmt::Display for ScanError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NoNumber => f.write_str("a limit or the line speed of the scan is not a number above zero"),
            Self::NoLength { axis } => {
                write!(
                    f,
                    "the lines of the scan have no length: its corners have the same {}",
                    axis_name(*axis)
                )
            }
            Self::NoPitch => f.write_str(
                "the scan has no line, or two in one place; give one line at least, and a pitch above zero",
            ),
            // As whole numbers: writing floats leaves panic paths in the standard library.
            Self::TooFast { axis, asked, limit } => write!(
                f,
                "the line speed of {} pm a tick is above the limit of {}, {}; scan slower",
                *asked as u64,
                axis_name(*axis),
                *limit as u64
            ),
            Self::TooLong => {
                f.write_str("the scan takes more than 134217728 ticks; scan faster, or in several parts")
            }
            Self::DoesNotFit => f.write_str(
                "a place of the scan is farther than 549 mm from zero, or a limit beyond 33 µm a tick, 131 nm a tick² \
                 or 8 nm a tick³",
            ),
            Self::BeyondTravel { axis, needs: [from, to], travel: [low, high] } => write!(
                f,
                "with its turns the scan needs {name} = {} … {} mm, and the travel is {} … {} mm; scan a smaller area, \
                 slower, or along the other axis",
                InMm(*from),
                InMm(*to),
                InMm(*low),
                InMm(*high),
                name = axis_name(*axis)
            ),
        }
    }
}

impl core::error::Error for ScanError {}
