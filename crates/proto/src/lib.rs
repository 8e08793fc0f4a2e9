//! See the workspace architecture page.
#![no_std]
