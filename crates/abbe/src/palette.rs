//! Colours of all plots: those of Okabe and Ito, told apart by people who see red and green alike.

use plotters::style::RGBColor;

pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const ORANGE: RGBColor = RGBColor(213, 94, 0);
pub(crate) const LIGHT_BLUE: RGBColor = RGBColor(86, 180, 233);
pub(crate) const LIGHT_ORANGE: RGBColor = RGBColor(230, 159, 0);
pub(crate) const RED: RGBColor = RGBColor(170, 0, 60);
pub(crate) const GREY: RGBColor = RGBColor(110, 118, 128);
pub(crate) const INK: RGBColor = RGBColor(27, 31, 36);
pub(crate) const GRID: RGBColor = RGBColor(226, 230, 234);
