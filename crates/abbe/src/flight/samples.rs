//! The samples of an analogue encoder in a recording, as `abbe encoder` reads them.

use super::file::{Recording, RecordingError};
use super::trace::Window;
use abbe_proto::record::{Decoder, Entry, Event};
use std::fmt::Write as _;

/// The samples of an axis inside the window: `t_s,a,b`, a the cosine and b the sine in codes of ± 2¹⁵. A sample that did not
/// come is a gap of the time. None where the axis gave no sample at all.
///
/// # Errors
/// The recording cannot be decoded.
pub(crate) fn csv(
    recording: &Recording,
    axis: usize,
    window: Window,
) -> Result<Option<String>, RecordingError> {
    let (mut csv, mut tick) = (String::from("t_s,a,b\n"), recording.numbers()[0]);
    let empty = csv.len();
    for stretch in &recording.stretches {
        let mut decoder = Decoder::<2>::new(&stretch.blocks);
        while let Some(entry) =
            decoder.next_entry().map_err(|error| RecordingError::Contents(error.to_string()))?
        {
            let Entry::Event(Event::Tick(inputs)) = entry else { continue };
            // Numbers of ticks wrap after some days, and jump where ticks were missed.
            tick += u64::from(inputs.tick.wrapping_sub(tick as u32));
            let t_s = tick as f64 / recording.tick_hz();
            if let Some(sample) = inputs.axes[axis].sin_cos.filter(|_| window.holds(t_s)) {
                _ = writeln!(csv, "{t_s:.4},{},{}", sample.cos, sample.sin);
            }
        }
    }
    Ok((csv.len() > empty).then_some(csv))
}
