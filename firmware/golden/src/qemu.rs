//! The trace from a file of the host, the answer to its terminal: for QEMU, by semihosting.
//!
//! The file is `trace.rec` in the folder QEMU runs in. It prints one line, `ticks proven hash`, and ends with status 0 when the outputs are
//! those of the recorded run.

use crate::{End, Found};
use semihosting::io::Read;
use semihosting::{fs::File, print, println, process};

/// The file.
pub(crate) struct Trace(File);

impl Trace {
    pub(crate) fn open() -> Self {
        match File::open(c"trace.rec") {
            Ok(file) => Self(file),
            Err(_) => nothing_to_do(),
        }
    }

    /// Fills `place`, or says that there is not enough.
    pub(crate) fn read(&mut self, mut place: &mut [u8]) -> bool {
        while !place.is_empty() {
            match self.0.read(place) {
                Ok(0) | Err(_) => return false,
                Ok(read) => place = &mut place[read..],
            }
        }
        true
    }
}

pub(crate) fn answer(found: &Found) -> ! {
    println!("{} {} {:016x}", found.ticks, found.proven, found.hash.value());
    match found.end {
        End::Whole => process::exit(0),
        End::Differs => println!("the outputs differ from those of the recorded run"),
        End::Unreadable(error) => println!("{error}"),
    }
    process::exit(1)
}

pub(crate) fn nothing_to_do() -> ! {
    println!("golden: there is no trace.rec here");
    process::exit(2)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    print!("{info}\n");
    process::exit(3)
}
