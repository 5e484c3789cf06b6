//! Convex bodies of what may touch and be touched.

use super::place;
use bevy_ecs::prelude::*;
use systems::assets::{Library, MeshId};
use systems::draw::pieces::{PieceOf, WholeMesh};
use systems::sensors::collision::Convex;
use systems::vehicles::{Vehicle, VehicleTypes};

/// Metres above the ground, but at most half a vehicle's height: what is lower is driven over.
const CLEARANCE: f32 = 0.2;

/// The bodies of a vehicle, or of anything else.
pub(super) fn solid(world: &World, entity: Entity) -> Vec<Convex> {
    let Some(vehicle) = world.get::<Vehicle>(entity) else { return boxes(world, entity) };
    let kind = world.resource::<VehicleTypes>().get(vehicle.kind);
    let mut bounds = kind.bounds();
    bounds.min.y = CLEARANCE.min(0.5 * bounds.max.y);
    vec![Convex::of_box(&place::place(world, entity), bounds.min.as_dvec3(), bounds.max.as_dvec3())]
}

/// An entity and all below it, with their meshes.
pub(super) fn meshes(world: &World, root: Entity) -> Vec<(Entity, MeshId)> {
    let (mut open, mut found) = (vec![root], Vec::new());
    while let Some(entity) = open.pop() {
        if world.get::<PieceOf>(entity).is_some() {
            continue;
        }
        let whole = world.get::<WholeMesh>(entity).map(|whole| whole.mesh);
        found.extend(whole.or(world.get::<MeshId>(entity).copied()).map(|mesh| (entity, mesh)));
        open.extend(world.get::<Children>(entity).into_iter().flat_map(|children| children.iter()));
    }
    found
}

/// The boxes around the meshes of an entity and all below it.
fn boxes(world: &World, root: Entity) -> Vec<Convex> {
    let library = world.resource::<Library>();
    let of_mesh = |(entity, mesh)| {
        let aabb = library.mesh(mesh)?.aabb;
        Some(Convex::of_box(&place::place(world, entity), aabb.min.as_dvec3(), aabb.max.as_dvec3()))
    };
    meshes(world, root).into_iter().filter_map(of_mesh).collect()
}
