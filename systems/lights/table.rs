//! Lights in a table, and what an object knows of its lights.
//!
//! Every entity with a [`Light`](crate::lights::Light) has a slot, with a [`PackedLight`] (what shaders read) and a
//! [`ScoredLight`] (what the search reads); `update_light_table` of `draw` writes both, from the lights that changed.
//! [`crate::lights::select_lights`] then gives objects their [`SelectedLights`](crate::lights::SelectedLights).
//!
//! Relevance is [`score`](crate::lights::score): no point of the object's bounding sphere receives more irradiance
//! (luminance, unshadowed, facing the light) from the light. The three highest scores win; of equal scores, the lower
//! slot. So that nothing pops when the three change, a light's weight is 1 − (s₄/s)⁴, s₄ the fourth highest score: a
//! light comes and goes at weight 0. What the weights leave out goes into an ambient cube of the
//! irradiance at the object's centre: with e the irradiance of a light (luminance) and l the direction to it, dir = Σ e
//! l, sides = Σ e |l| (component by component), and shading adds dot(n², sides + sign(n) · dir) / 2 in the mean colour
//! of what was left out.

use super::importance::{ShadowLight, ShadowLights};
use super::record::{LightRecord, NO_LIGHT, PackedLight};
use super::relevance::ScoredLight;
use super::tree::LightTree;
use crate::ecs::tables::Table;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The slot of a light in the light table; stable while the light lives. Derived.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
#[component(clone_behavior = Ignore)]
pub struct LightSlot(pub u32);

impl Default for LightSlot {
    fn default() -> Self {
        Self(NO_LIGHT)
    }
}

/// Result of the search for an object; it keeps it as [`SelectedLights`](crate::lights::SelectedLights).
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Selection {
    /// Slots in the light table, most relevant first; [`NO_LIGHT`] where there are fewer.
    pub lights: [u32; 3],
    /// Selection weights, 0..1.
    pub weights: [f32; 3],
    /// Irradiance of what the three leave out, linear RGB; a light's ambient counts four times, because shading takes
    /// a quarter of this for every side.
    pub residual_ambient: Vec3,
    /// Its luminance times the direction it comes from (world space), summed.
    pub residual_direction: Vec3,
    /// Its luminance times how much of it comes along each axis, from either side (world space), summed.
    pub residual_sides: Vec3,
    /// Light that the object's lights may miss. For an object with three it is the sum of the others' scores: the loss
    /// with each of the three in full. For one that may have more it is the sum over all scores of the part that their
    /// weights leave out.
    pub dropped: f32,
    /// Number of lights that reach the object (score above 0).
    pub reaching: u32,
}

impl Default for Selection {
    fn default() -> Self {
        Self {
            lights: [NO_LIGHT; 3],
            weights: [0.0; 3],
            residual_ambient: Vec3::ZERO,
            residual_direction: Vec3::ZERO,
            residual_sides: Vec3::ZERO,
            reaching: 0,
            dropped: 0.0,
        }
    }
}

/// Slots of lights, and the lights as the search reads them.
#[derive(Resource, Clone, Debug, Default)]
pub struct LightTable {
    scored: Vec<ScoredLight>,
    /// Given back since the last frame.
    freed: Vec<u32>,
    free: BinaryHeap<Reverse<u32>>,
    /// Lights that changed since the last frame, as they were before and as they are, and their slots.
    changes: Vec<[ScoredLight; 2]>,
    changed: Vec<u32>,
    tree: LightTree,
    shadow_lights: ShadowLights,
}

impl LightTable {
    /// One per slot, [`ScoredLight::OFF`] where the slot is empty or its light off.
    pub fn scored(&self) -> &[ScoredLight] {
        &self.scored
    }

    /// A tree over all of them.
    pub fn tree(&self) -> &LightTree {
        &self.tree
    }

    /// Those of them that cast shadows and are not off.
    pub fn shadow_lights(&self) -> &ShadowLights {
        &self.shadow_lights
    }

    /// The lights that changed in this frame, each as it was before and as it is.
    pub fn changes(&self) -> &[[ScoredLight; 2]] {
        &self.changes
    }

    /// The slots of these, in the same order.
    pub(crate) fn changed(&self) -> &[u32] {
        &self.changed
    }

    /// Forgets what changed in the last frame, and empties the slots of lights that went since then.
    pub(crate) fn begin_frame(&mut self, records: &mut Table<PackedLight>) {
        self.changes.clear();
        self.changed.clear();
        for slot in std::mem::take(&mut self.freed) {
            self.write(records, slot, PackedLight::default());
            self.shadow_lights.give(slot, None);
            self.shadow_lights.give_sun(slot, None);
            self.free.push(Reverse(slot));
        }
    }

    /// The lowest free slot.
    pub(crate) fn claim(&mut self) -> u32 {
        self.free.pop().map_or_else(
            || {
                self.scored.push(ScoredLight::OFF);
                self.scored.len() as u32 - 1
            },
            |Reverse(slot)| slot,
        )
    }

    /// Writes a light into a claimed slot, here and in the records that shaders read. A light that is too dark or too
    /// bright to be computed with once it is packed leaves the slot empty in both.
    pub(crate) fn write(&mut self, records: &mut Table<PackedLight>, slot: u32, light: PackedLight) {
        let new = ScoredLight::new(&light.unpacked());
        let light = if new.kind == LightRecord::OFF { PackedLight::default() } else { light };
        if records.records.get(slot as usize) == Some(&light) {
            return;
        }
        records.write(slot, light);
        if let Some(scored) = self.scored.get_mut(slot as usize) {
            let before = std::mem::replace(scored, new);
            self.changes.push([before, *scored]);
            self.changed.push(slot);
        }
    }

    /// Says whether the light that was last written into a slot casts shadows, and from which distance on (metres).
    pub(crate) fn write_shadow(&mut self, slot: u32, near: Option<f32>) {
        let scored = self.scored.get(slot as usize);
        let casting = near.zip(scored);
        let is_sun = |light: &ScoredLight| light.kind == LightRecord::DIRECTIONAL;
        let sun = casting.filter(|(_, light)| is_sun(light)).map(|(_, light)| light.luminance);
        self.shadow_lights.give_sun(slot, sun);
        self.shadow_lights.give(slot, casting.and_then(|(near, light)| ShadowLight::new(slot, near, light)));
    }

    /// Brings the tree and the lights with shadows up to date with what changed in this frame.
    pub(crate) fn end_frame(&mut self) {
        self.tree.update(&self.scored, &self.changed);
        self.shadow_lights.update();
    }
}

/// Notes the slot of a light that is removed or despawned; the next frame empties it.
pub(crate) fn free_slot(mut world: DeferredWorld, context: HookContext) {
    let Some(mut component) = world.get_mut::<LightSlot>(context.entity) else { return };
    // Reset too: the component stays where only the light is removed, and another light may come.
    let LightSlot(slot) = std::mem::take(&mut *component);
    if slot == NO_LIGHT {
        return;
    }
    // Emptied by the next frame: what is written between frames would not count as changed in any.
    if let Some(mut table) = world.get_resource_mut::<LightTable>() {
        table.freed.push(slot);
    }
}
