//! What all plots have in common; their colours are in [`crate::palette`].

use crate::palette::INK;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

pub(crate) const TITLE_SIZE: u32 = 20;
pub(crate) const TEXT_SIZE: u32 = 14;

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Panel<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(crate) type Drawn = Result<(), Box<dyn std::error::Error>>;

/// A picture as SVG.
pub(crate) fn svg(size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Drawn) -> anyhow::Result<String> {
    let mut drawn = String::new();
    let area = SVGBackend::with_string(&mut drawn, size).into_drawing_area();
    draw(&area).map_err(|error| anyhow::anyhow!("the plot cannot be drawn: {error}"))?;
    drop(area);
    Ok(drawn)
}

/// The key to the lines of a panel.
pub(crate) fn names<'a, 'b: 'a>(panel: &mut Panel<'a, 'b>) -> Drawn {
    panel
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .label_font(("sans-serif", TEXT_SIZE).into_font().color(&INK))
        .draw()?;
    Ok(())
}

/// Decimals that tell some six labels on a scale of this length apart.
pub(crate) fn decimals(length: f64) -> usize {
    (1.0 - length.max(1e-6).log10().floor()).clamp(0.0, 6.0) as usize
}
