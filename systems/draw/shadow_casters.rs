//! What casts shadows in a world, for renderers: the lights that have some, and the objects that stand in the way of
//! one. Objects are found by the order in which lights are chosen ([`ObjectOrder`]), so that a light costs what it
//! reaches, not what the world holds.

use super::instances::InstanceTable;
use super::list::BatchKey;
use crate::assets::library::Library;
use crate::assets::material::{AlphaMode, MaterialId};
use crate::assets::mesh::MeshId;
use crate::assets::object_bounds::world_bounds;
use crate::lights::components::NoShadow;
use crate::lights::importance::ShadowLights;
use crate::lights::order::ObjectOrder;
use crate::lights::table::LightTable;
use crate::space::bounds::Sphere;
use crate::space::transform::GlobalTransform;
use bevy_ecs::prelude::*;
use glam::Affine3A;

/// Lights and objects of a world as its last frame left them.
#[derive(Clone, Copy)]
pub struct ShadowScene<'w> {
    world: &'w World,
    lights: &'w LightTable,
    order: &'w ObjectOrder,
    instances: &'w InstanceTable,
}

/// An object that casts a shadow.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ShadowCaster {
    /// In the instance table.
    pub slot: u32,
    /// What it is drawn with: opaque, or a mask.
    pub key: BatchKey,
    /// In the material table.
    pub material: u32,
    /// Its place.
    pub world_from_object: Affine3A,
    /// World space.
    pub bounds: Sphere,
}

impl<'w> ShadowScene<'w> {
    /// Of a world that has all of that; `None` for others.
    pub(crate) fn of(world: &'w World) -> Option<Self> {
        Some(Self {
            world,
            lights: world.get_resource()?,
            order: world.get_resource()?,
            instances: world.get_resource()?,
        })
    }

    /// The lights that cast shadows, suns not among them.
    pub fn lights(&self) -> &'w ShadowLights {
        self.lights.shadow_lights()
    }

    /// Lists the objects that the light in a slot reaches and that cast shadows, in the order of their slots.
    pub fn casters(&self, light: u32, library: &Library, casters: &mut Vec<ShadowCaster>) {
        casters.clear();
        let Some(light) = self.lights.scored().get(light as usize) else { return };
        let entities = self.world.entities();
        for object in self.order.reached_by(light) {
            let entity = entities.resolve_from_index(object);
            // What is hidden has no slot.
            let Some(slot) = self.instances.slot(entity) else { continue };
            let key = self.instances.pages.key(slot);
            if key.pipeline.alpha == AlphaMode::Blend {
                continue;
            }
            let Ok(object) = self.world.get_entity(entity) else { continue };
            let parts = object.get_components::<(&GlobalTransform, &MeshId, &MaterialId)>();
            let Ok((place, &mesh, &material)) = parts else { continue };
            let bounds = world_bounds(library, mesh, place);
            if let Some(bounds) = bounds.filter(|_| !object.contains::<NoShadow>()) {
                let material = library.known_material(material).slot();
                casters.push(ShadowCaster { slot, key, material, world_from_object: place.affine(), bounds });
            }
        }
        casters.sort_unstable_by_key(|caster| caster.slot);
    }
}
