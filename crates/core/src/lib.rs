//! The controller.
#![no_std]
