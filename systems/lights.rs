//! Lights in a table, the policy, and what an object knows of its lights.
//!
//! [`update_light_table`] gives every [`Light`] entity a slot and writes its [`LightRecord`] (what shaders read) and
//! its
//! [`ScoredLight`] (what the search reads). [`crate::light_selection`] then gives objects their
//! [`SelectedLights`](crate::selected_lights::SelectedLights).
//!
//! Relevance is [`score`]: no point of the object's bounding sphere receives more irradiance (luminance, unshadowed,
//! facing the light) from the light. The three highest scores win; of equal scores, the lower slot. So that nothing
//! pops when the three change, a light's weight is 1 − (s₄/s)⁴, s₄ the fourth highest score: a light comes and goes at
//! weight 0. What the weights leave out goes into the remainder, an ambient cube of the irradiance at the object's
//! centre: with e the irradiance of a light (luminance) and l the direction to it, dir = Σ e l, sides = Σ e |l|
//! (component by component), and shading adds dot(n², sides + sign(n) · dir) / 2 in the mean colour of what was left
//! out.

use crate::changes::for_each_changed_in;
use crate::components::{Light, LightKind};
use crate::draw_list::DrawList;
use crate::light_tree::LightTree;
use crate::records::{LightRecord, NO_LIGHT};
pub use crate::relevance::{ScoredLight, irradiance, light_record, score};
use crate::tables::Table;
use crate::transform::GlobalTransform;
use bevy_ecs::change_detection::ContiguousRef;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Whether shading uses the three selected lights or all of them.
#[derive(Resource, Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum LightPolicy {
    /// Three lights with smooth weights, the rest in the remainder.
    #[default]
    Three,
    /// Three lights at full weight and nothing else: lights pop. To compare with.
    Hard,
    /// Every light that reaches the object: what the others are measured against. The selection is that of `Three`.
    All,
}

impl LightPolicy {
    /// All policies with the names that the command line uses.
    pub const ALL: [(&'static str, Self); 3] = [("three", Self::Three), ("hard", Self::Hard), ("all", Self::All)];
}

/// The slot of a light in the light table; stable while the light lives. Derived.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
#[component(clone_behavior = Ignore)]
pub struct LightSlot(pub u32);

impl Default for LightSlot {
    fn default() -> Self {
        Self(NO_LIGHT)
    }
}

/// What the search finds for an object; [`SelectedLights`](crate::selected_lights::SelectedLights) is what it keeps.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Selection {
    /// Slots in the light table, most relevant first; [`NO_LIGHT`] where there are fewer.
    pub lights: [u32; 3],
    /// Selection weights, 0..1.
    pub weights: [f32; 3],
    /// Irradiance of what the three leave out, linear RGB; a light's ambient counts four times, because shading takes
    /// a quarter of this for every side.
    pub remainder_ambient: Vec3,
    /// Its luminance times the direction it comes from (world space), summed.
    pub remainder_direction: Vec3,
    /// Its luminance times how much of it comes along each axis, from either side (world space), summed.
    pub remainder_sides: Vec3,
    /// Sum of the scores of the lights that are not among the three: what the object's three, each in full, may miss.
    pub dropped: f32,
    /// How many lights reach the object (score above 0).
    pub reaching: u32,
}

impl Default for Selection {
    fn default() -> Self {
        Self {
            lights: [NO_LIGHT; 3],
            weights: [0.0; 3],
            remainder_ambient: Vec3::ZERO,
            remainder_direction: Vec3::ZERO,
            remainder_sides: Vec3::ZERO,
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

    /// The lights that changed in this frame, each as it was before and as it is.
    pub fn changes(&self) -> &[[ScoredLight; 2]] {
        &self.changes
    }

    /// The lowest free slot.
    fn claim(&mut self) -> u32 {
        self.free.pop().map_or_else(
            || {
                self.scored.push(ScoredLight::OFF);
                self.scored.len() as u32 - 1
            },
            |Reverse(slot)| slot,
        )
    }

    /// Writes a light into a claimed slot, here and in the draw list.
    fn write(&mut self, records: &mut Table<LightRecord>, slot: u32, record: LightRecord) {
        if records.records.get(slot as usize) == Some(&record) {
            return;
        }
        records.write(slot, record);
        if let Some(scored) = self.scored.get_mut(slot as usize) {
            let before = std::mem::replace(scored, ScoredLight::new(&record));
            self.changes.push([before, *scored]);
            self.changed.push(slot);
        }
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

/// Writes the lights that changed or moved into the table, in slots that are theirs while they live.
#[allow(clippy::type_complexity)]
pub fn update_light_table(
    mut table: ResMut<LightTable>,
    mut draw_list: ResMut<DrawList>,
    mut lights: ParamSet<(Query<(Entity, Ref<Light>, Ref<GlobalTransform>, &LightSlot)>, Query<&mut LightSlot>)>,
) {
    let table = &mut *table;
    table.changes.clear();
    table.changed.clear();
    for slot in std::mem::take(&mut table.freed) {
        table.write(&mut draw_list.lights, slot, LightRecord { kind: LightRecord::OFF, ..LightRecord::default() });
        table.free.push(Reverse(slot));
    }
    let mut new = Vec::new();
    let all = lights.p0();
    for (entities, lights, transforms, slots) in all.contiguous_iter().into_iter().flatten() {
        let ((lights, settings), (transforms, places)) =
            (ContiguousRef::split(lights), ContiguousRef::split(transforms));
        for_each_changed_in([Some(&settings), Some(&places)], |row| {
            let mut slot = slots[row];
            if slot.0 == NO_LIGHT {
                slot.0 = table.claim();
                new.push((entities[row], slot));
            }
            let light = &lights[row];
            let attenuated = light.kind != LightKind::Directional;
            draw_list.light_traits.attenuation |= attenuated && light.attenuation != Light::INVERSE_SQUARE;
            draw_list.light_traits.cones |= matches!(light.kind, LightKind::Spot { .. });
            draw_list.light_traits.ambient |= light.ambient != Vec3::ZERO;
            table.write(&mut draw_list.lights, slot.0, light_record(light, &transforms[row]));
        });
    }
    let mut slots = lights.p1();
    for (entity, slot) in new {
        if let Ok(mut component) = slots.get_mut(entity) {
            *component = slot;
        }
    }
    table.tree.update(&table.scored, &table.changed);
}
