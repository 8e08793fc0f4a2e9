//! What travels on wires: parsers and encoders, sans I/O, without allocation and without panic.
//!
//! Nothing travels yet: the first commands of `abbe` talk to a twin in their own process. The crate is here so that
//! its place in the house is fixed (it may see `abbe-core` and nothing else of ours) and so that the link gate already
//! holds for whatever comes.
#![no_std]
