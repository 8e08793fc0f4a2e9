//! A stained tissue section, drawn from a seed, without an edge.
//!
//! Layers, from the largest to the smallest: districts (1.5 mm), neighbourhoods (0.3 mm), glands (0.16 mm) or fat
//! (60 µm holes), fibres (5 µm), nuclei (6 µm), grain (2 to 4 µm). Nothing is finer than about 1.2 µm, so a camera of
//! 0.5 µm a pixel samples it honestly. The stains are those of every textbook picture: haematoxylin (blue, nuclei)
//! and eosin (pink, the rest); light is lost in them as in two dyes, not mixed as in paint.

use super::Specimen;
use super::ground::{Ground, Survey, Terrain};
use super::lattice::{Lattice, Place, byte, ramp};

/// Thickness of the layer of cells that lines a gland, µm.
const LINING_UM: f32 = 24.0;
/// Pitch of the lattice of fat cells, µm, and the radius at which a fat cell is round.
const FAT_PITCH_UM: f32 = 62.0;
const FAT_RADIUS_UM: f32 = 37.0;
/// Pitch of the lattice of nuclei, µm; no nucleus reaches further than `NUCLEUS_REACH_UM`.
const NUCLEUS_PITCH_UM: f32 = 9.8;
const NUCLEUS_REACH_UM: f32 = 6.36;
/// Half of the softness of every edge, µm.
const SOFT_UM: f32 = 0.65;
/// What clean glass lets through: it never quite reaches 1.
const GLASS: [f32; 3] = [0.955, 0.95, 0.96];
/// Loss of light (natural logarithm) in one unit of each dye, red, green, blue.
const HAEMATOXYLIN: [f32; 3] = [1.05, 1.22, 0.58];
const EOSIN: [f32; 3] = [0.13, 0.62, 0.33];

/// A tissue section without an edge; the same seed draws the same section on every machine.
#[derive(Clone, Debug)]
pub struct Tissue {
    terrain: Terrain,
    fat: Lattice,
    fibres: [Lattice; 2],
    nuclei: Lattice,
    grain: Lattice,
    chromatin: Lattice,
}

/// How much of each dye a point holds.
#[derive(Clone, Copy, Debug, Default)]
struct Dyes {
    haematoxylin: f32,
    eosin: f32,
}

/// Nuclei over a point: how much of it they cover, and how near to their own rim, both `0 ..= 1`.
#[derive(Clone, Copy, Debug, Default)]
struct Cover {
    nucleus: f32,
    membrane: f32,
}

impl Tissue {
    /// The section of this seed.
    pub fn new(seed: u64) -> Self {
        let lattice = |layer, pitch_um| Lattice::new(seed, layer, pitch_um);
        Self {
            terrain: Terrain::new(seed),
            fat: lattice(5, f64::from(FAT_PITCH_UM)),
            fibres: [lattice(6, 1.0), lattice(7, 1.0)],
            nuclei: lattice(8, f64::from(NUCLEUS_PITCH_UM)),
            grain: lattice(9, 3.7),
            chromatin: lattice(10, 2.1),
        }
    }

    fn colour(&self, x_um: f64, y_um: f64, survey: &mut Survey) -> [f32; 3] {
        let ground = self.terrain.at(x_um, y_um, survey);
        let flat_x = x_um + f64::from(ground.shift_um[0]);
        let flat_y = y_um + f64::from(ground.shift_um[1]);
        let hole = self.fat_hole(flat_x, flat_y, ground.fatty);
        if hole >= 1.0 {
            return GLASS;
        }
        let (grain, grain_2) = self.grain.heights(x_um, y_um);
        let mut dyes = self.tissue(flat_x, flat_y, &ground, [grain, grain_2]);
        let rough = [x_um + f64::from(0.7 * grain), y_um + f64::from(0.7 * grain_2)];
        let cover = self.cover(rough, &ground);
        if cover.nucleus > 0.0 {
            let chromatin = self.chromatin.slopes(x_um, y_um);
            let dark = 0.88 + 0.42 * chromatin + 0.22 * cover.membrane + 0.12 * ground.inflamed;
            dyes = dyes.scaled(1.0 - 0.75 * cover.nucleus);
            dyes.add(Dyes { haematoxylin: dark, eosin: 0.25 }, cover.nucleus);
        }
        dyes.scaled(1.0 - hole).light()
    }

    /// Loss of tissue to fat cells: 0 whole tissue, 1 an empty hole. Holes shrink as fat gives way to fibres.
    fn fat_hole(&self, flat_x: f64, flat_y: f64, fatty: f32) -> f32 {
        if fatty <= 0.0 {
            return 0.0;
        }
        let wall_um = 1.4 + 34.0 * (1.0 - fatty);
        let (first, second) = self.two_nearest_fat(&self.fat.place(flat_x, flat_y));
        let to_wall = 0.5 * (second - first) * FAT_PITCH_UM - wall_um;
        let to_circle = FAT_RADIUS_UM - first * FAT_PITCH_UM;
        ramp(-SOFT_UM, SOFT_UM + 0.4, to_wall.min(to_circle))
    }

    /// Distances to the two nearest points of the fat lattice, in cells.
    fn two_nearest_fat(&self, at: &Place) -> (f32, f32) {
        let (mut first, mut second) = (9.0_f32, 9.0_f32);
        for row in -1..=1_i32 {
            for column in -1..=1_i32 {
                let bits = self.fat.bits(at.column.wrapping_add(column), at.row.wrapping_add(row));
                let dx = column as f32 + 0.2 + 0.6 * byte(bits, 0) - at.fx;
                let dy = row as f32 + 0.2 + 0.6 * byte(bits, 1) - at.fy;
                let square = dx * dx + dy * dy;
                second = second.min(first.max(square));
                first = first.min(square);
            }
        }
        (first.sqrt(), second.sqrt())
    }

    /// Everything but the nuclei: lumen, lining of the gland, and the fibres outside.
    fn tissue(&self, flat_x: f64, flat_y: f64, ground: &Ground, grain: [f32; 2]) -> Dyes {
        let distance = ground.rim.distance_um;
        let outside = ramp(-1.2, 1.2, distance);
        let mut dyes = Dyes::default();
        if outside > 0.0 {
            dyes.add(stroma(self.fibre(flat_x, flat_y, ground.weave), ground, grain[0]), outside);
        }
        if outside < 1.0 {
            let lumen = 1.0 - ramp(-LINING_UM - 2.5, -LINING_UM + 1.5, distance + 2.2 * grain[1]);
            dyes.add(lining(distance, grain), (1.0 - outside) * (1.0 - lumen));
            dyes.add(Dyes { haematoxylin: 0.03, eosin: 0.06 + 0.02 * grain[0] }, lumen);
        }
        dyes
    }

    /// Density of the fibres at a point, about −1 … 1.
    fn fibre(&self, flat_x: f64, flat_y: f64, weave: f32) -> f32 {
        let mut sum = 0.0;
        for (family, weight) in [(0, 1.0 - weave), (1, weave)] {
            if weight > 0.0 {
                let [ux, uy] = fibre_direction(family).map(f64::from);
                let along = flat_x * ux + flat_y * uy;
                let across = flat_y * ux - flat_x * uy;
                sum += weight * self.fibres[family].slopes(along * (1.0 / 34.0), across * (1.0 / 5.0));
            }
        }
        sum
    }

    fn cover(&self, point_um: [f64; 2], ground: &Ground) -> Cover {
        let mut cover = Cover::default();
        let distance = ground.rim.distance_um;
        if distance < -LINING_UM - NUCLEUS_REACH_UM {
            return cover;
        }
        let crowd_limit = if distance < NUCLEUS_REACH_UM { 1.0 } else { stroma_crowd(ground) };
        let at = self.nuclei.place(point_um[0], point_um[1]).nearest_four();
        for index in 0..4 {
            let (right, below) = (index & 1, index >> 1);
            let bits = self.nuclei.bits(at.column.wrapping_add(right), at.row.wrapping_add(below));
            if byte(bits, 2) < crowd_limit {
                let corner = [right as f32 - at.fx, below as f32 - at.fy];
                add_nucleus(bits, corner, ground, &mut cover);
            }
        }
        cover
    }
}

impl Specimen for Tissue {
    fn rgb(&self, x_um: f64, y_um: f64) -> [f32; 3] {
        self.colour(x_um, y_um, &mut Survey::default())
    }

    fn rgb_of_each(&self, points_um: &[[f64; 2]], colours: &mut [[f32; 3]]) {
        let mut survey = Survey::default();
        for (colour, point) in colours.iter_mut().zip(points_um) {
            *colour = self.colour(point[0], point[1], &mut survey);
        }
    }
}

impl Dyes {
    fn scaled(self, part: f32) -> Self {
        Self { haematoxylin: self.haematoxylin * part, eosin: self.eosin * part }
    }

    fn add(&mut self, other: Self, part: f32) {
        self.haematoxylin += other.haematoxylin * part;
        self.eosin += other.eosin * part;
    }

    /// The light that is left behind both dyes.
    fn light(self) -> [f32; 3] {
        core::array::from_fn(|channel| {
            let loss = self.haematoxylin * HAEMATOXYLIN[channel] + self.eosin * EOSIN[channel];
            GLASS[channel] * fading(loss.max(0.0))
        })
    }
}

/// Connective tissue: wavy pink fibres, with clefts where they part, denser around glands.
fn stroma(fibre: f32, ground: &Ground, grain: f32) -> Dyes {
    let distance = ground.rim.distance_um;
    let dense = ramp(-0.28, 0.34, fibre);
    let cleft = ramp(0.32, 0.54, 0.18 * ground.tint - fibre) * ramp(3.0, 14.0, distance);
    let sheath = 1.0 - ramp(1.0, 5.0, distance);
    let whole = 1.0 - 0.85 * cleft;
    Dyes {
        haematoxylin: whole * (0.05 + 0.05 * dense + 0.08 * ground.inflamed),
        eosin: whole * (0.42 + 0.42 * dense + 0.10 * grain + 0.15 * ground.tint + 0.25 * sheath),
    }
}

/// The cells that line a gland: bluish cytoplasm, paler towards the lumen.
fn lining(distance_um: f32, grain: [f32; 2]) -> Dyes {
    let basal = ramp(-LINING_UM, 0.0, distance_um);
    Dyes { haematoxylin: 0.15 + 0.16 * basal + 0.07 * grain[0], eosin: 0.42 + 0.10 * grain[1] }
}

/// Share of the places between glands that hold a nucleus.
fn stroma_crowd(ground: &Ground) -> f32 {
    0.26 + 0.75 * ground.inflamed
}

/// Adds the nucleus of one cell of the lattice, whose `corner` lies there, in cells from the point.
fn add_nucleus(bits: u32, corner: [f32; 2], ground: &Ground, cover: &mut Cover) {
    let dx = (corner[0] + 0.15 + 0.7 * byte(bits, 0)) * NUCLEUS_PITCH_UM;
    let dy = (corner[1] + 0.15 + 0.7 * byte(bits, 1)) * NUCLEUS_PITCH_UM;
    let square = dx * dx + dy * dy;
    if square > NUCLEUS_REACH_UM * NUCLEUS_REACH_UM {
        return;
    }
    // The gland's edge as the nucleus' own centre sees it: a nucleus is there as a whole or not at all.
    let rim = &ground.rim;
    let depth = rim.distance_um + rim.outward[0] * dx + rim.outward[1] * dy;
    let lining = ramp(-21.0, -15.0, depth) * (1.0 - ramp(-5.0, -1.0, depth));
    let stroma = ramp(1.0, 4.0, depth);
    let crowd = 1.25 * lining + stroma * stroma_crowd(ground);
    let present = ((crowd - byte(bits, 2)) * 4.0).clamp(0.0, 1.0);
    if present <= 0.0 {
        return;
    }
    let size = 0.82 + 0.36 * byte(bits, 3);
    let slender = stroma * (1.0 - ground.inflamed);
    let half_width = size * (2.9 - 1.2 * slender);
    let half_length = size * (2.9 + 1.3 * lining + 1.15 * slender);
    let axis = nucleus_axis(lining, slender, ground);
    let lengthwise = dx * axis[0] + dy * axis[1];
    let (thin, long) = (1.0 / (half_width * half_width), 1.0 / (half_length * half_length));
    let reach = (square * thin - lengthwise * lengthwise * (thin - long)).max(0.0).sqrt();
    let inside_um = (1.0 - reach) * half_width;
    let here = present * ramp(-SOFT_UM, SOFT_UM, inside_um) * (1.0 - cover.nucleus);
    cover.membrane += here * (1.0 - ramp(0.2, 1.2, inside_um));
    cover.nucleus += here;
}

/// Nuclei stand upright in a lining, lie along the fibres between glands, and are round where crowded.
///
/// The length of the axis, at most 1, says how far the nucleus is drawn out along it.
fn nucleus_axis(lining: f32, slender: f32, ground: &Ground) -> [f32; 2] {
    let (a, b) = (fibre_direction(0), fibre_direction(1));
    // An axis longer than 1 would stretch a nucleus without end.
    let upright = ground.rim.outward.map(|slope| slope * (1.0 / 1.2));
    core::array::from_fn(|i| lining * upright[i] + slender * (a[i] + ground.weave * (b[i] - a[i])))
}

/// The two families of fibres: 17° and 107°, as unit vectors.
fn fibre_direction(family: usize) -> [f32; 2] {
    const FAMILIES: [[f32; 2]; 2] = [[0.956_305, 0.292_372], [-0.292_372, 0.956_305]];
    FAMILIES[family & 1]
}

/// Close to exp(−x) for `x` from 0 to 2, and free of the platform's own exponential.
fn fading(x: f32) -> f32 {
    1.0 / (1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0)))))
}
