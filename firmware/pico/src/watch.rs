//! Watches the tick: when it stalls, the drives go off, whatever core 1 is doing.
//!
//! The look itself happens in an interrupt of core 0, so that nothing core 0 does keeps it waiting. The chip's watchdog is
//! fed only while ticks come: a tick that does not come back starts the board anew, with the drives off.

use crate::design::{FEED_US, STALLED_LOOKS, WATCHDOG_US};
use crate::front;
use crate::safety::enable_drives;
use crate::shared::{Note, TICKS};
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_rp::watchdog::Watchdog;
use embassy_time::{Duration, Timer};

/// The tick at the last look, and looks since it changed.
static SEEN: AtomicU32 = AtomicU32::new(0);
static LOOKS: AtomicU32 = AtomicU32::new(0);

/// One look, from an alarm's interrupt on core 0.
pub fn look() {
    let now = TICKS.load(Ordering::Relaxed);
    if now != SEEN.load(Ordering::Relaxed) {
        SEEN.store(now, Ordering::Relaxed);
        LOOKS.store(0, Ordering::Relaxed);
        return;
    }
    let looks = LOOKS.load(Ordering::Relaxed).saturating_add(1);
    LOOKS.store(looks, Ordering::Relaxed);
    if looks >= STALLED_LOOKS {
        enable_drives(false);
        front::halt_emitters();
        Note::Stalled.say();
    }
}

/// Whether ticks come.
pub fn ticks_come() -> bool {
    LOOKS.load(Ordering::Relaxed) < STALLED_LOOKS
}

/// Starts the chip's watchdog; from here on a program that ends anywhere starts anew.
pub fn begin(watchdog: &mut Watchdog) {
    if watchdog.reset_reason().is_some() {
        Note::StartedAnew.say();
    }
    watchdog.start(Duration::from_micros(u64::from(WATCHDOG_US)));
}

/// Feeds the watchdog, for ever, while ticks come.
pub async fn feed(mut watchdog: Watchdog) -> ! {
    loop {
        if ticks_come() {
            watchdog.feed(Duration::from_micros(u64::from(WATCHDOG_US)));
        }
        Timer::after_micros(FEED_US).await;
    }
}
