//! The presets.

#![allow(dead_code, reason = "each test uses its own part")]

pub(crate) use abbe_twin::preset::settings;

pub(crate) const MICROSCOPE_100: &str = include_str!("../../../../presets/microscope-100.toml");
pub(crate) const LITHO_120: &str = include_str!("../../../../presets/litho-120.toml");
