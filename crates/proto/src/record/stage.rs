//! Of which stage a recording is: a block before all others, for who replays it without knowing.
//!
//! Its payload is 15 × 16 + number of axes, where another block has the version of the format, and then
//! [`StageSettings`] by postcard: every float as the 8 bytes it is, so that whoever builds the stage builds the same
//! integers. The bytes follow the fields; a setting more or less is another stage, and is refused.

use super::decoder::payload_of;
use super::encoder::write_head;
use super::{Full, HEAD, LONGEST_BLOCK, RecordError, RecordFault};
use abbe_core::design::StageSettings;

/// Stands where other blocks have the version of the format.
const STAGE: u8 = 15;

/// Writes the block of a stage into `memory`, and lends it.
///
/// # Errors
/// When it is longer than a block; that of three axes has no half of it.
pub fn block<'a, const N: usize>(
    settings: &StageSettings<N>,
    memory: &'a mut [u8; LONGEST_BLOCK],
) -> Result<&'a [u8], Full> {
    let [_, _, _, _, _, _, kind, rest @ ..] = &mut *memory;
    *kind = STAGE << 4 | N as u8;
    let length = postcard::to_slice(settings, rest).map_err(|_| Full)?.len();
    let used = length.saturating_add(HEAD + 1);
    write_head(memory, used);
    memory.get(..used).ok_or(Full)
}

/// The stage that the first block of `bytes` is of; none where that block holds entries.
///
/// # Errors
/// When the block is altered or cut off, or its stage has other axes or settings than a stage has here.
pub fn of_block<const N: usize>(bytes: &[u8]) -> Result<Option<StageSettings<N>>, RecordError> {
    Ok(split(bytes)?.0)
}

/// The stage that a recording says it is of, if it does, and the blocks after that.
///
/// # Errors
/// As [`of_block`]. An empty recording is of no stage.
pub fn split<const N: usize>(recording: &[u8]) -> Result<(Option<StageSettings<N>>, &[u8]), RecordError> {
    if recording.get(HEAD).is_none_or(|kind| kind >> 4 != STAGE) {
        return Ok((None, recording));
    }
    let payload = payload_of(recording).map_err(|fault| RecordError { at: 0, fault })?;
    let settings = read(payload).map_err(|fault| RecordError { at: HEAD, fault })?;
    let rest = recording.get(HEAD.saturating_add(payload.len())..).unwrap_or_default();
    Ok((Some(settings), rest))
}

fn read<const N: usize>(payload: &[u8]) -> Result<StageSettings<N>, RecordFault> {
    let (kind, settings) = payload.split_first().ok_or(RecordFault::Cut)?;
    if usize::from(kind & 0x0f) != N {
        return Err(RecordFault::Axes { recorded: kind & 0x0f, here: N as u8 });
    }
    match postcard::take_from_bytes(settings) {
        Ok((settings, [])) => Ok(settings),
        _ => Err(RecordFault::Stage),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use abbe_core::design::{Analogue, Encoder, Motor};

    /// Two axes that differ in everything that has another form.
    fn settings() -> StageSettings<2> {
        let mut settings = StageSettings::default();
        settings.axes[0].encoder =
            Encoder::Analogue(Analogue { offset_cos: 0.1 + 0.2, factor: 160, ..Analogue::default() });
        (settings.axes[0].decode, settings.axes[0].filter_ns) = (1, 0);
        (settings.axes[1].decode, settings.axes[1].filter_ns) = (2, 2000);
        settings.axes[1].motor = Motor::Dc { full_speed_mm_s: -0.0, friction_mm_s: 1.3 };
        settings
    }

    fn written<const N: usize>(settings: &StageSettings<N>) -> Vec<u8> {
        block(settings, &mut [0; LONGEST_BLOCK]).unwrap().to_vec()
    }

    #[test]
    fn a_stage_comes_back_bit_for_bit_and_what_follows_is_left() {
        let recording = [&written(&settings())[..], b"blocks"].concat();
        let (read, rest) = split::<2>(&recording).unwrap();
        assert_eq!(format!("{read:?}"), format!("{:?}", Some(settings())));
        assert_eq!(rest, b"blocks");
        assert!(written(&StageSettings::<3>::default()).len() < LONGEST_BLOCK / 2);
    }

    #[test]
    fn a_recording_without_a_stage_is_left_whole() {
        for recording in [&b""[..], b"short", &[9, 0, 0, 0, 0, 0, super::super::FORMAT << 4 | 2, 0xc0]] {
            assert_eq!(split::<2>(recording), Ok((None, recording)));
        }
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_refused() {
        let stage = written(&settings());
        for at in (0..stage.len()).filter(|&at| at != HEAD) {
            let mut altered = stage.clone();
            altered[at] ^= 1 << (at % 8);
            assert!(of_block::<2>(&altered).is_err(), "byte {at}");
        }
        for end in HEAD + 1..stage.len() {
            let error = of_block::<2>(&stage[..end]).unwrap_err();
            assert_eq!((error.at, error.fault), (0, RecordFault::Truncated), "{end}");
        }
    }

    #[test]
    fn a_stage_with_other_axes_or_settings_is_told_apart() {
        let fault = |stage: &[u8]| of_block::<2>(stage).unwrap_err().fault;
        let of_one = written(&StageSettings::<1>::default());
        assert_eq!(fault(&of_one), RecordFault::Axes { recorded: 1, here: 2 });
        let mut memory = [0; LONGEST_BLOCK];
        let length = written(&settings()).len();
        for used in [length - 8, length + 8] {
            block(&settings(), &mut memory).unwrap();
            write_head(&mut memory, used);
            assert_eq!(fault(&memory[..used]), RecordFault::Stage);
        }
    }

    /// Whoever adds a setting is led here: traces of stages are to be recorded anew.
    #[test]
    fn a_default_axis_has_as_many_bytes_as_ever() {
        let [one, two] = [written(&StageSettings::<1>::default()), written(&StageSettings::<2>::default())];
        assert_eq!(two.len() - one.len(), 25 * 8 + 1 + 1 + 2 + 2);
    }
}
