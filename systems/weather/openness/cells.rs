//! Cells of the grid that surfaces look into: those whose corners pixels interpolate between.

use super::corners::Occluder;
use super::lattice::SPACING;
use glam::{IVec3, Vec3};
use std::collections::BTreeSet;

/// Metres from a surface along its normal at which pixels read openness.
pub const OFFSET: f32 = 1.0;
/// Heights above large level surfaces that things which move on them have, metres.
const ABOVE: [f32; 2] = [2.5, 4.5];
/// Cosine of the slope up to which something drives on a surface.
const LEVEL: f32 = 0.8;
/// Metres between places of a surface: no cell in between is missed by much.
const STEP: f32 = 1.0;

/// Cell of a place.
pub fn cell_of(place: Vec3) -> IVec3 {
    (place / SPACING).floor().as_ivec3()
}

/// Cells that pixels of these surfaces read, and of what moves on them, ascending.
pub fn cells_of(triangles: &[Occluder]) -> Vec<IVec3> {
    let mut cells = BTreeSet::new();
    for triangle in triangles {
        let [a, b, c] = triangle.corners;
        let (u, v) = (b - a, c - a);
        let Some(normal) = u.cross(v).try_normalize() else { continue };
        let offsets = [OFFSET, -OFFSET];
        let sides = &offsets[..if triangle.is_double_sided { 2 } else { 1 }];
        let steps = (u.length().max(v.length()).max((c - b).length()) / STEP).ceil().min(4096.0) as u32;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let (x, y) = (i as f32 / steps.max(1) as f32, j as f32 / steps.max(1) as f32);
                let place = a + u * x + v * y;
                for side in sides {
                    add(&mut cells, place + normal * *side);
                }
                if triangle.is_large && normal.y > LEVEL {
                    ABOVE.iter().for_each(|above| add(&mut cells, place + Vec3::Y * *above));
                }
            }
        }
    }
    cells.into_iter().map(|[y, z, x]| IVec3::new(x, y, z)).collect()
}

fn add(cells: &mut BTreeSet<[i32; 3]>, place: Vec3) {
    let IVec3 { x, y, z } = cell_of(place);
    cells.insert([y, z, x]);
}
