//! Where to look: a serpentine grid of fields over an area.

use std::ops::RangeInclusive;

use serde::Serialize;

/// Largest overlap of neighbouring fields in percent: beyond it a scan only repeats itself.
pub const MOST_OVERLAP_PERCENT: f64 = 90.0;

/// Most fields one plan may have.
pub const MOST_FIELDS: usize = 1_000_000;

/// One field to visit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Field {
    /// Row of the grid, from 0 at the least y.
    pub row: usize,
    /// Column of the grid, from 0 at the least x.
    pub col: usize,
    /// Centre of the field in the stage frame, mm.
    pub x_mm: f64,
    /// Centre of the field in the stage frame, mm.
    pub y_mm: f64,
}

/// Why an area cannot be planned.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The overlap is outside (0, 90] %.
    #[error("overlap of {percent} %: it must be more than 0 % and at most {MOST_OVERLAP_PERCENT} %")]
    Overlap {
        /// What was asked, percent of the field.
        percent: f64,
    },
    /// A length is not a positive finite number.
    #[error("{what} of {value_mm} mm: it must be a number greater than 0")]
    Length {
        /// Which length.
        what: &'static str,
        /// What was asked, mm.
        value_mm: f64,
    },
    /// The origin is not finite.
    #[error("origin of ({x_mm}, {y_mm}) mm: it must be two finite numbers")]
    Origin {
        /// What was asked, mm.
        x_mm: f64,
        /// What was asked, mm.
        y_mm: f64,
    },
    /// The grid would have too many fields.
    #[error("the area needs {fields} fields; at most {MOST_FIELDS} are planned")]
    TooMany {
        /// Fields needed, as a float because it may be beyond any integer.
        fields: f64,
    },
}

/// Plans the fields that cover `area_mm` (width, height) with its least corner at `origin_mm`, rows in turn left to
/// right and right to left so that no move is longer than one step.
///
/// * `field_mm` — what one image covers, width and height.
/// * `overlap_percent` — of neighbouring fields at least, `0 < p ≤ 90`. Fields are spread evenly so that the outer
///   edges of the grid fall on those of the area; where one field is larger than the area, it is centred.
///
/// # Errors
/// See [`PlanError`]; each names the value.
pub fn serpentine(
    area_mm: [f64; 2],
    origin_mm: [f64; 2],
    field_mm: [f64; 2],
    overlap_percent: f64,
) -> Result<Vec<Field>, PlanError> {
    check(area_mm, origin_mm, field_mm, overlap_percent)?;
    let step_share = 1.0 - overlap_percent / 100.0;
    let counts = [0, 1].map(|k| fields_along(area_mm[k], field_mm[k], step_share));
    if counts[0] * counts[1] > MOST_FIELDS as f64 {
        return Err(PlanError::TooMany { fields: counts[0] * counts[1] });
    }
    let [columns, rows] = counts.map(|n| n as usize);
    let centre = |k: usize, i: usize, n: usize| origin_mm[k] + centre_along(area_mm[k], field_mm[k], i, n);
    let field = |row, col| Field { row, col, x_mm: centre(0, col, columns), y_mm: centre(1, row, rows) };
    Ok((0..rows)
        .flat_map(|row| serpent(row, columns).map(move |col| (row, col)))
        .map(|(r, c)| field(r, c))
        .collect())
}

fn check(area_mm: [f64; 2], origin_mm: [f64; 2], field_mm: [f64; 2], percent: f64) -> Result<(), PlanError> {
    if !(percent > 0.0 && percent <= MOST_OVERLAP_PERCENT) {
        return Err(PlanError::Overlap { percent });
    }
    let lengths = [
        ("area width", area_mm[0]),
        ("area height", area_mm[1]),
        ("field width", field_mm[0]),
        ("field height", field_mm[1]),
    ];
    for (what, value_mm) in lengths {
        if !(value_mm > 0.0 && value_mm.is_finite()) {
            return Err(PlanError::Length { what, value_mm });
        }
    }
    if !(origin_mm[0].is_finite() && origin_mm[1].is_finite()) {
        return Err(PlanError::Origin { x_mm: origin_mm[0], y_mm: origin_mm[1] });
    }
    Ok(())
}

/// Fields needed so that neighbours overlap at least as asked. A billionth of a field is forgiven, or rounding of
/// an exact fit would add a row.
fn fields_along(area: f64, field: f64, step_share: f64) -> f64 {
    (1.0 + ((area - field) / (field * step_share) - 1e-9).ceil()).max(1.0)
}

fn centre_along(area: f64, field: f64, index: usize, count: usize) -> f64 {
    if count == 1 {
        return area / 2.0;
    }
    field / 2.0 + (area - field) * index as f64 / (count - 1) as f64
}

/// Columns of a row in the order of travel.
fn serpent(row: usize, columns: usize) -> impl Iterator<Item = usize> {
    let forward: RangeInclusive<usize> = 0..=columns - 1;
    let backward = row % 2 == 1;
    forward.map(move |c| if backward { columns - 1 - c } else { c })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn overlaps_outside_the_range_name_the_value() {
        for percent in [0.0, 100.0, -5.0, 90.5, f64::NAN] {
            let error = serpentine([1.0, 1.0], [0.0, 0.0], [0.5, 0.5], percent).unwrap_err();
            let text = error.to_string();
            assert!(text.contains(&format!("{percent} %")), "{text}");
            assert!(text.contains("more than 0 % and at most 90 %"), "{text}");
        }
    }

    #[test]
    fn impossible_lengths_name_themselves() {
        let plan = |area, field| serpentine(area, [0.0, 0.0], field, 10.0).unwrap_err().to_string();
        assert!(plan([-1.0, 1.0], [0.5, 0.5]).contains("area width of -1 mm"));
        assert!(plan([1.0, f64::INFINITY], [0.5, 0.5]).contains("area height"));
        assert!(plan([1.0, 1.0], [0.5, 0.0]).contains("field height of 0 mm"));
        assert!(plan([1e9, 1e9], [1e-9, 1e-9]).contains("fields"));
        let origin = serpentine([1.0, 1.0], [f64::NAN, 0.0], [0.5, 0.5], 10.0);
        assert!(matches!(origin, Err(PlanError::Origin { .. })));
    }

    #[test]
    fn rows_alternate() {
        let plan = serpentine([2.0, 1.4], [10.0, 20.0], [1.0, 1.0], 20.0).unwrap();
        let order: Vec<_> = plan.iter().map(|f| (f.row, f.col)).collect();
        assert_eq!(order, [(0, 0), (0, 1), (0, 2), (1, 2), (1, 1), (1, 0)]);
        assert_eq!((plan[0].x_mm, plan[0].y_mm), (10.5, 20.5));
        assert_eq!((plan[2].x_mm, plan[3].y_mm), (11.5, 20.9));
    }

    proptest! {
        #[test]
        fn every_point_of_the_area_is_covered_and_neighbours_overlap(
            area in [0.01..20.0f64, 0.01..20.0f64],
            origin in [-50.0..50.0f64, -50.0..50.0f64],
            field in [0.3..3.0f64, 0.3..3.0f64],
            overlap in 0.1..90.0f64,
            at in [0.0..=1.0f64, 0.0..=1.0f64],
        ) {
            let plan = serpentine(area, origin, field, overlap).unwrap();
            let point = [origin[0] + at[0] * area[0], origin[1] + at[1] * area[1]];
            let inside = |f: &Field| {
                (f.x_mm - point[0]).abs() <= field[0] / 2.0 + 1e-9 && (f.y_mm - point[1]).abs() <= field[1] / 2.0 + 1e-9
            };
            prop_assert!(plan.iter().any(inside));
            let most = [0, 1].map(|k| field[k] * (1.0 - overlap / 100.0) + 1e-6);
            for pair in plan.windows(2) {
                let step = [(pair[1].x_mm - pair[0].x_mm).abs(), (pair[1].y_mm - pair[0].y_mm).abs()];
                prop_assert!(step[0] <= most[0] && step[1] <= most[1], "{step:?} of {most:?}");
                prop_assert!(step[0] < 1e-12 || step[1] < 1e-12, "one axis at a time");
            }
        }
    }
}
