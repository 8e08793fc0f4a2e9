//! Plans of all kinds, from bytes: whatever is planned ends where it should and keeps its limits, and what is refused is
//! refused for its reason.
//!
//! The first byte chooses what is planned, the others are its numbers ([`Bytes`]).

#![no_main]

mod any;
mod bytes;
mod curve;
mod judge;
mod program;
mod transfer;
mod walk;

use bytes::Bytes;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes::of(data);
    match bytes.byte() % 7 {
        0 => transfer::fastest(&mut bytes),
        1 => transfer::stop(&mut bytes),
        2 => transfer::lasting(&mut bytes),
        3 => transfer::together(&mut bytes),
        4 => curve::along(&mut bytes),
        5 => program::walked(&mut bytes),
        _ => any::numbers(&mut bytes),
    }
});
