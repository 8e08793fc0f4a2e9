//! Pieces walked as a tick would, and what their set-points may do.

use abbe_core::plan::Limits;
use abbe_core::plan::curve::Place;
use abbe_core::plan::pieces::Piece;
use abbe_core::plan::steps::Walker;

/// A stage's limits at 10 kHz, pm and ticks: 20 mm/s, 0.5 m/s², 20 m/s³.
#[allow(dead_code, reason = "some have a stage of their own")]
pub(crate) const STAGE: Limits = Limits { speed: 2e6, acceleration: 5000.0, jerk: 20.0 };

/// The set-points of all ticks and of a few beyond, pm.
#[allow(dead_code, reason = "not every test walks pieces")]
pub(crate) fn walked(pieces: &[Piece], ticks: f64) -> Vec<Place> {
    let (mut walkers, mut next) = ([Walker::default(); 2], 0);
    (0..=ticks.ceil() as u32 + 5)
        .map(|tick| {
            walkers.iter_mut().for_each(Walker::step);
            while let Some(piece) = pieces.get(next).filter(|piece| piece[0].first <= tick) {
                walkers.iter_mut().zip(piece).for_each(|(walker, leg)| walker.begin(leg));
                next += 1;
            }
            walkers.map(|walker| walker.position().pm() as f64)
        })
        .collect()
}

/// No axis is beyond a limit by any difference of its set-points.
pub(crate) fn assert_within(places: &[Place], axes: &[Limits; 2]) {
    for (axis, limits) in axes.iter().enumerate() {
        let mut values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        for (k, limit) in [limits.speed, limits.acceleration, limits.jerk].into_iter().enumerate() {
            values = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let worst = values.iter().fold(0.0, |worst: f64, value| worst.max(value.abs()));
            // Each position is rounded to a picometre.
            let most = limit * (1.0 + 1e-6) + f64::from(2 << k);
            assert!(worst <= most, "axis {axis}, difference {}: {worst} of {limit}", k + 1);
        }
    }
}
