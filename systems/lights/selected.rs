//! Packed [`Selection`] of an object, in the words that its record takes over. Every frame in which an object moves
//! writes them, uploads them and reads them in every pixel.
//!
//! ```text
//! lights                 slot · 2¹⁰ + weight · 1023, rounded; of no light all bits of the slot are set
//! residual              nine numbers, ambient, direction and sides, in 16 bits each: in units of `residual_unit`,
//!                        of which the largest has 32767, rounded
//! last_side_and_dropped  the last of the nine, and the upper half of the float that is `dropped`: 8 bits of mantissa
//! reaching_or_list       how many lights reach the object; with the highest bit set, the first page of its list
//! ```
//!
//! So weights are at most 0.0005 off, residuals a 65,534th of the largest of their numbers, whatever its size.
//! [`SelectedLights::unpack`] undoes it, and for shaders `load_instance` of shaders/types.wgsl.

use super::lists::LightLists;
use super::record::NO_LIGHT;
use super::table::Selection;
use bevy_ecs::prelude::*;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

pub(crate) const WEIGHT_BITS: u32 = 10;
pub(crate) const MOST_WEIGHT: f32 = ((1 << WEIGHT_BITS) - 1) as f32;
pub(crate) const MOST_UNITS: f32 = 32767.0;
/// Less than this is nothing: its inverse would not be finite.
pub(crate) const LEAST: f32 = 1e-30;
/// 1.5 · 2²³: beside it no fraction of a float has room, which rounds it. A conversion would take longer.
pub(crate) const ROUNDER: f32 = 12_582_912.0;

/// The lights of an object. Derived; written by [`crate::lights::select_lights`]. The fields are those of
/// [`crate::draw::InstanceRecord`].
#[derive(Component, Clone, Copy, Debug, Pod, Zeroable)]
#[component(summary_tick)]
#[repr(C)]
pub struct SelectedLights {
    pub(crate) lights: [u32; 3],
    pub(crate) residual: [u32; 4],
    pub(crate) last_side_and_dropped: u32,
    pub(crate) residual_unit: f32,
    pub(crate) reaching_or_list: u32,
}

/// By their bits.
impl PartialEq for SelectedLights {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        let (a, b): (&[u32; 10], &[u32; 10]) = (bytemuck::cast_ref(self), bytemuck::cast_ref(other));
        a.iter().zip(b).fold(0, |bits, (a, b)| bits | (a ^ b)) == 0
    }
}

impl Default for SelectedLights {
    fn default() -> Self {
        Self::pack(&Selection::default())
    }
}

impl SelectedLights {
    /// Packs.
    #[inline]
    pub fn pack(selection: &Selection) -> Self {
        let Selection { lights, weights, residual_ambient: a, residual_direction: d, residual_sides: s, .. } =
            *selection;
        let light = |i: usize| pack_light(lights[i], weights[i]);
        let numbers = [a.x, a.y, a.z, d.x, d.y, d.z, s.x, s.y, s.z];
        // What is infinite counts as nothing.
        let largest = numbers.iter().fold(0.0f32, |largest, v| largest.max(v.abs())).min(f32::MAX);
        let units = if largest > LEAST { MOST_UNITS / largest } else { 0.0 };
        let [a, b, c, d, e, f, g, h, last] = numbers.map(|v| whole(v * units));
        let dropped = selection.dropped.to_bits().wrapping_add(1 << 15) & 0xffff_0000;
        Self {
            lights: [light(0), light(1), light(2)],
            residual: [a | b << 16, c | d << 16, e | f << 16, g | h << 16],
            last_side_and_dropped: last | dropped,
            residual_unit: largest / MOST_UNITS,
            reaching_or_list: selection.reaching,
        }
    }

    /// Unpacks the selection, as precise as its bits; the lights beyond the three are in the lists.
    pub fn unpack(&self, lists: &LightLists) -> Selection {
        let lights = self.lights.map(unpack_light);
        let numbers: [f32; 9] = std::array::from_fn(|i| {
            let word = self.residual.get(i / 2).copied().unwrap_or(self.last_side_and_dropped);
            f32::from((word >> (i % 2 * 16)) as u16 as i16) * self.residual_unit
        });
        Selection {
            lights: lights.map(|(slot, _)| slot),
            weights: lights.map(|(_, weight)| weight),
            residual_ambient: Vec3::from_slice(&numbers[0..]),
            residual_direction: Vec3::from_slice(&numbers[3..]),
            residual_sides: Vec3::from_slice(&numbers[6..]),
            dropped: f32::from_bits(self.last_side_and_dropped & 0xffff_0000),
            reaching: lists.of(self).1,
        }
    }
}

/// A slot and its weight in a word.
pub(crate) fn pack_light(slot: u32, weight: f32) -> u32 {
    slot << WEIGHT_BITS | whole(weight * MOST_WEIGHT)
}

/// Slot and weight of a word; [`NO_LIGHT`] where there is none.
pub(crate) fn unpack_light(light: u32) -> (u32, f32) {
    let all = u32::MAX >> WEIGHT_BITS;
    let slot = if light >> WEIGHT_BITS == all { NO_LIGHT } else { light >> WEIGHT_BITS };
    (slot, (light & ((1 << WEIGHT_BITS) - 1)) as f32 / MOST_WEIGHT)
}

/// The nearest whole number, 16 bits of it in two's complement.
fn whole(v: f32) -> u32 {
    (v + ROUNDER).to_bits() & 0xffff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_those_of_the_table_above_and_come_out_again() {
        let selection = Selection {
            lights: [7, 0, NO_LIGHT],
            weights: [1.0, 0.25, 0.0],
            residual_ambient: Vec3::new(0.25, 0.0, 0.5),
            residual_direction: Vec3::new(-0.5, 0.0, -0.0),
            residual_sides: Vec3::new(0.5, 0.0, 0.5),
            dropped: 0.75,
            reaching: 100_000,
        };
        let packed = SelectedLights::pack(&selection);
        // 0.25 · 1023 is 255.75; half of 32767, 16383.5, goes to the even number.
        assert_eq!(packed.lights, [7 << 10 | 1023, 256, u32::MAX << 10]);
        assert_eq!(packed.residual, [0x4000, 0x8001_7fff, 0, 0x7fff]);
        assert_eq!((packed.last_side_and_dropped, packed.reaching_or_list), (0x3f40_7fff, 100_000));
        assert_eq!(packed.residual_unit, 0.5 / 32767.0);
        let found = packed.unpack(&LightLists::default());
        assert_eq!((found.lights, found.reaching, found.dropped), ([7, 0, NO_LIGHT], 100_000, 0.75));
        assert_eq!(found.weights, [1.0, 256.0 / 1023.0, 0.0]);
        // Half a step of 0.5 / 32767 is 0.8e-5.
        assert!(found.residual_ambient.abs_diff_eq(Vec3::new(0.25, 0.0, 0.5), 1e-5));
        assert!(found.residual_direction.abs_diff_eq(Vec3::new(-0.5, 0.0, 0.0), 1e-5));
        assert!(found.residual_sides.abs_diff_eq(Vec3::new(0.5, 0.0, 0.5), 1e-5));
        assert_eq!(SelectedLights::default().unpack(&LightLists::default()), Selection::default());
    }
}
