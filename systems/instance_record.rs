//! An object's record from what its components say. Every frame in which an object moves writes its record, uploads it
//! and reads it in every pixel: so what shading needs of the [`Selection`] is packed.
//!
//! ```text
//! lights                 slot · 2¹⁰ + weight · 1023, rounded; of no light all bits of the slot are set
//! remainder              nine numbers, ambient, direction and sides, in 16 bits each: in units of `remainder_unit`,
//!                        of which the largest has 32767, rounded
//! last_side_and_dropped  the last of the nine, and the upper half of the float that is `dropped`: 8 bits of mantissa
//! ```
//!
//! So weights are at most 0.0005 off, remainders a 65,534th of the largest of their numbers, whatever its size.
//! `load_instance` of shaders/types.wgsl undoes it.

use crate::draw_list::InstanceRecord;
use crate::library::MaterialId;
use crate::lights::Selection;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Vec3A};

const WEIGHT_BITS: u32 = 10;
const MOST_UNITS: f32 = 32767.0;
/// Less than this is nothing: its inverse would not be finite.
const LEAST: f32 = 1e-30;

impl InstanceRecord {
    /// The record of an object.
    #[inline]
    pub fn new(entity: Entity, world_from_object: &Affine3A, material: MaterialId, selection: &Selection) -> Self {
        let (m, t) = (world_from_object.matrix3.transpose(), world_from_object.translation);
        let row = |axis: Vec3A, translation: f32| [axis.x, axis.y, axis.z, translation];
        let Selection { lights, weights, remainder_ambient: a, remainder_direction: d, remainder_sides: s, .. } =
            *selection;
        let light = |i: usize| lights[i] << WEIGHT_BITS | whole(weights[i] * ((1 << WEIGHT_BITS) - 1) as f32);
        let numbers = [a.x, a.y, a.z, d.x, d.y, d.z, s.x, s.y, s.z];
        // What is infinite counts as nothing, and leaves the others what they are.
        let largest = numbers.iter().fold(0.0f32, |largest, v| largest.max(v.abs())).min(f32::MAX);
        let units = if largest > LEAST { MOST_UNITS / largest } else { 0.0 };
        let [a, b, c, d, e, f, g, h, last] = numbers.map(|v| whole(v * units));
        let dropped = selection.dropped.to_bits().saturating_add(1 << 15) & 0xffff_0000;
        Self {
            world_from_object: [row(m.x_axis, t.x), row(m.y_axis, t.y), row(m.z_axis, t.z)],
            lights: [light(0), light(1), light(2)],
            material: material.0,
            remainder: [a | b << 16, c | d << 16, e | f << 16, g | h << 16],
            last_side_and_dropped: last | dropped,
            remainder_unit: largest / MOST_UNITS,
            reaching: selection.reaching,
            entity: entity.index_u32(),
        }
    }
}

/// The nearest whole number, 16 bits of it in two's complement. Beside 1.5 · 2²³ no fraction of a float has room, which
/// rounds it; a conversion would take longer.
fn whole(v: f32) -> u32 {
    (v + 12_582_912.0).to_bits() & 0xffff
}
