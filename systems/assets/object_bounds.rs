//! The bounds of objects in world space: those of their meshes, at their places.

use super::library::Library;
use super::mesh::MeshId;
use crate::space::bounds::{Aabb, Sphere};
use crate::space::transform::GlobalTransform;
use bevy_ecs::prelude::*;

/// The sphere around an object of that mesh at that place, world space; `None` while the library has no such mesh. No
/// component keeps it: found anew it costs little, kept it costs memory.
#[inline]
pub fn world_bounds(library: &Library, mesh: MeshId, place: &GlobalTransform) -> Option<Sphere> {
    library.mesh(mesh).map(|entry| entry.bounds.transformed(&place.affine()))
}

/// The axis-aligned box around an object of that mesh at that place, world space; `None` while the library has no such
/// mesh.
#[inline]
pub fn world_box(library: &Library, mesh: MeshId, place: &GlobalTransform) -> Option<Aabb> {
    library.mesh(mesh).map(|entry| entry.aabb.transformed(&place.affine()))
}

/// The sphere around an entity that has a mesh, world space, at its place of the last frame; `None` for others.
pub fn bounds_of(world: &World, entity: Entity) -> Option<Sphere> {
    let (&mesh, place) = (world.get::<MeshId>(entity)?, world.get::<GlobalTransform>(entity)?);
    world_bounds(world.get_resource::<Library>()?, mesh, place)
}

/// Those of all objects with a mesh, in no order.
pub fn all_bounds(world: &mut World) -> Vec<Sphere> {
    let mut objects = world.query::<(&MeshId, &GlobalTransform)>();
    let library = world.resource::<Library>();
    objects.iter(world).filter_map(|(&mesh, place)| world_bounds(library, mesh, place)).collect()
}
