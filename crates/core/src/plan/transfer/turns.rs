//! Where the ways of a family turn.

/// The slope of the ways is zero where twice the speed of the peak is the negative product of both highest accelerations:
/// h₁ h₂, of which one has another sign where the acceleration does not fall through zero. Between the parameters where
/// one or both are cut off that is a quadratic in y².
///
/// Going backwards for longer leads less far, and what starts by slowing down has first to speed up again: there is at most
/// one longest way and then one shortest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turns {
    /// Where the start settles.
    pub(super) settled: f64,
    /// What the squares of both highest accelerations are beyond y².
    pub(super) before: f64,
    pub(super) apart: f64,
}

impl Turns {
    /// Of those whose acceleration falls through zero, between two parameters; in the order of the time taken.
    pub(super) fn through_zero(&self, least: f64, most: f64) -> [Option<f64>; 2] {
        let mut turns = [None; 2];
        for square in self.squares().into_iter().flatten() {
            let size = libm::sqrt(square);
            // Below zero one of the accelerations has the sign of the other.
            let y = if self.settled + square > 0.0 { -size } else { size };
            if y > least && y < most {
                add(&mut turns, y);
            }
        }
        turns
    }

    /// Of those whose acceleration stays above zero.
    pub(super) fn above(&self, most: f64) -> [Option<f64>; 2] {
        let mut turns = [None; 2];
        for square in self.squares().into_iter().flatten() {
            let size = libm::sqrt(square);
            if self.settled + square > 0.0 && size < most {
                add(&mut turns, -size);
            }
        }
        turns.map(|turn| turn.map(|size| -size))
    }

    /// y² at which the speed of the peak is half the product of the accelerations, or its negative.
    fn squares(&self) -> [Option<f64>; 6] {
        let (s, a, c) = (self.settled, self.before, self.apart);
        let (little, much) = (a.min(c), a.max(c));
        // None cut off, one, both.
        let [none, one] = [1.0 - much, 1.0 - little];
        let within = |low: f64, high: f64| move |z: &f64| *z >= low.max(0.0) && *z <= high;
        let [x0, x1] =
            roots(3.0, 4.0 * s - 0.5 * (a + c), 4.0 * s * s - a * c).map(|z| z.filter(within(0.0, none)));
        let [y0, y1] = roots(4.0, 4.0 * s - 0.5, 4.0 * s * s - little).map(|z| z.filter(within(none, one)));
        let [z0, z1] = [-0.5 - s, 0.5 - s].map(|z| Some(z).filter(within(one, f64::INFINITY)));
        [x0, x1, y0, y1, z0, z1]
    }
}

/// In order; a third is what rounding made of one at the edge of a range.
fn add(turns: &mut [Option<f64>; 2], y: f64) {
    *turns = match *turns {
        [None, _] => [Some(y), None],
        [Some(one), None] if y < one => [Some(y), Some(one)],
        [Some(one), None] => [Some(one), Some(y)],
        both => both,
    };
}

/// Of a z² + 2 b z + c, whose a is above zero.
fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let square = b * b - a * c;
    if square < 0.0 {
        return [None; 2];
    }
    let q = -(b + libm::copysign(libm::sqrt(square), b));
    [Some(q / a), (q != 0.0).then(|| c / q)]
}
