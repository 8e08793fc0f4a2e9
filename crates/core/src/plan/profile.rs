//! A jerk-limited point-to-point profile of seven phases, walked in exact integers.
//!
//! Time is cut into ticks and the jerk is one *unit*: acceleration, speed and way are then whole numbers of units,
//! sums of sums of ±1, with nothing to round. The way of the whole profile is `K = Tj (Tj + Ta)(2 Tj + Ta + Tv)` units
//! exactly, so the unit is chosen last, as way ÷ K, and the end is met to the last picometre.

/// Limits of a motion, picometres and ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Limits {
    /// Picometres a tick.
    pub speed: f64,
    /// Picometres a tick².
    pub acceleration: f64,
    /// Picometres a tick³.
    pub jerk: f64,
}

impl Limits {
    /// All of them are numbers above zero.
    pub fn are_numbers(&self) -> bool {
        [self.speed, self.acceleration, self.jerk].iter().all(|limit| limit.is_finite() && *limit > 0.0)
    }
}

/// The durations of the phases: jerk, constant acceleration, constant speed; in ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Profile {
    /// Each of the four phases with jerk.
    pub jerk_ticks: u32,
    /// Each of the two phases of constant acceleration.
    pub acceleration_ticks: u32,
    /// The phase of constant speed.
    pub cruise_ticks: u32,
}

impl Profile {
    /// The fastest profile over `way` picometres within `limits`, with each duration rounded up to whole ticks.
    ///
    /// Rounding up only lowers speed, acceleration and jerk. All arguments must be positive and finite.
    pub fn fastest(way: f64, limits: &Limits) -> Self {
        let (jerk, acceleration, cruise) = durations(way, limits);
        // 2²⁴ ticks are 28 minutes at 10 kHz: more than any move, and K still fits 64 bit for the long slow ones.
        let ticks = |t: f64| libm::ceil(t).clamp(0.0, 16_777_216.0) as u32;
        Self {
            jerk_ticks: ticks(jerk).clamp(1, 1 << 16),
            acceleration_ticks: ticks(acceleration).min(1 << 18),
            cruise_ticks: ticks(cruise),
        }
    }

    /// The way of the whole profile, units.
    pub fn way(&self) -> i64 {
        let (j, a, c) =
            (i64::from(self.jerk_ticks), i64::from(self.acceleration_ticks), i64::from(self.cruise_ticks));
        let speed = j.saturating_mul(j.saturating_add(a));
        speed.saturating_mul(j.saturating_mul(2).saturating_add(a).saturating_add(c))
    }

    /// Ticks from start to end.
    pub fn ticks(&self) -> u32 {
        let both =
            self.jerk_ticks.saturating_mul(4).saturating_add(self.acceleration_ticks.saturating_mul(2));
        both.saturating_add(self.cruise_ticks)
    }

    /// The walk after so many ticks, in one step. Not for the tick: multiplies.
    pub fn walk(&self, ticks: u32) -> Walk {
        let mut walk = Walk::default();
        let mut left = ticks;
        while let Some((length, jerk)) = self.phase(walk.phase) {
            walk.ticks = left.min(length);
            walk.add(i64::from(walk.ticks), jerk);
            left = left.saturating_sub(length);
            if left == 0 {
                break;
            }
            walk.phase = walk.phase.saturating_add(1);
        }
        walk
    }

    /// Length in ticks and jerk in units of phase 0…6; `None` past the end.
    const fn phase(&self, number: u8) -> Option<(u32, i64)> {
        match number {
            0 | 6 => Some((self.jerk_ticks, 1)),
            1 | 5 => Some((self.acceleration_ticks, 0)),
            2 | 4 => Some((self.jerk_ticks, -1)),
            3 => Some((self.cruise_ticks, 0)),
            _ => None,
        }
    }
}

/// Durations in ticks, not yet whole, of jerk, constant acceleration and constant speed from rest to rest: the textbook
/// cases of the seven-phase profile.
pub(super) fn durations(way: f64, limits: &Limits) -> (f64, f64, f64) {
    let Limits { speed: v, acceleration: a, jerk: j } = *limits;
    // Reaching full speed, with or without a phase of constant acceleration.
    let (tj, ta) = if v * j < a * a { (libm::sqrt(v / j), 0.0) } else { (a / j, v / a - a / j) };
    let cruise = way / v - (2.0 * tj + ta);
    if cruise >= 0.0 {
        return (tj, ta, cruise);
    }
    // Full speed is not reached: the way is J·Tj (Tj + Ta)(2 Tj + Ta), a quadratic in Ta at full acceleration.
    let tj = a / j;
    let ta = 0.5 * (libm::sqrt(tj * tj + 4.0 * way / a) - 3.0 * tj);
    if ta >= 0.0 && v * j >= a * a {
        return (tj, ta, 0.0);
    }
    // Nor is full acceleration.
    (libm::cbrt(way / (2.0 * j)), 0.0, 0.0)
}

/// A profile being walked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Walk {
    phase: u8,
    ticks: u32,
    /// Units a tick².
    pub acceleration: i64,
    /// Units a tick.
    pub speed: i64,
    /// Units.
    pub way: i64,
}

impl Walk {
    /// One tick; returns false once the end was reached before.
    #[inline]
    pub fn tick(&mut self, profile: &Profile) -> bool {
        let Some(jerk) = self.jerk(profile) else {
            return false;
        };
        // None of them wraps: the way of the whole profile fits 63 bits, and on the way nothing is larger.
        self.acceleration = self.acceleration.wrapping_add(jerk);
        self.speed = self.speed.wrapping_add(self.acceleration);
        self.way = self.way.wrapping_add(self.speed);
        true
    }

    /// So many ticks of a jerk at once: sums of 1, 1 + 2 + …, and of those.
    fn add(&mut self, n: i64, jerk: i64) {
        let pairs = n.saturating_mul(n.saturating_add(1)) / 2;
        // Does not fit for long phases, which have no jerk.
        let triples = pairs.saturating_mul(n.saturating_add(2)) / 3;
        let way = [
            self.speed.saturating_mul(n),
            self.acceleration.saturating_mul(pairs),
            jerk.saturating_mul(triples),
        ];
        self.way = way.into_iter().fold(self.way, i64::saturating_add);
        let speed = self.acceleration.saturating_mul(n).saturating_add(jerk.saturating_mul(pairs));
        self.speed = self.speed.saturating_add(speed);
        self.acceleration = self.acceleration.saturating_add(jerk.saturating_mul(n));
    }

    /// The jerk of the phase it is in, units.
    pub fn jerk_now(&self, profile: &Profile) -> i64 {
        profile.phase(self.phase).map_or(0, |(_, jerk)| jerk)
    }

    /// Ticks gone.
    pub fn gone(&self, profile: &Profile) -> u32 {
        let before = (0..self.phase).filter_map(|number| profile.phase(number));
        before.fold(self.ticks, |ticks, (length, _)| ticks.saturating_add(length))
    }

    fn jerk(&mut self, profile: &Profile) -> Option<i64> {
        loop {
            let (length, jerk) = profile.phase(self.phase)?;
            if self.ticks < length {
                self.ticks = self.ticks.saturating_add(1);
                return Some(jerk);
            }
            self.phase = self.phase.saturating_add(1);
            self.ticks = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn walk(profile: &Profile) -> Vec<Walk> {
        let mut state = Walk::default();
        let mut states = Vec::new();
        while state.tick(profile) {
            states.push(state);
        }
        states
    }

    proptest! {
        #[test]
        fn the_walk_ends_on_the_closed_form_and_keeps_the_limits(
            way_exponent in 0.0f64..11.2,
            speed in 1e3f64..3e6,
            acceleration in 10.0f64..2e4,
            jerk in 0.5f64..200.0,
        ) {
            let way = 10f64.powf(way_exponent);
            let limits = Limits { speed, acceleration, jerk };
            let profile = Profile::fastest(way, &limits);
            prop_assume!(profile.ticks() < 200_000);
            let states = walk(&profile);
            for (ticks, state) in (1..).zip(&states).step_by(97).chain((1..).zip(&states).last()) {
                let at_once = profile.walk(ticks);
                let sums = |walk: &Walk| (walk.acceleration, walk.speed, walk.way, walk.gone(&profile));
                prop_assert_eq!(sums(&at_once), sums(state));
                prop_assert_eq!(state.gone(&profile), ticks);
            }
            let end = states.last().copied().unwrap_or_default();
            prop_assert_eq!(end.way, profile.way());
            prop_assert_eq!((end.speed, end.acceleration), (0, 0));
            prop_assert_eq!(states.len(), profile.ticks() as usize);
            let unit = way / profile.way() as f64;
            let (v, a) = states.iter().fold((0, 0), |(v, a), s| (v.max(s.speed), a.max(s.acceleration.abs())));
            let slack = 1.0 + 1e-9;
            prop_assert!(v as f64 * unit <= speed * slack);
            prop_assert!(a as f64 * unit <= acceleration * slack);
            prop_assert!(unit <= jerk * slack);
        }
    }

    #[test]
    fn is_within_a_few_ticks_of_the_time_optimum() {
        // Paper A's stage: 20 mm/s, 500 mm/s², 20 000 mm/s³ at 10 kHz; 10 mm take 0.5 + 0.04 + 0.025 s.
        let limits = Limits { speed: 2e6, acceleration: 5000.0, jerk: 20.0 };
        let ticks = Profile::fastest(10e9, &limits).ticks();
        assert!((5650..=5658).contains(&ticks), "{ticks}");
    }
}
