//! What is wrong with a recording, and where.

use abbe_core::compensate::MapError;
use core::fmt;

/// A recording that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordError {
    /// Where, bytes from the beginning of the recording.
    pub at: usize,
    /// What.
    pub fault: RecordFault,
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordFault {
    /// The recording ends inside a block.
    Truncated,
    /// No block is that long.
    Length(u16),
    /// The checksum of a block is another.
    Checksum {
        /// What the block says.
        written: u32,
        /// What its bytes give.
        found: u32,
    },
    /// Another version of the format.
    Format(u8),
    /// A stage with another number of axes.
    Axes {
        /// Of the recorded stage.
        recorded: u8,
        /// Of this one.
        here: u8,
    },
    /// No entry begins with this byte.
    Entry(u8),
    /// An entry goes on beyond the end of its block.
    Cut,
    /// A number does not fit where it stands.
    Number,
    /// A stage with more or fewer settings, or other kinds of devices.
    Stage,
    /// A map that no controller accepts.
    Map(MapError),
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "byte {} of the recording: {}", self.at, self.fault)
    }
}

impl fmt::Display for RecordFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated => f.write_str("it ends inside a block; it was cut off"),
            Self::Length(length) => write!(f, "no block holds {length} bytes; it was altered"),
            Self::Checksum { written, found } => {
                write!(f, "the block's checksum is {found:#010x} and not {written:#010x}; it was altered")
            }
            Self::Format(version) => {
                write!(f, "it is of version {version} of the format, this program reads {}", super::FORMAT)
            }
            Self::Axes { recorded, here } => {
                write!(f, "it is of a stage of {recorded} axes, this one has {here}")
            }
            Self::Entry(byte) => write!(f, "no entry begins with {byte:#04x}"),
            Self::Cut => f.write_str("an entry goes on beyond the end of its block"),
            Self::Number => f.write_str("a number does not fit where it stands"),
            Self::Stage => f.write_str("its stage has other settings than this program knows"),
            Self::Map(error) => write!(f, "an error map is not accepted: {error}"),
        }
    }
}

impl core::error::Error for RecordError {}
