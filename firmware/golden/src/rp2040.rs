//! The trace in the flash, the answer in memory: for an emulator that reads and writes both.

use crate::{End, Found};
use core::sync::atomic::{AtomicU32, Ordering};

/// Where the trace begins: its length, then its bytes.
const TRACE: usize = 0x1010_0000;

/// 0 while it runs; 1 at the end, 2 when the outputs differ, 4 without a stage, 5 after a panic; 16 and more when the
/// trace cannot be read from that byte of a block on.
#[unsafe(no_mangle)]
static GOLDEN_END: AtomicU32 = AtomicU32::new(0);
/// Ticks, ticks proven, hash low and high.
#[unsafe(no_mangle)]
static GOLDEN_FOUND: [AtomicU32; 4] = [const { AtomicU32::new(0) }; 4];

/// The bytes that are left.
pub(crate) struct Trace(&'static [u8]);

impl Trace {
    pub(crate) fn open() -> Self {
        // SAFETY: the emulator has laid the length and so many bytes into the flash, which nobody writes.
        let bytes = unsafe {
            let length = (TRACE as *const u32).read_volatile() as usize;
            core::slice::from_raw_parts((TRACE + 4) as *const u8, length)
        };
        Self(bytes)
    }

    /// Fills `place`, or says that there is not enough.
    pub(crate) fn read(&mut self, place: &mut [u8]) -> bool {
        let Some((now, rest)) = self.0.split_at_checked(place.len()) else { return false };
        place.copy_from_slice(now);
        self.0 = rest;
        true
    }
}

pub(crate) fn answer(found: &Found) -> ! {
    let hash = found.hash.value();
    let words = [found.ticks, found.proven, hash as u32, (hash >> 32) as u32];
    for (place, word) in GOLDEN_FOUND.iter().zip(words) {
        place.store(word, Ordering::Relaxed);
    }
    end(match found.end {
        End::Whole => 1,
        End::Differs => 2,
        End::Unreadable(error) => 16_u32.saturating_add(error.at as u32),
    })
}

pub(crate) fn nothing_to_do() -> ! {
    end(4)
}

fn end(how: u32) -> ! {
    GOLDEN_END.store(how, Ordering::Release);
    loop {
        core::hint::spin_loop();
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    end(5)
}
