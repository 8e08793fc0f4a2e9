//! Reads signals of analogue encoders on this processor, for an emulator that counts its cycles: the work that the
//! example `sensing_speed` of `crates/core` does on the host, from the same source. The answer stands in memory.
//! `crates/cosim/src/sensing.rs` reads it.
#![no_std]
#![no_main]

#[path = "../../../../crates/core/examples/sensing_speed/signals.rs"]
mod signals;
#[path = "../../../../crates/core/examples/sensing_speed/work.rs"]
#[allow(dead_code, reason = "names and budgets are for who reads the answer")]
mod work;

use core::sync::atomic::{AtomicU32, Ordering};
use signals::{Reading, SAMPLES};
use work::{Bench, ROWS, refine};

/// 0 while it runs; 1 at the end, 5 after a panic.
#[unsafe(no_mangle)]
static SENSING_END: AtomicU32 = AtomicU32::new(0);
/// The row that runs now.
#[unsafe(no_mangle)]
static SENSING_ROW: AtomicU32 = AtomicU32::new(0);
/// How many rows there are, and what the results of each hash to.
#[unsafe(no_mangle)]
static SENSING_FOUND: [AtomicU32; 1 + ROWS.len()] = [const { AtomicU32::new(0) }; 1 + ROWS.len()];

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut readings = [Reading::NONE; SAMPLES];
    signals::fill(&mut readings);
    let [rows, hashes @ ..] = &SENSING_FOUND;
    rows.store(ROWS.len() as u32, Ordering::Relaxed);
    for (number, (row, hash)) in ROWS.iter().zip(hashes).enumerate() {
        let mut bench = Bench::new(row);
        SENSING_ROW.store(number as u32, Ordering::Relaxed);
        let found = bench.run(&readings, |head| {
            refine(head, |row| SENSING_ROW.store(row as u32, Ordering::Relaxed));
            SENSING_ROW.store(number as u32, Ordering::Relaxed);
        });
        hash.store(found, Ordering::Relaxed);
    }
    end(1)
}

fn end(how: u32) -> ! {
    SENSING_END.store(how, Ordering::Release);
    loop {
        core::hint::spin_loop();
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    end(5)
}
