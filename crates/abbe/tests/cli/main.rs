//! The program as a user meets it: the built binary, its exit status, its two streams, and what it leaves on the disk.

// The lint spares test functions but not the functions they share.
#![allow(clippy::unwrap_used)]

mod certificate;
mod compensations;
#[cfg(unix)]
mod ctrl_c;
mod encoder;
mod encoder_gaps;
#[cfg(target_os = "linux")]
mod encoder_memory;
mod encoder_refusals;
mod ended;
mod folders;
mod harmonics;
mod pictures;
mod presets;
mod programs;
mod readings;
mod recordings;
mod runs;
mod signals;
mod stage;
mod stepwise;
mod sweeps;
mod usage;
