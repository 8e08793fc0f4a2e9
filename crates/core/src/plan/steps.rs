//! A planned motion tick by tick, in integers: sums of sums of sums.
//!
//! Within a phase the position is a cubic of time, so its third differences are constant, and a tick needs three additions.
//! Phases begin between ticks: each is laid out from the first tick inside it ([`Leg`]), by floats, before the motion
//! begins, and starts afresh from there, so that what was rounded in one does not reach the next. Set-points are those of
//! the exact motion to a picometre for 2²⁵ ticks at one speed (an hour at 10 kHz), and to four for as long as they may last.
//! Their differences are means of the motion's speed, acceleration and jerk: none is beyond a limit but for what rounding to
//! a picometre makes of a difference, eight of a third. What feeds forward comes from the finer sums.

use super::transfer::{Phase, State, Transfer};
use crate::units::Pos;

/// Fractional bits of position, speed, acceleration and jerk. A position takes 39 bits, a speed 25; the others have as many
/// more fractional bits as their errors have ticks to add up.
const BITS: [u32; 4] = [24, 38, 46, 50];

/// What the set-point is doing in a tick: for feed-forward, too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SetPoint {
    /// Where it is.
    pub position: Pos,
    /// pm a tick, 2⁻³⁸.
    pub speed: i64,
    /// pm a tick², 2⁻⁴⁶.
    pub acceleration: i64,
    /// pm a tick³, 2⁻⁵⁰.
    pub jerk: i64,
}

/// A cubic of time, from its first tick on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Leg {
    /// Ticks from the start of the motion.
    pub first: u32,
    /// Position there and its first, second and third difference, pm with 24, 38, 46 and 50 fractional bits.
    pub differences: [i64; 4],
}

/// A motion laid out in ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Steps {
    /// Seven phases, and what comes after.
    legs: [Leg; 8],
}

/// Longest motion: 3.7 hours at 10 kHz.
pub(super) const LONGEST: f64 = 134_217_728.0;

impl Steps {
    /// Lays a motion out from tick 0, at which it is where it begins. None if it lasts longer than 2²⁷ ticks, or is somewhere
    /// beyond what fits: 549 mm, 33 µm a tick, 131 nm a tick², 8 nm a tick³.
    ///
    /// At its end it is exactly there, or goes on from there at the speed of the end.
    pub fn of(transfer: &Transfer) -> Option<Self> {
        Self::beginning(transfer, 0.0)
    }

    /// The same of a motion that begins later, ticks.
    pub fn beginning(transfer: &Transfer, begins: f64) -> Option<Self> {
        let mut legs = [Leg::default(); 8];
        let mut time = begins;
        for ((leg, phase), state) in legs.iter_mut().zip(transfer.phases()).zip(beginnings(transfer)) {
            *leg = lay_out(time, state, phase)?;
            time += phase.ticks;
        }
        let end = State { acceleration: 0.0, ..transfer.end() };
        *legs.last_mut()? = lay_out(time, end, &Phase::default())?;
        Some(Self { legs })
    }

    /// Its legs; the last is its end.
    pub const fn legs(&self) -> &[Leg; 8] {
        &self.legs
    }

    /// Ticks until it is at its end.
    pub fn ticks(&self) -> u32 {
        let [.., last] = self.legs;
        last.first
    }
}

/// The states in which the phases begin: of the first half summed up from the start, of the second back from the end, so that
/// nothing that was rounded adds up; at constant speed without what it left of an acceleration.
fn beginnings(transfer: &Transfer) -> [State; 7] {
    let [a, b, c, cruise, e, f, g] = *transfer.phases();
    let after = |state: State, phase: Phase| state.after(phase.ticks, phase.jerk);
    let before = |state: State, phase: Phase| state.after(-phase.ticks, phase.jerk);
    let first = transfer.start();
    let second = after(first, a);
    let third = after(second, b);
    let seventh = before(transfer.end(), g);
    let sixth = before(seventh, f);
    let fifth = before(sixth, e);
    let mut fourth = after(third, c);
    // A shorter one does not carry on what was rounded, and its mean speed would be nothing else.
    if cruise.ticks >= 1.0 {
        let speed = (fifth.position - fourth.position) / cruise.ticks;
        fourth = State { speed, acceleration: 0.0, ..fourth };
    }
    [first, second, third, fourth, fifth, sixth, seventh]
}

/// Whether all of a phase fits, not only its ends.
fn within(from: State, phase: &Phase) -> bool {
    let State { speed, acceleration, .. } = from;
    let Phase { ticks, jerk } = *phase;
    // Where the speed turns, and where the position does.
    let fastest = -acceleration / jerk;
    let spread = libm::sqrt(acceleration * acceleration - 2.0 * jerk * speed) / jerk;
    let farthest =
        if jerk == 0.0 { [-speed / acceleration; 2] } else { [fastest - spread, fastest + spread] };
    let [before, behind] = farthest;
    [0.0, ticks, fastest, before, behind].into_iter().filter(|time| (0.0..=ticks).contains(time)).all(
        |time| {
            let State { position, speed, acceleration } = from.after(time, jerk);
            let numbers = [position, speed, acceleration, jerk];
            numbers.into_iter().zip(BITS).all(|(number, bits)| fixed_point(number, bits).is_some())
        },
    )
}

/// A phase that begins with a state at a time, ticks: from the first tick at or after it. None if any of it does not fit.
pub(super) fn lay_out(begins: f64, state: State, phase: &Phase) -> Option<Leg> {
    let (first, jerk) = (libm::ceil(begins), phase.jerk);
    if !(0.0..=LONGEST).contains(&first) || !within(state, phase) {
        return None;
    }
    let State { position, speed, acceleration } = state.after(first - begins, jerk);
    let differences = [position, speed + acceleration / 2.0 + jerk / 6.0, acceleration + jerk, jerk];
    let mut leg = Leg { first: first as u32, differences: [0; 4] };
    for ((fixed, number), bits) in leg.differences.iter_mut().zip(differences).zip(BITS) {
        *fixed = fixed_point(number, bits)?;
    }
    Some(leg)
}

/// A number with so many fractional bits; none if it does not fit 63 bits and a sign.
fn fixed_point(number: f64, bits: u32) -> Option<i64> {
    let scaled = libm::round(libm::ldexp(number, bits.cast_signed()));
    (scaled.abs() < 9_223_372_036_854_775_808.0).then_some(scaled as i64)
}

/// Where an axis is within a leg.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Walker {
    differences: [i64; 4],
}

impl Walker {
    /// One at the first tick of a leg.
    #[inline]
    pub const fn at(leg: &Leg) -> Self {
        Self { differences: leg.differences }
    }

    /// At the first tick of a leg.
    #[inline]
    pub fn begin(&mut self, leg: &Leg) {
        self.differences = leg.differences;
    }

    /// A tick on.
    #[inline]
    pub fn step(&mut self) {
        let [position, speed, acceleration, jerk] = &mut self.differences;
        // Rounded: a shift alone would lose half a bit each time, and always to the same side.
        *position = position.wrapping_add(speed.wrapping_add(1 << 13) >> 14);
        *speed = speed.wrapping_add(acceleration.wrapping_add(1 << 7) >> 8);
        *acceleration = acceleration.wrapping_add(jerk.wrapping_add(1 << 3) >> 4);
    }

    /// Where it is: rounded to a picometre.
    #[inline]
    pub fn position(&self) -> Pos {
        let [position, ..] = self.differences;
        Pos::from_pm(position.wrapping_add(1 << 23) >> 24)
    }

    /// The same as a state; what it has of picometres is exact to 2⁻¹⁶ within a metre. For planning, not for the tick.
    pub fn state(&self) -> (State, f64) {
        let [position, speed, acceleration, jerk] = [0, 1, 2, 3].map(|k| self.difference(k));
        let now = acceleration - jerk;
        (State { position, speed: speed - now / 2.0 - jerk / 6.0, acceleration: now }, jerk)
    }

    fn difference(&self, number: usize) -> f64 {
        let fixed = self.differences.get(number).copied().unwrap_or(0);
        let bits = BITS.get(number).copied().unwrap_or(0);
        libm::ldexp(fixed as f64, -bits.cast_signed())
    }

    /// All of it.
    pub fn set_point(&self) -> SetPoint {
        let [_, speed, acceleration, jerk] = self.differences;
        // Differences are those to the next tick.
        let (a, j) = (acceleration >> 8, jerk >> 12);
        SetPoint {
            position: self.position(),
            speed: speed.wrapping_sub(a >> 1).wrapping_add(third(j)),
            acceleration: acceleration.wrapping_sub(jerk >> 4),
            jerk,
        }
    }
}

/// A third, to 2⁻³² of it: a processor without a divider takes hundreds of cycles for it.
#[inline]
const fn third(number: i64) -> i64 {
    const THIRD: i64 = 0x5555_5555;
    (number >> 32).wrapping_mul(THIRD).wrapping_add((number & 0xffff_ffff).wrapping_mul(THIRD) >> 32)
}

/// Where a motion is being walked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stride {
    tick: u32,
    /// Number of the next leg.
    next: u8,
    walker: Walker,
}

impl Stride {
    /// The next tick; the first is tick 0.
    #[inline]
    pub fn tick(&mut self, steps: &Steps) {
        if self.next > 0 {
            self.walker.step();
            self.tick = self.tick.wrapping_add(1);
        }
        // A phase may begin and end between two ticks: then it has none.
        while let Some(leg) = steps.legs.get(usize::from(self.next)).filter(|leg| leg.first <= self.tick) {
            self.walker.begin(leg);
            self.next = self.next.wrapping_add(1);
        }
    }

    /// Whether it has come to the end.
    #[inline]
    pub fn is_at_end(&self) -> bool {
        self.next == 8
    }

    /// Where it is: rounded to a picometre.
    #[inline]
    pub fn position(&self) -> Pos {
        self.walker.position()
    }

    /// All of it.
    pub fn set_point(&self) -> SetPoint {
        self.walker.set_point()
    }
}
