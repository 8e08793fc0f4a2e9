//! The slow layers of a tissue section: everything wider than a few cells.
//!
//! They are worked out at the nodes of a coarse grid and blended in between, because a camera asks for ten points in
//! every such cell.

use super::lattice::{Lattice, Place, byte, ramp};

/// Pitch of the grid of nodes, µm.
const NODE_UM: f64 = 6.0;
/// Beyond this distance a gland is not felt, µm. Keeps the search for glands to four cells.
const FAR_UM: f32 = 24.0;
/// Glands closer to each other than this melt together, µm.
const MELT_UM: f32 = 10.0;
/// Pitch of the lattice of glands, µm.
const GLAND_PITCH_UM: f32 = 165.0;

/// What the slow layers say about a point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ground {
    /// From the point to where it would lie in an undisturbed section, µm.
    pub(super) shift_um: [f32; 2],
    /// How fatty, how inflamed the place is: each `0 ..= 1`.
    pub(super) fatty: f32,
    pub(super) inflamed: f32,
    /// Which of the two families of fibres rules: `0 ..= 1`.
    pub(super) weave: f32,
    /// A slow tint, −1 … 1.
    pub(super) tint: f32,
    pub(super) rim: Rim,
}

/// The edge of the nearest gland.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rim {
    /// Signed distance, µm: negative inside.
    pub(super) distance_um: f32,
    /// How the distance grows from here, µm per µm: at most 1.2 long, shorter where two glands meet.
    pub(super) outward: [f32; 2],
}

/// Draws the slow layers.
#[derive(Clone, Debug)]
pub(super) struct Terrain {
    nodes: Lattice,
    districts: Lattice,
    neighbourhoods: Lattice,
    waves: Lattice,
    glands: Lattice,
    directions: [[f32; 2]; 64],
}

/// The four nodes around the last point asked for.
#[derive(Clone, Debug, Default)]
pub(super) struct Survey {
    cell: Option<(i32, i32)>,
    corners: [Ground; 4],
}

impl Terrain {
    pub(super) fn new(seed: u64) -> Self {
        let lattice = |layer, pitch_um| Lattice::new(seed, layer, pitch_um);
        Self {
            nodes: lattice(0, NODE_UM),
            districts: lattice(1, 1500.0),
            neighbourhoods: lattice(2, 310.0),
            waves: lattice(3, 85.0),
            glands: lattice(4, f64::from(GLAND_PITCH_UM)),
            directions: core::array::from_fn(direction),
        }
    }

    /// The ground at a point; `survey` only saves time.
    pub(super) fn at(&self, x_um: f64, y_um: f64, survey: &mut Survey) -> Ground {
        let place = self.nodes.place(x_um, y_um);
        if survey.cell != Some((place.column, place.row)) {
            self.visit(&place, survey);
        }
        blend(&survey.corners, place.fx, place.fy)
    }

    /// Moves the survey to another cell; a step to the right keeps the nodes it shares.
    fn visit(&self, place: &Place, survey: &mut Survey) {
        let (column, row) = (place.column, place.row);
        let right = column.wrapping_add(1);
        let below = row.wrapping_add(1);
        let [_, top, _, bottom] = survey.corners;
        let (top, bottom) = if survey.cell == Some((column.wrapping_sub(1), row)) {
            (top, bottom)
        } else {
            (self.node(column, row), self.node(column, below))
        };
        survey.corners = [top, self.node(right, row), bottom, self.node(right, below)];
        survey.cell = Some((column, row));
    }

    fn node(&self, column: i32, row: i32) -> Ground {
        let (x, y) = (f64::from(column) * NODE_UM, f64::from(row) * NODE_UM);
        let (wave_x, wave_y) = self.waves.heights(x, y);
        // The large layers are turned against the camera's axes and bent, or their lattices would show.
        let (turned_x, turned_y) = (0.857 * x - 0.515 * y, 0.515 * x + 0.857 * y);
        let bend = |wave: f32| f64::from(45.0 * wave);
        let (near, near_2) = self.neighbourhoods.heights(turned_x + bend(wave_x), turned_y + bend(wave_y));
        let bend = |near: f32| f64::from(260.0 * near);
        let (district, district_2) = self.districts.heights(turned_x + bend(near_2), turned_y - bend(near));
        let shift_um = [20.0 * wave_x + 34.0 * near, 20.0 * wave_y + 34.0 * near_2];
        let glandular = ramp(-0.75, 0.10, district + 0.35 * near);
        Ground {
            shift_um,
            fatty: ramp(0.30, 0.75, district_2 + 0.4 * near_2 - 0.3 * district),
            inflamed: ramp(0.42, 0.92, near_2 - 0.4 * near + 0.3 * wave_x),
            weave: ramp(-0.15, 0.15, near + 0.5 * district_2),
            tint: 0.6 * district + 0.4 * near,
            rim: self.rim(x + f64::from(shift_um[0]), y + f64::from(shift_um[1]), glandular),
        }
    }

    fn rim(&self, x_um: f64, y_um: f64, growth: f32) -> Rim {
        if growth <= 0.0 {
            return Rim { distance_um: FAR_UM, outward: [0.0; 2] };
        }
        let at = self.glands.place(x_um, y_um).nearest_four();
        melt(&core::array::from_fn(|index| self.gland(&at, index & 1, index >> 1, growth)))
    }

    /// The gland of one cell of the lattice: an ellipse of radius 28 … 72 µm where fully grown.
    fn gland(&self, at: &Place, right: usize, below: usize, growth: f32) -> Rim {
        let bits = self.glands.bits(at.column.wrapping_add(right as i32), at.row.wrapping_add(below as i32));
        let centre_x = right as f32 + 0.25 + 0.5 * byte(bits, 0);
        let centre_y = below as f32 + 0.25 + 0.5 * byte(bits, 1);
        let (dx, dy) = ((at.fx - centre_x) * GLAND_PITCH_UM, (at.fy - centre_y) * GLAND_PITCH_UM);
        let [ux, uy] = self.directions[(bits >> 16) as usize & 63];
        let (along, across) = (0.8 * (dx * ux + dy * uy), 1.2 * (dy * ux - dx * uy));
        let reach = (along * along + across * across).sqrt();
        let radius = (26.0 + 46.0 * byte(bits, 3)) * growth;
        let per_reach = 1.0 / (reach + 1e-3);
        let (lengthwise, crosswise) = (0.8 * along, 1.2 * across);
        Rim {
            distance_um: reach - radius + 20.0 * (1.0 - growth),
            outward: [lengthwise * ux - crosswise * uy, lengthwise * uy + crosswise * ux]
                .map(|slope| slope * per_reach),
        }
    }
}

/// Joins up to four glands into one smooth outline.
fn melt(found: &[Rim; 4]) -> Rim {
    let nearest = found.iter().fold(FAR_UM, |least, rim| least.min(rim.distance_um));
    let mut weight = 0.0;
    let mut outward = [0.0; 2];
    for rim in found {
        let near = (1.0 - (rim.distance_um - nearest) * (1.0 / MELT_UM)).max(0.0);
        let felt = near * ((FAR_UM - rim.distance_um) * (1.0 / MELT_UM)).clamp(0.0, 1.0);
        weight += felt;
        outward[0] += felt * rim.outward[0];
        outward[1] += felt * rim.outward[1];
    }
    let share = 1.0 / f32::max(weight, 1.0);
    Rim {
        distance_um: nearest - 0.25 * MELT_UM * f32::max(weight - 1.0, 0.0),
        outward: [outward[0] * share, outward[1] * share],
    }
}

/// Blends four corners in proportion.
fn blend(corners: &[Ground; 4], fx: f32, fy: f32) -> Ground {
    let [a, b, c, d] = corners;
    let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
    let mix = |a: f32, b: f32, c: f32, d: f32| {
        (a * weights[0] + b * weights[1]) + (c * weights[2] + d * weights[3])
    };
    let pair = |a: [f32; 2], b: [f32; 2], c: [f32; 2], d: [f32; 2]| {
        [mix(a[0], b[0], c[0], d[0]), mix(a[1], b[1], c[1], d[1])]
    };
    Ground {
        shift_um: pair(a.shift_um, b.shift_um, c.shift_um, d.shift_um),
        fatty: mix(a.fatty, b.fatty, c.fatty, d.fatty),
        inflamed: mix(a.inflamed, b.inflamed, c.inflamed, d.inflamed),
        weave: mix(a.weave, b.weave, c.weave, d.weave),
        tint: mix(a.tint, b.tint, c.tint, d.tint),
        rim: Rim {
            distance_um: mix(a.rim.distance_um, b.rim.distance_um, c.rim.distance_um, d.rim.distance_um),
            outward: pair(a.rim.outward, b.rim.outward, c.rim.outward, d.rim.outward),
        },
    }
}

/// The `index`-th of 64 directions, evenly spread over half a turn: an ellipse has no head.
fn direction(index: usize) -> [f32; 2] {
    let angle = index as f64 * (core::f64::consts::PI / 64.0);
    [libm::cos(angle) as f32, libm::sin(angle) as f32]
}
