//! Watches the tick: when it stalls, the drives go off, whatever core 1 is doing.

use crate::design::{STALLED_LOOKS, WATCH_US, WATCHDOG_US};
use crate::front;
use crate::safety::enable_drives;
use crate::shared::{Note, TICKS};
use core::sync::atomic::Ordering;
use embassy_rp::watchdog::Watchdog;
use embassy_time::{Duration, Timer};

/// Looks for ticks, for ever. If core 0 itself stops looking, the chip's watchdog starts everything anew: drives off.
pub async fn watch_the_tick(mut watchdog: Watchdog) -> ! {
    if watchdog.reset_reason().is_some() {
        Note::StartedAnew.say();
    }
    watchdog.start(Duration::from_micros(u64::from(WATCHDOG_US)));
    let mut last = TICKS.load(Ordering::Relaxed);
    let mut looks = 0;
    loop {
        Timer::after_micros(WATCH_US).await;
        watchdog.feed(Duration::from_micros(u64::from(WATCHDOG_US)));
        let now = TICKS.load(Ordering::Relaxed);
        looks = if now == last { looks + 1 } else { 0 };
        last = now;
        if looks >= STALLED_LOOKS {
            enable_drives(false);
            front::stop_pulses();
            Note::Stalled.say();
        }
    }
}
