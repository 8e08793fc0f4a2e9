//! A recording as a file.
//!
//! | bytes | hold |
//! |---|---|
//! | 8 | `abbe-rec` |
//! | 2 | version of the file, little-endian |
//! | 8 | length of the whole file, little-endian |
//! | 4 | CRC-32 of all that follows, with version and length before it |
//! | … | [`Body`], by postcard; each stretch is deflated by itself |

use super::snapshot;
use crate::preset::Preset;
use abbe_core::design::{DesignError, StageSettings};
use abbe_core::edge::EDGE_VERSION;
use abbe_proto::record::FORMAT;
use crc::{CRC_32_ISO_HDLC, Crc};
use miniz_oxide::deflate::compress_to_vec;
use miniz_oxide::inflate::decompress_to_vec_with_limit;
use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"abbe-rec";
/// Version of the file; it changes whenever a file of one could not be read as the other.
const VERSION: u16 = 2;
/// Bytes before the body.
const HEAD: usize = 22;
/// How hard to deflate: more takes longer and gains little.
const LEVEL: u8 = 6;
/// No stretch is longer, bytes, whatever its file says.
const LONGEST_STRETCH: u64 = 1 << 30;

pub(super) const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// What was recorded, and of which stage.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Recording {
    pub(crate) origin: Origin,
    /// One after the other, without a gap; at least one.
    pub(crate) stretches: Vec<Stretch>,
}

/// Of which stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Origin {
    /// Name of the preset.
    pub(crate) preset: String,
    /// All that its `[controller]` part says of the stage.
    pub(crate) settings: StageSettings<2>,
    /// Seed of the twin.
    pub(crate) seed: u64,
}

impl Origin {
    /// A stage of this preset.
    pub(crate) fn of(preset: &Preset, seed: u64) -> Self {
        Self { preset: preset.name.clone(), settings: preset.controller.settings, seed }
    }
}

/// Some seconds of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Stretch {
    /// How many ticks.
    pub(crate) ticks: u64,
    /// Number of the last tick before it, and of its own last one, from power-on: a tick that was missed has a number.
    pub(crate) numbers: [u64; 2],
    /// The controller when it began.
    pub(crate) snapshot: Vec<u8>,
    /// What happened, in the blocks of [`abbe_proto::record`].
    pub(crate) blocks: Vec<u8>,
}

#[derive(Serialize, Deserialize)]
struct Body {
    program: String,
    edge: u16,
    format: u8,
    /// See [`snapshot::layout`].
    layout: u32,
    origin: Origin,
    stretches: Vec<Packed>,
}

#[derive(Serialize, Deserialize)]
struct Packed {
    /// Unpacked length, bytes.
    length: u64,
    deflated: Vec<u8>,
}

/// A file that is not a recording this program can replay.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecordingError {
    #[error("this is no recording of abbe")]
    NotARecording,
    #[error(
        "it is of version {0} of the file, this abbe reads version {VERSION}; replay it with the abbe that recorded it"
    )]
    Version(u16),
    #[error("it was cut off: {there} of {whole} bytes are there")]
    Truncated { there: u64, whole: u64 },
    #[error("it was altered: it has {there} bytes and says {whole}")]
    TooLong { there: u64, whole: u64 },
    #[error("it was altered: its checksum is {found:#010x}, not {written:#010x}")]
    Altered { found: u32, written: u32 },
    #[error("abbe {recorded} recorded it and this is abbe {here}; replay it with the abbe that recorded it")]
    Program { recorded: String, here: &'static str },
    #[error(
        "its inputs are of version {} and its blocks of version {}, this abbe's of {EDGE_VERSION} and {FORMAT}; replay it with the abbe that recorded it",
        recorded.0, recorded.1
    )]
    Edge { recorded: (u16, u8) },
    #[error("another build of abbe {here} recorded it, whose controller is kept in another form; replay it with that one", here = PROGRAM)]
    Layout,
    #[error("the stage it was recorded on is none: {0}")]
    Stage(DesignError),
    #[error("it cannot be read: {0}")]
    Contents(String),
}

const PROGRAM: &str = env!("CARGO_PKG_VERSION");

impl From<postcard::Error> for RecordingError {
    fn from(error: postcard::Error) -> Self {
        Self::Contents(error.to_string())
    }
}

impl Recording {
    /// The file.
    pub(crate) fn to_bytes(&self) -> Result<Vec<u8>, RecordingError> {
        let stretches = self.stretches.iter().map(pack).collect::<Result<_, _>>()?;
        let config = self.origin.settings.build().map_err(RecordingError::Stage)?;
        let body = Body {
            program: PROGRAM.to_owned(),
            edge: EDGE_VERSION,
            format: FORMAT,
            layout: snapshot::layout(&config)?,
            origin: self.origin.clone(),
            stretches,
        };
        let body = postcard::to_stdvec(&body)?;
        let mut file = MAGIC.to_vec();
        file.extend(VERSION.to_le_bytes());
        file.extend(((HEAD + body.len()) as u64).to_le_bytes());
        file.extend(checksum(&file[8..18], &body).to_le_bytes());
        file.extend(body);
        Ok(file)
    }

    /// Reads a file. Everything is checked before anything is believed.
    pub(crate) fn of_bytes(file: &[u8]) -> Result<Self, RecordingError> {
        let bytes = body_of(file)?;
        // Who recorded it stands first, and is looked at before the rest, which another program may have in another form.
        let ((program, edge, format), _): ((String, u16, u8), _) = postcard::take_from_bytes(bytes)?;
        if program != PROGRAM {
            return Err(RecordingError::Program { recorded: program, here: PROGRAM });
        }
        if (edge, format) != (EDGE_VERSION, FORMAT) {
            return Err(RecordingError::Edge { recorded: (edge, format) });
        }
        let body: Body = whole(postcard::take_from_bytes(bytes)?)?;
        let config = body.origin.settings.build().map_err(RecordingError::Stage)?;
        if body.layout != snapshot::layout(&config)? {
            return Err(RecordingError::Layout);
        }
        if body.stretches.is_empty() {
            return Err(RecordingError::Contents("nothing was recorded".into()));
        }
        let stretches = body.stretches.iter().map(unpack).collect::<Result<_, _>>()?;
        Ok(Self { origin: body.origin, stretches })
    }

    /// Number of the last tick before the recording, and of its own last one, from power-on.
    pub(crate) fn numbers(&self) -> [u64; 2] {
        let first = self.stretches.first().map_or(0, |stretch| stretch.numbers[0]);
        [first, self.stretches.last().map_or(first, |stretch| stretch.numbers[1])]
    }

    /// Ticks a second.
    pub(crate) fn tick_hz(&self) -> f64 {
        self.origin.settings.tick_hz
    }
}

fn checksum(version_and_length: &[u8], body: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(version_and_length);
    digest.update(body);
    digest.finalize()
}

/// The body of a file that is whole.
fn body_of(file: &[u8]) -> Result<&[u8], RecordingError> {
    let after_magic = file.strip_prefix(MAGIC).ok_or(RecordingError::NotARecording)?;
    let there = file.len() as u64;
    let cut_off = RecordingError::Truncated { there, whole: there.max(HEAD as u64) };
    let Some((version, rest)) = after_magic.split_first_chunk::<2>() else { return Err(cut_off) };
    let number = u16::from_le_bytes(*version);
    if number != VERSION {
        return Err(RecordingError::Version(number));
    }
    let Some((length, rest)) = rest.split_first_chunk::<8>() else { return Err(cut_off) };
    let whole = u64::from_le_bytes(*length);
    let Some((written, body)) = rest.split_first_chunk::<4>() else { return Err(cut_off) };
    if there < whole {
        return Err(RecordingError::Truncated { there, whole });
    }
    if there > whole {
        return Err(RecordingError::TooLong { there, whole });
    }
    let (found, written) = (checksum(&after_magic[..10], body), u32::from_le_bytes(*written));
    if found == written { Ok(body) } else { Err(RecordingError::Altered { found, written }) }
}

/// What was read, when nothing is left over.
fn whole<T>((value, rest): (T, &[u8])) -> Result<T, RecordingError> {
    if rest.is_empty() {
        return Ok(value);
    }
    Err(RecordingError::Contents(format!("{} bytes are left over", rest.len())))
}

fn pack(stretch: &Stretch) -> Result<Packed, RecordingError> {
    let bytes = postcard::to_stdvec(stretch)?;
    Ok(Packed { length: bytes.len() as u64, deflated: compress_to_vec(&bytes, LEVEL) })
}

fn unpack(packed: &Packed) -> Result<Stretch, RecordingError> {
    let length = packed.length.min(LONGEST_STRETCH) as usize;
    let bytes = decompress_to_vec_with_limit(&packed.deflated, length)
        .map_err(|error| RecordingError::Contents(format!("a stretch cannot be unpacked ({error})")))?;
    whole(postcard::take_from_bytes(&bytes)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::tests::rig;

    fn recording() -> Recording {
        let mut rig = rig(2);
        for _ in 0..2500 {
            rig.tick();
        }
        rig.recorder_mut().recording().unwrap()
    }

    #[test]
    fn a_recording_comes_back_from_its_file() {
        let recording = recording();
        assert_eq!(Recording::of_bytes(&recording.to_bytes().unwrap()).unwrap(), recording);
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_refused() {
        let file = recording().to_bytes().unwrap();
        for at in (0..HEAD).chain((HEAD..file.len()).step_by(37)) {
            let mut altered = file.clone();
            altered[at] ^= 1 << (at % 8);
            assert!(Recording::of_bytes(&altered).is_err(), "byte {at}");
            let cut = Recording::of_bytes(&file[..at]).unwrap_err();
            let expected = if at < 8 { "no recording" } else { "cut off" };
            assert!(cut.to_string().contains(expected), "{at}: {cut}");
        }
        let longer = [&file[..], b"more"].concat();
        assert!(matches!(Recording::of_bytes(&longer), Err(RecordingError::TooLong { .. })));
    }

    /// The body changed, with a checksum that fits again.
    fn forged(change: impl FnOnce(&mut Body)) -> RecordingError {
        let file = recording().to_bytes().unwrap();
        let mut body: Body = postcard::from_bytes(&file[HEAD..]).unwrap();
        change(&mut body);
        let body = postcard::to_stdvec(&body).unwrap();
        let mut forged = file[..10].to_vec();
        forged.extend(((HEAD + body.len()) as u64).to_le_bytes());
        forged.extend(checksum(&forged[8..18], &body).to_le_bytes());
        forged.extend(body);
        Recording::of_bytes(&forged).unwrap_err()
    }

    #[test]
    fn what_fits_this_program_no_more_is_told_apart() {
        let told = |error: RecordingError| error.to_string();
        assert!(told(forged(|body| body.program = "9.9.9".into())).starts_with("abbe 9.9.9 recorded it"));
        assert!(matches!(forged(|body| body.layout ^= 1), RecordingError::Layout));
        assert!(told(forged(|body| body.edge += 1)).starts_with("its inputs are of version 2"));
        assert!(
            told(forged(|body| body.format += 1)).contains(&format!("its blocks of version {}", FORMAT + 1))
        );
        assert!(told(forged(|body| body.origin.settings.tick_hz = -1.0)).contains("tick_hz"));
        assert!(told(forged(|body| body.stretches.clear())).contains("nothing was recorded"));
        assert!(told(forged(|body| body.stretches[0].length = 5)).contains("unpacked"));
        assert!(told(forged(|body| body.stretches[0].deflated.truncate(9))).contains("unpacked"));
    }
}
