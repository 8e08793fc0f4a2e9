//! Where a function is zero.

/// An argument and the function there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) x: f64,
    pub(super) f: f64,
}

impl Point {
    pub(super) fn of(x: f64, f: impl Fn(f64) -> f64) -> Self {
        Self { x, f: f(x) }
    }
}

/// Most steps of a search: more than a bisection needs for 53 bits, unless the root is all but zero.
const STEPS: usize = 200;

/// What is left of the function, part of the smaller of both values between which the search begins.
const ROUNDED: f64 = 1e-15;

/// Where a function is zero between two points, which may be one of them; the second if it has the same sign at both.
///
/// Chandrupatla, Advances in Engineering Software 28 (1997) 145: inverse quadratic interpolation where it is sure to help,
/// bisection elsewhere.
pub(super) fn root(from: Point, to: Point, f: impl Fn(f64) -> f64) -> f64 {
    if from.f == 0.0 {
        return from.x;
    }
    if (from.f > 0.0) == (to.f > 0.0) || to.f == 0.0 {
        return to.x;
    }
    let little = ROUNDED * from.f.abs().min(to.f.abs());
    let (mut near, mut far) = (to, from);
    let mut part = 0.5;
    for _ in 0..STEPS {
        let at = Point::of(near.x + part * (far.x - near.x), &f);
        let third = if (at.f > 0.0) == (near.f > 0.0) { near } else { core::mem::replace(&mut far, near) };
        near = at;
        let best = if near.f.abs() < far.f.abs() { near } else { far };
        let least = 2.0 * f64::EPSILON * best.x.abs() / (far.x - near.x).abs();
        if best.f.abs() <= little || least >= 0.5 || near.x == far.x {
            return best.x;
        }
        // Not `clamp`, which can panic.
        part = step(near, far, third).max(least).min(1.0 - least);
    }
    near.x
}

/// The highest argument, up to a top, at which nothing is left over that must not be below zero: less is left the higher it
/// is. Zero if nothing is left there.
pub(super) fn highest(top: f64, left: impl Fn(f64) -> f64) -> f64 {
    let lowest = Point::of(0.0, &left);
    if lowest.f > 0.0 { root(lowest, Point::of(top, &left), left) } else { 0.0 }
}

/// Where to look next between two points, 0 … 1.
fn step(near: Point, far: Point, third: Point) -> f64 {
    let xi = (near.x - far.x) / (third.x - far.x);
    let phi = (near.f - far.f) / (third.f - far.f);
    if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
        near.f / (far.f - near.f) * third.f / (far.f - third.f)
            + (third.x - near.x) / (far.x - near.x) * near.f / (third.f - near.f) * far.f / (third.f - far.f)
    } else {
        0.5
    }
}

/// A function and its slope somewhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    pub(super) f: f64,
    pub(super) slope: f64,
}

/// A step of Newton so small, part of the argument, is the last: the next would be as small as its square.
const LAST_STEP: f64 = 1e-9;

/// The same as [`root`] of a function whose slope is known: Newton's steps where they stay between and soon get smaller,
/// bisection elsewhere.
pub(super) fn root_by_slope(from: Point, to: Point, f: impl Fn(f64) -> Slope) -> f64 {
    if from.f == 0.0 {
        return from.x;
    }
    if (from.f > 0.0) == (to.f > 0.0) || to.f == 0.0 {
        return to.x;
    }
    let little = ROUNDED * from.f.abs().min(to.f.abs());
    let (mut near, mut far) = (from.x, to.x);
    let chord = near + (far - near) * (from.f / (from.f - to.f));
    let mut x = if chord.is_finite() { chord } else { near + 0.5 * (far - near) };
    let mut last = (far - near).abs();
    for _ in 0..STEPS {
        let Slope { f, slope } = f(x);
        if (f > 0.0) == (from.f > 0.0) {
            near = x;
        } else {
            far = x;
        }
        let newton = x - f / slope;
        let step = (newton - x).abs();
        if f.abs() <= little || near == far {
            return x;
        }
        let between = newton > near.min(far) && newton < near.max(far);
        if step <= LAST_STEP * x.abs() {
            return if between { newton } else { x };
        }
        let next = if between && step <= 0.5 * last { newton } else { near + 0.5 * (far - near) };
        last = (next - x).abs();
        if next == x {
            return x;
        }
        x = next;
    }
    x
}
