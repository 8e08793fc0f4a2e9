//! Registered places against places that are known to be true.

use serde::Serialize;

use crate::tiles::Placed;

/// How registered places differ from true ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Tiles compared.
    pub tiles: usize,
    /// Root mean square distance after the mean offset is removed, px.
    pub rms_px: f64,
    /// Largest distance after the mean offset is removed, px.
    pub worst_px: f64,
    /// Root mean square distance after the best shift, angle and scale are removed, px: for truth in another frame,
    /// such as that of the stage.
    pub aligned_rms_px: f64,
    /// Scale of the registered places over the true ones.
    pub scale: f64,
    /// Angle of the registered places against the true ones, x towards y, degrees.
    pub angle_deg: f64,
}

/// A registered tile whose true place is unknown, or the other way round.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("tile `{0}` is in only one of the two lists")]
pub struct UnknownTile(pub String);

/// Compares by file name; the order does not matter.
///
/// # Errors
/// [`UnknownTile`] if the two lists do not name the same tiles.
pub fn compare(registered: &[Placed], truth: &[Placed]) -> Result<Comparison, UnknownTile> {
    if let Some(odd) = truth.iter().find(|t| !registered.iter().any(|r| r.file == t.file)) {
        return Err(UnknownTile(odd.file.clone()));
    }
    let mut both = Vec::with_capacity(registered.len());
    for tile in registered {
        let known = truth.iter().find(|t| t.file == tile.file);
        both.push((tile.place_px, known.ok_or_else(|| UnknownTile(tile.file.clone()))?.place_px));
    }
    Ok(from_places(&both))
}

fn from_places(both: &[([f64; 2], [f64; 2])]) -> Comparison {
    let n = both.len().max(1) as f64;
    let sum = both.iter().fold([[0.0; 2]; 2], |s, (r, t)| [plus(s[0], *r), plus(s[1], *t)]);
    let [mean_r, mean_t] = sum.map(|total| total.map(|v| v / n));
    let centred: Vec<_> = both.iter().map(|(r, t)| (minus(*r, mean_r), minus(*t, mean_t))).collect();
    let [re, im] = similarity(&centred);
    let distance = |[x, y]: [f64; 2]| x.hypot(y);
    let plain: Vec<f64> = centred.iter().map(|(r, t)| distance(minus(*r, *t))).collect();
    let turned = |t: [f64; 2]| [re * t[0] - im * t[1], im * t[0] + re * t[1]];
    let aligned = centred.iter().map(|(r, t)| distance(minus(*r, turned(*t))).powi(2));
    Comparison {
        tiles: both.len(),
        rms_px: (plain.iter().map(|d| d * d).sum::<f64>() / n).sqrt(),
        worst_px: plain.iter().copied().fold(0.0, f64::max),
        aligned_rms_px: (aligned.sum::<f64>() / n).sqrt(),
        scale: re.hypot(im),
        angle_deg: im.atan2(re).to_degrees(),
    }
}

fn plus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// The complex factor that turns and scales the second places of centred pairs best onto the first ones.
fn similarity(centred: &[([f64; 2], [f64; 2])]) -> [f64; 2] {
    let spread: f64 = centred.iter().map(|(_, t)| t[0] * t[0] + t[1] * t[1]).sum();
    if spread <= 0.0 {
        return [1.0, 0.0];
    }
    let re: f64 = centred.iter().map(|(r, t)| r[0] * t[0] + r[1] * t[1]).sum();
    let im: f64 = centred.iter().map(|(r, t)| r[1] * t[0] - r[0] * t[1]).sum();
    [re / spread, im / spread]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(places: &[[f64; 2]]) -> Vec<Placed> {
        places.iter().enumerate().map(|(i, &place_px)| Placed { file: format!("{i}"), place_px }).collect()
    }

    #[test]
    fn offset_angle_and_scale_are_told_apart() {
        let truth = [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0], [100.0, 100.0]];
        let shifted = truth.map(|[x, y]| [x + 7.0, y - 3.0]);
        let same = compare(&placed(&shifted), &placed(&truth)).unwrap();
        assert!(same.rms_px < 1e-9 && same.worst_px < 1e-9);
        let (s, c) = 0.3_f64.to_radians().sin_cos();
        let turned = truth.map(|[x, y]| [1.002 * (c * x - s * y), 1.002 * (s * x + c * y)]);
        let other = compare(&placed(&turned), &placed(&truth)).unwrap();
        assert!(other.rms_px > 0.3 && other.aligned_rms_px < 1e-9);
        assert!((other.scale - 1.002).abs() < 1e-9 && (other.angle_deg - 0.3).abs() < 1e-9);
    }

    #[test]
    fn a_tile_in_only_one_list_is_named() {
        let (two, three) = (placed(&[[0.0; 2]; 2]), placed(&[[0.0; 2]; 3]));
        assert_eq!(compare(&three, &two), Err(UnknownTile("2".into())));
        assert_eq!(compare(&two, &three), Err(UnknownTile("2".into())));
    }
}
