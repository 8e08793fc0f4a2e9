//! A program walked tick by tick.

use abbe_core::Pos;
use abbe_core::plan::Limits;
use abbe_core::plan::curve::Place;
use abbe_core::plan::program::Program;
use abbe_core::plan::segment::Segment;
use abbe_core::plan::steps::Walker;
use abbe_core::plan::transfer::State;

/// The set-points of all ticks from the first that moves on.
pub(crate) struct Walk {
    /// Rounded to a picometre, as the servo gets them.
    pub(crate) places: Vec<Place>,
    /// The same with the part of a picometre that a tick knows, and what happens until the next.
    pub(crate) exact: Vec<[(State, f64); 2]>,
    /// The place of tick 0 of the program among them.
    pub(crate) begins: usize,
}

/// Tick from which the program counts.
const ORIGIN: u32 = 10;

impl Walk {
    /// From rest at a place to rest at the end of the last segment.
    pub(crate) fn of(from: [Pos; 2], axes: [Limits; 2], segments: &[Segment]) -> Self {
        let mut program = Program::new(from, axes, 1.0, ORIGIN);
        let mut coming = segments.iter();
        let mut walkers = [Walker::default(); 2];
        let (mut walk, mut waits, mut began) =
            (Self { places: Vec::new(), exact: Vec::new(), begins: 0 }, None, false);
        for tick in ORIGIN - 1.. {
            while program.has_room()
                && let Some(segment) = coming.next()
            {
                program.take(segment).expect("it is a segment");
            }
            if waits.is_none() {
                waits = program.span(tick - 1).expect("it can be planned");
            }
            if began && waits.is_none() && program.is_done() {
                break;
            }
            let due = waits.filter(|span| span.first == tick);
            if let Some(span) = due {
                walkers
                    .iter_mut()
                    .zip(span.legs.into_iter().flatten())
                    .for_each(|(walker, leg)| walker.begin(&leg));
                waits = None;
                began = true;
            } else if began {
                walkers.iter_mut().for_each(Walker::step);
            }
            if began {
                walk.places.push(walkers.map(|walker| walker.position().pm() as f64));
                walk.exact.push(walkers.map(|walker| walker.state()));
            }
        }
        walk
    }

    /// The largest of all differences, part of its limit; each set-point is rounded to a picometre, which is allowed for.
    pub(crate) fn largest(&self, limits: &Limits) -> f64 {
        let mut largest = 0.0_f64;
        for axis in 0..2 {
            let mut values: Vec<f64> = self.places.iter().map(|place| place[axis]).collect();
            for (order, limit) in [limits.speed, limits.acceleration, limits.jerk].into_iter().enumerate() {
                values = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
                let most = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
                largest = largest.max((most - f64::from(1 << order)) / limit);
            }
        }
        largest
    }

    /// The least of something over the whole path, between ticks, too.
    pub(crate) fn between(&self, of: impl Fn(Place) -> f64) -> f64 {
        let mut least = f64::INFINITY;
        for axes in &self.exact {
            for part in 0..16 {
                let part = f64::from(part) / 16.0;
                least = least.min(of(axes.map(|(state, jerk)| state.after(part, jerk).position)));
            }
        }
        least
    }
}
