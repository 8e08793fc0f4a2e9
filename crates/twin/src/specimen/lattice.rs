//! Random structure on square lattices: each layer of a drawn specimen hangs on one.
//!
//! A lattice point is a hash of its two indices, so the plane needs no memory and has no edge. Only integer
//! arithmetic and + − × on floats are used: every machine draws the same plane.

/// A square lattice of random points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    per_um: f64,
    salt: u32,
}

/// A position seen from a lattice: the cell it lies in, and where in the cell (`0 ..= 1`).
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) column: i32,
    pub(super) row: i32,
    pub(super) fx: f32,
    pub(super) fy: f32,
}

impl Lattice {
    /// A lattice of `pitch_um` (> 0). Lattices of different `layer` or `seed` are independent.
    pub(super) fn new(seed: u64, layer: u64, pitch_um: f64) -> Self {
        Self { per_um: 1.0 / pitch_um, salt: (mix(seed ^ mix(layer)) >> 32) as u32 }
    }

    /// Where a position lies. Good to 2³¹ cells from the origin, which is kilometres.
    pub(super) fn place(&self, x_um: f64, y_um: f64) -> Place {
        let (column, fx) = split(x_um * self.per_um);
        let (row, fy) = split(y_um * self.per_um);
        Place { column, row, fx, fy }
    }

    /// 32 random bits of one lattice point.
    pub(super) fn bits(&self, column: i32, row: i32) -> u32 {
        let x = (column as u32 ^ self.salt).wrapping_mul(0x9E37_79B1);
        let y = (row as u32).wrapping_add(self.salt).wrapping_mul(0x85EB_CA77);
        let mut h = x ^ y.rotate_left(13);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h ^ (h >> 16)
    }

    /// Smooth noise in about `−1 ..= 1` (rms 0.24) without blocks: each lattice point carries a random slope.
    pub(super) fn slopes(&self, x_um: f64, y_um: f64) -> f32 {
        let place = self.place(x_um, y_um);
        let corner = |dx: i32, dy: i32| {
            let (gx, gy) = halves(self.bits(place.column.wrapping_add(dx), place.row.wrapping_add(dy)));
            gx * (place.fx - dx as f32) + gy * (place.fy - dy as f32)
        };
        place.blend(corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)) * 1.6
    }

    /// Two independent smooth noises in `−1 ..= 1` for the price of one: each lattice point carries two heights.
    pub(super) fn heights(&self, x_um: f64, y_um: f64) -> (f32, f32) {
        let place = self.place(x_um, y_um);
        let corner =
            |dx: i32, dy: i32| halves(self.bits(place.column.wrapping_add(dx), place.row.wrapping_add(dy)));
        let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
        (place.blend(a.0, b.0, c.0, d.0), place.blend(a.1, b.1, c.1, d.1))
    }
}

impl Place {
    /// Blends the values of the four corners with a smooth weight; no slope remains at the cell's edges.
    fn blend(&self, a: f32, b: f32, c: f32, d: f32) -> f32 {
        let (u, v) = (fade(self.fx), fade(self.fy));
        let top = a + u * (b - a);
        let bottom = c + u * (d - c);
        top + v * (bottom - top)
    }

    /// The lower left of the two-by-two cells nearest to the position, and the position from its corner, in cells.
    ///
    /// A thing that reaches less than half a cell out of its own cell is found in one of these four.
    pub(super) fn nearest_four(&self) -> Place {
        let (left, above) = (self.fx < 0.5, self.fy < 0.5);
        Place {
            column: self.column.wrapping_sub(i32::from(left)),
            row: self.row.wrapping_sub(i32::from(above)),
            fx: self.fx + if left { 1.0 } else { 0.0 },
            fy: self.fy + if above { 1.0 } else { 0.0 },
        }
    }
}

/// Whole cells and the rest, rounded down.
fn split(t: f64) -> (i32, f32) {
    let whole = t as i32;
    let whole = whole.wrapping_sub(i32::from(f64::from(whole) > t));
    (whole, (t - f64::from(whole)) as f32)
}

/// Two numbers in `−1 .. 1` from 32 bits.
fn halves(bits: u32) -> (f32, f32) {
    const UNIT: f32 = 1.0 / 32768.0;
    (f32::from((bits >> 16) as i16) * UNIT, f32::from(bits as i16) * UNIT)
}

/// 0 to 1 with level ends.
fn fade(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

/// 0 below `low`, 1 above `high` (> `low`), smooth between.
pub(super) fn ramp(low: f32, high: f32, value: f32) -> f32 {
    let t = ((value - low) * (1.0 / (high - low))).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Eight random bits as a number in `0 .. 1`.
pub(super) fn byte(bits: u32, index: u32) -> f32 {
    ((bits >> (8 * index)) & 0xFF) as f32 * (1.0 / 256.0)
}

/// The finalizer of `SplitMix64`: every input bit reaches every output bit.
pub(super) fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
