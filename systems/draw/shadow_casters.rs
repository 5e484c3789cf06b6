//! Shadow casting in a world, for renderers: the lights that have shadows, and the objects that stand in their way.
//! Objects are found by the order in which lights are chosen ([`ObjectOrder`]). So a light costs what it reaches, not
//! what the world holds. Changed objects are found by their slots, so that a frame costs what moves in it.

use super::instance_records::InstanceSlots;
use super::instances::InstanceTable;
use super::list::BatchKey;
use crate::assets::library::Library;
use crate::assets::material::{AlphaMode, MaterialId};
use crate::assets::mesh::MeshId;
use crate::assets::object_bounds::world_bounds;
use crate::ecs::parallel::map_in_parallel;
use crate::lights::components::NoShadow;
use crate::lights::importance::ShadowLights;
use crate::lights::order::ObjectOrder;
use crate::lights::table::LightTable;
use crate::space::bounds::Sphere;
use crate::space::transform::GlobalTransform;
use bevy_ecs::entity::EntityIndex;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Vec3};

/// Changed objects that a task looks at.
const OBJECTS_PER_TASK: usize = 2048;

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
    /// Pipeline, textures and mesh: opaque, or a mask.
    pub key: BatchKey,
    /// In the material table.
    pub material: u32,
    /// Its place.
    pub world_from_object: Affine3A,
    /// World space.
    pub bounds: Sphere,
}

impl<'w> ShadowScene<'w> {
    /// Borrows the scene of a world that has all of its resources; `None` for others.
    pub(crate) fn of(world: &'w World) -> Option<Self> {
        Some(Self {
            world,
            lights: world.get_resource()?,
            order: world.get_resource()?,
            instances: world.get_resource()?,
        })
    }

    /// The lights that cast shadows.
    pub fn lights(&self) -> &'w ShadowLights {
        self.lights.shadow_lights()
    }

    /// The corners of a box around all objects, world space; `None` where there are none.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.order.bounds()
    }

    /// The objects of some kind that cast shadows, in no particular order. `may_hold` says of a box, by its corners,
    /// whether bounds of that kind may lie in it or stick out of it.
    pub fn casters_within(
        &self,
        library: &Library,
        may_hold: impl Fn(Vec3, Vec3) -> bool,
        is_wanted: impl Fn(Sphere) -> bool,
    ) -> Vec<ShadowCaster> {
        let objects = self.order.within(may_hold, &is_wanted);
        let casters = objects.into_iter().filter_map(|object| self.caster(object, library));
        casters.filter(|caster| is_wanted(caster.bounds)).collect()
    }

    /// Shadow casters in the slots that changed in a frame, by slot, ascending.
    pub fn changed_casters(&self, slots: &InstanceSlots, library: &Library) -> Vec<ShadowCaster> {
        let changed: Vec<u32> = slots.dirty.ranges(0).into_iter().flatten().collect();
        let casters = map_in_parallel(changed.chunks(OBJECTS_PER_TASK), |changed| {
            let objects = changed.iter().filter_map(|&slot| slots.objects[slot as usize]);
            objects.filter_map(|object| self.caster(object, library)).collect::<Vec<_>>()
        });
        casters.concat()
    }

    /// An object, if it casts a shadow.
    fn caster(&self, object: EntityIndex, library: &Library) -> Option<ShadowCaster> {
        let entity = self.world.entities().resolve_from_index(object);
        // What is hidden has no slot.
        let slot = self.instances.slot(entity)?;
        let key = self.instances.pages.key(slot);
        if key.pipeline.alpha == AlphaMode::Blend {
            return None;
        }
        let object = self.world.get_entity(entity).ok().filter(|object| !object.contains::<NoShadow>())?;
        let (place, &mesh, &material) = object.get_components::<(&GlobalTransform, &MeshId, &MaterialId)>().ok()?;
        let bounds = world_bounds(library, mesh, place)?;
        let material = library.known_material(material).slot();
        Some(ShadowCaster { slot, key, material, world_from_object: place.affine(), bounds })
    }
}
