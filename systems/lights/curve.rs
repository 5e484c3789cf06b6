//! Hilbert curves through the spheres of objects: neighbours on the curve are neighbours in space.

use super::tree::WIDTH;
use crate::ecs::parallel::on_pool;
use crate::space::bounds::{Sphere, around};
use bevy_tasks::TaskPool;
use glam::Vec3;

/// Spheres per task.
const PART: usize = 1 << 14;

/// The spheres in the order of their places on a Hilbert curve.
pub fn along_the_curve(spheres: &[Sphere]) -> Vec<Sphere> {
    let pool = bevy_tasks::TaskPoolBuilder::new().num_threads(1).build();
    let mut order: Vec<(u32, u32)> = hilbert_keys(&pool, spheres).into_iter().zip(0..).collect();
    radsort::sort_by_key(&mut order, |&(key, _)| key);
    order.into_iter().map(|(_, index)| spheres[index as usize]).collect()
}

/// Positions of spheres on a Hilbert curve through the box around all.
pub(crate) fn hilbert_keys(pool: &TaskPool, spheres: &[Sphere]) -> Vec<u32> {
    let (min, max, _) = around(spheres).unwrap_or_default();
    let extent = (max - min).max(Vec3::splat(1e-3));
    let (thin, height) = (extent.min_position(), extent.min_element());
    // A world that is no higher than a group of objects is wide has a curve of its own in the plane: those of three
    // dimensions jump about where they are cut.
    let area = extent.element_product() / height;
    let is_flat = height * height * spheres.len() as f32 <= area * WIDTH as f32;
    // Cells are squares or cubes.
    let top = if is_flat { u16::MAX.into() } else { (1 << 10) - 1 };
    let scale = top as f32 / extent.max_element();
    let cell = |v: f32| ((v * scale).max(0.0) as u32).min(top);
    let key = |sphere: &Sphere| {
        let [x, y, z] = (sphere.center - min).to_array().map(cell);
        match thin {
            _ if !is_flat => hilbert([x, y, z]),
            0 => hilbert([y, z]),
            1 => hilbert([x, z]),
            _ => hilbert([x, y]),
        }
    };
    let mut keys = vec![0; spheres.len()];
    let parts = spheres.chunks(PART).zip(keys.chunks_mut(PART));
    on_pool(pool, parts, |(spheres, keys)| {
        keys.iter_mut().zip(spheres).for_each(|(place, sphere)| *place = key(sphere))
    });
    keys
}

/// Index of a cell on the Hilbert curve of so many dimensions, with as many bits per axis as fit (J. Skilling:
/// "Programming the Hilbert curve", AIP Conference Proceedings 707, 2004): coordinates to the transposed index in
/// place, then its bits interleaved.
fn hilbert<const AXES: usize>(mut x: [u32; AXES]) -> u32 {
    let bits = u32::BITS / AXES as u32;
    let mut bit = 1 << (bits - 1);
    while bit > 1 {
        for i in 0..AXES {
            if x[i] & bit != 0 {
                x[0] ^= bit - 1;
            } else {
                let swapped = (x[0] ^ x[i]) & (bit - 1);
                x[0] ^= swapped;
                x[i] ^= swapped;
            }
        }
        bit >>= 1;
    }
    for i in 1..AXES {
        x[i] ^= x[i - 1];
    }
    let mut turn = 0;
    let mut bit = 1 << (bits - 1);
    while bit > 1 {
        if x[AXES - 1] & bit != 0 {
            turn ^= bit - 1;
        }
        bit >>= 1;
    }
    let bits = (0..bits).rev().flat_map(|k| x.map(|axis| (axis ^ turn) >> k & 1));
    bits.fold(0, |index, bit| index << 1 | bit)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first cells of a curve: a block at the origin, so many cells wide.
    fn follow<const AXES: usize>(width: u32) {
        let mut cells: Vec<(u32, [u32; AXES])> = Vec::new();
        for mut i in 0..width.pow(AXES as u32) {
            let cell = std::array::from_fn(|_| (i % width, i /= width).0);
            cells.push((hilbert(cell), cell));
        }
        cells.sort_unstable();
        for pair in cells.windows(2) {
            let step: u32 = (0..AXES).map(|axis| pair[0].1[axis].abs_diff(pair[1].1[axis])).sum();
            assert_eq!((pair[1].0 - pair[0].0, step), (1, 1), "{pair:?}");
        }
    }

    #[test]
    fn the_curve_goes_from_cell_to_neighbouring_cell() {
        follow::<2>(64);
        follow::<3>(16);
    }
}
